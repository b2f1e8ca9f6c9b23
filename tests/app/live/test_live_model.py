"""Listening from the window's side: a real ``sd2 listen`` beside it, and what is on screen."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QObject

from sd2app.live.feature import frames_text, level_text
from sd2app.live.model import LiveModel
from sd2app.live.process import ListenRequest, ListenSetup
from sd2app.session.session import Session
from sd2app.settings import Settings
from sd2core.files.resources import resource_path
from sd2core.fmcw.processing import doppler_map
from sd2core.io.radar.infineon import write_capture
from sd2core.live.counts import Counts
from sd2core.radar_config import CLUTTER
from sd2core.recording.recording import Recording, open_recording
from sd2core.sensor import VelocityAxis, VirtualSensor
from tests.core.live.fast_captures import fast_swipes

LIMIT_MS = 60_000


@pytest.fixture
def session(qtbot) -> Iterator[Session]:
    parent = QObject()
    made = Session(parent, Settings.forgetful())
    # As the window does it.
    made.document.opened.connect(made.attach)
    made.document.opened.connect(lambda: made.follow_capture(new=True))
    made.document.changed.connect(made.follow_capture)
    yield made
    made.document.close()


def written(folder: Path, times_s: np.ndarray) -> Path:
    """Swipes of the sample at other times."""
    found = fast_swipes(frames=len(times_s))
    samples = np.asarray(found.samples[: len(times_s)])
    write_capture(folder, samples, found.config, times_s, simulated=True)
    return folder


@pytest.fixture
def endless(tmp_path: Path) -> Path:
    """Capture whose last frame is minutes after the others: replaying it does not end by itself."""
    return written(tmp_path / "swipes", np.append(np.arange(12) / 30, 600.0))


@pytest.fixture
def mesh_recording(tmp_path: Path) -> Path:
    """Recording of a mesh alone."""
    return Recording.create(
        tmp_path / "mesh.sd2", mesh=resource_path("swipes.sd2") / "mesh.zarr"
    ).folder


def heard(session: Session, request: ListenRequest, qtbot, frames: int) -> LiveModel:
    """Model that has shown some frames."""
    model = LiveModel(session, QObject(session.document))
    model.start(request)
    qtbot.waitUntil(lambda: len(session.playback.timebase) >= frames, timeout=LIMIT_MS)
    return model


def stopped(model: LiveModel, qtbot) -> None:
    model.stop()
    qtbot.waitUntil(lambda: model.state == "stopped", timeout=LIMIT_MS)


def assert_shows(session: Session, folder: Path) -> None:
    """The map on screen is the recording's."""
    capture = open_recording(folder).load_capture()
    whole = doppler_map(capture, axis=VelocityAxis(), clutter=CLUTTER)
    np.testing.assert_array_equal(session.maps.real.map.values, whole.values)
    np.testing.assert_array_equal(session.playback.timebase.times_s, whole.times_s)


@pytest.mark.slow
def test_the_map_on_screen_is_that_of_the_recording_stopped_and_continued(
    session, endless, tmp_path, qtbot
):
    request = ListenRequest(tmp_path / "walk.sd2", replay=endless)
    model = heard(session, request, qtbot, 12)
    assert session.document.growing
    assert session.span.extent_s == (0.0, 10.0)  # room for what comes
    assert session.playback.frame == 11
    assert session.maps.real.title == "Radar (simulated)"
    assert_shows(session, request.folder)
    stopped(model, qtbot)
    assert not session.document.growing
    assert (model.counts.recorded, model.counts.whole) == (12, True)
    assert 0 < model.latency_s < 30
    qtbot.waitUntil(lambda: not session.document.maps_capture, timeout=LIMIT_MS)
    assert_shows(session, request.folder)
    session.playback.seek_frame(0)
    model.go_on()
    qtbot.waitUntil(lambda: len(session.playback.timebase) == 24, timeout=LIMIT_MS)
    assert session.playback.frame == 23
    assert_shows(session, request.folder)
    stopped(model, qtbot)
    assert "continued once" in " ".join(session.document.capture.notes)


@pytest.mark.slow
def test_a_source_that_ends_ends_it(session, tmp_path, qtbot):
    capture = written(tmp_path / "swipes", np.arange(40) / 60)
    model = LiveModel(session, QObject(session.document))
    model.start(ListenRequest(tmp_path / "walk.sd2", replay=capture))
    qtbot.waitUntil(lambda: model.state == "stopped", timeout=LIMIT_MS)
    assert (model.counts.recorded, model.counts.whole) == (40, True)
    qtbot.waitUntil(lambda: not session.document.maps_capture, timeout=LIMIT_MS)
    assert_shows(session, tmp_path / "walk.sd2")


@pytest.mark.slow
def test_edits_while_listening_stay_and_can_be_taken_back(session, endless, tmp_path, qtbot):
    request = ListenRequest(tmp_path / "walk.sd2", replay=endless)
    model = heard(session, request, qtbot, 3)
    session.edits.begin_offset_drag()
    session.edits.drag_offset(0.25)
    session.edits.end_drag()
    stopped(model, qtbot)
    document = session.document
    assert document.modified
    assert document.recording.radar_offset_s == 0.25
    assert session.playback.timebase.start_s == pytest.approx(0.25)
    document.undo_stack.undo()
    assert document.recording.radar_offset_s == 0.0


@pytest.mark.slow
def test_listening_goes_on_beside_another_recording(session, endless, tmp_path, qtbot):
    request = ListenRequest(tmp_path / "walk.sd2", replay=endless)
    model = heard(session, request, qtbot, 12)
    with qtbot.waitSignal(session.document.opened, timeout=LIMIT_MS):
        session.document.open([endless])
    assert model.busy
    assert model.can_be_shown
    assert not session.document.growing
    model.show()
    assert session.document.growing
    assert_shows(session, request.folder)
    with qtbot.waitSignal(session.document.opened, timeout=LIMIT_MS):
        session.document.open([endless])
    stopped(model, qtbot)
    assert session.document.paths == (endless,)
    with qtbot.waitSignal(session.document.opened, timeout=LIMIT_MS):
        model.show()  # as any other: it has ended
    assert session.document.capture.frame_count == 12
    assert model.state == "stopped"
    with qtbot.waitSignal(session.document.opened, timeout=LIMIT_MS):
        session.document.open([endless])
    assert model.state == "idle"  # its message leaves with its recording


@pytest.mark.slow
def test_closing_stores_what_was_received(session, endless, tmp_path, qtbot):
    request = ListenRequest(tmp_path / "walk.sd2", replay=endless)
    model = heard(session, request, qtbot, 12)
    model.close()
    assert open_recording(request.folder).load_capture().frame_count == 12


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


def test_a_recording_without_a_radar_is_refused(session, mesh_recording, qtbot):
    model = LiveModel(session, QObject(session.document))
    model.start(ListenRequest(mesh_recording, replay=mesh_recording))
    qtbot.waitUntil(lambda: model.state == "failed", timeout=LIMIT_MS)
    assert "radar" in model.text


def test_what_cannot_be_shown_is_said_once(session, tmp_path, qtbot):
    folder = tmp_path / "walk.sd2"
    column = {
        "event": "column", "time_s": 0.0, "received_unix_s": 0.0, "level_db": None,
        "values": [0.0] * 32, **vars(Counts(recorded=1)),
    }  # fmt: skip
    command = saying(0, column, {**column, "time_s": 0.1})
    model = LiveModel(session, QObject(session.document), command)
    warned: list[str] = []
    model.warned.connect(warned.append)
    model.start(ListenRequest(folder, replay=tmp_path / "capture"))
    folder.mkdir()
    (folder / "recording.json").write_text("{")
    qtbot.waitUntil(lambda: model.state == "stopped", timeout=LIMIT_MS)
    assert len(warned) == 1
    assert "cannot be shown" in warned[0]
    assert "recording.json" in warned[0]


# --- what is asked before ------------------------------------------------------------------


def test_a_set_up_says_what_is_missing_and_remembers(tmp_path, qtbot):
    settings = Settings.forgetful()
    setup = ListenSetup(settings)
    assert "Choose the .cfg or .json" in setup.chosen.problem
    (tmp_path / "profile.cfg").touch()
    setup.choose("setup", tmp_path / "gone.cfg")
    assert "does not exist" in setup.chosen.problem
    setup.choose("setup", tmp_path / "profile.cfg")
    assert setup.chosen.problem == ""
    setup.choose("address", " 192.168.33.30 ")
    setup.choose_folder(tmp_path / "walk")
    assert setup.chosen.words() == [
        "listen", "--dca1000", "192.168.33.30", "--setup", str(tmp_path / "profile.cfg"),
        "--out", str(tmp_path / "walk.sd2"), "--columns", "--json",
    ]  # fmt: skip
    setup.choose("way", "replay")
    assert "capture" in setup.chosen.problem
    (tmp_path / "live-1.sd2").mkdir()
    again = ListenSetup(settings)
    assert (again.chosen.way, again.chosen.setup) == ("replay", tmp_path / "profile.cfg")
    assert again.chosen.folder == tmp_path / "live-2.sd2"


@pytest.mark.slow
def test_what_is_filmed_is_shown_as_it_comes_and_then_with_its_video(session, tmp_path, qtbot):
    request = ListenRequest(tmp_path / "take.sd2", way="test", camera="test")
    model = heard(session, request, qtbot, 20)
    qtbot.waitUntil(lambda: session.video.picture is not None, timeout=LIMIT_MS)
    assert session.video.picture.shape == (180, 320, 3)
    assert session.document.recording.video == tmp_path / "take.sd2" / "video.mp4"
    stopped(model, qtbot)
    assert model.pictures > 0
    assert not model.can_go_on
    qtbot.waitUntil(lambda: session.document.video is not None, timeout=LIMIT_MS)
    assert len(session.document.video) == model.pictures
    assert session.document.simulated
    assert f"{model.pictures} pictures, " in frames_text(
        model.counts, model.pictures, model.pictures_dropped
    )


@pytest.mark.slow
def test_edits_made_while_filming_are_not_lost(session, tmp_path, qtbot):
    request = ListenRequest(tmp_path / "take.sd2", way="test", camera="test")
    model = heard(session, request, qtbot, 20)
    warnings = []
    model.warned.connect(warnings.append)
    session.edits.place_sensor(VirtualSensor(position_m=(0.5, 0.0, 0.0)))
    stopped(model, qtbot)
    assert any("Save the recording and open it again" in one for one in warnings)
    assert session.document.modified
    assert session.sensor.sensor.position_m[0] == 0.5


def test_a_board_that_is_started_from_here_needs_a_cfg(tmp_path):
    setup = ListenSetup(Settings.forgetful())
    setup.choose("way", "ti")
    setup.choose_folder(tmp_path / "take")
    assert "Choose the .cfg" in setup.chosen.problem
    for name, problem in (("walk.mmwave.json", "is no .cfg of the mmWave SDK."), ("walk.cfg", "")):
        (tmp_path / name).touch()
        setup.choose("setup", tmp_path / name)
        assert setup.chosen.problem.endswith(problem)
    assert setup.chosen.problem == ""
    words = setup.chosen.words()
    assert words[:5] == ["listen", "--radar", "ti", "--setup", str(tmp_path / "walk.cfg")]


def test_a_camera_makes_it_another_command(tmp_path):
    setup = ListenSetup(Settings.forgetful())
    setup.choose("way", "test")
    setup.choose_folder(tmp_path / "take")
    assert setup.chosen.words()[0] == "listen"
    setup.choose("camera", "0")
    words = setup.chosen.words()
    assert (words[0], words[words.index("--camera") + 1]) == ("record", "0")
    assert words[words.index("--radar") + 1] == "test"
    assert setup.chosen.problem == ""
    (tmp_path / "take.sd2").mkdir()
    assert "is not continued" in setup.chosen.problem
