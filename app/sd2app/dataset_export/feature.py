"""Export of data sets in a background process: the dialog."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtGui import QPixmap
from PySide6.QtWidgets import QFileDialog, QLabel, QLineEdit, QProgressBar, QScrollArea, QWidget

from sd2app.dataset_export.model import MAPS, ExportModel
from sd2app.feature import Action, Feature, Shell, report
from sd2app.manual.help import help_button
from sd2app.session.saving import saved_first
from sd2app.session.session import Session
from sd2app.widgets.dialogs import Dialog, ask_folder, show_in_files, take_room, with_suffix
from sd2app.widgets.inputs import CheckBox, Choice, option_box
from sd2app.widgets.layouts import STRETCH, column_of, form_of, row_of
from sd2app.widgets.panel import (
    ElidedLabel,
    copy_button,
    outlined,
    rule,
    sentence,
    show_words,
    side_by_side,
)
from sd2app.widgets.text import bytes_text, counted
from sd2core.cli.export import Export
from sd2core.recording.recording import is_recording

if TYPE_CHECKING:
    from sd2core.datasets.forecast import Forecast


_FORMATS = {
    ".zarr": "Zarr: a folder, read in parts",
    ".h5": "HDF5: one file, read in parts",
    ".npz": "NPZ: one file, read whole; for small sets",
}
_MAX_NAMED = 4
_SIZE_PX = (680, 360)
_SHEET_PX = 940
"""Width of the preview sheet."""


class ExportDialog(Dialog):
    """A view of :class:`ExportModel`; the writing goes on when it, or the window, is closed."""

    def __init__(self, model: ExportModel, opened: Path | None, parent: QWidget | None) -> None:
        super().__init__("Export data set", parent)
        self._model, self._opened = model, opened
        self._build_form()
        self._build_foot()
        words = (self._size, self._labels, self._splits, self._message)
        parts = (self._form, rule(), *words, (self._sheet, 1), (None, 0), self._bar, self._foot)
        self.setLayout(column_of(*parts, spacing_px=12, margins_px=16))
        model.changed.connect(self._refresh)
        self._refresh()
        self.resize(*_SIZE_PX)

    # --- building -------------------------------------------------------------------------

    def _build_form(self) -> None:
        model = self._model
        self._place = ElidedLabel(self)
        self._this = outlined(
            "This recording", "Export the recording that is open",
            lambda: model.begin(self._opened), self,
        )  # fmt: skip
        self._other = outlined(
            "Folder…", "Export a recording (.sd2), or all recordings in a folder", self._ask_place,
            self,
        )  # fmt: skip
        self._people = QLineEdit(self)
        self._people.setAccessibleName("Who each recording is of")
        self._people.setPlaceholderText("each a different person; or names, as anna, anna, ben")
        self._people.editingFinished.connect(self._name_people)
        self._boxes = {name: CheckBox(name, self, self._choose_maps) for name in MAPS}
        self._sensors = Choice(
            "From which sensors the maps are seen",
            self,
            {None: "each recording's own", "planned": ""},
            lambda placements: model.choose(placements=placements),
        )
        self._inertial = CheckBox(
            "", self, lambda wanted: model.choose(imu=model.imu_places if wanted else ())
        )
        self._inertial.setAccessibleName("Inertial sensors")
        self._cut = Choice(
            "What a segment is",
            self,
            {"windows": "windows of", "spans": "each labelled span, filled up to"},
            lambda segments: model.choose(segments=segments),
        )
        self._margin = option_box(Export, "margin_s", " s around", decimals=1, step=0.1)
        self._margin.valueChanged.connect(lambda value: model.choose(margin_s=round(value, 3)))
        self._length = option_box(Export, "segment_frames", " frames")
        self._overlap = option_box(Export, "overlap_frames", " frames")
        self._length.valueChanged.connect(lambda _: self._choose_frames())
        self._overlap.valueChanged.connect(lambda _: self._choose_frames())
        self._format = Choice(
            "Format of the data set",
            self,
            _FORMATS,
            lambda ending: model.choose(out=model.choice.out.with_suffix(ending)),
        )
        where = row_of((self._place, 1), self._this, self._other, spacing_px=8)
        self._overlap_word = QLabel("overlap", self)
        around = (self._overlap_word, self._overlap, self._margin)
        segments = side_by_side(self._cut, self._length, *around)
        self._form = form_of(
            ("From", where),
            ("People", self._people),
            ("Maps", side_by_side(*self._boxes.values(), spacing_px=16)),
            ("Sensors", side_by_side(self._sensors)),
            ("Inertial sensors", side_by_side(self._inertial)),
            ("Segments", segments),
            ("Format", side_by_side(self._format)),
        )

    def _build_foot(self) -> None:
        self._size, self._labels, self._splits = sentence("", "plain"), sentence(""), sentence("")
        self._message = sentence("", "warning")
        self._picture = QLabel(self)
        self._picture.setAccessibleName("Preview sheet")
        self._sheet = QScrollArea(self)
        self._sheet.setWidget(self._picture)
        self._sheet.setWidgetResizable(True)
        self._sheet.setMinimumHeight(120)
        self._picture.setAlignment(Qt.AlignmentFlag.AlignTop | Qt.AlignmentFlag.AlignLeft)
        self._bar = QProgressBar(self)
        self._bar.setAccessibleName("How far the export is")
        tip = "Choose a name and write"
        self._export = outlined("Export…", tip, self._ask_out, self, look="primary")
        model = self._model
        self._copy = copy_button(lambda: model.line, self)
        self._stop = outlined(
            "Stop",
            "What is complete stays; the same export goes on there",
            partial(model.tell, "stop"),
            self,
        )
        self._open = outlined("Open folder", "Show the data set's folder", self._show_folder, self)
        self._close = outlined("Close", "An export under way goes on", self.close, self)
        buttons = (self._stop, self._copy, self._export, self._close)
        guide = help_button("Export data set", self)
        self._foot = row_of(guide, self._open, STRETCH, *buttons, spacing_px=8)

    # --- following the model --------------------------------------------------------------

    def _refresh(self) -> None:
        model = self._model
        choice, place = model.choice, model.place
        spans = choice.segments == "spans"
        self._place.setText("nothing yet" if place is None else str(place))
        self._this.setVisible(self._opened is not None and place != self._opened)
        several = place is not None and not is_recording(place)
        self._form.setRowVisible(self._people, several)
        if not self._people.hasFocus():
            self._people.setText(", ".join(choice.subjects or ()))
        for name, box in self._boxes.items():
            box.show_checked({*MAPS[name]} <= {*choice.kinds})
        planned = counted(model.places, "planned place")
        self._sensors.setItemText(1, f"its own, and {planned}")
        self._sensors.show_value(choice.placements)
        self._sensors.setToolTip(
            "From which sensors the maps are seen" if model.places
            else "No places are planned: Edit → Placements…"
        )  # fmt: skip
        self._inertial.setText(inertial_words(model.imu_places))
        self._inertial.show_checked(bool(choice.imu))
        self._inertial.setToolTip(
            "What ideal sensors there would feel, simulated, at the frames of the maps"
            if model.imu_places
            else "No recording has one at a named place of the body: Edit → Place inertial sensor…"
        )
        self._cut.show_value(choice.segments)
        self._margin.show_value(choice.margin_s)
        self._margin.setVisible(spans)
        for one in (self._overlap_word, self._overlap):
            one.setVisible(not spans)
        self._length.show_value(choice.segment_frames)
        self._overlap.show_value(choice.overlap_frames)
        self._format.show_value(choice.out.suffix)
        available = {self._sensors: model.places > 0, self._inertial: bool(model.imu_places)}
        for field in (
            self._this, self._other, self._sensors, self._inertial, self._cut, self._length,
            self._overlap, self._margin, self._format, self._people, *self._boxes.values(),
        ):  # fmt: skip
            field.setEnabled(not model.under_way and available.get(field, True))
        self._show_counts()
        self._show_writing()

    def _show_counts(self) -> None:
        model, forecast = self._model, self._model.forecast
        if forecast is None:
            self._size.setText("Counting…" if model.counting else "")
            self._labels.setText("")
            self._splits.setText("")
        else:
            parts = (size_words(forecast, model.choice.segment_frames), model.time)
            self._size.setText(" · ".join(filter(None, parts)))
            self._labels.setText(label_words(forecast))
            self._splits.setText(split_words(forecast))
        left_out = [] if forecast is None else list(forecast.failed)
        if model.result is not None:
            left_out = list(model.result.failed)
        messages = [model.problem, *(f"Left out: {one}" for one in left_out)]
        show_words(self._message, "\n".join(filter(None, messages)))

    def _show_writing(self) -> None:
        model = self._model
        run = model.run
        done, total = (0, 0) if run is None else (run.history.done, run.history.total)
        self._bar.setVisible(model.under_way)
        self._bar.setRange(0, total)
        self._bar.setValue(done)
        self._stop.setVisible(model.under_way)
        self._stop.setEnabled(run is None or run.phase != "stopping")
        self._export.setEnabled(model.ready)
        self._copy.setEnabled(model.ready)
        result = model.result
        written = result is not None and not model.under_way
        self._open.setVisible(written)
        if written and result is not None:
            self._size.setText(
                f"{result.segments:,} segments are in {result.dataset.name}, with a card"
                f" ({result.card.name}) and this sheet:"
            )
            self._size.setToolTip(str(result.dataset))
            self._show_sheet(result.sheet)
        elif not self._picture.pixmap().isNull():
            self._picture.clear()
            self.resize(*_SIZE_PX)
        self._sheet.setVisible(written)

    def _show_sheet(self, file: Path) -> None:
        """Show the preview sheet in the width of the dialog, which grows to hold it."""
        picture = QPixmap(str(file))
        if picture.isNull() or not self._picture.pixmap().isNull():
            return
        ratio = self.devicePixelRatioF()
        picture = picture.scaledToWidth(
            round(_SHEET_PX * ratio), Qt.TransformationMode.SmoothTransformation
        )
        picture.setDevicePixelRatio(ratio)
        self._picture.setPixmap(picture)
        needed = self.sizeHint().height() + round(picture.height() / ratio) + 16
        take_room(self, max(self.width(), _SHEET_PX + 48), min(max(self.height(), needed), 860))

    # --- what is clicked ------------------------------------------------------------------

    def _choose_maps(self, _: bool) -> None:
        chosen = (MAPS[name] for name, box in self._boxes.items() if box.isChecked())
        self._model.choose(kinds=tuple(chain(*chosen)))

    def _choose_frames(self) -> None:
        length = round(self._length.value())
        overlap = min(round(self._overlap.value()), length - 1)
        self._model.choose(segment_frames=length, overlap_frames=overlap)

    def _name_people(self) -> None:
        names = tuple(part.strip() for part in self._people.text().split(",") if part.strip())
        self._model.choose(subjects=names or None)

    def _ask_place(self) -> None:
        if path := ask_folder(self, "A recording, or a folder of recordings"):
            self._model.begin(path)

    def _ask_out(self) -> None:
        ending, start = self._model.choice.out.suffix, str(self._model.usual_out)
        # A folder is not asked for by its own name: one that is there can be gone on with.
        name, _ = QFileDialog.getSaveFileName(
            self, "Export data set", start, f"Data set (*{ending})",
            options=QFileDialog.Option.DontConfirmOverwrite,
        )  # fmt: skip
        if name:
            self._model.start(with_suffix(Path(name), ending))

    def _show_folder(self) -> None:
        result = self._model.result
        if result is not None:
            show_in_files(result.dataset.absolute().parent)


def size_words(forecast: Forecast, length: int) -> str:
    """Size in words: ``24 segments of 2.4 s from 3 views · 0.7 MB before compression``."""
    seconds = length / forecast.frame_rate_hz
    segments, views = counted(forecast.segments, "segment"), counted(forecast.sources, "view")
    size = bytes_text(forecast.total_bytes)
    return f"{segments} of {seconds:.1f} s from {views} · {size} before compression"


def label_words(forecast: Forecast) -> str:
    """Number of segments of each label."""
    named = " · ".join(f"{name} {count:,}" for name, count in forecast.of_label.items())
    return f"Labels: {named}" if named else ""


def split_words(forecast: Forecast) -> str:
    """Number of segments and people of each split."""
    if not (forecast.split.validation or forecast.split.test):
        who = _named(forecast.split.training)
        return f"Split: all {forecast.segments:,} to train ({who}); none to validate or test on"
    people = {
        "train": forecast.split.training,
        "validation": forecast.split.validation,
        "test": forecast.split.test,
    }
    return "Split: " + " · ".join(
        f"{name} {count:,} ({_named(people[name])})" for name, count in forecast.of_split().items()
    )


def inertial_words(places: Sequence[str]) -> str:
    """Places of inertial sensors that can be exported: ``at head, left wrist``."""
    names = [place.replace("-", " ") for place in places]
    more = len(names) - _MAX_NAMED
    listed = ", ".join(names[:_MAX_NAMED]) + (f" and {more} more" if more > 0 else "")
    return f"at {listed}" if names else "none placed"


def _named(people: tuple[str, ...]) -> str:
    if not people:
        return "no person"
    return ", ".join(people) if len(people) <= 3 else f"{len(people)} people"


class DatasetExportFeature(Feature):
    """Segments with labels to learn from, of the open recording or a folder."""

    def __init__(self, session: Session, shell: Shell) -> None:
        self._session, self._shell = session, shell
        self.model = ExportModel(session.jobs, session.parent)
        report(shell, self.model)
        self.closing = self.running = (self.model,)  # an export goes on

    def actions(self) -> Sequence[Action]:
        """The dialog."""
        return (
            Action(
                "export_dataset", "File", "Export data set…", ("Ctrl+Shift+D",),
                "Write segments with labels to learn from (Zarr, HDF5, NPZ), of this recording or"
                " a folder",
                self._export,
            ),
        )  # fmt: skip

    def _export(self) -> None:
        """Choose what a data set holds and have it written; the window can be used meanwhile."""
        document = self._session.document
        if not saved_first(document, self._shell, "A data set is made of what is saved."):
            return
        recording = document.recording
        opened = None if recording is None else recording.folder
        if not self.model.under_way:
            self.model.begin(opened)
        dialog = ExportDialog(self.model, opened, self._shell.dialog_parent)
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.open()
