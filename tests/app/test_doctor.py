"""What an installation lacks is named, with the line that mends it."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from sd2app import command_line, displays, doctor
from sd2app.displays import (
    DRAWING,
    UNDER_WAYLAND,
    UNDER_X11,
    missing_libraries,
    wanted_libraries,
)
from sd2core.errors import Sd2Error

SCRIPT = Path(__file__).parents[2] / "scripts" / "system_packages.sh"


def finding(about: str) -> doctor.Finding:
    (found,) = (one for one in doctor.examine() if one.about == about)
    return found


@pytest.fixture
def without_egl(monkeypatch: pytest.MonkeyPatch) -> None:
    loads = displays.loads
    monkeypatch.setattr(
        displays, "loads", lambda library: library != "libEGL.so.1" and loads(library)
    )


def test_the_script_that_installs_them_has_the_same_libraries() -> None:
    listed = dict(re.findall(r"(lib[\w.+-]+\.so\.\d+)=([\w.+-]+)", SCRIPT.read_text("utf-8")))
    assert listed == DRAWING | UNDER_X11 | UNDER_WAYLAND


@pytest.mark.parametrize(
    ("environment", "besides"),
    [
        ({"DISPLAY": ":0"}, UNDER_X11),
        ({"DISPLAY": ":0", "QT_QPA_PLATFORM": "offscreen"}, {}),
        ({"QT_QPA_PLATFORM": "xcb"}, UNDER_X11),
        # Qt falls back on X11 where Wayland's libraries are missing.
        ({"WAYLAND_DISPLAY": "wayland-0", "DISPLAY": ":0"}, UNDER_X11),
        ({"WAYLAND_DISPLAY": "wayland-0"}, UNDER_WAYLAND),
        ({"WAYLAND_DISPLAY": "wayland-0", "QT_QPA_PLATFORM": "offscreen"}, {}),
        ({}, {}),
    ],
)
def test_libraries_of_the_display_that_qt_chooses_are_wanted(
    environment: dict[str, str], besides: dict[str, str]
) -> None:
    assert wanted_libraries(environment) == DRAWING | besides


@pytest.mark.usefixtures("without_egl")
def test_a_missing_library_is_named_with_its_package(capsys: pytest.CaptureFixture[str]) -> None:
    assert missing_libraries({}) == {"libEGL.so.1": "libegl1"}
    assert doctor.report(as_json=False) == 1
    said = capsys.readouterr().out
    assert "PROBLEM" in said
    assert "sudo apt-get update && sudo apt-get install --no-install-recommends libegl1" in said


@pytest.mark.usefixtures("without_egl")
def test_a_window_that_cannot_be_drawn_is_not_begun(tmp_path: Path) -> None:
    with pytest.raises(Sd2Error, match=r"libEGL\.so\.1.*libegl1"):
        command_line._show([], tmp_path / "window.png")


def test_a_display_that_is_gone_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "silent_displays", lambda *_: ("DISPLAY=:1977",))
    found = finding("Window")
    assert (found.state, "DISPLAY=:1977" in found.found) == ("problem", True)


def test_a_window_that_ends_its_process_is_a_problem(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "PROBE", "raise SystemExit('could not load the platform plugin')")
    found = finding("Window")
    assert (found.state, found.found) == ("problem", "could not load the platform plugin")


def test_without_opengl_the_sentence_of_the_3d_view_is_said(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    probe = 'print(\'{"platform": "offscreen", "fonts": 0, "gl": "No OpenGL. Mend it."}\')'
    monkeypatch.setattr(doctor, "PROBE", probe)
    found = finding("3D view")
    assert (found.state, found.found, found.remedy) == ("problem", "No OpenGL", "Mend it.")
    assert finding("Fonts").state == "problem"


def test_the_same_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    code = doctor.report(as_json=True)
    found = json.loads(capsys.readouterr().out)
    assert {"System libraries", "3D view", "Kernels", "Cache"} <= {one["about"] for one in found}
    assert code == int(any(one["state"] == "problem" for one in found))
