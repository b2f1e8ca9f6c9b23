"""How well the map is known, by key and mouse."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import QCheckBox, QToolButton
from window_models import models_of

from sd2app.maps.heatmap import HeatmapView
from sd2app.maps.level_bar import LevelBar
from sd2app.maps.readout import reading_lines
from sd2app.sensor.panel import SensorPanel
from sd2core.io.mesh import load_mesh, save_mesh
from sd2core.maps import DopplerMap
from sd2core.mesh.velocity_uncertainty import VelocityUncertainty
from sd2core.sensor import VirtualSensor


@pytest.fixture
def fitted(empty_window, recording_copy, qtbot):
    """The window on the ball, whose velocity is known to ±0.5 m/s from the camera."""
    ball = load_mesh(recording_copy / "mesh.npz")
    frames = ball.frame_count
    known = VelocityUncertainty(
        ("ball",),
        np.zeros(ball.vertex_count, int),
        np.full((frames, 1), 0.5),
        np.full((frames, 1), 0.001),
    )
    save_mesh(replace(ball, uncertainty=known), recording_copy / "mesh.npz")
    with qtbot.waitSignal(models_of(empty_window).document.opened, timeout=20_000):
        empty_window.open_paths([recording_copy])
    wait(empty_window, qtbot)
    return empty_window


def wait(window, qtbot):
    c = models_of(window)
    qtbot.waitUntil(
        lambda: window.settled and c.synthesis.complete and not c.uncertainty.busy, timeout=20_000
    )


def colour_of(view):
    """How far from grey is what is shown of the ball at its fastest."""
    image = view.grab().toImage()
    x, y = round(view.scale.x_of(0.5)), round(view.y_of(1.2))
    return int(np.ptp(image.pixelColor(x, y).getRgb()[:3]))


@pytest.mark.slow
def test_what_is_not_known_has_no_colour_until_a_key_gives_it(fitted, qtbot, tmp_path):
    c, view = models_of(fitted), fitted.findChildren(HeatmapView)[0]
    assert c.trade.in_use.body > 0.2, "so badly known that no key is needed"
    assert fitted.action("uncertain").isChecked()
    assert c.synthetic.uncertainty is not None
    assert colour_of(view) < 10
    assert "grey: ±50 % or worse" in view.status()
    place = QPoint(round(view.scale.x_of(0.5)), round(view.y_of(1.2)))
    qtbot.mouseMove(view, place)
    reading = c.pointer.reading
    frame = reading.frame
    known = c.synthetic.uncertainty
    missed = known.expected[25, frame] - reading.value
    assert reading.deviation == pytest.approx(np.hypot(known.sd[25, frame], missed), rel=1e-5)
    assert reading.deviation > 0.5 * reading.value
    assert f"{reading.value:.3g} ± {reading.deviation:.2g}" in reading_lines(reading)[1]
    c.synthesis.export(tmp_path / "map.npz")
    np.testing.assert_array_equal(
        DopplerMap.load(tmp_path / "map.npz").uncertainty.sd, c.synthetic.uncertainty.sd
    )
    qtbot.keyClick(fitted, Qt.Key.Key_U)
    assert c.synthetic.uncertainty is None
    assert colour_of(view) > 40
    qtbot.mouseMove(view, place + QPoint(1, 0))
    assert c.pointer.reading.deviation is None


@pytest.mark.slow
def test_it_follows_the_sensor_and_is_remembered(fitted, qtbot):
    c, view = models_of(fitted), fitted.findChildren(HeatmapView)[0]
    button = next(
        b for b in fitted.findChild(LevelBar).findChildren(QToolButton) if b.text() == "Uncertain"
    )
    for checked in (False, True):
        qtbot.mouseClick(button, Qt.MouseButton.LeftButton)
        wait(fitted, qtbot)
        assert button.isChecked() == checked
    assert c.settings.stored("uncertain_cells", False)
    ahead = c.synthetic.uncertainty
    # From aside, across the camera's view, velocities are known well.
    c.edits.place_sensor(VirtualSensor(position_m=(2.0, 0.0, 2.0)), "Move sensor")
    assert c.synthetic.uncertainty is not ahead or c.synthesis.busy
    wait(fitted, qtbot)
    aside = c.synthetic.uncertainty
    assert aside is not None
    assert aside.sd.max() < 0.5 * ahead.sd.max()
    qtbot.keyClick(fitted, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    wait(fitted, qtbot)
    np.testing.assert_allclose(c.synthetic.uncertainty.sd, ahead.sd)
    assert view.isVisible()


def test_without_knowledge_the_action_says_why(window, qtbot):
    action = window.action("uncertain")
    assert not action.isEnabled()
    assert "does not say how well its velocities are known" in action.toolTip()
    button = next(
        b for b in window.findChild(LevelBar).findChildren(QToolButton) if b.text() == "Uncertain"
    )
    assert not button.isEnabled()
    assert button.toolTip() == action.toolTip()
    qtbot.keyClick(window, Qt.Key.Key_U)
    assert not models_of(window).uncertainty.shown
    assert models_of(window).synthetic.uncertainty is None


@pytest.mark.slow
def test_closing_while_it_is_found_is_safe(fitted, qtbot):
    for _ in range(2):  # off, and on again
        qtbot.keyClick(fitted, Qt.Key.Key_U)
    assert models_of(fitted).uncertainty.busy
    models_of(fitted).document.undo_stack.clear()
    fitted.close()


def counting(panel) -> QCheckBox:
    """The box that spreads vertices over bins."""
    return next(one for one in panel.findChildren(QCheckBox) if one.text() == "expected map")


def test_counting_is_chosen_by_hand_and_the_title_states_one_accuracy(fitted, qtbot, tmp_path):
    c, (panel,) = models_of(fitted), fitted.findChildren(SensorPanel)
    fitted.bring_up("Sensor", "Sensor")
    expected = c.synthetic.map.values.copy()
    accuracy = c.trade.in_use.accuracy
    assert accuracy.startswith("±")
    assert "(body " in accuracy
    assert c.synthetic.status.startswith(accuracy)
    c.synthesis.export(tmp_path / "map.npz")
    assert str(DopplerMap.load(tmp_path / "map.npz").accuracy) == accuracy

    box = counting(panel)
    qtbot.mouseClick(box, Qt.MouseButton.LeftButton, pos=QPoint(8, box.height() // 2))
    assert c.document.count == "plain"
    wait(fitted, qtbot)
    plain = c.synthetic.map.values.copy()
    assert np.abs(plain - expected).sum() > 0.1 * plain.sum()
    assert c.synthesis.whole_map().meta["count"] == "plain"
    qtbot.keyClick(fitted, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert c.document.count == "expected"
    assert box.isChecked()
    wait(fitted, qtbot)
    np.testing.assert_array_equal(c.synthetic.map.values, expected)


def test_a_mesh_that_says_nothing_offers_no_counting(window):
    (panel,) = window.findChildren(SensorPanel)
    assert counting(panel).isHidden()
