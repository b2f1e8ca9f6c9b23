"""Dialog that shows how well each time offset of the radar fits, and applies the best."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QWidget

from sd2app.manual.help import with_help
from sd2app.sensor.alignment import AlignmentModel, result_text
from sd2app.widgets.canvas import Themed
from sd2app.widgets.chart import Chart, ChartView, Curve, Mark, Scale
from sd2app.widgets.dialogs import Dialog, accepting
from sd2app.widgets.inputs import option_box
from sd2app.widgets.layouts import column_of, form_of
from sd2app.widgets.panel import copy_button, sentence, show_words, side_by_side
from sd2core.cli.align import Align

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
