"""Import of labels: a file is read, shown, and taken as the user chooses."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from PySide6.QtCore import QSize
from PySide6.QtWidgets import QWidget

from sd2app.feature import Shell
from sd2app.labels.edits import LabelEdits
from sd2app.manual.help import with_help
from sd2app.session.content import UNTITLED
from sd2app.widgets.dialogs import Dialog, accepted, accepting, ask_file
from sd2app.widgets.inputs import Choice, NumberBox
from sd2app.widgets.layouts import column_of, form_of
from sd2app.widgets.panel import FactRows, copy_button, rule, sentence, show_words, title
from sd2app.widgets.text import counted, quoted
from sd2core.cli.labels import Convert
from sd2core.cli.running import explanation
from sd2core.errors import Sd2Error
from sd2core.io.imu_columns import holds_inertial_signals
from sd2core.labels.formats import (
    FORMATS,
    READ_ONLY,
    LabelReading,
    observations,
    read_label_file,
    readable_formats,
)
from sd2core.labels.import_labels import Incoming, Way
from sd2core.labels.spans import Labels
from sd2core.options.records import words_of
from sd2core.recording.recording import Recording
from sd2core.timebase import Timebase

_WAYS: dict[Way, str] = {
    "add": "on tracks of their own",
    "replace": "instead of all labels of this recording",
}
_MAX_NAMED = 6
_MAX_FACTS = 7
_LONGEST_MARK_S = 600.0


def label_files() -> str:
    """Files of labels, for a dialog."""
    suffixes = dict.fromkeys(suffix for one in readable_formats() for suffix in one.suffixes)
    return f"Labels ({' '.join(f'*{suffix}' for suffix in suffixes)});;All files (*)"


def is_label_file(path: Path) -> bool:
    """True for a file of labels by its name; an inertial sensor's table is none by its heading.

    Those that only plug-ins read are imported from the menu.
    """
    known = {suffix for one in (*FORMATS, *READ_ONLY) for suffix in one.suffixes}
    if path.suffix.lower() not in known or path.name == "recording.json":
        return False
    return not holds_inertial_signals(path)


def import_labels(shell: Shell, edits: LabelEdits, path: Path | None = None) -> None:
    """Ask for a file unless there is one, preview it, and import it."""
    if edits.refusal:
        shell.warn(edits.refusal)
        return
    parent = shell.dialog_parent
    if path is None:
        path = ask_file(parent, "Import labels", label_files())
        if path is None:
            return
    labels, base = edits.labels.labels, edits.playback.timebase
    dialog = LabelImportDialog(path, labels, base, parent, edits.recording)
    taken, incoming, way, name = accepted(dialog), dialog.incoming, dialog.way, path.stem
    if taken and incoming is not None:
        edits.apply(lambda now: incoming.take_into(now.labels, way, name))


def _frame_source(recording: Recording) -> dict[str, Any]:
    """Option by which commands find times of frames: the saved recording, or a file."""
    sources = {"video": recording.video, "mesh": recording.mesh}
    if recording.folder != UNTITLED:
        sources = {"recording": recording.folder}
    return dict([(name, path) for name, path in sources.items() if path is not None][:1])


def _spans(incoming: Incoming) -> str:
    spans = incoming.labels.spans
    if not spans:
        return "none within this recording" if incoming.outside else "none"
    end_s = max(span.end_s for span in spans)
    return f"{len(spans):,}, from {spans[0].start_s:.3f} to {end_s:.3f} s"


def _names(names: Sequence[str]) -> str:
    more = len(names) - _MAX_NAMED
    shown = ", ".join(names[:_MAX_NAMED])
    return f"{shown} and {more} more" if more > 0 else shown


class LabelImportDialog(Dialog):
    """Content of a label file above, choices below; read again when its format is chosen."""

    def __init__(
        self,
        path: Path,
        labels: Labels,
        timebase: Timebase,
        parent: QWidget | None = None,
        recording: Recording | None = None,
    ) -> None:
        super().__init__("Import labels", parent)
        self._recording = recording
        self._path, self._labels, self._timebase = path, labels, timebase
        self.reading: LabelReading | None = None  # what the file has; None: it cannot be read
        self.incoming: Incoming | None = None  # the same, fitted to the recording
        self.problem = ""  # why the file cannot be read
        self.observations: tuple[str, ...] = ()  # to choose from, where there are several videos
        self._observed: str | None = None
        self._format = Choice(
            "The program that the file is of",
            self,
            {
                None: "found by name and content",
                **{one.name: one.title for one in readable_formats()},
            },
            self._read_as,
        )
        self._observation = Choice("Which of the videos in the file", self)
        self._observation.currentTextChanged.connect(self._observe)
        self._facts = FactRows(_MAX_FACTS, at_the_edge=False, parent=self)
        self._message, self._consequence = sentence("", "warning"), sentence("")
        self._way = Choice("What becomes of the labels that are there", self, _WAYS)
        self._way.show_value("add" if labels.spans else "replace")
        self._way.currentIndexChanged.connect(self._refresh)
        buttons, self._import = accepting(self, "Import")
        self._mark = NumberBox(
            0.0, _LONGEST_MARK_S, " s", "Length of marks without a duration", decimals=3
        )
        self._mark.setSpecialValueText("the frame shown then")
        self._mark.valueChanged.connect(self._read)
        form = self._form = form_of(
            ("Read as", self._format),
            ("Observation", self._observation),
            ("Marks become", self._mark),
        )
        take = form_of(("Take them", self._way))
        foot = with_help("Import labels", buttons, copy_button(lambda: self.line, self))
        content = form, rule(), self._message, self._facts, rule(), take, self._consequence
        parts = title(path.name), *content, 8, foot
        self.setLayout(column_of(*parts, spacing_px=8, margins_px=16))
        self._read()
        self.setMinimumWidth(560)

    @property
    def way(self) -> Way:
        """Replace the present labels, or add to them."""
        return self._way.currentData()

    @property
    def line(self) -> str:
        """Command for a terminal that reads the file likewise, to a file of our own."""
        recording, name = self._recording, f"{self._path.stem}-imported.json"
        clock = {} if recording is None else _frame_source(recording)
        convert = Convert(
            file=self._path,
            out=Path(name),
            format=self._format.currentData(),
            observation=self._observed,
            mark_s=self._mark.value() or None,
            **clock,
        )
        return quoted(words_of("labels convert", convert))

    def facts(self) -> list[tuple[str, str]]:
        """Return names and values on the content and what importing changes."""
        incoming = self.incoming
        if incoming is None:
            return []
        tracks = incoming.labels.tracks
        counts = Counter(span.label for span in incoming.labels.spans)
        facts = [
            ("Spans", _spans(incoming)),
            ("Tracks", f"{len(tracks)}: {_names([track.name for track in tracks])}"),
            ("Labels", _names([f"{name} ({count})" for name, count in counts.items()]) or "none"),
        ]
        if unknown := incoming.unknown(incoming.set_after(self._labels.label_set, self.way)):
            are = "It is" if len(unknown) == 1 else "They are"
            text = f"{_names(list(unknown))}. {are} kept and shown in grey."
            facts.append(("Not in the label set", text))
        if incoming.cut:
            spans = counted(len(incoming.cut), "span")
            facts.append(("Cut", f"{spans} beyond the recording, cut where it ends or begins"))
        if incoming.outside:
            spans, base = counted(len(incoming.outside), "span"), self._timebase
            where = f"outside the recording ({base.start_s:.3f} to {base.end_s:.3f} s)"
            facts.append(("Left out", f"{spans} {where}"))
        if self.reading is not None and (self.reading.left_out or self.reading.remarks):
            facts.append(("Of the file", self.reading.sentence))
        return facts

    def consequence(self) -> str:
        """Return a sentence on the effect on present labels."""
        count = len(self._labels.spans)
        if self.way == "add":
            return "Nothing that is there changes. Undo takes the import back."
        if not count:
            return "There are no labels to replace. Undo takes the import back."
        return f"The {counted(count, 'span')} of this recording go. Undo brings them back."

    def _read_as(self, _: str | None) -> None:
        self._observed, self.observations = None, ()
        self._read()

    def _observe(self, name: str) -> None:
        if name and name != self._observed:
            self._observed = name
            self._read()

    def _read(self) -> None:
        self.reading, self.incoming, self.problem = None, None, ""
        path, name, base = self._path, self._format.currentData(), self._timebase
        try:
            names = observations(path, name)
            self.observations = names if len(names) > 1 else ()
            self._observed = self._observed or next(iter(self.observations), None)
            chosen, mark_s = self._observed or next(iter(names), None), self._mark.value() or None
            self.reading = read_label_file(path, base, name, observation=chosen, mark_s=mark_s)
            self.incoming = Incoming.of(self.reading.labels, base)
        except (Sd2Error, OSError) as error:
            self.problem = str(explanation(error))
        self._refresh()

    def _refresh(self) -> None:
        show_words(self._message, self.problem)
        self._facts.show_facts(self.facts())
        self._form.setRowVisible(self._observation, bool(self.observations))
        observed = self.observations.index(self._observed) if self._observed else -1
        self._observation.offer(self.observations, observed)
        self._consequence.setText(self.consequence())
        incoming, layout = self.incoming, self.layout()
        if layout is not None and layout.hasHeightForWidth():  # facts wrap
            self.resize(self.size().expandedTo(QSize(0, layout.totalHeightForWidth(self.width()))))
        self._import.setEnabled(incoming is not None and not incoming.refusal(self.way))
