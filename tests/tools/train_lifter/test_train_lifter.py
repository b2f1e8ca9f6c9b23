"""Pictures of random people, and what is learnt from them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sd2core.body.blazepose import CROP_PX, Roi
from sd2core.body.camera import PinholeCamera
from sd2core.body.lifter import OUTPUTS, Lifter
from sd2core.body.lifter_features import rate
from sd2core.body.rig import JOINTS
from sd2core.body.shape import BodyShape, ShapeSpace
from sd2core.mocap.body_motion import BodyMotion
from sd2core.simulate.people.arms import STYLES
from tools.train_lifter.crops import CropPainter, Look, Wardrobe, random_furniture
from tools.train_lifter.deeds import GESTURE_STYLES, HELD_OUT_STYLES, random_deed
from tools.train_lifter.emulate import (
    Emulator,
    Walk,
    batch,
    emulated,
    example,
    random_walks,
    varied,
)
from tools.train_lifter.takes import Stage, Take

TIMES = np.arange(45) / 30.0


@pytest.fixture(scope="module")
def stage() -> Stage:
    return Stage()


def test_tested_styles_are_never_trained_on() -> None:
    trained = STYLES | GESTURE_STYLES
    assert not set(trained) & set(HELD_OUT_STYLES)
    assert not set(trained.values()) & set(HELD_OUT_STYLES.values())


def test_who_gestures_does_not_walk_and_moves_the_hands_before_the_body(stage: Stage) -> None:
    deeds = [random_deed(np.random.default_rng(n), manner="gestures") for n in range(60)]
    assert {deed.legs for deed in deeds} == {"stand", "shift", "sit"}
    assert all(set(deed.arms) & set(GESTURE_STYLES.values()) for deed in deeds)
    ahead = []
    for n in range(12):
        scene = stage.scene(np.random.default_rng(n), manner="gestures", frames=60)
        places, middle = scene.keypoints_m, scene.keypoints_m[:, [11, 12, 23, 24]].mean(axis=1)
        across = places[:, 11] - places[:, 12]
        up = places[:, [11, 12]].mean(axis=1) - places[:, [23, 24]].mean(axis=1)
        front = np.cross(across, up)
        front /= np.linalg.norm(front, axis=1, keepdims=True)
        hands = places[:, [15, 16]] - middle[:, None]
        ahead.append((hands * front[:, None]).sum(axis=2).max())
    assert np.median(ahead) > 0.2
    assert min(ahead) > 0.0


def test_scenes_repeat_and_show_the_upper_body(stage: Stage) -> None:
    one, again = (stage.scene(np.random.default_rng(9), frames=30) for _ in range(2))
    np.testing.assert_array_equal(one.keypoints_m, again.keypoints_m)
    size = np.array([one.camera.width, one.camera.height])
    shown = one.camera.project(one.keypoints_m)[:, [0, 11, 12]]
    assert ((shown > 0) & (shown < size)).all()


def test_what_is_drawn_lies_where_it_is_seen() -> None:
    # A square board of two triangles, and nothing else.
    corners = np.array([[-0.2, -0.3], [0.2, -0.3], [0.2, 0.3], [-0.2, 0.3]])
    board = np.concatenate([corners, np.full((4, 1), 2.0)], axis=1).astype(np.float32)
    faces = np.array([[0, 2, 1], [0, 3, 2]], np.int32)
    ones = np.ones((9, 3), np.float32)
    wardrobe = Wardrobe(np.full((4, 8), -1, np.float32), ones, np.ones((2, 4), np.float32))
    camera = PinholeCamera(400, 300, 500.0)
    look = Look((), 1.0, 1.0, 0.0, 0.0, 0)
    background = np.zeros((300, 400, 3), np.uint8)
    painter = CropPainter(faces, wardrobe, camera, look, background, np.random.default_rng(0))
    roi = Roi(210.0, 140.0, 320.0, 0.3)
    crop = painter.crop(board, roi)
    rows, columns = np.nonzero(crop[..., 0] > 127)
    seen = np.array([columns.mean() + 0.5, rows.mean() + 0.5, 1.0]) @ roi.matrix().T
    np.testing.assert_allclose(
        seen, camera.project(board.astype(np.float64)).mean(axis=0), atol=0.5
    )
    area = len(rows) * (roi.size_px / CROP_PX) ** 2
    np.testing.assert_allclose(area, (0.4 * 250.0) * (0.6 * 250.0), rtol=0.01)


@pytest.mark.slow
def test_takes_come_back_from_disk(takes: list[Take], tmp_path: Path) -> None:
    takes[0].save(tmp_path / "take.npz")
    back = Take.load(tmp_path / "take.npz")
    assert back.camera == takes[0].camera
    for name in ("keypoints_m", "image_px", "world_m", "confidence", "bone_turns"):
        np.testing.assert_array_equal(getattr(back, name), getattr(takes[0], name))


def test_velocities_of_examples_are_those_of_the_truth(takes: list[Take]) -> None:
    truth = batch([example(takes[1])])
    z = takes[1].keypoints_m[..., 2] / takes[1].stature_m
    np.testing.assert_allclose(truth.velocity[0, 1:-1], 15.0 * (z[2:] - z[:-2]), atol=1e-4)
    np.testing.assert_allclose(rate(np.arange(5.0) * 2.0, 0), 60.0)


def test_varied_examples_keep_what_is_seen_and_true_together(takes: list[Take]) -> None:
    # A landmark model that is right: depth it says and truth stay the same through all changes.
    one = example(takes[2])
    right = one._replace(seen=one.seen._replace(depth=one.places[..., 2].copy()))
    rng = np.random.default_rng(2)
    for _ in range(12):
        other = varied(rng, right, 16)
        whole = other.seen.sure > 0
        depth = np.asarray(other.seen.depth)
        np.testing.assert_array_equal(depth[whole], other.places[whole][..., 2])


def test_varied_examples_keep_places_where_they_are_in_the_picture(takes: list[Take]) -> None:
    # Landmarks that lie on the keypoints stay there, mirrored, turned and reversed.
    one = example(takes[2])
    right = one._replace(seen=one.seen._replace(slopes=one.places[..., :2] / one.places[..., 2:]))
    rng = np.random.default_rng(3)
    for _ in range(12):
        other = varied(rng, right, 16)
        whole = other.seen.sure > 0
        np.testing.assert_allclose(batch([other]).across[0][whole], 0.0, atol=1e-5)


def test_emulated_people_look_like_the_takes(takes: list[Take]) -> None:
    emulator = Emulator(takes)
    walks = random_walks(emulator, 2, 5)
    assert walks[0].places.shape == (96, 33, 3)
    cut = Walk(walks[0].places[:24], walks[0].apparent[:24])
    drawn = emulated(np.random.default_rng(1), emulator, cut)
    assert drawn.seen.slopes.shape == (24, 33, 2)
    np.testing.assert_array_equal(drawn.places, cut.places)
    assert np.isfinite(batch([drawn]).features).all()


@pytest.mark.slow
def test_training_learns_and_repeats(takes: list[Take], tmp_path: Path) -> None:
    pytest.importorskip("torch")
    from tools.train_lifter.training import Recipe, TrainingArrays, save_lifter, train

    recipe = Recipe(width=8, dilations=(1, 2), steps=30, batch=4, frames=24, dropout=0.0)
    one = train(TrainingArrays(takes[1:], takes[:1]), recipe)
    two = train(TrainingArrays(takes[1:], takes[:1]), recipe)
    for name, array in one.network.arrays.items():
        np.testing.assert_array_equal(array, two.network.arrays[name])
    begun = train(TrainingArrays(takes[1:], takes[:1]), replace(recipe, steps=1))
    learnt = example(takes[1])
    root = batch([learnt]).root[0]
    off = [np.abs(each.outputs(learnt.seen)[:, 0] - root) for each in (begun, one)]
    assert off[1].mean() < off[0].mean()
    save_lifter(one, tmp_path / "lifter.npz")
    back = Lifter.load(tmp_path / "lifter.npz")
    seen = example(takes[0]).seen
    wanted = one.outputs(seen)
    np.testing.assert_allclose(back.outputs(seen), wanted, atol=0.02 * np.abs(wanted).max())
    assert wanted.shape == (24, OUTPUTS)


def test_a_spread_beyond_its_limits_still_learns() -> None:
    torch = pytest.importorskip("torch")
    from tools.train_lifter.training import _likelihood

    log_sigma = torch.tensor([-9.0, 0.0, 4.0], requires_grad=True)
    _likelihood(torch.tensor([0.1, 0.1, 0.1]), log_sigma).sum().backward()
    gradient = log_sigma.grad.numpy()
    # Too sure: larger; too unsure: smaller, however far outside.
    assert gradient[0] < -1.0
    assert gradient[1] > 0.5
    assert gradient[2] > 0.5


@pytest.mark.slow
def test_real_motion_is_seen_from_everywhere() -> None:
    stage = Stage([_swaying()])
    facing, distances_m = [], []
    for n in range(40):
        scene = stage.captured(np.random.default_rng(n), frames=24)
        assert scene.keypoints_m.shape == (24, 33, 3)
        trunk_m = scene.keypoints_m[:, [11, 12, 23, 24]]
        assert (scene.keypoints_m[..., 2] > 0.7).all()
        size = np.array([scene.camera.width, scene.camera.height])
        shown = scene.camera.project(trunk_m)
        assert ((shown >= 0.0) & (shown <= size)).all(axis=2).mean() > 0.97
        across = trunk_m[0, 0] - trunk_m[0, 1]
        facing.append(np.arctan2(across[2], across[0]))
        distances_m.append(trunk_m[..., 2].mean())
    quarters = np.histogram(facing, 4, (-np.pi, np.pi))[0]
    assert (quarters >= 3).all()
    assert min(distances_m) < 2.5
    assert max(distances_m) > 4.5


def test_furniture_stands_before_the_person() -> None:
    rng = np.random.default_rng(3)
    places_px = rng.uniform([200, 100], [300, 400], (5, 33, 2))
    furniture = random_furniture(rng, places_px, 640, 480)
    assert furniture.picture.shape == (480, 640, 3)
    covered = furniture.mask[places_px[..., 1].astype(int), places_px[..., 0].astype(int)] > 0
    assert 0.02 < covered.mean() < 0.9


def _swaying() -> BodyMotion:
    """A body that sways and turns round."""
    space = ShapeSpace()
    vectors = np.zeros((60, len(JOINTS), 3))
    vectors[:, 0, 1] = np.linspace(0.0, 1.0, 60)
    vectors[:, 1, 0] = 0.2 * np.sin(np.arange(60) / 5.0)
    shape = BodyShape(np.zeros(len(space)), 1.7)
    return BodyMotion("t", "p", "learn", shape, vectors, np.zeros((60, 3)), 0.01)


def test_numpy_and_torch_agree() -> None:
    torch = pytest.importorskip("torch")
    from tools.train_lifter.network import TemporalNetwork, random_network

    torch.manual_seed(1)
    rng = np.random.default_rng(1)
    told = rng.normal(1.0, 2.0, (50, 9)).astype(np.float32)
    network = TemporalNetwork(random_network(told, 16, (1, 3, 2), 7), 0.5)
    network.eval()
    with torch.no_grad():
        wanted = network(torch.from_numpy(told)[None])[0].numpy()
    np.testing.assert_allclose(network.exported().whole(told), wanted, atol=1e-5)
