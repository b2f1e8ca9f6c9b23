"""The same motion through the radar signal and through counting."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sd2core.doppler import PRESETS, Synthesizer
from sd2core.fmcw import SignalOptions, doppler_map, simulate_capture
from sd2core.mesh import MeshSequence
from sd2core.sensor import PAPER_RADAR, VelocityAxis, VirtualSensor
from sd2core.spectrum import DopplerMap
from sd2core.timebase import Timebase

AXIS = VelocityAxis()
FRAMES = 60
TIMES_S = np.arange(FRAMES) / 30.0


def plate(distance_m: np.ndarray) -> MeshSequence:
    """Plate of 0.1 m across the optical axis, facing the camera, moving along it."""
    cells = 6
    grid = np.linspace(-0.05, 0.05, cells + 1)
    x, y = np.meshgrid(grid, grid, indexing="ij")
    corner = np.arange((cells + 1) * cells).reshape(cells, cells + 1)[:, :-1].ravel()
    a, b, c, d = corner, corner + 1, corner + cells + 1, corner + cells + 2
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([b, d, c], 1)])
    vertices = np.zeros((len(distance_m), x.size, 3), dtype=np.float32)
    vertices[..., 0], vertices[..., 1] = x.ravel(), y.ravel()
    vertices[..., 2] = distance_m[:, None]
    return MeshSequence(vertices, faces.astype(np.int32), Timebase(TIMES_S))


def both(mesh: MeshSequence, sensor: VirtualSensor) -> tuple[DopplerMap, DopplerMap]:
    counted = Synthesizer(mesh, replace(PRESETS["paper"], null_bins=())).map(sensor)
    capture = simulate_capture(mesh, PAPER_RADAR, sensor=sensor, options=SignalOptions(snr_db=20.0))
    return counted, doppler_map(capture, axis=AXIS)


def test_a_plate_at_1_3_metres_per_second() -> None:
    counted, measured = both(plate(4.0 - 1.3 * TIMES_S), VirtualSensor())
    assert (counted.axis, measured.axis) == (AXIS, AXIS)
    np.testing.assert_allclose(counted.times_s, measured.times_s, atol=1e-9)
    for found in (counted, measured):
        off = np.abs(found.peak_velocity_mps() - 1.3)
        assert off.max() <= AXIS.bin_width_mps
    apart = np.abs(counted.peak_velocity_mps() - measured.peak_velocity_mps())
    assert apart.max() <= AXIS.bin_width_mps


@pytest.mark.parametrize("position_m", [(0.0, 0.0, 0.0), (0.5, -0.3, 0.4)])
def test_a_swinging_plate(position_m: tuple[float, float, float]) -> None:
    # +-1.5 m/s at 0.7 Hz; seen from the side only the part along the line of sight.
    swing_m = 1.5 / (2 * np.pi * 0.7) * np.sin(2 * np.pi * 0.7 * TIMES_S)
    counted, measured = both(plate(2.4 - swing_m), VirtualSensor(position_m=position_m))
    apart = np.abs(counted.peak_velocity_mps() - measured.peak_velocity_mps())
    assert apart.max() <= AXIS.bin_width_mps + 1e-9
    # Neither is late: the best lag of one against the other is 0.
    a, b = counted.peak_velocity_mps(), measured.peak_velocity_mps()
    mismatch = {lag: np.abs(a[2:-2] - np.roll(b, lag)[2:-2]).mean() for lag in (-2, -1, 0, 1, 2)}
    assert min(mismatch, key=lambda lag: mismatch[lag]) == 0
