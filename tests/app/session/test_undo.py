from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sd2app.session.content import load_content, recording_of
from sd2app.session.document import DocumentModel
from sd2app.session.sensor import SensorModel
from sd2app.session.tasks import TaskList
from sd2app.session.undo import Edits
from sd2core.mesh.things import Thing
from sd2core.sensor import VirtualSensor


def write_points(path):
    vertices = np.random.default_rng(0).normal(size=(4, 5, 3))
    vertices[..., 2] += 3.0
    np.savez(path, vertices=vertices)
    return path


def open_document(qtbot, path):
    document = DocumentModel(TaskList())
    write_points(path)
    with qtbot.waitSignal(document.opened):
        document.open([path])
    return document


@pytest.fixture
def document(qtbot, tmp_path):
    document = open_document(qtbot, tmp_path / "points.npz")
    yield document
    document.close()


positions = st.tuples(*[st.floats(-5, 5)] * 3)


def test_a_drag_is_one_step(document):
    sensor = SensorModel()
    edits = Edits(document, sensor)
    seen = []
    sensor.changed.connect(lambda: seen.append(sensor.sensor.position_m))
    edits.begin_sensor_drag()
    for x in (0.1, 0.2, 0.3):
        assert sensor.dragging
        edits.drag_sensor((x, 0.0, 0.0))
    edits.end_drag()
    assert not sensor.dragging
    assert len(seen) == 3
    assert document.undo_stack.count() == 1
    assert document.undo_stack.undoText() == "Move sensor"
    document.undo_stack.undo()
    assert sensor.sensor == VirtualSensor()
    document.undo_stack.redo()
    assert sensor.sensor.position_m == (0.3, 0.0, 0.0)
    assert document.recording.sensor == sensor.sensor


def test_a_drag_back_to_the_start_is_no_step(document):
    edits = Edits(document, SensorModel())
    edits.begin_sensor_drag()
    edits.drag_sensor((1.0, 0.0, 0.0))
    edits.drag_sensor((0.0, 0.0, 0.0))
    edits.end_drag()
    assert document.undo_stack.count() == 0


def test_an_edit_in_the_middle_of_a_drag_is_a_step_after_it(document):
    sensor = SensorModel()
    edits = Edits(document, sensor)
    edits.begin_sensor_drag()
    edits.drag_sensor((1.0, 0.0, 0.0))
    edits.place_sensor(VirtualSensor(position_m=(0.0, 0.0, 2.0)))
    edits.drag_sensor((3.0, 0.0, 0.0))  # of what is held no more
    edits.end_drag()
    states = [sensor.sensor.position_m]
    while document.undo_stack.canUndo():
        document.undo_stack.undo()
        states.append(sensor.sensor.position_m)
    assert states == [(0.0, 0.0, 2.0), (1.0, 0.0, 0.0), (0.0, 0.0, 0.0)]


def test_a_thing_that_comes_while_another_is_dragged_stays(document):
    one, other = (Thing("box", (x, 0.3, 1.0)) for x in (1.0, -1.0))
    moved = replace(one, position_m=(1.5, 0.3, 1.0))
    edits = Edits(document, SensorModel())
    edits.add_to_scene(one)
    edits.begin_scene_drag(0)
    edits.drag_in_scene((0.5, 0.0, 0.0))
    edits.add_to_scene(other)
    edits.drag_in_scene((2.0, 0.0, 0.0))
    edits.end_drag()
    assert document.recording.things == (moved, other)
    for before in ((moved,), (one,), ()):
        document.undo_stack.undo()
        assert document.recording.things == before


@settings(max_examples=20)
@given(moves=st.lists(st.one_of(positions, st.floats(-3, 3)), max_size=30))
def test_undo_restores_every_former_state(moves, qapp, tmp_path_factory):
    document = DocumentModel(TaskList())
    sensor = SensorModel()
    edits = Edits(document, sensor)
    path = write_points(tmp_path_factory.mktemp("points") / "points.npz")
    document._open(load_content(recording_of([path]), lambda *_: None), unsaved=False)

    def state():
        return (sensor.sensor, document.recording.radar_offset_s)

    states = [state()]
    for move in moves:
        if isinstance(move, tuple):
            edits.place_sensor(VirtualSensor(position_m=move))
        else:
            edits.set_radar_offset(move)
        if state() != states[-1]:
            states.append(state())
    for expected in reversed(states[:-1]):
        document.undo_stack.undo()
        assert state() == expected
    assert not document.undo_stack.canUndo()
    for expected in states[1:]:
        document.undo_stack.redo()
        assert state() == expected


def test_the_history_ends_with_the_recording(document, qtbot, tmp_path):
    edits = Edits(document, SensorModel())
    edits.place_sensor(VirtualSensor(position_m=(1, 0, 0)))
    assert document.modified
    with qtbot.waitSignal(document.opened):
        document.open([tmp_path / "points.npz"])
    assert not document.undo_stack.canUndo()
    assert not document.modified


@pytest.mark.parametrize("what", ["sensor", "offset"])
def test_what_is_held_is_let_go_of_where_another_recording_is_opened(
    document, what, qtbot, tmp_path
):
    edits = Edits(document, SensorModel())
    if what == "sensor":
        edits.begin_sensor_drag()
        edits.drag_sensor((1.0, 0.0, 0.0))
    else:
        edits.begin_offset_drag()
        edits.drag_offset(0.5)
    with qtbot.waitSignal(document.opened):
        document.open([write_points(tmp_path / "others.npz")])
    assert not edits.dragging
    edits.drag_sensor((2.0, 0.0, 0.0))
    edits.drag_offset(0.75)
    edits.end_drag()
    assert document.recording.sensor == VirtualSensor()
    assert document.recording.radar_offset_s == 0.0
    assert document.undo_stack.count() == 0


def test_aligning_by_drag_is_one_step(document):
    edits = Edits(document, SensorModel())
    edits.begin_offset_drag()
    edits.drag_offset(0.1)
    edits.drag_offset(0.25)
    edits.end_drag()
    assert document.recording.radar_offset_s == 0.25
    assert document.undo_stack.count() == 1
    document.undo_stack.undo()
    assert document.recording.radar_offset_s == 0.0
