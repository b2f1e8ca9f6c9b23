"""A rendered body whose place is known; pictures turned and mirrored."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from sd2core.body.blazepose import PoseDetector, PoseLandmarker, Roi, _refined, _same_person
from sd2core.body.landmark_models import LandmarkModels
from sd2core.body.model import Body
from sd2core.body.track import LANDMARKS, MIRRORED
from tools.build_sample.render import Camera, Renderer

CAMERA = Camera()
PLACE = np.array([0.2, CAMERA.above_floor_m, 2.6])


@pytest.fixture(scope="module")
def picture() -> NDArray[np.uint8]:
    """A body at rest that faces the camera, a little to the right of the middle."""
    body = Body.load("medium")
    return Renderer(body, CAMERA).frame(body.vertices_m + PLACE)


@pytest.fixture(scope="module")
def landmarker(models: LandmarkModels) -> PoseLandmarker:
    return PoseLandmarker(models.follower)


@pytest.fixture(scope="module")
def detector(models: LandmarkModels) -> PoseDetector:
    return PoseDetector(models.detector)


class TestRoi:
    def test_its_corners_in_the_picture(self) -> None:
        """Turned by 90° clockwise, the top left corner becomes the top right one."""
        matrix = Roi(100.0, 50.0, 40.0, math.pi / 2).matrix(256)
        np.testing.assert_allclose(matrix @ [0, 0, 1], [120, 30], atol=1e-12)
        np.testing.assert_allclose(matrix @ [256, 0, 1], [120, 70], atol=1e-12)
        np.testing.assert_allclose(matrix @ [128, 128, 1], [100, 50], atol=1e-12)

    @pytest.mark.parametrize(("rim", "angle"), [((5, -3), 0.0), ((9, 1), math.pi / 2)])
    def test_around_a_person(self, rim: tuple[float, float], angle: float) -> None:
        """Lying with the head to the right is standing, turned clockwise by 90°."""
        roi = Roi.around(np.array([5.0, 1.0]), np.array(rim, float))
        assert roi.angle_rad == pytest.approx(angle)
        assert roi.size_px == pytest.approx(10.0)

    def test_a_cut_at_full_size_is_the_picture(self, picture: NDArray[np.uint8]) -> None:
        cut = Roi(200.0, 180.0, 256.0).cut(picture)
        np.testing.assert_array_equal(cut, picture[52:308, 72:328])

    def test_outside_the_picture_is_black(self, picture: NDArray[np.uint8]) -> None:
        cut = Roi(0.0, 0.0, 256.0).cut(picture)
        assert not cut[:127].any()
        assert not cut[:, :127].any()
        np.testing.assert_array_equal(cut[128:, 128:], picture[:128, :128])


class TestDetector:
    def test_finds_the_body_where_it_is(
        self, detector: PoseDetector, picture: NDArray[np.uint8]
    ) -> None:
        (found,) = detector.people(picture)
        hips = CAMERA.project(PLACE - [0.0, 0.93, 0.0])
        assert found.score > 0.9
        assert np.hypot(found.roi.centre_x_px - hips[0], found.roi.centre_y_px - hips[1]) < 25
        assert abs(found.roi.angle_rad) < 0.1

    def test_finds_nobody_in_the_empty_room(self, detector: PoseDetector) -> None:
        assert detector.people(np.full((480, 640, 3), 180, np.uint8)) == []

    def test_portrait(self, detector: PoseDetector, picture: NDArray[np.uint8]) -> None:
        """The same person in a strip cut out of the picture."""
        (whole,) = detector.people(picture)
        (strip,) = detector.people(np.ascontiguousarray(picture[:, 200:540]))
        assert strip.roi.centre_x_px + 200 == pytest.approx(whole.roi.centre_x_px, abs=8)
        assert strip.roi.centre_y_px == pytest.approx(whole.roi.centre_y_px, abs=8)

    def test_boxes_of_two_people_are_kept_apart(self) -> None:
        centres = np.array([[0.0, 0.0], [0.1, 0.0], [5.0, 0.0]])
        people = _same_person(centres, np.ones((3, 2)), np.array([0.6, 0.9, 0.7]))
        assert [list(rows) for rows in people] == [[1, 0], [2]]


class TestLandmarker:
    def roi(self, detector: PoseDetector, picture: NDArray[np.uint8]) -> Roi:
        return detector.people(picture)[0].roi

    def test_points_lie_on_the_body(
        self, detector: PoseDetector, landmarker: PoseLandmarker, picture: NDArray[np.uint8]
    ) -> None:
        pose = landmarker.in_picture(picture, self.roi(detector, picture))
        skeleton = Body.load("medium").skeleton
        assert pose.confidence > 0.95
        for landmark, bone in (("elbow", "lowerarm01"), ("wrist", "wrist"), ("knee", "lowerleg01")):
            for side in "LR":
                number = LANDMARKS.index(f"{landmark}.{side}")
                head = skeleton.heads_m[skeleton.index[f"{bone}.{side}"]]
                at = CAMERA.project(head + PLACE)
                assert np.hypot(*(pose.image_px[number] - at)) < 12, landmark
                assert pose.visibility[number] > 0.8

    def test_no_side_is_favoured(
        self, detector: PoseDetector, landmarker: PoseLandmarker, picture: NDArray[np.uint8]
    ) -> None:
        """In the mirrored picture everything is mirrored: no constant shift by part of a cell."""
        roi = self.roi(detector, picture)
        mirrored = np.ascontiguousarray(picture[:, ::-1])
        other = Roi(640 - roi.centre_x_px, roi.centre_y_px, roi.size_px, -roi.angle_rad)
        one = landmarker.in_picture(picture, roi)
        two = landmarker.in_picture(mirrored, other)
        shift = one.image_px[:33, 0] + two.image_px[list(MIRRORED), 0] - 640
        crop_px = roi.size_px / 256
        assert abs(np.median(shift)) / 2 < 0.6 * crop_px

    def test_turned_with_the_picture(
        self, detector: PoseDetector, landmarker: PoseLandmarker, picture: NDArray[np.uint8]
    ) -> None:
        """A picture turned by 90°: the same crop, so points and metres turned by 90°."""
        roi = self.roi(detector, picture)
        turned = np.ascontiguousarray(np.rot90(picture, -1))  # clockwise: (x, y) to (480 - y, x)
        around = Roi(
            480 - roi.centre_y_px, roi.centre_x_px, roi.size_px, roi.angle_rad + math.pi / 2
        )
        one, two = landmarker.in_picture(picture, roi), landmarker.in_picture(turned, around)
        expected = np.stack([480 - one.image_px[:, 1], one.image_px[:, 0]], axis=1)
        np.testing.assert_allclose(two.image_px, expected, atol=1.0)
        metres = np.stack([-one.world_m[:, 1], one.world_m[:, 0]], axis=1)
        np.testing.assert_allclose(two.world_m[:, :2], metres, atol=0.01)
        np.testing.assert_allclose(two.world_m[:, 2], one.world_m[:, 2], atol=0.01)

    def test_a_crop_of_somebody_else(
        self, detector: PoseDetector, landmarker: PoseLandmarker, picture: NDArray[np.uint8]
    ) -> None:
        roi = self.roi(detector, picture)
        one = landmarker.in_picture(picture, roi)
        two = landmarker.on_crop(roi.cut(picture), roi)
        np.testing.assert_array_equal(one.image_px, two.image_px)
        assert one.mask.shape == (256, 256)
        assert one.world_m.shape == (33, 3)

    def test_both_sides_of_a_mirrored_picture(
        self, detector: PoseDetector, landmarker: PoseLandmarker, picture: NDArray[np.uint8]
    ) -> None:
        """What the mirror image gives is the mirror image of what the picture gives.

        Nearly: where the two sides differ, the one that is looked at first counts more.
        """
        roi = replace(self.roi(detector, picture), angle_rad=0.2)
        crop = roi.cut(picture)
        other = replace(roi, centre_x_px=640 - roi.centre_x_px, angle_rad=-0.2)
        one = landmarker.on_both_sides(crop, roi)
        two = landmarker.on_both_sides(np.ascontiguousarray(crop[:, ::-1]), other)
        mirrored = list(MIRRORED)
        expected = two.image_px[mirrored] * [-1, 1] + [640, 0]
        np.testing.assert_allclose(one.image_px[:33], expected, atol=1.0)
        metres = two.world_m[mirrored] * [-1, 1, 1]
        np.testing.assert_allclose(one.world_m, metres, atol=0.02)
        np.testing.assert_allclose(one.visibility, two.visibility[mirrored], atol=0.02)
        np.testing.assert_allclose(one.mask, two.mask[:, ::-1], atol=1e-6)

    def test_the_mean_is_near_both(
        self, detector: PoseDetector, landmarker: PoseLandmarker, picture: NDArray[np.uint8]
    ) -> None:
        roi = replace(self.roi(detector, picture), angle_rad=0.2)
        crop = roi.cut(picture)
        one, both = landmarker.on_crop(crop, roi), landmarker.on_both_sides(crop, roi)
        assert np.hypot(*(one.image_px - both.image_px)[:33].T).max() < 0.04 * roi.size_px
        assert np.abs(one.world_m - both.world_m).max() < 0.15

    def test_finds_nobody_in_the_empty_room(self, landmarker: PoseLandmarker) -> None:
        empty = np.full((480, 640, 3), 180, np.uint8)
        assert landmarker.in_picture(empty, Roi(320, 240, 480)).confidence < 0.5


def test_points_move_to_the_mean_of_the_heat() -> None:
    heat = np.full((64, 64, 39), -50.0, np.float32)
    heat[20, 30, 0] = heat[20, 31, 0] = 50.0
    heat[10, 10, 1] = -1.0  # too little to go by
    points = np.full((39, 2), 81.0)
    points[0] = 4 * 30.4, 4 * 21.2
    points[1] = 4 * 10.5, 4 * 10.5
    points[2] = -3.0, 5.0  # outside the crop
    refined = _refined(points, heat)
    np.testing.assert_allclose(refined[0], [4 * 30.5, 4 * 20], atol=1e-6)
    np.testing.assert_allclose(refined[1:], points[1:])
