from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from sd2core.body.model import Body
from sd2core.body.rig import KeypointSpace
from sd2core.body.shape import ShapeSpace
from sd2core.body.track import LANDMARKS
from sd2core.errors import Sd2Error
from sd2core.io.video import open_video
from sd2core.progress import Cancelled
from tools.build_sample.clothing import Clothes, Outfit
from tools.build_sample.render import Renderer, Studio
from tools.fitting import clips as clip_module
from tools.fitting.clips import clip_named, make_fit_truth, scene
from tools.fitting.truth import read_truth, truths_in

FRAMES = 4


@pytest.fixture(scope="module")
def space() -> ShapeSpace:
    return ShapeSpace()


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clip_module, "duration_s", lambda action, seed: FRAMES / 30.0)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("truth")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(clip_module, "duration_s", lambda action, seed: FRAMES / 30.0)
        make_fit_truth(out, [clip_named("still-hand-up")])
    return out / "still-hand-up"


@pytest.mark.slow
def test_a_clip_is_complete_and_on_one_clock(made: Path) -> None:
    truth = read_truth(made)
    mesh = truth.mesh()
    with open_video(truth.video) as video:
        assert (video.width, video.height) == (640, 480)
        np.testing.assert_allclose(video.timebase.times_s, mesh.times_s, atol=1e-6)
    assert json.loads((made / "truth.json").read_text("utf-8"))["simulated"] is True
    assert (truth.kind, truth.strokes, truth.camera.focal_px) == ("still", (), 600.0)
    assert [one.name for one in truths_in(made.parent)] == [truth.name]


def test_the_picture_shows_the_mesh(made: Path) -> None:
    """Where the mesh is, the picture differs from the empty room beside it."""
    truth = read_truth(made)
    pixels = truth.camera.project(truth.mesh().frame(0).astype(np.float64))
    with open_video(truth.video) as video:
        picture = video.read(0).astype(int)
    inside = (pixels > 2).all(axis=1) & (pixels < (638, 478)).all(axis=1)
    columns, rows = pixels[inside].astype(int).T
    empty = picture[rows, 560]
    differs = [
        np.abs(picture[rows, columns + shift] - empty).sum(axis=1) > 25 for shift in (0, 150)
    ]
    assert differs[0].mean() > 0.85
    assert differs[1].mean() < 0.1


def test_keypoints_lie_on_and_in_the_surface(space: ShapeSpace) -> None:
    known = scene(clip_named("vertical-fast"), space)
    frame = 40
    vertices = known.mesh(space, "high").frame(frame)
    keypoints = KeypointSpace(space).of(known.shape).positions(known.transforms)[frame]
    away, _ = cKDTree(vertices).query(keypoints)
    for name in ("nose", "mouth.L", "ear.R", "heel.R", "foot_index.L"):
        assert away[LANDMARKS.index(name)] < 0.002
    # Joints are as deep in the body as limbs are thick.
    assert away.max() < 0.13
    assert (keypoints >= vertices.min(axis=0)).all()
    assert (keypoints <= vertices.max(axis=0)).all()


def test_what_is_there_is_kept(made: Path, short: None) -> None:
    before = {path: path.stat().st_mtime_ns for path in made.rglob("*")}
    asked: list[tuple[int, int]] = []
    clips = [clip_named("still-hand-up")]
    make_fit_truth(made.parent, clips, lambda *step: asked.append(step))
    assert asked == [(0, 0)]
    assert {path: path.stat().st_mtime_ns for path in made.rglob("*")} == before


def test_another_clip_of_the_same_name_is_not_touched(made: Path) -> None:
    other = replace(clip_named("still-hand-up"), seed=5)
    with pytest.raises(Sd2Error, match="another clip of this name"):
        make_fit_truth(made.parent, [other])


@pytest.mark.slow
def test_a_clip_is_the_same_every_time(made: Path, tmp_path: Path, short: None) -> None:
    (again,) = make_fit_truth(tmp_path / "again", [clip_named("still-hand-up")])
    assert (again / "truth.json").read_bytes() == (made / "truth.json").read_bytes()
    np.testing.assert_array_equal(
        read_truth(again).mesh().read(0, FRAMES), read_truth(made).mesh().read(0, FRAMES)
    )
    with open_video(again / "video.mp4") as one, open_video(made / "video.mp4") as other:
        np.testing.assert_array_equal(one.read(1), other.read(1))


def test_a_cancelled_clip_leaves_nothing(tmp_path: Path, short: None) -> None:
    def stop(done: int, total: int) -> None:
        if done >= 1:
            raise Cancelled

    with pytest.raises(Cancelled):
        make_fit_truth(tmp_path / "truth", [clip_named("turn")], stop)
    assert list((tmp_path / "truth").iterdir()) == []


def test_what_is_no_clip_is_explained(tmp_path: Path) -> None:
    with pytest.raises(Sd2Error, match="no clip of known motion"):
        truths_in(tmp_path)
    with pytest.raises(Sd2Error, match="no clip 'ballet'"):
        clip_named("ballet")
    (tmp_path / "truth.json").write_text(json.dumps({"format": "sd2-fit-truth", "version": 99}))
    with pytest.raises(Sd2Error, match="version 99"):
        read_truth(tmp_path)


def test_a_shaped_body_wears_the_same_clothes(space: ShapeSpace) -> None:
    """Sleeves end at the same vertices, so the forearm is bare however long it is."""
    clip = clip_named("left-hand-fast")
    known = scene(clip, space)
    drawer = clip_module.renderer(clip, space, known)
    np.testing.assert_array_equal(
        drawer.clothes.fields, Clothes.of(Body.load("high"), drawer.clothes.outfit).fields
    )


@pytest.mark.parametrize(("sleeve_m", "covered"), [(0.03, False), (0.5, True)])
def test_sleeves_are_as_long_as_asked(sleeve_m: float, covered: bool) -> None:
    body = Body.load("medium")
    clothes = Clothes.of(body, Outfit(sleeve_m=sleeve_m))
    elbow = body.skeleton.heads_m[body.skeleton.index["lowerarm01.L"]]
    near = np.linalg.norm(body.vertices_m - elbow, axis=1) < 0.06
    assert near.sum() > 10
    assert ((clothes.fields[near, 1] > 0) == covered).all()


@pytest.mark.parametrize("pattern", ["stripes", "checks"])
def test_a_pattern_covers_half_the_shirt(pattern: str) -> None:
    body = Body.load("high")
    red, white = (0.8, 0.1, 0.1), (0.9, 0.9, 0.9)
    clothes = Clothes.of(body, Outfit(shirt=red, second=white, pattern=pattern, period_m=0.06))
    colours, _ = clothes.colours(clothes.attributes)
    shirt = colours[(clothes.fields[:, 1] > 0) & (clothes.fields[:, 2] <= 0)]
    assert len(np.unique(shirt, axis=0)) == 2
    assert 0.4 < (shirt[:, 1] > 0.5).mean() < 0.6


@pytest.mark.slow
def test_the_cameras_noise_is_that_of_its_seed() -> None:
    body = Body.load("low")
    drawer = Renderer(body, studio=Studio(noise=0.01))
    vertices = body.vertices_m + np.array([0.0, 1.1, 2.2])
    one, same, other = (drawer.frame(vertices, seed).astype(int) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one, same)
    corner = (slice(0, 100), slice(0, 100))
    assert (one - other)[corner].std() == pytest.approx(0.01 * 255 * np.sqrt(2), rel=0.15)
