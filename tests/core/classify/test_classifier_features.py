"""Features: causal, free of gain, and what closed forms say."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from classifiers import AXIS, NULLED, RATE_HZ, energies, features
from hypothesis import given, settings
from hypothesis import strategies as st

from sd2core.classify.features import KINDS, NOISE_S, RANGE, STANDS_OUT, Features
from sd2core.denoise.metrics import stands_out
from sd2core.errors import Sd2Error
from sd2core.maps import peak_velocity_mps


def noise(frames: int, seed: int = 0) -> np.ndarray:
    values = np.random.default_rng(seed).exponential(1.0, (frames, AXIS.bins))
    values[:, list(NULLED)] = 0.0
    return values


def test_the_peak_is_the_velocity_of_the_strongest_bin() -> None:
    values = np.ones((60, AXIS.bins))
    values[:, list(NULLED)] = 0.0
    bins = np.array([0, 3, 13, 17, 25, 31] * 10)
    values[np.arange(60), bins] = 500.0
    found, _ = features("peak").of(values)
    np.testing.assert_allclose(found[:, 0], AXIS.centres_mps[bins] / AXIS.v_max_mps, atol=1e-6)
    np.testing.assert_array_equal(found[:, 1], 1.0)


def test_a_frame_of_noise_has_no_target_and_its_velocity_is_0() -> None:
    values = np.ones((100, AXIS.bins))
    values[:, list(NULLED)] = 0.0
    values[40:60, 20] = STANDS_OUT + 0.1
    values[60:80, 20] = STANDS_OUT - 0.1
    found, _ = features("peak").of(values)
    np.testing.assert_array_equal(found[:, 1], np.isin(np.arange(100), np.arange(40, 60)))
    np.testing.assert_array_equal(found[:40], 0.0)
    np.testing.assert_array_equal(found[60:], 0.0)


def test_targets_are_those_that_stand_out_of_the_whole_take() -> None:
    """Where the noise stays the same, what is known so far is what is known in the end."""
    values = energies(450).astype(np.float64)
    found, _ = features("peak").of(values)
    np.testing.assert_array_equal(found[:, 1] > 0, stands_out(values, NULLED))
    wanted = np.where(found[:, 1] > 0, peak_velocity_mps(values, AXIS), 0.0)
    np.testing.assert_allclose(found[:, 0] * AXIS.v_max_mps, wanted, atol=1e-6)


def test_columns_are_0_at_nothing_and_3_at_forty_db_over_the_noise() -> None:
    values = np.ones((10, AXIS.bins))
    values[:, list(NULLED)] = 0.0
    values[:, 5] = RANGE
    values[:, 7] = 0.0
    found, _ = features().of(values)
    np.testing.assert_allclose(found[:, 5], 3.0, atol=1e-3)
    np.testing.assert_array_equal(found[:, [7, *NULLED]], 0.0)
    np.testing.assert_allclose(found[:, 20], np.log10(1.1), atol=1e-6)


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=25, deadline=None)
@given(gain=st.floats(1e-12, 1e12), seed=st.integers(0, 5))
def test_gain_changes_nothing(kind: str, gain: float, seed: int) -> None:
    values = energies(80, seed).astype(np.float64)
    one, _ = features(kind).of(values)
    other, _ = features(kind).of(values * gain)
    np.testing.assert_allclose(other, one, atol=1e-5)


@pytest.mark.one_in(2)
@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=25, deadline=None)
@given(cuts=st.lists(st.integers(0, 400), max_size=5))
def test_pieces_equal_the_whole(kind: str, cuts: list[int]) -> None:
    shown = features(kind)
    values = energies(400)
    whole, last = shown.of(values)
    heard, parts, edges = None, [], [0, *sorted(cuts), 400]
    for start, stop in pairwise(edges):
        part, heard = (
            shown.of(values[start:stop]) if heard is None else shown.of(values[start:stop], heard)
        )
        parts.append(part)
    np.testing.assert_allclose(np.concatenate(parts), whole, atol=1e-6)
    assert heard is not None
    np.testing.assert_array_equal(heard.medians, last.medians)
    assert heard.loudest_log == pytest.approx(last.loudest_log)
    assert len(heard.medians) == round(NOISE_S * RATE_HZ)


def test_emptied_bins_are_not_looked_at() -> None:
    values = energies(50)
    other = values.copy()
    other[:, list(NULLED)] = 1e6
    np.testing.assert_array_equal(features().of(values)[0], features().of(other)[0])


def test_the_noise_is_that_of_the_last_seconds() -> None:
    """A radar that becomes louder: after five seconds its noise is no target."""
    values = noise(600)
    values[300:] *= 1e3
    found, _ = features("peak").of(values)
    assert found[300:360, 1].mean() > 0.9
    assert found[460:, 1].mean() < 0.05


def test_an_empty_map_has_no_target() -> None:
    for kind in KINDS:
        found, _ = features(kind).of(np.zeros((30, AXIS.bins)))
        np.testing.assert_array_equal(found, 0.0)


def test_a_synthetic_map_without_noise_has_targets() -> None:
    values = np.zeros((30, AXIS.bins))
    values[10:20, 25] = 0.01
    found, _ = features("peak").of(values)
    np.testing.assert_array_equal(found[:, 1], np.isin(np.arange(30), np.arange(10, 20)))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: features("colour"), "features are 'colour'"),
        (lambda: Features("peak", AXIS, tuple(range(32)), 30.0), "All 32 bins"),
        (lambda: features().of(np.zeros((3, 31))), r"\(3, 31\)"),
        (lambda: features().of(np.zeros(32)), r"\(32,\)"),
    ],
)
def test_what_makes_no_sense_is_refused(make, words: str) -> None:
    with pytest.raises(Sd2Error, match=words):
        make()
