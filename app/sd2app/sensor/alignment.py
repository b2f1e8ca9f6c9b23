"""Time offset of the radar, found by what its map and the synthetic one have in common."""

from __future__ import annotations

from typing import Any

from PySide6.QtCore import QObject

from sd2app.background.latest import LatestRunner, ProblemModel
from sd2app.background.quoting import quoted
from sd2app.maps.model import SynthesisModel
from sd2app.session.content import folder_for_command
from sd2app.session.session import Session
from sd2core.cli.align import Align
from sd2core.doppler.alignment import WITHIN_S, Alignment, align
from sd2core.options.records import words_of

_SURE = 0.99


class AlignmentModel(ProblemModel):
    """Looks in the background for the offset at which the maps on screen fit."""

    def __init__(self, session: Session, synthesis: SynthesisModel, parent: QObject) -> None:
        super().__init__(parent)
        self._session, self._synthesis = session, synthesis
        self.within_s = WITHIN_S  # how far is searched
        self.result: Alignment | None = None
        self._runner = LatestRunner("alignment", self, self._take, self._refuse)

    @property
    def now_s(self) -> float:
        """Offset of the recording."""
        recording = self._session.document.recording
        return recording.radar_offset_s if recording is not None else 0.0

    @property
    def line(self) -> str:
        """Command for a terminal that looks for the offset in the saved recording, and keeps it."""
        recording = self._session.document.recording
        folders = () if recording is None else (folder_for_command(recording),)
        return quoted(words_of("align", Align(recordings=folders, within=self.within_s, save=True)))

    @property
    def why_not(self) -> str:
        """Reason why nothing can be aligned; empty if it can."""
        if self._session.maps.real.map is None:
            return (
                "There is no radar to align: add its recording first"
                " (File → Add to this recording…)"
            )
        if not self._session.has_mesh():
            return "There is no mesh to compare the radar with: fit one to the video first"
        if not self._synthesis.complete:
            return "Wait until the synthetic map is complete"
        return ""

    @property
    def nothing_measured(self) -> str:
        """Reason why there is nothing to move in time; empty if there is."""
        recording = self._session.document.recording
        if self._session.maps.real.map is None and (recording is None or recording.imu is None):
            return "There is no radar and no real inertial sensor to align"
        return ""

    def search(self, within_s: float | None = None) -> None:
        """Search up to so many seconds from the recording's offset, by default as before."""
        self.within_s = reach_s = within_s or self.within_s
        self.result, self.problem = None, ""
        maps, now_s = self._session.maps, self.now_s
        synthetic, radar = maps.synthetic.map, maps.real.map
        if synthetic is None or radar is None:
            return
        self._runner.submit(lambda emit: align(synthetic, radar, around_s=now_s, within_s=reach_s))
        self.changed.emit()

    def apply(self) -> None:
        """Give the recording the offset, as one step in the history."""
        if self.result is not None and not self.problem:
            self._session.edits.set_radar_offset(self.result.offset_s)

    def cancel(self) -> None:
        """Stop searching."""
        self._runner.cancel()

    def _take(self, result: Any) -> None:
        self.result, self.problem = result, result.problem
        self.changed.emit()


def result_text(model: AlignmentModel) -> str:
    """Sentence on what was found; empty where there is a problem."""
    result = model.result
    if model.busy:
        return "Comparing…"
    if result is None or model.problem:
        return ""
    sure = "high" if result.confidence >= _SURE else "sufficient"
    return (
        f"The radar fits best with an offset of {result.offset_s:.3f} s (now {model.now_s:.3f} s)."
        f" Confidence is {sure} ({result.confidence:.2f})."
    )
