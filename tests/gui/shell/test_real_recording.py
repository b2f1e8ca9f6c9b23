"""A real video with a fitted mesh, and a real radar capture, in the whole window."""

from __future__ import annotations

import numpy as np
import pytest
from window_models import models_of

from sd2core.figures.surface import shade_mesh


@pytest.fixture
def walk(empty_window, shared_data, qtbot):
    document = models_of(empty_window).document
    with qtbot.waitSignal(document.opened, timeout=30_000):
        empty_window.open_paths(
            [shared_data / "video" / "walk.mkv", shared_data / "mesh" / "walk.npz"]
        )
    qtbot.waitUntil(lambda: empty_window.settled, timeout=60_000)
    qtbot.waitUntil(lambda: models_of(empty_window).synthesis.complete, timeout=60_000)
    return empty_window


@pytest.mark.slow
def test_the_mesh_lies_on_the_person(walk, qtbot):
    c = models_of(walk)
    for frame in (20, 44, 70):
        c.playback.seek_frame(frame)
        qtbot.waitUntil(lambda frame=frame: c.video.shown_frame == frame, timeout=10_000)
        red, green, blue = (c.video.picture[:, :, k].astype(int) for k in range(3))
        pullover = (red - blue > 90) & (red - green > 20)
        mesh = c.document.mesh
        body = shade_mesh(mesh.frame(frame), mesh.faces, c.document.camera) > 0
        # She wears the only thing of that orange. A pullover is wider than the body in it.
        assert (pullover & body).sum() > 0.7 * pullover.sum()
        assert body.sum() < 4 * pullover.sum()


@pytest.mark.slow
def test_the_sensor_drag_is_followed(walk, qtbot):
    c = models_of(walk)
    before = c.synthetic.map.values.copy()
    c.edits.begin_sensor_drag()
    for step in range(10):
        c.edits.drag_sensor((0.08 * step, 0.0, 0.0))
        qtbot.wait(5)
    qtbot.waitUntil(lambda: not np.array_equal(before, c.synthetic.map.values), timeout=5_000)
    c.edits.end_drag()
    qtbot.waitUntil(lambda: c.synthesis.complete, timeout=60_000)
    assert c.document.undo_stack.count() == 1
    assert walk.messages.text == ""


def test_a_real_capture_shows_a_person_receding(empty_window, shared_data, qtbot):
    c = models_of(empty_window)
    with qtbot.waitSignal(c.document.opened, timeout=30_000):
        empty_window.open_paths([shared_data / "radar" / "infineon_people"])
    qtbot.waitUntil(lambda: c.real.map is not None, timeout=30_000)
    assert c.real.title == "Real"
    assert c.real.map.kind == "real"
    assert c.synthetic.map is None
    values, times_s = c.real.map.values, c.real.map.times_s
    receding, approaching = values[:14].sum(axis=0), values[18:].sum(axis=0)
    late = times_s > 1.8
    assert (receding[late] > approaching[late]).mean() > 0.9
    # Before it somebody stands there: nothing moves away faster than 0.25 m/s.
    assert receding[times_s < 1.25].max() < 0.02 * receding[late].mean()
