"""Preview of a label file to import: its content and what importing changes."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QObject, Signal

from sd2app.background.latest import Emit, LatestRunner
from sd2core.labels.formats import FORMATS, format_for, read_labels
from sd2core.labels.formats.boris import observations
from sd2core.labels.import_labels import Incoming, Way, set_after
from sd2core.labels.spans import Labels, Span
from sd2core.timebase import Timebase

_MOST_NAMED = 6

LABEL_SUFFIXES = tuple(dict.fromkeys(suffix for one in FORMATS for suffix in one.suffixes))
LABEL_FILES = f"Labels ({' '.join(f'*{suffix}' for suffix in LABEL_SUFFIXES)});;All files (*)"
"""Filter of file choosers."""


def is_label_file(path: Path) -> bool:
    """True for the name of a label file; a ``recording.json`` is none."""
    return path.suffix.lower() in LABEL_SUFFIXES and path.name != "recording.json"


class LabelImportModel(QObject):
    """Reads a file in the background, again when its format is chosen."""

    changed = Signal()  # content, problem or choices

    def __init__(
        self, path: Path, labels: Labels, timebase: Timebase, parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self.path = path
        self._labels, self._timebase = labels, timebase
        self._format: str | None = None
        self._observation: str | None = None
        self._observations: tuple[str, ...] = ()
        self._incoming: Incoming | None = None
        self._problem = ""
        self._way: Way = "add" if labels.spans else "replace"
        self._runner = LatestRunner("labels", self)
        self._runner.partial.connect(self._learn)
        self._runner.finished.connect(self._receive)
        self._runner.failed.connect(self._refuse)
        self._read()

    @property
    def incoming(self) -> Incoming | None:
        """Labels fitted to the recording; None while reading and after an error."""
        return self._incoming

    @property
    def problem(self) -> str:
        """Reason why the file cannot be read, or empty."""
        return self._problem

    @property
    def busy(self) -> bool:
        """True while reading."""
        return self._runner.busy

    @property
    def way(self) -> Way:
        """Replace the present labels, or add to them."""
        return self._way

    @property
    def observations(self) -> tuple[str, ...]:
        """Observations to choose from, where the file has several videos."""
        return self._observations

    @property
    def observation(self) -> str | None:
        """Observation chosen."""
        return self._observation

    def set_way(self, way: Way) -> None:
        """Choose to replace the present labels or to add to them."""
        if way != self._way:
            self._way = way
            self.changed.emit()

    def read_as(self, name: str | None) -> None:
        """Read the file in a named format; None: by name and content."""
        if name != self._format:
            self._format, self._observation, self._observations = name, None, ()
            self._read()

    def set_observation(self, name: str) -> None:
        """Read the labels of this observation."""
        if name != self._observation:
            self._observation = name
            self._read()

    def facts(self) -> list[tuple[str, str]]:
        """Return names and values on the content and what importing changes."""
        found = self._incoming
        if found is None:
            return []
        tracks = found.labels.tracks
        facts = [
            ("Spans", _spans(found)),
            ("Tracks", f"{len(tracks)}: {_names([track.name for track in tracks])}"),
            ("Labels", _label_words(found.labels.spans)),
        ]
        if unknown := found.unknown(set_after(self._labels.label_set, found, self._way)):
            one = len(unknown) == 1
            facts.append(
                (
                    "Not in the label set",
                    f"{_names(list(unknown))}. {'It is' if one else 'They are'} kept and shown in"
                    " grey.",
                )
            )
        if found.cut:
            facts.append(
                ("Cut", f"{_counted(found.cut)} beyond the recording, cut where it ends or begins")
            )
        if found.outside:
            facts.append(
                (
                    "Left out",
                    f"{_counted(found.outside)} outside the recording"
                    f" ({self._timebase.start_s:.3f} to {self._timebase.end_s:.3f} s)",
                )
            )
        return facts

    def consequence(self) -> str:
        """Return a sentence on the effect on present labels."""
        count = len(self._labels.spans)
        if self._way == "add":
            return "Nothing that is there changes. Undo takes the import back."
        if not count:
            return "There are no labels to replace. Undo takes the import back."
        return f"The {_counted(self._labels.spans)} of this recording go. Undo brings them back."

    def close(self) -> None:
        """Stop reading."""
        self._runner.close()

    # --- inside ---------------------------------------------------------------------------

    def _read(self) -> None:
        self._incoming, self._problem = None, ""
        path, name, observation, base = self.path, self._format, self._observation, self._timebase

        def read(emit: Emit) -> Incoming:
            chosen = name or format_for(path, writing=False).name
            if chosen == "boris":
                emit(observations(path))
            labels = read_labels(path, base, chosen, observation=observation)
            return Incoming.of(labels, base)

        self._runner.submit(read)
        self.changed.emit()

    def _learn(self, names: tuple[str, ...]) -> None:
        self._observations = names if len(names) > 1 else ()

    def _receive(self, incoming: Incoming) -> None:
        self._incoming = incoming
        self.changed.emit()

    def _refuse(self, error: Exception) -> None:
        self._problem = str(error)
        if self._observations and self._observation is None:
            # Not a fault: the user has not chosen yet.
            self._problem = ""
            self.set_observation(self._observations[0])
            return
        self.changed.emit()


def _spans(found: Incoming) -> str:
    spans = found.labels.spans
    if not spans:
        return "none within this recording" if found.outside else "none"
    end_s = max(span.end_s for span in spans)
    return f"{len(spans):,}, from {spans[0].start_s:.3f} to {end_s:.3f} s"


def _label_words(spans: tuple[Span, ...]) -> str:
    counts: dict[str, int] = {}
    for span in spans:
        counts[span.label] = counts.get(span.label, 0) + 1
    return _names([f"{name} ({count})" for name, count in counts.items()]) or "none"


def _names(names: list[str]) -> str:
    more = len(names) - _MOST_NAMED
    shown = ", ".join(names[:_MOST_NAMED])
    return f"{shown} and {more} more" if more > 0 else shown


def _counted(spans: tuple[Span, ...]) -> str:
    return f"{len(spans):,} span" + ("" if len(spans) == 1 else "s")
