"""Help on a panel or dialog: a button that opens the manual at the right page."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtGui import QDesktopServices, QKeySequence, QShortcut
from PySide6.QtWidgets import QDialogButtonBox, QHBoxLayout, QToolButton, QWidget

from sd2app.manual.view import address
from sd2app.widgets.layouts import row_of
from sd2app.widgets.panel import outlined

HELP = {
    "Sensor": "first-five-minutes.md#move-the-sensor",
    "Placements": "tutorials/plan-placements.md#1-plan-a-grid",
    "Accuracy": "how-to/choose-accuracy.md",
    "Denoiser": "tutorials/train-a-denoiser.md#3-train",
    "Classifier": "how-to/recognise-gestures.md",
    "Study": "how-to/recognise-gestures.md",
    "Labels": "tutorials/label-fast.md#1-mark-with-keys",
    "Label set": "how-to/use-your-own-label-set.md",
    "Agreement": "tutorials/label-fast.md#3-compare-with-a-second-annotator",
    "New from video": "tutorials/video-to-data-set.md#2-fit-a-body",
    "Mesh over the video": "how-to/compare-with-another-mesh.md#see-it-over-the-video",
    "Record": "how-to/record-a-live-radar.md",
    "Protocol": "how-to/record-a-live-radar.md#a-guided-session",
    "Check the place": "how-to/record-a-live-radar.md#check-the-place-first",
    "Align automatically": "how-to/align-video-and-radar.md",
    "Compare meshes": "how-to/compare-with-another-mesh.md",
    "Inertial sensor": "imu.md#in-the-window",
    "Import labels": "tutorials/label-fast.md#4-take-the-labels-over",
    "Export labels": "tutorials/label-fast.md#5-hand-them-on",
    "Export cut-outs": "tutorials/label-fast.md#5-hand-them-on",
    "Export map": "formats.md#doppler-map-files",
    "Export figure": "how-to/figures-for-a-paper.md",
    "Export data set": "tutorials/video-to-data-set.md#6-export-the-data-set",
    "Batch": "how-to/many-recordings.md",
    "Any command": "how-to/many-recordings.md",
    "Recover labels": "how-to/recover-after-a-crash.md",
    "Keys": "how-to/change-keys.md",
    "Preferences": "how-to/find-your-way-in-the-window.md#what-is-in-no-menu",
}
"""Panels and dialogs, and the heading of the manual that says most about each."""


def show_help(topic: str) -> None:
    """Open the manual about a row of the table."""
    QDesktopServices.openUrl(address(HELP[topic]))


def help_button(topic: str | Callable[[], str], parent: QWidget, key: str = "F1") -> QToolButton:
    """A small "?" that opens the manual about a row of the table, which may change."""
    topic_now = topic if callable(topic) else lambda: topic
    tip = "Help on this panel"
    button = outlined("?", tip, lambda: show_help(topic_now()), parent, name=tip, look="")
    QShortcut(QKeySequence(key), button).activated.connect(button.click)
    return button


def with_help(topic: str, buttons: QDialogButtonBox, *others: QWidget) -> QHBoxLayout:
    """Last row of a dialog: the button and others at the left, then those that end it."""
    return row_of(help_button(topic, buttons), *others, (buttons, 1), spacing_px=8)
