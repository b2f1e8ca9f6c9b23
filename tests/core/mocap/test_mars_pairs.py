"""Pairs from MARS recordings: targets in closed form, inputs of a body that is driven."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from mars_files import approaching, write_part

from sd2core.cli.info.learning_data import describe_pairs
from sd2core.errors import Sd2Error
from sd2core.io.radar.mars import MarsStretch, read_mars
from sd2core.mocap.driving import KINECT_MARKERS, puppet_of
from sd2core.mocap.mars_pairs import MarsChoices, make_mars_pairs, radar_doppler, skeleton_clip
from sd2core.mocap.radar_place import RadarPlace
from sd2core.pairs.store import PairSet, read_pairs
from sd2core.progress import Cancelled
from sd2core.sensor import VelocityAxis

AXIS = VelocityAxis()
STEP_MPS = 0.356


def _stretch(rows: list[int], speeds: list[float], powers: list[float], frames: list[int]):
    return MarsStretch(
        np.array(frames),
        np.ones((len(frames), 25, 3)),
        np.array(rows, np.intp),
        np.array(speeds),
        np.array(powers),
    )


def test_a_point_is_spread_over_its_resolution_cell() -> None:
    values = radar_doppler(_stretch([0], [STEP_MPS], [7.0], [0]), AXIS)
    assert values.shape == (1, 32)
    # From 0.178 to 0.534 m/s: part of bin 17, bins 18 and 19 whole, part of bin 20.
    assert np.flatnonzero(values[0]).tolist() == [17, 18, 19, 20]
    expected = np.array([0.25 - 0.178, 0.125, 0.125, 0.534 - 0.5]) / STEP_MPS
    np.testing.assert_allclose(values[0, 17:21], expected, rtol=1e-5)


def test_points_weigh_as_their_intensity() -> None:
    stretch = _stretch([0, 0, 1], [STEP_MPS, -STEP_MPS, 0.0], [3.0, 1.0, 5.0], [0, 2])
    shares = radar_doppler(stretch, AXIS)
    np.testing.assert_allclose(shares.sum(axis=1), [1.0, 0.0, 1.0], atol=1e-6)
    approaching_share = shares[0, AXIS.centres_mps > 0].sum()
    assert approaching_share == pytest.approx(0.75, abs=1e-6)
    # A still point lies evenly about zero.
    np.testing.assert_allclose(shares[2], shares[2, ::-1], atol=1e-6)
    powers = radar_doppler(stretch, AXIS, "intensity")
    np.testing.assert_allclose(powers.sum(axis=1), [4.0, 0.0, 5.0], rtol=1e-6)


def test_what_is_beyond_the_axis_is_left_out() -> None:
    values = radar_doppler(_stretch([0, 1], [2.0, 3.0], [1.0, 1.0], [0, 1]), AXIS)
    np.testing.assert_allclose(values.sum(axis=1), [0.5, 0.0], atol=1e-6)


FRAMES = np.delete(np.arange(50, 75), 10)
SPEED_MPS = float(AXIS.centres_mps[19])  # 0.4375


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Two people: one approaches at 0.44 m/s, the other recedes as fast; 24 rows of 25 frames."""
    at = tmp_path_factory.mktemp("mars")
    folders = []
    for subject, speed_mps in (("7", SPEED_MPS), ("8", -SPEED_MPS)):
        folder = at / f"mars_subject{subject}"
        joints = approaching(25, speed_mps)[FRAMES - 50]
        points = [(frame, -speed_mps, 4.0) for frame in FRAMES.tolist()]
        write_part(folder, "test", joints, FRAMES, points)
        folders.append(folder)
    return folders


@pytest.fixture(scope="module")
def pairs(folders: list[Path], tmp_path_factory: pytest.TempPathFactory) -> PairSet:
    out = tmp_path_factory.mktemp("pairs") / "pairs.zarr"
    made = make_mars_pairs(folders, out, MarsChoices(limbs=True))
    assert [*made] == ["7", "8"]
    assert {(one.takes, one.frames) for one in made.values()} == {(1, 25)}
    assert made["7"].stature_m == pytest.approx(1.75, abs=0.03)
    return read_pairs(out)


def _mean_mps(values: np.ndarray) -> np.ndarray:
    total = values.sum(axis=1)
    return (values @ AXIS.centres_mps)[total > 0] / total[total > 0]


@pytest.mark.slow
def test_pairs_say_what_they_are(pairs: PairSet) -> None:
    assert pairs.kind == "real"
    assert pairs.subjects == ("7", "8")
    assert pairs.null_bins == ()
    assert pairs.frame_rate_hz == 10.0
    assert pairs.provenance["parts"] == [["mars_subject7", "test"], ["mars_subject8", "test"]]
    for take in pairs.takes:
        np.testing.assert_allclose(take.times_s, np.arange(25) / 10.0)
        assert not take.label.any()


@pytest.mark.parametrize(("subject", "speed_mps"), [("7", SPEED_MPS), ("8", -SPEED_MPS)])
def test_input_and_target_show_the_same_motion(
    pairs: PairSet, subject: str, speed_mps: float
) -> None:
    (take,) = pairs.of([subject]).takes
    # Feet and head approach a little slower than the middle, in the same bin.
    np.testing.assert_allclose(_mean_mps(take.synthetic), speed_mps, atol=0.02)
    np.testing.assert_allclose(_mean_mps(take.radar), speed_mps, atol=0.01)
    # The radar saw nothing in the frame that is left out; the body was there.
    assert np.flatnonzero(take.radar.sum(axis=1) == 0).tolist() == [10]
    assert not any("lost" in note for note in describe_pairs(Path("mars.zarr"), pairs).notes)
    assert (take.synthetic.sum(axis=1) > 0).all()


def test_limb_maps_add_up(pairs: PairSet) -> None:
    for take in pairs.takes:
        assert take.limbs is not None
        total = take.limbs.values.sum(axis=0).T
        np.testing.assert_allclose(total, take.synthetic, rtol=1e-4, atol=1e-6)


@pytest.mark.slow
def test_a_given_place_is_used(folders: list[Path], tmp_path: Path) -> None:
    """From below, who approaches is slower along the line of sight."""
    place = RadarPlace((0.0, 1.5, 0.0), 0.1)
    made = make_mars_pairs(folders[:1], tmp_path / "low.zarr", MarsChoices(place=place))
    assert made["7"].radar == place
    (take,) = read_pairs(tmp_path / "low.zarr").takes
    np.testing.assert_array_equal(take.sensor_position_m, place.position_m)
    assert (_mean_mps(take.synthetic)[2:-3] < 0.95 * SPEED_MPS).all()


@pytest.mark.slow
def test_nulled_bins_are_empty_in_both(folders: list[Path], tmp_path: Path) -> None:
    choices = MarsChoices()
    nulled = (14, 15, 16, 19)
    choices = replace(choices, synthesis=replace(choices.synthesis, null_bins=nulled))
    make_mars_pairs(folders[:1], tmp_path / "nulled.zarr", choices)
    pairs = read_pairs(tmp_path / "nulled.zarr")
    assert pairs.null_bins == nulled
    assert not pairs.takes[0].synthetic[:, nulled].any()
    assert not pairs.takes[0].radar[:, nulled].any()
    assert pairs.takes[0].radar.any()


@pytest.mark.slow
def test_a_stopped_run_goes_on(folders: list[Path], pairs: PairSet, tmp_path: Path) -> None:
    out = tmp_path / "stopped.zarr"
    seen = []

    def stop(done: int, total: int) -> None:
        seen.append((done, total))
        if done >= 25:
            raise Cancelled

    with pytest.raises(Cancelled):
        make_mars_pairs(folders, out, MarsChoices(limbs=True), progress=stop)
    assert all(total == 50 for _, total in seen)
    assert [done for done, _ in seen] == sorted(done for done, _ in seen)
    assert read_pairs(out).subjects == ("7",)
    make_mars_pairs(folders, out, MarsChoices(limbs=True))
    again = read_pairs(out)
    for take, whole in zip(again.takes, pairs.takes, strict=True):
        assert take.key == whole.key
        np.testing.assert_array_equal(take.synthetic, whole.synthetic)
        np.testing.assert_array_equal(take.radar, whole.radar)


def test_the_same_part_twice_is_refused(folders: list[Path], tmp_path: Path) -> None:
    with pytest.raises(Sd2Error, match="part test of person 7"):
        make_mars_pairs([folders[0], folders[0]], tmp_path / "twice.zarr")
    assert not (tmp_path / "twice.zarr").exists()


@pytest.mark.slow
def test_a_real_lunge_drives_a_body(shared_data: Path) -> None:
    part = read_mars(shared_data / "paired" / "mars_subject4", "validate")
    whole, rows = part.stretches[3], 80
    points = whole.point_rows < rows
    lunge = MarsStretch(
        whole.frames[:rows],
        whole.joints_m[:rows],
        whole.point_rows[points],
        whole.point_mps[points],
        whole.point_intensity[points],
    )
    clip = skeleton_clip(lunge)
    driven = puppet_of([clip], KINECT_MARKERS).pose(clip)
    assert driven.puppet.shape.stature_m == pytest.approx(1.6, abs=0.1)
    assert np.nanmean(driven.residual_m) < 0.03
    # What the radar saw follows the trunk of the body, neither early nor late.
    trunk = driven.landmarks_m[:, [11, 12, 23, 24]].mean(axis=1)
    speed = (-np.gradient(np.linalg.norm(trunk, axis=1)) * 10.0)[lunge.frames]
    inner = slice(5, rows - 5)
    found = {
        lag: np.corrcoef(np.roll(speed, lag)[inner], lunge.mean_velocity_mps()[inner])[0, 1]
        for lag in range(-3, 4)
    }
    assert max(found, key=lambda lag: found[lag]) in (0, 1)
    assert found[0] > 0.85
