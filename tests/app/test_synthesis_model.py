"""The synthetic map without a window: order of work, quality, interruption."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

from sd2app.context import build_context
from sd2app.models import synthesis as synthesis_module
from sd2app.settings import Settings
from sd2core.compiled import warm_up


@pytest.fixture(scope="module")
def ball(tmp_path_factory):
    path = tmp_path_factory.mktemp("ball") / "ball.npz"
    shape = trimesh.creation.icosphere(subdivisions=2, radius=0.3)
    times_s = np.arange(90) / 30
    vertices = np.repeat(shape.vertices[None], 90, axis=0)
    vertices[:, :, 2] += 2 + 0.2 * np.sin(2 * np.pi * times_s)[:, None]
    np.savez(path, vertices=vertices, faces=shape.faces, times_s=times_s)
    return path


@pytest.fixture
def context(qapp):
    from PySide6.QtCore import QObject

    warm_up()
    parent = QObject()
    context = build_context(parent, Settings.forgetful())
    yield context
    context.close()
    parent.deleteLater()


def open_ball(context, qtbot, ball):
    with qtbot.waitSignal(context.document.opened, timeout=10_000):
        context.document.open([ball])


def test_rough_comes_before_exact(context, qtbot, ball):
    ranks = []
    context.synthetic.changed.connect(
        lambda: ranks.append(context.synthesis._canvas.rank.copy()) if context.synthetic.map else 0
    )
    open_ball(context, qtbot, ball)
    qtbot.waitUntil(lambda: context.synthesis.complete, timeout=10_000)
    assert (ranks[0] == 1).all()
    assert (ranks[-1] == 3).all()
    lowest = [rank.min() for rank in ranks]
    assert lowest == sorted(lowest)


def test_the_map_is_that_of_the_library(context, qtbot, ball):
    from sd2core.doppler.synthesizer import Synthesizer
    from sd2core.io.mesh import load_mesh

    open_ball(context, qtbot, ball)
    qtbot.waitUntil(lambda: context.synthesis.complete, timeout=10_000)
    expected = Synthesizer(load_mesh(ball), "paper").map(context.sensor.sensor)
    np.testing.assert_allclose(context.synthetic.map.values, expected.values, atol=1e-7)
    assert context.synthetic.map.unit == expected.unit


def test_every_sweep_of_a_fast_hand_is_for_one_placement(context, qtbot, ball):
    open_ball(context, qtbot, ball)
    qtbot.waitUntil(lambda: context.synthesis.complete, timeout=10_000)
    shown = []
    context.synthetic.changed.connect(lambda: shown.append(context.synthesis._canvas.sensor))
    context.edits.begin_sensor_drag()
    for step in range(200):
        context.edits.drag_sensor((step * 0.005, 0.0, 0.0))
        qtbot.wait(1)
    qtbot.waitUntil(lambda: not context.synthesis.busy, timeout=5_000)
    places = [sensor.position_m[0] for sensor in shown]
    assert len(places) > 10
    assert places == sorted(places)
    assert places[-1] == pytest.approx(199 * 0.005)
    context.edits.end_sensor_drag()
    qtbot.waitUntil(lambda: context.synthesis.complete, timeout=10_000)
    assert context.document.undo_stack.count() == 1


def test_a_hand_that_holds_still_gets_the_exact_map(context, qtbot, ball):
    open_ball(context, qtbot, ball)
    qtbot.waitUntil(lambda: context.synthesis.complete, timeout=10_000)
    context.edits.begin_sensor_drag()
    context.edits.drag_sensor((0.2, 0.0, 0.0))
    qtbot.waitUntil(lambda: context.synthetic.status.startswith("preview"), timeout=5_000)
    qtbot.waitUntil(lambda: context.synthesis.complete, timeout=10_000)
    assert context.sensor.dragging
    context.edits.drag_sensor((0.3, 0.0, 0.0))
    qtbot.waitUntil(lambda: context.synthetic.status.startswith("preview"), timeout=5_000)
    context.edits.end_sensor_drag()


def test_another_recording_replaces_work_under_way(context, qtbot, ball, tmp_path):
    still = tmp_path / "still.npz"
    with np.load(ball) as data:
        np.savez(still, vertices=np.repeat(data["vertices"][:1], 5, axis=0), faces=data["faces"])
    open_ball(context, qtbot, ball)
    with qtbot.waitSignal(context.document.opened, timeout=10_000):
        context.document.open([still])
    qtbot.waitUntil(lambda: context.synthesis.complete, timeout=10_000)
    assert context.synthetic.map.values.shape == (32, 5)
    assert context.synthetic.map.values.max() == 0


def test_without_machine_code_exact_waits_for_the_compiler(context, qtbot, ball, monkeypatch):
    state = {"ready": False, "exit": None}
    compiler = SimpleNamespace(poll=lambda: state["exit"])
    monkeypatch.setattr(synthesis_module, "kernels_ready", lambda: state["ready"])
    monkeypatch.setattr(synthesis_module, "compile_in_background", lambda: compiler)
    open_ball(context, qtbot, ball)
    qtbot.waitUntil(lambda: "compiling" in context.synthetic.status, timeout=10_000)
    assert not context.synthesis.complete
    state.update(ready=True, exit=0)
    qtbot.waitUntil(lambda: context.synthesis.complete, timeout=10_000)
    assert context.synthetic.status == "exact visibility"


def test_a_compiler_that_fails_does_not_keep_exact_away(context, qtbot, ball, monkeypatch):
    compiler = SimpleNamespace(poll=lambda: 1)
    monkeypatch.setattr(synthesis_module, "kernels_ready", lambda: False)
    monkeypatch.setattr(synthesis_module, "compile_in_background", lambda: compiler)
    open_ball(context, qtbot, ball)
    qtbot.waitUntil(lambda: context.synthesis.complete, timeout=30_000)


def test_levels_keep_their_reference_until_asked(context, qtbot, ball):
    open_ball(context, qtbot, ball)
    qtbot.waitUntil(lambda: context.synthesis.complete, timeout=10_000)
    reference = context.synthetic.reference
    assert reference > 0
    context.edits.begin_sensor_drag()
    context.edits.drag_sensor((0.0, 0.0, -5.0))
    context.edits.end_sensor_drag()
    qtbot.waitUntil(lambda: context.synthesis.complete, timeout=10_000)
    assert context.synthetic.reference == reference
    context.reset_references()
    assert context.synthetic.reference < reference
