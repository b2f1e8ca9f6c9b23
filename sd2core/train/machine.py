"""Device, precision, threads and priority of a run."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Literal

import torch

from sd2core.errors import Sd2Error
from sd2core.options.training import MachineConfig
from sd2core.processes import processor_name

Device = Literal["cpu", "cuda"]


def device_of(machine: MachineConfig) -> Device:
    """Device to compute on. Raises Sd2Error if a GPU is asked for and there are too few."""
    gpus = torch.cuda.device_count() if torch.cuda.is_available() else 0
    if machine.device == "cpu" or (machine.device == "auto" and not gpus):
        return "cpu"
    if gpus < machine.devices:
        raise Sd2Error(
            f"machine.device is {machine.device!r} with {machine.devices} devices, and torch"
            f" {torch.__version__} finds {gpus} GPUs",
            "as many as are asked for",
            "Leave it to the program (--device auto), or train on the CPU (--device cpu)",
        )
    return "cuda"


def precision_of(machine: MachineConfig, device: Device) -> Literal["32-true", "bf16-mixed"]:
    """Precision of matrix products; state-space kernels use float32 or better in any case.

    Half precision (fp16) is not offered: it needs its losses scaled by a factor that
    would have to be kept with every checkpoint, and what has no bf16 is no faster with it
    at these sizes.
    """
    if machine.precision == "bf16":
        return "bf16-mixed"
    if machine.precision == "auto" and device == "cuda" and torch.cuda.is_bf16_supported():
        return "bf16-mixed"
    return "32-true"


@contextmanager
def settled(machine: MachineConfig, threads: int) -> Iterator[None]:
    """Threads and determinism for the time of a run."""
    before_threads = torch.get_num_threads()
    before_strict = torch.are_deterministic_algorithms_enabled()
    before_warn = torch.is_deterministic_algorithms_warn_only_enabled()
    before_rng = torch.get_rng_state()
    keep_freed_memory()
    try:
        torch.set_num_threads(threads)
        if machine.deterministic:
            # Read by cuBLAS when it starts; it has no other switch.
            os.environ.setdefault("CUBLAS_WORKSPACE_CONFIG", ":4096:8")
            torch.use_deterministic_algorithms(True)
        yield
    finally:
        torch.use_deterministic_algorithms(before_strict, warn_only=before_warn)
        torch.set_num_threads(before_threads)
        torch.set_rng_state(before_rng)


def keep_freed_memory() -> None:
    """Have the C library keep what a training step frees, for the next step to use.

    Linux's (glibc) hands memory back above a limit that follows the largest block freed so far, and
    the next step then fetches it again page by page. The limit follows up to blocks of 32 MiB, so
    one of nearly that size is freed here. Elsewhere this does nothing.
    """
    torch.empty(2**25 - 2**16, dtype=torch.uint8)


def machine_words(device: Device, precision: str, threads: int) -> dict[str, Any]:
    """Description of the machine that a model was trained on, for its card."""
    here = f"{processor_name()}, {os.cpu_count()} cores"
    name = torch.cuda.get_device_name() if device == "cuda" else here
    return {
        "device": name,
        "precision": precision,
        "threads": threads,
        "torch": str(torch.__version__),
    }
