"""On how many threads torch works."""

from __future__ import annotations

import torch


def use_one_thread() -> None:
    """Leave the other cores to other processes, which work beside this one."""
    torch.set_num_threads(1)
