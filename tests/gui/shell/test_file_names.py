"""Files that are written are proposed under the recording's name."""

from __future__ import annotations

from pathlib import Path

import pytest
from answering import menu_at, once_asked, pick
from copied import copied_record
from finding import button_of
from PySide6.QtWidgets import QDialog, QFileDialog, QMessageBox, QPushButton
from window_models import models_of

from sd2app.maps.feature import MapExportDialog
from sd2app.sensor.feature import PlacementsPage
from sd2core.cli.synth import Synth
from sd2core.maps import DopplerMap
from sd2core.placements.placements import PlacementGrid


@pytest.fixture
def proposed(monkeypatch) -> list[str]:
    """Names that dialogs propose; each is cancelled."""
    names: list[str] = []
    monkeypatch.setattr(
        QFileDialog, "getSaveFileName", lambda *given, **_: (names.append(given[2]), ("", ""))[1]
    )
    return names


def press(dialog: QDialog, text: str) -> None:
    """Press a button of the last row; a dialog that is not accepted is given up."""
    button = next(one for one in dialog.findChildren(QPushButton) if one.text() == text)
    button.click()
    dialog.reject()


def test_exports_and_save_as_are_named_as_the_recording(window, proposed):
    window.action("save_as").trigger()
    once_asked(MapExportDialog, lambda dialog: press(dialog, "Export…"))
    window.action("export_map").trigger()
    assert proposed == ["ball.sd2", "ball-synthetic.npz"]


def test_the_command_for_a_map_is_copied_from_where_it_is_exported(window):
    def copy(dialog: MapExportDialog) -> None:
        button_of(dialog, "Copy command").click()
        press(dialog, "Cancel")

    once_asked(MapExportDialog, copy)
    window.action("export_map").trigger()
    command, c = copied_record(), models_of(window)
    assert isinstance(command, Synth)
    assert (command.mesh, command.out) == (c.document.recording.folder, Path("ball-synthetic.npz"))
    assert command.sensor == c.sensor.sensor.position_m
    assert (command.visibility or "exact") == c.synthesis._plan.visibility


def test_pictures_are_named_as_the_recording(window, proposed):
    for view in (window.maps.synthetic, window.maps.real):
        pick(menu_at(view, view.rect().center()), "Save picture…")
    assert proposed == ["ball-synthetic-map.png", "ball-real-map.png"]


def test_placements_are_named_as_the_recording(labelled, proposed):
    c = models_of(labelled)
    c.edits.plan_placements(PlacementGrid((1.0,)))
    labelled.action("placements").trigger()
    button_of(labelled.findChild(PlacementsPage), "Export…").click()
    assert proposed == ["ball-placements.json"]
    c.document.undo_stack.undo()


def test_a_title_is_no_path(labelled):
    document = models_of(labelled).document
    document.recording.title = "walk/run: 1"
    assert document.file_name(".sd2") == "walk-run- 1.sd2"


@pytest.fixture
def asked(monkeypatch) -> list[str]:
    """Questions that are answered with Cancel."""
    words: list[str] = []
    cancel = QMessageBox.StandardButton.Cancel
    monkeypatch.setattr(
        QMessageBox, "question", lambda *given, **_: (words.append(given[2]), cancel)[1]
    )
    return words


def export_map(window, monkeypatch, path: Path) -> None:
    """Name a file for the synthetic map; a dialog that gets none is given up."""

    def export(dialog: MapExportDialog) -> None:
        button_of(dialog, "Export…").click()
        if dialog.isVisible():
            dialog.reject()

    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *_, **__: (str(path), ""))
    once_asked(MapExportDialog, export)
    window.action("export_map").trigger()


def test_a_file_that_the_ending_leads_to_is_not_replaced_unasked(
    window, tmp_path, monkeypatch, asked
):
    old = tmp_path / "walk 2.5 m.npz"
    old.write_bytes(b"kept")
    export_map(window, monkeypatch, tmp_path / old.stem)
    assert asked == ["walk 2.5 m.npz exists. Replace it?"]
    assert old.read_bytes() == b"kept"
    export_map(window, monkeypatch, tmp_path / "other")
    assert DopplerMap.load(tmp_path / "other.npz").kind == "synthetic"
    assert len(asked) == 1


def test_a_folder_that_cannot_be_written_is_said_in_words(window, tmp_path, monkeypatch):
    path = tmp_path / "none" / "map.npz"
    export_map(window, monkeypatch, path)
    assert f"{path}: No such file or directory" in window.messages.text
