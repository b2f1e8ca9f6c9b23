"""Difference of the denoised and the measured map, as shown on screen."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from sd2app.session.display import HeatmapLevels
from sd2app.session.maps import Reading
from sd2app.session.session import Session
from sd2core.figures.maps import matching_gain

_SHOWN = "difference"


class DifferenceModel(QObject):
    """Level of one map minus that of another, on the clock of the first.

    Counted and measured energies have no common unit: the first is taken as strong as the other
    altogether, where both are known. What is below the faintest level shown counts as that level.
    On a linear scale it is the difference of shares of the other's reference.
    """

    changed = Signal()

    def __init__(self, session: Session, parent: QObject) -> None:
        super().__init__(parent)
        self.denoised, self.real = session.maps.denoised, session.maps.real
        self._session = session
        self.wanted = session.settings.stored(_SHOWN, False)  # by the user
        for signal in (self.denoised.changed, self.real.changed, session.display.levels_changed):
            signal.connect(self.changed)

    @property
    def why_not(self) -> str:
        """Reason why there is no difference; empty where there is one."""
        if self.denoised.map is None:
            return "There is no denoised map: choose a model under Model"
        if self.real.map is None:
            return "There is no radar capture to compare with"
        if self.denoised.map.axis != self.real.map.axis:
            return "The two maps have different velocity axes"
        return ""

    @property
    def shown(self) -> bool:
        """True while it is on screen."""
        return self.wanted and not self.why_not

    @property
    def against(self) -> str:
        """Name of the map that is subtracted."""
        return self.real.title.lower()

    @property
    def blank_bins(self) -> tuple[int, ...]:
        """Bins in which one of the two has no information."""
        bins: set[int] = set()
        for track in (self.denoised, self.real):
            if track.map is not None:
                bins |= {*track.map.null_bins, *track.map.unseen_bins}
        return tuple(sorted(bins))

    @property
    def gain(self) -> float:
        """Factor that makes the denoised map as strong as the measured one."""
        tracks, own_s, parts = (self.denoised, self.real), [], []
        for track in tracks:
            if track.map is None:
                return 1.0
            own_s.append(track.map.times_s + track.offset_s)
        start_s, end_s = max(one[0] for one in own_s), min(one[-1] for one in own_s)
        for track, times_s in zip(tracks, own_s, strict=True):
            frames = track.known & (start_s <= times_s) & (times_s <= end_s)
            values = np.delete(track.values[:, frames], self.blank_bins, axis=0)
            # Their frames are of other lengths.
            parts.append(values.sum(axis=1) / max(np.count_nonzero(frames), 1))
        return matching_gain(*parts)

    def set_wanted(self, wanted: bool) -> None:
        """Show or hide it, and store the choice."""
        if wanted != self.wanted:
            self.wanted = wanted
            self._session.settings.set_value(_SHOWN, wanted)
            self.changed.emit()

    def full_scale(self, levels: HeatmapLevels) -> tuple[float, str]:
        """Difference that has the strongest colour, and its unit."""
        low, high, unit = levels.ends
        return high - low, unit

    def shades(
        self, denoised: NDArray[np.float32], real: NDArray[np.float32], levels: HeatmapLevels
    ) -> NDArray[np.float32]:
        """Difference of values (bins, n) each, from −1 to 1; zero where one says nothing."""
        difference = self._shade(denoised, levels) - self.real.shade(real, levels)
        difference[list(self.blank_bins)] = 0.0
        return difference

    def _shade(self, denoised: NDArray[np.float32], levels: HeatmapLevels) -> NDArray[np.float32]:
        return self.real.shade(np.float32(self.gain) * denoised, levels)

    def read(self, time_s: float, velocity_mps: float) -> Reading | None:
        """Cell under the pointer, with both levels."""
        if self.why_not:
            return None
        one = self.denoised.read(time_s, velocity_mps)
        other = self.real.read(time_s, velocity_mps)
        if one is None or other is None:
            return None
        note = one.note or other.note
        levels = self._session.display.levels
        full, unit = self.full_scale(levels)
        shade = float(
            self._shade(np.array(one.value, np.float32), levels)
            - self.real.shade(np.array(other.value, np.float32), levels)
        )
        text = "not defined" if note else f"{full * shade:+.1f} {unit}".replace("-", "−")
        return Reading(
            track=f"Denoised − {self.against}",
            time_s=one.time_s,
            frame=one.frame,
            velocity_mps=one.velocity_mps,
            value=one.value,
            level_db=one.level_db - other.level_db,
            note=note or f"{one.level} − ({other.level}), as strong altogether",
            text=text,
        )
