"""What the window shows while nothing is open, or when asked: ways to begin, and recent files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtGui import QAction, QPixmap
from PySide6.QtWidgets import QGridLayout, QScrollArea, QWidget

from sd2app.settings import MAX_RECENT, Settings
from sd2app.welcome.cards import RecentCard, WayCard
from sd2app.welcome.pictures import RecordingPictures
from sd2app.welcome.tour import TourModel
from sd2app.widgets.layouts import STRETCH, column_of, row_of
from sd2app.widgets.panel import outlined, sentence, title
from sd2core.files.resources import is_bundled

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
