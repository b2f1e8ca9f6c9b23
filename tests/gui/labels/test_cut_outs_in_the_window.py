"""Spans cut out by real keys and clicks in the whole window; what counts is on disk."""

from __future__ import annotations

import json
import shlex
from pathlib import Path

import pytest
from answering import answer, once_asked
from finding import button_of
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication, QCheckBox, QComboBox, QFileDialog, QPushButton
from window_models import models_of

from sd2app.command_line import main
from sd2app.labels.exports import CutOutDialog
from sd2core.io.video import open_video
from sd2core.maps import DopplerMap

LEFT = Qt.MouseButton.LeftButton


@pytest.fixture
def cuts(tmp_path, monkeypatch) -> Path:
    folder = tmp_path / "cuts"
    monkeypatch.setattr(QFileDialog, "getExistingDirectory", lambda *_: str(folder))
    return folder


def cut(window, qtbot, which: str, *left_out: str) -> None:
    def work(dialog: CutOutDialog) -> None:
        dialog.findChild(QComboBox).setCurrentText(which)
        for box in dialog.findChildren(QCheckBox):
            if box.text() in left_out:
                box.click()
        button = next(one for one in dialog.findChildren(QPushButton) if one.text() == "Export…")
        qtbot.mouseClick(button, LEFT)

    window.messages.dismiss()
    once_asked(CutOutDialog, work)
    window.action("cut_out").trigger()
    qtbot.waitUntil(lambda: bool(window.messages.text), timeout=30_000)
    assert not models_of(window).jobs.jobs


def listed(folder: Path) -> list[tuple[str, tuple[int, int, int], list[str]]]:
    spans = json.loads((folder / "index.json").read_text("utf-8"))["spans"]
    return [(one["span"]["label"], tuple(one["frames"].values()), one["files"]) for one in spans]


@pytest.mark.slow
def test_all_spans_with_all_that_there_is(window, qtbot, cuts) -> None:
    cut(window, qtbot, "all (2)")
    files = ["video.mp4", "mesh.zarr", "synthetic.npz", "radar.npz"]
    assert listed(cuts) == [("there", (6, 23, 18), files), ("back", (30, 59, 30), files)]
    assert window.messages.text == f"2 spans cut out into {cuts}."
    with open_video(next(cuts.glob("*_there_*")) / "video.mp4") as clip:
        assert len(clip) == 18
        # The brightness is the frame number.
        assert float(clip.read(0).mean()) == pytest.approx(40 + 3 * 6, abs=4)


def test_a_map_that_is_cut_out_says_how_it_was_made(window, qtbot, cuts) -> None:
    cut(window, qtbot, "back (1)", "video", "mesh")
    (made,) = cuts.glob("*_back_*/synthetic.npz")
    part, whole = DopplerMap.load(made), models_of(window).synthesis.whole_map()
    assert part.of_simulated
    assert part.meta["plan"]["text"] == whole.meta["plan"]["text"]
    assert part.meta["visible_share"] == whole.meta["visible_share"][30:]


def test_one_label_and_some_parts_then_something_else(window, qtbot, cuts) -> None:
    cut(window, qtbot, "back (1)", "mesh", "maps: synthetic, radar")
    assert listed(cuts) == [("back", (30, 59, 30), ["video.mp4"])]
    answer(qtbot, "Keep them")
    cut(window, qtbot, "all (2)", "video", "mesh")
    assert window.messages.text.endswith("1 stayed as they were.")
    assert [files for _, _, files in listed(cuts)] == [
        ["synthetic.npz", "radar.npz"],
        ["video.mp4"],
    ]
    answer(qtbot, "Replace")
    cut(window, qtbot, "all (2)", "video", "mesh")
    assert [files for _, _, files in listed(cuts)] == [["synthetic.npz", "radar.npz"]] * 2


@pytest.mark.slow
def test_the_copied_command_cuts_the_same_out(window, qtbot, cuts, monkeypatch) -> None:
    copied: list[list[str]] = []

    def copy(dialog: CutOutDialog) -> None:
        dialog.findChild(QComboBox).setCurrentText("back (1)")
        next(box for box in dialog.findChildren(QCheckBox) if box.text() == "mesh").click()
        qtbot.mouseClick(button_of(dialog, "Copy command"), LEFT)
        copied.append(shlex.split(QApplication.clipboard().text())[1:])
        dialog.reject()

    once_asked(CutOutDialog, copy)
    window.action("cut_out").trigger()
    there = cuts.with_name("there")
    there.mkdir()
    monkeypatch.chdir(there)
    assert main(copied[0]) == 0
    cut(window, qtbot, "back (1)", "mesh")
    assert listed(there / "cuts") == listed(cuts) != []


def test_a_command_cannot_choose_single_spans(window, qtbot) -> None:
    labels = models_of(window).labels
    labels.select([labels.labels.spans[0].id])
    enabled: dict[str, bool] = {}

    def look(dialog: CutOutDialog) -> None:
        which = dialog.findChild(QComboBox)
        for row in range(which.count()):
            which.setCurrentIndex(row)
            enabled[which.currentText()] = button_of(dialog, "Copy command").isEnabled()
        dialog.reject()

    once_asked(CutOutDialog, look)
    window.action("cut_out").trigger()
    assert enabled == {
        "the selected (1)": False,
        "all (2)": True,
        "there (1)": True,
        "back (1)": True,
    }


def test_cancelled_it_leaves_whole_folders_only(window, qtbot, cuts) -> None:
    c = models_of(window)
    c.cut_out.start(c.labels.labels.spans, ("video", "mesh", "maps"), cuts, lambda _: False)
    (job,) = c.jobs.jobs
    assert job.title == "Cutting out 2 spans"
    c.jobs.cancel(job)
    assert not c.jobs.jobs
    c.cut_out.close()
    assert not list(cuts.glob(".*.tmp"))


@pytest.mark.slow
def test_a_folder_that_cannot_be_is_said(window, qtbot, cuts) -> None:
    cuts.write_text("a file")
    cut(window, qtbot, "all (2)")
    assert str(cuts) in window.messages.text
