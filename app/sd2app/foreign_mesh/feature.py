"""A mesh of another program over the video, before it is taken and whenever it is asked for."""

from __future__ import annotations

from collections.abc import Sequence

from sd2app.feature import Action, Feature, Shell
from sd2app.foreign_mesh.dialog import MeshDialog
from sd2app.foreign_mesh.model import MeshPreview
from sd2app.session.mesh_reading import ReadMesh
from sd2app.session.session import Session
from sd2app.widgets.dialogs import accepted
from sd2core.recording.recording import Recording


class ForeignMeshFeature(Feature):
    """The dialog in which one says how a mesh is to be read, and sees what comes of it."""

    def __init__(self, session: Session, shell: Shell) -> None:
        self._session, self._shell = session, shell

    def actions(self) -> Sequence[Action]:
        """Reading the mesh that is open another way."""
        document = self._session.document
        return (
            Action(
                "read_mesh", "File", "Lay the mesh over the video…", (),
                "Read the mesh another way (person, turn, focal length, unit) and see it over the"
                " video as it changes",
                self._read_again,
                lambda: document.recording is not None and document.recording.mesh is not None,
            ),
        )  # fmt: skip

    def ask(self, recording: Recording) -> ReadMesh | None:
        """Show the mesh of a recording over its video; None where it is not taken."""
        window = self._shell.dialog_parent
        preview = MeshPreview(recording, window)
        dialog = MeshDialog(preview, self._session.display.palette, window)
        taken = preview.taken if accepted(dialog) else None
        preview.close()
        preview.deleteLater()
        return taken

    def _read_again(self) -> None:
        recording = self._session.document.recording
        assert recording is not None
        if taken := self.ask(recording):
            self._session.edits.take_mesh("Read mesh another way", taken)
