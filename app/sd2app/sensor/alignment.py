"""Time offset of the radar, found by what its map and the synthetic one have in common."""

from __future__ import annotations

from typing import Any

from PySide6.QtCore import QObject, Qt
from PySide6.QtWidgets import QWidget

from sd2app.background.latest import LatestRunner, ProblemModel
from sd2app.manual.help import with_help
from sd2app.maps.model import SynthesisModel
from sd2app.session.content import folder_for_command
from sd2app.session.session import Session
from sd2app.widgets.canvas import Themed
from sd2app.widgets.chart import Chart, ChartView, Curve, Mark, Scale
from sd2app.widgets.dialogs import Dialog, accepting
from sd2app.widgets.inputs import option_box
from sd2app.widgets.layouts import column_of, form_of
from sd2app.widgets.panel import copy_button, sentence, show_words, side_by_side
from sd2app.widgets.text import quoted
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


_ABOUT = (
    "Mean velocity and motion of the synthetic map, compared with the radar's at each time offset."
)


class AlignmentDialog(Dialog):
    """A view of :class:`AlignmentModel`; the search begins with it."""

    def __init__(self, model: AlignmentModel, display: Themed, parent: QWidget) -> None:
        super().__init__("Align automatically", parent)
        self._model = model
        self._chart = ChartView(display, "Correlation over offsets", offset_chart(model))
        self._result, self._problem = sentence("", "plain"), sentence("", "warning")
        self._within = option_box(Align, "within", " s", decimals=1)
        self._within.show_value(model.within_s)
        self._within.valueChanged.connect(model.search)
        buttons, self._apply = accepting(self, "Align")
        within = form_of(("Search within ±", side_by_side(self._within)))
        foot = with_help("Align automatically", buttons, copy_button(lambda: model.line, self))
        parts = sentence(_ABOUT), (self._chart, 1), self._result, self._problem, within, foot
        self.setLayout(column_of(*parts, spacing_px=12, margins_px=16))
        self.accepted.connect(model.apply)
        self.finished.connect(lambda _: model.cancel())
        model.changed.connect(self._refresh)
        model.search()
        self._refresh()
        self.resize(560, 440)

    def _refresh(self) -> None:
        model = self._model
        self._chart.show_chart(offset_chart(model))
        show_words(self._result, result_text(model))
        show_words(self._problem, model.problem)
        possible = model.result is not None and not model.problem
        appears = possible and not self._apply.isEnabled()
        self._apply.setEnabled(possible)
        if appears and not self._within.hasFocus():
            # While it could not be pressed, the keyboard went to Cancel.
            self._apply.setFocus(Qt.FocusReason.OtherFocusReason)


def offset_chart(model: AlignmentModel) -> Chart:
    """Correlation over the offsets, with the best one and the present one marked."""
    result, now_s, within_s = model.result, model.now_s, model.within_s
    across = Scale(now_s - within_s, now_s + within_s)
    chart = Chart(across, Scale(0.0, 1.0), "Offset of the radar, s", "correlation")
    if result is None:
        return chart
    points = list(zip(result.offsets_s.tolist(), result.correlation.tolist(), strict=True))
    best = Mark(result.offset_s, result.peak, f"Best: {result.offset_s:.3f} s, {result.peak:.2f}")
    marks = [best]
    if result.other_s is not None:
        other = min(points, key=lambda point: abs(point[0] - result.other_s))
        marks.append(Mark(*other, f"Next best: {other[0]:.3f} s, {other[1]:.2f}"))
    curves = (
        Curve("now", "muted", ((now_s, 0.0), (now_s, 1.0)), width_px=1.0),
        Curve("", "accent", points),
    )
    return Chart(
        across, Scale(0.0, 1.0), chart.below, chart.unit, curves,
        sorted(marks, key=lambda mark: mark.x), best,
    )  # fmt: skip
