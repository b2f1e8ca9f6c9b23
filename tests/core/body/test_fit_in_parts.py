"""Clips longer than what is in memory at a time: as if they were fitted whole."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from whole_fits import fit_body, mesh_of

from sd2core.body import fit as fitting
from sd2core.body import fit_windows, landmark_repair, sides, track
from sd2core.body.camera import PinholeCamera
from sd2core.body.fit import fit_motion
from sd2core.body.landmark_files import load_track, save_track
from sd2core.body.lifter import Lifter
from sd2core.body.raw_track import RawTrack
from sd2core.body.rig import KeypointSpace
from sd2core.body.shape import ShapeSpace
from sd2core.body.sides import swap_sides
from sd2core.body.track import LANDMARKS, PER_FRAME, LandmarkTrack
from sd2core.timebase import Timebase
from tools.build_sample.swipes import swipes

CAMERA = PinholeCamera()
HIPS = [LANDMARKS.index(f"hip.{side}") for side in "LR"]
STATURE_M = 1.7


@lru_cache(maxsize=4)
def swiping(frames: int, frames_per_s: float = 30.0, *, uneven: bool = False) -> LandmarkTrack:
    """Somebody who swipes on and on, seen as the landmark model sees people; not to be changed."""
    rng = np.random.default_rng(3)
    times_s = np.arange(frames) / frames_per_s
    if uneven:
        times_s = times_s + 0.3 * rng.uniform(-1.0, 1.0, frames) / frames_per_s
    space = ShapeSpace()
    motion = swipes(space.base_skeleton, 1.2 + times_s % 9.0)
    shape = replace(space.random(rng), stature_m=STATURE_M)
    place = np.stack([0.3 * np.sin(0.5 * times_s), 1.1 + 0.0 * times_s, 2.4 + 0.2 * times_s / 9.0])
    transforms = space.skeleton(shape).transforms(motion.rotations, motion.translation_m + place.T)
    points_m = KeypointSpace(space).of(shape).positions(transforms)
    around = points_m - points_m[:, HIPS].mean(axis=1, keepdims=True)
    noise = rng.standard_normal((frames, 33, 2))
    return LandmarkTrack(
        timebase=Timebase(times_s - times_s[0]),
        width=CAMERA.width,
        height=CAMERA.height,
        image_px=(CAMERA.project(points_m) + noise).astype(np.float32),
        depth_px=(0.8 * around[..., 2] * CAMERA.focal_px / 2.4).astype(np.float32),
        world_m=(around * [1.0, 1.0, 0.8]).astype(np.float32),
        visibility=np.ones((frames, 33), np.float32),
        confidence=np.full(frames, 0.9, np.float32),
        present=np.ones(frames, bool),
        bridged=np.zeros(frames, bool),
        silhouette_frames=np.zeros(0, np.intp),
        silhouettes=np.zeros((0, 8, 8), np.uint8),
    )


def without(known: LandmarkTrack, *gaps: tuple[int, int]) -> LandmarkTrack:
    """The same, but with nobody there in some frames."""
    arrays = {name: getattr(known, name).copy() for name in PER_FRAME}
    for start, stop in gaps:
        for name in ("image_px", "depth_px", "world_m"):
            arrays[name][start:stop] = np.nan
        for name in ("visibility", "confidence", "present"):
            arrays[name][start:stop] = 0
    return replace(known, **arrays)


@pytest.fixture
def short_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(track, "PART_FRAMES", 50)
    monkeypatch.setattr(track, "_MARGIN_FRAMES", 30)


@given(st.integers(1, 100_000))
def test_parts_follow_one_another(frames: int) -> None:
    found = list(track.parts(frames))
    assert found[0][0] == 0
    assert found[-1][1] == frames
    assert all(stop == start for (_, stop), (start, _) in pairwise(found))
    lengths = [stop - start for start, stop in found]
    assert max(lengths) <= track.PART_FRAMES
    assert max(lengths) - min(lengths) <= 1


def odds_by_place(found: RawTrack) -> np.ndarray:
    """Log odds that a part of somebody who faces the camera is mirrored, frame by frame."""
    apart = [
        found.image_px[:, LANDMARKS.index(f"{name}.R"), 0]
        - found.image_px[:, LANDMARKS.index(f"{name}.L"), 0]
        for name in ("shoulder", "elbow", "knee")
    ]
    return 9.0 * np.sign(np.stack(apart, axis=1))


class TestMending:
    FRAMES = 150

    def both(
        self, spoilt: RawTrack, max_gap_s: float = 0.5
    ) -> list[tuple[RawTrack, tuple[str, ...]]]:
        """Mended as a whole, and in parts of 50 frames."""
        outcomes = []
        for part_frames in (self.FRAMES, 50):
            with pytest.MonkeyPatch.context() as patch:
                patch.setattr(track, "PART_FRAMES", part_frames)
                patch.setattr(track, "_MARGIN_FRAMES", 30)
                patch.setattr(sides, "swap_odds", odds_by_place)
                outcomes.append(landmark_repair.repair_landmarks(spoilt, max_gap_s))
        return outcomes

    def found(self, known: LandmarkTrack) -> RawTrack:
        names = ("present", "bridged", "image_px", "depth_px", "world_m", "visibility")
        arrays = {name: getattr(known, name).copy() for name in names}
        return RawTrack(times_s=known.timebase.times_s, **arrays)

    @pytest.mark.slow
    @settings(max_examples=4)
    @given(
        st.lists(st.tuples(st.integers(0, 140), st.integers(1, 9)), max_size=4),
        st.lists(st.tuples(st.integers(3, 146), st.integers(0, 32)), max_size=4),
        st.lists(st.tuples(st.integers(5, 135), st.integers(1, 9)), max_size=3),
        st.sampled_from(["head and trunk", "the arms", "the legs"]),
    )
    def test_parts_are_mended_as_the_whole(
        self,
        swaps: list[tuple[int, int]],
        jumps: list[tuple[int, int]],
        gaps: list[tuple[int, int]],
        part: str,
    ) -> None:
        known = without(swiping(self.FRAMES), *((at, at + length) for at, length in gaps))
        wrong = np.zeros(self.FRAMES, bool)
        for start, length in swaps:
            wrong[start : start + length] = True
        spoilt = swap_sides(self.found(known), part, wrong & known.present)
        for frame, landmark in jumps:
            spoilt.image_px[frame, landmark] += 90.0
        (whole, notes), (parts, other) = self.both(spoilt)
        assert notes == other
        for name, values in vars(whole).items():
            np.testing.assert_allclose(
                getattr(parts, name).astype(float), values.astype(float), atol=1e-4, err_msg=name
            )

    @pytest.mark.slow
    @pytest.mark.parametrize(("first", "last"), [(0, 60), (0, 90), (95, 150)])
    def test_the_right_side_does_not_depend_on_most_of_the_clip(
        self, first: int, last: int
    ) -> None:
        """Also where a whole part, or two, are the other way round."""
        true = self.found(swiping(self.FRAMES))
        wrong = np.zeros(self.FRAMES, bool)
        wrong[first:last] = True
        (whole, notes), (parts, other) = self.both(swap_sides(true, "the arms", wrong))
        assert notes == other
        np.testing.assert_array_equal(parts.image_px, whole.image_px)
        np.testing.assert_array_equal(whole.image_px, self.both(true)[0][0].image_px)

    @pytest.mark.one_in(2)
    @pytest.mark.parametrize("start", [48, 60])
    def test_a_long_gap_is_bridged_across_parts(self, start: int) -> None:
        known = without(swiping(self.FRAMES), (start, start + 45))
        (whole, notes), (parts, other) = self.both(self.found(known), max_gap_s=3.0)
        assert notes == other
        assert whole.bridged.sum() == parts.bridged.sum() == 45
        np.testing.assert_allclose(parts.image_px, whole.image_px, atol=1e-3)


@pytest.mark.usefixtures("short_parts")
def test_a_track_is_saved_part_by_part_or_whole(tmp_path: Path) -> None:
    known = without(swiping(170), (40, 61))
    save_track(known, tmp_path / "track.npz")
    loaded = load_track(tmp_path / "track.npz").part(30, 90)
    for name in PER_FRAME:
        np.testing.assert_array_equal(getattr(loaded, name), getattr(known, name)[30:90])


@pytest.mark.slow
@pytest.mark.usefixtures("short_parts")
@pytest.mark.parametrize(
    ("frames_per_s", "uneven"), [(30.0, False), (12.5, False), (60.0, False), (50.0, True)]
)
def test_a_track_is_lifted_in_parts_as_a_whole(frames_per_s: float, uneven: bool) -> None:
    known = without(swiping(260, frames_per_s, uneven=uneven), (120, 123))
    lifter = Lifter.load()
    in_parts = lifter.lift(known, CAMERA)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(track, "PART_FRAMES", 1000)
        whole = lifter.lift(known, CAMERA)
    for name, values in vars(whole).items():
        near = 1e-4 * np.nanmax(np.abs(values))
        np.testing.assert_allclose(getattr(in_parts, name), values, rtol=0.0, atol=near)


def velocity_mps(points_m: np.ndarray, times_s: np.ndarray) -> np.ndarray:
    """Of all landmarks, (T, 33, 3)."""
    return np.asarray(np.gradient(points_m, times_s, axis=0))


class TestFit:
    FRAMES = 150

    @pytest.mark.slow
    def test_short_parts_change_nothing(self) -> None:
        """Windows are the same: only rounding differs."""
        few = swiping(60)
        whole = fit_body(few, CAMERA, stature_m=STATURE_M)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(track, "PART_FRAMES", 25)
            patch.setattr(fitting, "_FINISHED_FRAMES", 17)
            parts = fit_body(few, CAMERA, stature_m=STATURE_M)
        np.testing.assert_allclose(parts.keypoints_m, whole.keypoints_m, atol=2e-4)
        np.testing.assert_allclose(parts.along_sd_mps, whole.along_sd_mps, atol=1e-4)

    @pytest.mark.slow
    def test_velocities_go_on_across_seams(self) -> None:
        """Fitted in windows, they differ little from those of one window, seams or not."""
        known = swiping(self.FRAMES)
        found = []
        for frames in (self.FRAMES, 120):
            with pytest.MonkeyPatch.context() as patch:
                patch.setattr(fit_windows, "_WINDOW_FRAMES", frames)
                patch.setattr(track, "PART_FRAMES", frames)
                found.append(fit_body(known, CAMERA, stature_m=STATURE_M).keypoints_m)
                spans = fit_windows.Windows(np.ones(self.FRAMES, bool), None).spans
                seams = [span[0] for span in spans][1:]
        times_s = known.timebase.times_s
        true = velocity_mps(found[0], times_s)
        apart = velocity_mps(found[1], times_s) - true
        shared = np.zeros(self.FRAMES, bool)
        for seam in seams:
            shared[seam - 1 : seam + fit_windows._OVERLAP_FRAMES + 1] = True
        assert len(seams) == 1
        typical = np.sqrt((true**2).sum(axis=-1).mean())
        at_seams, elsewhere = (
            np.sqrt((apart[frames] ** 2).sum(axis=-1).mean()) for frames in (shared, ~shared)
        )
        assert elsewhere < 0.02 * typical
        assert at_seams < 0.05 * typical


class TestMotion:
    @pytest.mark.slow
    def test_the_mesh_is_that_of_a_fit_in_memory(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(fit_windows, "_WINDOW_FRAMES", 30)
        monkeypatch.setattr(fit_windows, "_OVERLAP_FRAMES", 10)
        known = without(swiping(75), (0, 3), (40, 48))
        whole = fit_body(known, CAMERA, stature_m=STATURE_M)
        reports: list[tuple[int, int]] = []
        motion = fit_motion(
            known,
            CAMERA,
            stature_m=STATURE_M,
            workspace=tmp_path,
            progress=lambda *report: reports.append(report),
        )
        one, other = mesh_of(whole, "low"), motion.mesh("low")
        np.testing.assert_array_equal(other.read(0, 75), one.read(0, 75))
        assert other.vertices[5:5].shape == (0, 1229, 3)
        some = [60, 2, 44, 60]
        np.testing.assert_array_equal(other.vertices[some], one.read(0, 75)[some])
        for name in ("along_mps", "across_mps"):
            np.testing.assert_array_equal(
                getattr(other.uncertainty, name), getattr(one.uncertainty, name)
            )
        assert motion.residual_m == pytest.approx(np.nanmean(whole.residual_m))
        assert motion.quality == pytest.approx(whole.quality[known.present].mean())
        assert reports == sorted(reports)
        assert reports[-1][0] == reports[-1][1]
