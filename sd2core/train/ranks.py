"""Several processes that train one model, each with its share of every batch."""

from __future__ import annotations

import multiprocessing.connection
import os
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from torch import nn
from torch.nn.parallel import DistributedDataParallel

_LAST_WORDS_S = 10.0
"""Time in which a process may still say why it fails, when another one has failed."""


@dataclass(frozen=True)
class Ranks:
    """Place of a process among all that train one model; by default it is the only one."""

    rank: int = 0
    count: int = 1

    @property
    def leads(self) -> bool:
        """True in the one that writes files."""
        return self.rank == 0

    def agreed(self, *values: Any) -> tuple[Any, ...]:
        """Values of the first process in all processes; else they would wait for each other."""
        if self.count == 1:
            return values
        shared = [*values]
        torch.distributed.broadcast_object_list(shared)
        return tuple(shared)

    def together(self, module: nn.Module, device: torch.device) -> nn.Module:
        """Module whose gradients are those of all processes' shares together."""
        if self.count == 1:
            return module
        ids = [device.index] if device.type == "cuda" else None
        return DistributedDataParallel(module, device_ids=ids, forward_sync_buffers=False)


@contextmanager
def joined(ranks: Ranks, meeting: Path, device: torch.device) -> Iterator[None]:
    """Group of all processes that meet at this file."""
    backend = "nccl" if device.type == "cuda" else "gloo"
    torch.distributed.init_process_group(
        backend, init_method=meeting.as_uri(), rank=ranks.rank, world_size=ranks.count
    )
    try:
        yield
    finally:
        torch.distributed.destroy_process_group()


@contextmanager
def others(count: int, work: Callable[..., None], *arguments: Any) -> Iterator[Path]:
    """Processes beside this one, each of which does ``work(*arguments, rank, meeting)``.

    They end with this process, and this one with any of them that fails. Yields the file at
    which all meet.
    """
    context = multiprocessing.get_context("spawn")
    over = threading.Event()
    with tempfile.TemporaryDirectory() as folder:
        meeting = Path(folder).absolute() / "meeting"
        started = [
            context.Process(target=work, args=(*arguments, rank, meeting), daemon=True)
            for rank in range(1, count)
        ]
        for one in started:
            one.start()

        def watch() -> None:
            left: dict[Any, Any] = {one.sentinel: one for one in started}
            while left:
                for ended in multiprocessing.connection.wait(list(left)):
                    if left.pop(ended).exitcode and not over.wait(_LAST_WORDS_S):
                        os._exit(1)

        threading.Thread(target=watch, name="sd2-ranks", daemon=True).start()
        try:
            yield meeting
        except BaseException:
            over.set()
            for one in started:
                one.kill()
            raise
        for one in started:
            one.join()
        over.set()
