"""Dialog New from video: person, height, camera and folder."""

from __future__ import annotations

from PySide6.QtCore import QPointF, QRectF, QSignalBlocker, QSize, Qt
from PySide6.QtGui import (
    QColor,
    QIcon,
    QImage,
    QMouseEvent,
    QPainter,
    QPainterPath,
    QPen,
    QPixmap,
    QTransform,
)
from PySide6.QtWidgets import QLabel, QListWidget, QListWidgetItem, QSizePolicy, QWidget

from sd2app.fit.setup import DEFAULT_STATURE_M, PICTURE_PX, FitSetupModel, Portrait
from sd2app.manual.help import with_help
from sd2app.palette import Palette
from sd2app.widgets.canvas import Canvas
from sd2app.widgets.dialogs import Dialog, accepting, ask_file, ask_new
from sd2app.widgets.inputs import CheckBox, Choice, FrameSlider, option_box
from sd2app.widgets.layouts import STRETCH, column_of, form_of, row_of
from sd2app.widgets.mesh_painting import paint_picture
from sd2app.widgets.panel import ElidedLabel, copy_button, outlined, say, sentence, side_by_side
from sd2core.cli.fit import Fit

VIDEOS = "Video (*.mp4 *.mkv *.mov *.avi *.webm *.m4v *.mpg *.ts *.wmv);;All files (*)"
_CAMERAS = {
    "file": "as the file says, else {angle:.0f}°",
    "angle": "field of view",
    "focal": "focal length",
}
_DIMMED = 110
_SCALE = (
    f"{DEFAULT_STATURE_M:g} m where it is not known. It fixes the scale: all distances and"
    " velocities are proportional to it."
)
_OF_FIRST = (
    "Of the first who is ticked, where it is known. How tall the others are beside them, the"
    " floor tells on which all stand."
)


class PersonPicker(Canvas):
    """Picture on which a drag draws a rectangle and a click removes it."""

    USUAL_PX = 560, 420

    def __init__(self, setup: FitSetupModel, palette: Palette, parent: QWidget) -> None:
        super().__init__(parent)
        self.setup = setup
        self._colours = palette
        self._from: QPointF | None = None
        self._to = QPointF()
        self.setMinimumSize(320, 240)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setCursor(Qt.CursorShape.CrossCursor)
        self.setAccessibleName("Drag a rectangle around the person")
        self.follow(setup.changed, setup.picture_changed)

    @property
    def _placed(self) -> QTransform:
        """From pixels of the picture to those of the widget."""
        width, height = self.setup.size or (1, 1)
        scale = min(self.width() / width, self.height() / height)
        left, top = (self.width() - width * scale) / 2, (self.height() - height * scale) / 2
        return QTransform.fromTranslate(left, top).scale(scale, scale)

    @property
    def box(self) -> QRectF:
        """Rectangle of the picture."""
        return self._placed.mapRect(QRectF(0, 0, *(self.setup.size or (0, 0))))

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Set a corner of the rectangle."""
        if event.button() == Qt.MouseButton.LeftButton and self.setup.picture is not None:
            self._from = self._to = event.position()
            self.update()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Move the opposite corner."""
        if self._from is not None:
            self._to = event.position()
            self.update()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Take the rectangle, or remove it where nothing was drawn."""
        if self._from is None or event.button() != Qt.MouseButton.LeftButton:
            return
        corner, self._from = self._from, None
        end = event.position()
        self.update()
        if (end - corner).manhattanLength() < 6:
            self.setup.change(person=None)
            return
        there, _ = self._placed.inverted()
        begun, ended = there.map(corner), there.map(end)
        self.setup.set_person(begun.x(), begun.y(), ended.x(), ended.y())

    def paint(self, painter: QPainter) -> None:
        """Paint the picture, dimmed outside the rectangle."""
        painter.fillRect(self.rect(), QColor(self._colours.well))
        picture = self.setup.picture
        if picture is None:
            painter.setPen(QColor(self._colours.muted))
            text = "Reading the video…" if self.setup.reading else ""
            painter.drawText(self.rect(), Qt.AlignmentFlag.AlignCenter, text)
            return
        paint_picture(painter, self.rect(), picture)
        rectangle = self._rectangle()
        if rectangle is None:
            return
        person = self.setup.choices.person
        drawn_here = self._from is not None or (
            person is not None and person.frame == self.setup.frame
        )
        if drawn_here:
            self._dim_around(painter, rectangle)
        pen = QPen(QColor(self._colours.overlay), 2)
        # In another frame the person is elsewhere.
        pen.setStyle(Qt.PenStyle.SolidLine if drawn_here else Qt.PenStyle.DotLine)
        painter.setPen(pen)
        painter.drawRect(rectangle)

    def _dim_around(self, painter: QPainter, inside: QRectF) -> None:
        around = QPainterPath()  # odd-even: what both rectangles have stays as it is
        around.addRect(self.box)
        around.addRect(inside)
        painter.fillPath(around, QColor(0, 0, 0, _DIMMED))

    def _rectangle(self) -> QRectF | None:
        """Rectangle on the widget: the one being drawn, else the chosen one."""
        if self._from is not None:
            return QRectF(self._from, self._to).normalized().intersected(self.box)
        person = self.setup.choices.person
        if person is None or self.setup.size is None:
            return None
        return self._placed.mapRect(QRectF(*person.box))


class PeopleList(QListWidget):
    """Everybody in the video; who is ticked is fitted, and who is clicked is shown."""

    def __init__(self, setup: FitSetupModel, parent: QWidget) -> None:
        super().__init__(parent)
        self._setup = setup
        self._shown: list[Portrait] = []
        self.setAccessibleName("People to fit")
        self.setIconSize(QSize(PICTURE_PX, PICTURE_PX))
        self.setMinimumHeight(2 * PICTURE_PX)
        self.itemChanged.connect(self._tick)
        self.currentRowChanged.connect(self._show)
        setup.changed.connect(self._refresh)
        self._refresh()

    def _refresh(self) -> None:
        portraits = self._setup.portraits
        self.setVisible(bool(portraits))
        with QSignalBlocker(self):
            if portraits is not self._shown:
                self._shown = portraits
                self.clear()
                for each in portraits:
                    side, form = PICTURE_PX, QImage.Format.Format_RGB888
                    image = QImage(each.picture.data, side, side, 3 * side, form)
                    item = QListWidgetItem(QIcon(QPixmap.fromImage(image)), each.words)
                    item.setFlags(item.flags() | Qt.ItemFlag.ItemIsUserCheckable)
                    self.addItem(item)
            for row, each in enumerate(portraits):
                ticked = each.number in self._setup.choices.people
                state = Qt.CheckState.Checked if ticked else Qt.CheckState.Unchecked
                self.item(row).setCheckState(state)

    def _tick(self, item: QListWidgetItem) -> None:
        number = self._shown[self.row(item)].number
        self._setup.tick(number, item.checkState() == Qt.CheckState.Checked)

    def _show(self, row: int) -> None:
        if 0 <= row < len(self._shown):
            self._setup.show_frame(self._shown[row].frame)


class NewFromVideoDialog(Dialog):
    """A view of :class:`FitSetupModel`; what is asked for is in the model."""

    def __init__(self, setup: FitSetupModel, palette: Palette, parent: QWidget) -> None:
        super().__init__("New from video", parent)
        self.setup = setup
        self.picker = PersonPicker(setup, palette, self)
        self._slider = FrameSlider(setup.show_frame, self)
        self._build_form()
        self._buttons, self._begin = accepting(self, "Fit")
        tip = "The same as a command for a terminal, which writes the mesh alone"
        self._copy = copy_button(lambda: setup.line, self, tip)
        self._lay_out()
        setup.changed.connect(self._refresh)
        self._refresh()
        self.resize(960, 560)

    # --- building -------------------------------------------------------------------------

    def _build_form(self) -> None:
        setup = self.setup
        self._video = ElidedLabel(self)
        self._folder = ElidedLabel(self)
        other, elsewhere = "Take another video", "Save elsewhere"
        self._other_video = outlined("Choose…", other, self._ask_video, self, name=other)
        self._other_folder = outlined("Choose…", elsewhere, self._ask_folder, self, name=elsewhere)
        self._person = QLabel(self)
        self._person.setWordWrap(True)
        tip = "Have the person chosen"
        who = {"person": None, "people": ()}
        self._clear = outlined("Clear", tip, lambda: setup.change(**who), self, name=tip)
        tip = "Find everybody in the video, to tick those to fit"
        self._everybody = outlined("Who is there?", tip, self._find, self)
        self._people = PeopleList(setup, self)
        self._stature = option_box(Fit, "stature_m", " m", decimals=2, step=0.01)
        self._stature.setValue(DEFAULT_STATURE_M)
        self._stature.valueChanged.connect(lambda value_m: setup.change(stature_m=value_m))
        self._known = CheckBox(
            "known:",
            self,
            lambda known: setup.change(stature_m=self._stature.value() if known else None),
        )
        angle = setup.choices.angle_deg
        self._camera = Choice(
            "How the focal length of the camera is known",
            self,
            {way: text.format(angle=angle) for way, text in _CAMERAS.items()},
            lambda way: setup.change(camera=way),
        )
        self._angle = option_box(Fit, "field_of_view_deg", "°", decimals=1)
        self._angle.valueChanged.connect(lambda value_deg: setup.change(angle_deg=value_deg))
        self._focal = option_box(Fit, "focal_px", " px", step=10.0)
        self._focal.valueChanged.connect(setup.set_focal)
        self._message = sentence("")

    def _lay_out(self) -> None:
        self._scale = sentence("")
        form = form_of(
            ("Video", row_of((self._video, 1), self._other_video, spacing_px=8)),
            ("Person", row_of((self._person, 1), self._clear, self._everybody, spacing_px=8)),
            ("", sentence("Of several: drag a rectangle around one, or see who is there.")),
            ("", self._people),
            ("Body height", side_by_side(self._known, self._stature)),
            ("", self._scale),
            ("Camera", side_by_side(self._camera, self._angle, self._focal)),
            ("Save as", row_of((self._folder, 1), self._other_folder, spacing_px=8)),
            gaps_px=(16, 12),
        )
        left = column_of((self.picker, 1), self._slider)
        right = column_of(form, STRETCH, self._message)
        columns = row_of((left, 3), (right, 2), spacing_px=24)
        buttons = with_help("New from video", self._buttons)
        buttons.insertWidget(1, self._copy)
        self.setLayout(column_of((columns, 1), buttons, spacing_px=16, margins_px=16))

    # --- following the model --------------------------------------------------------------

    def _refresh(self) -> None:
        setup, choices = self.setup, self.setup.choices
        self._video.setText(setup.video.name if setup.video is not None else "none")
        self._folder.setText(str(choices.folder) if choices.folder is not None else "")
        self._other_folder.setEnabled(choices.folder is not None)
        self._slider.show_frame(setup.frame, setup.frames, setup.time_s)
        self._person.setText(self._who())
        self._clear.setVisible(choices.person is not None or bool(choices.people))
        searching = setup.searched is not None
        self._everybody.setVisible(setup.ready and not setup.portraits)
        self._everybody.setText("Stop" if searching else "Who is there?")
        several = len(choices.people) > 1
        self._scale.setText(_OF_FIRST if several else _SCALE)
        self._known.show_checked(choices.stature_m is not None)
        self._stature.setEnabled(choices.stature_m is not None)
        if choices.stature_m is not None:
            self._stature.show_value(choices.stature_m)
        self._camera.show_value(choices.camera)
        self._angle.setVisible(choices.camera == "angle")
        self._angle.show_value(choices.angle_deg)
        self._focal.setVisible(choices.camera == "focal")
        if setup.focal_px is not None:
            self._focal.show_value(setup.focal_px)
        self._show_message()

    def _who(self) -> str:
        """People that are fitted, in words."""
        setup, choices = self.setup, self.setup.choices
        if setup.searched is not None:
            return f"looking for everybody, {100.0 * setup.searched:.0f} %"
        if choices.people:
            one = len(choices.people) == 1
            return ("person " if one else "people ") + ", ".join(map(str, choices.people))
        person = choices.person
        return "who is seen best" if person is None else f"in the rectangle in frame {person.frame}"

    def _show_message(self) -> None:
        setup = self.setup
        text, role = "", "muted"
        if setup.problem:
            text, role = setup.problem, "warning"
        elif setup.continues:
            text = "A fit of this video was stopped here: it will be continued."
        elif setup.kept is not None:
            text = "A fit with other choices was stopped here: it will start again."
        elif setup.completes:
            text = "The mesh will be added to this recording."
        say(self._message, text, role)
        self._begin.setEnabled(setup.ready)
        self._copy.setEnabled(setup.ready)
        self._begin.setText("Continue" if setup.continues else "Fit")

    # --- what is clicked ------------------------------------------------------------------

    def _find(self) -> None:
        (self.setup.find_people if self.setup.searched is None else self.setup.stop_finding)()

    def _ask_video(self) -> None:
        start = str(self.setup.video.parent) if self.setup.video is not None else ""
        if path := ask_file(self, "Video of a person", VIDEOS, start):
            self.setup.choose_video(path)

    def _ask_folder(self) -> None:
        start = str(self.setup.choices.folder)
        if folder := ask_new(self, "Save recording as", start, "Recording (*.sd2)"):
            self.setup.change(folder=folder)
