"""Long recordings, dragging, cancelling: what the window lives on."""

from __future__ import annotations

import threading
import tracemalloc
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zarr
from doppler_scenes import CAMERA, cached_mask, options, sensor_at, wobbling

from sd2core.doppler import PRESETS, Synthesizer
from sd2core.doppler.masks import VisibilityMasks
from sd2core.errors import Sd2Error
from sd2core.mesh.sequence import MeshSequence
from sd2core.numerics import parallel
from sd2core.numerics.byte_budget import ByteBudget
from sd2core.numerics.parallel import run_jobs, run_light_jobs
from sd2core.progress import Cancelled, silent

FRAMES = 110
NEAR = sensor_at(0.3, -0.2, 0.1)
NEXT = sensor_at(0.32, -0.2, 0.1)


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> tuple[MeshSequence, MeshSequence]:
    """The same scene in memory and chunked on disk."""
    mesh = wobbling(FRAMES, divisions=2)
    stored = zarr.create_array(
        tmp_path_factory.mktemp("recording") / "mesh.zarr",
        shape=mesh.vertices.shape,
        chunks=(37, 324, 3),
        dtype="f4",
    )
    stored[:] = np.asarray(mesh.vertices)
    return mesh, MeshSequence(stored, mesh.faces, mesh.timebase, "zarr")


@pytest.mark.one_in(5)
@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"weight": "area"},
        {"weight": "projected"},
        {"oversampling": 3, "trajectory_smoothing_s": 0.05},
        {"oversampling": 4},
        {"time_sigma_s": 0.2},
        {"mask_stride": 7},
    ],
    ids=str,
)
@pytest.mark.parametrize("visibility", ["exact", "depth", "facing"])
def test_a_long_recording_equals_the_one_in_memory(
    recording: tuple[MeshSequence, MeshSequence], changes: dict[str, Any], visibility: Any
) -> None:
    mesh, stored = recording
    chosen = replace(PRESETS["paper"], **changes)
    budget = 160_000  # of the 0.4 MB that its positions alone would take
    streamed = Synthesizer(stored, chosen, memory_budget_bytes=budget)
    assert streamed.prepared.block_count > 8
    whole = Synthesizer(mesh, chosen).stretch(NEAR, 0, FRAMES, visibility)
    result = streamed.stretch(NEAR, 0, FRAMES, visibility)
    np.testing.assert_array_equal(result.values, whole.values)
    np.testing.assert_array_equal(result.visible_share, whole.visible_share)
    assert streamed.prepared.budget.used_bytes <= budget
    # The same again from its middle, with seams where nothing else has one.
    part = streamed.stretch(NEAR, 38, 91, visibility)
    np.testing.assert_array_equal(part.values, whole.values[:, 38:91])


@pytest.mark.slow
def test_memory_stays_within_the_budget(tmp_path: Path) -> None:
    mesh = wobbling(200)
    stored = zarr.create_array(
        tmp_path / "mesh.zarr",
        shape=mesh.vertices.shape,
        chunks=(8, mesh.vertex_count, 3),
        dtype="f4",
    )
    stored[:] = np.asarray(mesh.vertices)
    budget = 1_000_000
    streamed = Synthesizer(
        MeshSequence(stored, mesh.faces, mesh.timebase, "zarr"),
        options(),
        memory_budget_bytes=budget,
    )
    streamed.map(NEAR, visibility="facing")
    tracemalloc.start()
    try:
        for place in (NEAR, NEXT, CAMERA):
            streamed.map(place, visibility="facing")
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    block = streamed.prepared.block_frames * mesh.vertex_count * 12
    at_work, result = 10 * block, mesh.frame_count * 32 * 8 * 6
    assert budget + at_work + result < mesh.frame_count * mesh.vertex_count * 15
    assert peak < budget + at_work + result


def test_budget_lets_go_of_the_least_recently_used() -> None:
    budget = ByteBudget(100)
    budget.put("a", 1, 40)
    budget.put("b", 2, 40)
    assert budget.get("a") == 1
    budget.put("c", 3, 40)
    assert (budget.get("a"), budget.get("b"), budget.get("c")) == (1, None, 3)
    assert budget.used_bytes == 80
    budget.put("whale", 4, 101)
    assert budget.get("whale") is None
    assert budget.get("a") == 1


def test_budget_makes_an_entry_once() -> None:
    budget, made, gate = ByteBudget(100), [], threading.Barrier(4)

    def make() -> tuple[str, int]:
        made.append(1)
        return "made", 10

    def ask() -> None:
        gate.wait()
        budget.get_or_make("key", make)

    threads = [threading.Thread(target=ask) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert made == [1]


def test_frozen_is_the_last_exact_visibility() -> None:
    mesh = wobbling(20)
    maker = Synthesizer(mesh, options())
    before = maker.stretch(NEXT, 0, 20, "frozen")
    assert before.quality == "facing"  # nothing exact has been worked out yet
    np.testing.assert_array_equal(before.values, maker.stretch(NEXT, 0, 20, "facing").values)
    assert cached_mask(maker, NEAR) is None

    exact = maker.stretch(NEAR, 0, 20)
    assert exact.quality == "exact"
    same = maker.stretch(NEAR, 0, 20, "frozen")
    assert same.quality == "frozen"
    np.testing.assert_array_equal(same.values, exact.values)
    mask = cached_mask(maker, NEAR)
    assert mask is not None
    assert mask.shape == (20, mesh.vertex_count)

    def error(visibility: Any) -> float:
        truth = Synthesizer(mesh, options()).stretch(NEXT, 0, 20).values
        return float(np.abs(maker.stretch(NEXT, 0, 20, visibility).values - truth).sum())

    # Two centimetres on, the frozen mask is much closer to the truth than facing.
    assert error("frozen") < 0.3 * error("facing")
    assert maker.frame(NEXT, 3, "frozen").quality == "frozen"


def test_frozen_for_a_part_only_is_labelled_by_its_weakest() -> None:
    maker = Synthesizer(wobbling(40), options())
    maker.stretch(NEAR, 0, 8)
    assert maker.stretch(NEXT, 0, 8, "frozen").quality == "frozen"
    assert maker.stretch(NEXT, 0, 40, "frozen").quality == "facing"


def test_a_refinement_cut_short_does_not_spoil_what_is_frozen() -> None:
    maker = Synthesizer(wobbling(60), options())
    maker.stretch(NEAR, 0, 60)
    maker.stretch(NEXT, 0, 7)  # the hand moved on before more was done
    assert maker.stretch(CAMERA, 0, 60, "frozen").quality == "frozen"
    assert maker.frame(CAMERA, 40, "frozen").quality == "frozen"


def test_exact_visibility_is_kept_per_sensor_position(monkeypatch: pytest.MonkeyPatch) -> None:
    maker = Synthesizer(wobbling(12), options())
    first = maker.map(NEAR).values
    maker.map(NEXT)

    def never(*arguments: Any) -> None:
        raise AssertionError("worked out again")

    monkeypatch.setattr(VisibilityMasks, "_test_body", never)
    np.testing.assert_array_equal(maker.map(NEAR).values, first)


@pytest.mark.parametrize("visibility", ["exact", "depth", "facing"])
def test_progress_and_cancelling(visibility: Any) -> None:
    maker = Synthesizer(wobbling(60), options())
    reports: list[tuple[int, int]] = []
    maker.map(
        NEAR, visibility=visibility, progress=lambda done, total: reports.append((done, total))
    )
    assert reports[0] == (0, 60)
    assert reports[-1] == (60, 60)
    assert [done for done, _ in reports] == sorted(done for done, _ in reports)

    def stop(done: int, total: int) -> None:
        raise Cancelled

    with pytest.raises(Cancelled):
        maker.map(NEXT, visibility=visibility, progress=stop)
    # What was cancelled can be asked for again and is complete.
    fresh = Synthesizer(wobbling(60), options()).map(NEXT, visibility=visibility)
    np.testing.assert_array_equal(maker.map(NEXT, visibility=visibility).values, fresh.values)


def test_a_failing_job_stops_the_others_and_is_heard() -> None:
    started = threading.Event()
    stopped: list[bool] = []

    def endless(ticket: Any) -> None:
        started.set()
        try:
            while True:
                ticket.advance(0)
        except Cancelled:
            stopped.append(True)
            raise

    def failing(ticket: Any) -> None:
        started.wait(0.2)
        raise ValueError("no")

    with pytest.raises(ValueError, match="no"):
        run_jobs([failing, endless], 2, silent)
    assert stopped == ([True] if started.is_set() else [])


def test_light_jobs_do_not_wait_for_a_busy_pool(monkeypatch: pytest.MonkeyPatch) -> None:
    pool, busy, free = ThreadPoolExecutor(1), threading.Event(), threading.Event()
    monkeypatch.setattr(parallel, "workers", lambda: pool)
    monkeypatch.setattr(parallel, "worker_count", lambda: 3)
    pool.submit(lambda: (busy.set(), free.wait(10)))
    assert busy.wait(10)
    done: list[int] = []
    reports: list[int] = []
    jobs = [lambda ticket, number=number: done.append(number) for number in range(5)]
    run_light_jobs(jobs, 5, lambda one, total: reports.append(one))
    assert done == list(range(5))
    assert reports == [0, 5]
    free.set()
    pool.shutdown()


def test_a_light_job_that_fails_elsewhere_is_heard(monkeypatch: pytest.MonkeyPatch) -> None:
    pool, taken = ThreadPoolExecutor(1), threading.Event()
    monkeypatch.setattr(parallel, "workers", lambda: pool)
    monkeypatch.setattr(parallel, "worker_count", lambda: 2)
    here = threading.current_thread()

    def job(ticket: Any) -> None:
        if threading.current_thread() is not here:
            taken.set()
            raise ValueError("no")
        taken.wait(10)

    with pytest.raises(ValueError, match="no"):
        run_light_jobs([job] * 2, 2, silent)
    pool.shutdown()


@pytest.mark.parametrize("visibility", ["exact", "facing"])
def test_one_thread_is_the_callers(visibility: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    mesh, everywhere = wobbling(60), Synthesizer(wobbling(60), options())
    alone = Synthesizer(mesh, options(), threads=1)
    two = Synthesizer(mesh, options(), threads=2)
    expected = everywhere.map(NEAR, visibility=visibility).values
    np.testing.assert_array_equal(two.map(NEAR, visibility=visibility).values, expected)

    def never() -> None:
        raise AssertionError("the pool was asked")

    monkeypatch.setattr(parallel, "workers", never)
    alone.prepare()
    reports: list[int] = []
    made = alone.map(NEAR, visibility=visibility, progress=lambda done, total: reports.append(done))
    np.testing.assert_array_equal(made.values, expected)
    assert reports[0] == 0
    assert reports[-1] == 60
    assert reports == sorted(reports)

    def stop(done: int, total: int) -> None:
        if done:
            raise Cancelled

    with pytest.raises(Cancelled):
        alone.map(NEXT, visibility=visibility, progress=stop)
    with pytest.raises(Sd2Error, match="threads is 0"):
        Synthesizer(mesh, threads=0)


def test_no_more_jobs_at_once_than_allowed(monkeypatch: pytest.MonkeyPatch) -> None:
    pool = ThreadPoolExecutor(6)
    monkeypatch.setattr(parallel, "workers", lambda: pool)
    lock, running, most = threading.Lock(), [0], [0]

    def job(ticket: Any) -> None:
        with lock:
            running[0] += 1
            most[0] = max(most[0], running[0])
        threading.Event().wait(0.005)
        ticket.advance(1)
        with lock:
            running[0] -= 1

    reports: list[int] = []
    run_jobs([job] * 12, 12, lambda done, total: reports.append(done), threads=2)
    assert most[0] <= 2
    assert reports[-1] == 12
    run_jobs([job] * 12, 12, silent)
    assert most[0] > 2
    pool.shutdown()


def test_several_threads_at_once() -> None:
    maker = Synthesizer(wobbling(60), options(), memory_budget_bytes=3_000_000)
    places = [sensor_at(0.05 * k, 0.1, 0.0) for k in range(4)]
    alone = [Synthesizer(wobbling(60), options()).map(place).values for place in places]
    together: list[Any] = [None] * 4

    def work(k: int) -> None:
        together[k] = maker.map(places[k]).values

    threads = [threading.Thread(target=work, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for one, other in zip(together, alone, strict=True):
        np.testing.assert_array_equal(one, other)


def test_prepare_reads_ahead() -> None:
    maker = Synthesizer(wobbling(60), options())
    reports: list[int] = []
    maker.prepare(lambda done, total: reports.append(done))
    assert reports[-1] == maker.prepared.block_count
    assert maker.prepared.has(0)


@pytest.mark.parametrize(
    ("changes", "kept"),
    [
        ({"weight": "area"}, {"areas", "surface"}),
        ({"weight": "projected"}, {"area vectors", "surface"}),
        ({"range_law": "frame"}, {"middles"}),
    ],
    ids=["area", "projected", "range law"],
)
def test_preparing_leaves_nothing_to_the_first_map(changes: dict[str, Any], kept: set[str]) -> None:
    """Else the first map from a new place would be timed with it."""
    maker = Synthesizer(wobbling(40), replace(PRESETS["paper"], **changes))
    maker.prepare()
    for name in kept | {"block", "normals"}:
        assert maker.prepared.budget.get((name, 0)) is not None, name
