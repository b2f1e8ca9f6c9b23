"""The window: a skeleton that stands at once, filled when the rest is loaded."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from importlib import import_module
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from PySide6.QtCore import QByteArray, QEvent, QRect, QSize, Qt, QTimer, Signal
from PySide6.QtGui import (
    QAction,
    QCloseEvent,
    QDragEnterEvent,
    QDragLeaveEvent,
    QDragMoveEvent,
    QDropEvent,
    QGuiApplication,
    QKeyEvent,
)
from PySide6.QtWidgets import QAbstractButton, QApplication, QMainWindow, QMenu, QTabBar, QWidget

from sd2app.background.latest import LatestRunner, delayed
from sd2app.session.display import LAYOUTS, Layouts
from sd2app.settings import Settings
from sd2app.shell.loading import DropOverlay, LoadingCover
from sd2app.shell.messages import MessageNotice, MessagesDialog, MessagesModel
from sd2app.shell.parts import Parts
from sd2app.shell.side_panel import SideDock, SidePanel
from sd2app.widgets.dialogs import accepted, tab_to
from sd2app.widgets.inputs import claims
from sd2app.widgets.layouts import column_of, pane, row_of
from sd2app.widgets.notices import Notice, NoticeStack
from sd2app.widgets.panel import fill, panel, replace_content, sentence, splitter
from sd2app.widgets.theme import apply_theme, is_dark, leave_unstyled
from sd2core.processes import return_free_memory

if TYPE_CHECKING:
    from sd2app.feature import Feature
    from sd2app.maps.stack import MapStack
    from sd2app.session.session import Session
    from sd2app.shell.keys.model import KeyBindings
    from sd2app.shell.wiring import Features

T = TypeVar("T")

_PANELS = ("video", "scene", "tracks", "spectrum", "side")
_SPLITTERS = ("views", "main")  # whose sizes each layout remembers
_SIDE_PX = 328
_SHARE = 0.8
_LEAST_PX = QSize(960, 640)
_OFF_SCREEN_PX = QSize(1280, 800)


class MainWindow(QMainWindow):
    """One recording: frame-wise views at the left, time-wise tracks beside them.

    It is also the :class:`sd2app.feature.Shell` of its features.
    """

    first_painted = Signal()

    session: Session
    features: Features
    keys: KeyBindings
    side: SidePanel
    maps: MapStack
    # Of the shell, what others do for it.
    note: Callable[[str], None]
    warn: Callable[[str], None]
    fold_side: Callable[[bool], None]
    save: Callable[[], bool]
    may_discard: Callable[[], bool]
    open_paths: Callable[[Sequence[Path]], None]

    def __init__(self, settings: Settings, parts: Parts | None = None) -> None:
        super().__init__()
        self._settings = settings
        self._parts = parts or Parts()
        self.ready = False  # true once the views stand and a recording can be shown
        self._asks_start = False
        self._behind: set[Feature] = set()  # whose actions do not follow their models yet
        self._tabbed: QWidget | None = None  # control that Tab has reached last
        self.setWindowTitle("SD² Studio")
        self.setAcceptDrops(True)
        self._panels = {name: panel(name) for name in _PANELS}
        self._build_skeleton()
        place_on_screen(self, settings.layout("window"))

    @property
    def settled(self) -> bool:
        """True while nothing is being read, computed or decoded."""
        busy = any(feature.busy for feature in self.features)
        return not self.session.jobs.jobs and not busy

    # --- building -------------------------------------------------------------------------

    def _build_skeleton(self) -> None:
        across, panels = Qt.Orientation.Horizontal, self._panels
        self._views = splitter(
            Qt.Orientation.Vertical, [panels["video"], panels["scene"]], (300, 320)
        )
        # Of the room of a larger window, maps take most.
        parts = [self._views, panels["tracks"], panels["spectrum"]]
        self._main = splitter(across, parts, (320, 640, 200))
        for place, share in enumerate((0, 1, 0)):
            self._main.setStretchFactor(place, share)
        self._below = column_of(margins_px=0)
        self._panes = pane((self._main, 1), self._below, spacing_px=2)
        self._column = column_of((self._panes, 1), spacing_px=4, margins_px=0)
        beside = QWidget(self)
        beside.setLayout(self._column)
        # The side panel has the window's full height, from the menus to the last line; it lies
        # over its room, which it may exceed.
        self._room = QWidget(self)
        self._across = splitter(across, [beside, self._room], (936, _SIDE_PX))
        self._lines = column_of((self._across, 1), spacing_px=0, margins_px=(8, 0, 8, 0))
        self._centre = QWidget(self)
        self._centre.setLayout(self._lines)
        self.setCentralWidget(self._centre)
        panels["side"].setParent(self._centre)
        self._loading = LoadingCover(self._centre)
        self._loading.painted.connect(self.first_painted, Qt.ConnectionType.SingleShotConnection)

    def populate(self) -> None:
        """Load what takes time to import, and fill the skeleton."""
        # Nearly all that is made now stays: looking for what does not would take a tenth of it.
        gc.disable()
        leave_unstyled(_application())
        # Imported here so that the skeleton is on screen before NumPy, PyAV,
        # numba and VTK are loaded.
        from sd2app.playback.feature import TransportBar
        from sd2app.session.session import Session
        from sd2app.shell.keys.model import KeyBindings
        from sd2app.shell.menus import Menus, in_order
        from sd2app.shell.status_bar import StatusLine
        from sd2app.shell.wiring import Features

        self._drops = DropOverlay(self._centre)
        self.messages = MessagesModel(self)
        self.note, self.warn = self.messages.note, self.messages.warn
        self.session = s = Session(self, self._settings)
        s.display.set_dark(is_dark(self._settings.dark))
        self.features = Features(s, self, self._parts)
        files = self.features.files
        self.save, self.may_discard, self.open_paths = files.save, files.may_discard, files.open
        self._offered = {feature: feature.actions() for feature in self.features}
        actions = in_order(chain.from_iterable(self._offered.values()))
        self.keys = KeyBindings(actions, self.features.labels.model, self._settings, self)
        self._menus = Menus(self, s, actions, self.keys)
        self._menus.fill(
            {name: fill for feature in self.features for name, fill in feature.menus().items()}
        )
        self._fill_panels()
        self.start = self.features.welcome.start_page()
        bars = [bar for feature in self.features for bar in feature.bars()]
        for bar in bars:
            self._column.insertWidget(0, bar)
        self._dock.keep_clear([*bars, self._suggestions])
        offered = (notice for feature in self.features for notice in feature.notices())
        notices = [notice for notice in offered if isinstance(notice, Notice)]
        for notice in notices:
            notice.announced.connect(self.messages.keep)
        beside = self._column.parentWidget()
        assert beside is not None
        notices.insert(0, MessageNotice(self.messages))
        self._notices = NoticeStack(beside, self._views, notices)
        accuracy, synthesis = self.features.accuracy.model, self.features.maps.synthesis
        transport = TransportBar(s.playback, self.features.labels.loop, self.action, self)
        status = StatusLine(s, accuracy, synthesis, partial(self.bring_up, "Accuracy"), self)
        self._lines.addLayout(row_of(transport, (status, 1), spacing_px=8, margins_px=0))
        tabs = LayoutTabs(self.session.layouts, self)
        # A menu bar that is not the window's has no corner.
        if self.menuBar().isNativeMenuBar():
            self._lines.insertWidget(0, tabs)
        else:
            self.menuBar().setCornerWidget(tabs)
        self._column.insertWidget(self._column.indexOf(self._panes), self.start, 1)
        self.start.hide()
        self._of_recording = (tabs, self._panes, self._room, self._panels["side"], transport)
        label_set = self.features.labels.model
        self.tour = self.features.welcome.callout(
            self, lambda: label_set.labels.label_set.labels[0].key
        )
        shown = self.start, *self._panels.values(), self._suggestions, transport, status, self.tour
        self._regions = (tabs, *notices, *bars, *shown)
        self._soon = delayed(self._follow_actions, 0, self)
        # Once it is known if something is being opened, and before anything is painted.
        self._start_or_views = delayed(self._choose_start, 0, self)
        self._start_or_views.start()
        self._connect()
        self._restyle()
        self._refresh()
        self._show_layout()
        self._loading.follow(s)
        self.ready = True
        for feature in self.features:
            feature.look_for_unfinished()
        # VTK last, imported in a thread: everything else is usable while it loads.
        self._importer = LatestRunner("import", self, lambda _: self._add_scene())
        self._importer.submit(lambda emit: import_module("sd2app.scene.view"))
        gc.enable()

    def _fill_panels(self) -> None:
        from sd2app.maps.level_bar import MapEdge
        from sd2app.shell.wiring import side_pages, track_stack

        views = {name: view for feature in self.features for name, view in feature.panels().items()}
        for name in ("video", "spectrum"):
            fill(self._panels[name], views[name])
        edge = views["spectrum"]
        assert isinstance(edge, MapEdge)
        self._edge = edge
        self.side = SidePanel(side_pages(self.features, views), self._menus["pane_over"])
        self.fold_side = self.side.set_folded
        fill(self._panels["side"], self.side)
        frame, layouts = self._panels["side"], self.session.layouts
        self._dock = SideDock(frame, self._across, self.side, self._settings, layouts)
        self._suggestions = views["suggestions"]  # as wide as all panes, which is one row
        self._below.addWidget(self._suggestions)
        stack, self.maps = track_stack(self.session, self.features, views)
        fill(self._panels["tracks"], stack)
        self._scene_comes = sentence("Loading the 3D view…")
        self._scene_comes.setAlignment(Qt.AlignmentFlag.AlignCenter)
        fill(self._panels["scene"], self._scene_comes)

    def _add_scene(self) -> None:
        if self.ready:
            replace_content(self._scene_comes, self.features.scene.make_view())

    def _connect(self) -> None:
        s, features = self.session, self.features
        for feature in features:
            for signal in feature.changing:
                signal.connect(lambda *_, one=feature: self._refresh([one]))
        features.program.manual.answer()
        # What is open, and if it can be edited, concerns all.
        everybody = s.document.changed, features.labels.autosave.changed, self.keys.changed
        for signal in (*everybody, self.side.folded_changed):
            signal.connect(lambda *_: self._refresh())
        s.sensor.dragging_changed.connect(lambda _: self._refresh([]))
        s.document.opened.connect(self._show_document)
        for signal in (s.document.opened, s.jobs.changed):
            signal.connect(self._start_or_views.start)
        for signal in (s.document.changed, s.video.frame_changed):
            signal.connect(self._show_panes)
        self.session.layouts.leaving.connect(self._keep_layout)
        self.session.layouts.changed.connect(self._show_layout)
        self.session.layouts.panes_changed.connect(self._show_panes)
        for runs in (features.training.model, features.classify.training):
            runs.changed.connect(self._mark_training)
        # Without a person in the frame there is nothing to aim at.
        features.maps.synthesis.frame_changed.connect(lambda: self._menus.refresh_one("aim_sensor"))
        s.display.theme_changed.connect(self._restyle)
        # What computing a map has freed; the window rests now.
        features.maps.synthesis.completed.connect(return_free_memory)

    def _mark_training(self) -> None:
        runs = self.features.training.model, self.features.classify.training
        marked = next((model for model in runs if model.mark), runs[0])
        self.side.button("Train").set_mark(marked.mark, marked.share)

    # --- following the models -------------------------------------------------------------

    def _show_document(self) -> None:
        self._asks_start = False
        self.messages.dismiss()
        self.maps.refresh()
        self._refresh()

    def _choose_start(self) -> None:
        """Show the start page while nothing is open or it is asked for, and nothing else."""
        document = self.session.document
        nothing = document.content is None and document.reading is None
        starts = nothing or (self._asks_start and document.reading is None)
        if self.ready and starts == self.start.isHidden():
            for view in self._of_recording:
                view.setVisible(not starts)
            self.start.refresh("" if nothing else document.title)
            self.start.setVisible(starts)
            self._refresh([self.features.welcome])
            if not starts:  # Space plays, whatever had the keyboard on the page
                self._panels["tracks"].setFocus()

    def _show_panes(self) -> None:
        """Show the panes of the layout that have content."""
        document, filmed = self.session.document, self.session.video.picture is not None
        has = {"video": filmed or document.video is not None, "scene": document.mesh is not None}
        shown = {name: has[name] and self.session.layouts.shows(name) for name in has}
        for name, is_shown in shown.items():
            self._panels[name].setVisible(is_shown)
        self._views.setVisible(any(shown.values()))
        self._edge.set_folded(not self.session.layouts.shows("spectrum"))

    def _show_layout(self) -> None:
        """Show the layout in use as it was left."""
        self._dock.restore()
        for name in _SPLITTERS:
            if (state := self.session.layouts.sizes(name)) is not None:
                getattr(self, f"_{name}").restoreState(state)
        self._show_panes()
        if self.session.layouts.sizes("main") is None:
            wide_px = self._main.width()
            left_px = max(self.session.layouts.usual.views_px, wide_px // 5)
            edge_px = self._panels["spectrum"].sizeHint().width()
            self._main.setSizes([left_px, wide_px - left_px - edge_px, edge_px])
        self._refresh()

    def _keep_layout(self) -> None:
        self._dock.remember()
        for name in _SPLITTERS:
            self.session.layouts.keep_sizes(name, getattr(self, f"_{name}").saveState())

    def _follow_actions(self) -> None:
        """Enable and check the actions, and name the window, as the models stand now."""
        if self._behind:
            rows = [row for feature in self._behind for row in self._offered[feature]]
            self._behind.clear()
            self._menus.refresh(rows)
            self._name_window()

    def _name_window(self) -> None:
        document = self.session.document
        mark = " *" if document.modified else ""
        kind = " (simulated)" if document.simulated else ""
        name = f"{document.title}{mark}{kind} – " if document.title else ""
        self.setWindowFilePath(document.file_name(""))  # names what is saved of it
        self.setWindowTitle(f"{name}SD² Studio")

    def _refresh(self, features: Iterable[Feature] | None = None) -> None:
        # An edit changes several models; actions follow them once, before they are used: not
        # while the sensor is dragged, unless a key is pressed.
        self._behind.update(self.features if features is None else features)
        if not self.session.sensor.dragging:
            self._soon.start()

    def _restyle(self) -> None:
        apply_theme(_application(), self.session.display.dark)
        self._menus.restyle()

    # --- what features use ----------------------------------------------------------------

    @property
    def dialog_parent(self) -> QWidget:
        """Parent of dialogs."""
        return self

    def action(self, name: str) -> QAction:
        """Action by its id, of any feature."""
        self._follow_actions()
        return self._menus[name]

    def place_menu(self, place: str) -> QMenu:
        """Menu of the actions that stand at a place of their own, such as spans."""
        return self._menus.elsewhere[place]

    def show_messages(self) -> None:
        """Show what was said so far."""
        accepted(MessagesDialog(self.messages, self))

    def attempt(self, work: Callable[[], T]) -> T | None:
        """Result of ``work``; an error is told to the user, and None returned."""
        from sd2core.cli.running import explanation
        from sd2core.errors import Sd2Error

        try:
            return work()
        except (Sd2Error, OSError) as error:
            self.warn(str(explanation(error)))
            return None

    def bring_up(self, panel: str, page: str = "") -> None:
        """Show a panel at the side, and a page of it."""
        self._panels["side"].show()  # also beside the start page
        self.side.bring_up(panel, page)

    @property
    def side_folded(self) -> bool:
        """True while the panel at the side is folded away."""
        return self.side.folded

    @property
    def starts(self) -> bool:
        """True while the start page is on screen."""
        return not self.start.isHidden()

    def show_start(self, shown: bool) -> None:
        """Show the start page over what is open, or what is open again."""
        self._asks_start = shown
        self._start_or_views.start()

    # --- Qt events ------------------------------------------------------------------------

    def focusNextPrevChild(self, forward: bool) -> bool:
        """Go through all controls with Tab, from top left to bottom right."""
        regions = self._regions if self.ready else []
        self._tabbed = tab_to(regions, self.focusWidget(), forward)
        return self._tabbed is not None

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Show all maps again with Escape, wherever the keyboard is."""
        if self.ready and self.maps.ends_enlarging(event):
            self.maps.arrangement.enlarge(None)
        else:
            super().keyPressEvent(event)

    def event(self, event: QEvent) -> bool:
        """Leave Space to a button that was reached with Tab; keys find the actions as they are."""
        if event.type() == QEvent.Type.ShortcutOverride:
            self._follow_actions()
        focus = self.focusWidget()
        if isinstance(focus, QAbstractButton) and focus is self._tabbed:
            return claims(event, (Qt.Key.Key_Space,)) or super().event(event)
        return super().event(event)

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:
        """Say what a drop of these files would do."""
        paths = [Path(url.toLocalFile()) for url in event.mimeData().urls() if url.isLocalFile()]
        if self.ready and paths:
            used = [feature.drop_of(paths[0]) for feature in self.features if len(paths) == 1]
            own = [drop for drop in used if drop is not None][:1]
            self._drops.offer(paths, own or self.features.files.drops_of(paths))
            self.dragMoveEvent(event)

    def dragMoveEvent(self, event: QDragMoveEvent) -> None:
        """Follow the pointer."""
        self._drops.point(self._drops.mapFrom(self, event.position()))
        event.acceptProposedAction()

    def dragLeaveEvent(self, event: QDragLeaveEvent) -> None:
        """Show the window again."""
        self._drops.hide()

    def dropEvent(self, event: QDropEvent) -> None:
        """Do what the field below the pointer says."""
        self._drops.point(self._drops.mapFrom(self, event.position()))
        self._drops.hide()
        event.acceptProposedAction()
        # A dialog during the drop would keep the program waiting that it came from.
        QTimer.singleShot(0, self._drops.drops[self._drops.current].run)

    def closeEvent(self, event: QCloseEvent) -> None:
        """Ask, remember the layout, stop every thread, release VTK."""
        if not self.ready:
            event.accept()
            return
        features = self.features
        if not all(feature.may_close() for feature in features):
            event.ignore()
            return
        self._settings.set_layout("window", self.saveGeometry())
        self._keep_layout()
        self.ready = False
        self._importer.close()
        self.session.playback.pause()
        features.close()
        event.accept()


class LayoutTabs(QTabBar):
    """A tab for each layout."""

    def __init__(self, layouts: Layouts, parent: QWidget) -> None:
        super().__init__(parent)
        self.setAccessibleName("Layout")
        self.setObjectName("layouts")
        self.setDrawBase(False)
        self.setExpanding(False)
        for place, (name, layout) in enumerate(LAYOUTS.items()):
            self.addTab(name)
            self.setTabToolTip(place, layout.tip)
        self._layouts = layouts
        layouts.changed.connect(self._follow)
        self._follow()
        self.currentChanged.connect(lambda place: layouts.choose(list(LAYOUTS)[place]))

    def _follow(self) -> None:
        self.setCurrentIndex(list(LAYOUTS).index(self._layouts.name))


def _application() -> QApplication:
    application = QApplication.instance()
    assert isinstance(application, QApplication)
    return application


def place_on_screen(window: QWidget, remembered: QByteArray | None) -> None:
    """Put a window where it was left or, at first, in the middle; always within its screen."""
    # Qt moves it into the screen, or refuses where that is much wider or narrower than the old one.
    restored = remembered is not None and window.restoreGeometry(remembered)
    if QGuiApplication.platformName() == "offscreen":  # whose screen says nothing
        window.setMinimumSize(_LEAST_PX)
        if not restored:
            window.resize(_OFF_SCREEN_PX)
        return
    room = window.screen().availableGeometry()
    window.setMinimumSize(_LEAST_PX.boundedTo(room.size()))
    if not restored:
        window.setGeometry(usual_place(room))


def usual_place(room: QRect) -> QRect:
    """80 % of a screen's room or what the views need, in the middle."""
    size = (room.size() * _SHARE).expandedTo(_LEAST_PX).boundedTo(room.size())
    place = QRect(room.topLeft(), size)
    place.moveCenter(room.center())
    return place
