"""How long steps take on this machine, from the batches it has done."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from sd2core.atomic import atomic_write_text
from sd2core.batch.plan import Step

_FEWEST = {"fit": 100, "export": 1}
"""Frames, or sources, from which a rate is worth keeping."""


def known_rates() -> dict[str, float]:
    """Seconds per frame of ``fit``, and per source of ``export``, as far as they are known."""
    try:
        content: dict[str, Any] = json.loads(_place().read_text(encoding="utf-8"))
        return {step: float(content[step]) for step in _FEWEST if step in content}
    except (OSError, ValueError, TypeError, AttributeError):
        return {}


def remember_rate(step: Step, seconds: float, count: int) -> None:
    """Keep how long a step took; where nothing can be written it is not kept.

    Parameters
    ----------
    step : Step
        ``fit`` or ``export``; the others are measured when they are asked for.
    seconds : float
    count : int
        Frames, or sources.
    """
    if step not in _FEWEST or count < _FEWEST[step]:
        return
    try:
        _place().parent.mkdir(parents=True, exist_ok=True)
        atomic_write_text(_place(), json.dumps(known_rates() | {step: seconds / count}) + "\n")
    except OSError:
        return


def _place() -> Path:
    import platformdirs

    return Path(platformdirs.user_cache_dir("sd2-studio", appauthor=False)) / "batch-rates.json"
