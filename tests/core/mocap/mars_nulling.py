"""What nulled bins cost, measured on the MARS recordings of subject 1.

A Kinect skeleton and a 77 GHz radar saw the same person (S. An and U. Y. Ogras,
"MARS: mmWave-based assistive rehabilitation system for smart healthcare", ACM
TECS 2021). The skeleton's joints become a point cloud, that becomes synthetic
Doppler, and its mean velocity per frame is compared with the radar's own.

Run it to print the table of ``docs/nulling.md``::

    python tests/core/mocap/mars_nulling.py [FOLDER]
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sd2core.doppler import PRESETS, SynthesisOptions, Synthesizer
from sd2core.io.radar.mars import FRAMES_PER_S, read_mars
from sd2core.mesh.sequence import MeshSequence
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase

PARTS = ("test", "validate")
LAGS = (-3, -2, -1, 0, 1, 2, 3)

FULL = replace(PRESETS["paper"], visibility="none", null_bins=())
NULLED = replace(PRESETS["paper"], visibility="none")
SYMMETRIC = replace(PRESETS["paper"], visibility="none", null_bins=(15, 16))


@dataclass(frozen=True, eq=False)
class Segment:
    """One uninterrupted stretch.

    ``joints_m`` is (n, 25, 3) in the camera frame, ``radar_mps`` (n,) the
    intensity-weighted mean of the radar's points, positive when approaching,
    ``moving_points`` (n,) how many of them had a Doppler other than 0.
    """

    joints_m: NDArray[np.float32]
    radar_mps: NDArray[np.float64]
    moving_points: NDArray[np.int64]

    @property
    def mesh(self) -> MeshSequence:
        """The joints as a point cloud."""
        timebase = Timebase.regular(len(self.joints_m), FRAMES_PER_S)
        return MeshSequence(self.joints_m, None, timebase, source="MARS skeleton")

    def synthetic_mps(self, options: SynthesisOptions) -> NDArray[np.float64]:
        """Mean velocity of the synthetic map per frame; NaN where it is empty."""
        return Synthesizer(self.mesh, options).map(VirtualSensor()).mean_velocity_mps()


def read_part(folder: Path, part: str) -> list[Segment]:
    """Segments of one part, row by row as the file has them."""
    return [
        Segment(
            stretch.joints_m.astype(np.float32),
            stretch.mean_velocity_mps(),
            np.bincount(stretch.point_rows, stretch.point_mps != 0.0).astype(np.int64),
        )
        for stretch in read_mars(folder, part).stretches
    ]


def correlation(
    synthetic: Iterable[NDArray[np.float64]], segments: Iterable[Segment], lag: int = 0
) -> float:
    """Pearson correlation over all frames that have both values.

    A positive lag compares each synthetic frame with a later radar frame; no
    pair reaches across a join.
    """
    left, right = [], []
    for values, segment in zip(synthetic, segments, strict=True):
        stop = len(values) - abs(lag)
        left.append(values[max(-lag, 0) :][:stop])
        right.append(segment.radar_mps[max(lag, 0) :][:stop])
    pair = np.stack([np.concatenate(left), np.concatenate(right)])
    return float(np.corrcoef(pair[:, np.isfinite(pair).all(axis=0)])[0, 1])


def at_rest(synthetic: Iterable[NDArray[np.float64]]) -> list[NDArray[np.float64]]:
    """An empty frame says that nothing moves: 0 m/s."""
    return [np.nan_to_num(values) for values in synthetic]


def unsmoothed(options: SynthesisOptions) -> SynthesisOptions:
    """Without the preset's Gaussian, which fills empty frames from their neighbours."""
    return replace(options, velocity_sigma_bins=0.0, time_sigma_s=0.0)


def main() -> None:
    """Print the table of docs/nulling.md."""
    shared = Path(__file__).resolve().parents[4] / "shared" / "data"
    default = Path(os.environ.get("SD2_SHARED_DATA", shared)) / "paired" / "mars_subject1"
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, nargs="?", default=default, metavar="FOLDER")
    folder = parser.parse_args().folder
    print("| part | nulled bins | empty frames | unsmoothed | correlation | empty left out |")
    print("|---|---|---|---|---|---|")
    for part in PARTS:
        segments = read_part(folder, part)
        for name, options in (("none", FULL), ("15, 16", SYMMETRIC), ("14, 15, 16", NULLED)):
            synthetic, raw = (
                [segment.synthetic_mps(used) for segment in segments]
                for used in (options, unsmoothed(options))
            )
            empty, empty_raw = (np.isnan(np.concatenate(one)).mean() for one in (synthetic, raw))
            print(
                f"| {part} | {name} | {empty:.1%} | {empty_raw:.1%}"
                f" | {correlation(at_rest(synthetic), segments):.3f}"
                f" | {correlation(synthetic, segments):.3f} |"
            )


if __name__ == "__main__":
    main()
