"""Sentences about a radar that is listened to."""

from __future__ import annotations

from sd2app.live.model import LiveModel
from sd2core.files.tables import counted
from sd2core.live.counts import Counts


def title_text(live: LiveModel) -> str:
    """What is going on, with the recording's name."""
    assert live.request is not None
    name = live.request.folder.name
    match live.state:
        case "opening":
            return f"Opening {name}…"
        case "starting":
            return f"Beginning to record {name}…"
        case "running" if not live.counts.recorded:
            return "Waiting for the first frame…"
        case "running":
            return f"Recording {name}"
        case "stopping":
            return f"Storing what was received in {name}…"
        case "failed":
            return "Recording has failed"
        case _:
            return f"{name} is recorded"


def frames_text(counts: Counts, pictures: int = 0, pictures_dropped: int = 0) -> str:
    """Number of frames, and what they lack, in words."""
    if not counts.recorded:
        return ""
    filmed = f"{counted(pictures, 'picture')}, " if pictures else ""
    if pictures_dropped:
        filmed = f"{pictures:,} of {counted(pictures + pictures_dropped, 'picture')}, "
    lacks = [
        (counts.dropped, "dropped (this computer was too slow)"),
        (counts.lost, "lost on the way"),
        (counts.damaged, "with lost packets"),
        (counts.not_shown, "stored and not shown yet"),
    ]
    missing = [f"{number:,} {what}" for number, what in lacks if number]
    return f"{filmed}{counts.frames}, {', '.join(missing) or 'none missing'}"


def level_text(level_db: float | None) -> str:
    """Power of the newest column of the map."""
    return "" if level_db is None else f"level {level_db:.1f} dB".replace("-", "−")


def latency_text(latency_s: float | None) -> str:
    """How long a frame takes from its reception to the screen."""
    return "" if latency_s is None else f"on screen {1e3 * latency_s:.0f} ms after it was received"
