"""A radar in the window: a receiver or transmitter that is chosen, and where it stands in time."""

from __future__ import annotations

import numpy as np
import pytest
from PySide6.QtCore import QObject
from swinging_recordings import recording

from sd2app.session.session import Session
from sd2app.settings import Settings
from sd2core.fmcw import doppler_map
from sd2core.io.radar.infineon import write_capture
from sd2core.recording.recording import open_recording
from sd2core.sensor import VelocityAxis


@pytest.fixture
def session(qtbot, tmp_path):
    """The shared models with a recording whose radar has a silent second receiver."""
    parent = QObject()
    session = Session(parent, Settings())
    document = session.document
    document.changed.connect(session.follow_capture)
    open_here(document, recording(tmp_path / "anna.sd2", silent_receivers=1).folder, qtbot)
    yield session
    document.close()


def open_here(document, path, qtbot):
    with qtbot.waitSignal(document.opened, timeout=10_000):
        document.open([path])
    qtbot.waitUntil(lambda: document.radar_map is not None, timeout=10_000)


def wait_for(session, values, qtbot):
    qtbot.waitUntil(lambda: np.array_equal(session.maps.real.map.values, values), timeout=10_000)


def test_the_map_follows_and_the_choice_can_be_undone(session, qtbot):
    document, real = session.document, session.maps.real
    every, reference = real.map.values, real.reference
    first = doppler_map(
        document.capture.channel(1), axis=VelocityAxis(), clutter=document.clutter
    ).values
    assert not np.array_equal(first, every)
    assert real.title == "Radar (simulated)"
    session.edits.change("Choose receiver", {"radar_receiver": 1})
    assert document.undo_stack.undoText() == "Choose receiver"
    wait_for(session, first, qtbot)
    assert real.title == "Radar (simulated), receiver 1"
    assert real.reference == reference  # compared at the same 0 dB
    session.edits.change("Choose receiver", {"radar_receiver": 2})
    wait_for(session, np.zeros_like(every), qtbot)
    document.undo_stack.undo()
    wait_for(session, first, qtbot)
    document.undo_stack.undo()
    wait_for(session, every, qtbot)
    assert real.title == "Radar (simulated)"


def test_the_choice_is_stored_and_shown_again(session, qtbot):
    document = session.document
    folder = document.recording.folder
    session.edits.change("Choose receiver", {"radar_receiver": 2})
    document.save()
    assert open_recording(folder).radar_receiver == 2
    open_here(document, folder, qtbot)
    wait_for(session, np.zeros_like(document.radar_map.values), qtbot)
    assert document.capture.config.receivers == 2  # all are still there to choose from


def test_another_radar_file_has_no_choice_yet(session, qtbot, tmp_path):
    document = session.document
    session.edits.change("Choose receiver", {"radar_receiver": 2})
    other = recording(tmp_path / "ben.sd2", silent_receivers=2)
    with qtbot.waitSignal(document.opened, timeout=10_000):
        session.edits.add([other.radar])
    assert document.recording.radar == other.radar
    assert document.recording.radar_receiver is None


def test_a_number_that_is_not_there_is_told_and_can_be_replaced(session, qtbot):
    document = session.document
    with qtbot.waitSignal(document.failed, timeout=10_000) as told:
        session.edits.change("Choose receiver", {"radar_receiver": 7})
    assert "Receiver 7" in told.args[0]
    assert "1 to 2" in told.args[0]
    session.edits.change("Choose receiver", {"radar_receiver": 2})
    wait_for(session, np.zeros_like(document.radar_map.values), qtbot)


def test_a_simulated_radar_that_is_added_stands_where_its_mesh_stood(session, qtbot, tmp_path):
    document = session.document
    folder, late = document.recording.folder, tmp_path / "late"
    capture = document.capture
    about = capture.meta.get("simulation", {}) | {"first_frame_s": 1.5}
    write_capture(
        late,
        capture.samples[:],
        capture.config,
        capture.timebase.times_s,
        simulated=True,
        meta={"simulation": about},
    )
    for paths, offset_s in (([late], 1.5), ([folder], 0.0)):
        with qtbot.waitSignal(document.opened, timeout=10_000):
            session.edits.add(paths) if paths == [late] else document.open(paths)
        assert document.recording.radar_offset_s == offset_s
