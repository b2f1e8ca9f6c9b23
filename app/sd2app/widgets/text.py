"""Durations, times, errors, keys and command lines as texts."""

from __future__ import annotations

import functools
import shlex
import subprocess
import sys
import time

from PySide6.QtGui import QKeySequence

from sd2core.files.tables import bytes_text as bytes_text
from sd2core.files.tables import counted as counted


def duration_text(seconds: float) -> str:
    """Duration, rounded as an estimate."""
    if seconds < 10:
        return "a few seconds"
    if seconds < 57.5:
        return f"{5 * round(seconds / 5)} s"
    if seconds < 3570:
        return f"{max(round(seconds / 60), 1)} min"
    hours, minutes = divmod(round(seconds / 60), 60)
    if hours < 10:
        return f"{hours} h {minutes} min" if minutes else f"{hours} h"
    if hours < 48:
        return f"{round(seconds / 3600)} h"
    return f"{seconds / 86400:.1f} days"


def about(seconds: float) -> str:
    """A duration, called an estimate."""
    text = duration_text(seconds)
    return text if text.startswith("a ") else f"about {text}"


def exact_text(seconds: float) -> str:
    """Elapsed time."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"


def clock_text(unix_s: float) -> str:
    """Date and time, without the date when it is today's."""
    then, now = time.localtime(unix_s), time.localtime()
    if then[:3] == now[:3]:
        return time.strftime("%H:%M", then)
    return time.strftime("%Y-%m-%d %H:%M", then)


def error_text(value: float) -> str:
    """An error with three digits."""
    return f"{value:.3g}" if value < 1000 else f"{value:.0f}"


def number(value: float) -> str:
    """Two significant digits, but every digit before the point."""
    return f"{value:.0f}" if abs(value) >= 10 else f"{value:.2g}" if abs(value) >= 1e-3 else "0"


def milliseconds(value_ms: float) -> str:
    """A cost with its unit."""
    return f"{number(value_ms)} ms" if value_ms >= 1e-3 or value_ms == 0 else "<0.001 ms"


def seconds(value_s: float) -> str:
    """Duration in seconds or milliseconds."""
    return milliseconds(1e3 * value_s) if value_s < 1 else f"{number(value_s)} s"


def canonical(key: str) -> str:
    """A key as Qt writes it, the same on every machine; empty where it is none."""
    sequence = QKeySequence(key)
    one = sequence.count() == 1
    return sequence.toString(QKeySequence.SequenceFormat.PortableText) if one else ""


@functools.lru_cache
def native(key: str) -> str:
    """A key as it is written on this machine."""
    return QKeySequence(key).toString(QKeySequence.SequenceFormat.NativeText)


def quoted(arguments: list[str]) -> str:
    """Command line for a terminal."""
    words = ["sd2", *arguments]
    return subprocess.list2cmdline(words) if sys.platform == "win32" else shlex.join(words)
