"""The mesh that is open made smooth in time: a run of ``sd2 refine``, and its result in place."""

from __future__ import annotations

from pathlib import Path

from sd2app.commands.model import AnyCommandRun, CommandForms
from sd2app.session.session import Session
from sd2core.cli.refine import Refine
from sd2core.files.paths import free_path, plain_path
from sd2core.files.recording_json import MeshReading
from sd2core.files.resources import is_bundled
from sd2core.io.mesh_models import is_estimate

_ENDING = "-smooth.zarr"


class MeshRefining:
    """Fills in the form of ``sd2 refine``, and puts what it made in the place of the mesh."""

    def __init__(self, session: Session, forms: CommandForms) -> None:
        self.document, self._edits, self._forms = session.document, session.edits, forms
        forms.ended.connect(self.take)

    @property
    def why_not(self) -> str:
        """Reason why there is nothing to make smooth; empty where there is a mesh."""
        mesh = self.document.mesh
        if mesh is None:
            return "There is no mesh to make smooth: add one first (File → Add to this recording…)"
        if mesh.uncertainty is not None:
            return "This mesh is smooth already: of `sd2 fit`, or made smooth before"
        return ""

    def fill(self) -> None:
        """Show the form with the mesh as it is read now."""
        content = self.document.content
        assert content is not None
        recording, mesh = content.recording, content.recording.mesh
        assert mesh is not None
        read = recording.mesh_reading.options()
        folder = recording.folder if content.saved else mesh.parent
        folder = Path.home() if is_bundled(folder) else folder
        estimated = is_estimate(mesh)
        rate = read.pop("frames_per_s", None)
        if not estimated:  # the command refuses what would change nothing
            read.pop("focal_px", None)
        self._forms.fill(
            Refine(
                mesh=plain_path(mesh),
                out=free_path(folder, f"{mesh.stem}{_ENDING}", "again", reserved=""),
                video=recording.video if estimated else None,
                faces=recording.faces,
                fps=rate,
                **read,
            )
        )

    def can_take(self, run: AnyCommandRun) -> bool:
        """True for a mesh that was made smooth from the one that is open."""
        recording, made = self.document.recording, run.about
        if run.phase != "finished" or made.get("what") != "refine" or recording is None:
            return False
        return recording.mesh is not None and made.get("mesh") == str(plain_path(recording.mesh))

    def take(self, run: AnyCommandRun) -> None:
        """Put the smooth mesh in the place of the open one, as a step of the history."""
        recording = self.document.recording
        if recording is None or not self.can_take(run):
            return
        # Smooth vertices are placed already; the focal length lays them over the video.
        reading = MeshReading(focal_px=recording.mesh_reading.focal_px)
        smooth = {"mesh": Path(run.about["out"]), "faces": None, "mesh_reading": reading}
        self._edits.read_mesh("Make mesh smooth", smooth)
