"""Import of labels: reading of a file in the background, preview, and choices."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import QObject, QSignalBlocker, Signal
from PySide6.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QFileDialog,
    QFormLayout,
    QLabel,
    QWidget,
)

from sd2app.background.latest import Emit, LatestRunner
from sd2app.feature import Shell
from sd2app.labels.edits import LabelEdits
from sd2app.widgets.dialogs import LABEL_FILES, LABEL_SUFFIXES
from sd2app.widgets.inputs import Choice
from sd2app.widgets.layouts import column_of
from sd2app.widgets.panel import FactRows, rule, say, sentence, title
from sd2app.widgets.text import counted
from sd2core.labels.formats import FORMATS, format_for, read_labels
from sd2core.labels.formats.boris import observations
from sd2core.labels.import_labels import Incoming, Way, set_after, take_in
from sd2core.labels.spans import Labels
from sd2core.timebase import Timebase

_MOST_NAMED = 6
_MOST_FACTS = 6


def is_label_file(path: Path) -> bool:
    """True for the name of a label file; a ``recording.json`` is none."""
    return path.suffix.lower() in LABEL_SUFFIXES and path.name != "recording.json"


def import_labels(shell: Shell, edits: LabelEdits, path: Path | None = None) -> None:
    """Ask for a file unless there is one, preview it, and import it."""
    if edits.refusal:
        shell.warn(edits.refusal)
        return
    parent = shell.dialog_parent
    if path is None:
        name, _ = QFileDialog.getOpenFileName(parent, "Import labels", "", LABEL_FILES)
        if not name:
            return
        path = Path(name)
    file = LabelFile(path, edits.labels.labels, edits.playback.timebase, parent)
    dialog = LabelImportDialog(file, parent)
    accepted = dialog.exec() == QDialog.DialogCode.Accepted
    incoming, way, name = file.incoming, file.way, path.stem
    file.close()
    for done in (dialog, file):
        done.deleteLater()
    if accepted and incoming is not None:
        edits.apply(lambda labels, _: take_in(labels, incoming, way, name))


class LabelFile(QObject):
    """Content of a label file, read again when its format is chosen."""

    changed = Signal()  # content, problem or choices

    def __init__(
        self, path: Path, labels: Labels, timebase: Timebase, parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self.path = path
        self.incoming: Incoming | None = None  # fitted to the recording; None while reading
        self.problem = ""
        self.way: Way = "add" if labels.spans else "replace"
        self.observations: tuple[str, ...] = ()  # to choose from, where there are several videos
        self.observation: str | None = None
        self._labels, self._timebase = labels, timebase
        self._format: str | None = None
        self._runner = LatestRunner("labels", self)
        self._runner.partial.connect(self._learn)
        self._runner.finished.connect(self._receive)
        self._runner.failed.connect(self._refuse)
        self._read()

    def set_way(self, way: Way) -> None:
        """Choose to replace the present labels or to add to them."""
        if way != self.way:
            self.way = way
            self.changed.emit()

    def read_as(self, name: str | None) -> None:
        """Read the file in a named format; None: by name and content."""
        if name != self._format:
            self._format, self.observation, self.observations = name, None, ()
            self._read()

    def set_observation(self, name: str) -> None:
        """Read the labels of this observation."""
        if name != self.observation:
            self.observation = name
            self._read()

    def facts(self) -> list[tuple[str, str]]:
        """Return names and values on the content and what importing changes."""
        found = self.incoming
        if found is None:
            return []
        tracks, counts = found.labels.tracks, Counter(span.label for span in found.labels.spans)
        facts = [
            ("Spans", _spans(found)),
            ("Tracks", f"{len(tracks)}: {_names([track.name for track in tracks])}"),
            ("Labels", _names([f"{name} ({count})" for name, count in counts.items()]) or "none"),
        ]
        if unknown := found.unknown(set_after(self._labels.label_set, found, self.way)):
            are = "It is" if len(unknown) == 1 else "They are"
            text = f"{_names(list(unknown))}. {are} kept and shown in grey."
            facts.append(("Not in the label set", text))
        if found.cut:
            spans = counted(len(found.cut), "span")
            facts.append(("Cut", f"{spans} beyond the recording, cut where it ends or begins"))
        if found.outside:
            spans, base = counted(len(found.outside), "span"), self._timebase
            where = f"outside the recording ({base.start_s:.3f} to {base.end_s:.3f} s)"
            facts.append(("Left out", f"{spans} {where}"))
        return facts

    def consequence(self) -> str:
        """Return a sentence on the effect on present labels."""
        count = len(self._labels.spans)
        if self.way == "add":
            return "Nothing that is there changes. Undo takes the import back."
        if not count:
            return "There are no labels to replace. Undo takes the import back."
        return f"The {counted(count, 'span')} of this recording go. Undo brings them back."

    def close(self) -> None:
        """Stop reading."""
        self._runner.close()

    def _read(self) -> None:
        self.incoming, self.problem = None, ""
        path, name, observation, base = self.path, self._format, self.observation, self._timebase

        def read(emit: Emit) -> Incoming:
            chosen = name or format_for(path, writing=False).name
            if chosen == "boris":
                emit(observations(path))
            labels = read_labels(path, base, chosen, observation=observation)
            return Incoming.of(labels, base)

        self._runner.submit(read)
        self.changed.emit()

    def _learn(self, names: tuple[str, ...]) -> None:
        self.observations = names if len(names) > 1 else ()

    def _receive(self, incoming: Incoming) -> None:
        self.incoming = incoming
        self.changed.emit()

    def _refuse(self, error: Exception) -> None:
        if self.observations and self.observation is None:
            # Not a fault: the user has not chosen yet.
            self.set_observation(self.observations[0])
            return
        self.problem = str(error)
        self.changed.emit()


def _spans(found: Incoming) -> str:
    spans = found.labels.spans
    if not spans:
        return "none within this recording" if found.outside else "none"
    end_s = max(span.end_s for span in spans)
    return f"{len(spans):,}, from {spans[0].start_s:.3f} to {end_s:.3f} s"


def _names(names: Sequence[str]) -> str:
    more = len(names) - _MOST_NAMED
    shown = ", ".join(names[:_MOST_NAMED])
    return f"{shown} and {more} more" if more > 0 else shown


class LabelImportDialog(QDialog):
    """View of :class:`LabelFile`: content above, choices below."""

    def __init__(self, file: LabelFile, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._file = file
        self.setWindowTitle("Import labels")
        self._format = Choice("The program that the file is of", self)
        self._format.addItem("found by name and content", None)
        for one in FORMATS:
            self._format.addItem(one.title, one.name)
        self._format.currentIndexChanged.connect(lambda _: file.read_as(self._format.currentData()))
        self._observation = Choice("Which of the videos in the file", self)
        self._observation.currentTextChanged.connect(
            lambda name: file.set_observation(name) if name else None
        )
        self._observation_name = QLabel("Observation", self)
        self._facts = FactRows(_MOST_FACTS, at_the_edge=False, parent=self)
        self._said, self._consequence = sentence(""), sentence("")
        self._way = Choice("What becomes of the labels that are there", self)
        self._way.addItem("on tracks of their own", "add")
        self._way.addItem("instead of all labels of this recording", "replace")
        self._way.currentIndexChanged.connect(lambda _: file.set_way(self._way.currentData()))
        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Cancel, self)
        self._import = buttons.addButton("Import", QDialogButtonBox.ButtonRole.AcceptRole)
        self._import.setDefault(True)
        buttons.accepted.connect(self.accept)
        buttons.rejected.connect(self.reject)
        form, take = QFormLayout(), QFormLayout()
        for rows in (form, take):
            rows.setHorizontalSpacing(12)
        form.addRow("Read as", self._format)
        form.addRow(self._observation_name, self._observation)
        take.addRow("Take them", self._way)
        content = form, rule(), self._said, self._facts, rule(), take, self._consequence
        parts = title(file.path.name), *content, 8, buttons
        self.setLayout(column_of(*parts, spacing_px=8, margins_px=(16, 16, 16, 16)))
        file.changed.connect(self._refresh)
        self._refresh()
        self.setMinimumWidth(560)

    def _refresh(self) -> None:
        file = self._file
        said = file.problem or ("" if file.incoming is not None else "Reading…")
        say(self._said, said, "warning" if file.problem else "muted")
        self._said.setVisible(bool(said))
        self._facts.show_facts(file.facts())
        for widget in (self._observation_name, self._observation):
            widget.setVisible(bool(file.observations))
        observed = file.observation
        self._observation.offer(
            file.observations, file.observations.index(observed) if observed else -1
        )
        with QSignalBlocker(self._way):
            self._way.setCurrentIndex(self._way.findData(file.way))
        self._consequence.setText(file.consequence())
        self._import.setEnabled(file.incoming is not None)
