"""Figures for papers: the maps, and strips of frames."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from PySide6.QtWidgets import QDialog

from sd2app.feature import Action, Feature, Shell
from sd2app.figures.dialogs import MapFigureDialog, StripDialog
from sd2app.figures.model import DrawnFigure, MapFigure, StripModel
from sd2app.maps.difference import DifferenceModel
from sd2app.session.session import Session
from sd2app.widgets.dialogs import accepted
from sd2core.labels.spans import Labels


class FiguresFeature(Feature):
    """Dialogs that draw what is on screen into a file.

    ``labels`` gives the labels that are drawn, ``denoiser`` the denoiser in words.
    """

    def __init__(
        self,
        session: Session,
        shell: Shell,
        difference: DifferenceModel,
        labels: Callable[[], Labels],
        denoiser: Callable[[], str],
    ) -> None:
        self._session, self._shell, self._difference = session, shell, difference
        self._labels, self._denoiser = labels, denoiser
        self.changing = tuple(track.came_or_went for track in session.maps.all)

    def actions(self) -> Sequence[Action]:
        """Figure of the maps, strip of frames."""
        s = self._session
        return (
            Action(
                "export_maps", "File", "Export figure of the maps…", (),
                "Write the Doppler maps one above the other, as they are shown (.png, .svg, .pdf)",
                self._export_maps, lambda: any(track.map is not None for track in s.maps.all),
            ),
            Action(
                "export_strip", "File", "Export strip of frames…", ("Ctrl+Shift+E",),
                "Write frames side by side, the video above its mesh (.png, .svg, .pdf)",
                self._export_strip, lambda: s.document.video is not None or s.has_mesh(),
            ),
        )  # fmt: skip

    def _export_maps(self) -> None:
        s, window = self._session, self._shell.dialog_parent
        model = MapFigure(s, self._difference, self._labels(), self._denoiser(), window)
        name = s.document.file_name("-maps")
        self._ask(MapFigureDialog(model, s.display.palette, name, window), model)

    def _export_strip(self) -> None:
        s, content = self._session, self._session.document.content
        if content is not None:
            window, name = self._shell.dialog_parent, s.document.file_name("-frames")
            model = StripModel(content, s.playback.time_s, window)
            self._ask(StripDialog(model, s.display.palette, name, window), model)

    @staticmethod
    def _ask(dialog: QDialog, model: DrawnFigure) -> None:
        accepted(dialog)
        model.close()
        model.deleteLater()
