"""Compression: invertible, the same for all cells, with a root mean square of 1."""

from __future__ import annotations

import json

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from sd2core.denoise.scaling import Compression, Scaling
from sd2core.errors import Sd2Error

exponents = st.floats(0.1, 1.0)
references = st.floats(1e-9, 1e6)


@given(references, exponents, st.lists(st.floats(0.0, 1e4, width=32), min_size=1))
def test_expanding_undoes_compressing(
    reference: float, exponent: float, multiples: list[float]
) -> None:
    compression = Compression(reference, exponent)
    energies = np.array(multiples) * reference
    back = compression.expand(compression.compress(energies))
    np.testing.assert_allclose(back, energies, rtol=1e-9, atol=1e-30)


@given(references, exponents, st.lists(st.floats(-5.0, 5.0, width=32), min_size=1))
def test_energies_are_never_negative_and_keep_their_order(
    reference: float, exponent: float, answers: list[float]
) -> None:
    energies = Compression(reference, exponent).expand(np.array(answers))
    assert (energies >= 0).all()
    assert (energies[np.array(answers) <= 0] == 0).all()
    assert (np.diff(energies[np.argsort(answers)]) >= 0).all()


def test_known_values() -> None:
    amplitude = Compression(4.0, 0.5)
    np.testing.assert_array_equal(
        amplitude.compress(np.array([0.0, 1.0, 4.0, 36.0])), [0, 0.5, 1, 3]
    )
    np.testing.assert_array_equal(amplitude.expand(np.array([-2.0, 0.0, 0.5, 3.0])), [0, 0, 1, 36])


@given(st.sampled_from([0.25, 0.5, 1.0]), st.integers(0, 100), st.floats(1e-6, 1e6))
def test_fitted_on_data_their_root_mean_square_is_one(
    exponent: float, seed: int, gain: float
) -> None:
    random = np.random.default_rng(seed)
    stretches = [gain * random.exponential(size=(frames, 8)) for frames in (5, 40)]
    for values in stretches:
        values[:, [2, 3]] = 0.0
    compression = Compression.fitted(stretches, (2, 3), exponent)
    counted = np.delete(np.concatenate(stretches), [2, 3], axis=1)
    assert np.sqrt((compression.compress(counted) ** 2).mean()) == pytest.approx(1.0)


def test_the_reference_of_amplitudes_is_the_mean_energy() -> None:
    values = np.array([[1.0, 3.0], [8.0, 0.0]])
    assert Compression.fitted([values], (), 0.5).reference == pytest.approx(3.0)
    assert Compression.fitted([values], (1,), 0.5).reference == pytest.approx(4.5)


def test_torch_and_numpy_agree_in_single_precision() -> None:
    compression = Compression(0.013, 0.37)
    values = np.random.default_rng(0).normal(size=(7, 5)).astype(np.float32)
    for work in (compression.expand, lambda x: compression.compress(abs(x))):
        of_numpy, of_torch = work(values), work(torch.from_numpy(values))
        assert of_numpy.dtype == np.float32
        assert of_torch.dtype == torch.float32
        np.testing.assert_allclose(of_torch.numpy(), of_numpy, rtol=1e-5)


def test_it_survives_json() -> None:
    scaling = Scaling(Compression(0.1, 0.5), Compression(1 / 3, 0.25), 1e-4)
    assert Scaling.from_json(json.loads(json.dumps(scaling.to_json()))) == scaling


def test_models_of_before_there_was_a_floor_have_none() -> None:
    told = Scaling(Compression(0.1), Compression(0.2), 1e-4).to_json()
    del told["target_floor"]
    assert Scaling.from_json(told).floor == 0.0


def test_the_floor_is_half_of_the_weakest_that_the_radar_shows() -> None:
    inputs = [np.ones((2, 3), np.float32), np.ones((1, 3), np.float32)]
    targets = [np.array([[0, 2.0, 5.0], [0, 0, 0.3]]), np.array([[0, 0, 0.0]])]
    found = Scaling.fitted(inputs, [one.astype(np.float32) for one in targets])
    assert found.floor == pytest.approx(0.15)


def test_silence_has_no_scale() -> None:
    with pytest.raises(Sd2Error, match="no energy"):
        Compression.fitted([np.zeros((3, 4), np.float32)])
    with pytest.raises(Sd2Error, match="no energy"):
        Compression.fitted([])


@pytest.mark.parametrize(
    ("reference", "exponent"), [(0.0, 0.5), (-1.0, 0.5), (np.inf, 0.5), (1.0, 0.0), (1.0, 1.5)]
)
def test_what_is_no_compression_is_refused(reference: float, exponent: float) -> None:
    with pytest.raises(Sd2Error):
        Compression(reference, exponent)
