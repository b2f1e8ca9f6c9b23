"""Files that are written are proposed under the recording's name."""

from __future__ import annotations

import pytest
from answering import menu_at, pick
from finding import button_of
from PySide6.QtWidgets import QFileDialog
from window_models import models_of

from sd2app.sensor.placements_page import PlacementsPage
from sd2core.placements.placements import PlacementGrid


@pytest.fixture
def proposed(monkeypatch) -> list[str]:
    """Names that dialogs propose; each is cancelled."""
    names: list[str] = []
    monkeypatch.setattr(
        QFileDialog, "getSaveFileName", lambda *given, **_: (names.append(given[2]), ("", ""))[1]
    )
    return names


def test_exports_and_save_as_are_named_as_the_recording(window, proposed):
    window.action("save_as").trigger()
    window.action("export_map").trigger()
    assert proposed == ["ball.sd2", "ball-synthetic.npz"]


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
