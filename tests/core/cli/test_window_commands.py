"""``sd2 open`` and ``sd2 demo`` up to the window itself."""

from __future__ import annotations

import signal
import socket
import sys
from pathlib import Path
from types import ModuleType

import pytest
from cli_outcome import Sd2

from sd2app.displays import has_display, silent_displays
from sd2core.files.resources import is_bundled, resource_path
from sd2core.recording.recording import open_recording


@pytest.fixture
def window(monkeypatch: pytest.MonkeyPatch) -> list[tuple[list[Path], Path | None]]:
    """Stands in for the window and notes what it was asked to show."""
    shown: list[tuple[list[Path], Path | None]] = []

    def run(paths: list[Path], *, screenshot: Path | None = None, parser: object) -> int:
        shown.append((paths, screenshot))
        return 0

    module = ModuleType("sd2app.shell.app")
    module.run = run  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "sd2app.shell.app", module)
    return shown


@pytest.fixture
def no_display(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM"):
        monkeypatch.delenv(name, raising=False)


@pytest.mark.parametrize(
    ("platform", "environment", "expected"),
    [
        ("linux", {}, False),
        ("linux", {"DISPLAY": ""}, False),
        ("linux", {"DISPLAY": ":0"}, True),
        ("linux", {"WAYLAND_DISPLAY": "wayland-0"}, True),
        ("linux", {"QT_QPA_PLATFORM": "offscreen"}, True),
        ("darwin", {}, True),
        ("win32", {}, True),
    ],
)
def test_display(platform: str, environment: dict[str, str], expected: bool) -> None:
    assert has_display(platform, environment) is expected


@pytest.mark.parametrize(
    ("environment", "silent"),
    [
        ({"DISPLAY": ":1977"}, ("DISPLAY=:1977",)),
        ({"WAYLAND_DISPLAY": "gone"}, ("WAYLAND_DISPLAY=gone",)),
        (
            {"WAYLAND_DISPLAY": "gone", "DISPLAY": ":1977"},
            ("WAYLAND_DISPLAY=gone", "DISPLAY=:1977"),
        ),
        ({"QT_QPA_PLATFORM": "xcb"}, ("DISPLAY=",)),
        ({"QT_QPA_PLATFORM": "xcb;offscreen", "DISPLAY": ":1977"}, ()),
        ({"QT_QPA_PLATFORM": "offscreen", "DISPLAY": ":1977"}, ()),
        ({}, ()),
    ],
)
def test_displays_that_do_not_answer(
    environment: dict[str, str], silent: tuple[str, ...], tmp_path: Path
) -> None:
    environment["XDG_RUNTIME_DIR"] = str(tmp_path)
    assert silent_displays("linux", environment) == silent
    assert silent_displays("darwin", environment) == ()


def test_one_display_that_answers_is_enough(tmp_path: Path) -> None:
    environment = {"DISPLAY": ":1977", "WAYLAND_DISPLAY": "way", "XDG_RUNTIME_DIR": str(tmp_path)}
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(tmp_path / "way"))
        server.listen()
        assert silent_displays("linux", environment) == ()


@pytest.mark.usefixtures("no_display")
def test_a_display_that_is_gone_is_named(
    sd2: Sd2, window: list, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("DISPLAY", ":1977")
    outcome = sd2("demo")
    assert outcome.code == 1
    assert "DISPLAY=:1977" in outcome.err
    assert "--screenshot FILE.png" in outcome.err
    assert not window


@pytest.mark.usefixtures("no_display")
@pytest.mark.parametrize("command", ["open", "demo"])
def test_without_a_display_it_says_what_to_do(
    sd2: Sd2, window: list, command: str, plate: Path
) -> None:
    outcome = sd2(command, *([plate] if command == "open" else []))
    assert outcome.code == 1
    assert "no display" in outcome.err
    assert "--screenshot FILE.png" in outcome.err
    assert not window


@pytest.mark.usefixtures("no_display")
def test_a_screenshot_needs_no_display(
    sd2: Sd2, window: list, plate: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import os

    monkeypatch.setenv("QT_QPA_PLATFORM", "xcb")
    picture = tmp_path / "window.png"
    assert sd2("open", plate, "--screenshot", picture).code == 0
    assert window == [([plate], picture)]
    assert os.environ["QT_QPA_PLATFORM"] == "offscreen"


def test_a_display_is_used(
    sd2: Sd2, window: list, plate: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("DISPLAY", ":0")
    capture = plate.parent / "capture"
    capture.mkdir()
    (capture / "radar.npy").touch()
    assert sd2("open", plate, capture).code == 0
    assert window == [([plate, capture], None)]
    assert sd2("open").code == 0
    assert window[1:] == [([], None)]


@pytest.mark.parametrize(
    ("name", "says"),
    [("window.jpg", "ends in .png"), ("plate.npz/window.png", "plate.npz is a file")],
)
def test_a_screenshot_that_cannot_be_written(
    sd2: Sd2, window: list, plate: Path, tmp_path: Path, name: str, says: str
) -> None:
    outcome = sd2("open", plate, "--screenshot", tmp_path / name)
    assert (outcome.code, window) == (1, [])
    assert says in " ".join(outcome.err.split())


def test_a_copy_of_the_sample_is_complete_and_ones_own(
    sd2: Sd2, window: list, tmp_path: Path
) -> None:
    assert sd2("demo", "--out", tmp_path / "mine").code == 0
    assert not window
    copy, sample = (
        open_recording(tmp_path / "mine.sd2"),
        open_recording(resource_path("swipes.sd2")),
    )
    assert (copy.spans, copy.sensor, copy.title) == (sample.spans, sample.sensor, sample.title)
    for file in (copy.video, copy.mesh, copy.radar):
        assert file is not None
        assert file.is_relative_to(tmp_path / "mine.sd2")
        assert not is_bundled(file)
    again = sd2("demo", "--out", tmp_path / "mine.sd2")
    assert again.code == 1
    assert "is a recording already" in again.err


def test_ctrl_c_ends_the_window(
    sd2: Sd2, window: list, plate: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    handlers = []

    def run(paths: list[Path], *, screenshot: Path | None = None, parser: object) -> int:
        handlers.append(signal.getsignal(signal.SIGINT))
        return 0

    before = signal.getsignal(signal.SIGINT)
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr(sys.modules["sd2app.shell.app"], "run", run)
    assert sd2("open", plate).code == 0
    assert handlers == [signal.SIG_DFL]
    assert signal.getsignal(signal.SIGINT) is before


def test_opening_nothing(sd2: Sd2, window: list, tmp_path: Path) -> None:
    outcome = sd2("open", tmp_path / "no.sd2")
    assert (outcome.code, window) == (1, [])
    assert "does not exist" in outcome.err
