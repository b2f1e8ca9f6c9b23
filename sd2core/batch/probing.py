"""What tasks cost here, by doing some of them on a few frames in a temporary folder."""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sd2core.batch.folder import BatchFolder
from sd2core.batch.inputs import Inspection
from sd2core.batch.plan import BatchPlan
from sd2core.batch.task_graph import Flow, simulation_of
from sd2core.maps import DopplerMap, MapKind
from sd2core.progress import silent
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase

if TYPE_CHECKING:
    from sd2core.batch.synthesis import Choosing

_SHORT_FRAMES, _LONG_FRAMES = 120, 480
_SIMULATED_FRAMES = 60
_FEW_SOURCES, _MANY_SOURCES = 4, 24
_MOST_SOURCE_FRAMES = 3_600


@dataclass(frozen=True)
class TaskRate:
    """Seconds and bytes of a task: so many, and so many per frame."""

    seconds: float
    frame_s: float
    bytes: float
    frame_bytes: float


def task_rates(flow: Flow, found: Inspection) -> dict[str, TaskRate]:
    """What a map of this mesh costs, by making some of a few frames.

    Parameters
    ----------
    flow : Flow
        Of a plan that synthesises.
    found : Inspection
        With a mesh.

    Returns
    -------
    dict
        ``synthesise``, ``denoise`` and ``simulate`` per task, and ``open``, once per
        recording.
    """
    from sd2core.batch.denoising import denoise

    maps = _TimedMaps(flow.plan, found)
    rates = {}
    with tempfile.TemporaryDirectory(prefix="sd2-batch-") as name:
        folder = Path(name)
        choosing_s = _seconds(lambda: maps.choose(folder / "plan.json"))
        first_s = _seconds(lambda: maps.make(maps.long, folder / "first.npz"))
        again_s = _seconds(lambda: maps.make(maps.long, folder / "again.npz"))
        rates["open"] = TaskRate(choosing_s + max(first_s - again_s, 0.0), 0.0, 0.0, 0.0)
        outs = {count: folder / f"{count}.npz" for count in (maps.long, maps.short)}
        rates["synthesise"] = _rate(lambda count: maps.make(count, outs[count]), outs)
        if flow.plan.denoise is not None:
            model, digest = flow.model
            cleaned = {count: folder / f"denoised-{count}.npz" for count in outs}

            def clean(count: int) -> None:
                denoise([outs[count]], model, digest, [cleaned[count]])

            for count in outs:
                clean(count)
            rates["denoise"] = _rate(clean, cleaned)
        if flow.plan.simulate is not None:
            seen = {count: folder / f"simulated-{count}.npz" for count in maps.simulated}
            rates["simulate"] = _rate(lambda count: maps.simulate(count, seen[count]), seen)
    return rates


class _TimedMaps:
    """Makes maps of frames in the middle of a mesh, each from a place of its own."""

    def __init__(self, plan: BatchPlan, found: Inspection) -> None:
        assert found.mesh is not None
        assert plan.synthesise is not None
        self._mesh, self.told = found.mesh, plan.synthesise
        self._sensors = list(plan.sensors(found.sensor, found.mesh.target_m).values())
        self._sensor = self._sensors[len(self._sensors) // 2]
        self._choosing: Choosing | None = None
        self.long = min(_LONG_FRAMES, found.mesh.frames)
        self.short = max(1, min(_SHORT_FRAMES, self.long // 2))
        few = min(_SIMULATED_FRAMES, self.long)
        self.simulated = few, max(1, few // 4)
        self._simulation = None if plan.simulate is None else simulation_of(plan.simulate)
        self._made = 0

    def choose(self, path: Path) -> None:
        """Choose how they are made, where the plan is told a tolerance; it holds from now on."""
        from sd2core.accuracy.places import spread
        from sd2core.batch.synthesis import Choosing, chosen_plan

        if self.told.tolerance is not None:
            frames = self._mesh.frames * len(self._sensors)
            self._choosing = Choosing(path, spread(self._sensors), frames)
            chosen_plan(self._mesh, self.told, self._choosing)

    def make(self, count: int, out: Path) -> None:
        """Make one."""
        from sd2core.batch.synthesis import synthesise

        # Moved a little: what is visible from a place is kept, and would cost nothing.
        self._made += 1
        x, y, z = self._sensor.position_m
        sensor = replace(self._sensor, position_m=(x + 1e-3 * self._made, y, z))
        first = (self._mesh.frames - self.long) // 2
        synthesise(self._mesh, sensor, self.told, (first, first + count), self._choosing, out)

    def simulate(self, count: int, out: Path) -> None:
        """Simulate one."""
        from sd2core.batch.simulation import simulate

        assert self._simulation is not None
        first = (self._mesh.frames - count) // 2
        axis = self.told.options().axis
        simulate(self._mesh, self._sensor, self._simulation, axis, (first, first + count), out)


def _rate(work: Callable[[int], None], outs: Mapping[int, Path]) -> TaskRate:
    """From the same done to many frames and to few."""
    long, short = outs
    seconds = {}
    for count in outs:
        seconds[count] = min(_seconds(partial(work, count)) for _ in range(2))
    sizes = {count: out.stat().st_size for count, out in outs.items()}
    per_frame_s, fixed_s = _line(seconds, long, short)
    per_frame, fixed = _line(sizes, long, short)
    return TaskRate(fixed_s, per_frame_s, fixed, per_frame)


def _line(values: dict[int, Any], long: int, short: int) -> tuple[float, float]:
    """Slope and start, neither below 0."""
    if long == short:
        return values[long] / long, 0.0
    slope = max((values[long] - values[short]) / (long - short), 0.0)
    return slope, max(values[short] - slope * short, 0.0)


def _seconds(work: Callable[[], None]) -> float:
    begun_s = time.perf_counter()
    work()
    return time.perf_counter() - begun_s


def export_s(plan: BatchPlan, frames: int, kinds: tuple[MapKind, ...]) -> float:
    """Seconds that a source of a data set takes, by writing some.

    Of maps alone: what a radar file takes besides is not in it.

    Parameters
    ----------
    plan : BatchPlan
        With a section ``[export]``.
    frames : int
        Of a source.
    kinds : tuple of str
        Of maps that the batch makes.
    """
    from sd2core.batch.exporting import export_dataset

    assert plan.export is not None
    assert plan.synthesise is not None
    export, axis = plan.export, plan.synthesise.options().axis
    # A clip of any length is cut in segments; a very long one is taken to cost in proportion.
    shorter = min(max(frames, export.segment_frames), _MOST_SOURCE_FRAMES)
    values = np.random.default_rng(0).random((axis.bins, shorter), np.float32)
    with tempfile.TemporaryDirectory(prefix="sd2-batch-") as name:
        row: dict[str, Any] = {
            "source": "nobody.npz", "subject": "nobody", "sensor": asdict(VirtualSensor()),
            "target_m": (0.0, 0.0, 2.0), "about": "", "start": 0, "stop": shorter,
            "synthetic": None, "denoised": None, "simulated": None,
        }  # fmt: skip
        for kind in kinds:
            row[kind] = f"{kind}.npz"
            clock = Timebase.regular(shorter, 30.0)
            DopplerMap(values, axis, clock, kind).save(Path(name) / row[kind])

        def work(sources: int) -> None:
            folder = BatchFolder(Path(name) / str(sources))
            folder.path.mkdir()
            lines = [
                row | {"recording": f"{k}.npz", "placement": 1}
                | {kind: f"../{row[kind]}" for kind in kinds}
                for k in range(sources)
            ]  # fmt: skip
            folder.results.write_text("".join(json.dumps(line) + "\n" for line in lines))
            told = export.model_copy(
                update={"validation_subjects": (), "test_subjects": (), "kinds": kinds}
            )
            export_dataset(folder, told, silent)

        seconds = {count: _seconds(partial(work, count)) for count in (_FEW_SOURCES, _MANY_SOURCES)}
    slope_s, _ = _line(seconds, _MANY_SOURCES, _FEW_SOURCES)
    return slope_s * max(frames / shorter, 1.0)
