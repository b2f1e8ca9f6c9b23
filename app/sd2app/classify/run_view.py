"""Progress, results and actions of one training or comparison of classifiers."""

from __future__ import annotations

from functools import partial

from PySide6.QtWidgets import QHBoxLayout, QLabel, QProgressBar, QVBoxLayout, QWidget

from sd2app.background.run_monitor import UNDER_WAY
from sd2app.classify.curve import ClassCurve
from sd2app.classify.questions import ClassAsks
from sd2app.classify.run import ClassRun
from sd2app.classify.run_text import facts, headline, note, time_text
from sd2app.classify.training import ClassTraining
from sd2app.session.display import DisplayModel
from sd2app.widgets.panel import FactRows, outlined, sentence

_PARTS = 1000


class ClassRunView(QWidget):
    """A view of :class:`ClassRun`."""

    def __init__(
        self,
        training: ClassTraining,
        display: DisplayModel,
        asks: ClassAsks,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._training = training
        self._headline = QLabel(self)
        self._headline.setObjectName("title")
        self._headline.setWordWrap(True)
        self._headline.setAccessibleName("How it stands")
        self._bar = QProgressBar(self)
        self._bar.setMaximumHeight(14)
        self._bar.setTextVisible(False)
        self._bar.setAccessibleName("How far it is")
        self._time, self._reason = sentence(""), sentence("", "warning")
        self._note, self._about = sentence(""), sentence("")
        self._curve = ClassCurve(training, display, self)
        self._facts = FactRows(2, at_the_edge=False, parent=self)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(6)
        for widget in (self._headline, self._bar, self._time):
            layout.addWidget(widget)
        layout.addLayout(self._button_row(asks))
        for part in (self._reason, self._note, self._curve, self._facts, self._about):
            layout.addWidget(part)
        training.changed.connect(self._refresh)
        self._refresh()

    def _button_row(self, asks: ClassAsks) -> QHBoxLayout:
        self._buttons = {
            "use": outlined(
                "Use this model", "Say with it which gesture each frame shows",
                asks.use_model, self,
            ),
            "show": outlined(
                "Show result", "Both confusion matrices, and the learning curve",
                asks.show_result, self,
            ),
            "stop": outlined(
                "Stop", "End it now and keep what there is",
                partial(self._training.tell, "stop"), self,
            ),
            "cancel": outlined(
                "Cancel", "End it now and delete what it made",
                partial(self._training.tell, "cancel"), self,
            ),
            "again": outlined("Resume", "Train what is missing", asks.again, self),
            "delete": outlined("Delete…", "Delete it with what it made", asks.delete, self),
        }  # fmt: skip
        for name in ("use", "show"):
            self._buttons[name].setObjectName("primary")
        row = QHBoxLayout()
        row.setSpacing(6)
        for button in self._buttons.values():
            row.addWidget(button)
        row.addStretch(1)
        return row

    def _refresh(self) -> None:
        run = self._training.run
        if run is None:
            return
        phase, history = run.phase, run.history
        under_way = phase in UNDER_WAY
        self._headline.setText(headline(run))
        self._bar.setVisible(under_way)
        share = history.share
        # Without a maximum the bar says that it is busy.
        self._bar.setRange(0, 0 if share is None else _PARTS)
        if share is not None:
            self._bar.setValue(round(share * _PARTS))
        for label, text in (
            (self._time, time_text(run)),
            (self._reason, run.text),
            (self._note, note(run)),
        ):
            label.setText(text)
            label.setVisible(bool(text))
        self._curve.setVisible(not run.compares and bool(history.losses))
        self._facts.show_facts(facts(run))
        self._about.setText(run.folder.path.name)
        self._about.setToolTip(str(run.folder.path))
        self._refresh_buttons(run, under_way)

    def _refresh_buttons(self, run: ClassRun, under_way: bool) -> None:
        ended, has_result = not under_way, run.result is not None
        shown = {
            "use": ended and has_result and not run.compares and not self._training.in_use,
            "show": ended and has_result and run.compares,
            "stop": under_way,
            "cancel": under_way,
            "again": ended and run.compares and run.phase != "finished",
            "delete": ended,
        }
        for name, button in self._buttons.items():
            button.setVisible(shown[name])
        waiting = run.phase in ("stopping", "cancelling") or run.history.saving
        self._buttons["stop"].setEnabled(not waiting)
        self._buttons["cancel"].setEnabled(run.phase != "cancelling")
