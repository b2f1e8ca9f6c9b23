"""Accuracy of maps and its cost in the window."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QWidget

from sd2app.accuracy.measurements import Library, core_accuracy
from sd2app.accuracy.model import AccuracyModel
from sd2app.accuracy.panel import AccuracyPanel
from sd2app.feature import Action, Feature, Shell, report
from sd2app.session.session import Session


class AccuracyFeature(Feature):
    """Choice and measurement of accuracy plans."""

    def __init__(
        self, session: Session, shell: Shell, library: Library | None, parent: QObject
    ) -> None:
        self._session, self._shell = session, shell
        self.model = AccuracyModel(session.jobs, session.settings, library or core_accuracy, parent)
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
