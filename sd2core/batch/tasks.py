"""Tasks: small records that a worker carries out on paths, and that may be done again."""

from __future__ import annotations

import os
import platform
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from sd2core.batch.folder import BatchFolder
from sd2core.batch.inputs import Origin, inspect, mesh_input
from sd2core.batch.keys import all_code_digest
from sd2core.batch.plan import Export, Step, Synthesise
from sd2core.errors import Sd2Error
from sd2core.files.atomic import DISK_FULL
from sd2core.progress import silent
from sd2core.radar_config import RadarConfig
from sd2core.sensor import VelocityAxis, VirtualSensor

BEGUN = "begun"
"""Folder of what is under way; it is there only while a batch runs."""

_MARKER = "task-"
_ONE_FILE = ("synthesise", "denoise", "simulate")
"""Steps that are done when their last file is there."""


@dataclass(frozen=True, eq=False)
class Task:
    """One thing to do: a function of paths and small values, whose result is a file.

    Parameters
    ----------
    step : Step
    key : str
        Names the result; what has the same key is the same.
    origin : Origin
    details : mapping
        Arguments, as JSON can hold them.
    placement : int, optional
    frames : int
        How many are worked on, for rates.
    group : str
        Tasks of one group are best done by one process.
    out : str
        What is written last; empty where that is not a file of its own.
    """

    step: Step
    key: str
    origin: Origin
    details: Mapping[str, Any]
    placement: int | None = None
    frames: int = 0
    group: str = ""
    out: str = ""

    def record(self, folder: Path) -> dict[str, Any]:
        """What is sent to a worker."""
        return {
            "step": self.step,
            "key": self.key,
            "out": self.out,
            "folder": str(folder),
            "origin": asdict(self.origin),
            "details": dict(self.details),
        }


class TaskFailed(Exception):
    """A task cannot be done; what a worker says of it.

    Parameters
    ----------
    found, expected, remedy : str
        As of an :class:`~sd2core.errors.Sd2Error`.
    fatal : bool
        Whether no other task can be done either.
    """

    def __init__(self, found: str, expected: str, remedy: str, fatal: bool = False) -> None:
        self.error = {"found": found, "expected": expected, "remedy": remedy}
        self.fatal = fatal
        super().__init__(found, expected, remedy, fatal)


class SomeFailed(Exception):
    """Of some tasks that were given out together, some cannot be done.

    Parameters
    ----------
    failures : tuple
        One per task; None for those that were done.
    """

    def __init__(self, failures: tuple[TaskFailed | None, ...]) -> None:
        self.failures = failures
        super().__init__(failures)


def run_tasks(records: Sequence[Mapping[str, Any]]) -> None:
    """Carry out tasks in this process, one after the other.

    Raises
    ------
    SomeFailed
        When not all could be done; after a failure that is fatal the others are not tried.
    """
    failures: list[TaskFailed | None] = []
    for record in records:
        fatal = failures[-1] if failures and failures[-1] and failures[-1].fatal else None
        try:
            if fatal is None:
                run_task(record)
            failures.append(fatal)
        except TaskFailed as failure:
            failures.append(failure)
    if any(failures):
        raise SomeFailed(tuple(failures))


def run_task(record: Mapping[str, Any]) -> None:
    """Carry out a task in this process.

    Raises
    ------
    TaskFailed
        Whatever goes wrong.
    """
    folder = BatchFolder(Path(record["folder"]))
    marker = folder.path / BEGUN / _process_name()
    try:
        marker.write_text(record["key"], encoding="ascii")
        if record["out"] and os.path.exists(record["out"]) and record["step"] in _ONE_FILE:
            return  # a worker that was lost had just written it
        _compile_once()
        _WORK[record["step"]](folder, Origin(**record["origin"]), **record["details"])
    except Sd2Error as error:
        raise TaskFailed(error.found, error.expected, error.remedy) from None
    except MemoryError as error:
        raise TaskFailed(f"There is not enough memory for this ({error})", "", "") from None
    except OSError as error:
        about = f"{error.filename}: {error.strerror}" if error.filename else str(error)
        raise TaskFailed(about, "", "", fatal=error.errno in DISK_FULL) from None
    except Exception as error:
        about = f"This should not happen ({type(error).__name__}: {error})"
        raise TaskFailed(about, "", "Please report it") from error
    finally:
        marker.unlink(missing_ok=True)


def killed_in(folder: Path, key: str) -> bool:
    """Whether a process had begun this task, and never came to its end."""
    for marker in (folder / BEGUN).glob(f"{_MARKER}*"):
        try:
            if marker.read_text(encoding="ascii") == key:
                marker.unlink(missing_ok=True)
                return True
        except OSError:
            continue
    return False


def probe(folder: str, token: str) -> dict[str, Any]:
    """What a worker says of itself: the code it has, and whether it sees the folder."""
    path = Path(folder) / BEGUN / token
    return {"code": all_code_digest(), "sees": path.exists(), "host": platform.node()}


def _process_name() -> str:
    return f"{_MARKER}{platform.node()}-{os.getpid()}"


@lru_cache(maxsize=1)
def _compile_once() -> None:
    from sd2core.numerics.compiled import kernels_ready, warm_up

    if not kernels_ready():
        warm_up()


def _inspect(folder: BatchFolder, origin: Origin) -> None:
    inspect(folder, origin)


def _fit(folder: BatchFolder, origin: Origin, **details: Any) -> None:
    from sd2core.batch.fitting import fit_to_video

    fit_to_video(**details)


def _synthesise(
    folder: BatchFolder,
    origin: Origin,
    mesh: Mapping[str, Any],
    sensor: Mapping[str, Any],
    told: Mapping[str, Any],
    stretch: list[int],
    choosing: Mapping[str, Any] | None,
    out: str,
) -> None:
    from sd2core.batch.synthesis import choosing_of, synthesise

    synthesise(
        mesh_input(mesh),
        VirtualSensor(**sensor),
        Synthesise.model_validate(dict(told), strict=False),
        (stretch[0], stretch[1]),
        None if choosing is None else choosing_of(choosing),
        Path(out),
    )


def _denoise(
    folder: BatchFolder,
    origin: Origin,
    maps: list[str],
    model: str,
    digest: str,
    outs: list[str],
) -> None:
    from sd2core.batch.denoising import denoise

    denoise([Path(one) for one in maps], model, digest, [Path(one) for one in outs])


def _simulate(
    folder: BatchFolder,
    origin: Origin,
    mesh: Mapping[str, Any],
    sensor: Mapping[str, Any],
    axis: Mapping[str, Any],
    radar: Mapping[str, Any],
    seed: int,
    stretch: list[int],
    out: str,
) -> None:
    from sd2core.batch.simulation import simulate
    from sd2core.datasets.simulating import Simulation

    simulate(
        mesh_input(mesh),
        VirtualSensor(**sensor),
        Simulation(RadarConfig(**radar), seed),
        VelocityAxis(**axis),
        (stretch[0], stretch[1]),
        Path(out),
    )


def _export(folder: BatchFolder, origin: Origin, export: Mapping[str, Any]) -> None:
    from sd2core.batch.exporting import export_dataset

    export_dataset(folder, Export.model_validate(dict(export), strict=False), silent)


_WORK: dict[str, Callable[..., None]] = {
    "inspect": _inspect,
    "fit": _fit,
    "synthesise": _synthesise,
    "denoise": _denoise,
    "simulate": _simulate,
    "export": _export,
}
