"""Session of the open recording: lock against other windows, journal, recovery offers."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject, QTimer, Signal

from sd2app.labels.model import LabelsModel
from sd2app.session.content import UNTITLED
from sd2app.session.document import DocumentModel
from sd2app.widgets.text import clock_text
from sd2core.errors import Sd2Error
from sd2core.files.edit_lock import HEARTBEAT_EVERY_S, edit_lock
from sd2core.labels.comparison import changed_stretch
from sd2core.labels.journal import Journal
from sd2core.labels.recovery import Recoverable, Recoveries, RecoveryPlace, offers_in
from sd2core.labels.spans import Labels
from sd2core.recording.edited import differing, edited_fields
from sd2core.recording.recording import Recording

_NOTHING_OPEN = "Nothing is open: labels belong to a recording"


class LabelAutosave(QObject):
    """Edits of one recording in this window, from opening to closing.

    One window edits the labels; another is read-only and says why. A journal begins with the first
    step of the history that edits labels or what :mod:`sd2core.recording.edited` names; every step,
    and every one back, is on disk before its labels are shown. ``done_at`` then has the earliest
    start and latest end of changed spans. ``root`` is the recovery folder, shared by all windows.
    """

    changed = Signal()  # read-only state, offers or notes
    done_at = Signal(float, float)
    noted = Signal(str)
    failed = Signal(str)

    def __init__(
        self, document: DocumentModel, labels: LabelsModel, root: Path, parent: QObject
    ) -> None:
        super().__init__(parent)
        self._document, self._labels, self._root = document, labels, root
        self._place: RecoveryPlace | None = None
        self._journal: Journal | None = None
        self._keeping = True
        self._refusal = ""
        self._offers: tuple[Recoverable, ...] = ()
        self._wanted: Recoverable | None = None
        self._recording: Recording | None = None  # the one that the history is of
        self._kept: tuple[Labels, dict[str, Any]] = Labels(), {}  # with other fields, or saved
        self._step = 0  # of the history
        self.notes: tuple[str, ...] = ()  # on unreadable sessions, or edits that are not kept
        self.waiting = Recoveries()  # at the start, until a recording is open
        heartbeat = QTimer(self)
        heartbeat.timeout.connect(lambda: self._place is not None and self._place.heartbeat())
        heartbeat.start(round(HEARTBEAT_EVERY_S * 1000))
        document.saved.connect(self._follow_saving)
        document.undo_stack.indexChanged.connect(self._follow_history)

    @property
    def refusal(self) -> str:
        """Reason why labels cannot be edited here; empty where they can."""
        return _NOTHING_OPEN if self._document.content is None else self._refusal

    @property
    def read_only(self) -> bool:
        """True while labels are shown that cannot be edited here."""
        return self._document.content is not None and bool(self._refusal)

    @property
    def offer(self) -> Recoverable | None:
        """Unsaved labels of an earlier session that are offered, or None."""
        return self._offers[0] if self._offers else None

    # --- opening and closing --------------------------------------------------------------

    def attach(self) -> None:
        """Begin a session for the recording just opened, unless another window has its labels."""
        recording = self._document.recording
        if recording is not None and not self._document.same_recording:
            self.close()
            self.waiting = Recoveries()
            self._begin(reread=True)
        elif recording is not None and self._is_elsewhere:
            self._move(recording)
        self._recording = recording
        same, model = self._document.same_recording, self._labels
        (model.set_labels if same else model.open)(self._document.labels)

    def try_again(self) -> None:
        """Read the labels again and edit them, if the other window has released them."""
        if self._place is None or not self.read_only:
            return
        self._take(reread=True)
        if self.read_only:
            self.noted.emit(self._refusal)
        else:
            self._labels.open(self._document.labels)

    def close(self) -> None:
        """End the session: all is saved, or the user discards it."""
        self._go_on_in(None)
        if self._place is not None:
            self._place.release()
        self._place = None
        self._refusal, self._offers, self.notes, self._keeping = "", (), (), True

    @property
    def _labelled_path(self) -> Path:
        """Path that names a recording's recoveries: its folder, or the file it was made from."""
        return next(iter(self._document.paths), UNTITLED)

    @property
    def _is_elsewhere(self) -> bool:
        return self._place is None or self._place.recording != self._labelled_path.resolve()

    def _move(self, recording: Recording) -> None:
        """Keep edits of what was never saved under the name of its files, which are others now."""
        place = RecoveryPlace(self._root, self._labelled_path)
        try:
            taken = place.take()
        except (OSError, Sd2Error):
            taken = False
        if not taken:
            return  # another window has that name: the one before goes on
        journal, before = self._journal, self._place
        self._journal, self._place, self._kept = None, place, (Labels(), {})
        self._keep("Files", recording)
        if journal is not None:
            with suppress(OSError):
                journal.close()
        if before is not None:
            before.release()

    def _begin(self, *, reread: bool) -> None:
        content, path = self._document.content, self._labelled_path
        beside = edit_lock(path) if content is not None and content.saved else None
        self._place = RecoveryPlace(self._root, path, beside)
        self._take(reread=reread)

    def _take(self, *, reread: bool) -> None:
        place, recording = self._place, self._document.recording
        assert place is not None
        assert recording is not None
        self._refusal = ""
        try:
            if not place.take():
                self._refusal = _held_words(place, recording.title)
            elif reread:  # another window may have saved since they were read
                self._document.read_labels_again()
        except OSError as error:
            # No journal is no reason not to edit.
            self.notes = (f"Edits are not kept until they are saved ({error}).",)
        except Sd2Error as error:
            place.release()
            self._refusal = str(error)
        recording.labels_elsewhere = bool(self._refusal)
        self._kept = self._document.labels, edited_fields(recording)
        if place.held:
            self._look_for_offers(place)
        self.changed.emit()

    def _follow_saving(self) -> None:
        recording = self._document.recording
        if recording is None:
            return
        self._recording = recording
        self._kept = self._document.labels, edited_fields(recording)
        if self._is_elsewhere:
            self.close()
            self._begin(reread=False)
        elif self._journal is not None:
            # Unwritten, what is in the file is offered, found to be the same, and dropped.
            with suppress(OSError):
                self._journal.saved()

    # --- every edit -----------------------------------------------------------------------

    def _follow_history(self, step: int) -> None:
        """Write a step to disk, then show its labels."""
        recording, stack = self._document.recording, self._document.undo_stack
        back, self._step = step < self._step, step
        # The history of the recording before is cleared when another one is there already.
        if recording is None or recording is not self._recording:
            return
        self._keep(f"Undo {stack.redoText().lower()}" if back else stack.undoText(), recording)
        before, labels = self._labels.labels, self._document.labels
        if labels != before:
            self._labels.set_labels(labels)
            if (stretch := changed_stretch(before, labels)) is not None:
                self.done_at.emit(*stretch)

    def _keep(self, name: str, recording: Recording) -> None:
        """Write what differs from what was written last; report a failure."""
        place, before = self._place, self._kept
        self._kept = labels, others = self._document.labels, edited_fields(recording)
        if self._kept == before:
            return
        try:
            if place is None or not place.take():
                return
            if self._journal is None:
                self._journal = place.begin(before[0])
            self._journal.write(name, labels, None if others == before[1] else others)
        except OSError as error:
            self._tell_unkept(error)
        else:
            if not self._keeping:
                self.noted.emit("Edits are kept again.")
            self._keeping = True

    def _tell_unkept(self, error: OSError) -> None:
        if self._keeping:
            self.failed.emit(
                f"The edit is made, but could not be kept for the case of a crash ({error})."
                " Save the recording; free space where that is missing."
            )
        self._keeping = False

    def _go_on_in(self, journal: Journal | None) -> None:
        before, self._journal = self._journal, journal
        if before is not None:
            with suppress(OSError):
                before.close()

    # --- recovery ----------------------------------------------------------------------

    def look_around(self) -> None:
        """Find recordings with unsaved labels, at the start."""
        self.waiting = offers_in(self._root)
        self.changed.emit()

    def recoveries(self) -> Recoveries:
        """Find unsaved labels of all recordings, discarded ones included."""
        others = offers_in(self._root, declined=True)
        if self._place is None or not self._place.held:
            return others
        own = self._place.offers(declined=True)
        offers = sorted((*own.offers, *others.offers), key=lambda one: -one.time_unix_s)
        return Recoveries(tuple(offers), (*own.notes, *others.notes))

    def is_of_open(self, offer: Recoverable) -> bool:
        """True if the offer is for the open recording."""
        return self._place is not None and self._place.recording == offer.recording

    def give_up(self, offer: Recoverable) -> None:
        """Discard an offer; one that was discarded before is deleted."""
        own = self._place if self.is_of_open(offer) else None
        place = own or RecoveryPlace(self._root, offer.recording)
        try:
            if place.take():
                (place.delete if offer.declined else place.decline)(offer)
        except OSError as error:
            self.failed.emit(str(error))
        finally:
            if own is None:
                place.release()
        self._offers = tuple(one for one in self._offers if one != offer)
        self.waiting = Recoveries(tuple(one for one in self.waiting.offers if one != offer))
        self.changed.emit()

    def ask_for(self, offer: Recoverable) -> None:
        """Offer these labels, now or when their recording is open."""
        self._wanted = offer
        if self._place is not None and self._place.held:
            self._look_for_offers(self._place)
            self.changed.emit()

    def changed_others(self, offer: Recoverable) -> list[str]:
        """Name what an offer changes besides labels, in words."""
        recording = self._document.recording
        if offer.others is None or recording is None:
            return []
        return differing(offer.others, edited_fields(recording))

    def take_offer(self) -> Labels:
        """Continue with the labels offered, in a journal of their own."""
        offer, place = self._offers[0], self._place
        assert place is not None
        try:
            journal = place.begin(offer.labels, offer)
        except OSError as error:
            self._tell_unkept(error)
        else:
            self._go_on_in(journal)
            self._kept = offer.labels, offer.others or self._kept[1]
        self.postpone()
        return offer.labels

    def decline(self) -> None:
        """Discard the present offer; :meth:`recoveries` still lists it."""
        if self._offers[0].declined:
            self.postpone()
        else:
            self.give_up(self._offers[0])

    def postpone(self) -> None:
        """Offer it again when the recording is opened the next time."""
        self._offers = self._offers[1:]
        self.changed.emit()

    def dismiss(self) -> None:
        """Clear the notes once they were read."""
        self.notes, self.waiting = (), Recoveries()
        self.changed.emit()

    def _look_for_offers(self, place: RecoveryPlace) -> None:
        wanted = self._wanted.files if self._wanted is not None else ()
        recoveries = place.offers(declined=bool(wanted))
        asked = [one for one in recoveries.offers if one.files == wanted]
        if asked:
            self._wanted = None
        others = (one for one in recoveries.offers if not one.declined and one not in asked)
        self._offers = tuple(self._other_than_open(place, (*asked, *others)))
        self.notes = recoveries.notes

    def _other_than_open(
        self, place: RecoveryPlace, offers: Iterable[Recoverable]
    ) -> Iterable[Recoverable]:
        """Offers that differ from what is open; the others are deleted as redundant."""
        for offer in offers:
            if offer.labels != self._document.labels or self.changed_others(offer):
                yield offer
            else:
                with suppress(OSError):
                    place.delete(offer)


def _held_words(place: RecoveryPlace, title: str) -> str:
    holder = place.holder()
    who = str(holder) if holder and holder.host else "another user"
    since = f" since {clock_text(holder.since_unix_s)}" if holder and holder.since_unix_s else ""
    return (
        f"The labels of {title} are edited by {who}{since}; here they can only be looked at, and"
        " what else is edited is kept once it is saved"
    )
