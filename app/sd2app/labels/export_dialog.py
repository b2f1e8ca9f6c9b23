"""Export of labels to another program's format, with its losses shown beforehand."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QWidget

from sd2app.background.latest import Emit, LatestRunner
from sd2app.background.quoting import quoted
from sd2app.feature import Shell
from sd2app.labels.model import LabelsModel
from sd2app.manual.help import with_help
from sd2app.session.content import folder_for_command
from sd2app.session.session import Session
from sd2app.widgets.dialogs import Dialog, ExportButtons, accepted, ask_new, with_suffix
from sd2app.widgets.inputs import Choice
from sd2app.widgets.layouts import STRETCH, column_of, form_of
from sd2app.widgets.panel import copy_button, rule, say, sentence
from sd2app.widgets.text import counted
from sd2core.cli.labels import Convert
from sd2core.errors import Sd2Error
from sd2core.labels.formats import LabelFormat, Loss, all_formats, would_lose, write_labels
from sd2core.labels.spans import Labels
from sd2core.options.records import words_of
from sd2core.recording.recording import Recording
from sd2core.timebase import Timebase


def export_labels(shell: Shell, session: Session, labels: LabelsModel) -> None:
    """Ask for format and file, show the losses, and write it."""
    content = session.document.content
    if content is None:
        return
    dialog = LabelExportDialog(
        labels.labels,
        session.playback.timebase,
        content.recording,
        session.document.file_name(""),
        shell.dialog_parent,
    )
    dialog.written.connect(shell.note)
    accepted(dialog)


class LabelExportDialog(Dialog):
    """Choice of a format; accepted once the file is written.

    The losses are computed by writing to a temporary folder. ``name`` is proposed for the file.
    """

    written = Signal(str)  # a sentence on it

    def __init__(
        self,
        labels: Labels,
        timebase: Timebase,
        recording: Recording,
        name: str,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__("Export labels", parent)
        self._labels, self._timebase, self._name = labels, timebase, name
        self._recording, self._media = recording, recording.video
        self.losses: tuple[Loss, ...] | None = None  # of the format; None while unknown
        self.problem = ""  # why the file cannot be written
        self.exporting = False
        self._runner = LatestRunner("labels", self, self._receive, self._refuse)
        self.finished.connect(lambda _: self._runner.close())
        self._format = Choice("The program that is to read the file", self)
        self._formats = all_formats()
        self._format.addItems([one.title for one in self._formats])
        self._format.currentIndexChanged.connect(self._look)
        self._about, self._message = sentence(""), sentence("")
        self._buttons = ExportButtons(self, self._ask)
        form = form_of(("For", self._format))
        foot = with_help("Export labels", self._buttons, copy_button(lambda: self.line, self))
        parts = form, self._about, rule(), self._message, STRETCH, foot
        self.setLayout(column_of(*parts, spacing_px=8, margins_px=16))
        self._look()
        self.resize(560, 300)

    @property
    def format(self) -> LabelFormat:
        """Format chosen."""
        return self._formats[self._format.currentIndex()]

    @property
    def line(self) -> str:
        """Command for a terminal that writes the labels of the saved recording."""
        out = Path(f"{self._name}{self.format.suffixes[0]}")
        file = folder_for_command(self._recording)
        return quoted(words_of("labels convert", Convert(file=file, out=out, to=self.format.name)))

    def export(self, path: Path) -> None:
        """Write the file, with the usual suffix where the name has none."""
        labels, base, chosen, media = self._labels, self._timebase, self.format, self._media
        known = [suffix for one in all_formats() for suffix in one.suffixes]
        target = with_suffix(path, chosen.suffixes[0], known)
        if target != path and target.exists():
            # The user was not asked about that one.
            remedy = "Type the ending as well to replace it"
            self._refuse(Sd2Error(f"{target} exists", "another name", remedy))
            return

        def write(emit: Emit) -> str:
            losses = write_labels(target, labels, base, chosen.name, media=media)
            kept = " ".join(["Not kept:", *(f"{loss}." for loss in losses)])
            text = f"Wrote {target} with {counted(len(labels.spans), 'span')}."
            return f"{text} {kept if losses else 'The file holds everything.'}"

        self.exporting, self.problem = True, ""
        self._runner.submit(write)
        self._refresh()

    def _look(self) -> None:
        self.losses, self.problem = None, ""
        labels, base, name, media = self._labels, self._timebase, self.format.name, self._media
        self._runner.submit(lambda emit: tuple(would_lose(labels, base, name, media=media)))
        self._refresh()

    def _receive(self, result: str | tuple[Loss, ...]) -> None:
        if isinstance(result, str):
            self.exporting = False
            self.written.emit(result)
            self.accept()
        else:
            self.losses = result
            self._refresh()

    def _refuse(self, error: Exception) -> None:
        self.exporting, self.problem = False, str(error)
        self._refresh()

    def _refresh(self) -> None:
        chosen = self.format
        about = f"{', '.join(chosen.suffixes)}, opened by {chosen.made_for}. {chosen.remark}"
        self._about.setText(about.strip())
        if self.losses is None:
            text = "Computing the losses…"
        elif not self.losses:
            text = "It holds everything: read back, the labels are the same."
        else:
            lines = "\n".join(f"• {one}." for one in self.losses)
            text = f"It cannot hold everything:\n{lines}"
        say(self._message, self.problem or text, "warning" if self.problem else "muted")
        self._buttons.show_state(possible=self.losses is not None, exporting=self.exporting)

    def _ask(self) -> None:
        chosen = self.format
        kinds = " ".join(f"*{suffix}" for suffix in chosen.suffixes)
        start = f"{self._name}{chosen.suffixes[0]}"
        if path := ask_new(self, "Export labels", start, f"{chosen.title} ({kinds})"):
            self.export(path)
