"""The beam of the sensor by real keys: chosen, typed, aimed, undone, kept, seen."""

from __future__ import annotations

from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLabel
from window_models import models_of

from sd2app.sensor.panel import BeamForm, SensorPanel
from sd2app.widgets.inputs import Choice, NumberBox
from sd2core.recording.recording import open_recording
from sd2core.sensor import Beam, VirtualSensor


def form_of(window) -> BeamForm:
    return window.findChild(BeamForm)


def choose(window, text: str) -> None:
    """Walk through the list by the arrow keys to a line that begins like this."""
    choice = form_of(window).findChild(Choice)
    choice.setFocus()
    texts = [choice.itemText(line) for line in range(choice.count())]
    wanted = next(line for line, one in enumerate(texts) if one.startswith(text))
    step = Qt.Key.Key_Down if wanted > choice.currentIndex() else Qt.Key.Key_Up
    for _ in range(abs(wanted - choice.currentIndex())):
        QTest.keyClick(choice, step)


def type_into(window, tip: str, text: str) -> None:
    boxes = form_of(window).findChildren(NumberBox)
    box = next(box for box in boxes if box.accessibleName().endswith(tip))
    box.setFocus()
    box.selectAll()
    QTest.keyClicks(box, text)
    QTest.keyClick(box, Qt.Key.Key_Return)


def in_the_beam(window) -> str:
    labels = window.findChild(SensorPanel).findChildren(QLabel)
    value = next(one for one in labels if "half power" in one.toolTip())
    return value.text() if value.isVisible() else ""


def test_a_beam_is_chosen_typed_and_undone(window, qtbot):
    sensor, undo = models_of(window).sensor, models_of(window).document.undo_stack
    assert in_the_beam(window) == ""
    assert not any(box.isVisible() for box in form_of(window).findChildren(NumberBox))
    choose(window, "by")
    assert sensor.sensor.beam == Beam(60.0, 60.0)
    assert undo.undoText() == "Set beam"
    type_into(window, "across", "40")
    type_into(window, "in height", "10")
    assert sensor.sensor.beam == Beam(40.0, 10.0)
    type_into(window, "to the right", "-120")
    assert sensor.sensor.azimuth_deg == pytest.approx(-120.0)
    assert undo.undoText() == "Turn sensor"
    qtbot.waitUntil(lambda: in_the_beam(window) == "0 % of the echo")
    window.action("aim_sensor").trigger()
    qtbot.waitUntil(lambda: in_the_beam(window) not in ("0 % of the echo", "–", ""))
    for _ in range(5):
        undo.undo()
    assert sensor.sensor.beam is None
    assert in_the_beam(window) == ""


def test_a_map_follows_what_the_sensor_looks_at(window, qtbot):
    c = models_of(window)
    qtbot.waitUntil(lambda: c.synthesis.complete)
    alike = c.synthetic.map.values.sum()
    choose(window, "by")
    window.action("aim_sensor").trigger()
    qtbot.waitUntil(lambda: c.synthesis.complete and c.synthetic.map.values.sum() != alike)
    aimed = c.synthetic.map.values.sum()
    assert 0 < aimed < alike
    type_into(window, "to the right", "180")
    qtbot.waitUntil(lambda: c.synthesis.complete and c.synthetic.map.values.sum() != aimed)
    assert c.synthetic.map.values.sum() < 1e-3 * aimed


def test_a_table_is_read_and_one_that_is_none_leaves_the_beam(
    window, qtbot, tmp_path: Path, monkeypatch
):
    sensor = models_of(window).sensor
    table = tmp_path / "antenna.csv"
    table.write_text("-90,-20,-30\n0,0,0\n90,-20,-30\n")
    monkeypatch.setattr("sd2app.sensor.panel.ask_file", lambda *_: table)
    choose(window, "from")
    beam = sensor.sensor.beam
    assert len(beam.cuts) == 3
    assert form_of(window).findChild(Choice).currentText() == "from a table…"
    table.write_text("nothing")
    choose(window, "IWR1443")
    choose(window, "from")
    assert sensor.sensor.beam == Beam(56.0, 28.0)
    assert form_of(window).findChild(Choice).currentText() == "IWR1443's board"


def test_a_beam_is_kept_in_the_recording(window, qtbot, tmp_path: Path):
    choose(window, "by")
    type_into(window, "across", "33")
    folder = tmp_path / "kept.sd2"
    models_of(window).document.save_as(folder)
    assert open_recording(folder).sensor.beam == Beam(33.0, 60.0)


def test_a_direction_beyond_a_turn_is_shown_within_one_and_typed_alone(window, qtbot):
    c = models_of(window)
    over = VirtualSensor((0.0, 0.0, 0.0), 400.0, 12.34, Beam(60.04, 30.0))
    c.session.edits.place_sensor(over)
    shown = {box.accessibleName(): box.value() for box in form_of(window).findChildren(NumberBox)}
    assert shown["Direction of the boresight, to the right"] == 40.0
    type_into(window, "upwards", "-5")
    type_into(window, "in height", "20")
    sensor = c.sensor.sensor
    # What was not typed is as it was, to all its digits.
    assert (sensor.azimuth_deg, sensor.elevation_deg) == (400.0, -5.0)
    assert sensor.beam == Beam(60.04, 20.0)
