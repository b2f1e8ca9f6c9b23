"""A campaign on disk: the same however it is made, and goes on where it was."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sd2core.doppler.options import chosen_options
from sd2core.errors import Sd2Error
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.vertex_parts import JOINTS, QUANTITIES
from sd2core.options.synthesis import Synthesis
from sd2core.pairs.store import PairSet, PairWriter, Take, read_pairs
from sd2core.processes import ProcessId
from sd2core.progress import Cancelled
from sd2core.radar_config import PAPER_RADAR
from sd2core.sensor import VelocityAxis
from sd2core.simulate.campaign import takes
from sd2core.simulate.campaign.fit_errors import FitErrors
from sd2core.simulate.campaign.making import make_campaign, take_numbers
from sd2core.simulate.campaign.radar import TargetOptions, radar_at
from sd2core.simulate.campaign.takes import Campaign, TakeMaker, limb_errors
from sd2core.timebase import Timebase

SHORT = Campaign(seed=3, take_seconds=2.0, target=TargetOptions(looks=1))
MINUTES = 4 * 2.0 / 60.0
"""Four takes."""


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("campaign") / "whole.zarr"
    assert make_campaign(out, SHORT, subjects=2, minutes=MINUTES, processes=1) == 4
    return out


def same(one: PairSet, other: PairSet) -> bool:
    return [take.key for take in one.takes] == [take.key for take in other.takes] and all(
        getattr(a, name).tobytes() == getattr(b, name).tobytes()
        for a, b in zip(one.takes, other.takes, strict=True)
        for name in ("synthetic", "radar", "times_s", "label", "sensor_position_m")
    )


@pytest.mark.slow
def test_takes_are_of_everybody_in_turn(whole: Path) -> None:
    pairs = read_pairs(whole)
    assert pairs.kind == "simulated"
    assert [tuple(take.key) for take in pairs.takes] == [
        ("s01", "take-0001", 0),
        ("s02", "take-0001", 0),
        ("s01", "take-0002", 0),
        ("s02", "take-0002", 0),
    ]
    assert pairs.frame_rate_hz == pytest.approx(30.0)
    for take in pairs.takes:
        assert take.synthetic.shape == (60, 32)
        for values in (take.synthetic, take.radar):
            assert not values[:, list(pairs.null_bins)].any()
    assert any(take.synthetic.any() and take.radar.any() for take in pairs.takes)


def test_a_perfect_fit_is_of_the_same_motion(whole: Path) -> None:
    made = read_pairs(whole).takes[0]
    one = TakeMaker(SHORT).make(0, 0)[0]
    assert one.radar.tobytes() == made.radar.tobytes()
    assert one.synthetic.tobytes() != made.synthetic.tobytes()
    assert one.label.tobytes() == made.label.tobytes()


@pytest.mark.slow
def test_errors_of_fits_of_another_size(whole: Path) -> None:
    """None at 0, as measured at 1; the radar's maps and the motion are the same at any size."""
    bundled = FitErrors.load()
    asked = replace(SHORT, error_sizes=(0.0, 0.0))
    exact, perfect = TakeMaker(asked, bundled).make(0, 0)[0], TakeMaker(SHORT).make(0, 0)[0]
    np.testing.assert_allclose(exact.synthetic, perfect.synthetic, atol=1e-6)
    drawn = TakeMaker(replace(SHORT, error_sizes=(0.5, 1.5)), bundled).make(0, 0)[0]
    made = read_pairs(whole).takes[0]
    assert drawn.radar.tobytes() == exact.radar.tobytes() == made.radar.tobytes()
    assert drawn.synthetic.tobytes() != made.synthetic.tobytes() != exact.synthetic.tobytes()
    with pytest.raises(Sd2Error, match="0 to 10 times"):
        replace(SHORT, error_sizes=(1.0, 0.5))


@pytest.mark.slow
def test_bodies_state_about_how_wrong_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    """σ of the joints: none without errors, and with them their size, on average."""
    monkeypatch.setattr(takes, "radar_target", lambda *_, **__: np.zeros((60, 32), np.float32))
    asked = replace(SHORT, limbs=True)
    known, fitted = TakeMaker(asked), TakeMaker(asked, FitErrors.load())
    exact = known.make(0, 0)[0].limbs
    stated, wrong = [], []
    for number in range(6):
        moves = [maker.make(0, number)[0].limbs.kinematics for maker in (fitted, known)]
        sigma = moves[0][:, QUANTITIES.index("sigma_mps")]
        stated.append(sigma.mean(axis=1))
        wrong.append(np.sqrt(((moves[0] - moves[1])[:, 0] ** 2).mean(axis=1)))
    assert not exact.kinematics[:, QUANTITIES.index("sigma_mps")].any()
    ratio = np.log(np.array(stated)) - np.log(np.array(wrong))
    assert abs(np.median(ratio)) < 0.7
    # Who is more wrong says so: hands more than the trunk.
    hand, trunk = (JOINTS.index(name) for name in ("hand.R", "trunk"))
    assert np.mean(stated, axis=0)[hand] > 1.5 * np.mean(stated, axis=0)[trunk]


def test_limbs_err_along_the_line_of_sight_and_across() -> None:
    """Two limbs on the axis: one moves wrongly along it, the other at right angles."""
    times_s = np.arange(30) / 30.0
    true = np.zeros((30, 4, 3))
    true[..., 2] = 3.0
    found = true.copy()
    found[:, :2, 2] += 0.5 * times_s[:, None]
    found[:, 2:, 0] += 0.2 * times_s[:, None]
    meshes = [
        MeshSequence(points.astype(np.float32), None, Timebase(times_s)) for points in (true, found)
    ]
    numbers = np.array([0, 0, 1, 1], np.uint8)
    with np.errstate(invalid="ignore"):  # limbs without vertices
        along, across = limb_errors(*meshes, numbers)
    np.testing.assert_allclose(along[:2], [0.5, 0.0], atol=1e-3)
    np.testing.assert_allclose(across[:2], [0.0, 0.2 / np.sqrt(2.0)], atol=1e-3)


@pytest.mark.slow
def test_frames_and_bins_of_ones_own(tmp_path: Path) -> None:
    asked = replace(SHORT, radar=radar_at(60.0, 64), synthesis=chosen_options(Synthesis(bins=64)))
    assert asked.radar.chirps_per_frame == 42  # as many as fit
    assert radar_at(30.0, 32) == PAPER_RADAR
    assert radar_at(10.0, 128).chirps_per_frame == 256
    out = tmp_path / "fine.zarr"
    make_campaign(out, asked, subjects=1, minutes=0.05, processes=1)
    pairs = read_pairs(out)
    assert pairs.frame_rate_hz == 60.0
    assert pairs.axis == VelocityAxis(64, 2.0)
    # The same velocities are emptied as of 32 bins.
    emptied = pairs.axis.centres_mps[list(pairs.null_bins)]
    assert (emptied.min(), emptied.max()) == pytest.approx((-0.21875, 0.09375))
    take = pairs.takes[0]
    assert len(take.times_s) == round(SHORT.take_seconds * 60)
    assert not take.radar[:, list(pairs.null_bins)].any()


def test_a_campaign_does_not_go_on_with_errors_of_another_size(whole: Path) -> None:
    with pytest.raises(Sd2Error, match="error_sizes"):
        make_campaign(whole, replace(SHORT, error_sizes=(0.0, 1.5)), subjects=2, minutes=1.0)


@pytest.mark.slow
def test_stopped_and_continued_is_as_if_it_had_not_been(
    whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "stopped.zarr"

    def stop(done: int, total: int) -> None:
        if done == 1:
            raise Cancelled

    with pytest.raises(Cancelled):
        make_campaign(out, SHORT, subjects=2, minutes=MINUTES, processes=1, progress=stop)
    # Killed in the middle of writing the next: its rows are there, its line is not.
    append = PairWriter.append

    def killed(self: PairWriter, take: Take) -> None:
        append(self, take)
        index = out / "takes.jsonl"
        index.write_bytes(index.read_bytes()[:-20])
        raise KeyboardInterrupt

    monkeypatch.setattr(PairWriter, "append", killed)
    with pytest.raises(KeyboardInterrupt):
        make_campaign(out, SHORT, subjects=2, minutes=MINUTES, processes=1)
    monkeypatch.undo()
    assert make_campaign(out, SHORT, subjects=2, minutes=MINUTES, processes=1) == 3
    assert same(read_pairs(out), read_pairs(whole))


@pytest.mark.slow
def test_several_processes_make_the_same_and_a_longer_one_begins_alike(
    whole: Path, tmp_path: Path
) -> None:
    out = tmp_path / "both.zarr"
    assert make_campaign(out, SHORT, subjects=2, minutes=0.5 * MINUTES, processes=2) == 2
    assert make_campaign(out, SHORT, subjects=2, minutes=MINUTES, processes=1) == 2
    assert [take.key for take in read_pairs(out).takes] == [
        take.key for take in read_pairs(whole).takes
    ]
    for one, other in zip(read_pairs(out).takes, read_pairs(whole).takes, strict=True):
        assert one.synthetic.tobytes() == other.synthetic.tobytes()
        assert one.radar.tobytes() == other.radar.tobytes()


@pytest.mark.slow
def test_who_stops_leaves_no_process_behind(tmp_path: Path) -> None:
    before = multiprocessing.active_children()
    workers: list[ProcessId | None] = []

    def stop(done: int, total: int) -> None:
        if done == 1:
            started = [one for one in multiprocessing.active_children() if one not in before]
            workers.extend(ProcessId.of(one.pid) for one in started if one.pid is not None)
            raise Cancelled

    out = tmp_path / "stopped.zarr"
    with pytest.raises(Cancelled):
        make_campaign(out, SHORT, subjects=1, minutes=100.0, processes=2, progress=stop)
    # The list of active children may name one that has ended for a moment longer.
    assert workers
    assert not any(worker is not None and worker.is_alive for worker in workers)
    assert len(read_pairs(out).takes) == 1


@pytest.mark.slow
def test_other_places_see_the_same_take(whole: Path, tmp_path: Path) -> None:
    out = tmp_path / "places.zarr"
    several = Campaign(SHORT.seed, SHORT.take_seconds, 2, target=SHORT.target)
    make_campaign(out, several, subjects=1, minutes=2.0 / 60.0, processes=1)
    own, other = read_pairs(out).takes
    first = read_pairs(whole).takes[0]
    assert (own.placement, other.placement) == (0, 1)
    assert own.radar.tobytes() == first.radar.tobytes()
    assert own.synthetic.tobytes() == first.synthetic.tobytes()
    np.testing.assert_array_equal(own.label, other.label)
    assert np.linalg.norm(own.sensor_position_m) < 0.4
    assert not np.allclose(own.sensor_position_m, other.sensor_position_m)
    assert own.radar.tobytes() != other.radar.tobytes()


def test_subjects_and_seeds_differ(whole: Path, tmp_path: Path) -> None:
    takes = read_pairs(whole).takes
    assert len({take.synthetic.tobytes() for take in takes}) == len(takes)
    out = tmp_path / "other.zarr"
    other = Campaign(4, SHORT.take_seconds, target=SHORT.target)
    make_campaign(out, other, subjects=1, minutes=2.0 / 60.0, processes=1)
    assert read_pairs(out).takes[0].radar.tobytes() != takes[0].radar.tobytes()


def test_another_campaign_does_not_go_on_with_this_one(whole: Path) -> None:
    other = Campaign(SHORT.seed + 1, SHORT.take_seconds, target=SHORT.target)
    with pytest.raises(Sd2Error, match="provenance"):
        make_campaign(whole, other, subjects=2, minutes=MINUTES, processes=1)


def test_minutes_are_of_all_subjects_together() -> None:
    numbers = take_numbers(Campaign(take_seconds=15.0), subjects=6, minutes=90.0)
    assert len(numbers) == 360
    assert numbers[:7] == [(0, 0), (1, 0), (2, 0), (3, 0), (4, 0), (5, 0), (0, 1)]


@pytest.mark.parametrize(
    "wrong", [{"seed": -1}, {"take_seconds": 0.5}, {"take_seconds": 1e6}, {"placements": 0}]
)
def test_what_makes_no_campaign_is_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(Sd2Error):
        Campaign(**wrong)  # type: ignore[arg-type]


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc").is_dir(), reason="looks for processes in /proc")
def test_workers_end_with_a_parent_that_is_killed(tmp_path: Path) -> None:
    """And what is there is whole."""
    out = tmp_path / "killed.zarr"
    command = [sys.executable, "-m", "sd2core.cli", "simulate", "campaign", "--out", str(out)]
    with subprocess.Popen([*command, "--take-seconds", "2"]) as parent:
        _until(lambda: (out / "takes.jsonl").exists(), 120.0)
        workers = _children(parent.pid)
        assert workers
        parent.send_signal(signal.SIGKILL)
        parent.wait()
    _until(lambda: not any(_lives(pid) for pid in workers), 30.0)
    assert read_pairs(out).takes


def _until(done: object, limit_s: float) -> None:
    assert callable(done)
    end = time.monotonic() + limit_s
    while not done():
        assert time.monotonic() < end
        time.sleep(0.1)


def _children(parent: int) -> list[int]:
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                fields = (entry / "stat").read_text().rsplit(")", 1)[1].split()
            except OSError:
                continue
            if int(fields[1]) == parent:
                found.append(int(entry.name))
    return found


def _lives(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
    except OSError:
        return False
    return state != "Z" and os.path.exists(f"/proc/{pid}")
