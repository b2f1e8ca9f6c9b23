"""People whose places are known, found in videos of every kind."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from filmed_people import (
    CAMERA,
    FRAMES,
    STEP_S,
    empty_room,
    film,
    person_at,
    swiping,
)

from sd2core.body.landmark_files import load_track, save_track
from sd2core.body.landmark_models import LandmarkModels
from sd2core.body.landmarks import find_landmarks
from sd2core.body.person_selection import Rectangle
from sd2core.body.track import LANDMARKS, LandmarkTrack
from sd2core.errors import Sd2Error
from sd2core.io.video import open_video
from sd2core.progress import Cancelled, Progress

TORSO = [LANDMARKS.index(name) for name in ("shoulder.L", "shoulder.R", "hip.L", "hip.R")]
WRIST = LANDMARKS.index("wrist.R")
PERSON_PX = 230
"""Height of the person in the picture, about."""


def found(path: Path, models: LandmarkModels, **options: object) -> LandmarkTrack:
    with open_video(path) as video:
        return find_landmarks(video, models, **options)  # type: ignore[arg-type]


def off_px(track: LandmarkTrack, frames: list[int] | slice = slice(None)) -> np.ndarray:
    """How far every landmark is from where it is known to be, (T, 33)."""
    _, truth = swiping()
    return np.hypot(*np.moveaxis(track.image_px - truth[frames], -1, 0))


@pytest.fixture(scope="module")
def swipe(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return film(tmp_path_factory.mktemp("swipe") / "swipe.mp4", swiping()[0])


@pytest.fixture(scope="module")
def track(swipe: Path, models: LandmarkModels) -> LandmarkTrack:
    return found(swipe, models)


class TestOnePerson:
    def test_landmarks_are_where_the_body_is(self, track: LandmarkTrack) -> None:
        off = off_px(track)
        assert track.present.all()
        assert not track.bridged.any()
        assert track.confidence.min() > 0.9
        assert np.median(off) < 0.02 * PERSON_PX
        assert off[:, [*TORSO, WRIST]].max() < 0.06 * PERSON_PX

    def test_the_hand_is_followed_through_the_swipe(self, track: LandmarkTrack) -> None:
        truth = swiping()[1][:, WRIST, 0]
        assert np.ptp(truth) > 0.15 * PERSON_PX  # it does move
        correlation = np.corrcoef(track.image_px[:, WRIST, 0], truth)[0, 1]
        assert correlation > 0.99

    def test_the_world_is_a_person_of_usual_size(self, track: LandmarkTrack) -> None:
        shoulders = track.world_m[:, TORSO[0]] - track.world_m[:, TORSO[1]]
        assert shoulders[:, 0].min() > 0.2  # the left one is on the right of the picture
        height = track.world_m[:, LANDMARKS.index("ankle.L"), 1] - track.world_m[:, 0, 1]
        assert 1.0 < np.median(height) < 1.9

    def test_silhouettes_cover_the_body(self, track: LandmarkTrack) -> None:
        assert track.silhouettes.shape == (FRAMES, 192, 256)  # fewer frames than asked for
        truth = swiping()[1]
        for frame, mask in zip(track.silhouette_frames, track.silhouettes, strict=True):
            inside = (0.8 * truth[frame, TORSO]).astype(int)
            assert (mask[inside[:, 1], inside[:, 0]] > 127).all()
            area = (mask > 127).mean() * CAMERA.width * CAMERA.height
            assert 0.1 < area / PERSON_PX**2 < 0.35

    @pytest.mark.slow
    def test_both_passes_are_shown(self, swipe: Path, models: LandmarkModels) -> None:
        stages: list[str] = []
        seen: dict[str, list[int]] = {"find": [], "refine": []}
        reports: dict[str, list[tuple[int, int]]] = {"find": [], "refine": []}

        def progress_of(stage: str) -> Progress:
            stages.append(stage)
            return lambda *report: reports[stage].append(report)

        found(
            swipe,
            models,
            on_frame=lambda stage, frame, points, seeing: seen[stage].append(frame),
            progress_of=progress_of,
            silhouettes=3,
        )
        assert stages == ["find", "refine"]
        assert sorted(seen["find"]) == seen["refine"] == list(range(FRAMES))
        assert reports["find"][-1] == reports["refine"][-1] == (FRAMES, FRAMES)

    @pytest.mark.slow
    def test_one_thread_finds_the_same_as_two(
        self, swipe: Path, models: LandmarkModels, track: LandmarkTrack
    ) -> None:
        other = found(swipe, models, threads=1)
        np.testing.assert_allclose(other.image_px, track.image_px, atol=0.5)


class TestWhichPerson:
    def crossing(self, path: Path, *, red_in_front: bool) -> Path:
        """Blue goes to the right, red to the left; they meet in the middle."""
        pictures = []
        for k in range(21):
            way = int(-90 + 9 * k)
            layers = [(way, False), (-way, True)]
            room = empty_room()
            for columns, red in layers if red_in_front else layers[::-1]:
                room = person_at(room, columns, red=red)
            pictures.append(room)
        return film(path, pictures)

    @pytest.mark.slow
    @pytest.mark.parametrize(("red", "red_in_front"), [(False, True), (True, True)])
    def test_people_who_cross_are_not_confused(
        self, models: LandmarkModels, tmp_path: Path, red: bool, red_in_front: bool
    ) -> None:
        path = self.crossing(tmp_path / "crossing.mp4", red_in_front=red_in_front)
        left = 205 if red else 25
        track = found(path, models, person=Rectangle(left, 20, 90, 215))
        middle = track.image_px[:, TORSO, 0].mean(axis=1)
        way = (-90 + 9 * np.arange(21)) * (-1 if red else 1)
        expected = CAMERA.width / 2 + way
        # While one hides the other, nobody can say where they are.
        apart = np.abs(way) > 45
        np.testing.assert_allclose(middle[apart], expected[apart], atol=8)

    @pytest.mark.slow
    def test_a_rectangle_in_a_later_frame(self, models: LandmarkModels, tmp_path: Path) -> None:
        path = self.crossing(tmp_path / "crossing.mp4", red_in_front=True)
        track = found(path, models, person=Rectangle(205, 20, 90, 215, frame=20))
        middle = track.image_px[:, TORSO, 0].mean(axis=1)
        np.testing.assert_allclose(middle[[0, 20]], [70, 250], atol=8)  # the blue one

    def test_the_larger_one_by_default(self, models: LandmarkModels, tmp_path: Path) -> None:
        room = person_at(empty_room(), 90, red=True)
        small = cv2.resize(person_at(empty_room(), 0), None, fx=0.6, fy=0.6)
        room = room.copy()
        room[96 : 96 + len(small), : small.shape[1] // 2 + 30] = small[
            :, small.shape[1] // 4 - 18 : small.shape[1] // 4 - 18 + small.shape[1] // 2 + 30
        ]
        track = found(film(tmp_path / "two.mp4", [room] * 4), models)
        np.testing.assert_allclose(track.image_px[:, TORSO, 0].mean(axis=1), 250, atol=8)

    @pytest.mark.parametrize(
        ("rectangle", "said"),
        [
            (Rectangle(0, 0, 40, 60), "No person was found in the rectangle"),
            (Rectangle(400, 0, 90, 90), "is not in the picture"),
            (Rectangle(100, 20, 90, 215, frame=FRAMES), f"a frame from 0 to {FRAMES - 1}"),
        ],
    )
    def test_a_rectangle_without_a_person(
        self, swipe: Path, models: LandmarkModels, rectangle: Rectangle, said: str
    ) -> None:
        with pytest.raises(Sd2Error, match=said):
            found(swipe, models, person=rectangle)


class TestPictures:
    @pytest.mark.slow
    def test_a_person_half_out_of_the_picture(self, models: LandmarkModels, tmp_path: Path) -> None:
        """The picture ends at the middle of the body, on the person's left."""
        pictures, truth = swiping()
        path = film(tmp_path / "half.mp4", [each[:, :166] for each in pictures])
        track = found(path, models)
        assert track.present.all()
        right = LANDMARKS.index("shoulder.R")
        assert np.abs(track.image_px[:, right] - truth[:, right]).max() < 0.08 * PERSON_PX
        hidden = [LANDMARKS.index(f"{name}.L") for name in ("elbow", "wrist", "index")]
        shown = [LANDMARKS.index(f"{name}.R") for name in ("elbow", "wrist", "index")]
        assert track.visibility[:, hidden].max() < 0.5
        assert np.median(track.visibility[:, shown]) > 0.7

    @pytest.mark.slow
    @pytest.mark.parametrize("share", [0.15])
    def test_a_small_person(self, models: LandmarkModels, tmp_path: Path, share: float) -> None:
        """Far away, to the left; the model sees people from two fifths of the picture on."""
        wide = cv2.resize(empty_room(), (1280, 720))
        filmed = []
        for each in swiping()[0][::3]:
            small = cv2.resize(each, None, fx=3 * share, fy=3 * share, interpolation=cv2.INTER_AREA)
            rows, columns = small.shape[:2]
            scene = wide.copy()
            scene[400 : 400 + rows, 200 : 200 + columns] = small
            filmed.append(scene)
        track = found(film(tmp_path / "far.mp4", filmed), models)
        assert track.present.all()
        truth = 3 * share * swiping()[1][::3] + [200, 400]
        off = np.hypot(*np.moveaxis(track.image_px - truth, -1, 0))
        assert np.median(off) < 0.03 * 3 * share * PERSON_PX

    @pytest.mark.slow
    def test_portrait(self, models: LandmarkModels, tmp_path: Path) -> None:
        path = film(tmp_path / "portrait.mp4", [each[:, 60:220] for each in swiping()[0]])
        track = found(path, models)
        assert (track.width, track.height) == (160, 240)
        assert track.silhouettes.shape[1:] == (240, 160)
        off = np.hypot(*np.moveaxis(track.image_px - (swiping()[1] - [60, 0]), -1, 0))
        assert np.median(off) < 0.02 * PERSON_PX

    @pytest.mark.one_in(2)
    @pytest.mark.parametrize("turn", [1, 2])
    def test_a_rotated_video(self, models: LandmarkModels, tmp_path: Path, turn: int) -> None:
        """Stored lying or upside down, with the file's word how to turn it upright."""
        stored = [np.rot90(each, -turn) for each in swiping()[0][::4]]
        track = found(film(tmp_path / "turned.mp4", stored, rotation=90 * turn), models)
        assert (track.width, track.height) == (320, 240)
        assert np.median(off_px(track, slice(None, None, 4))) < 0.02 * PERSON_PX

    def test_two_frames(self, models: LandmarkModels, tmp_path: Path) -> None:
        track = found(film(tmp_path / "two.mp4", swiping()[0][:2]), models)
        assert len(track) == 2
        assert np.median(off_px(track, [0, 1])) < 0.02 * PERSON_PX

    @pytest.mark.parametrize("suffix", [".png", ".jpg"])
    def test_an_image(self, models: LandmarkModels, tmp_path: Path, suffix: str) -> None:
        path = tmp_path / f"person{suffix}"
        cv2.imwrite(str(path), swiping()[0][0][..., ::-1])
        with pytest.raises(Sd2Error, match="holds a single picture"):
            found(path, models)

    @pytest.mark.slow
    def test_nobody(self, models: LandmarkModels, tmp_path: Path) -> None:
        path = film(tmp_path / "empty.mp4", [empty_room()] * 2)
        with pytest.raises(Sd2Error, match=r"No person was found in .*empty.mp4.*\d % sure"):
            found(path, models)

    @pytest.mark.slow
    def test_a_damaged_file(self, swipe: Path, models: LandmarkModels, tmp_path: Path) -> None:
        """What is left of it is used, or a sentence says why not; never anything else."""
        content = swipe.read_bytes()
        for share in (0.3, 0.6, 0.9):
            path = tmp_path / "damaged.mp4"
            path.write_bytes(content[: int(share * len(content))])
            with pytest.raises(Sd2Error, match=r"damaged\.mp4"):
                found(path, models)
        start = content.index(b"mdat") + 4
        middle = start + (content.index(b"moov", start) - start) // 2
        path.write_bytes(content[:middle] + bytes(400) + content[middle + 400 :])
        track = found(path, models)
        assert track.present.any()


class TestTimes:
    """Limits are times, whatever the frames."""

    def gap(self, frames_per_s: float, empty_s: float) -> list[np.ndarray]:
        """A standing person who is gone for a while."""
        person, room = swiping()[0][0], empty_room()
        times = np.arange(round(1.2 * frames_per_s)) / frames_per_s
        gone = (times > 0.25) & (times < 0.25 + empty_s)
        return [room if each else person for each in gone]

    @pytest.mark.slow
    @pytest.mark.parametrize("frames_per_s", [10, 30])
    @pytest.mark.parametrize("bridged", [True, False])
    def test_a_gap(
        self, models: LandmarkModels, tmp_path: Path, frames_per_s: int, bridged: bool
    ) -> None:
        pictures = self.gap(frames_per_s, 0.25 if bridged else 0.65)
        path = film(tmp_path / "gap.mp4", pictures, frames_per_s=frames_per_s)
        track = found(path, models)
        gone = np.array([each is not pictures[0] for each in pictures])
        np.testing.assert_allclose(np.diff(track.timebase.times_s), 1 / frames_per_s, atol=1e-3)
        assert (track.confidence[gone] == 0).all()
        # Beside the gap a frame may be lost that lies between two looks.
        lost = np.abs(track.confidence - ~gone) > 0.5
        assert lost.sum() <= 2 * frames_per_s / 15
        if bridged:
            assert track.present.all()
            np.testing.assert_array_equal(track.bridged, track.confidence == 0)
            still = track.image_px[:, TORSO] - track.image_px[0, TORSO]
            assert np.abs(still).max() < 3
        else:
            assert not track.present[gone].any()
            assert np.isnan(track.image_px[gone]).all()
            assert (track.visibility[gone] == 0).all()
            assert not track.bridged.any()

    @pytest.mark.slow
    def test_another_limit(self, models: LandmarkModels, tmp_path: Path) -> None:
        path = film(tmp_path / "gap.mp4", self.gap(10, 0.65), frames_per_s=10)
        assert found(path, models, max_gap_s=1.0).present.all()

    @pytest.mark.slow
    def test_variable_frame_rate(self, models: LandmarkModels, tmp_path: Path) -> None:
        """Every frame is shown at its own time, and the swipe is found there."""
        pictures, _ = swiping()
        times_ms = [round(1000 * STEP_S * k) + (0, 21, 9)[k % 3] for k in range(FRAMES)]
        track = found(film(tmp_path / "vfr.mkv", pictures, times_ms=times_ms), models)
        np.testing.assert_allclose(track.timebase.times_s, np.array(times_ms) / 1e3, atol=2e-3)
        assert np.median(off_px(track)) < 0.02 * PERSON_PX

    @pytest.mark.slow
    def test_a_fast_camera(self, models: LandmarkModels, tmp_path: Path) -> None:
        """At 120 frames/s, the first pass looks at one in eight."""
        pictures = [each for each in swiping()[0][4:6] for _ in range(8)]
        path = film(tmp_path / "fast.mp4", pictures, frames_per_s=120)
        seen: list[tuple[str, int]] = []
        track = found(path, models, on_frame=lambda stage, frame, *_: seen.append((stage, frame)))
        assert len([frame for stage, frame in seen if stage == "find"]) <= 4
        assert len([frame for stage, frame in seen if stage == "refine"]) == 16
        assert track.present.all()
        rows = [4 + k // 8 for k in range(16)]
        assert np.median(off_px(track, rows)) < 0.02 * PERSON_PX


class TestStopped:
    @pytest.mark.slow
    @pytest.mark.parametrize("stop_after", [9, 20])
    def test_going_on_gives_the_same(
        self,
        swipe: Path,
        models: LandmarkModels,
        track: LandmarkTrack,
        tmp_path: Path,
        monkeypatch: pytest.MonkeyPatch,
        stop_after: int,
    ) -> None:
        monkeypatch.setattr("sd2core.body.landmarks._SAVE_EVERY", 4)
        monkeypatch.setattr("sd2core.body.landmarks._STRETCH_FRAMES", 4)
        shown = 0

        def cancel(*_: object) -> None:
            nonlocal shown
            shown += 1
            if shown == stop_after:
                raise Cancelled

        with pytest.raises(Cancelled):
            found(swipe, models, workspace=tmp_path, on_frame=cancel)
        again: list[int] = []
        resumed = found(
            swipe, models, workspace=tmp_path, on_frame=lambda _, frame, *__: again.append(frame)
        )
        for name, value in vars(track).items():
            if isinstance(value, np.ndarray):
                np.testing.assert_array_equal(getattr(resumed, name), value, err_msg=name)
        # What was saved is not done again.
        assert len(again) <= 2 * FRAMES - stop_after + 4 + 4
        assert found(swipe, models, workspace=tmp_path, on_frame=cancel).present.all()

    @pytest.mark.slow
    def test_the_work_on_another_video_is_not_used(
        self, swipe: Path, models: LandmarkModels, tmp_path: Path
    ) -> None:
        found(swipe, models, workspace=tmp_path)
        other = film(tmp_path / "other.mp4", [person_at(empty_room(), 60)] * 3)
        track = found(other, models, workspace=tmp_path)
        np.testing.assert_allclose(track.image_px[:, TORSO, 0].mean(axis=1), 220, atol=8)


class TestFiles:
    def test_there_and_back(self, track: LandmarkTrack, tmp_path: Path) -> None:
        save_track(track, tmp_path / "track.npz")
        loaded = load_track(tmp_path / "track.npz")
        for name, value in vars(track).items():
            if name == "timebase":
                np.testing.assert_array_equal(loaded.timebase.times_s, value.times_s)
            elif isinstance(value, np.ndarray):
                np.testing.assert_array_equal(getattr(loaded, name), value)
                assert getattr(loaded, name).dtype == value.dtype
            else:
                assert getattr(loaded, name) == value

    def test_what_is_no_track(self, track: LandmarkTrack, tmp_path: Path) -> None:
        path = tmp_path / "track.npz"
        with pytest.raises(Sd2Error, match="does not exist"):
            load_track(path)
        np.savez(path, image_px=track.image_px)
        with pytest.raises(Sd2Error, match="cannot be read as landmarks"):
            load_track(path)
        np.savez(path, meta=np.array({"a": 1}, dtype=object))  # a pickle
        with pytest.raises(Sd2Error, match="cannot be read as landmarks"):
            load_track(path)
        save_track(track, path)
        path.write_bytes(path.read_bytes()[:-300])
        with pytest.raises(Sd2Error, match="cannot be read as landmarks"):
            load_track(path)

    def test_of_a_later_version(
        self, track: LandmarkTrack, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr("sd2core.body.landmark_files.VERSION", 2)
        save_track(track, tmp_path / "track.npz")
        monkeypatch.undo()
        with pytest.raises(Sd2Error, match="version 2"):
            load_track(tmp_path / "track.npz")


@pytest.mark.slow
def test_a_real_person(shared_data: Path, models: LandmarkModels, tmp_path: Path) -> None:
    """Found in every frame; the face above the shoulders, they above the hips."""
    with open_video(shared_data / "video" / "help.mkv") as video:
        pictures = [video.read(frame) for frame in range(0, 24, 2)]
    track = found(film(tmp_path / "real.mp4", pictures), models)
    assert track.present.all()
    assert track.confidence.min() > 0.9
    nose, shoulder, hip = (
        track.image_px[:, LANDMARKS.index(name), 1] for name in ("nose", "shoulder.L", "hip.L")
    )
    assert (nose < shoulder).all()
    assert (shoulder < hip).all()
    assert track.notes == ()
