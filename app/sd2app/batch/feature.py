"""Batches over many recordings and placements: the window, and the batch in view."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QAbstractItemView,
    QGridLayout,
    QHeaderView,
    QLabel,
    QPlainTextEdit,
    QTextBrowser,
    QWidget,
)

from sd2app.batch.model import BatchModel
from sd2app.batch.questions import BatchQuestions
from sd2app.batch.run import BatchMonitor, batch_time_text, headline, step_facts
from sd2app.batch.setup_view import BatchSetupView
from sd2app.denoise.model import DenoiseModel
from sd2app.feature import Action, Feature, Shell, report
from sd2app.manual.help import help_button
from sd2app.sensor.placements import PlacementsModel
from sd2app.session.session import Session
from sd2app.widgets.dialogs import Dialog, take_room
from sd2app.widgets.layouts import STRETCH, column_of, grid_of, pane, row_of
from sd2app.widgets.panel import (
    ElidedLabel,
    InnerPages,
    ProgressBar,
    outlined,
    sentence,
    show_words,
)
from sd2app.widgets.run_panel import Button, RunPanel, RunView, RunWords
from sd2app.widgets.table import RecordTable
from sd2core.runs.command_folder import COMMAND

_MAX_STEPS = 6
_NO_DATASET = "No data set has been exported here yet."
_FAILURES, _FAILURES_PAGE = "Failures", 2
_WORDS = RunWords(
    headline, lambda run: "", batch_time_text, "batch", "End it now; what is done stays",
    is_deleted=False,
)  # fmt: skip


class BatchRunView(RunView[BatchMonitor]):
    """Steps and failures of a batch, its log, and its results."""

    def __init__(self, batch: BatchModel, asks: BatchQuestions) -> None:
        buttons = (
            # First, so that no other button comes to where it was.
            Button(
                "folder", "Open folder", "Show the results as files", asks.open_folder,
                lambda run: True,
            ),
            Button(
                "resume", "Go on", "Do what is missing or new", asks.resume,
                lambda run: run.resumable,
            ),
        )  # fmt: skip
        super().__init__(batch, asks.shell, _WORDS, buttons)
        self._batch, self._asks = batch, asks
        self._shown_card: str | None = None
        self._where = ElidedLabel(self, "muted")
        self.add(self._bars(), self._where, (self._pages(), 1))

    def _bars(self) -> QGridLayout:
        self._steps: list[tuple[QLabel, ProgressBar, QLabel]] = []
        for _ in range(_MAX_STEPS):
            widgets = (QLabel(self), ProgressBar("", height_px=12), sentence(""))
            widgets[2].setWordWrap(False)
            self._steps.append(widgets)
        return grid_of(*self._steps, gaps_px=(12, 4))

    def _pages(self) -> InnerPages:
        self._failures = _text("What could not be done")
        self._log = _text("Log")
        self._card = QTextBrowser(self)
        self._card.setAccessibleName("What the data set holds")
        self._table = _result_table(self._open)
        self._table.setModel(self._batch.results)
        self._open_result = outlined(
            "Open in the window",
            "The recording, with the sensor where this map was made from",
            self._open,
            self,
        )
        self._no_results = sentence("What was made is listed once the batch has come to its end.")
        open_row = row_of(self._open_result, STRETCH)
        results = pane(self._no_results, (self._table, 1), open_row, spacing_px=6)
        self._inner = InnerPages(
            ("Results", "The maps that were made", results),
            ("Data set", "What was exported to learn from", self._card),
            (_FAILURES, "Tasks that could not be done, and why", self._failures),
            ("Log", "What happened, as it happened", self._log),
        )
        return self._inner

    def show_made(self, run: BatchMonitor) -> None:
        """Follow steps, failures, log and results."""
        results, failures = self._batch.results, run.history.failures
        self._where.setText(str(run.path))
        self._buttons["resume"].setText("Run again" if run.phase == "finished" else "Go on")
        self._buttons["folder"].setEnabled(run.path.is_dir())
        self._show_steps(run)
        _show(self._failures, "\n\n".join(failures) or "None.")
        count = len(failures)
        self._inner.name_page(_FAILURES_PAGE, f"{_FAILURES} ({count})" if count else _FAILURES)
        _show(self._log, run.facts or "Nothing was noted.")
        if results.card != self._shown_card:
            self._shown_card = results.card
            self._card.setMarkdown(results.card or _NO_DATASET)
        self._no_results.setVisible(not results.rows)
        self._table.setVisible(bool(results.rows))
        self._open_result.setVisible(bool(results.rows))

    def _show_steps(self, run: BatchMonitor) -> None:
        facts = step_facts(run)
        for row, (name, bar, words) in enumerate(self._steps):
            shown = row < len(facts)
            for widget in (name, bar, words):
                widget.setVisible(shown)
            if shown:
                text, done, total, count_text = facts[row]
                name.setText(text)
                bar.show_count(done, total)
                bar.setAccessibleName(f"{text}: {count_text}")
                words.setText(count_text)

    def _open(self) -> None:
        index = self._table.currentIndex()
        if index.isValid():
            self._asks.open_result(index.row())
        elif self._batch.results.rows:
            self._asks.open_result(0)


def _result_table(open_row: Callable[[], None]) -> RecordTable:
    """Table of results, where Return or a double click opens a row."""
    table = RecordTable("Results")
    table.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
    table.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
    table.setWordWrap(False)
    header = table.horizontalHeader()
    header.setStretchLastSection(True)
    header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
    header.setResizeContentsPrecision(50)
    table.activated.connect(lambda _: open_row())
    return table


def _text(name: str) -> QPlainTextEdit:
    text = QPlainTextEdit()
    text.setReadOnly(True)
    text.setAccessibleName(name)
    text.setTextInteractionFlags(
        Qt.TextInteractionFlag.TextSelectableByMouse
        | Qt.TextInteractionFlag.TextSelectableByKeyboard
    )
    return text


def _show(widget: QPlainTextEdit, text: str) -> None:
    """Set a text that differs from the present one, which keeps its scroll position."""
    if text != widget.toPlainText():
        widget.setPlainText(text)


class BatchWindow(Dialog):
    """A new batch, or the one in view; the rest of the program can be used meanwhile."""

    def __init__(self, batch: BatchModel, asks: BatchQuestions, parent: QWidget) -> None:
        super().__init__("Batch", parent)
        self._warning = sentence("", "warning")
        self._warning.hide()
        runs = RunPanel(
            batch,
            BatchSetupView(batch, asks, self),
            BatchRunView(batch, asks),
            "The batch in view; one that lies elsewhere can be opened",
            ("Open batch…", asks.open_batch),
            new="New batch",
            guide=help_button("Batch", self),
        )
        column = column_of(self._warning, (runs, 1), spacing_px=4, margins_px=(8, 8, 8, 10))
        self.setLayout(column)
        take_room(self, 620, 640)

    def warn(self, text: str) -> None:
        """Say what went wrong, or nothing any more."""
        show_words(self._warning, text)


class BatchFeature(Feature):
    """Window in which a batch is set up, followed and its results opened."""

    def __init__(
        self,
        session: Session,
        shell: Shell,
        placements: PlacementsModel,
        denoiser: DenoiseModel,
        command: Sequence[str] | None,
    ) -> None:
        self.model = BatchModel(session.settings, session.parent, command or COMMAND)
        self.running = (self.model,)
        report(shell, self.model)
        self._shell = shell
        self._questions = BatchQuestions(self.model, session, shell, placements, denoiser)
        self._questions.warned.connect(self._say)
        self._window: BatchWindow | None = None

    def show(self) -> None:
        """Bring up the batch in view, or set up another as the open recording is."""
        if self._window is None:
            self._window = BatchWindow(self.model, self._questions, self._shell.dialog_parent)
        if not self._window.isVisible():
            self._questions.begin_as_open()
        self._window.show()
        self._window.raise_()
        self._window.activateWindow()

    def show_with_placements(self) -> None:
        """Set up a batch with the places that are planned in the open recording."""
        self.show()
        self._questions.place_as_planned()

    def _say(self, text: str) -> None:
        """Show a sentence in the batch window if it is open, else in the main window."""
        if self._window is not None and self._window.isVisible():
            self._window.warn(text)
        elif text:
            self._shell.warn(text)

    def actions(self) -> Sequence[Action]:
        """The window of the batch."""
        return (
            Action(
                "batch", "File", "Batch…", ("Ctrl+B",),
                "Fit, synthesise, denoise and export many recordings from many places, in the"
                " background",
                self.show,
            ),
        )  # fmt: skip

    def close(self) -> None:
        """Close the window of the batch, which goes on."""
        if self._window is not None:
            self._window.close()
        self.model.close()
