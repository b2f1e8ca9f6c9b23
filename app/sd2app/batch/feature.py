"""Batches over many recordings and placements."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from PySide6.QtCore import QObject, SignalInstance

from sd2app.background.run_command import COMMAND
from sd2app.batch.dialog import BatchDialogs
from sd2app.batch.model import BatchModel
from sd2app.feature import Action, Feature, Shell
from sd2app.sensor.placements import PlacementsModel
from sd2app.session.session import Session


class BatchFeature(Feature):
    """Window in which a batch is set up, followed and its results opened."""

    def __init__(
        self,
        session: Session,
        shell: Shell,
        placements: PlacementsModel,
        installed: Callable[[], Sequence[str]],
        command: Sequence[str] | None,
        parent: QObject,
    ) -> None:
        self.model = BatchModel(session.settings, parent, command or COMMAND)
        self.dialogs = BatchDialogs(self.model, session, shell, placements, installed)

    def actions(self) -> Sequence[Action]:
        """The window of the batch."""
        return (
            Action(
                "batch", "File", "Batch…", ("Ctrl+B",),
                "Fit, synthesise, denoise and export many recordings from many places, in the"
                " background",
                self.dialogs.show,
            ),
        )  # fmt: skip

    def warnings(self) -> Sequence[SignalInstance]:
        """Failures of the batch."""
        return (self.model.failed,)

    def notes(self) -> Sequence[SignalInstance]:
        """Ends of batches."""
        return (self.model.noted,)

    def look_for_unfinished(self) -> None:
        """Find a batch that outlived its window."""
        self.model.look_for_batch()

    def close(self) -> None:
        """Close the window of the batch, which goes on."""
        self.dialogs.close()
        self.model.close()
