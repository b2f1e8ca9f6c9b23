"""What the menu of labels asks about files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QDialog, QFileDialog, QMessageBox, QWidget

from sd2app.labels.cut_out_dialog import CutOutDialog
from sd2app.labels.cut_out_model import groups
from sd2app.labels.export_dialog import LabelExportDialog
from sd2app.labels.export_model import LabelExportModel
from sd2app.labels.import_dialog import LabelImportDialog
from sd2app.labels.import_model import LABEL_SUFFIXES, LabelImportModel, is_label_file
from sd2core.labels.import_labels import take_in

if TYPE_CHECKING:
    from sd2app.shell.wiring import Context
    from sd2app.widgets.message_bar import MessageBar

_PATTERNS = " ".join(f"*{suffix}" for suffix in LABEL_SUFFIXES)
LABEL_FILES = f"Labels ({_PATTERNS});;All files (*)"


class LabelFileDialogs:
    """Asks, then calls models and edits; what came of it is said over the window."""

    def __init__(
        self,
        parent: QWidget,
        context: Context,
        messages: MessageBar,
        show_agreement: Callable[[], object],
    ) -> None:
        self._parent, self._context, self._messages = parent, context, messages
        self._show_agreement = show_agreement
        context.cut_out.asked.connect(self.decide_on_others)
        context.cut_out.noted.connect(messages.note)
        context.cut_out.failed.connect(messages.warn)

    def take_dropped(self, path: Path) -> bool:
        """Import a file of labels once the drop is over; False where it is none."""
        if not is_label_file(path):
            return False
        # A dialog during the drop would keep the program waiting that it came from.
        QTimer.singleShot(0, lambda: self.import_labels(path))
        return True

    def import_labels(self, path: Path | None = None) -> None:
        """Ask for a file unless there is one, show what it holds, and take it."""
        c = self._context
        if c.label_edits.refusal:
            self._messages.warn(c.label_edits.refusal)
            return
        if path is None:
            name, _ = QFileDialog.getOpenFileName(self._parent, "Import labels", "", LABEL_FILES)
            if not name:
                return
            path = Path(name)
        model = LabelImportModel(path, c.labels.labels, c.playback.timebase, self._parent)
        dialog = LabelImportDialog(model, self._parent)
        accepted = dialog.exec() == QDialog.DialogCode.Accepted
        incoming, way = model.incoming, model.way
        model.close()
        for done in (dialog, model):
            done.deleteLater()
        if accepted and incoming is not None:
            c.label_edits.apply(lambda labels, _: take_in(labels, incoming, way, path.stem))

    def export_labels(self) -> None:
        """Show what a format can hold, ask for a file, and write it."""
        c = self._context
        content = c.document.content
        if content is None:
            return
        model = LabelExportModel(
            c.labels.labels, c.playback.timebase, content.recording.video, self._parent
        )
        model.written.connect(lambda written: self._messages.note(str(written)))
        dialog = LabelExportDialog(model, c.document.title, self._parent)
        dialog.exec()
        model.close()
        for done in (dialog, model):
            done.deleteLater()

    def compare_labels(self) -> None:
        """Ask for the file of another person, and show how far the two agree."""
        name, _ = QFileDialog.getOpenFileName(
            self._parent, "Compare with another's labels", "", LABEL_FILES
        )
        if name:
            self._context.agreement.open(Path(name))
            self._show_agreement()

    def cut_out(self) -> None:
        """Ask which spans, what of them and where to, and cut them out in the background."""
        c = self._context
        source = c.cut_out.source()
        offered = groups(c.labels.labels, c.labels.selected)
        if source is None:
            return
        if not offered[-1][1]:
            self._messages.warn("There is nothing to cut out: accept the suggestions first.")
            return
        dialog = CutOutDialog(offered, source, self._parent)
        accepted = dialog.exec() == QDialog.DialogCode.Accepted
        spans, parts = dialog.spans, dialog.parts
        dialog.deleteLater()
        if not accepted:
            return
        folder = QFileDialog.getExistingDirectory(self._parent, "Folder for the cut-outs")
        if folder:
            c.cut_out.start(spans, parts, Path(folder))

    def decide_on_others(self, count: int, example: str) -> None:
        """Folders hold something else: ask what becomes of them."""
        buttons = QMessageBox.StandardButton
        box = QMessageBox(self._parent)
        box.setWindowTitle("Replace cut-outs?")
        box.setText(
            f"{count} folder{'s' * (count != 1)} of the same name hold something else, such as"
            f" {example}."
        )
        replace = box.addButton("Replace", QMessageBox.ButtonRole.DestructiveRole)
        keep = box.addButton("Keep them", QMessageBox.ButtonRole.AcceptRole)
        box.addButton(buttons.Cancel)
        box.setDefaultButton(keep)
        box.exec()
        if box.clickedButton() in (replace, keep):
            self._context.cut_out.go_on(replace_others=box.clickedButton() is replace)
        else:
            self._context.cut_out.give_up()
        box.deleteLater()
