"""The list of runs over a panel: something new, what lies on disk, and what else there is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from PySide6.QtCore import QSignalBlocker
from PySide6.QtWidgets import QSizePolicy, QWidget

from sd2app.widgets.inputs import Choice

_NEW = "New training"


class RunChoice(Choice):
    """Runs by their titles.

    Parameters
    ----------
    tip : str
        What is in the list.
    select : callable
        Shows a run, or None for a new one.
    open_other : callable, optional
        Lets the user choose a run that lies elsewhere.
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

    def show_runs(self, runs: Sequence[tuple[Path, str]], here: Path | None) -> None:
        """List them; ``here`` is in view."""
        paths: list[Path | None] = [None, *(path for path, _ in runs)]
        texts = [_NEW, *(text for _, text in runs)]
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
