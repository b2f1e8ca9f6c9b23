"""Export of labels to another program's format, with a preview of the losses."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from PySide6.QtCore import QObject, Signal

from sd2app.background.latest import Emit, LatestRunner
from sd2core.errors import Sd2Error
from sd2core.labels.formats import FORMATS, LabelFormat, Loss, would_lose, write_labels
from sd2core.labels.spans import Labels
from sd2core.timebase import Timebase


@dataclass(frozen=True)
class Written:
    """Exported file and its losses."""

    path: Path
    spans: int
    losses: tuple[Loss, ...]

    def __str__(self) -> str:
        words = f"Wrote {self.path} with {self.spans:,} span{'s' * (self.spans != 1)}."
        if not self.losses:
            return f"{words} The file holds everything."
        return f"{words} Not kept: " + " ".join(f"{loss}." for loss in self.losses)


class LabelExportModel(QObject):
    """Computes the losses beforehand by writing to a temporary folder."""

    changed = Signal()  # format, losses or problem
    written = Signal(object)  # Written

    def __init__(
        self,
        labels: Labels,
        timebase: Timebase,
        media: Path | None,
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._labels, self._timebase, self._media = labels, timebase, media
        self._format = FORMATS[0]
        self._losses: tuple[Loss, ...] | None = None
        self._problem = ""
        self._exporting = False
        self._runner = LatestRunner("labels", self)
        self._runner.finished.connect(self._receive)
        self._runner.failed.connect(self._refuse)
        self._look()

    @property
    def format(self) -> LabelFormat:
        """Format chosen."""
        return self._format

    @property
    def losses(self) -> tuple[Loss, ...] | None:
        """Losses of the format; None while unknown."""
        return self._losses

    @property
    def problem(self) -> str:
        """Reason why the file cannot be written, or empty."""
        return self._problem

    @property
    def exporting(self) -> bool:
        """True while writing."""
        return self._exporting

    def choose(self, name: str) -> None:
        """Choose a format by its name."""
        chosen = next(one for one in FORMATS if one.name == name)
        if chosen != self._format:
            self._format = chosen
            self._look()

    def export(self, path: Path) -> None:
        """Write the file, with the usual suffix where the name has none."""
        labels, base, chosen, media = self._labels, self._timebase, self._format, self._media
        target = path if path.suffix else path.with_suffix(chosen.suffixes[0])
        if target != path and target.exists():
            # The user was not asked about that one.
            self._refuse(
                Sd2Error(
                    f"{target} exists", "another name", "Type the ending as well to replace it"
                )
            )
            return

        def write(emit: Emit) -> Written:
            losses = write_labels(target, labels, base, chosen.name, media=media)
            return Written(target, len(labels.spans), tuple(losses))

        self._exporting, self._problem = True, ""
        self._runner.submit(write)
        self.changed.emit()

    def close(self) -> None:
        """Finish the file being written."""
        self._runner.close()

    def _look(self) -> None:
        self._losses, self._problem = None, ""
        labels, base, chosen, media = self._labels, self._timebase, self._format, self._media
        self._runner.submit(lambda emit: tuple(would_lose(labels, base, chosen.name, media=media)))
        self.changed.emit()

    def _receive(self, result: object) -> None:
        if isinstance(result, Written):
            self._exporting = False
            self.changed.emit()
            self.written.emit(result)
            return
        assert isinstance(result, tuple)
        self._losses = result
        self.changed.emit()

    def _refuse(self, error: Exception) -> None:
        self._exporting = False
        self._problem = str(error)
        self.changed.emit()
