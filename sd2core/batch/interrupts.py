"""Loaded by the processes of a local batch: Ctrl-C is the business of who started them."""

from __future__ import annotations

import signal
from typing import Any


def dask_setup(worker: Any) -> None:
    """Dask calls it when a worker begins; the terminal tells all its processes of Ctrl-C."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
