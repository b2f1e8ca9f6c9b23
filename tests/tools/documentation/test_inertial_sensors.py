"""Virtual inertial sensors beside real ones: a board and shoes that cameras tracked."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sd2core.imu.mounting import mounted
from sd2core.imu.signals import InertialSignals, imu_signals
from tools.documentation.inertial_sensors import (
    beside,
    board,
    board_beside,
    foot_beside,
)


@pytest.fixture(scope="module")
def recording(shared_data: Path) -> Path:
    return shared_data / "imu" / "broad" / "10_undisturbed_slow_translation_A.hdf5"


@pytest.mark.slow
def test_a_board_feels_what_the_sensor_on_it_measured(recording: Path) -> None:
    found = board_beside(recording)
    assert found.samples > 34_000
    assert found.acceleration_rms_mps2 <= 0.06
    assert found.turn_rate_rms_radps <= 0.025
    assert found.acceleration_correlation > 0.999
    assert abs(found.shift_s) < 0.005


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_walking_foot_feels_what_the_sensor_on_it_measured(shared_data: Path, side: str) -> None:
    acceleration, turn_rate, _ = foot_beside(shared_data / "imu" / "gaitmap", side)
    assert acceleration >= 0.86
    assert turn_rate >= 0.97


def test_the_comparison_finds_a_known_rotation_shift_and_offset(recording: Path) -> None:
    mesh, _, _ = board(recording)
    mesh = mesh.between(20_000, 24_000)
    path = mounted(mesh, 0).path(mesh)
    virtual = imu_signals(path, mesh.times_s, 6.0)
    turn = Rotation.from_rotvec([0.4, -1.0, 0.2])
    later = imu_signals(path, mesh.times_s[100:-100] - 0.02, 60.0)
    real = InertialSignals(
        later.times_s + 0.02,
        turn.apply(later.acceleration_mps2) + np.array([0.1, 0.2, -0.3]),
        turn.apply(later.turn_rate_radps) - 0.05,
    )
    inner = np.zeros(len(real.times_s), bool)
    inner[400:-400] = True
    found = beside(virtual, real, inner)
    assert found.shift_s == pytest.approx(0.02, abs=1e-9)
    # What is left: a low pass of the path, then of what is felt on it, are not quite the same.
    assert found.acceleration_rms_mps2 < 0.02
    assert found.turn_rate_rms_radps < 0.005
