"""Listening from the window's side: a real ``sd2 listen`` beside it, and what is on screen."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QObject

from sd2app.live.model import LiveModel
from sd2app.live.request import ListenRequest
from sd2app.live.setup import ListenSetup
from sd2app.live.text import frames_text, level_text
from sd2app.session.session import Session, build_session
from sd2app.settings import Settings
from sd2core.fmcw.processing import doppler_map
from sd2core.io.radar import write_capture
from sd2core.live.counts import Counts
from sd2core.radar_config import CLUTTER
from sd2core.recording.recording import open_recording
from sd2core.sensor import VelocityAxis
from tests.core.live.fast_captures import fast_swipes

LIMIT_MS = 60_000


@pytest.fixture
def session(qtbot) -> Iterator[Session]:
    parent = QObject()
    made = build_session(parent, Settings.forgetful())
    yield made
    made.document.close()


@pytest.fixture
def capture(tmp_path: Path) -> Path:
    """Swipes that last a second."""
    found = fast_swipes(frames=45, faster=1.5)
    folder = tmp_path / "swipes"
    samples = np.asarray(found.samples[:45])
    write_capture(folder, samples, found.config, found.timebase.times_s, simulated=True)
    return folder


def heard(session: Session, request: ListenRequest, qtbot, frames: int) -> LiveModel:
    """Model that has shown some frames."""
    model = LiveModel(session, QObject(session.document))
    model.start(request)
    qtbot.waitUntil(lambda: session.maps.real.map is not None, timeout=LIMIT_MS)
    qtbot.waitUntil(lambda: len(session.playback.timebase) >= frames, timeout=LIMIT_MS)
    return model


def whole_map(folder: Path) -> np.ndarray:
    capture = open_recording(folder).load_capture()
    return doppler_map(capture, axis=VelocityAxis(), clutter=CLUTTER).values


def test_the_map_on_screen_is_that_of_the_recording_stopped_and_continued(
    session, capture, tmp_path, qtbot
):
    request = ListenRequest(tmp_path / "walk.sd2", replay=capture)
    model = heard(session, request, qtbot, 5)
    assert session.document.growing
    assert session.span.extent_s[1] >= 10.0  # room for what comes
    assert session.playback.frame == len(session.playback.timebase) - 1
    assert session.maps.real.title == "Radar (simulated)"
    model.stop()
    qtbot.waitUntil(lambda: model.state == "stopped", timeout=LIMIT_MS)
    assert not session.document.growing
    first = session.document.capture.frame_count
    assert model.counts == Counts(recorded=first)
    assert 0 < model.latency_s < 30
    qtbot.waitUntil(lambda: not session.document.maps_capture, timeout=LIMIT_MS)
    np.testing.assert_array_equal(session.maps.real.map.values, whole_map(request.folder))
    # The last bit of it by itself: the capture ends, and with it the process.
    session.playback.seek_frame(0)
    model.go_on()
    qtbot.waitUntil(lambda: model.state == "listening", timeout=LIMIT_MS)
    qtbot.waitUntil(lambda: model.state == "stopped", timeout=LIMIT_MS)
    live = session.maps.real.map
    assert model.counts == Counts(recorded=45)
    assert len(session.playback.timebase) == first + 45
    np.testing.assert_array_equal(live.values, whole_map(request.folder))
    assert "continued once" in " ".join(session.document.capture.notes)
    model.close()


def test_edits_while_listening_stay_and_can_be_taken_back(session, capture, tmp_path, qtbot):
    request = ListenRequest(tmp_path / "walk.sd2", replay=capture)
    model = heard(session, request, qtbot, 3)
    session.edits.begin_offset_drag()
    session.edits.drag_offset(0.25)
    session.edits.end_offset_drag()
    model.stop()
    qtbot.waitUntil(lambda: model.state == "stopped", timeout=LIMIT_MS)
    document = session.document
    assert document.modified
    assert document.recording.radar_offset_s == 0.25
    assert session.playback.timebase.start_s == pytest.approx(0.25)
    document.undo_stack.undo()
    assert document.recording.radar_offset_s == 0.0
    model.close()


def test_listening_goes_on_beside_another_recording(session, capture, tmp_path, qtbot):
    request = ListenRequest(tmp_path / "walk.sd2", replay=capture)
    model = heard(session, request, qtbot, 2)
    with qtbot.waitSignal(session.document.opened, timeout=LIMIT_MS):
        session.document.open([capture])
    assert model.can_be_shown
    assert model.busy
    qtbot.waitUntil(lambda: model.state == "stopped", timeout=LIMIT_MS)
    assert session.document.paths == (capture,)
    assert not session.document.growing
    with qtbot.waitSignal(session.document.opened, timeout=LIMIT_MS):
        model.show()
    assert session.document.capture.frame_count == 45
    model.close()


def test_closing_stores_what_was_received(session, capture, tmp_path, qtbot):
    request = ListenRequest(tmp_path / "walk.sd2", replay=capture)
    model = heard(session, request, qtbot, 2)
    shown = len(session.playback.timebase)
    model.close()
    found = open_recording(request.folder).load_capture()
    assert shown <= found.frame_count <= 45


# --- a process that says what it is told to ------------------------------------------------


def saying(code: int, *lines: object, error: str = "") -> tuple[str, ...]:
    """Command that prints lines and an error, and ends."""
    text = "".join(f"{json.dumps(one) if isinstance(one, dict) else one}\n" for one in lines)
    program = f"import sys; print({text!r}, end=''); sys.stderr.write({error!r}); sys.exit({code})"
    return (sys.executable, "-c", program)


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (saying(1, error="sd2: Port 4098 of 127.0.0.1 is in use.\n"), "Port 4098 of 127.0.0.1"),
        (saying(3), "It ended without saying why."),
        (("/nowhere/sd2",), "/nowhere/sd2 cannot be started"),
    ],
)
def test_a_failure_is_told_in_its_own_words(session, tmp_path, qtbot, command, words):
    model = LiveModel(session, QObject(session.document), command)
    model.start(ListenRequest(tmp_path / "walk.sd2", replay=tmp_path / "capture"))
    qtbot.waitUntil(lambda: model.state == "failed", timeout=LIMIT_MS)
    assert words in model.text
    assert not model.busy
    assert session.document.content is None
    model.dismiss()
    assert model.state == "idle"


def test_damaged_lines_are_left_out_and_doubts_told(session, tmp_path, qtbot):
    counts = dict.fromkeys(("dropped", "lost", "damaged", "not_shown"), 2)
    command = saying(
        0, "{", "[]", {"event": "column"}, {"event": "doubt", "text": "Packets lost: 7."},
        {"event": "frames", "recorded": 9, **counts},
    )  # fmt: skip
    model = LiveModel(session, QObject(session.document), command)
    with qtbot.waitSignal(model.warned) as warned:
        model.start(ListenRequest(tmp_path / "walk.sd2", replay=tmp_path / "capture"))
    assert warned.args == ["Packets lost: 7."]
    qtbot.waitUntil(lambda: model.state == "stopped", timeout=LIMIT_MS)
    assert model.counts == Counts(9, 2, 2, 2, 2)
    assert "2 dropped" in frames_text(model.counts)
    assert level_text(-61.24) == "level −61.2 dB"


def test_a_recording_that_cannot_be_opened_is_not_continued(session, tmp_path, qtbot):
    folder = tmp_path / "walk.sd2"
    folder.mkdir()
    (folder / "recording.json").write_text("{")
    model = LiveModel(session, QObject(session.document), saying(0))
    model.start(ListenRequest(folder, replay=tmp_path / "capture"))
    qtbot.waitUntil(lambda: model.state == "failed", timeout=LIMIT_MS)
    assert "recording.json" in model.text


# --- what is asked before ------------------------------------------------------------------


def test_a_set_up_says_what_is_missing_and_remembers(tmp_path, qtbot):
    settings = Settings.forgetful()
    setup = ListenSetup(settings)
    assert "Choose the .cfg or .json" in setup.problem
    (tmp_path / "profile.cfg").touch()
    setup.choose("setup", tmp_path / "gone.cfg")
    assert "does not exist" in setup.problem
    setup.choose("setup", tmp_path / "profile.cfg")
    assert setup.problem == ""
    setup.choose("address", " 192.168.33.30 ")
    setup.choose_folder(tmp_path / "walk")
    assert setup.request().words() == [
        "listen", "--dca1000", "192.168.33.30", "--setup", str(tmp_path / "profile.cfg"),
        "--out", str(tmp_path / "walk.sd2"), "--json", "--columns",
    ]  # fmt: skip
    setup.choose("way", "replay")
    assert "capture" in setup.problem
    (tmp_path / "live-1.sd2").mkdir()
    again = ListenSetup(settings)
    assert (again.way, again.setup) == ("replay", tmp_path / "profile.cfg")
    assert again.folder == tmp_path / "live-2.sd2"
