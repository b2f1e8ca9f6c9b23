"""Runs of one kind: something new to be set up, or one that is under way or has ended."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from PySide6.QtCore import QSignalBlocker
from PySide6.QtGui import QHideEvent, QShowEvent
from PySide6.QtWidgets import QHBoxLayout, QSizePolicy, QVBoxLayout, QWidget

from sd2app.background.runs import KnownRun, Runs
from sd2app.widgets.inputs import Choice
from sd2app.widgets.panel import outlined

_NEW = "New training"


class RunPanel(QWidget):
    """The list of runs on top; below it the run in view, or the setup of a new one.

    ``tip`` describes the list. ``open_other`` lets the user choose a run of another folder.
    """

    def __init__(
        self,
        runs: Runs[Any],
        tip: str,
        open_other: Callable[[], object] | None = None,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self.setObjectName("page")
        self._runs = runs
        self._list = RunChoice(tip, runs.select, open_other, self)
        self._new = outlined("New", "Set up another training", lambda: runs.select(None), self)
        self._column = QVBoxLayout(self)
        self._column.setContentsMargins(8, 4, 8, 6)
        self._column.setSpacing(8)
        row = QHBoxLayout()
        row.setSpacing(6)
        row.addWidget(self._list, 1)
        row.addWidget(self._new)
        self._column.addLayout(row)

    def fill(self, setup: QWidget, run: QWidget) -> None:
        """Put in the set-up of a new run, and the run in view."""
        self._setup, self._run = setup, run
        for part in (setup, run):
            self._column.addWidget(part)
        self._column.addStretch(1)
        self._runs.changed.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Follow the model."""
        here = self._runs.run.path if self._runs.run is not None else None
        self._setup.setVisible(here is None)
        self._run.setVisible(here is not None)
        self._new.setVisible(here is not None)
        self._list.show_runs(self._runs.known, here)

    def showEvent(self, event: QShowEvent) -> None:
        """Read the runs again, and time a step where that is unknown."""
        super().showEvent(event)
        self._runs.set_watched(True)

    def hideEvent(self, event: QHideEvent) -> None:
        """Note that the panel is hidden."""
        super().hideEvent(event)
        self._runs.set_watched(False)


class RunChoice(Choice):
    """List of runs by their titles, described by ``tip``.

    ``select`` shows a run, or None for a new one; ``open_other`` lets the user choose a run of
    another folder.
    """

    def __init__(
        self,
        tip: str,
        select: Callable[[Path | None], object],
        open_other: Callable[[], object] | None = None,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(tip, parent)
        self._tip, self._select, self._open = tip, select, open_other
        self._paths: list[Path | None] = [None]
        self._here: Path | None = None
        self.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
        self.activated.connect(self._choose)

    def show_runs(self, runs: Sequence[KnownRun], here: Path | None) -> None:
        """List them; ``here`` is in view."""
        paths: list[Path | None] = [None, *(one.path for one in runs)]
        texts = [_NEW, *(one.title for one in runs)]
        if here is not None and here not in paths:
            # Just begun: it is not in the list yet.
            paths.insert(1, here)
            texts.insert(1, here.name)
        if self._open is not None:
            texts.append("Open a run…")
        self.setToolTip(str(here) if here is not None else self._tip)
        with QSignalBlocker(self):
            if texts != [self.itemText(at) for at in range(self.count())]:
                self.clear()
                self.addItems(texts)
            self.setCurrentIndex(paths.index(here))
        self._paths, self._here = paths, here

    def _choose(self, at: int) -> None:
        if at < len(self._paths):
            self._select(self._paths[at])
        elif self._open is not None:
            self._open()
            with QSignalBlocker(self):
                self.setCurrentIndex(self._paths.index(self._here))
