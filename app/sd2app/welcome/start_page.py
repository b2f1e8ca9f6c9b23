"""What the window shows while nothing is open: ways to begin, and recent files with pictures."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from hashlib import sha256
from pathlib import Path

from PySide6.QtCore import QObject, QPoint, QRect, QRectF, QSize, Qt, Signal
from PySide6.QtGui import (
    QAction,
    QFont,
    QImage,
    QKeyEvent,
    QPainter,
    QPainterPath,
    QPaintEvent,
    QPalette,
    QPixmap,
)
from PySide6.QtWidgets import QAbstractButton, QGridLayout, QScrollArea, QSizePolicy, QWidget

from sd2app.background.latest import BackgroundModel, LatestRunner, delayed
from sd2app.maps.heatmap_image import heatmap_image
from sd2app.session.session import Session
from sd2app.settings import MAX_RECENT, Settings
from sd2app.welcome.tour import TourModel
from sd2app.widgets.icons import draw_panel_icon
from sd2app.widgets.layouts import STRETCH, column_of, row_of
from sd2app.widgets.panel import outlined, sentence, title
from sd2app.widgets.picture import png_of
from sd2core.files.atomic import atomic_write
from sd2core.files.paths import plain_path
from sd2core.files.resources import is_bundled

SIZE_PX = QSize(448, 252)
_MAP_COLUMNS = 448
_PATIENCE_MS = 700
"""Delay after which what has just been opened is worth a picture."""
_ABOVE = 0.2
"""Share of what is cut off a high picture that is cut above: people have their heads there."""
_MAX_PICTURES = 60
"""Number that are kept."""


class RecordingPictures(BackgroundModel):
    """Makes a picture of what is open, of its video or else of a map, and finds it again.

    ``folder`` holds the pictures. One that cannot be written is not there; nothing else is lost.
    """

    changed = Signal()

    def __init__(self, session: Session, folder: Path, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._session, self._folder = session, folder
        self._writer = LatestRunner("picture", self, lambda _: self.changed.emit())
        self._patience = delayed(self._keep, _PATIENCE_MS, self)
        for signal in (session.document.opened, session.document.saved):
            signal.connect(self._patience.start)

    def path_of(self, paths: Sequence[Path]) -> Path:
        """File of the picture of what is opened together, which may not be there."""
        names = "\n".join(str(plain_path(path)) for path in paths)
        return self._folder / f"{sha256(names.encode()).hexdigest()[:24]}.png"

    def _keep(self) -> None:
        """Write a picture of what is open, or look again where there is none yet."""
        paths, picture = self._session.document.paths, self._picture()
        if paths and (picture is None or self._session.document.growing):
            self._patience.start()
        elif paths and picture is not None:
            path = self.path_of(paths)
            self._writer.submit(lambda emit: _write(picture, path))

    def _picture(self) -> QImage | None:
        session = self._session
        frame = session.video.picture
        if frame is not None:
            height, width, _ = frame.shape
            stride = frame.strides[0]
            return QImage(frame.data, width, height, stride, QImage.Format.Format_RGB888).copy()
        if session.document.video is not None:
            return None  # its first frame is on its way
        for track in (session.maps.real, session.maps.synthetic):
            if track.map is not None and track.covered is None:
                start_s, end_s = (
                    getattr(track.map.timebase, edge) + track.offset_s
                    for edge in ("start_s", "end_s")
                )
                levels = session.display.levels
                return heatmap_image(track, levels, start_s, end_s, _MAP_COLUMNS, 0xFF000000)
        return None


def _write(picture: QImage, path: Path) -> None:
    """Write a picture cut to size, heads left on; delete the oldest of too many."""
    whole = SIZE_PX if picture.height() < 64 else picture.size()  # a map has a row per bin
    fitted = picture.scaled(
        whole.scaled(SIZE_PX, Qt.AspectRatioMode.KeepAspectRatioByExpanding),
        Qt.AspectRatioMode.IgnoreAspectRatio,
        Qt.TransformationMode.SmoothTransformation,
    )
    over_px = fitted.size() - SIZE_PX
    part = QRect(QPoint(over_px.width() // 2, round(_ABOVE * over_px.height())), SIZE_PX)
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_write(path) as stream:
        stream.write(png_of(fitted.copy(part)))
    kept = sorted(path.parent.glob("*.png"), key=lambda one: one.stat().st_mtime)
    for old in kept[:-_MAX_PICTURES]:
        old.unlink(missing_ok=True)


_RADIUS_PX, _PAD_PX, _ICON_PX = 8.0, 14, 28
_WRAPPED = int(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignTop | Qt.TextFlag.TextWordWrap)


class Card(QAbstractButton):
    """Button with a border that follows the pointer and the keyboard; Return presses it too."""

    def __init__(self, name: str, tip: str, height_px: int, parent: QWidget) -> None:
        super().__init__(parent)
        self.setText(name)
        self.setAccessibleName(name)
        self.setAccessibleDescription(tip)
        self.setToolTip(tip)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setAttribute(Qt.WidgetAttribute.WA_Hover)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setFixedHeight(height_px)

    def sizeHint(self) -> QSize:
        """Narrow; the row gives each an equal share."""
        return QSize(160, self.height())

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Press with Return as with Space."""
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self.click()
        else:
            super().keyPressEvent(event)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint the ground, what is on it, and the border."""
        colours, roles = self.palette(), QPalette.ColorRole
        chosen = self.isEnabled() and (self.underMouse() or self.hasFocus())
        with QPainter(self) as painter:
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            edge = QRectF(self.rect()).adjusted(1, 1, -1, -1)
            shape = QPainterPath()
            shape.addRoundedRect(edge, _RADIUS_PX, _RADIUS_PX)
            ground = roles.AlternateBase if self.isDown() else roles.Base
            painter.fillPath(shape, colours.color(ground))
            painter.save()
            painter.setClipPath(shape)
            self.paint_content(painter, edge)
            painter.restore()
            pen = painter.pen()
            pen.setColor(colours.color(roles.Highlight if chosen else roles.Mid))
            pen.setWidthF(2.0 if chosen else 1.0)
            painter.setPen(pen)
            painter.drawPath(shape)

    def paint_content(self, painter: QPainter, edge: QRectF) -> None:
        """Paint what the card is about."""
        raise NotImplementedError

    def write(self, painter: QPainter, box: QRectF, text: str, *, bold: bool = False) -> float:
        """Write wrapped words from the top of a box, muted unless bold; returns their height."""
        font, group = QFont(self.font()), QPalette.ColorGroup.Active
        role = QPalette.ColorRole.WindowText if bold else QPalette.ColorRole.PlaceholderText
        if not self.isEnabled():
            group = QPalette.ColorGroup.Disabled
        if bold:
            font.setWeight(QFont.Weight.DemiBold)
        painter.setFont(font)
        painter.setPen(self.palette().color(group, role))
        used = painter.boundingRect(box, _WRAPPED, text)
        painter.drawText(box, _WRAPPED, text)
        return used.height()


class WayCard(Card):
    """A way to begin: icon, name, and a sentence on what comes of it."""

    def __init__(self, name: str, words: str, icon: str, parent: QWidget) -> None:
        super().__init__(name, words, 118, parent)
        self._words, self._icon = words, icon

    def paint_content(self, painter: QPainter, edge: QRectF) -> None:
        """Paint the icon in the accent colour above the words."""
        box = edge.adjusted(_PAD_PX, _PAD_PX, -_PAD_PX, -_PAD_PX)
        accent = self.palette().color(QPalette.ColorRole.Highlight)
        place = QRectF(box.left(), box.top(), _ICON_PX, _ICON_PX)
        draw_panel_icon(painter, place, self._icon, accent)
        box.setTop(box.top() + _ICON_PX + 8)
        box.setTop(box.top() + self.write(painter, box, self.text(), bold=True) + 3)
        self.write(painter, box, self._words)


class RecentCard(Card):
    """A recording that was open lately, with its picture if there is one."""

    def __init__(self, name: str, place: str, tip: str, picture: QPixmap, parent: QWidget) -> None:
        super().__init__(name, tip, 176, parent)
        self._place, self._picture = place, picture

    def paint_content(self, painter: QPainter, edge: QRectF) -> None:
        """Paint the picture over name and place, each in a line."""
        metrics = self.fontMetrics()
        words_px = 2 * metrics.height() + 18
        room = edge.adjusted(0, 0, 0, -words_px)
        painter.fillRect(room, self.palette().color(QPalette.ColorRole.AlternateBase))
        if self._picture.isNull():
            place = QRectF(0, 0, _ICON_PX, _ICON_PX)
            place.moveCenter(room.center())
            hatch = self.palette().color(QPalette.ColorGroup.Disabled, QPalette.ColorRole.Text)
            draw_panel_icon(painter, place, "Video", hatch)
        else:
            painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
            size = QRectF(self._picture.rect())
            scale = max(room.width() / size.width(), room.height() / size.height())
            part = QRectF(0, 0, room.width() / scale, room.height() / scale)
            part.moveCenter(size.center())
            painter.drawPixmap(room, self._picture, part)
        line = QRectF(_PAD_PX, room.bottom() + 7, edge.width() - 2 * _PAD_PX, metrics.height())
        right = Qt.TextElideMode.ElideRight
        self.write(painter, line, metrics.elidedText(self.text(), right, int(line.width())),
                   bold=True)  # fmt: skip
        line.translate(0, metrics.height() + 2)
        left = Qt.TextElideMode.ElideLeft
        self.write(painter, line, metrics.elidedText(self._place, left, int(line.width())))


_COLUMNS, _WIDTH_PX, _GAP_PX = 4, 1040, 16


_WAYS = (
    ("sample", "Open the sample", "A simulated person, eight swipes, a simulated radar", "Sample"),
    ("new_from_video", "New from video…",
     "Fit a body to the person in a video, and see its Doppler", "Video"),
    ("open_radar", "Open a radar capture…", "Samples, point clouds or maps of a real radar",
     "Sensor"),
    ("listen", "Record…", "A camera and a radar together, or a radar alone", "Record"),
)  # fmt: skip
"""Cards: the action that each does, what it is called, what comes of it, and its icon."""


class StartPage(QScrollArea):
    """Cards of ways to begin, the tour, and recordings with pictures; files can be dropped on it.

    ``action`` finds an action by its id; ``open_recent`` opens what was open together; ``back``
    goes back to what is open.
    """

    def __init__(
        self,
        settings: Settings,
        pictures: RecordingPictures,
        tour: TourModel,
        action: Callable[[str], QAction],
        open_recent: Callable[[Sequence[Path]], object],
        back: Callable[[], object],
    ) -> None:
        super().__init__()
        self._settings, self._pictures, self._tour = settings, pictures, tour
        self._open_recent = open_recent
        self.setAccessibleName("Start")
        self.setWidgetResizable(True)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        head = title("SD² Studio")
        font = head.font()
        font.setPointSizeF(2.0 * font.pointSizeF())
        head.setFont(font)
        about = sentence("Video of a person in, Doppler of a radar out.")
        ways = row_of(spacing_px=_GAP_PX)
        for name, text, words, icon in _WAYS:
            done, card = action(name), WayCard(text, words, icon, self)
            card.clicked.connect(done.trigger)
            done.changed.connect(lambda card=card, done=done: card.setEnabled(done.isEnabled()))
            ways.addWidget(card, 1)
        self.back = outlined("", "What is open is still there", back, self)
        self._begin = outlined("", "", tour.begin, self, look="primary")
        self._about_tour = sentence("")
        any_file = outlined("Open…", action("open").toolTip(), action("open").trigger, self)
        self.recent: list[RecentCard] = []  # the latest first
        self._recent = QGridLayout()
        self._recent.setSpacing(_GAP_PX)
        for column in range(_COLUMNS):
            self._recent.setColumnStretch(column, 1)
            # A column without anything would have no gap beside it.
            self._recent.addWidget(QWidget(self), MAX_RECENT, column)
        self._nothing = sentence("What you open is listed here, with a picture of it.")
        page = QWidget(self)
        page.setObjectName("page")
        page.setMaximumWidth(_WIDTH_PX)
        parts = (
            STRETCH, row_of(head, STRETCH, self.back), about, 20, ways, 12,
            row_of(self._begin, (self._about_tour, 1), spacing_px=12), 20,
            row_of(title("Recent"), STRETCH, any_file), 8, self._nothing, self._recent, 16,
            sentence("Or drop anything here: a recording, a video, a mesh, a radar capture."),
            STRETCH, STRETCH,
        )  # fmt: skip
        page.setLayout(column_of(*parts, spacing_px=0, margins_px=(24, 16, 24, 16)))
        middle = QWidget(self)
        middle.setObjectName("page")
        middle.setLayout(row_of(STRETCH, (page, 100), STRETCH, spacing_px=0, margins_px=0))
        self.setWidget(middle)
        tour.changed.connect(self._say_tour)
        pictures.changed.connect(lambda: self.refresh())
        self.refresh("")
        self._say_tour()

    def refresh(self, opened: str | None = None) -> None:
        """List what was open lately anew, with pictures as they are on disk.

        ``opened`` is the title of what is open, empty if that is nothing; None: as before.
        """
        if opened is not None:
            self.back.setText(f"Back to “{opened}”")
            self.back.setVisible(opened != "")
        for card in self.recent:
            self._recent.removeWidget(card)
            card.deleteLater()
        self.recent = []
        groups = self._settings.recent
        self._nothing.setVisible(not groups)
        for at, paths in enumerate(groups):
            picture = QPixmap(str(self._pictures.path_of(paths)))
            name, place = _words(paths)
            tip = "\n".join(map(str, paths))
            card = RecentCard(name, place, tip, picture, self)
            card.clicked.connect(lambda _=False, paths=paths: self._open_recent(paths))
            self.recent.append(card)
            self._recent.addWidget(card, at // _COLUMNS, at % _COLUMNS)

    def _say_tour(self) -> None:
        tour = self._tour
        at, many = tour.kept + 1, len(tour.steps)
        begun = at > 1
        self._begin.setText("Go on with the tour" if begun else "Take the tour")
        self._about_tour.setText(
            f"Step {at} of {many}: {tour.steps[tour.kept].title.lower()}"
            if begun
            else f"{many} small steps on the sample by your own hand, from the first look to a"
            " trained model; leave and go on when you like"
        )
        self._begin.setToolTip("Opens the sample, and points at one thing after another")


def _words(paths: Sequence[Path]) -> tuple[str, str]:
    """Name and place of what was open together."""
    first = paths[0]
    if is_bundled(first):
        return "The sample", "comes with SD² Studio"
    others = f" + {len(paths) - 1}" if len(paths) > 1 else ""
    home = Path.home()
    place = first.parent
    near = f"~/{place.relative_to(home)}" if place.is_relative_to(home) else str(place)
    return f"{first.name}{others}", near
