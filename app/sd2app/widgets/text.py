"""Durations, times and errors as texts."""

from __future__ import annotations

import time


def duration_text(seconds: float) -> str:
    """Rounded as an estimate deserves."""
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
    """Time that has passed."""
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
