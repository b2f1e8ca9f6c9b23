"""How long fitting takes on this machine, from what was fitted on it."""

from __future__ import annotations

import json
from pathlib import Path

from sd2core.body.model import Resolution
from sd2core.files.atomic import atomic_write_text

_FEWEST_FRAMES = 100
"""From which a rate is worth keeping."""


def known_fit_rate(resolution: Resolution) -> float | None:
    """Processor seconds per frame of the last fit, by `sd2 fit` or a batch, if there was one."""
    return _known().get(resolution)


def remember_fit_rate(resolution: Resolution, seconds: float, frames: int) -> None:
    """Keep how long a fit took; where nothing can be written it is not kept.

    Parameters
    ----------
    resolution : {"low", "medium", "high"}
    seconds : float
        Of one core.
    frames : int
    """
    if frames < _FEWEST_FRAMES:
        return
    try:
        _place().parent.mkdir(parents=True, exist_ok=True)
        atomic_write_text(_place(), json.dumps(_known() | {resolution: seconds / frames}) + "\n")
    except OSError:
        return


def _known() -> dict[str, float]:
    try:
        content = json.loads(_place().read_text(encoding="utf-8"))
        return {str(name): float(rate) for name, rate in content.items()}
    except (OSError, ValueError, TypeError, AttributeError):
        return {}


def _place() -> Path:
    import platformdirs

    return Path(platformdirs.user_cache_dir("sd2-studio", appauthor=False)) / "fit-rates.json"
