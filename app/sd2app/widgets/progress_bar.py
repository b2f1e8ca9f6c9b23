"""Bar that shows how far some work is."""

from __future__ import annotations

from PySide6.QtWidgets import QProgressBar

_PARTS = 1000


class ProgressBar(QProgressBar):
    """Low bar without a text in it; ``name`` is for screen readers."""

    def __init__(self, name: str, width_px: int | None = None, height_px: int = 14) -> None:
        super().__init__()
        self.setAccessibleName(name)
        self.setTextVisible(False)
        self.setMaximumHeight(height_px)
        if width_px is not None:
            self.setFixedWidth(width_px)

    def show_count(self, done: int, total: int) -> None:
        """Show how much is done; of a total of zero, that something is."""
        self.setRange(0, total)
        self.setValue(done)

    def show_share(self, share: float | None) -> None:
        """Show the share that is done; None: not known, it is busy."""
        if share is None:
            self.show_count(0, 0)
        else:
            self.show_count(round(share * _PARTS), _PARTS)
