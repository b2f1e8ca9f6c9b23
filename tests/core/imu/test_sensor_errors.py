"""Errors of a sensor are those that were asked for."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from scipy.signal import welch

from sd2core.errors import Sd2Error
from sd2core.imu.sensor_errors import with_errors
from sd2core.imu.signals import InertialSignals
from sd2core.options.inertial import SensorErrors


def constant(samples: int, rate_hz: float, value: float = 0.0) -> InertialSignals:
    times_s = np.arange(samples) / rate_hz
    return InertialSignals(times_s, np.full((samples, 3), value), np.full((samples, 3), value))


@pytest.mark.parametrize("rate_hz", [50.0, 400.0])
def test_noise_has_its_density_at_all_frequencies_and_rates(rate_hz: float) -> None:
    errors = SensorErrors(acceleration_noise=0.02, turn_rate_noise=0.003, seed=4)
    noisy = with_errors(constant(100_000, rate_hz), errors)
    for values, density in ((noisy.acceleration_mps2, 0.02), (noisy.turn_rate_radps, 0.003)):
        _, power = welch(values, fs=rate_hz, nperseg=1000, axis=0)
        bands = np.sqrt(power[1:-1].reshape(499, 3).reshape(-1, 3)[:495].reshape(5, 99, 3))
        np.testing.assert_allclose(bands.mean(axis=1), density, rtol=0.03)
        assert np.abs(np.corrcoef(values.T)[np.triu_indices(3, 1)]).max() < 0.02


def test_a_seed_gives_the_same_noise_again() -> None:
    ideal = constant(100, 100.0)
    one, same, other = (
        with_errors(ideal, SensorErrors(turn_rate_noise=1.0, seed=seed)) for seed in (1, 1, 2)
    )
    assert (one.turn_rate_radps == same.turn_rate_radps).all()
    assert (one.turn_rate_radps != other.turn_rate_radps).all()
    assert (one.acceleration_mps2 == 0.0).all()


def test_bias_is_added_before_the_range_clips() -> None:
    errors = SensorErrors(
        acceleration_bias_mps2=(0.5, 0.0, -12.5),
        turn_rate_bias_radps=(0.1, 0.2, 0.3),
        acceleration_range_mps2=2.0,
    )
    found = with_errors(constant(5, 100.0, 1.75), errors)
    np.testing.assert_allclose(found.acceleration_mps2, [[2.0, 1.75, -2.0]] * 5)
    np.testing.assert_allclose(found.turn_rate_radps, [[1.85, 1.95, 2.05]] * 5)


def test_what_is_not_known_stays_so() -> None:
    ideal = constant(4, 100.0, np.nan)
    errors = SensorErrors(acceleration_noise=1.0, turn_rate_range_radps=1.0)
    assert not with_errors(ideal, errors).known.any()


def test_the_samples_say_which_errors_they_have() -> None:
    meta = with_errors(constant(4, 100.0), SensorErrors(acceleration_noise=0.5, seed=3)).meta
    assert json.loads(json.dumps(meta["errors"])) == {"acceleration_noise": 0.5, "seed": 3}
    none = SensorErrors(acceleration_noise=0.0, turn_rate_bias_radps=(0.0, 0.0, 0.0), seed=3)
    assert with_errors(ideal := constant(4, 100.0), none) is ideal


@pytest.mark.parametrize(
    "wrong",
    [
        {"acceleration_noise": -0.1},
        {"turn_rate_noise": math.inf},
        {"acceleration_range_mps2": 0.0},
        {"turn_rate_range_radps": math.nan},
        {"acceleration_bias_mps2": (0.0, math.nan, 0.0)},
        {"seed": -1},
    ],
)
def test_numbers_that_cannot_be_are_refused(wrong: dict) -> None:
    with pytest.raises(Sd2Error):
        with_errors(constant(4, 100.0), SensorErrors(**wrong))
