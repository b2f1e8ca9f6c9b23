"""A data set exported by real keys and clicks in the whole window; what counts is on disk."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from copied import copied_record
from PySide6.QtCore import Qt, QUrl
from PySide6.QtGui import QDesktopServices
from PySide6.QtWidgets import (
    QApplication,
    QCheckBox,
    QComboBox,
    QFileDialog,
    QLabel,
    QProgressBar,
    QToolButton,
)
from window_models import models_of

from sd2app.dataset_export.feature import ExportDialog
from sd2app.widgets.inputs import NumberBox
from sd2core.datasets.reading import open_dataset

LEFT = Qt.MouseButton.LeftButton
FAKE = Path(__file__).resolve().parents[2] / "fake_export.py"


@pytest.fixture
def dialog(window, qtbot):
    """The dialog, opened by its key, with the counts of the small recording."""
    window.messages.dismiss()
    qtbot.keyClick(window, Qt.Key.Key_D, Qt.KeyboardModifier.ControlModifier
                   | Qt.KeyboardModifier.ShiftModifier)  # fmt: skip
    found = QApplication.activeModalWidget()
    assert isinstance(found, ExportDialog)
    qtbot.waitUntil(lambda: not models_of(window).export.counting, timeout=20_000)
    yield found
    model = models_of(window).export
    if model.under_way:
        model.tell("stop")
        qtbot.waitUntil(lambda: not model.under_way, timeout=20_000)


def button(dialog: ExportDialog, text: str) -> QToolButton:
    return next(one for one in dialog.findChildren(QToolButton) if one.text() == text)


def check(dialog: ExportDialog, text: str, qtbot) -> None:
    box = next(one for one in dialog.findChildren(QCheckBox) if one.text() == text)
    qtbot.mouseClick(box, LEFT)


def type_frames(dialog: ExportDialog, tip: str, number: str, qtbot) -> None:
    box = next(one for one in dialog.findChildren(NumberBox) if one.toolTip() == tip)
    box.setFocus()
    box.selectAll()
    qtbot.keyClicks(box, number)
    qtbot.keyClick(box, Qt.Key.Key_Return)


def words(dialog: ExportDialog) -> list[str]:
    return [one.text() for one in dialog.findChildren(QLabel) if one.isVisible()]


def test_counts_follow_and_the_data_set_is_written(
    window, dialog, qtbot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    model = models_of(window).export
    # The recording has 60 frames: none of 72 on end.
    assert "No recording has 72 frames on end with a person." in words(dialog)
    assert not button(dialog, "Export…").isEnabled()
    type_frames(dialog, "Length of a segment (default: 72)", "20", qtbot)
    type_frames(dialog, "Frames that neighbours share (default: 10)", "0", qtbot)
    check(dialog, "denoised", qtbot)
    assert (model.choice.segment_frames, model.choice.overlap_frames) == (20, 0)
    assert model.choice.kinds == ("synthetic", "simulated", "real")
    qtbot.waitUntil(lambda: model.ready, timeout=20_000)
    assert any(text.startswith("3 segments of 0.7 s from 1 view") for text in words(dialog))
    formats = next(one for one in dialog.findChildren(QComboBox) if "Format" in one.toolTip())
    qtbot.keyClick(formats, Qt.Key.Key_Down)
    assert model.choice.out.suffix == ".h5"
    qtbot.mouseClick(button(dialog, "Copy command"), LEFT)
    assert copied_record() == model.command(model.usual_out)
    assert copied_record().segment_frames == 20
    assert copied_record().out.suffix == ".h5"

    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *_, **__: (str(tmp_path / "s"), ""))
    qtbot.mouseClick(button(dialog, "Export…"), LEFT)
    assert dialog.findChild(QProgressBar).isVisible()
    assert not formats.isEnabled()
    qtbot.waitUntil(lambda: not model.under_way, timeout=60_000)
    with open_dataset(tmp_path / "s.h5") as dataset:
        assert len(dataset) == 3
        assert dataset.header.kinds == ("synthetic", "simulated")
    assert window.messages.text == f"3 segments from 1 view are in {tmp_path / 's.h5'}."
    picture = next(
        one for one in dialog.findChildren(QLabel) if one.accessibleName() == "Preview sheet"
    )
    assert picture.isVisible()
    assert not picture.pixmap().isNull()
    shown: list[QUrl] = []
    monkeypatch.setattr(QDesktopServices, "openUrl", shown.append)
    qtbot.mouseClick(button(dialog, "Open folder"), LEFT)
    assert shown == [QUrl.fromLocalFile(str(tmp_path))]
    qtbot.mouseClick(button(dialog, "Close"), LEFT)
    qtbot.waitUntil(lambda: QApplication.activeModalWidget() is None)


@pytest.mark.slow
def test_it_goes_on_when_the_dialog_is_closed_and_can_be_stopped(
    window, dialog, qtbot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    model = models_of(window).export
    monkeypatch.setattr(model, "_command", (sys.executable, str(FAKE), "slow"))
    type_frames(dialog, "Length of a segment (default: 72)", "20", qtbot)
    qtbot.waitUntil(lambda: model.ready, timeout=20_000)
    out = tmp_path / "s.zarr"
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *_, **__: (str(out), ""))
    qtbot.mouseClick(button(dialog, "Export…"), LEFT)
    qtbot.waitUntil(lambda: model.run is not None and model.run.history.done == 500, timeout=20_000)
    qtbot.keyClick(dialog, Qt.Key.Key_Escape)
    qtbot.waitUntil(lambda: QApplication.activeModalWidget() is None)
    assert model.under_way
    assert [job.title for job in models_of(window).jobs.jobs] == ["Exporting s.zarr"]
    window.action("export_dataset").trigger()
    again = QApplication.activeModalWidget()
    assert isinstance(again, ExportDialog)
    qtbot.mouseClick(button(again, "Stop"), LEFT)
    qtbot.waitUntil(lambda: not model.under_way, timeout=20_000)
    assert button(again, "Export…").isEnabled()
    assert not models_of(window).jobs.jobs
    again.close()


@pytest.mark.slow
def test_one_segment_of_each_labelled_span(window, dialog, qtbot) -> None:
    model = models_of(window).export
    cut = next(one for one in dialog.findChildren(QComboBox) if "segment is" in one.toolTip())
    qtbot.keyClick(cut, Qt.Key.Key_Down)
    assert model.choice.segments == "spans"
    type_frames(dialog, "Of spans: time kept before and after each (default: 0)", "0.1", qtbot)
    assert model.choice.margin_s == pytest.approx(0.1)
    shown = {one.toolTip() for one in dialog.findChildren(NumberBox) if one.isVisible()}
    assert shown == {
        "Length of a segment (default: 72)",
        "Of spans: time kept before and after each (default: 0)",
    }
    qtbot.waitUntil(lambda: not model.counting, timeout=20_000)
    assert model.forecast is not None
    assert model.forecast.of_label == {"there": 1, "back": 1}
    assert "Labels: there 1 · back 1" in words(dialog)
