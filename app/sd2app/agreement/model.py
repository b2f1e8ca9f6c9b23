"""Comparison of another person's labels with those of the recording."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Literal

from PySide6.QtCore import QObject, Signal

from sd2app.background.latest import Emit, LatestRunner, ReportingModel
from sd2app.labels.model import LabelsModel
from sd2app.session.content import folder_for_command
from sd2app.session.session import Session
from sd2app.widgets.text import quoted
from sd2core.cli.labels.agree import Agree
from sd2core.labels.agreement import Agreement, Disagreement, agreement, disagreements
from sd2core.labels.formats import read_label_file
from sd2core.labels.import_labels import Incoming
from sd2core.labels.spans import Labels
from sd2core.options.records import words_of

Compared = tuple[Agreement, tuple[Disagreement, ...]]


class AgreementModel(ReportingModel):
    """Agreement with the labels of a file, compared again when the recording's labels change.

    Suggestions that are not accepted yet are left out.
    """

    changed = Signal()

    def __init__(self, session: Session, labels: LabelsModel, parent: QObject) -> None:
        super().__init__(parent)
        self._labels, self._document = labels, session.document
        self._playback, self._span = session.playback, session.span
        self.other = LabelsModel(self)
        self.path: Path | None = None  # of the other person's labels, while they are open
        self.sentence = ""  # on what was taken of their file, and what was not
        self.left_out = 0  # spans of theirs outside the recording
        self.measures: Agreement | None = None  # until they are computed
        self.disagreements: tuple[Disagreement, ...] = ()  # in order
        self._comparer = LatestRunner("agreement", self, self._take, self._fail)
        labels.changed.connect(self._compare)

    @property
    def active(self) -> bool:
        """True while another person's labels are open."""
        return self.path is not None

    @property
    def name(self) -> str:
        """Name of the other person: that of the file."""
        return self.path.stem if self.path is not None else ""

    @property
    def line(self) -> str:
        """Command for a terminal that compares the labels of the saved recording."""
        content, other = self._document.content, self.path
        assert content is not None
        assert other is not None
        return quoted(
            words_of("labels agree", Agree(a=folder_for_command(content.recording), b=other))
        )

    @property
    def current(self) -> int | None:
        """Index of the disagreement at the cursor, or None."""
        now_s = self._playback.timebase.time_of(self._playback.frame)
        places = enumerate(self.disagreements)
        return next((k for k, one in places if one.start_s <= now_s < one.end_s), None)

    def open(self, path: Path) -> None:
        """Compare with the labels of a file; Sd2Error or OSError where it cannot be read."""
        base = self._playback.timebase
        reading = read_label_file(path, base)
        incoming = Incoming.of(reading.labels, base)
        self.path, self.sentence, self.left_out = path, reading.sentence, len(incoming.outside)
        self.measures, self.disagreements = None, ()
        # Colours are those of this recording wherever it has the label.
        own = self._labels.labels.label_set
        names = {one.name for one in own.labels}
        more = [one for one in incoming.labels.label_set.labels if one.name not in names]
        colours = replace(own, labels=(*own.labels, *(replace(one, key="") for one in more)))
        self.other.open(replace(incoming.labels, label_set=colours))
        self._compare()

    def clear(self) -> None:
        """End the comparison."""
        self._comparer.cancel()
        if self.active:
            self.path, self.sentence = None, ""
            self.measures, self.disagreements = None, ()
            self.other.open(Labels())
            self.changed.emit()

    def step(self, towards: Literal[-1, 1]) -> None:
        """Go to the start of the next disagreement, or of the previous one."""
        now_s = self._playback.timebase.time_of(self._playback.frame)
        starts_s = [one.start_s for one in self.disagreements]
        ahead_s = [start_s for start_s in starts_s if (start_s - now_s) * towards > 0]
        if ahead_s:
            start_s = ahead_s[0 if towards > 0 else -1]
            self._playback.seek(start_s)
            self._span.reveal(start_s)
            self.changed.emit()

    def _compare(self) -> None:
        if not self.active:
            return
        both = self._labels.labels, self.other.labels
        mine, theirs = (replace(labels, spans=labels.decided) for labels in both)
        base = self._playback.timebase

        def compare(emit: Emit) -> Compared:
            return agreement(mine, theirs, base), disagreements(mine.spans, theirs.spans, base)

        self._comparer.submit(compare)
        self.changed.emit()

    def _take(self, compared: Compared) -> None:
        self.measures, self.disagreements = compared
        self.changed.emit()
