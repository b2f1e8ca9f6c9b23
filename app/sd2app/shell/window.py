"""The window: a skeleton that stands at once, filled when the rest is loaded."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import (
    QCloseEvent,
    QDragEnterEvent,
    QDropEvent,
    QPaintEvent,
)
from PySide6.QtWidgets import (
    QApplication,
    QMainWindow,
    QVBoxLayout,
    QWidget,
)

from sd2app.background.latest import LatestRunner
from sd2app.settings import Settings
from sd2app.widgets.panel import fill, panel, splitter
from sd2app.widgets.theme import apply_theme

if TYPE_CHECKING:
    from sd2app.accuracy.ladder import Ladder
    from sd2app.batch.dialog import BatchDialogs
    from sd2app.classify.dialogs import ClassifyDialogs
    from sd2app.classify.library import ClassifierLibrary
    from sd2app.denoise.library import DenoiserLibrary
    from sd2app.labels.files_dialogs import LabelFileDialogs
    from sd2app.labels.panel import LabelsPanel
    from sd2app.labels.tracks_dialog import TrackDialogs
    from sd2app.scene import SceneView
    from sd2app.sensor.panel import SensorPages
    from sd2app.shell.file_dialogs import Dialogs
    from sd2app.shell.side_panel import SidePanel
    from sd2app.shell.wiring import Context
    from sd2app.training.dialogs import TrainingDialogs
    from sd2app.training.page import TrainPage

_SHARED_KEYS = ("play", "previous_frame", "next_frame", "back_second", "on_second", "zoom_fit")
"""Actions that work in the window of a comparison too."""
_LABELS_PX = 560
"""Room for the usual columns of the table of spans."""
_PANELS = ("video", "scene", "sensor", "tracks", "spectrum")


class MainWindow(QMainWindow):
    """One recording: frame-wise views on top, time-wise tracks below."""

    first_painted = Signal()

    context: Context
    dialogs: Dialogs
    label_files: LabelFileDialogs
    track_dialogs: TrackDialogs
    train_dialogs: TrainingDialogs
    class_dialogs: ClassifyDialogs
    side: SidePanel
    train_page: TrainPage
    labels_panel: LabelsPanel
    sensor_pages: SensorPages
    batch_dialogs: BatchDialogs

    def __init__(
        self,
        settings: Settings,
        ladder: Ladder | None = None,
        fit_command: Sequence[str] | None = None,
        denoisers: DenoiserLibrary | None = None,
        train_command: Sequence[str] | None = None,
        recovery: Path | None = None,
        batch_command: Sequence[str] | None = None,
        classifiers: ClassifierLibrary | None = None,
    ) -> None:
        super().__init__()
        self._settings = settings
        self._ladder = ladder
        self._fit_command = fit_command
        self._denoisers = denoisers
        self._train_command = train_command
        self._recovery = recovery
        self._batch_command = batch_command
        self._classifiers = classifiers
        self._scene: SceneView | None = None
        self._ready = False
        self._painted = False
        self.setWindowTitle("SD² Studio")
        self.setAcceptDrops(True)
        self.setMinimumSize(960, 640)
        self.resize(1280, 800)
        self._panels = {name: panel(name) for name in _PANELS}
        self._build_skeleton()
        if (geometry := settings.layout("window")) is not None:
            self.restoreGeometry(geometry)

    @property
    def ready(self) -> bool:
        """Whether the views stand and a recording can be shown."""
        return self._ready

    @property
    def settled(self) -> bool:
        """Whether nothing is being read, computed or decoded."""
        return (
            self._scene is not None
            and not self.context.jobs.jobs
            and not self.context.synthesis.busy
            and not self.context.placements.busy
            and not self.context.denoise.busy
            and not self.context.classify.busy
            and not self.context.video.busy
        )

    # --- building -------------------------------------------------------------------------

    def _build_skeleton(self) -> None:
        self._top = splitter(
            Qt.Orientation.Horizontal,
            [self._panels[name] for name in ("video", "scene", "sensor")],
            (360, 620, 284),
        )
        self._bottom = splitter(
            Qt.Orientation.Horizontal,
            [self._panels["tracks"], self._panels["spectrum"]],
            (992, 272),
        )
        self._rows = splitter(Qt.Orientation.Vertical, [self._top, self._bottom], (360, 336))
        self._column = QVBoxLayout()
        self._column.setContentsMargins(8, 0, 8, 0)
        self._column.setSpacing(4)
        self._column.addWidget(self._rows, 1)
        centre = QWidget(self)
        centre.setLayout(self._column)
        self.setCentralWidget(centre)

    def populate(self) -> None:
        """Load what takes time to import, and fill the skeleton."""
        # Imported here so that the skeleton is on screen before NumPy, PyAV,
        # numba and VTK are loaded.
        from sd2app.batch.dialog import BatchDialogs
        from sd2app.classify.chooser import ClassifierChooser
        from sd2app.classify.dialogs import ClassifyDialogs
        from sd2app.denoise.chooser import DenoiserChooser
        from sd2app.labels.files_dialogs import LabelFileDialogs
        from sd2app.labels.tracks_dialog import TrackDialogs
        from sd2app.playback.transport import TransportBar
        from sd2app.shell.file_dialogs import Dialogs
        from sd2app.shell.menus import ActionSet
        from sd2app.shell.panes import fit_bar, label_bar
        from sd2app.shell.status_bar import StatusLine
        from sd2app.shell.wiring import build_context
        from sd2app.widgets.message_bar import MessageBar
        from sd2app.widgets.model_menu import ModelMenu

        self.context = build_context(
            self,
            self._settings,
            self._ladder,
            self._fit_command,
            self._denoisers,
            self._train_command,
            self._recovery,
            self._batch_command,
            self._classifiers,
        )
        context = self.context
        context.display.set_dark(is_dark(self._settings))
        self.messages = MessageBar(self)
        self.dialogs = Dialogs(self, context, self.messages.warn)
        self.label_files = LabelFileDialogs(
            self, context, self.messages, lambda: self.side.bring_up("Agree")
        )
        self.batch_dialogs = BatchDialogs(self, context, self.messages.warn, self.open_others)
        self.track_dialogs = TrackDialogs(self, context, self.messages)
        self._actions = ActionSet(self)
        below = [self._actions[name] for name in ("open_model", "model_card")]
        choosers = DenoiserChooser(context.denoise), ClassifierChooser(context.classify)
        self._models = ModelMenu(choosers[0], self.dialogs.use_model, below, self)
        self.class_dialogs = ClassifyDialogs(self, context, self.messages.warn)
        below = [self._actions[name] for name in ("open_classifier", "classifier_card")]
        self._classes = ModelMenu(choosers[1], self.class_dialogs.use, below, self)
        self._recent_menu = self._actions.fill_menu_bar(self._models, self._classes)
        self._recent_menu.aboutToShow.connect(self._list_recent)
        self._fill_panels()
        self._column.insertWidget(0, self.messages)
        self._column.insertWidget(1, label_bar(context, self.dialogs))
        self._column.insertWidget(2, fit_bar(context, self.dialogs))
        self._column.addWidget(
            TransportBar(context.playback, context.span_loop, self._actions, self)
        )
        self._column.addWidget(
            StatusLine(context.pointer, context.jobs, context.trade, context.synthesis, self)
        )
        self._connect()
        self._restyle()
        self._refresh()
        for name in ("top", "bottom", "rows"):
            if (state := self._settings.layout(name)) is not None:
                getattr(self, f"_{name}").restoreState(state)
        self._ready = True
        context.fit.look_for_unfinished()
        context.training.look_for_runs()
        context.batch.look_for_batch()
        context.class_training.look_for_runs()
        context.export.look_for_export()
        # VTK last, imported in a thread: everything else is usable while it loads.
        self._importer = LatestRunner("import", self)
        self._importer.finished.connect(self._add_scene)
        self._importer.submit(lambda emit: import_module("sd2app.scene"))

    def _fill_panels(self) -> None:
        from sd2app.shell.page_widths import PageWidths
        from sd2app.shell.panes import spectrum_pane, video_pane
        from sd2app.shell.side_pages import side_pages
        from sd2app.shell.track_stack import Tracks

        c, actions = self.context, self._actions
        fill(self._panels["video"], video_pane(c, actions))
        self.side, self.sensor_pages, self.train_page, self.labels_panel, self.train_dialogs = (
            side_pages(self, actions)
        )
        fill(self._panels["sensor"], self.side)
        self._widths = PageWidths(self._top, self.side, {"Labels": _LABELS_PX}, self._settings)
        self._tracks = Tracks(c, self._models, self._classes, actions)
        fill(self._panels["tracks"], self._tracks)
        fill(self._panels["spectrum"], spectrum_pane(c, actions))

    def _add_scene(self) -> None:
        if not self._ready:
            return
        from sd2app.scene import SceneView
        from sd2app.scene.bar import SceneBar

        c = self.context
        self._scene = SceneView(
            c.document,
            c.playback,
            c.sensor,
            c.display,
            c.synthesis,
            c.placements,
            begin_drag=c.edits.begin_sensor_drag,
            drag=c.edits.drag_sensor,
            end_drag=c.edits.end_sensor_drag,
        )
        layout = QVBoxLayout()
        layout.addWidget(SceneBar(c.display, self._actions))
        layout.addWidget(self._scene, 1)
        fill(self._panels["scene"], layout)

    def _connect(self) -> None:
        from sd2app.shell.window_signals import connect_sentences, signals_of_actions

        c = self.context
        connect_sentences(c, self.messages)
        self.labels_panel.model.noted.connect(self.messages.note)
        c.document.opened.connect(self._show_document)
        for training in (c.training, c.class_training):
            training.changed.connect(self._mark_training)
        # Without a person in the frame there is nothing to aim at.
        c.synthesis.target_changed.connect(lambda: self._actions.refresh_one("aim_sensor"))
        c.display.theme_changed.connect(self._restyle)
        for signal in signals_of_actions(c):
            signal.connect(self._refresh)

    def _mark_training(self) -> None:
        c = self.context
        self.side.set_mark("Train", c.training.mark or c.class_training.mark)

    # --- following the models -------------------------------------------------------------

    def _show_document(self) -> None:
        self.messages.hide()
        self._tracks.show_document()
        self._refresh()

    def _refresh(self) -> None:
        document = self.context.document
        self._actions.refresh()
        mark = " *" if document.modified else ""
        kind = " (simulated)" if document.simulated else ""
        name = f"{document.title}{mark}{kind} – " if document.title else ""
        self.setWindowTitle(f"{name}SD² Studio")

    def _restyle(self) -> None:
        application = QApplication.instance()
        assert isinstance(application, QApplication)
        apply_theme(application, self.context.display.dark)
        self._actions.restyle()

    # --- what actions call ----------------------------------------------------------------

    def open_paths(self, paths: list[Path]) -> None:
        """Open what was named on the command line, dropped, or chosen from the list."""
        if len(paths) == 1 and self.context.fit.take_up(paths[0]):
            # No recording yet: a folder in which a fit was stopped.
            request = self.context.fit.request
            assert request is not None
            paths = [request.video]
        self.context.document.open(paths)
        if len(paths) == 1:
            self._settings.add_recent(paths[0].resolve())

    def open_others(self, paths: list[Path]) -> bool:
        """Open in place of what is open; False where the user wants to keep that."""
        if not self.dialogs.may_discard():
            return False
        self.open_paths(paths)
        return True

    def open_sample(self) -> None:
        """Open the recording that comes with the program."""
        from sd2core.files.resources import resource_path

        if self.dialogs.may_discard():
            self.open_paths([resource_path("swipes.sd2")])

    def set_dark(self, dark: bool) -> None:
        """Choose the theme and remember it."""
        self._settings.dark = dark
        self.context.display.set_dark(dark)

    def set_scene_view(self, name: str) -> None:
        """Look at the scene from somewhere else."""
        if self._scene is not None:
            self._scene.set_view(name)

    def compare_with_mesh(self, path: Path | None = None) -> None:
        """Ask for another mesh, and show both."""
        keys = [self._actions[name] for name in _SHARED_KEYS]
        self.dialogs.compare_with_mesh(keys, path)

    def show_sensor(self) -> None:
        """Bring up the one sensor."""
        self.side.bring_up("Sensor")
        self.sensor_pages.show_sensor()

    def show_placements(self) -> None:
        """Bring up the places where sensors are planned."""
        self.side.bring_up("Sensor")
        self.sensor_pages.show_placements()

    def measure_scene(self) -> None:
        """Measure every plan, where one can watch it."""
        self.side.bring_up("Accuracy")
        self.context.trade.measured.measure()

    def show_labels(self, page: Literal["spans", "search", "label set"] = "spans") -> None:
        """Bring up the table of spans, the search in it, or the label set, with the keyboard."""
        self.side.bring_up("Labels")
        panel = self.labels_panel
        pages = {"spans": panel.show_spans, "search": panel.find, "label set": panel.show_label_set}
        pages[page]()

    def show_training(self, page: Literal["denoisers", "classifiers"]) -> None:
        """Bring up the training of denoisers, or that of classifiers."""
        self.side.bring_up("Train")
        train = self.train_page
        {"denoisers": train.show_denoisers, "classifiers": train.show_classifiers}[page]()

    def close_window(self) -> None:
        """Close, after asking when edits would be lost."""
        self.close()

    def _list_recent(self) -> None:
        self._recent_menu.clear()
        for path in self._settings.recent:
            action = self._recent_menu.addAction(str(path))
            action.triggered.connect(lambda _=False, path=path: self._open_recent(path))
        self._recent_menu.setEnabled(True)
        if self._recent_menu.isEmpty():
            self._recent_menu.addAction("Nothing yet").setEnabled(False)

    def _open_recent(self, path: Path) -> None:
        if self.dialogs.may_discard():
            self.open_paths([path])

    # --- Qt events ------------------------------------------------------------------------

    def paintEvent(self, event: QPaintEvent) -> None:
        """Say when the skeleton is on screen."""
        super().paintEvent(event)
        if not self._painted:
            self._painted = True
            self.first_painted.emit()

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:
        """Take files."""
        if self._ready and event.mimeData().hasUrls():
            event.acceptProposedAction()

    def dropEvent(self, event: QDropEvent) -> None:
        """Open what was dropped; with Shift, add it. A model is used, labels are imported."""
        paths = [Path(url.toLocalFile()) for url in event.mimeData().urls() if url.isLocalFile()]
        if not paths:
            return
        event.acceptProposedAction()
        if len(paths) == 1 and paths[0].suffix == ".safetensors":
            if not self.class_dialogs.take_dropped(paths[0]):
                self.dialogs.use_model(paths[0])
        elif len(paths) == 1 and self.label_files.take_dropped(paths[0]):
            pass
        elif event.modifiers() & Qt.KeyboardModifier.ShiftModifier:
            self.context.document.add(paths)
        elif self.dialogs.may_discard():
            self.open_paths(paths)

    def closeEvent(self, event: QCloseEvent) -> None:
        """Ask, remember the layout, stop every thread, release VTK."""
        if not self._ready:
            event.accept()
            return
        asked = (self.dialogs.may_discard, self.dialogs.may_stop_fit, self.train_dialogs.may_leave)
        if not all(may_close() for may_close in asked):
            event.ignore()
            return
        self._settings.set_layout("window", self.saveGeometry())
        self._widths.remember()
        for name in ("top", "bottom", "rows"):
            self._settings.set_layout(name, getattr(self, f"_{name}").saveState())
        self._ready = False
        self.dialogs.close_comparison()
        self.batch_dialogs.close()
        self._importer.close()
        self.context.close()
        if self._scene is not None:
            self._scene.close()
        event.accept()


def is_dark(settings: Settings) -> bool:
    """The user's choice of theme, or the system's."""
    if settings.dark is not None:
        return settings.dark
    hints = QApplication.styleHints()
    return hints.colorScheme() == Qt.ColorScheme.Dark
