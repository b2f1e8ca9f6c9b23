"""Labels written for other programs, and cut-outs of their spans: dialogs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QMessageBox, QWidget

from sd2app.background.latest import Emit, ReportingModel
from sd2app.feature import Shell
from sd2app.labels.model import LabelsModel
from sd2app.manual.help import with_help
from sd2app.maps.model import SynthesisModel
from sd2app.session.content import folder_for_command
from sd2app.session.session import Session
from sd2app.session.tasks import ListedRunner
from sd2app.widgets.dialogs import (
    Dialog,
    ExportButtons,
    accepted,
    accepting,
    ask_folder,
    ask_new,
    with_suffix,
)
from sd2app.widgets.inputs import CheckBox, Choice
from sd2app.widgets.layouts import STRETCH, column_of, form_of
from sd2app.widgets.panel import copy_button, rule, say, sentence, side_by_side
from sd2app.widgets.text import counted, quoted
from sd2core.cli.labels import Convert
from sd2core.cli.labels.recording import Cut as CutCommand
from sd2core.cli.running import explanation
from sd2core.cutouts.cutting import cut_out, plan_cuts, without_frame
from sd2core.cutouts.source import CutSource, Part
from sd2core.errors import Sd2Error
from sd2core.labels.formats import LabelFormat, Loss, all_formats, would_lose, write_labels
from sd2core.labels.spans import Labels, Span
from sd2core.maps import DopplerMap
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

    ``name`` is proposed for the file.
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
        self.losses: tuple[Loss, ...] | None = None  # of the format; None: it cannot be written
        self.problem = ""  # why the file cannot be written
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
        labels, chosen = self._labels, self.format
        known = [suffix for one in all_formats() for suffix in one.suffixes]
        target = with_suffix(path, chosen.suffixes[0], known)
        try:
            if target != path and target.exists():
                # The user was not asked about that one.
                remedy = "Type the ending as well to replace it"
                raise Sd2Error(f"{target} exists", "another name", remedy)
            losses = write_labels(target, labels, self._timebase, chosen.name, media=self._media)
        except (Sd2Error, OSError) as error:
            self.problem = str(explanation(error))
            self._refresh()
            return
        kept = " ".join(["Not kept:", *(f"{loss}." for loss in losses)])
        text = f"Wrote {target} with {counted(len(labels.spans), 'span')}."
        self.written.emit(f"{text} {kept if losses else 'The file holds everything.'}")
        self.accept()

    def _look(self) -> None:
        self.losses, self.problem = None, ""
        labels, base, name = self._labels, self._timebase, self.format.name
        try:
            self.losses = tuple(would_lose(labels, base, name, media=self._media))
        except (Sd2Error, OSError) as error:
            self.problem = str(explanation(error))
        self._refresh()

    def _refresh(self) -> None:
        chosen = self.format
        about = f"{', '.join(chosen.suffixes)}, opened by {chosen.made_for}. {chosen.remark}"
        self._about.setText(about.strip())
        text = "It holds everything: read back, the labels are the same."
        if self.losses:
            lines = "\n".join(f"• {one}." for one in self.losses)
            text = f"It cannot hold everything:\n{lines}"
        say(self._message, self.problem or text, "warning" if self.problem else "muted")
        self._buttons.show_state(possible=self.losses is not None)

    def _ask(self) -> None:
        chosen = self.format
        kinds = " ".join(f"*{suffix}" for suffix in chosen.suffixes)
        start = f"{self._name}{chosen.suffixes[0]}"
        if path := ask_new(self, "Export labels", start, f"{chosen.title} ({kinds})"):
            self.export(path)


_ABOUT = (
    "Each span becomes a folder of its own, with 0 s at its first frame, and an index lists them"
    " all. Cut-outs that are in the folder already are kept."
)


class SpanGroup(NamedTuple):
    """Spans that can be chosen together."""

    name: str
    spans: tuple[Span, ...]
    labels: tuple[str, ...] | None = ()  # for the command; None: it cannot choose just these


class CutOutModel(ReportingModel):
    """Cuts spans out into folders."""

    noted = Signal(str)

    def __init__(self, session: Session, synthesis: SynthesisModel, parent: QObject) -> None:
        super().__init__(parent)
        self._session, self._synthesis = session, synthesis
        self._runner = ListedRunner("cut", session.jobs, self, self.noted.emit, self._fail)

    def source(self, parts: Iterable[Part] = ("video", "mesh", "maps")) -> CutSource:
        """Return the parts of the recording, without maps that are still computed."""
        content = self._session.document.content
        assert content is not None
        recording = content.recording
        whole = CutSource(
            recording.title,
            recording.simulated,
            content.timebase,
            recording.video if content.video is not None else None,
            content.mesh,
            self._maps(),
            recording.sensor.position_m,
        )
        return whole.only(parts)

    def _maps(self) -> dict[str, DopplerMap]:
        """Maps that are there to their end, with their provenance."""
        maps = self._session.maps
        tracks = {"synthetic": maps.synthetic, "denoised": maps.denoised, "radar": maps.real}
        made = {
            name: track.map.shifted(track.offset_s)
            for name, track in tracks.items()
            if track.map is not None and track.covered is None
        }
        if not self._synthesis.complete:
            return {name: one for name, one in made.items() if name == "radar"}
        about = self._synthesis.whole_map().meta
        kept = {name: about[name] for name in about if name in ("sensor", "simulated")}
        denoised = {"input": about} | kept
        more = {"synthetic": about, "denoised": denoised, "radar": {}}
        return {name: replace(one, meta=one.meta | more[name]) for name, one in made.items()}

    def line(self, labels: tuple[str, ...], parts: Sequence[Part]) -> str:
        """Command for a terminal that cuts spans of the saved recording out, by their labels."""
        recording, source = self._session.document.recording, self.source(parts)
        assert recording is not None
        maps, out = ",".join(source.maps) or None, Path("cuts")
        folder, shown = folder_for_command(recording), ",".join(parts)
        cut = CutCommand(recording=folder, out=out, label=labels, parts=shown, maps=maps)
        return quoted(words_of("labels cut", cut))

    def start(
        self,
        spans: Sequence[Span],
        parts: Iterable[Part],
        folder: Path,
        replaces: Callable[[Sequence[str]], bool | None],
    ) -> None:
        """Export in the background.

        Parameters
        ----------
        spans, parts : sequence of Span, iterable of Part
            What is cut out.
        folder : Path
            Holds a folder per span; complete ones stay, so a stopped export goes on from there.
        replaces : callable
            Given the names of folders that hold something else, says if they are replaced; None:
            nothing is exported.

        Raises
        ------
        Sd2Error
            When no span has a frame of the recording.
        """
        source = self.source(parts)
        cuts = plan_cuts(source, spans, folder)
        others = [cut.path.name for cut in cuts if cut.state == "other"]
        replace_others = replaces(others) if others else False
        if replace_others is None:
            return

        def cut(emit: Emit) -> str:
            written = cut_out(
                source,
                cuts,
                folder,
                replace_others=replace_others,
                progress=lambda done, total: emit((done, total)),
            )
            words = f"{counted(len(written), 'span')} cut out into {folder}."
            same = sum(one.state != "empty" for one in cuts) - len(written)
            words += f" {same} stayed as they were." if same else ""
            return words + without_frame(cuts)

        self._runner.submit(cut, f"Cutting out {counted(len(cuts), 'span')}")


def ask_for_cut_outs(shell: Shell, labels: LabelsModel, model: CutOutModel) -> None:
    """Ask for spans, parts and folder, and export the cut-outs."""
    source, groups = model.source(), _groups(labels.labels, labels.selected)
    if not groups[-1].spans:
        shell.warn("There is nothing to cut out: accept the suggestions first.")
        return
    dialog = CutOutDialog(groups, model, source, shell.dialog_parent)
    if not accepted(dialog):
        return
    spans, parts = dialog.spans, dialog.parts
    if folder := ask_folder(shell.dialog_parent, "Folder for the cut-outs"):
        replaces = partial(_ask_about_others, shell.dialog_parent)
        shell.attempt(lambda: model.start(spans, parts, folder, replaces))


def _ask_about_others(parent: QWidget, others: Sequence[str]) -> bool | None:
    """Whether folders that hold something else are replaced; None where the user cancels."""
    box = QMessageBox(parent)
    box.setWindowTitle("Replace cut-outs?")
    folders = counted(len(others), "folder")
    box.setText(f"{folders} of the same name hold something else, such as {others[0]}.")
    replace = box.addButton("Replace", QMessageBox.ButtonRole.DestructiveRole)
    keep = box.addButton("Keep them", QMessageBox.ButtonRole.AcceptRole)
    box.addButton(QMessageBox.StandardButton.Cancel)
    box.setDefaultButton(keep)
    box.exec()
    box.deleteLater()
    clicked = box.clickedButton()
    return clicked is replace if clicked in (replace, keep) else None


def _groups(labels: Labels, selected: Sequence[Span]) -> list[SpanGroup]:
    """Choices of spans: the selection, all, or the spans of one label."""
    chosen = tuple(span for span in selected if span.origin != "suggestion")
    by_label: dict[str, list[Span]] = {}
    for span in labels.decided:
        by_label.setdefault(span.label, []).append(span)
    selection = [SpanGroup("the selected", chosen, None)] if chosen else []
    each = (SpanGroup(name, tuple(spans), (name,)) for name, spans in by_label.items())
    return [*selection, SpanGroup("all", labels.decided), *each]


class CutOutDialog(Dialog):
    """Accepted to choose a folder for :attr:`spans` and :attr:`parts`."""

    def __init__(
        self, groups: Sequence[SpanGroup], model: CutOutModel, source: CutSource, parent: QWidget
    ) -> None:
        super().__init__("Export cut-outs", parent)
        self._groups, self._source = groups, source
        self._which = Choice("Which spans", self)
        self._which.addItems([f"{one.name} ({len(one.spans)})" for one in groups])
        self._which.currentIndexChanged.connect(self._refresh)
        maps = ", ".join(source.maps)
        available: dict[Part, tuple[str, bool]] = {
            "video": ("video", source.video is not None),
            "mesh": ("mesh", source.mesh is not None),
            "maps": (f"maps: {maps}" if maps else "maps", bool(maps)),
        }
        self._parts: dict[Part, CheckBox] = {}
        for part, (text, has) in available.items():
            box = self._parts[part] = CheckBox(text, self, lambda _: self._refresh())
            box.setEnabled(has)
            box.show_checked(has)
        self._size = sentence("")
        buttons, self._go = accepting(self, "Export…")
        parts = side_by_side(*self._parts.values(), spacing_px=16)
        form = form_of(("Spans", self._which), ("Parts", parts))
        tip = (
            "As a command for a terminal, which chooses spans by their labels, and counts maps at"
            " its usual accuracy"
        )
        self._copy = copy_button(
            lambda: model.line(self._group.labels or (), self.parts), self, tip
        )
        foot = with_help("Export cut-outs", buttons, self._copy)
        content = form, self._size, sentence(_ABOUT), STRETCH, foot
        self.setLayout(column_of(*content, spacing_px=12, margins_px=16))
        self._refresh()
        self.setMinimumWidth(520)

    @property
    def _group(self) -> SpanGroup:
        return self._groups[self._which.currentIndex()]

    @property
    def spans(self) -> tuple[Span, ...]:
        """Spans chosen."""
        return self._group.spans

    @property
    def parts(self) -> tuple[Part, ...]:
        """Parts chosen."""
        return tuple(part for part, box in self._parts.items() if box.isChecked())

    def _refresh(self) -> None:
        frames = sum(
            stop - first for first, stop in (self._source.frames_of(one) for one in self.spans)
        )
        seconds = sum(one.duration_s for one in self.spans)
        self._size.setText(f"{frames:,} frames, {seconds:.1f} s in all.")
        self._go.setEnabled(bool(self.spans and self.parts))
        self._copy.setEnabled(self._go.isEnabled() and self._group.labels is not None)
