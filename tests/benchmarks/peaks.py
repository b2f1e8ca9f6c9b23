"""The most memory that this process had."""

from __future__ import annotations

from pathlib import Path


def peak_mb() -> float:
    """Since the process began, or since :func:`forget_peak`.

    Not by ``getrusage``: its peak begins with that of the process which started this one.
    """
    status = Path("/proc/self/status").read_text(encoding="ascii")
    return int(status.split("VmHWM:")[1].split()[0]) / 1024


def forget_peak() -> None:
    """From now on the peak is that of what comes."""
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
