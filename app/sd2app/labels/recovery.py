"""Offers of labels that were not saved: a notice, and a list of all recordings."""

from __future__ import annotations

from PySide6.QtCore import QSize, Qt
from PySide6.QtWidgets import (
    QDialogButtonBox,
    QMessageBox,
    QTreeWidgetItem,
    QWidget,
)

from sd2app.feature import Shell
from sd2app.labels.autosave import LabelAutosave
from sd2app.labels.edits import LabelEdits
from sd2app.manual.help import with_help
from sd2app.session.document import DocumentModel
from sd2app.widgets.dialogs import Dialog, accepted, ask_new, closing, may_delete
from sd2app.widgets.layouts import column_of
from sd2app.widgets.notices import Notice
from sd2app.widgets.panel import sentence, show_words
from sd2app.widgets.table import entry_list
from sd2app.widgets.text import clock_text, counted
from sd2core.errors import Sd2Error
from sd2core.labels.comparison import compare
from sd2core.labels.files import write_labels
from sd2core.labels.recovery import Recoverable

_ABOUT = (
    "Edits that were not saved when the program ended. Open a recording to see what they change."
)
_NOTHING = "There is nothing to recover: all edits were saved or discarded."
_ROW_PX, _MARGIN_PX = 24, 16
_HEADINGS = ("Recording", "Edits that were not saved", "Holds", "")


def _edits_text(offer: Recoverable) -> str:
    """Number of edits, and time and name of the last."""
    edits, until = counted(offer.edits, "edit"), clock_text(offer.time_unix_s)
    return f"{edits} until {until}, the last “{offer.last}”"


class LabelNotice(Notice):
    """Bar with a question about the labels; hidden when there is none."""

    def __init__(
        self, autosave: LabelAutosave, edits: LabelEdits, document: DocumentModel, shell: Shell
    ) -> None:
        buttons = (
            ("again", "Try again", "Edit them here, once the other window is closed",
             autosave.try_again),
            ("restore", "Restore", "Use these edits; one undo takes that back", edits.restore),
            ("decline", "Discard", "Do not offer them again; File → Recover labels… lists them",
             autosave.decline),
            ("postpone", "Not now", "Offer them again when this recording is opened next",
             autosave.postpone),
            ("recover", "Recover labels…", "See what is there, and open its recording",
             lambda: recover(autosave, document, shell)),
        )  # fmt: skip
        super().__init__("State of the labels", buttons, self._put_off)
        self._autosave, self._document = autosave, document
        autosave.changed.connect(self._refresh)
        # What is offered is compared with what is open by now.
        document.undo_stack.indexChanged.connect(lambda _: autosave.offer and self._refresh())
        self._refresh()

    def _put_off(self) -> None:
        if self._autosave.read_only:
            return
        if self._autosave.offer is not None:
            self._autosave.postpone()
        else:
            self._autosave.dismiss()

    def _refresh(self) -> None:
        autosave, offer = self._autosave, self._autosave.offer
        head, text, shown = "Labels were not saved", "", set()
        if autosave.read_only:
            head, text, shown = "Labels are read-only", f"{autosave.refusal}.", {"again"}
        elif offer is not None:
            others = self._autosave.changed_others(offer)
            head = f"{'Edits' if others else 'Labels'} were not saved"
            text, shown = self._offered(offer, others), {"restore", "decline", "postpone"}
        elif autosave.notes:
            head = "Labels"
        else:
            text, shown = self._waiting(), {"recover"}
        for name, button in self.buttons.items():
            button.setVisible(name in shown)
        self.show_words(head, "\n".join(filter(None, (text, *autosave.notes))))

    def _offered(self, offer: Recoverable, others: list[str]) -> str:
        """Offer, compared with what is open."""
        holds, difference = offer.labels, compare(self._document.labels, offer.labels)
        spans = counted(len(holds.spans), "span")
        changes = ", ".join(filter(None, (str(difference), *(f"another {one}" for one in others))))
        return f"{_edits_text(offer)}. {spans}; against what is open: {changes}."

    def _waiting(self) -> str:
        """Names of the recordings with unsaved labels; empty without any."""
        offers = self._autosave.waiting.offers
        names = list(dict.fromkeys(one.recording.name for one in offers if not one.declined))
        if not names:
            return ""
        listed = ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")
        return f"The program ended before labels were saved: {listed}."


def recover(autosave: LabelAutosave, document: DocumentModel, shell: Shell) -> None:
    """List what was not saved, and open the recording of what is chosen."""
    dialog = RecoverLabelsDialog(autosave, shell.dialog_parent)
    if not accepted(dialog) or (offer := dialog.offer) is None:
        return
    if autosave.is_of_open(offer):
        autosave.ask_for(offer)
    elif shell.may_discard():
        autosave.ask_for(offer)
        document.open([offer.recording])


class RecoverLabelsDialog(Dialog):
    """A row for each session with unsaved edits: open, write to a file, discard."""

    def __init__(self, autosave: LabelAutosave, parent: QWidget) -> None:
        super().__init__("Recover labels", parent)
        self._autosave = autosave
        self._about, self._notes = sentence(""), sentence("", "warning")
        self._about.setAlignment(Qt.AlignmentFlag.AlignTop)
        self._list = entry_list("Labels that can be recovered", _HEADINGS, 1, self)
        self._list.setAllColumnsShowFocus(True)
        self._list.currentItemChanged.connect(self._follow)
        buttons = closing(self)
        roles = QDialogButtonBox.ButtonRole
        self._open = buttons.addButton("Open recording", roles.AcceptRole)
        self._write = buttons.addButton("Write to file…", roles.ActionRole)
        self._discard = buttons.addButton("Discard", roles.ActionRole)
        self._list.itemActivated.connect(lambda *_: self._open.isEnabled() and self.accept())
        self._open.clicked.connect(self.accept)
        self._open.setDefault(True)
        self._write.clicked.connect(self._write_file)
        self._discard.clicked.connect(self._give_up)
        foot = with_help("Recover labels", buttons)
        self.setLayout(column_of(self._about, self._list, self._notes, foot))
        self.resize(800, 320)
        self._fill()

    def _fill(self) -> None:
        recoveries = self._autosave.recoveries()
        self._list.clear()
        for offer in recoveries.offers:
            name, spans = offer.recording.name, counted(len(offer.labels.spans), "span")
            declined = "discarded" if offer.declined else ""
            item = QTreeWidgetItem([name, _edits_text(offer), spans, declined])
            item.setData(0, Qt.ItemDataRole.UserRole, offer)
            item.setToolTip(0, str(offer.recording))
            width = self._list.fontMetrics().horizontalAdvance(name)
            item.setSizeHint(0, QSize(width + _MARGIN_PX, _ROW_PX))
            self._list.addTopLevelItem(item)
        self._about.setText(_ABOUT if recoveries.offers else _NOTHING)
        self._list.setVisible(bool(recoveries.offers))
        show_words(self._notes, "\n".join(recoveries.notes))
        if (first := self._list.topLevelItem(0)) is not None:
            self._list.setCurrentItem(first)
        self._follow()

    @property
    def offer(self) -> Recoverable | None:
        """Offer of the current row."""
        item = self._list.currentItem()
        return None if item is None else item.data(0, Qt.ItemDataRole.UserRole)

    def _follow(self) -> None:
        offer = self.offer
        exists = offer is not None and offer.recording.exists()
        self._open.setEnabled(exists)
        self._open.setToolTip(
            f"{offer.recording} is not there any more; its labels can be written to a file"
            if offer is not None and not exists
            else "Its labels are offered there beside those that were saved"
        )
        self._write.setEnabled(offer is not None)
        self._discard.setEnabled(offer is not None)
        declined = offer is not None and offer.declined
        self._discard.setText("Delete…" if declined else "Discard")
        self._discard.setToolTip(
            "Delete them for good" if declined else "Offer them no more; this list keeps them"
        )

    def _write_file(self) -> None:
        offer = self.offer
        assert offer is not None
        start = f"{offer.recording.stem}-labels.json"
        if path := ask_new(self, "Write labels", start, "Labels (*.json)", ".json"):
            try:
                write_labels(path, offer.labels, recording=offer.recording)
            except (OSError, Sd2Error) as error:
                QMessageBox.warning(self, "Write labels", str(error))

    def _give_up(self) -> None:
        offer = self.offer
        assert offer is not None
        what = f"{_edits_text(offer)} of {offer.recording.name} are deleted and cannot be restored."
        if not offer.declined or may_delete(self, "Delete for good?", what):
            self._autosave.give_up(offer)
            self._fill()
