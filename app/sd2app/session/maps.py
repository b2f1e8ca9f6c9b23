"""The Doppler maps that stand one above the other, and the parts of the body they are shown of."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from sd2app.session.display import HeatmapLevels
from sd2core.cli.recording_maps import MapName
from sd2core.maps import OF, CellUncertainty, DopplerMap
from sd2core.mesh.presence import runs
from sd2core.mesh.vertex_parts import PARTS

UNCERTAIN_SHARE = 0.5
"""Relative deviation from which a cell counts as uncertain."""

_FAINT_SHARE = 0.05
"""Share of the highest level below which nothing shows on a linear scale."""

_SHOWS_SHARE = 0.1
"""Deviation, as share of the highest level, that matters where nothing shows."""


@dataclass(frozen=True)
class Reading:
    """One cell of a map under the pointer.

    ``deviation`` is how far from the value the truth may be, where that is known;
    ``text`` stands in place of level and value; ``range_m`` is that of the body, where known.
    """

    track: str
    time_s: float
    frame: int
    velocity_mps: float
    value: float
    level_db: float
    note: str = ""
    deviation: float | None = None
    text: str = ""
    range_m: float | None = None

    @property
    def level(self) -> str:
        """Level with its unit."""
        return f"{self.level_db:.1f} dB".replace("-", "−") if self.value > 0 else "−∞ dB"


class MapModel(QObject):
    """One Doppler map on the shared time axis.

    ``reference`` is the value shown as 0 dB. It is set when a recording is
    opened and stays, so that a placement farther away looks weaker. ``revision`` counts
    how often the map was set, also to one whose values changed in place. ``name`` is what commands
    call it. Others read the attributes; the methods change them.
    """

    changed = Signal()
    came_or_went = Signal()  # there is a map where there was none, or the reverse
    status_changed = Signal()

    def __init__(
        self, title: str, parent: QObject | None = None, name: MapName | None = None
    ) -> None:
        super().__init__(parent)
        self.title, self.name = title, name
        self.revision = 0
        self.map: DopplerMap | None = None  # on its own clock, without the offset
        self.covered: NDArray[np.bool_] | None = None  # (frames,): is computed; None: all are
        self.key: Hashable = None  # of all that the map was made from; None until it is final
        self.uncertainty: CellUncertainty | None = None  # None: unknown or switched off
        self.offset_s = 0.0  # start of the map's clock on the recording's clock
        self.reference = 1.0  # value shown as 0 dB
        self.by_hand = False  # the user chose that value
        self.parts: tuple[str, ...] = ()  # shown alone where their maps are known
        self.growing = False  # frames are being added at its end
        self.awaited = False  # is going to be made: its place is kept while it is not there
        self.status = ""  # quality of the map in a few words, e.g. "exact"

    @property
    def values(self) -> NDArray[np.float32]:
        """Values on screen, (bins, frames): the map's, or of some parts of the body or people."""
        assert self.map is not None
        split = [*self.split.values()]
        return np.sum(split, axis=0) if split else self.map.values

    @property
    def split(self) -> dict[str, NDArray[np.float32]]:
        """Values (bins, frames) of each part of the body or person that is shown alone."""
        limbs = None if self.map is None else self.map.limbs
        if limbs is None:
            return {}
        values = {one: limbs.shown(one) for one in self.parts}
        return {one: its for one, its in values.items() if its is not None}

    @property
    def known(self) -> NDArray[np.bool_]:
        """Frames that hold something, (frames,)."""
        if self.covered is not None:
            return self.covered
        return np.ones(0 if self.map is None else len(self.map.timebase), bool)

    @property
    def gaps_s(self) -> tuple[tuple[float, float], ...]:
        """Stretches without a person, half-open on the recording's clock."""
        present = None if self.map is None else self.map.present
        return () if present is None else self._seconds(runs(~present))

    @property
    def covered_s(self) -> tuple[tuple[float, float], ...]:
        """Stretches that are computed already, half-open on the recording's clock."""
        return self._seconds(runs(self.known))

    def _seconds(self, stretches: Iterable[tuple[int, int]]) -> tuple[tuple[float, float], ...]:
        if self.map is None:
            return ()
        edges_s, offset_s = self.map.timebase.edges_s, self.offset_s
        return tuple(
            (float(edges_s[start]) + offset_s, float(edges_s[stop]) + offset_s)
            for start, stop in stretches
        )

    @property
    def strongest_db(self) -> float:
        """Level of the strongest bin of the map, minus infinity for an empty one."""
        empty = self.map is None
        return -np.inf if empty else self.levels_db(self.values.max(keepdims=True)).item()

    def set_map(
        self,
        doppler_map: DopplerMap | None,
        covered: NDArray[np.bool_] | None = None,
        key: Hashable = None,
    ) -> None:
        """Show another map, or none."""
        came_or_went = (self.map is None) != (doppler_map is None)
        self.revision += 1
        self.map = doppler_map
        self.covered = covered
        self.key = key
        self.uncertainty = None
        self.changed.emit()
        if came_or_went:
            self.came_or_went.emit()

    def key_with(self, *maker: Hashable) -> Hashable:
        """Key of what a maker makes of the map; None until the map is final."""
        return None if self.key is None else (self.key, *maker)

    def set_awaited(self, awaited: bool) -> None:
        """Say if the map is going to be made."""
        if awaited != self.awaited:
            self.awaited = awaited
            self.changed.emit()

    def set_uncertainty(self, uncertainty: CellUncertainty | None) -> None:
        """Set the uncertainty of the map's cells."""
        if uncertainty is not self.uncertainty:
            self.uncertainty = uncertainty
            self.changed.emit()

    def set_parts(self, parts: tuple[str, ...]) -> None:
        """Show some parts of the body alone, or (none) all of it."""
        if parts != self.parts:
            self.parts = parts
            self.changed.emit()

    def set_offset(self, offset_s: float) -> None:
        """Align the map in time."""
        if offset_s != self.offset_s:
            self.offset_s = offset_s
            self.changed.emit()

    def set_status(self, status: str) -> None:
        """Set the text about the map's quality."""
        if status != self.status:
            self.status = status
            self.status_changed.emit()

    def set_reference(self, reference: float, *, by_hand: bool = False) -> None:
        """Choose the value shown as 0 dB."""
        self.reference, self.by_hand = reference if reference > 0 else 1.0, by_hand
        self.changed.emit()

    def frame_at(self, time_s: float) -> int | None:
        """Frame of the map at a time of the recording, or None outside and in gaps."""
        return None if self.map is None else self.map.timebase.shown_at(time_s - self.offset_s)

    def levels_db(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        """Values in dB above the reference; minus infinity for zero."""
        with np.errstate(divide="ignore"):
            levels: NDArray[np.float32] = 10.0 * np.log10(values / np.float32(self.reference))
        return levels

    def shade(self, values: NDArray[np.float32], levels: HeatmapLevels) -> NDArray[np.float32]:
        """Values on the scale of the colour map, 0 to 1."""
        if levels.scale == "dB":
            shade = (self.levels_db(values) - levels.low_db) / (levels.high_db - levels.low_db)
        else:
            shade = values / np.float32(self.reference * 10.0 ** (levels.high_db / 10.0))
        return np.clip(shade, 0.0, 1.0).astype(np.float32)

    def _deviation(self, index: int, frame: int) -> float | None:
        if self.map is None or self.uncertainty is None or self.parts:
            return None
        column = self.map.values[:, frame : frame + 1]
        return float(self.uncertainty.between(frame, frame + 1).deviation(column)[index, 0])

    def uncertain(self, levels: HeatmapLevels, start: int, stop: int) -> NDArray[np.bool_] | None:
        """Cells that are known to worse than :data:`UNCERTAIN_SHARE` of their value.

        Where nothing shows, being fainter than the faintest level, those that may well
        show after all: whose deviation is a tenth of the highest level.
        Deviations are those of :meth:`CellUncertainty.deviation`. The shape is
        (bins, stop - start); None if no uncertainty is known.
        """
        if self.map is None or self.uncertainty is None or self.parts:
            return None
        values = self.map.values[:, start:stop]
        highest = self.reference * 10.0 ** (levels.high_db / 10.0)
        faintest = _FAINT_SHARE * highest
        if levels.scale == "dB":
            faintest = self.reference * 10.0 ** (levels.low_db / 10.0)
        shows = np.float32(UNCERTAIN_SHARE) * values
        limit = np.where(values >= faintest, shows, np.float32(_SHOWS_SHARE * highest))
        deviation = self.uncertainty.between(start, stop).deviation(values)
        return deviation > limit

    def read(self, time_s: float, velocity_mps: float) -> Reading | None:
        """Cell at a time and velocity, or None where there is none."""
        frame = self.frame_at(time_s)
        if self.map is None or frame is None:
            return None
        index = self.map.axis.bin_of(velocity_mps)
        if index is None or (self.covered is not None and not self.covered[frame]):
            return None
        value = self.values[index, frame]
        note = ""
        if not self.map.present_mask[frame]:
            note = "no person"
        elif index in self.map.null_bins:
            note = "nulled bin"
        elif index in self.map.unseen_bins:
            note = "beyond the radar's v_max"
        return Reading(
            track=self.title,
            time_s=self.map.timebase.time_of(frame) + self.offset_s,
            frame=frame,
            velocity_mps=float(self.map.axis.centres_mps[index]),
            value=float(value),
            level_db=float(self.levels_db(value)),
            note=note,
            deviation=self._deviation(index, frame),
        )


class PointerModel(QObject):
    """Reading under the pointer."""

    changed = Signal()

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self.time_s: float | None = None  # None while the pointer is elsewhere
        self.velocity_mps: float | None = None
        self.reading: Reading | None = None

    def point_at(
        self, time_s: float, velocity_mps: float | None = None, reading: Reading | None = None
    ) -> None:
        """Set time and velocity under the pointer, and what is read there of a map."""
        self.time_s, self.velocity_mps, self.reading = time_s, velocity_mps, reading
        self.changed.emit()

    def leave(self) -> None:
        """Clear the reading."""
        if self.time_s is not None:
            self.time_s = self.velocity_mps = self.reading = None
            self.changed.emit()


LIMB_COLOURS: Mapping[str, str] = {
    "trunk": "#9aa3ad",
    "upper_arm.L": "#4fb3ff",
    "upper_arm.R": "#f2a900",
    "forearm.L": "#1f77d0",
    "forearm.R": "#e8600a",
    "thigh.L": "#2bbf8a",
    "thigh.R": "#f57fb5",
    "lower_leg.L": "#008f6b",
    "lower_leg.R": "#c2307f",
}
"""Colour of every part of the body: cool ones on the left, warm ones on the right."""


def title_of(track: MapModel) -> str:
    """Title of a map, with the parts of the body that are shown alone."""
    parts = " + ".join(map(part_words, track.parts))
    return f"{track.title} · {parts}" if parts else track.title


def part_words(part: str) -> str:
    """Part of the body in words, after a person's name in a scene of several."""
    person, of, own = part.rpartition(OF)
    if of:
        return f"{person}{of}{part_words(own)}"
    if part not in PARTS:  # a person
        return part
    name, _, side = part.partition(".")
    words = "head and trunk" if name == "trunk" else name.replace("_", " ")
    return {"L": f"left {words}", "R": f"right {words}"}.get(side, words)


def colours_of(parts: Iterable[str]) -> dict[str, str]:
    """Colour of each of some parts or people: a limb's own, unless another one has it."""
    colours: dict[str, str] = {}
    for part in parts:
        free = [one for one in LIMB_COLOURS.values() if one not in colours.values()]
        own = LIMB_COLOURS.get(part.rpartition(OF)[2], "")
        colours[part] = own if own in free else (free or [*LIMB_COLOURS.values()])[-1]
    return colours
