"""Questions, buttons and file filters of dialogs, and the order in which Tab goes through them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from pathlib import Path

from PySide6.QtCore import QPoint, QSize, Qt, QUrl
from PySide6.QtGui import QDesktopServices, QGuiApplication, QShowEvent
from PySide6.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QFileDialog,
    QMessageBox,
    QPushButton,
    QWidget,
)

from sd2core.files.figure_files import SUFFIXES


def controls_of(regions: Sequence[QWidget]) -> list[QWidget]:
    """Enabled controls that are visible, from region to region, in rows from top left."""
    return [control for region in regions for control in _rows_of(region)]


def tab_to(regions: Sequence[QWidget], focus: QWidget | None, forward: bool) -> QWidget | None:
    """Give the keyboard to the control after the one that has it, or before; None without any.

    Qt asks too when what has it is hidden or disabled. Then nothing has it: had the next control
    it, a second Space would press that.
    """
    if focus is not None and not (focus.isVisible() and focus.isEnabled()):
        focus.clearFocus()
        return None
    controls, step = controls_of(regions), 1 if forward else -1
    if not controls:
        return None
    at = controls.index(focus) + step if focus in controls else min(step, 0)
    control, reason = controls[at % len(controls)], Qt.FocusReason
    control.setFocus(reason.TabFocusReason if forward else reason.BacktabFocusReason)
    return control


def _rows_of(region: QWidget) -> list[QWidget]:
    places = {one: one.mapTo(region, QPoint(0, 0)) for one in _controls(region)}
    rows: list[list[QWidget]] = []
    for one in sorted(places, key=lambda one: places[one].y() + one.height() / 2):
        middle_px = places[one].y() + one.height() / 2
        # A row is what the first control of it has beside itself.
        if rows and middle_px < places[rows[-1][0]].y() + rows[-1][0].height():
            rows[-1].append(one)
        else:
            rows.append([one])
    return [one for row in rows for one in sorted(row, key=lambda one: places[one].x())]


def _controls(region: QWidget) -> list[QWidget]:
    tab = Qt.FocusPolicy.TabFocus.value
    return [
        one
        for one in region.findChildren(QWidget)
        if one.focusPolicy().value & tab
        and one.isVisibleTo(region)
        and region.isVisible()
        and one.isEnabled()
        and one.focusProxy() is None
        and one.window() is region.window()
    ]


_TITLE_PX = 40
Answer = QMessageBox.StandardButton
FIGURES = ";;".join(f"{suffix[1:].upper()} (*{suffix})" for suffix in SUFFIXES)


class Dialog(QDialog):
    """A dialog through which Tab goes as one reads, whatever was made first."""

    def __init__(self, title: str, parent: QWidget | None) -> None:
        super().__init__(parent)
        self.setWindowTitle(title)

    def showEvent(self, event: QShowEvent) -> None:
        """Begin with the first control: Qt takes Cancel while it is the only button to press."""
        super().showEvent(event)
        if self.focusWidget() is None:
            tab_to([self], None, forward=True)

    def focusNextPrevChild(self, forward: bool) -> bool:
        """Go to the next control, or to the one before."""
        return tab_to([self], self.focusWidget(), forward) is not None


def may_delete(parent: QWidget, title: str, what: str) -> bool:
    """Ask if something may be deleted; Escape and Return keep it."""
    return confirmed(parent, title, what, Answer.Discard, usual=Answer.Cancel)


def confirmed(
    parent: QWidget, title: str, words: str, answer: Answer, usual: Answer | None = None
) -> bool:
    """Ask if something is to be done, or to be cancelled; Return gives the usual answer."""
    given = QMessageBox.question(parent, title, words, answer | Answer.Cancel, usual or answer)
    return bool(given == answer)


def accepting(dialog: QDialog, text: str) -> tuple[QDialogButtonBox, QPushButton]:
    """Buttons Cancel and one that accepts the dialog; the latter again, to be enabled."""
    buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Cancel, dialog)
    accept = buttons.addButton(text, QDialogButtonBox.ButtonRole.AcceptRole)
    accept.setDefault(True)
    buttons.accepted.connect(dialog.accept)
    buttons.rejected.connect(dialog.reject)
    return buttons, accept


def accepted(dialog: QDialog) -> bool:
    """Show a dialog until it ends, and let go of it; True if it was accepted."""
    result = dialog.exec()
    dialog.deleteLater()
    return bool(result == QDialog.DialogCode.Accepted)


def take_room(window: QWidget, width_px: int, height_px: int) -> None:
    """Give a window its usual size, or what its screen has room for below a title."""
    usual = QSize(width_px, height_px)
    if QGuiApplication.platformName() != "offscreen":  # whose screen says nothing
        usual = usual.boundedTo(window.screen().availableSize() - QSize(0, _TITLE_PX))
    window.resize(usual)


def closing(dialog: QDialog) -> QDialogButtonBox:
    """Row of buttons that ends a dialog by Close alone."""
    buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Close, dialog)
    buttons.rejected.connect(dialog.reject)
    return buttons


class ExportButtons(QDialogButtonBox):
    """Buttons Export…, which calls ``ask`` for a destination, and Cancel, which ends the dialog."""

    def __init__(self, dialog: QDialog, ask: Callable[[], None]) -> None:
        super().__init__(QDialogButtonBox.StandardButton.Cancel, dialog)
        self._export = self.addButton("Export…", QDialogButtonBox.ButtonRole.ActionRole)
        self._export.setDefault(True)
        self._export.clicked.connect(ask)
        self.rejected.connect(dialog.reject)

    def show_state(self, *, possible: bool, exporting: bool = False) -> None:
        """Follow the state: something can be exported, or is being written."""
        self._export.setEnabled(possible and not exporting)
        self._export.setText("Exporting…" if exporting else "Export…")


def ask_figure(parent: QWidget, title: str, name: str) -> Path | None:
    """Let the user choose; a name without an ending gets that of the kind."""
    chosen, kind = QFileDialog.getSaveFileName(parent, title, f"{name}.png", FIGURES)
    return _completed(parent, title, chosen, f".{kind[:3].lower()}", SUFFIXES)


def ask_file(parent: QWidget, title: str, kinds: str, start: str = "") -> Path | None:
    """Let the user choose a file that is there."""
    chosen, _ = QFileDialog.getOpenFileName(parent, title, start, kinds)
    return Path(chosen) if chosen else None


def ask_folder(parent: QWidget, title: str) -> Path | None:
    """Let the user choose a folder that is there."""
    chosen = QFileDialog.getExistingDirectory(parent, title)
    return Path(chosen) if chosen else None


def show_in_files(folder: Path) -> None:
    """Show a folder in the desktop's own window."""
    QDesktopServices.openUrl(QUrl.fromLocalFile(str(folder)))


def ask_new(
    parent: QWidget,
    title: str,
    start: str,
    kinds: str = "",
    suffix: str = "",
    others: Collection[str] = (),
) -> Path | None:
    """Let the user name a file or folder to write.

    ``suffix`` is added to a name with neither it nor one of the ``others``.
    """
    chosen, _ = QFileDialog.getSaveFileName(parent, title, start, kinds)
    return _completed(parent, title, chosen, suffix, others)


def _completed(
    parent: QWidget, title: str, chosen: str, suffix: str, others: Collection[str]
) -> Path | None:
    """A chosen path with its suffix; the dialog has not asked about a file of that name."""
    if not chosen:
        return None
    path = with_suffix(Path(chosen), suffix, others)
    if path == Path(chosen) or not path.exists():
        return path
    words = f"{path.name} exists. Replace it?"
    return path if confirmed(parent, title, words, Answer.Yes, Answer.Cancel) else None


def with_suffix(path: Path, suffix: str, others: Collection[str] = ()) -> Path:
    """Path with a suffix after its name, unless it has it, or one of the others."""
    has = path.suffix.lower() in (suffix, *others)
    return path if has else path.with_name(path.name + suffix)
