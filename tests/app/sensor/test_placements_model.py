"""Placements in the window, without a window."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from PySide6.QtCore import QObject, Signal

from sd2app.accuracy.measurements import InUse
from sd2app.sensor.placements import (
    PlacementFields,
    PlacementsModel,
    cost_text,
    count_text,
    current_text,
    limit_facts,
    limits_text,
)
from sd2app.session.sensor import SensorModel
from sd2app.widgets.text import bytes_text
from sd2core.accuracy.plans import AccuracyPlan
from sd2core.mesh.sequence import MeshSequence
from sd2core.placements.placements import PlacementCloud, PlacementGrid
from sd2core.radar_profiles import RADARS
from sd2core.sensor import Beam, VirtualSensor
from sd2core.timebase import Timebase


class Document(QObject):
    opened, changed = Signal(), Signal()
    capture = None

    def __init__(self):
        super().__init__()
        self.mesh = self.recording = None

    def open(self, mesh, plan=None):
        self.mesh = mesh
        self.recording = type("Recording", (), {"placements": plan})()
        self.opened.emit()
        self.changed.emit()


class Trade(QObject):
    plan_changed = Signal()
    in_use = None
    frames = 10


class Edits:
    """Assigns at once and counts steps."""

    def __init__(self, document, sensor):
        self.document, self.sensor, self.steps = document, sensor, []

    def plan_placements(self, plan):
        self.type_placements(plan)
        self.end_drag()

    def type_placements(self, plan):
        self.document.recording.placements = plan
        self.document.changed.emit()

    def end_drag(self):
        self.steps.append(self.document.recording.placements)

    def place_sensor(self, sensor, text):
        self.steps.append(text)
        self.sensor.set_sensor(sensor)


def a_cube(fast=False):
    """A cube of 1 m, 3 m ahead, that goes to and fro by 0.5 m ten times a second when fast."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / 2
    depth = 3.0 + (0.5 * (np.arange(10) % 2) if fast else np.zeros(10))
    vertices = corners[None] + depth[:, None, None] * (0.0, 0.0, 1.0)
    return MeshSequence(vertices.astype(np.float32), None, Timebase.regular(10, 10.0))


@pytest.fixture
def stage(qtbot):
    document, sensor, trade = Document(), SensorModel(), Trade()
    edits = Edits(document, sensor)
    model = PlacementsModel(
        SimpleNamespace(document=document, sensor=sensor, edits=edits), trade, sensor
    )
    model.test = (document, sensor, trade, edits)
    yield model
    model.close()


def settle(qtbot, model):
    qtbot.waitUntil(lambda: not model.busy and model.planned.coverage is not None, timeout=10_000)


GRID = PlacementGrid((1.0, 2.0, 12.0), (0.0, 30.0))


def test_places_follow_the_plan_of_the_recording(stage, qtbot):
    document, *_ = stage.test
    document.open(a_cube(), GRID)
    settle(qtbot, stage)
    assert stage.planned.places == GRID.places()
    assert stage.planned.sensors == GRID.sensors((0.0, 0.0, 3.0))
    stage.edits.plan_placements(None)
    assert stage.planned.sensors == ()
    assert count_text(stage) == ""
    stage.edits.plan_placements(PlacementGrid((1.0,)))
    settle(qtbot, stage)
    assert count_text(stage) == "1 placement"


def test_another_recording_has_other_places(stage, qtbot):
    document, *_ = stage.test
    document.open(a_cube(), GRID)
    settle(qtbot, stage)
    document.open(a_cube(), None)
    assert stage.planned.sensors == ()
    assert not stage.busy
    document.open(None, GRID)
    assert not stage.possible
    assert stage.planned.sensors == ()


def test_what_is_beyond_the_radar_is_counted(stage, qtbot):
    document, *_ = stage.test
    document.open(a_cube(fast=True), PlacementGrid((0.4, 2.0, 12.0)))
    settle(qtbot, stage)
    # 0.4 m before its middle is in the cube; 5 m/s towards the sensor is too fast everywhere.
    assert dict(limit_facts(stage)) == {
        "In the body": "1",
        "Beyond R max 9.6 m": "1",
        "Faster than ±3.20 m/s": "3",
    }
    document.open(a_cube(), PlacementGrid((2.0,)))
    settle(qtbot, stage)
    assert limit_facts(stage) == []
    assert limits_text(stage).startswith("All within")
    document.capture = SimpleNamespace(config=RADARS["cw-5.8ghz"])
    assert ": none, ±4.14" in limits_text(stage)


def test_the_cost_is_that_of_the_plan_in_use_times_the_places(stage, qtbot):
    document, _, trade, _ = stage.test
    document.open(a_cube(), GRID)
    settle(qtbot, stage)
    assert stage.cost is None
    trade.in_use = InUse(AccuracyPlan(), 0.01, 2.5)
    with qtbot.waitSignal(stage.changed):
        trade.plan_changed.emit()
    assert stage.cost.total_s == pytest.approx(6 * 10 * 2.5e-3)
    assert stage.cost.total_bytes == 6 * 10 * (32 * 4 + 8)
    assert cost_text(stage.cost) == "6 maps in about 150 ms, 8.2 kB"


def test_the_sensor_steps_from_place_to_place_and_keeps_its_beam(stage, qtbot):
    document, sensor, _, edits = stage.test
    document.open(a_cube(), GRID)
    sensor.set_sensor(VirtualSensor((9.0, 9.0, 9.0), beam=Beam(50.0, 30.0)))
    settle(qtbot, stage)
    assert stage.current is None
    assert current_text(stage) == "The sensor is elsewhere"
    for wanted in (0, 1, 2):
        stage.step(1)
        assert stage.current == wanted
    stage.step(-1)
    assert current_text(stage) == "2 of 6: 1 m, azimuth 30°, elevation 0°"
    stage.use(5)
    stage.step(1)
    assert stage.current == 0
    assert sensor.sensor.beam == Beam(50.0, 30.0)
    assert len(edits.steps) == 6
    stage.use(99)
    assert stage.current == 0


def test_fields_become_the_plan_and_say_what_is_wrong(stage):
    document, _, _, edits = stage.test
    document.open(a_cube())
    fields = PlacementFields(stage)
    assert fields.kind == "none"
    assert fields.texts == {}
    fields.set_kind("grid")
    assert fields.texts["range"] == "1:4:1"
    fields.set_text("range", "1, 2.5,")
    assert "not a number" in fields.problem
    assert stage.plan.ranges_m == (1.0, 2.0, 3.0, 4.0)
    fields.set_text("range", "1, 2.5")
    assert fields.problem == ""
    assert stage.plan.ranges_m == (1.0, 2.5)
    fields.set_text("elevation", "100")
    assert "elevation 100°" in fields.problem
    fields.set_text("elevation", "0:40:20")
    fields.end()
    assert stage.plan.elevations_deg == (0.0, 20.0, 40.0)
    assert len(edits.steps) == 2


def test_what_was_typed_stays_as_it_was_typed_and_comes_back_with_its_kind(stage):
    document, *_ = stage.test
    document.open(a_cube())
    fields = PlacementFields(stage)
    fields.set_kind("cloud")
    fields.set_text("count", "007")
    fields.set_text("range", "1.0 : 2")
    assert (fields.texts["count"], fields.texts["range"]) == ("007", "1.0 : 2")
    assert stage.plan == PlacementCloud(7, (1.0, 2.0), (-60.0, 60.0), (-10.0, 40.0))
    for name, text in (("count", "1.5"), ("seed", "-1"), ("azimuth", "5:1"), ("count", "²")):
        fields.set_text(name, text)
        assert fields.problem
    fields.set_kind("grid")
    assert fields.problem == ""
    fields.set_kind("cloud")
    assert stage.plan.count == 7


def test_an_undo_takes_the_place_of_what_was_typed(stage):
    document, _, _, edits = stage.test
    document.open(a_cube(), PlacementGrid((1.0,)))
    fields = PlacementFields(stage)
    fields.set_text("range", "2")
    edits.type_placements(PlacementGrid((1.0,)))
    assert fields.texts["range"] == "1"


@pytest.mark.parametrize(
    ("count", "text"),
    [
        *((0, "0 bytes"), (999, "999 bytes"), (8160, "8.2 kB"), (99_700, "100 kB")),
        *((18_360_000, "18 MB"), (99_700_000, "100 MB"), (2e11, "200 GB")),
    ],
)
def test_bytes_are_said_in_their_unit(count, text):
    assert bytes_text(count) == text
