"""Doppler map that is filled part by part, each frame with its quality."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator
from copy import deepcopy
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2app.session.content import reference_of
from sd2app.session.maps import MapModel
from sd2core.doppler.options import SynthesisOptions
from sd2core.maps import DopplerMap, LimbMaps
from sd2core.mesh.presence import runs
from sd2core.mesh.sequence import MeshSequence
from sd2core.sensor import VirtualSensor

PREVIEW, FINAL = 1, 2
"""Quality of a frame: a preview (or what was final for another plan), what the plan in use gives.
0 is not computed."""

View = tuple[int, int]


class PartialMap:
    """Map on a track that is filled part by part, each frame with its quality."""

    def __init__(self, track: MapModel) -> None:
        self._track = track
        self.forget()

    def forget(self) -> None:
        """Begin without a mesh; what is on the track stays."""
        self._map: DopplerMap | None = None  # with the values so far
        self.quality = np.zeros(0, np.uint8)  # (T,), see FINAL
        self._shares = np.zeros((2, 0), np.float32)  # (2, T), of final frames
        self.sensor: VirtualSensor | None = None  # placement that all of it is for
        self._key: Hashable = None  # of the final frames
        self._words: dict[int, str] = {}
        self._needs_reference = True

    def begin(self, empty: DopplerMap) -> None:
        """Begin with a map none of which is computed; its values are filled in place."""
        self.forget()
        self.quality = np.zeros(len(empty.timebase), np.uint8)
        self._shares = np.zeros((2, self.frames), np.float32)
        self._map = empty

    @property
    def frames(self) -> int:
        """Number of frames T."""
        return len(self.quality)

    @property
    def full(self) -> bool:
        """True once every frame is computed, at any quality."""
        return bool(self.frames and self.quality.min() > 0)

    @property
    def final(self) -> bool:
        """True once every frame has its final quality."""
        return bool(self.frames and self.quality.min() >= FINAL)

    @property
    def split(self) -> bool:
        """True if the map is split by the parts of the body."""
        return self._map is not None and self._map.limbs is not None

    def kept(self) -> Part | None:
        """A copy of the map once it is final, which can be taken again."""
        made, sensor = self._map, self.sensor
        if made is None or sensor is None or not self.final:
            return None
        return Part(
            sensor, 0, made.values.copy(), deepcopy(made.limbs), FINAL, self._words[FINAL],
            made.unit, self._key, self._shares.copy(),
        )  # fmt: skip

    def mark_stale(self) -> None:
        """Lower final frames to previews; they stay on screen until they are replaced."""
        np.minimum(self.quality, PREVIEW, out=self.quality)
        self._words[PREVIEW] = self._words.get(FINAL, self._words.get(PREVIEW, ""))

    def quality_for(self, sensor: VirtualSensor) -> NDArray[np.uint8]:
        """A copy of the ranks as far as they hold for a placement."""
        return self.quality.copy() if sensor == self.sensor else np.zeros_like(self.quality)

    def take(self, part: Part) -> None:
        """Show computed frames; those of another sensor are forgotten."""
        assert self._map is not None
        if part.sensor != self.sensor:
            self.sensor = part.sensor
            self.quality[:] = 0
        self.paint(part.start, part.values, part.quality)
        limbs = self._map.limbs
        if part.limbs is None:
            limbs = None
        else:
            if limbs is None or limbs.parts != part.limbs.parts:  # somebody came or went
                limbs = part.limbs.empty(self.frames)
            limbs.put(part.start, part.limbs)
        if part.shares is not None:
            self._shares[:, part.start : part.stop] = part.shares
        if part.quality >= FINAL:
            self._key = part.key
        self._words[part.quality] = part.words
        # Others tell by the object that it is another map, though its values are in the same place.
        self._map = replace(self._map, unit=part.unit, limbs=limbs)
        self.show(self._key if self.final else None)

    def paint(
        self, start: int, values: NDArray[np.float32], quality: int | NDArray[np.uint8]
    ) -> None:
        """Fill in frames (bins, n) from ``start`` on, of one quality or each of its own."""
        assert self._map is not None
        inside = slice(start, start + values.shape[1])
        self._map.values[:, inside] = values
        self.quality[inside] = quality

    def show(self, key: Hashable = None) -> None:
        """Show on the track what is filled in; ``key`` is that of a final map.

        The first whole map sets the 0 dB reference, and parts before it where none is set by hand.
        """
        if self._map is None:
            return
        full, values = self.full, self._map.values
        if self._needs_reference and values.any() and (full or not self._track.by_hand):
            self._needs_reference = not full
            self._track.set_reference(reference_of(values))
        self._track.set_map(self._map, None if full else self.quality > 0, key)

    def say_quality(self, view: View, final_words: Callable[[], str], compiling: bool) -> None:
        """Write the lowest quality in view on the track; ``final_words`` gives the final one."""
        start, stop = view
        quality = self.quality[start:stop]
        if not quality.any():
            return
        final = float((quality >= FINAL).mean())
        lowest = int(quality[quality > 0].min())
        words = final_words() if lowest == FINAL else self._words.get(lowest, "")
        if 0 < final < 1 and lowest < FINAL:
            words = f"{words}, {100 * final:.0f} % final"
        if compiling:
            words += " · compiling, exact follows"
        self._track.set_status(words)


def empty_map(options: SynthesisOptions, mesh: MeshSequence) -> DopplerMap:
    """Synthetic map of a mesh, all zero."""
    return DopplerMap(
        values=np.zeros((options.axis.bins, mesh.frame_count), np.float32),
        axis=options.axis,
        timebase=mesh.timebase,
        kind="synthetic",
        null_bins=options.null_bins,
        present=mesh.presence.measured,
    )


def pieces(wanting: NDArray[np.bool_], start: int, stop: int, size: int) -> Iterator[View]:
    """Stretches of at most ``size`` frames all of which want something."""
    for first, last in runs(wanting[start:stop]):
        for at in range(start + first, start + last, size):
            yield at, min(at + size, start + last)


@dataclass(frozen=True, eq=False)
class Part:
    """Computed frames on their way to the window.

    ``key`` is of all that final ones depend on; ``shares`` (2, n) are of their vertices that are
    seen, and of these beyond the axis; ``more`` is what was made of it and is shown with it.
    """

    sensor: VirtualSensor
    start: int
    values: NDArray[np.float32]  # (bins, n)
    limbs: LimbMaps | None
    quality: int
    words: str
    unit: str
    key: Hashable = None
    shares: NDArray[np.float32] | None = None
    more: Any = None

    @property
    def size_bytes(self) -> int:
        """Memory that it takes, about."""
        return self.values.nbytes + (0 if self.limbs is None else self.limbs.values.nbytes)

    @property
    def stop(self) -> int:
        """Number of the frame after the last."""
        return self.start + self.values.shape[1]
