"""Comparison of the open mesh with another one of the same video."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from PySide6.QtWidgets import QWidget

from sd2app.feature import Action, Feature, Shell
from sd2app.mesh_comparison.model import ComparisonModel
from sd2app.mesh_comparison.window import ComparisonWindow
from sd2app.playback.views import TimeRuler
from sd2app.session.maps import MapModel
from sd2app.session.session import Session
from sd2app.video.overlay_settings import OverlayModel
from sd2app.widgets.dialogs import ask_file

_MESHES = (
    "Mesh or recording (*.npz *.zip zarr.json *.pkl *.obj *.ply *.glb recording.json);;"
    "All files (*)"
)
_SHARED_KEYS = ("play", "previous_frame", "next_frame", "back_second", "on_second", "zoom_fit")
"""Actions that work in the window of a comparison too."""


def mesh_of(path: Path) -> Path:
    """Mesh that a chosen file belongs to: a Zarr group is a folder, as are frames in files."""
    if path.name in ("zarr.json", "recording.json"):
        return path.parent
    if path.suffix.lower() in (".obj", ".ply", ".glb") and path.parent.is_dir():
        return path.parent
    return path


class MeshComparisonFeature(Feature):
    """Window of its own with two meshes side by side; ``map_view`` makes the view of a map."""

    def __init__(
        self,
        session: Session,
        shell: Shell,
        overlay: OverlayModel,
        map_view: Callable[[MapModel], QWidget],
    ) -> None:
        self._session, self._shell, self._overlay = session, shell, overlay
        self._map_view = map_view
        self._window: ComparisonWindow | None = None

    def actions(self) -> Sequence[Action]:
        """The comparison."""
        return (
            Action(
                "compare", "File", "Compare with mesh…", (),
                "Measure another mesh of this video against the one that is open",
                self.compare, self._session.has_mesh,
            ),
        )  # fmt: skip

    def compare(self, path: Path | None = None) -> None:
        """Measure another mesh, which is asked for, against the one that is open."""
        s, shell = self._session, self._shell
        path = path or self._ask()
        if path is None or not s.has_mesh():
            return
        self.close()
        window = ComparisonWindow(
            ComparisonModel(s, path),
            s,
            self._overlay,
            map_view=self._map_view,
            ruler=TimeRuler(s),
            keys=[shell.action(name) for name in _SHARED_KEYS],
            attempt=shell.attempt,
            parent=shell.dialog_parent,
        )
        window.closed.connect(self._forget)
        # It is about the recording that was open.
        s.document.opened.connect(window.close)
        self._window = window
        window.show()

    def _ask(self) -> Path | None:
        path = ask_file(self._shell.dialog_parent, "Compare with mesh", _MESHES)
        return None if path is None else mesh_of(path)

    def _forget(self) -> None:
        window, self._window = self._window, None
        if window is not None:
            window.deleteLater()

    def close(self) -> None:
        """Close the comparison, where one is open."""
        if self._window is not None:
            self._window.close()
