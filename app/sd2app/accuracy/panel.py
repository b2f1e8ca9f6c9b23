"""The Accuracy panel: accepted error, its cost on this scene, and the reasons."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QSizePolicy,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from sd2app.accuracy.model import PRESETS, AccuracyModel
from sd2app.widgets.inputs import NumberBox
from sd2app.widgets.panel import title
from sd2app.widgets.text import milliseconds, number, percent

if TYPE_CHECKING:
    from sd2core.accuracy.results import Reason

from PySide6.QtCore import QSignalBlocker
from PySide6.QtGui import QAction
from PySide6.QtWidgets import (
    QProgressBar,
)

from sd2app.accuracy.measurements import FAMILIES
from sd2app.accuracy.plot import AccuracyPlot
from sd2app.accuracy.text import deviation
from sd2app.session.display import DisplayModel
from sd2app.widgets.inputs import Choice
from sd2app.widgets.panel import rule, sentence
from sd2app.widgets.text import seconds

_FAMILY_TEXT = {"histogram": "counting", "fmcw": "FMCW signal"}
_NO_MESH = "Open a mesh: here you choose how exact its synthetic map is to be, and see the cost."
_NOT_MEASURED = {
    "histogram": "Every plan is a trade of error for time. Measure this scene to see them all: "
    "what each costs per frame on this machine, and how far its map is off.",
    "fmcw": "The radar signal itself, by plans of its own. Measure this scene to compare them "
    "with their reference, the direct sum.",
}


class AccuracyPanel(QWidget):
    """Tolerance, plan in use, plot of all plans, reasons."""

    def __init__(
        self,
        trade: AccuracyModel,
        display: DisplayModel,
        measure: QAction,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self.setObjectName("page")
        self._trade = trade
        layout = QVBoxLayout(self)
        layout.setContentsMargins(8, 6, 8, 6)
        layout.setSpacing(6)
        self._nothing = sentence(_NO_MESH)
        layout.addWidget(self._nothing)
        self._parts = [
            ToleranceRow(trade, self),
            self._use_part(),
            self._plot_part(display, measure),
            self._reason_part(),
        ]
        for part in self._parts:
            layout.addWidget(part)
        layout.addStretch(1)
        for signal in (trade.changed, trade.plan_changed):
            signal.connect(self._refresh)
        self._refresh()

    # --- building -------------------------------------------------------------------------

    def _use_part(self) -> QWidget:
        part, layout = _part(self)
        self._plan = sentence("", "plan")
        self._plan.setAccessibleName("Plan in use")
        self._figures = sentence("", "title")
        self._figures.setAccessibleName("Its error and cost")
        self._warning = sentence("", "warning")
        self._by_tolerance = QToolButton(self)
        self._by_tolerance.setObjectName("outlined")
        self._by_tolerance.setText("Choose by tolerance")
        self._by_tolerance.setToolTip("Let the tolerance rule again instead of the clicked point")
        self._by_tolerance.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self._by_tolerance.clicked.connect(self._trade.choose_by_tolerance)
        for widget in (self._figures, self._plan, self._warning):
            layout.addWidget(widget)
        layout.addWidget(self._by_tolerance, 0, Qt.AlignmentFlag.AlignLeft)
        return part

    def _plot_part(self, display: DisplayModel, measure: QAction) -> QWidget:
        part, layout = _part(self)
        self._empty = sentence("")
        layout.addWidget(self._empty)
        self._plot = AccuracyPlot(self._trade, display, self)
        layout.addWidget(self._plot)
        self._source = sentence("")
        row = QHBoxLayout()
        self._family = Choice("Plans of which signal model", self)
        for family in FAMILIES:
            self._family.addItem(_FAMILY_TEXT[family], family)
        self._family.currentIndexChanged.connect(
            lambda _: self._trade.measured.set_family(self._family.currentData())
        )
        self._measure = QToolButton(self)
        self._measure.setObjectName("outlined")
        self._measure.setToolTip(measure.toolTip())
        self._measure.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self._measure.clicked.connect(measure.trigger)
        self._bar = QProgressBar(self)
        self._bar.setMaximumHeight(14)
        self._bar.setTextVisible(False)
        self._bar.setAccessibleName("Progress of the measurement")
        self._cancel = QToolButton(self)
        self._cancel.setObjectName("outlined")
        self._cancel.setText("Cancel")
        self._cancel.setToolTip("Stop measuring")
        self._cancel.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self._cancel.clicked.connect(self._trade.measured.cancel)
        for widget in (self._family, self._measure, self._bar, self._cancel):
            row.addWidget(widget)
        row.addStretch(1)
        layout.addLayout(row)
        layout.addWidget(self._source)
        return part

    def _reason_part(self) -> QWidget:
        part, layout = _part(self)
        layout.addWidget(rule())
        self._why = title("Why this plan")
        layout.addWidget(self._why)
        self._reasons = ReasonList(self)
        layout.addWidget(self._reasons)
        return part

    # --- showing --------------------------------------------------------------------------

    def _refresh(self) -> None:
        there = self._trade.frames > 0
        self._nothing.setVisible(not there)
        for part in self._parts:
            part.setVisible(there)
        if there:
            self._refresh_use()
            self._refresh_plot()
            self._refresh_reasons()

    def _refresh_use(self) -> None:
        trade, in_use = self._trade, self._trade.in_use
        clicked = in_use is not None and in_use.origin == "clicked"
        warning = ""
        if in_use is None:
            self._figures.setText("Choosing what this scene requires…" if trade.choosing else "–")
            self._plan.setText("Until then occlusion is computed exactly.")
        else:
            off, cost = deviation(in_use.error), milliseconds(in_use.cost_ms)
            clip = seconds(1e-3 * in_use.cost_ms * trade.frames)
            self._figures.setText(f"{off} · {cost}/frame · {clip} the clip")
            self._plan.setText(_unbroken(str(in_use.plan)))
        if in_use is not None and clicked:
            warning = "You clicked this point; the tolerance is not applied."
            if in_use.elsewhere:
                warning += " It was measured with the sensor at another place."
        elif trade.choice is not None and not trade.choice.holds and not trade.choosing:
            warning = (
                f"No plan holds {percent(trade.tolerance)} here. This is the best that can be had."
            )
        self._warning.setText(warning)
        self._warning.setVisible(bool(warning))
        self._by_tolerance.setVisible(clicked)

    def _refresh_plot(self) -> None:
        measured = self._trade.measured
        measurement, job = measured.measurement, measured.job
        with QSignalBlocker(self._family):
            self._family.setCurrentIndex(FAMILIES.index(measured.family))
        self._plot.setVisible(measurement is not None)
        self._empty.setVisible(measurement is None)
        self._empty.setText(_NOT_MEASURED[measured.family])
        self._source.setVisible(measurement is not None)
        if measurement is not None:
            here = f"{len(measurement.frames)} frames, {measurement.machine}"
            self._source.setText(
                f"Measured for another placement, options or machine: {here}"
                if measurement.stale
                else f"Measured on {here}"
            )
            self._source.setObjectName("warning" if measurement.stale else "muted")
            self._source.style().unpolish(self._source)
            self._source.style().polish(self._source)
        self._measure.setText("Measure again" if measurement is not None else "Measure this scene")
        self._measure.setVisible(job is None)
        self._measure.setEnabled(measured.can_measure)
        self._bar.setVisible(job is not None)
        self._cancel.setVisible(job is not None)
        if job is not None:
            self._bar.setRange(0, job.total)
            self._bar.setValue(job.done)

    def _refresh_reasons(self) -> None:
        choice, in_use = self._trade.choice, self._trade.in_use
        shown = choice is not None and in_use is not None and in_use.plan == choice.plan
        around = self._reasons.parentWidget()
        assert around is not None
        around.setVisible(shown)
        if shown and choice is not None:
            self._reasons.show_reasons(choice.reasons)


def _part(parent: QWidget) -> tuple[QWidget, QVBoxLayout]:
    part = QWidget(parent)
    layout = QVBoxLayout(part)
    layout.setContentsMargins(0, 0, 0, 0)
    layout.setSpacing(4)
    return part, layout


def _unbroken(plan: str) -> str:
    """Text without line breaks before separators or between a sign and its number."""
    space = "\N{NO-BREAK SPACE}"
    return plan.replace(" ·", f"{space}·").replace("× ", f"×{space}").replace(" %", f"{space}%")


class ReasonList(QWidget):
    """One line per reason: ✓ is modelled, – is left out."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._shown: tuple[Reason, ...] = ()
        self._grid = QGridLayout(self)
        self._grid.setContentsMargins(0, 0, 0, 0)
        self._grid.setHorizontalSpacing(6)
        self._grid.setVerticalSpacing(4)
        self._grid.setColumnStretch(1, 1)

    def show_reasons(self, reasons: tuple[Reason, ...]) -> None:
        """Replace what is listed; what is modelled comes first."""
        if reasons == self._shown:
            return
        self._shown = reasons
        while (item := self._grid.takeAt(0)) is not None:
            if (widget := item.widget()) is not None:
                widget.deleteLater()
        for row, reason in enumerate(sorted(reasons, key=lambda reason: not reason.modelled)):
            mark = QLabel("✓" if reason.modelled else "–", self)
            sentence = reason.text[:1].upper() + reason.text[1:]
            # A number and its unit stay on one line.
            text = QLabel(sentence.replace(" %", "\N{NO-BREAK SPACE}%"), self)
            text.setWordWrap(True)
            text.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
            text.setAccessibleName(
                f"{'Modelled' if reason.modelled else 'Left out'}: {reason.text}"
            )
            for label in (mark, text):
                label.setObjectName("plain" if reason.modelled else "muted")
            self._grid.addWidget(mark, row, 0, Qt.AlignmentFlag.AlignTop)
            self._grid.addWidget(text, row, 1)


class ToleranceRow(QWidget):
    """Row of the panel that sets the tolerance: the accepted error of the map."""

    def __init__(self, trade: AccuracyModel, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._trade = trade
        self._box = NumberBox(
            0.05,
            50.0,
            " %",
            "Tolerance: how much of the map may differ from the reference, after smoothing",
            decimals=2,
            step=0.5,
        )
        self._box.valueChanged.connect(lambda value: trade.set_tolerance(value / 100))
        head = QHBoxLayout()
        head.addWidget(title("Tolerance"))
        head.addStretch(1)
        head.addWidget(self._box)
        row = QHBoxLayout()
        row.setSpacing(4)
        self._presets: dict[float, QToolButton] = {}
        for tolerance in PRESETS:
            button = QToolButton(self)
            button.setObjectName("preset")
            button.setCheckable(True)
            button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
            button.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
            button.clicked.connect(lambda _=False, value=tolerance: trade.set_tolerance(value))
            row.addWidget(button, 1)
            self._presets[tolerance] = button
        self._meaning = QLabel(self)
        self._meaning.setObjectName("muted")
        self._meaning.setWordWrap(True)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(4)
        layout.addLayout(head)
        layout.addLayout(row)
        layout.addWidget(self._meaning)
        trade.changed.connect(self._refresh)
        self._refresh()

    def _refresh(self) -> None:
        trade = self._trade
        self._box.show_value(100 * trade.tolerance)
        clicked = trade.in_use is not None and trade.in_use.origin == "clicked"
        known = trade.measured.counting is not None
        for tolerance, button in self._presets.items():
            cost_ms = trade.cost_at(tolerance)
            cost = number(cost_ms) if cost_ms is not None else "–"
            # What a tolerance costs stands under it once the scene has been measured.
            button.setText(f"{percent(tolerance)}\n{cost}" if known else percent(tolerance))
            button.setChecked(not clicked and abs(tolerance - trade.tolerance) < 1e-9)
            price = "measure this scene to see its cost"
            if known:
                price = "no plan holds it"
            if cost_ms is not None:
                price = f"{milliseconds(cost_ms)} per frame here"
            button.setToolTip(f"Accept an error of {percent(tolerance)}: {price}")
            button.setAccessibleName(button.toolTip())
        here = " Under each its cost here, ms per frame." if known else ""
        self._meaning.setText(
            f"{percent(trade.tolerance)}: the differences from the reference map add up to"
            f" {percent(trade.tolerance)} of it.{here}"
        )
