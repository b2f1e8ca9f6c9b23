"""Dialog of unsaved labels of all recordings: open, write to a file, discard."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QSize, Qt
from PySide6.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QFileDialog,
    QHeaderView,
    QMessageBox,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from sd2app.labels.autosave import LabelAutosave
from sd2app.widgets.panel import sentence
from sd2app.widgets.text import clock_text
from sd2core.errors import Sd2Error
from sd2core.labels.comparison import compare
from sd2core.labels.files import write_labels
from sd2core.labels.recovery import Found, Offer
from sd2core.labels.spans import Labels

_SAID = (
    "Edits of labels that were not saved when the program ended. Open a recording to see what"
    " they change."
)
_NOTHING = "There is nothing to recover: all edits were saved or discarded."
_ROW_PX, _MARGIN_PX = 24, 16
_HEADINGS = ("Recording", "Edits that were not saved", "Holds", "")


def choose_recovery(session: LabelAutosave, parent: QWidget) -> Offer | None:
    """Show the dialog; return the offer whose recording is to be opened."""
    dialog = RecoverLabelsDialog(session, parent)
    accepted = dialog.exec() == QDialog.DialogCode.Accepted
    dialog.deleteLater()
    return dialog.chosen if accepted else None


class RecoverLabelsDialog(QDialog):
    """A row for each session with unsaved edits."""

    def __init__(self, session: LabelAutosave, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self.chosen: Offer | None = None
        self.setWindowTitle("Recover labels")
        self._said, self._notes = sentence(""), sentence("", "warning")
        self._said.setAlignment(Qt.AlignmentFlag.AlignTop)
        self._list = QTreeWidget(self)
        self._list.setHeaderLabels(_HEADINGS)
        self._list.setAccessibleName("Labels that can be recovered")
        self._list.setRootIsDecorated(False)
        self._list.setUniformRowHeights(True)
        self._list.setAllColumnsShowFocus(True)
        self._list.header().setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        self._list.currentItemChanged.connect(self._follow)
        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Close, self)
        roles = QDialogButtonBox.ButtonRole
        self._open = buttons.addButton("Open recording", roles.AcceptRole)
        self._write = buttons.addButton("Write to file…", roles.ActionRole)
        self._discard = buttons.addButton("Discard", roles.ActionRole)
        self._list.itemActivated.connect(lambda *_: self._open.isEnabled() and self._accept())
        self._open.clicked.connect(self._accept)
        self._write.clicked.connect(self._write_file)
        self._discard.clicked.connect(self._give_up)
        buttons.rejected.connect(self.reject)
        layout = QVBoxLayout(self)
        for one in (self._said, self._list, self._notes, buttons):
            layout.addWidget(one)
        self.resize(800, 320)
        self._fill()

    def _fill(self) -> None:
        found = self._session.recoveries()
        self._list.clear()
        for offer in found.offers:
            item = QTreeWidgetItem(
                [
                    offer.recording.name,
                    edits_text(offer),
                    spans_text(offer.labels),
                    "discarded" if offer.declined else "",
                ]
            )
            item.setData(0, Qt.ItemDataRole.UserRole, offer)
            item.setToolTip(0, str(offer.recording))
            width = self._list.fontMetrics().horizontalAdvance(offer.recording.name)
            item.setSizeHint(0, QSize(width + _MARGIN_PX, _ROW_PX))
            self._list.addTopLevelItem(item)
        self._said.setText(_SAID if found.offers else _NOTHING)
        self._list.setVisible(bool(found.offers))
        self._notes.setText("\n".join(found.notes))
        self._notes.setVisible(bool(found.notes))
        if (first := self._list.topLevelItem(0)) is not None:
            self._list.setCurrentItem(first)
        self._follow()

    @property
    def _offer(self) -> Offer | None:
        item = self._list.currentItem()
        return None if item is None else item.data(0, Qt.ItemDataRole.UserRole)

    def _follow(self) -> None:
        offer = self._offer
        there = offer is not None and offer.recording.exists()
        self._open.setEnabled(there)
        self._open.setToolTip(
            f"{offer.recording} is not there any more; its labels can be written to a file"
            if offer is not None and not there
            else "Its labels are offered there beside those that were saved"
        )
        self._write.setEnabled(offer is not None)
        self._discard.setEnabled(offer is not None)
        declined = offer is not None and offer.declined
        self._discard.setText("Delete…" if declined else "Discard")
        self._discard.setToolTip(
            "Delete them for good" if declined else "Offer them no more; this list keeps them"
        )

    # --- what is clicked ------------------------------------------------------------------

    def _accept(self) -> None:
        self.chosen = self._offer
        self.accept()

    def _write_file(self) -> None:
        offer = self._offer
        assert offer is not None
        name, _ = QFileDialog.getSaveFileName(
            self, "Write labels", f"{offer.recording.stem}-labels.json", "Labels (*.json)"
        )
        if name:
            try:
                write_labels(Path(name), offer.labels, recording=offer.recording)
            except (OSError, Sd2Error) as error:
                QMessageBox.warning(self, "Write labels", str(error))

    def _give_up(self) -> None:
        offer = self._offer
        assert offer is not None
        if offer.declined and not self._sure(offer):
            return
        self._session.give_up(offer)
        self._fill()

    def _sure(self, offer: Offer) -> bool:
        buttons = QMessageBox.StandardButton
        answer = QMessageBox.question(
            self,
            "Delete for good?",
            f"{edits_text(offer)} of {offer.recording.name} are deleted and cannot be restored.",
            buttons.Discard | buttons.Cancel,
            buttons.Cancel,
        )
        return answer == buttons.Discard


def edits_text(offer: Offer) -> str:
    """Return the number of edits, and time and name of the last."""
    edits = "1 edit" if offer.edits == 1 else f"{offer.edits:,} edits"
    return f"{edits} until {clock_text(offer.time_unix_s)}, the last “{offer.last}”"


def spans_text(labels: Labels) -> str:
    """Return the number of spans."""
    return "1 span" if len(labels.spans) == 1 else f"{len(labels.spans):,} spans"


def offer_text(offer: Offer, there: Labels) -> str:
    """Describe an offer, compared with the open labels."""
    difference = compare(there, offer.labels)
    return f"{edits_text(offer)}. {spans_text(offer.labels)}; against what is open: {difference}."


def waiting_text(found: Found) -> str:
    """Name the recordings with unsaved labels; empty without any."""
    names = list(dict.fromkeys(one.recording.name for one in found.offers if not one.declined))
    if not names:
        return ""
    listed = ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")
    return f"The program ended before labels were saved: {listed}."
