"""Print the tables of docs/imu.md.

::

    python -m tools.documentation.inertial_sensors board 10_undisturbed_slow_translation_A.hdf5
    python -m tools.documentation.inertial_sensors foot GAITMAP_FOLDER
    python -m tools.documentation.inertial_sensors fit TRUE_MESH FITTED_MESH

The first holds a virtual sensor on a board beside the real one on it (a recording of BROAD, its
pose tracked by cameras), the second one on a shoe (the sample of gaitmap, markers tracked by
cameras), the last one on a body that `sd2 fit` found in a video beside one on the true body.
"""

from __future__ import annotations

import argparse
import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline
from scipy.spatial.transform import Rotation

import sd2core as sd2
from sd2core.compare.measures import correlation, rms
from sd2core.files.hdf5_files import open_hdf5_file
from sd2core.imu.mounting import mounted
from sd2core.imu.signals import GRAVITY_MPS2, InertialSignals, RigidPath, imu_signals, low_pass
from sd2core.mesh.sequence import MeshSequence
from sd2core.timebase import Timebase
from tools.documentation.measured import table

Floats = NDArray[np.float64]

CUTOFF_HZ = 6.0
CUTOFFS_HZ = (3.0, 6.0, 12.0)
INSTEP, FOREFOOT = 3, 4
"""Vertices of a shoe besides its markers."""
FROM_EAST_NORTH_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""Turns a frame whose z axis points up into ours: right, down, forward."""

SHIFTS_S = np.arange(-0.05, 0.0501, 0.0005)
PLACES = ("chest", "right-upper-arm", "right-forearm", "right-wrist", "right-hand")


@dataclass(frozen=True)
class Beside:
    """A virtual sensor beside a real one, after one constant alignment."""

    acceleration_rms_mps2: float  # of an axis
    turn_rate_rms_radps: float
    acceleration_correlation: float  # of all axes together
    shift_s: float
    samples: int


# -- A board ---------------------------------------------------------------------------------------


def board(path: Path) -> tuple[MeshSequence, InertialSignals, NDArray[np.bool_]]:
    """Mesh of a tracked board, the real sensor on it, and the samples in which it is moved."""
    with open_hdf5_file(path, "a recording of BROAD") as file:
        position_m, wxyz = file["opt_pos"][:], file["opt_quat"][:]
        acceleration, turn_rate = file["imu_acc"][:], file["imu_gyr"][:]
        moved = file["movement"][:]
        rate_hz = float(file.attrs["sampling_rate"])
    present = np.isfinite(position_m).all(axis=1) & np.isfinite(wxyz).all(axis=1)
    turns = Rotation.from_quat(np.where(present[:, None], wxyz, [1, 0, 0, 0]), scalar_first=True)
    corners_m = np.array([[0, 0, 0], [1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]]) * 0.1
    vertices = np.einsum("tij,vj->tvi", turns.as_matrix(), corners_m) + position_m[:, None]
    times = Timebase.regular(len(position_m), rate_hz)
    faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]])
    mesh = MeshSequence(
        np.nan_to_num(vertices @ FROM_EAST_NORTH_UP.T), faces, times, "the board", present=present
    )
    return mesh, InertialSignals(times.times_s, acceleration, turn_rate), moved & present


def beside(
    virtual: InertialSignals,
    real: InertialSignals,
    counted: NDArray[np.bool_],
    cutoff_hz: float = CUTOFF_HZ,
) -> Beside:
    """Align by one rotation, one time shift and one offset of each quantity, and compare."""
    rate_hz = real.rate_hz
    acceleration = low_pass(real.acceleration_mps2, rate_hz, cutoff_hz)[counted]
    turn_rate = low_pass(real.turn_rate_radps, rate_hz, cutoff_hz)[counted]
    known = virtual.known
    curve = make_interp_spline(
        virtual.times_s[known],
        np.hstack([virtual.acceleration_mps2, virtual.turn_rate_radps])[known],
    )

    acceleration, turn_rate = (one - one.mean(axis=0) for one in (acceleration, turn_rate))

    def compared(shift_s: float) -> Beside:
        moved = curve(real.times_s[counted] - shift_s)
        moved -= moved.mean(axis=0)
        turn, _ = Rotation.align_vectors(acceleration, moved[:, :3])
        turned = turn.apply(moved[:, :3]), turn.apply(moved[:, 3:])
        return Beside(
            rms(acceleration - turned[0]),
            rms(turn_rate - turned[1]),
            correlation(acceleration, turned[0]),
            float(shift_s),
            int(counted.sum()),
        )

    return min((compared(shift) for shift in SHIFTS_S), key=lambda one: one.acceleration_rms_mps2)


def board_beside(path: Path, cutoff_hz: float = CUTOFF_HZ) -> Beside:
    """The virtual sensor in the middle of the board beside the real one, where it is moved."""
    mesh, real, moved = board(path)
    virtual = imu_signals(mounted(mesh, 0).path(mesh), mesh.times_s, cutoff_hz)
    return beside(virtual, real, moved & virtual.known, cutoff_hz)


def board_rows(path: Path) -> list[list[str]]:
    """Differences of the two sensors on a board below some frequencies."""
    rows = [["below", "acceleration, m/s²", "correlation", "turn rate, rad/s", "shift", "samples"]]
    for cutoff_hz in CUTOFFS_HZ:
        one = board_beside(path, cutoff_hz)
        numbers = one.acceleration_rms_mps2, one.acceleration_correlation, one.turn_rate_rms_radps
        cells = (f"{number:.4f}" for number in numbers)
        rows.append(
            [f"{cutoff_hz:g} Hz", *cells, f"{1000 * one.shift_s:.1f} ms", f"{one.samples:,}"]
        )
    return rows


# -- A foot ----------------------------------------------------------------------------------------


def foot(folder: Path, side: str) -> tuple[MeshSequence, InertialSignals]:
    """Markers of a shoe with its instep, and the real sensor on it; side is left or right.

    Where the sensor sits on the shoe is not recorded: the instep is half way between the heel and
    the middle of the other two markers, the forefoot half way between the toe and that of the rest.
    """
    markers = _columns(folder / "mocap_sample.csv")
    letter = side[0].upper()
    heel, toe, outside = (
        np.stack([markers[f"{letter}_{name}", axis] for axis in "xyz"], axis=1) / 1000.0
        for name in ("FCC", "TOE", "FM5")
    )
    quarters = (heel + toe + outside) / 4
    corners = np.stack([heel, toe, outside, quarters + heel / 4, quarters + toe / 4], axis=1)
    mesh = MeshSequence(
        corners @ FROM_EAST_NORTH_UP.T,
        np.array([[a, b, top] for top in (INSTEP, FOREFOOT) for a, b in ((0, 1), (1, 2), (2, 0))]),
        Timebase.regular(len(corners), 100.0),
        f"the {side} shoe",
    )
    samples = _columns(folder / "imu_sample.csv")
    acceleration, turn_rate = (
        np.stack([samples[f"{side}_sensor", f"{name}_{axis}"] for axis in "xyz"], axis=1)
        for name in ("acc", "gyr")
    )
    times_s = np.arange(len(acceleration)) / 204.8
    return mesh, InertialSignals(times_s, acceleration, np.radians(turn_rate))


def foot_beside(folder: Path, side: str, vertex: int = INSTEP) -> tuple[float, float, float]:
    """Correlations of |a| and of |ω| of a virtual and a real sensor, and the time between them."""
    mesh, real = foot(folder, side)
    virtual = imu_signals(mounted(mesh, vertex).path(mesh), mesh.times_s, CUTOFF_HZ)
    magnitudes = [np.linalg.norm(one, axis=1) for one in _both(virtual)]
    smooth = [low_pass(one, real.rate_hz, CUTOFF_HZ) for one in _both(real)]
    inner = slice(50, -50)  # what the shift leaves of both recordings

    def alike(shift_s: float) -> tuple[float, float, float]:
        at_s = virtual.times_s[inner] + shift_s
        correlations = [
            np.corrcoef(one[inner], np.interp(at_s, real.times_s, np.linalg.norm(other, axis=1)))
            for one, other in zip(magnitudes, smooth, strict=True)
        ]
        return float(correlations[0][0, 1]), float(correlations[1][0, 1]), float(shift_s)

    return max(map(alike, SHIFTS_S))


def foot_rows(folder: Path) -> list[list[str]]:
    """Likeness of the two sensors on each foot, with the virtual one at two places."""
    rows = [["foot", "\\|a\\| correlates at", "\\|ω\\| correlates at", "shift"]]
    for place, vertex in (("instep", INSTEP), ("forefoot", FOREFOOT)):
        for side in ("left", "right"):
            acceleration, turn_rate, shift_s = foot_beside(folder, side, vertex)
            values = f"{acceleration:.3f}", f"{turn_rate:.3f}", f"{1000 * shift_s:.1f} ms"
            rows.append([f"{side}, {place}", *values])
    return rows


def _both(signals: InertialSignals) -> tuple[Floats, Floats]:
    return signals.acceleration_mps2, signals.turn_rate_radps


def _columns(path: Path) -> dict[tuple[str, str], Floats]:
    """Columns under a heading of two lines."""
    with path.open(encoding="utf-8", newline="") as stream:
        first, second, *rows = csv.reader(stream)
    table = np.array(rows, np.float64)
    return {
        title: table[:, number]
        for number, title in enumerate(zip(first, second, strict=True))
        if number
    }


# -- A fit -----------------------------------------------------------------------------------------


def fit_rows(true_mesh: Path, fitted_mesh: Path) -> list[list[str]]:
    """Errors of virtual sensors on a fitted body, of one on the true body at the same place."""
    true, fitted = sd2.load_mesh(true_mesh), sd2.load_mesh(fitted_mesh)
    rows = [["place", "moves", "off", "across", "along", "turns", "off", "turned by"]]
    rows.append(["", "m/s²", "m/s²", "m/s²", "m/s²", "rad/s", "rad/s", "°"])
    times_s = true.times_s[true.times_s <= fitted.times_s[-1]]
    for place in PLACES:
        paths = [mounted(mesh, place).path(mesh) for mesh in (true, fitted)]
        own = [imu_signals(path, times_s, CUTOFF_HZ) for path in paths]
        world = [
            imu_signals(_unturned(path), times_s, CUTOFF_HZ).acceleration_mps2 for path in paths
        ]
        known = own[0].known & own[1].known
        moved = (world[0] - [0.0, -GRAVITY_MPS2, 0.0])[known]
        off = (world[1] - world[0])[known]
        rates = [one.turn_rate_radps[known] for one in own]
        felt_off = (own[1].acceleration_mps2 - own[0].acceleration_mps2)[known]
        frames = [np.searchsorted(path.timebase.times_s, times_s[known]) for path in paths]
        turns = [
            Rotation.from_matrix(path.rotation[numbers])
            for path, numbers in zip(paths, frames, strict=True)
        ]
        vectors = (moved, felt_off, off[:, :2], off[:, 2:], rates[0], rates[1] - rates[0])
        values = [rms(np.linalg.norm(each, axis=1)) for each in vectors]
        turned_deg = np.degrees((turns[0].inv() * turns[1]).magnitude()).mean()
        rows.append([place, *(f"{value:.2f}" for value in values), f"{turned_deg:.0f}"])
    return rows


def _unturned(path: RigidPath) -> RigidPath:
    """The same places with the world's axes."""
    turns = np.broadcast_to(np.eye(3), path.rotation.shape)
    return RigidPath(path.timebase, path.position_m, turns, path.present)


TABLES = {
    "board": board_rows,
    "foot": foot_rows,
    "fit": fit_rows,
}


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("table", choices=TABLES)
    parser.add_argument("paths", nargs="*", type=Path, help="of what it is measured on")
    options = parser.parse_args()
    print(table(TABLES[options.table](*options.paths)))


if __name__ == "__main__":
    main()
