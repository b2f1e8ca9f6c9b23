"""The denoised map without a window: which model, which frames, which place."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from fake_accuracy import FakeAccuracy
from fake_denoisers import FakeDenoisers, card_of, fading
from PySide6.QtCore import QObject
from window_models import build_models

from sd2app.denoise import map as denoised_map
from sd2app.maps import model as maps_model
from sd2app.settings import Settings
from sd2app.shell.parts import Parts
from sd2core.denoise.files import LIMBS_MODEL, MAP_MODEL
from sd2core.denoise.known import KnownMovements
from sd2core.denoise.texture import Texture
from sd2core.errors import Sd2Error
from sd2core.files.resources import resource_path
from sd2core.io.mesh import load_mesh, save_mesh
from sd2core.maps import DopplerMap
from sd2core.mesh.sequence import MeshSequence
from sd2core.recording.recording import Recording, open_recording
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase

FRAMES = 90


@pytest.fixture(scope="module")
def original(tmp_path_factory):
    """A recording of a ball that swings along the line of sight."""
    folder = tmp_path_factory.mktemp("ball") / "ball.sd2"
    folder.mkdir()
    shape = trimesh.creation.icosphere(subdivisions=2, radius=0.3)
    times_s = np.arange(FRAMES) / 30
    vertices = np.repeat(shape.vertices[None], FRAMES, axis=0).astype(np.float32)
    vertices[:, :, 2] += (2 + 0.2 * np.sin(2 * np.pi * times_s)[:, None]).astype(np.float32)
    mesh = MeshSequence(vertices, np.asarray(shape.faces, np.int32), Timebase(times_s))
    save_mesh(mesh, folder / "mesh.npz")
    Recording.create(folder, mesh=folder / "mesh.npz")
    return folder


@pytest.fixture
def ball(original, tmp_path):
    return Path(shutil.copytree(original, tmp_path / original.name))


@pytest.fixture
def models(tmp_path):
    """Two models in files, and none that is used by default."""
    models = FakeDenoisers()
    for name, gain in (("one", 2.0), ("two", 3.0)):
        (path := tmp_path / f"{name}.safetensors").write_bytes(b"weights")
        models.add(path, gain)
    return models


@pytest.fixture
def make(qapp, compiled_kernels):
    """Makes contexts on a library of models."""
    made = []

    def context(models):
        parent = QObject()
        made.append(
            (
                parent,
                build_models(
                    parent,
                    Settings.forgetful(),
                    Parts(accuracy=FakeAccuracy().library, denoisers=models.library),
                ),
            )
        )
        return made[-1][1]

    yield context
    for parent, one in made:
        one.close()
        parent.deleteLater()


@pytest.fixture
def context(make, models):
    return make(models)


def open_it(context, qtbot, path):
    with qtbot.waitSignal(context.document.opened, timeout=10_000):
        context.document.open([path])
    rest(context, qtbot)


def rest(context, qtbot):
    def resting() -> bool:
        # Together: a model that was found may ask for the map of the limbs.
        return context.synthesis.complete and not (context.synthesis.busy or context.denoise.busy)

    qtbot.waitUntil(resting, timeout=120_000)


def is_of(context, gain):
    """Whether the track is the answer to the synthetic map that is shown."""
    expected = fading(context.synthetic.map.values, np.float32(gain))
    return np.allclose(context.denoised.map.values, expected, rtol=1e-5, atol=1e-9)


# --- which model --------------------------------------------------------------------------


def test_without_a_model_there_is_no_track(context, models, qtbot, ball):
    open_it(context, qtbot, ball)
    assert context.denoised.map is None
    assert models.loaded == []
    assert not context.denoise.can_export


def test_the_bundled_model_is_used_where_nobody_has_chosen(make, qtbot, ball):
    models = FakeDenoisers.bundled(2.0)
    context = make(models)
    open_it(context, qtbot, ball)
    assert is_of(context, 2.0)
    assert context.denoised.status == "simulated data only"
    assert context.denoised.map.unit == "power"
    assert not context.document.modified
    context.denoise.use(None)
    rest(context, qtbot)
    assert context.denoised.map is None
    context.document.undo_stack.undo()
    rest(context, qtbot)
    assert is_of(context, 2.0)


def test_the_map_is_drawn_as_the_radar_would_show_it_and_the_mean_again(
    make, qtbot, tmp_path, ball
):
    models = FakeDenoisers()
    law = Texture(half=0.01, slope=1.5, floor=0.0, gain=1.0, looks=2.0, persistence=0.3)
    (path := tmp_path / "one.safetensors").write_bytes(b"weights")
    models.add(path, 2.0, texture=law)
    context = make(models)
    open_it(context, qtbot, ball)
    context.denoise.use(path)
    rest(context, qtbot)
    assert is_of(context, 2.0)
    mean = context.denoised.map.values.copy()
    context.denoise.set_textured(True)
    rest(context, qtbot)
    drawn = law.drawn(np.ascontiguousarray(mean.T), (0,)).T
    np.testing.assert_allclose(context.denoised.map.values, drawn, rtol=1e-4, atol=1e-9)
    assert "drawn" in context.denoised.status
    context.edits.begin_sensor_drag()
    context.edits.drag_sensor((0.3, 0.0, 0.0))
    qtbot.waitUntil(lambda: not context.synthesis.busy, timeout=10_000)
    swept = fading(context.synthetic.map.values, np.float32(2.0))
    drawn = law.drawn(np.ascontiguousarray(swept.T), (0,)).T
    np.testing.assert_allclose(context.denoised.map.values, drawn, rtol=1e-4, atol=1e-9)
    context.edits.end_drag()
    context.document.undo_stack.undo()
    rest(context, qtbot)
    context.denoise.export(tmp_path / "drawn.npz")
    assert DopplerMap.load(tmp_path / "drawn.npz").meta["texture"] == {"seed": 0}
    context.denoise.set_textured(False)
    rest(context, qtbot)
    assert is_of(context, 2.0)
    assert context.denoised.status == "simulated data only"


def test_frames_that_the_model_did_not_learn_are_counted_beside_the_title(
    make, qtbot, tmp_path, ball
):
    models = FakeDenoisers()
    (path := tmp_path / "one.safetensors").write_bytes(b"weights")
    known = KnownMovements(-0.4, 0.4, 2.0, 1.0)
    models.add(path, 2.0, known=known)
    context = make(models)
    open_it(context, qtbot, ball)
    context.denoise.use(path)
    rest(context, qtbot)
    source = context.synthetic.map
    passed = int(known.strange(source.values.T, source.axis).sum())
    assert 0 < passed < FRAMES
    assert f"{passed} frames unlike what it learnt stay synthetic" in context.denoised.status


def test_where_the_parts_of_the_body_are_known_the_bundled_model_for_them_is_used(
    make, qtbot, tmp_path, ball
):
    path = tmp_path / "body.npz"
    save_mesh(load_mesh(resource_path("swipes.sd2") / "mesh.zarr").between(100, 130), path)
    context = make(FakeDenoisers.bundled(2.0, limbs_gain=3.0))
    open_it(context, qtbot, path)
    assert context.denoise.card.name == LIMBS_MODEL
    of_forearm = context.synthesis.whole_map().limbs.inputs(("forearm.R",)).T
    np.testing.assert_allclose(
        context.denoised.map.values, fading(of_forearm, np.float32(3.0)), rtol=1e-4, atol=1e-7
    )
    open_it(context, qtbot, ball)
    assert context.denoise.card.name == MAP_MODEL
    assert context.denoise.before is None
    assert is_of(context, 2.0)


def test_a_choice_is_an_edit_that_is_saved_with_the_recording(context, models, qtbot, ball):
    one, two = models.cards
    open_it(context, qtbot, ball)
    context.denoise.use(one)
    rest(context, qtbot)
    assert is_of(context, 2.0)
    context.denoise.use(two)
    rest(context, qtbot)
    assert is_of(context, 3.0)
    stack = context.document.undo_stack
    assert stack.undoText() == "Choose denoiser"
    stack.undo()
    rest(context, qtbot)
    assert is_of(context, 2.0)
    assert models.loaded == [one, two]  # what was in use before is still there
    stack.redo()
    context.document.save()
    assert open_recording(ball).denoiser == two
    assert not context.document.modified
    context.denoise.use(None)
    context.document.save()
    assert open_recording(ball).bundled_denoiser == ""
    assert open_recording(ball).denoiser is None


def test_a_missing_model_is_named_and_the_rest_works(context, models, qtbot, ball, tmp_path):
    recording = open_recording(ball)
    recording.denoiser = tmp_path / "gone.safetensors"
    recording.save()
    said = context.shell.warned = []
    open_it(context, qtbot, ball)
    assert len(said) == 1
    assert "denoiser is not at" in said[0]
    assert "gone.safetensors" in said[0]
    assert "gone.safetensors" in context.denoise.problem
    assert context.synthetic.map is not None
    assert context.denoised.map is None
    context.denoise.use(next(iter(models.cards)))
    rest(context, qtbot)
    assert is_of(context, 2.0)
    assert context.denoise.problem == ""


def test_a_model_that_fails_is_named_and_can_be_chosen_again(context, models, qtbot, ball):
    one = next(iter(models.cards))
    open_it(context, qtbot, ball)
    said = context.shell.warned = []
    models.failure = Sd2Error("The map has 25 frames/s", "30 frames/s")
    context.denoise.use(one)
    rest(context, qtbot)
    assert said == [str(models.failure)]
    assert context.denoise.problem == said[0]
    assert context.denoised.map is None
    assert context.synthesis.complete
    models.failure = None
    context.denoise.use(one)
    rest(context, qtbot)
    assert is_of(context, 2.0)
    assert context.denoise.problem == ""


def test_that_the_default_does_not_suit_is_no_failure(make, qtbot, ball):
    models = FakeDenoisers.bundled(2.0)
    models.failure = Sd2Error("The map has 64 bins", "32 bins")
    context = make(models)
    said = []
    context.denoise.failed.connect(said.append)
    open_it(context, qtbot, ball)
    assert said == []
    assert "64 bins" in context.denoise.problem
    assert context.denoised.map is None


def test_what_is_no_model_is_refused_and_nothing_changes(context, qtbot, ball):
    open_it(context, qtbot, ball)
    with pytest.raises(Sd2Error, match="no model file"):
        context.denoise.use(ball / "mesh.npz")
    assert context.document.undo_stack.count() == 0


# --- which place --------------------------------------------------------------------------


def test_while_dragging_both_maps_are_of_one_place(context, models, qtbot, ball):
    open_it(context, qtbot, ball)
    context.denoise.use(next(iter(models.cards)))
    rest(context, qtbot)
    together = []
    context.denoised.changed.connect(lambda: together.append(is_of(context, 2.0)))
    context.edits.begin_sensor_drag()
    for step in range(1, 6):
        before, here = len(together), context.denoised.map.values.copy()
        context.edits.drag_sensor((0.3 * step, 0.0, 0.0))
        qtbot.waitUntil(lambda n=before: len(together) > n, timeout=10_000)
        qtbot.waitUntil(lambda: not context.synthesis.busy, timeout=10_000)
        assert not np.array_equal(context.denoised.map.values, here)
    assert all(together)
    assert any(thread.startswith("postprocess") for _, thread in models.asked)
    context.edits.end_drag()
    rest(context, qtbot)
    assert is_of(context, 2.0)


def test_what_a_model_made_of_a_place_comes_back_with_the_place_and_with_the_model(
    context, models, qtbot, ball
):
    open_it(context, qtbot, ball)
    first, second = list(models.cards)[:2]
    context.denoise.use(first)
    rest(context, qtbot)
    before = context.denoised.map.values.copy()
    context.edits.place_sensor(VirtualSensor(position_m=(0.4, 0.0, 0.0)))
    rest(context, qtbot)
    assert is_of(context, 2.0)
    models.asked.clear()
    context.document.undo_stack.undo()
    rest(context, qtbot)
    np.testing.assert_array_equal(context.denoised.map.values, before)
    assert models.asked == []
    context.denoise.use(second)
    rest(context, qtbot)
    assert not np.array_equal(context.denoised.map.values, before)
    models.asked.clear()
    context.denoise.use(first)
    rest(context, qtbot)
    np.testing.assert_array_equal(context.denoised.map.values, before)
    assert models.asked == []


def test_a_model_too_slow_for_a_hand_waits_for_it(context, models, qtbot, ball, monkeypatch):
    monkeypatch.setattr(denoised_map, "_TOO_SLOW_S", -1.0)
    open_it(context, qtbot, ball)
    context.denoise.use(next(iter(models.cards)))
    rest(context, qtbot)
    context.edits.begin_sensor_drag()
    for step in range(1, 5):
        assert context.denoised.covered is None
        context.edits.drag_sensor((0.3 * step, 0.0, 0.0))
        qtbot.waitUntil(lambda: not context.synthesis.busy, timeout=10_000)
    # Nothing of an earlier place is shown as if it were of this one.
    assert not context.denoised.covered.any()
    assert "follows when the sensor rests" in context.denoised.status
    context.edits.end_drag()
    rest(context, qtbot)
    assert context.denoised.covered is None
    assert is_of(context, 2.0)
    assert "rests" not in context.denoised.status


def test_0_db_stays_while_the_sensor_moves(context, models, qtbot, ball):
    open_it(context, qtbot, ball)
    context.denoise.use(next(iter(models.cards)))
    rest(context, qtbot)
    reference = context.denoised.reference
    assert reference == context.denoised.map.values.max()
    context.edits.place_sensor(VirtualSensor(position_m=(2.0, 0.0, 2.0)))
    rest(context, qtbot)
    assert context.denoised.reference == reference
    assert context.denoised.map.values.max() != reference


def test_another_recording_shows_nothing_of_the_one_before(context, models, qtbot, ball, original):
    open_it(context, qtbot, ball)
    context.denoise.use(next(iter(models.cards)))
    rest(context, qtbot)
    context.document.undo_stack.setClean()
    open_it(context, qtbot, original)
    assert context.denoised.map is None
    assert context.denoise.card is None
    assert context.denoise.before is None


def test_a_recording_with_the_same_model_needs_no_loading(context, models, qtbot, ball):
    open_it(context, qtbot, ball)
    context.denoise.use(next(iter(models.cards)))
    rest(context, qtbot)
    context.document.save()
    open_it(context, qtbot, ball)
    assert is_of(context, 2.0)
    assert len(models.loaded) == 1
    assert context.denoise.before is None


# --- long clips ---------------------------------------------------------------------------


def test_a_clip_is_denoised_while_it_is_synthesised_and_in_the_end_as_a_whole(
    context, models, qtbot, ball, monkeypatch
):
    monkeypatch.setattr(maps_model, "AT_ONCE", 1)  # a few frames of the map after another
    open_it(context, qtbot, ball)
    context.span.set_span(2.0, 2.5)
    context.denoise.use(next(iter(models.cards)))
    rest(context, qtbot)
    models.asked.clear()
    track, covered, keys = context.denoised, [], []
    track.changed.connect(lambda: covered.append(track.known.copy()))
    track.changed.connect(lambda: keys.append(track.key))
    context.edits.place_sensor(VirtualSensor(position_m=(1.0, 0.0, 0.0)))
    rest(context, qtbot)
    # What is in view comes first, and nothing is shown that there was no input of.
    first = next(known for known in covered if known.any())
    assert set(np.flatnonzero(first)) <= set(range(60, 75))
    assert len(models.asked) > 1
    assert models.asked[-1][0] == FRAMES
    assert is_of(context, 2.0)
    assert track.key is not None  # it is kept
    assert all(key is None for key, known in zip(keys, covered, strict=True) if not known.all())


def test_a_model_of_another_frame_rate_gives_what_it_gives_the_whole_clip(
    context, models, qtbot, ball
):
    for path, card in models.cards.items():
        models.cards[path] = replace(card, frame_rate_hz=25.0)
    open_it(context, qtbot, ball)
    context.denoise.use(next(iter(models.cards)))
    rest(context, qtbot)
    assert is_of(context, 2.0)


def test_a_long_clip_is_a_job_that_can_be_cancelled(context, models, qtbot, ball, monkeypatch):
    monkeypatch.setattr(denoised_map, "_LISTED", 8)
    open_it(context, qtbot, ball)
    models.gate.clear()
    context.denoise.use(next(iter(models.cards)))
    qtbot.waitUntil(
        lambda: any(job.title == "Denoising the map" for job in context.jobs.jobs), timeout=10_000
    )
    context.jobs.cancel(context.jobs.jobs[-1])
    models.gate.set()
    rest(context, qtbot)
    assert not context.jobs.jobs
    assert context.denoised.map is None
    context.edits.place_sensor(VirtualSensor(position_m=(1.0, 0.0, 0.0)))
    rest(context, qtbot)
    assert is_of(context, 2.0)


# --- before and after, export -------------------------------------------------------------


def test_the_model_before_can_be_shown_beside_this_one(context, models, qtbot, ball):
    one, two = models.cards
    open_it(context, qtbot, ball)
    context.denoise.use(one)
    rest(context, qtbot)
    context.denoise.set_comparing(True)
    assert context.before.map is None  # there was none
    assert not context.denoise.comparing
    context.denoise.use(two)
    rest(context, qtbot)
    assert context.denoise.before.name == "one"
    assert is_of(context, 3.0)
    expected = fading(context.synthetic.map.values, np.float32(2.0))
    np.testing.assert_allclose(context.before.map.values, expected, rtol=1e-5, atol=1e-9)
    assert context.before.status == "one (simulated data only)"
    context.edits.begin_sensor_drag()
    context.edits.drag_sensor((0.5, 0.0, 0.0))
    qtbot.waitUntil(lambda: not context.synthesis.busy, timeout=10_000)
    expected = fading(context.synthetic.map.values, np.float32(2.0))
    np.testing.assert_allclose(context.before.map.values, expected, rtol=1e-5, atol=1e-9)
    context.edits.end_drag()
    context.denoise.set_comparing(False)
    assert context.before.map is None


def test_the_exported_map_says_where_it_comes_from(context, models, qtbot, ball, tmp_path):
    open_it(context, qtbot, ball)
    with pytest.raises(Sd2Error, match="No model"):
        context.denoise.export(tmp_path / "map.npz")
    context.denoise.use(next(iter(models.cards)))
    rest(context, qtbot)
    assert context.denoise.can_export
    context.denoise.export(tmp_path / "map.npz")
    made = DopplerMap.load(tmp_path / "map.npz")
    assert made.kind == "denoised"
    np.testing.assert_allclose(made.values, context.denoised.map.values, rtol=1e-5, atol=1e-9)
    assert made.meta["denoiser"]["name"] == "one"
    assert "sensor" in made.meta["input"]


def test_closing_lets_go_of_the_models(context, models, qtbot, ball):
    open_it(context, qtbot, ball)
    models.gate.clear()
    context.denoise.use(next(iter(models.cards)))
    qtbot.waitUntil(lambda: context.denoise.map.busy, timeout=10_000)
    context.close()
    assert models.closed


# --- the library's own --------------------------------------------------------------------


@pytest.mark.slow
def test_a_real_model_gives_the_map_that_the_library_gives(
    qapp, compiled_kernels, qtbot, ball, tmp_path
):
    import torch

    from sd2core.denoise.files import load_model, save_model
    from sd2core.denoise.live import TrainedDenoiser
    from sd2core.denoise.registry import build

    torch.manual_seed(0)
    network = build("gru", 32, channels=8)
    with torch.no_grad():
        for parameter in network.parameters():
            parameter += 0.3 * torch.randn_like(parameter)
    card = replace(card_of(tmp_path), options={"channels": 8}, path=None)
    save_model(tmp_path / "own.safetensors", TrainedDenoiser(network, card))
    parent = QObject()
    context = build_models(parent, Settings.forgetful(), Parts(accuracy=FakeAccuracy().library))
    open_it(context, qtbot, ball)
    context.denoise.use(tmp_path / "own.safetensors")
    qtbot.waitUntil(lambda: not context.denoise.busy, timeout=120_000)
    expected = load_model(tmp_path / "own.safetensors").denoise(context.synthetic.map).values
    assert expected.any()
    np.testing.assert_allclose(
        context.denoised.map.values, expected, rtol=1e-4, atol=1e-6 * expected.max()
    )
    context.edits.begin_sensor_drag()
    context.edits.drag_sensor((0.5, 0.0, 0.0))
    qtbot.waitUntil(lambda: not context.synthesis.busy, timeout=20_000)
    assert context.denoised.covered is None
    moved = load_model(tmp_path / "own.safetensors").denoise(context.synthetic.map).values
    np.testing.assert_allclose(
        context.denoised.map.values, moved, rtol=1e-4, atol=1e-6 * moved.max()
    )
    assert not np.allclose(moved, expected)
    context.edits.end_drag()
    context.close()
    parent.deleteLater()
