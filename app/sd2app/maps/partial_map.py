"""Doppler map that is filled part by part, each frame with its quality."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2app.session.content import reference_of
from sd2app.session.maps import MapModel
from sd2core.doppler.options import SynthesisOptions
from sd2core.doppler.synthesizer import Stretch
from sd2core.maps import DopplerMap, LimbMaps
from sd2core.mesh.sequence import MeshSequence
from sd2core.sensor import VirtualSensor

ROUGH, PREVIEW, FINAL = 1, 2, 3
"""Quality of a frame: rough, the preview while the sensor is dragged (or what was
final for another plan), what the plan in use gives. 0 is not computed."""

View = tuple[int, int]


class PartialMap:
    """Doppler map of which some frames are computed, none of them at first."""

    def __init__(self, bins: int, frames: int) -> None:
        self.values = np.zeros((bins, frames), np.float32)
        self.limbs: LimbMaps | None = None  # where they are wanted
        self.quality = np.zeros(frames, np.uint8)  # see FINAL
        self.sensor: VirtualSensor | None = None  # placement that all of it is for

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

    def paint(self, sensor: VirtualSensor, start: int, stretch: Stretch, quality: int) -> None:
        """Take computed frames over; those of another sensor are forgotten."""
        if sensor != self.sensor:
            self.sensor = sensor
            self.quality[:] = 0
        inside = slice(start, start + stretch.values.shape[1])
        self.values[:, inside] = stretch.values
        if stretch.limbs is None:
            self.limbs = None
        else:
            if self.limbs is None:
                self.limbs = stretch.limbs.empty(self.frames)
            self.limbs.put(start, stretch.limbs)
        self.quality[inside] = quality

    def mark_stale(self) -> None:
        """Lower final frames to previews; they stay on screen until they are replaced."""
        np.minimum(self.quality, PREVIEW, out=self.quality)

    def quality_for(self, sensor: VirtualSensor) -> NDArray[np.uint8]:
        """A copy of the ranks as far as they hold for a placement."""
        return self.quality.copy() if sensor == self.sensor else np.zeros_like(self.quality)


def pieces(
    quality: NDArray[np.uint8], below: int, start: int, stop: int, size: int
) -> Iterator[View]:
    """Stretches of at most ``size`` frames from ``start`` to ``stop`` whose quality is below.

    ``quality`` may change while iterating.
    """
    while start < stop:
        if quality[start] >= below:
            start += 1
            continue
        inside = quality[start : min(stop, start + size)] < below
        end = start + (len(inside) if inside.all() else int(inside.argmin()))
        yield start, end
        start = end


class ShownMap:
    """Map on screen that is painted part by part, with its quality on the track."""

    def __init__(self, track: MapModel) -> None:
        self._track = track
        self.forget()

    def forget(self) -> None:
        """Remove the map."""
        self.partial = PartialMap(2, 0)
        self._scene: tuple[SynthesisOptions, MeshSequence] | None = None
        self._words: dict[int, str] = {}
        self._needs_reference = True

    def begin(self, options: SynthesisOptions, mesh: MeshSequence) -> None:
        """Begin an empty map of another mesh."""
        self.forget()
        self._scene = options, mesh
        self.partial = PartialMap(options.axis.bins, mesh.frame_count)

    def mark_stale(self) -> None:
        """Lower final frames to previews; they stay on screen until they are replaced."""
        self.partial.mark_stale()
        self._words[PREVIEW] = self._words.get(FINAL, self._words.get(PREVIEW, ""))

    def take(self, part: Part) -> None:
        """Paint a stretch; the first whole map sets the 0 dB reference."""
        assert self._scene is not None
        options, mesh = self._scene
        self.partial.paint(part.sensor, part.start, part.stretch, part.quality)
        self._words[part.quality] = part.words
        if self._needs_reference and self.partial.full:
            self._needs_reference = False
            self._track.set_reference(reference_of(self.partial.values))
        painted = DopplerMap(
            values=self.partial.values,
            axis=options.axis,
            timebase=mesh.timebase,
            kind="synthetic",
            unit=part.unit,
            null_bins=options.null_bins,
            present=mesh.presence.measured,
            limbs=self.partial.limbs,
        )
        self._track.set_map(painted, None if self.partial.full else self.partial.quality > 0)

    def say_quality(self, view: View, final_words: str, compiling: bool) -> None:
        """Write the lowest quality in view on the track."""
        start, stop = view
        quality = self.partial.quality[start:stop]
        if not quality.any():
            return
        final = float((quality >= FINAL).mean())
        lowest = int(quality[quality > 0].min())
        words = final_words if lowest == FINAL else self._words.get(lowest, "")
        if 0 < final < 1 and lowest < FINAL:
            words = f"{words}, {100 * final:.0f} % final"
        if compiling:
            words += " · compiling, exact follows"
        self._track.set_status(words)


@dataclass(frozen=True, eq=False)
class Part:
    """Computed frames on their way to the window.

    ``more`` is what a companion made of it.
    """

    sensor: VirtualSensor
    start: int
    stretch: Stretch
    quality: int
    words: str
    unit: str
    more: Any = None
