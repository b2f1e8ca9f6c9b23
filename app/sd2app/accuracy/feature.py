"""Accuracy of maps and its cost: the panel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtGui import QAction, QShowEvent
from PySide6.QtWidgets import QLabel, QSizePolicy, QToolButton, QWidget

from sd2app.accuracy.measurements import Library, chosen_sentence, core_accuracy, legend
from sd2app.accuracy.model import PRESETS, AccuracyModel
from sd2app.accuracy.plot import AccuracyPlot
from sd2app.feature import Action, Feature, Shell, report
from sd2app.session.display import DisplayModel
from sd2app.session.session import Session
from sd2app.widgets.inputs import Choice, NumberBox
from sd2app.widgets.layouts import STRETCH, column_of, grid_of, pane, row_of
from sd2app.widgets.panel import Fold, ProgressBar, outlined, rule, say, sentence, show_words, title
from sd2app.widgets.text import milliseconds, number
from sd2core.files.tables import capitalised
from sd2core.numerics.map_accuracy import percent

if TYPE_CHECKING:
    from sd2core.accuracy.results import Reason


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

    def __init__(self, accuracy: AccuracyModel, display: DisplayModel, measure: QAction) -> None:
        super().__init__()
        self.setObjectName("page")
        self._accuracy = accuracy
        self._nothing = sentence(_NO_MESH)
        self._tolerance = ToleranceRow(accuracy, self)
        self._parts = (
            self._tolerance,
            # Above what a click on it says, so that it stays where it is.
            self._plot_part(display, measure),
            self._use_part(),
            self._reason_part(),
        )
        self.setLayout(
            column_of(self._nothing, *self._parts, STRETCH, spacing_px=6, margins_px=(8, 6, 8, 6))
        )
        for signal in (accuracy.changed, accuracy.plan_changed):
            signal.connect(self._follow)
        self._refresh()

    def showEvent(self, event: QShowEvent) -> None:
        """Bring up to date what drags, which change much of it, left alone while it was hidden."""
        super().showEvent(event)
        self._refresh()

    def _use_part(self) -> QWidget:
        self._chosen = sentence("", "plan")
        self._chosen.setAccessibleName("Plan in use, its error and cost")
        self._warning = sentence("", "warning")
        self._by_tolerance = outlined(
            "Choose by tolerance",
            "Let the tolerance rule again instead of the clicked point",
            self._accuracy.choose_by_tolerance,
            self,
        )
        below = row_of(self._by_tolerance, STRETCH)
        return pane(self._chosen, self._warning, below, spacing_px=4)

    def _plot_part(self, display: DisplayModel, measure: QAction) -> QWidget:
        measured = self._accuracy.measured
        self._empty, self._legend, self._source = sentence(""), sentence(""), sentence("")
        self._legend.setAccessibleName("Legend of the plot")
        self._plot = AccuracyPlot(self._accuracy, display)
        self._family = Choice(
            "Plans of which signal model", self, _FAMILY_TEXT, measured.set_family
        )
        self._measure = outlined("", measure.toolTip(), measure.trigger, self)
        self._bar = ProgressBar("Progress of the measurement")
        self._cancel = outlined("Cancel", "Stop measuring", measured.cancel, self)
        controls = row_of(self._family, self._measure, self._bar, self._cancel, STRETCH)
        return pane(self._empty, self._plot, self._legend, controls, self._source, spacing_px=4)

    def _reason_part(self) -> QWidget:
        self._reasons = ReasonList(self)
        tip = "What this scene requires of the plan, setting by setting"
        fold = Fold("Why this plan", tip, self._reasons, self)
        return pane(rule(), row_of(fold, STRETCH), self._reasons, spacing_px=4)

    def _follow(self) -> None:
        if self.isVisible():
            self._refresh()

    def _refresh(self) -> None:
        has_mesh = self._accuracy.frames > 0
        self._nothing.setVisible(not has_mesh)
        for part in self._parts:
            part.setVisible(has_mesh)
        if has_mesh:
            self._tolerance.refresh()
            self._refresh_use()
            self._refresh_plot()
            choice, in_use = self._accuracy.choice, self._accuracy.in_use
            shown = choice is not None and in_use is not None and in_use.plan == choice.plan
            self._parts[-1].setVisible(shown)
            if shown and choice is not None:
                self._reasons.show_reasons(choice.reasons)

    def _refresh_use(self) -> None:
        accuracy, in_use = self._accuracy, self._accuracy.in_use
        clicked = in_use is not None and in_use.clicked
        warning = ""
        if in_use is None:
            doing = "Choosing what this scene requires. " if accuracy.choosing else ""
            self._chosen.setText(f"{doing}So far occlusion is computed exactly.")
        else:
            self._chosen.setText(_unbroken(chosen_sentence(in_use, accuracy.frames)))
            self._chosen.setToolTip(str(in_use.plan))
        if in_use is not None and clicked:
            warning = "You clicked this point; the tolerance is not applied."
            if in_use.elsewhere:
                warning += " It was measured with the sensor at another place."
        elif accuracy.choice is not None and not accuracy.choice.holds and not accuracy.choosing:
            held = percent(accuracy.tolerance)
            warning = f"No plan holds {held} here. This is the best that can be had."
        show_words(self._warning, warning)
        self._by_tolerance.setVisible(clicked)

    def _refresh_plot(self) -> None:
        measured = self._accuracy.measured
        measurement, job = measured.measurement, measured.job
        self._family.show_value(measured.family)
        self._empty.setText(_NOT_MEASURED[measured.family])
        self._empty.setVisible(measurement is None)
        self._measure.setText("Measure this scene" if measurement is None else "Measure again")
        self._plot.setVisible(measurement is not None)
        self._source.setVisible(measurement is not None)
        words = ""
        if measurement is not None:
            in_use = self._accuracy.in_use is not None
            words = legend(measurement, self._accuracy.tolerance, in_use=in_use)
            self._plot.refresh()
        show_words(self._legend, words)
        if measurement is not None:
            here = f"{len(measurement.frames)} frames, {measurement.machine}"
            text, role = f"Measured on {here}", "muted"
            if measurement.stale:
                text = f"Measured for another placement, options or machine: {here}"
                role = "warning"
            say(self._source, text, role)
        self._measure.setVisible(job is None)
        self._measure.setEnabled(measured.can_measure)
        self._bar.setVisible(job is not None)
        self._cancel.setVisible(job is not None)
        if job is not None:
            self._bar.show_count(job.done, job.total)


def _unbroken(plan: str) -> str:
    """Text without line breaks before separators or between a sign and its number."""
    space = "\N{NO-BREAK SPACE}"
    return plan.replace(" ·", f"{space}·").replace("× ", f"×{space}").replace(" %", f"{space}%")


class ReasonList(QWidget):
    """One line per reason: ✓ is modelled, – is left out."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._shown: tuple[Reason, ...] = ()
        self._grid = grid_of(gaps_px=(6, 4))
        self.setLayout(self._grid)

    def show_reasons(self, reasons: tuple[Reason, ...]) -> None:
        """Replace what is listed; what is modelled comes first."""
        if reasons == self._shown:
            return
        self._shown = reasons
        while (item := self._grid.takeAt(0)) is not None:
            if (widget := item.widget()) is not None:
                widget.deleteLater()
        for line, reason in enumerate(sorted(reasons, key=lambda reason: not reason.modelled)):
            role = "plain" if reason.modelled else "muted"
            mark = QLabel("✓" if reason.modelled else "–", self)
            mark.setObjectName(role)
            words = capitalised(reason.text)
            # A number and its unit stay on one line.
            text = sentence(words.replace(" %", "\N{NO-BREAK SPACE}%"), role)
            text.setAccessibleName(
                f"{'Modelled' if reason.modelled else 'Left out'}: {reason.text}"
            )
            self._grid.addWidget(mark, line, 0, Qt.AlignmentFlag.AlignTop)
            self._grid.addWidget(text, line, 1)


class ToleranceRow(QWidget):
    """Row of the panel that sets the tolerance: the accepted error of the map."""

    def __init__(self, accuracy: AccuracyModel, parent: QWidget) -> None:
        super().__init__(parent)
        self._accuracy = accuracy
        tip = "Tolerance: how much of the map may differ from the reference, after smoothing"
        self._box = NumberBox(0.05, 50.0, " %", tip, step=0.5)
        self._box.valueChanged.connect(lambda value: accuracy.set_tolerance(value / 100))
        self._presets: dict[float, QToolButton] = {}
        for tolerance in PRESETS:
            self._presets[tolerance] = button = QToolButton(self)
            button.setObjectName("preset")
            button.setCheckable(True)
            button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
            button.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
            button.clicked.connect(lambda _=False, value=tolerance: accuracy.set_tolerance(value))
        self._meaning = sentence("")
        top = row_of(title("Tolerance"), STRETCH, self._box)
        presets = row_of(*((button, 1) for button in self._presets.values()), spacing_px=4)
        self.setLayout(column_of(top, presets, self._meaning, spacing_px=4, margins_px=0))

    def refresh(self) -> None:
        """Show the tolerance, and what each costs."""
        accuracy = self._accuracy
        self._box.show_value(100 * accuracy.tolerance)
        clicked = accuracy.in_use is not None and accuracy.in_use.clicked
        known = accuracy.measured.counting is not None
        for tolerance, button in self._presets.items():
            cost_ms = accuracy.cost_at(tolerance)
            cost = number(cost_ms) if cost_ms is not None else "–"
            # What a tolerance costs stands under it once the scene has been measured.
            button.setText(f"{percent(tolerance)}\n{cost}" if known else percent(tolerance))
            button.setChecked(not clicked and abs(tolerance - accuracy.tolerance) < 1e-9)
            price = "measure this scene to see its cost"
            if known:
                price = "no plan holds it"
            if cost_ms is not None:
                price = f"{milliseconds(cost_ms)} per frame here"
            button.setToolTip(f"Accept an error of {percent(tolerance)}: {price}")
            button.setAccessibleName(button.toolTip())
        here = " Under each its cost here, ms per frame." if known else ""
        self._meaning.setText(
            f"{percent(accuracy.tolerance)}: the differences from the reference map add up to"
            f" {percent(accuracy.tolerance)} of it.{here}"
        )


class AccuracyFeature(Feature):
    """Choice and measurement of accuracy plans."""

    def __init__(self, session: Session, shell: Shell, library: Library | None) -> None:
        self._session, self._shell = session, shell
        self.model = AccuracyModel(
            session.jobs, session.settings, library or core_accuracy, session.parent
        )
        report(shell, self.model)
        self.changing = (self.model.plan_changed, self.model.measured.changed)
        self.closing = (self.model,)

    def actions(self) -> Sequence[Action]:
        """Panel and measurement."""
        return (
            Action(
                "show_trade", "View", "Accuracy panel", ("T",),
                "How exact the synthetic map is to be, and what that costs",
                lambda: self._shell.bring_up("Accuracy"),
            ),
            Action(
                "measure", "View", "Measure this scene", ("Ctrl+M",),
                "Measure error and cost of every plan with the sensor where it is; takes a while",
                self.measure, lambda: self.model.measured.can_measure,
            ),
        )  # fmt: skip

    def measure(self) -> None:
        """Measure every plan, with the panel in view."""
        self._shell.bring_up("Accuracy")
        self.model.measured.measure()

    def panels(self) -> Mapping[str, QWidget]:
        """The panel at the side."""
        measure = self._shell.action("measure")
        return {"Accuracy": AccuracyPanel(self.model, self._session.display, measure)}
