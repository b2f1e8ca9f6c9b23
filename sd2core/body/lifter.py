"""Depth and motion of landmarks, and where they really are in the picture, by a small network.

The network was trained on simulated people (decision 18); here it only runs, on NumPy, over
blocks of a long track.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sd2core.body.camera import PinholeCamera
from sd2core.body.lifter_features import (
    RATE_HZ,
    Seen,
    backwards,
    features,
    interpolated,
    mirrored,
    nearly_at_rate,
    rate,
    resampled,
    scale_of,
    typical_size,
)
from sd2core.body.network import Network, network_of
from sd2core.body.track import (
    LANDMARK,
    LANDMARKS,
    MIRRORED,
    PART_FRAMES,
    LandmarkTrack,
    parts,
)
from sd2core.errors import Sd2Error
from sd2core.files.resources import open_bundled_arrays, resource_path
from sd2core.mesh.presence import runs
from sd2core.progress import Progress, silent

Singles = NDArray[np.float32]
Floats = NDArray[np.float64]


FORMAT = "sd2-lifter"
VERSION = 3
POINTS = len(LANDMARKS)
FEET = tuple(LANDMARK[f"{place}.{side}"] for place in ("heel", "foot_index") for side in "LR")
"""Landmarks that stand still where they touch the ground."""
KINDS = 7
OUTPUTS = 2 + KINDS * POINTS + len(FEET)
"""Root and its spread; of all landmarks the depths and their spreads, the velocities and theirs,
what is to be added to their places in the picture (x, then y) and its spread; spreads as
logarithms. Then the log odds that each of the feet stands still.

Velocities are what is to be added to the rate of the depths, see :func:`with_rates`. What is added
to places is in typical apparent sizes of the torso.
"""

SPREADS = (1, 3, 6)
"""Which of the KINDS are spreads."""

_VELOCITIES = slice(2 + 2 * POINTS, 2 + 3 * POINTS)
_ACROSS_X = slice(2 + 4 * POINTS, 2 + 5 * POINTS)
STANDING = slice(OUTPUTS - len(FEET), OUTPUTS)

LOG_SIGMA = (-6.0, 1.5)
"""Between these the network's logarithms of spreads are held."""

_OTHER_SIDE = [
    *(0, 1),
    *(2 + POINTS * kind + other for kind in range(KINDS) for other in MIRRORED),
    *(STANDING.start + FEET.index(MIRRORED[row]) for row in FEET),
]
"""Outputs of the mirror image, in the order of those of the person."""

_BESIDE = 4
"""Frames more than a tick away that still matter where a track is resampled."""


@dataclass(frozen=True, eq=False)
class LiftedTrack:
    """Depth and motion along z of every landmark, in statures; NaN in empty frames."""

    centre_depth: Floats  # (T,) z of the body's centre, the mean of shoulders and hips
    centre_sigma: Floats  # (T,) its standard deviation
    depth: Floats  # (T, 33) behind the centre
    depth_sigma: Floats  # (T, 33)
    velocity: Floats  # (T, 33) of the landmark's z per second, positive away
    velocity_sigma: Floats  # (T, 33)
    across: Floats  # (T, 33, 2) to be added to the slopes of the landmarks
    across_sigma: Floats  # (T, 33) standard deviation of a slope after that
    standing: Floats  # (T, 4) probability that each of FEET stands still

    def part(self, start: int, stop: int) -> LiftedTrack:
        """Frames ``start`` to ``stop``."""
        return LiftedTrack(**{name: values[start:stop] for name, values in vars(self).items()})


@dataclass(frozen=True, eq=False)
class Lifter:
    """A trained network, and how well its outputs and the fits made of them are known."""

    network: Network
    calibration: Singles  # (OUTPUTS,) added to the logarithms of standard deviations
    fit_law: Singles  # (2 + 33,), see :meth:`fit_sigma_mps`
    provenance: Mapping[str, Any]

    @classmethod
    def load(cls, path: Path | None = None) -> Lifter:
        """Read the bundled lifter, or another one; Sd2Error if it is missing, damaged or newer."""
        path = resource_path("lifter.npz") if path is None else Path(path)
        command = "python -m tools.train_lifter train"
        with open_bundled_arrays(path, FORMAT, VERSION, "a lifter", command, oldest=VERSION) as (
            meta,
            data,
        ):
            network = network_of(meta, data)
            calibration, law = (
                data[name].astype(np.float32) for name in ("calibration", "fit_law")
            )
        return cls(network, calibration, law, meta["provenance"])

    def fit_sigma_mps(self, lifted_mps: Floats, speed_mps: Floats) -> Floats:
        """Standard deviation of the velocity of a fit's landmarks along the view, (T, 33).

        A product of powers of the lifter's own deviation and of the landmark's speed in the fit,
        with a factor of each landmark, as measured on fits of people not learnt from
        (docs/decisions/0046): who moves fast is known less well.
        """
        logarithm = np.log(fit_law_terms(lifted_mps, speed_mps)) @ self.fit_law[:2]
        return np.asarray(np.exp(logarithm + self.fit_law[2:]), np.float64)

    def lift(
        self, track: LandmarkTrack, camera: PinholeCamera, progress: Progress = silent
    ) -> LiftedTrack:
        """Lift a track of any length; ``progress`` counts frames.

        Raises Sd2Error if the camera's picture has another size than the track's.
        """
        if (camera.width, camera.height) != (track.width, track.height):
            raise Sd2Error(
                f"The camera takes pictures of {camera.width} × {camera.height}",
                f"{track.width} × {track.height}, as the landmarks were found in",
            )
        none = vars(_lifted(np.empty((0, OUTPUTS)), np.nan))
        whole = {
            name: np.full((len(track), *values.shape[1:]), np.nan) for name, values in none.items()
        }
        for first, last in runs(track.present):
            stretch = _Stretch(track.part(first, last), camera, self.network.reach + 2)
            # Of a stretch that is one block, the block itself.
            sample = None if len(stretch.blocks) == 1 else stretch.sample()
            for start, stop in stretch.blocks:
                progress(first + start, len(track))
                view = stretch.view(start, stop)
                known = view.seen if sample is None else sample
                outputs = self.outputs(view.seen, known)
                raw = interpolated(outputs, view.place - view.ticks[0])
                for name, values in vars(_lifted(raw, float(typical_size(known.slopes)))).items():
                    whole[name][first + start : first + stop] = values
        return LiftedTrack(**whole)

    def outputs(self, seen: Seen, sample: Seen | None = None) -> Singles:
        """Calibrated outputs (T, OUTPUTS) of one stretch, velocities in full.

        The mean over the stretch, its mirror image, and both played backwards, so that sides and
        directions of time are treated alike. The person's measures are taken from ``sample``, by
        default the stretch itself.
        """
        return symmetric(self.network, seen, sample) + self.calibration


def fit_law_terms(lifted_mps: Floats, speed_mps: Floats) -> Floats:
    """Terms of the law of a fit's deviations, (T, 33, 2), not below what is left at rest."""
    return np.stack([lifted_mps + 0.01, speed_mps + 0.03], axis=-1)


def symmetric(network: Network, seen: Seen, sample: Seen | None = None) -> Singles:
    """Mean of the outputs over a stretch's mirror image and reversal, velocities in full."""
    sample = seen if sample is None else sample
    size = float(typical_size(sample.slopes))
    total = np.zeros((len(seen.sure), OUTPUTS), np.float32)
    for view, known in ((seen, sample), (mirrored(seen), mirrored(sample))):
        scale = scale_of(known)
        ahead, back = (
            with_rates(network(features(each, scale)), size) for each in (view, backwards(view))
        )
        back = back[::-1].copy()
        back[:, _VELOCITIES] *= -1.0
        both = ahead + back
        if view is not seen:
            both = both[:, _OTHER_SIDE]
            both[:, _ACROSS_X] *= -1.0
        total += both
    return np.asarray(total / 4.0, np.float32)


def with_rates(out: Singles, size: float) -> Singles:
    """Add the rates of centre and depths to the velocities of outputs (T, OUTPUTS).

    ``size`` is that of :func:`~sd2core.body.lifter_features.typical_size`.
    """
    full = out.copy()
    centre = np.exp(out[:, :1]) / np.float32(size) * rate(out[:, :1], 0)
    full[:, _VELOCITIES] += rate(out[:, 2 : 2 + POINTS], 0) + centre
    return full


def by_landmark(out: NDArray[Any]) -> NDArray[Any]:
    """Outputs (T, OUTPUTS) by landmark, in the order told there, (T, KINDS, 33)."""
    return out[:, 2 : STANDING.start].reshape(len(out), KINDS, POINTS)


def spread(logarithm: NDArray[np.floating]) -> Floats:
    """Standard deviation of its clipped logarithm."""
    return np.asarray(np.exp(np.clip(logarithm, *LOG_SIGMA)))


class _View(NamedTuple):
    """A block of a stretch resampled to the network's rate."""

    seen: Seen
    ticks: NDArray[np.intp]  # (n,) numbers of these moments, from the beginning of the stretch
    place: Floats  # where the block's frames are among them
    end: float  # where the frames of the next block begin


class _Stretch:
    """Frames with a person throughout, which are lifted in blocks, as much around them as matters.

    ``reach`` is the number of ticks around a block that matter to it.
    """

    def __init__(self, track: LandmarkTrack, camera: PinholeCamera, reach: int) -> None:
        self.blocks = [*parts(len(track))]
        self._track, self._camera, self._reach = track, camera, reach
        times_s = track.timebase.times_s
        self._same = nearly_at_rate(times_s)
        self._place = (times_s - times_s[0]) * RATE_HZ
        if self._same:
            self._place = np.arange(len(track), dtype=np.float64)

    def sample(self) -> Seen:
        """Ticks of a long stretch, evenly spread."""
        every = -(-len(self._track) // PART_FRAMES)
        seen = []
        for start, stop in self.blocks:
            view = self.view(start, stop)
            own = (view.ticks >= view.place[0]) & (view.ticks < view.end)
            rows = np.flatnonzero(own & (view.ticks % every == 0))
            seen.append([np.asarray(values)[rows] for values in view.seen])
        return Seen(*(np.concatenate(values) for values in zip(*seen, strict=True)))

    def view(self, start: int, stop: int) -> _View:
        """A block at the network's rate."""
        place, frames = self._place, len(self._track)
        inner = place[start:stop]
        end = np.inf if stop == frames else place[stop]
        ticks = np.arange(
            max(int(inner[0]) - self._reach, 0),
            min(int(inner[-1]) + 1 + self._reach, int(place[-1] + 1e-6)) + 1,
        )
        if self._same:
            first, last = int(ticks[0]), int(ticks[-1]) + 1
        else:
            first = max(int(np.searchsorted(place, ticks[0] - 1)) - _BESIDE, 0)
            last = min(int(np.searchsorted(place, ticks[-1] + 1)) + _BESIDE, frames)
        seen = _seen(self._track.part(first, last), self._camera)
        if not self._same:
            near = place[first:last]
            seen = Seen(*(resampled(np.asarray(part), near, ticks) for part in seen))
        return _View(seen, ticks, inner, end)


def _seen(track: LandmarkTrack, camera: PinholeCamera) -> Seen:
    return Seen(
        camera.slopes(track.image_px.astype(np.float64)),
        track.depth_px / camera.focal_px,
        track.world_m.astype(np.float64),
        track.visibility.astype(np.float64),
        np.where(track.bridged, 0.0, track.confidence),
    )


def _lifted(raw: Floats, size: float) -> LiftedTrack:
    """Of outputs of the network, (T, OUTPUTS), and the typical size of their stretch."""
    root, root_spread, rest = raw[:, 0], raw[:, 1], by_landmark(raw)
    centre = np.exp(root) / size
    return LiftedTrack(
        centre,
        centre * spread(root_spread),
        rest[:, 0],
        spread(rest[:, 1]),
        rest[:, 2],
        spread(rest[:, 3]),
        size * rest[:, 4:6].swapaxes(1, 2),
        size * spread(rest[:, 6]),
        1.0 / (1.0 + np.exp(-raw[:, STANDING])),
    )
