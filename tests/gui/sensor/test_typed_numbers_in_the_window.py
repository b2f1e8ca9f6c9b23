"""Numbers typed into the Sensor panel by real keys: understood, refused with a sentence, marked."""

from __future__ import annotations

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLabel, QToolTip
from window_models import models_of

from sd2app.scene.view import SceneView
from sd2app.sensor.panel import SensorPanel
from sd2app.sensor.placements import PlacementFields
from sd2app.widgets.inputs import NumberBox, TypedLine


def box_of(window, tip: str) -> NumberBox:
    boxes = window.findChild(SensorPanel).findChildren(NumberBox)
    return next(box for box in boxes if box.accessibleName().startswith(tip))


def type_into(box, text: str, key: Qt.Key | None = Qt.Key.Key_Return) -> None:
    """Put the keyboard on a box and type."""
    box.setFocus()
    box.selectAll()
    QTest.keyClicks(box, text)
    if key is not None:
        QTest.keyClick(box, key)


def range_m(window) -> float:
    """Distance from the sensor to what its angles are about."""
    c = models_of(window)
    return float(np.linalg.norm(np.subtract(c.sensor.sensor.position_m, c.synthesis.torso_m)))


def warnings_in(window) -> str:
    labels = window.findChild(SensorPanel).findChildren(QLabel)
    return " ".join(
        one.text() for one in labels if one.objectName() == "warning" and not one.isHidden()
    )


@pytest.fixture
def active(window, qtbot):
    window.activateWindow()
    qtbot.waitUntil(window.isActiveWindow, timeout=5000)
    return window


@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("text", "metres"),
    [("250cm", 2.5), ("2500 mm", 2.5), ("2,5", 2.5), ("1.75 m", 1.75), ("3", 3.0), ("0.2", 0.2)],
)
def test_a_range_is_understood(active, text: str, metres: float) -> None:
    box = box_of(active, "Range")
    type_into(box, text)
    assert range_m(active) == pytest.approx(metres, abs=0.005)
    assert box.value() == pytest.approx(metres, abs=0.005)
    assert box.text() == f"{metres:.2f} m"
    assert not box.hasFocus()
    models_of(active).document.undo_stack.undo()


@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("250kg", "“250kg” is not a length"),
        ("far", "“far” is not a length"),
        ("2500", "out of range"),
        ("0", "out of range"),
    ],
)
def test_what_is_no_range_is_refused_with_a_sentence(active, qtbot, text: str, said: str) -> None:
    box, before_m = box_of(active, "Range"), range_m(active)
    type_into(box, text)
    qtbot.waitUntil(lambda: said in QToolTip.text(), timeout=5000)
    assert "Expected: " in QToolTip.text()
    assert range_m(active) == before_m
    assert models_of(active).document.undo_stack.count() == 0
    # It can be mended, or taken back.
    assert box.hasFocus()
    QTest.keyClick(box, Qt.Key.Key_Escape)
    assert box.text() == f"{before_m:.2f} m"
    assert not box.hasFocus()
    type_into(box, text, key=None)
    refused: list[str] = []
    box.refused.connect(refused.append)
    active.findChild(SensorPanel).setFocus()
    box.clearFocus()
    assert said in refused[0]
    assert box.text() == f"{before_m:.2f} m"
    assert range_m(active) == before_m


def test_an_angle_in_radians(active) -> None:
    box = box_of(active, "Azimuth")
    type_into(box, "0.5rad")
    assert box.value() == pytest.approx(np.degrees(0.5), abs=0.06)
    models_of(active).document.undo_stack.undo()


def test_a_range_beyond_the_radars_is_marked(active) -> None:
    box, radar = box_of(active, "Range"), models_of(active).placements.radar
    assert "R max" not in warnings_in(active)
    type_into(box, f"{radar.range_max_m + 1:.2f}")
    assert f"beyond R max of {radar.name}, {radar.range_max_m:.1f} m" in warnings_in(active)
    assert box.objectName() == "marked"
    type_into(box, f"{radar.range_max_m - 1:.2f}")
    assert "R max" not in warnings_in(active)
    assert box.objectName() == ""
    for _ in range(2):
        models_of(active).document.undo_stack.undo()


def test_ranges_of_placements_have_units_too(active) -> None:
    c = models_of(active)
    window = active
    window.bring_up("Sensor", "Placements")
    fields = window.findChild(SensorPanel).window().findChildren(TypedLine)
    page = next(one for one in fields if one.accessibleName() == "Ranges, m")
    kinds = window.findChild(PlacementFields)
    kinds.set_kind("grid")
    QApplication.processEvents()
    type_into(page, "150cm, 2, 3000 mm", key=None)
    assert c.placements.plan.ranges_m == (1.5, 2.0, 3.0)
    type_into(page, "1, 2 kg", key=None)
    assert "'2 kg' is not a number" in kinds.problem
    assert c.placements.plan.ranges_m[-1] != 2000
    QTest.keyClick(page, Qt.Key.Key_Return)
    window.bring_up("Sensor", "Sensor")
    c.document.undo_stack.setIndex(0)


def test_signs_around_a_number_and_a_word_in_its_place(qtbot) -> None:
    box = NumberBox(0.0, 10.0, " s", "How long")
    qtbot.addWidget(box)
    box.setPrefix("× ")
    box.setSpecialValueText("never")
    box.show()
    assert box.text() == "never"
    type_into(box, "1.5")
    assert (box.value(), box.text()) == (1.5, "× 1.50 s")
    type_into(box, "250ms")
    assert box.value() == 0.25
    QTest.keyClick(box, Qt.Key.Key_Up)
    assert box.value() == pytest.approx(0.35)
    type_into(box, "0")
    assert box.text() == "never"
    type_into(box, "")
    assert box.value() == 0.0


def test_a_range_typed_into_the_panel_keeps_it_in_sight(active) -> None:
    scene = active.findChild(SceneView).scene
    type_into(box_of(active, "Range"), "6")
    assert range_m(active) == pytest.approx(6.0, abs=0.01)
    assert scene.sensor_in_sight
    active.action("undo").trigger()
    assert scene.sensor_in_sight
