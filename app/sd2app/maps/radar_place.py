"""Notice that the synthetic map is seen from elsewhere than the radar's."""

from __future__ import annotations

import math

from PySide6.QtCore import Qt
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QToolButton

from sd2app.session.session import Session

_LEAST_M = 0.05
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
        self._text = ""

    def follow(self) -> bool:
        """Say where the sensor stands; True if that changed."""
        maps = self._session.maps
        away_m = math.hypot(*self._session.sensor.sensor.position_m)
        apart = maps.synthetic.map is not None and maps.real.map is not None and away_m >= _LEAST_M
        text = f"Synthetic: seen from {away_m:.1f} m beside the radar · go there" if apart else ""
        if text == self._text:
            return False
        self._text = text
        self.setText(text)
        self.setVisible(bool(text))
        return True
