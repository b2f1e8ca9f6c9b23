"""Notice that the synthetic map is seen from elsewhere than the radar's."""

from __future__ import annotations

import math

from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QAction, QResizeEvent
from PySide6.QtWidgets import QToolButton

from sd2app.session.session import Session

_MIN_M = 0.05
"""A sensor as near as this sees what the radar sees."""


class RadarPlaceBadge(QToolButton):
    """Says how far the virtual sensor is from the radar, which stands at the camera; goes there."""

    def __init__(self, session: Session, go: QAction) -> None:
        super().__init__()
        self._session = session
        self.setObjectName("outlined")
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.setToolTip("Put the virtual sensor where the radar stands: at the camera")
        self.clicked.connect(go.trigger)
        self.hide()
        self._words: tuple[str, ...] = ()  # the longest first

    def follow(self) -> bool:
        """Say where the sensor stands; True if that changed."""
        maps = self._session.maps
        away_m = math.hypot(*self._session.sensor.sensor.position_m)
        apart = maps.synthetic.map is not None and maps.real.map is not None and away_m >= _MIN_M
        go = "Go to the radar's place"
        words: tuple[str, ...] = (
            f"Synthetic: seen from {away_m:.1f} m beside the radar · {go}",
            f"Seen from {away_m:.1f} m beside the radar · {go}",
            f"{go}, {away_m:.1f} m away",
            go,
            "To the radar",
        )
        if not apart:
            words = ()
        if words == self._words:
            return False
        self._words = words
        self._choose()
        self.setVisible(apart)
        return True

    def sizeHint(self) -> QSize:
        """Size of the longest words."""
        longest = self._words[0] if self._words else ""
        return super().sizeHint() + QSize(self._advance(longest) - self._advance(self.text()), 0)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Say as much as there is room for."""
        super().resizeEvent(event)
        self._choose()

    def _choose(self) -> None:
        room_px = self.width() - super().sizeHint().width() + self._advance(self.text())
        fitting = [words for words in self._words if self._advance(words) <= room_px]
        self.setText(next(iter(fitting or self._words[-1:]), ""))
        self.setAccessibleName(self._words[0] if self._words else "")

    def _advance(self, words: str) -> int:
        return self.fontMetrics().horizontalAdvance(words)
