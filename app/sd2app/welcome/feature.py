"""The start page, and the tour of the sample as a callout beside each thing."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path

from PySide6.QtCore import QEvent, QObject, QPoint, QRect, QSize, Qt, QTimer
from PySide6.QtGui import QAction, QKeyEvent, QKeySequence, QPainter, QPaintEvent, QRegion
from PySide6.QtWidgets import QFrame, QMainWindow, QWidget

from sd2app.feature import Action, Feature, Shell
from sd2app.session.session import Session
from sd2app.welcome.start_page import RecordingPictures, StartPage
from sd2app.welcome.tour import Step, TourModel
from sd2app.widgets.layouts import STRETCH, column_of, row_of
from sd2app.widgets.panel import outlined, sentence, title
from sd2core.files.resources import is_bundled

_WIDTH_PX, _GAP_PX, _RING_PX = 340, 12, 3
_FOLLOW_MS = 200
_END = (
    "That is the tour",
    "Next: File → New from video… makes all this of a video of your own. The manual ({manual})"
    " has the rest.",
)


def beside(target: QRect, size: QSize, room: QRect) -> QRect:
    """Place beside a target within the room, where it hides least of it."""
    middle = QRect(QPoint(0, 0), size)
    middle.moveCenter(target.center())
    left, right = target.left() - size.width() - _GAP_PX, target.right() + _GAP_PX
    above, below = target.top() - size.height() - _GAP_PX, target.bottom() + _GAP_PX
    wanted = (
        QPoint(right, middle.top()),
        QPoint(left, middle.top()),
        QPoint(middle.left(), above),
        QPoint(middle.left(), below),
        room.bottomRight(),
        room.topLeft(),
    )

    def held(corner: QPoint) -> QPoint:
        return QPoint(
            max(min(corner.x(), room.right() - size.width()), room.left()),
            max(min(corner.y(), room.bottom() - size.height()), room.top()),
        )

    def cost(corner: QPoint) -> tuple[int, int]:
        common = QRect(held(corner), size) & target
        hidden_px2 = max(common.width(), 0) * max(common.height(), 0)
        return hidden_px2, (held(corner) - corner).manhattanLength()

    return QRect(held(min(wanted, key=cost)), size)


class Ring(QWidget):
    """A line around a thing, through which the mouse goes."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self.hide()

    def surround(self, place: QRect) -> None:
        """Lie around a place."""
        if place != self.geometry():
            self.setGeometry(place)
            inner = self.rect().adjusted(_RING_PX, _RING_PX, -_RING_PX, -_RING_PX)
            self.setMask(QRegion(self.rect()) - QRegion(inner))
        self.raise_()
        self.show()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint all that the mask leaves."""
        with QPainter(self) as painter:
            painter.fillRect(self.rect(), self.palette().highlight())


class TourCallout(QFrame):
    """The step of the tour over a window; Escape or *Later* lets it rest.

    ``action`` finds an action by its id, for its keys; ``label_key`` is that of the first label.
    """

    def __init__(
        self,
        tour: TourModel,
        window: QMainWindow,
        action: Callable[[str], QAction],
        label_key: Callable[[], str],
    ) -> None:
        super().__init__(window)
        self._tour, self._window, self._action, self._label_key = tour, window, action, label_key
        self._target: QWidget | None = None
        self.setObjectName("notice")
        self.setAccessibleName("Tour")
        self.setFixedWidth(_WIDTH_PX)
        self._ring = Ring(window)
        self._at, self._title, self._words = sentence(""), title("", "Step"), sentence("", "plain")
        tip = "Let the tour rest; Help → Tour of the sample goes on with it (Esc)"
        self.later = outlined("Later", tip, tour.leave, self)
        self.back = outlined("Back", "To the step before", tour.back, self)
        self.skip = outlined("Skip", "To the next step", tour.skip, self)
        buttons = row_of(self._at, STRETCH, self.back, self.skip, self.later, spacing_px=6)
        parts = self._title, self._words, buttons
        self.setLayout(column_of(*parts, spacing_px=6, margins_px=(14, 8, 10, 8)))
        self.hide()
        self._following = QTimer(self, interval=_FOLLOW_MS)
        self._following.timeout.connect(self._place)
        tour.changed.connect(self._refresh)
        window.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Leave with the Escape that nothing else has used; stay beside the thing."""
        if isinstance(event, QKeyEvent) and event.type() == QEvent.Type.KeyPress:
            if event.key() == Qt.Key.Key_Escape and self.isVisible():
                self._tour.leave()
                return True
        elif event.type() == QEvent.Type.Resize:
            self._place()
        return False

    def _refresh(self) -> None:
        tour, step = self._tour, self._tour.step
        head, words = _END if step is None else (step.title, step.words)
        if step is None and not tour.over:
            self._following.stop()
            self.hide()
            self._ring.hide()
            return
        self._title.setText(f"✓ {head}" if tour.done else head)
        self._words.setText(re.sub(r"{(\w+)}", lambda found: self._keys(found[1]), words))
        self._at.setText("" if step is None else f"{tour.kept + 1} of {len(tour.steps)}")
        self.back.setVisible(step is not None and tour.kept > 0)
        self.skip.setVisible(step is not None)
        self.later.setText("Close" if step is None else "Later")
        self._target = None
        self._following.start()
        self._place()

    def _keys(self, name: str) -> str:
        """Keys of an action by its id; the words of the menu for one without."""
        if name == "label":
            return self._label_key()
        action = self._action(name)
        keys = action.shortcut().toString(QKeySequence.SequenceFormat.NativeText)
        return keys or f"“{action.text().replace('&', '')}”"

    def _place(self) -> None:
        """Stand beside what the step is about, wherever that is by now."""
        step = self._tour.step
        if step is None and not self._tour.over:
            return
        if step is not None:
            self._target = _shown(self._window, step.targets, self._target)
        layout = self.layout()
        assert layout is not None
        layout.activate()
        size = QSize(_WIDTH_PX, layout.totalHeightForWidth(_WIDTH_PX))
        room = self._window.rect().adjusted(_GAP_PX, _GAP_PX, -_GAP_PX, -_GAP_PX)
        if self._target is None or step is None:
            place = QRect(QPoint(0, 0), size)
            place.moveCenter(room.center())
            self._ring.hide()
        else:
            around = QRect(self._target.mapTo(self._window, QPoint(0, 0)), self._target.size())
            around = around.adjusted(-_RING_PX, -_RING_PX, _RING_PX, _RING_PX)
            self._ring.surround(around & self._window.rect())
            place = beside(around, size, room)
        self.setGeometry(place)
        self.show()
        self.raise_()


def _shown(window: QWidget, names: Iterable[str], before: QWidget | None) -> QWidget | None:
    """The largest thing on screen whose name for screen readers begins with the first name."""
    for name in names:
        if _is(before, name):
            return before
        widgets = [one for one in window.findChildren(QWidget) if _is(one, name)]
        if widgets:
            return max(widgets, key=lambda one: one.width() * one.height())
    return None


def _is(widget: QWidget | None, name: str) -> bool:
    return widget is not None and widget.accessibleName().startswith(name) and widget.isVisible()


class WelcomeFeature(Feature):
    """Ways to begin.

    Parameters
    ----------
    session : Session
    shell : Shell
    steps : sequence of Step
        Of the tour.
    open_sample : callable
    open_recent : callable
        Opens what was open together.
    pictures : Path
        Folder of the pictures of recordings.
    """

    def __init__(
        self,
        session: Session,
        shell: Shell,
        steps: Sequence[Step],
        open_sample: Callable[[], object],
        open_recent: Callable[[Sequence[Path]], object],
        pictures: Path,
    ) -> None:
        self._session, self._shell, self._open_recent = session, shell, open_recent
        self.pictures = RecordingPictures(session, pictures, session.parent)
        self.tour = TourModel(
            steps, session.settings, self._sample_is_open, open_sample, session.parent
        )
        self.changing, self.closing = (self.tour.changed,), (self.pictures,)

    def actions(self) -> Sequence[Action]:
        """The start page and the tour."""
        shell, document = self._shell, self._session.document
        return (
            Action(
                "start_page", "File", "Start page", (),
                "Ways to begin, and what was open lately; what is open stays open",
                lambda: shell.show_start(not shell.starts),
                lambda: document.content is not None, checked=lambda: shell.starts,
            ),
            Action(
                "tour", "Help", "Tour of the sample", (),
                "Small steps by your own hand, from the first look to a trained model; goes on"
                " where you left it",
                self.tour.begin,
            ),
        )  # fmt: skip

    def start_page(self) -> StartPage:
        """Page to begin on."""
        settings, action = self._session.settings, self._shell.action
        back = partial(self._shell.show_start, False)
        return StartPage(settings, self.pictures, self.tour, action, self._open_recent, back)

    def callout(self, window: QMainWindow, label_key: Callable[[], str]) -> TourCallout:
        """The tour on a window."""
        return TourCallout(self.tour, window, self._shell.action, label_key)

    def attach(self) -> None:
        """Go on with the tour, or let it rest."""
        self.tour.follow_document()

    def _sample_is_open(self) -> bool:
        recording = self._session.document.recording
        return recording is not None and is_bundled(recording.folder)
