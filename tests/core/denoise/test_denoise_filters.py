"""Filters find what they must where the answer is known."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from denoisers import energies

from sd2core.denoise.filters import fit_median, fit_ridge, fit_wiener
from sd2core.denoise.registry import FILTERS, build, fit_filter

NULLED = (14, 15, 16)


def takes(count: int, frames: int = 200) -> list[np.ndarray]:
    return [np.sqrt(energies(frames, seed)) for seed in range(count)]


def filtered(values: np.ndarray) -> np.ndarray:
    """0.5 of the frame before, 0.25 of the next higher bin, and a mean that falls."""
    before = np.concatenate([values[:1], values[:-1]])
    above = np.concatenate([values[:, 1:], values[:, -1:]], axis=1)
    return (0.5 * before + 0.25 * above + np.linspace(1, 0, 32)).astype(np.float32)


def test_wiener_recovers_a_linear_filter() -> None:
    inputs = takes(3)
    wiener = fit_wiener(inputs, [filtered(one) for one in inputs], NULLED)
    expected = np.zeros((9, 5))
    expected[7, 2], expected[8, 3] = 0.5, 0.25
    np.testing.assert_allclose(wiener.weight.view(9, 5), expected, atol=1e-4)
    counted = np.delete(np.arange(32), NULLED)
    np.testing.assert_allclose(wiener.mean[counted], np.linspace(1, 0, 32)[counted], atol=1e-3)
    unseen = np.sqrt(energies(50, 99))
    answer = wiener(torch.from_numpy(unseen)[None])[0].numpy()
    np.testing.assert_allclose(answer[:, counted], filtered(unseen)[:, counted], atol=1e-3)


def test_wiener_shrinks_towards_the_mean_as_the_closed_form_says() -> None:
    # White input of variance s², target = input signal of variance p with p / s² of it left.
    random = np.random.default_rng(0)
    clean = random.normal(size=(20_000, 32)).astype(np.float32)
    noisy = clean + 2.0 * random.normal(size=clean.shape).astype(np.float32)
    wiener = fit_wiener([noisy], [clean])
    expected = np.zeros((9, 5))
    expected[8, 2] = 1 / (1 + 2.0**2)
    np.testing.assert_allclose(wiener.weight.view(9, 5), expected, atol=0.01)


def test_wiener_without_fit_changes_nothing() -> None:
    values = torch.from_numpy(energies(30))[None]
    torch.testing.assert_close(build("wiener")(values), values)


def test_ridge_recovers_a_linear_map_of_all_bins() -> None:
    random = np.random.default_rng(0)
    across = random.normal(size=(32, 32)) / 32
    inputs = takes(10)
    goals = [(filtered(one) @ across).astype(np.float32) for one in inputs]
    ridge = fit_ridge(inputs[:9], goals[:9], NULLED)
    counted = np.delete(np.arange(32), NULLED)
    answer = ridge(torch.from_numpy(inputs[9])[None])[0].numpy()
    np.testing.assert_allclose(answer[8:, counted], goals[9][8:, counted], atol=2e-3)
    assert not answer[:, NULLED].any()


def test_ridge_is_larger_where_there_is_little_to_learn_from() -> None:
    """Noise that says nothing gets next to no weight, however few the takes."""
    random = np.random.default_rng(0)
    inputs = takes(10, frames=60)
    goals = [random.normal(2.0, 1.0, one.shape).astype(np.float32) for one in inputs]
    ridge = fit_ridge(inputs, goals)
    answer = ridge(torch.from_numpy(np.sqrt(energies(60, 99)))[None])[0].numpy()
    assert np.abs(answer - 2.0).mean() < 0.3


def test_ridge_without_fit_changes_nothing() -> None:
    values = torch.from_numpy(energies(30))[None]
    torch.testing.assert_close(build("ridge")(values), values)


def test_nulled_bins_do_not_count_in_a_fit() -> None:
    inputs = takes(2)
    targets = [filtered(one) for one in inputs]
    spoilt = [target.copy() for target in targets]
    for target in spoilt:
        target[:, list(NULLED)] = 1e3
    for name in ("median", "wiener", "ridge"):
        one, other = (fit_filter(name, inputs, goal, NULLED) for goal in (targets, spoilt))
        assert one[1] == other[1]
        for a, b in zip(one[0].parameters(), other[0].parameters(), strict=True):
            torch.testing.assert_close(a, b)


def test_the_median_is_the_median() -> None:
    values = energies(40)
    median = build("median", frames=3, width=3)
    answer = median(torch.from_numpy(values)[None])[0].numpy()
    for frame, number in [(2, 1), (17, 30), (39, 12)]:
        around = values[frame - 2 : frame + 1, number - 1 : number + 2]
        assert answer[frame, number] == np.median(around)


def test_the_median_that_made_the_targets_is_chosen() -> None:
    inputs = takes(2)
    maker = build("median", frames=5, width=3)
    targets = [3.0 * maker(torch.from_numpy(one)[None])[0].numpy() for one in inputs]
    median = fit_median(inputs, targets, NULLED)
    assert (median.frames, median.width) == (5, 3)
    assert float(median.level) == pytest.approx(3.0, rel=1e-5)


def test_a_speck_is_removed_by_the_median() -> None:
    values = np.full((20, 32), 0.1, np.float32)
    values[9, 20] = 5.0
    answer = build("median")(torch.from_numpy(values)[None])[0]
    torch.testing.assert_close(answer, torch.full_like(answer, 0.1))


@pytest.mark.parametrize("name", FILTERS)
def test_silence_stays_silent(name: str) -> None:
    nothing = [np.zeros((30, 32), np.float32)]
    network, _ = fit_filter(name, nothing, nothing)
    assert not network(torch.zeros(1, 30, 32)).any()
