"""A map drawn as the radar would show it has the mean that it was drawn of, and its speckle."""

from __future__ import annotations

from dataclasses import asdict, replace

import numpy as np
import pytest
from denoisers import energies, synthetic_map, trained
from hypothesis import given, settings
from hypothesis import strategies as st

from sd2core.denoise.card import ModelCard
from sd2core.denoise.texture import Texture
from sd2core.errors import Sd2Error

LAW = Texture(half=0.3, slope=1.5, floor=0.1, gain=0.9, looks=2.0, persistence=0.5)


def means(segments: int = 40, seed: int = 0) -> np.ndarray:
    """Of cells that do not change within a segment."""
    values = np.random.default_rng(seed).gamma(0.3, 1.0, (segments, 1, 29)) + 1e-6
    return np.repeat(values, 72, axis=1).astype(np.float32)


def drawn(law: Texture, of: np.ndarray) -> np.ndarray:
    return np.stack([law.drawn(one, (1, number)) for number, one in enumerate(of)])


@pytest.mark.parametrize("looks", [1.0, 4.0])
@pytest.mark.parametrize("persistence", [0.0, 0.4])
def test_a_law_is_found_again_in_what_it_drew(looks: float, persistence: float) -> None:
    law = replace(LAW, looks=looks, persistence=persistence)
    found = Texture.fitted(means(), drawn(law, means()))
    assert found is not None
    for name, value in asdict(law).items():
        near = 0.2 if name == "persistence" else 0.08
        assert getattr(found, name) == pytest.approx(value, rel=0.12, abs=near), name


def test_how_far_takes_are_from_the_answers_is_no_speckle() -> None:
    """Takes of other levels than the model's answers scatter no more than each does."""
    levels = np.random.default_rng(2).lognormal(0.0, 1.0, (40, 1, 1)).astype(np.float32)
    found = Texture.fitted(means() * levels, drawn(LAW, means()))
    assert found is not None
    assert found.looks == pytest.approx(LAW.looks, rel=0.15)


def test_power_is_that_of_the_law() -> None:
    """Share of frames that show, mean and variance, of one cell over many frames."""
    law = replace(LAW, persistence=0.0)
    mean = np.full((20_000, 1), 0.5, np.float32)
    shown = law.drawn(mean, (3,))
    there = shown[shown > 0]
    assert len(there) / len(shown) == pytest.approx(1 / (1 + (0.3 / 0.5) ** 1.5), abs=0.01)
    assert there.mean() == pytest.approx(0.1 + 0.9 * 0.5, rel=0.02)
    assert there.var() / there.mean() ** 2 == pytest.approx(1 / law.looks, rel=0.05)


@given(first=st.integers(0, 1100), frames=st.integers(1, 600), seed=st.integers(0, 2**40))
@settings(max_examples=30, deadline=None)
def test_a_stretch_is_drawn_as_in_the_whole(first: int, frames: int, seed: int) -> None:
    mean = energies(1700)
    whole = LAW.drawn(mean, (seed, 1))
    part = LAW.drawn(mean[first : first + frames], (seed, 1), first)
    np.testing.assert_array_equal(part, whole[first : first + frames])


@pytest.mark.parametrize("share", [0.1, 0.4, 0.8])
def test_the_mean_that_shows_in_a_share_of_the_frames(share: float) -> None:
    law = replace(LAW, persistence=0.0)
    mean = np.full((20_000, 1), law.mean_that_shows(share), np.float32)
    assert (law.drawn(mean, (5,)) > 0).mean() == pytest.approx(share, abs=0.015)


def test_what_is_empty_stays_empty() -> None:
    mean = energies(100)
    mean[30:40] = 0.0
    shown = LAW.drawn(mean, (0,))
    assert not shown[30:40].any()
    assert np.isfinite(shown).all()
    assert (shown >= 0).all()


def test_a_map_says_so_and_other_maps_get_other_speckle() -> None:
    one = trained("gru").denoise(synthetic_map(energies(80)))
    other = replace(one, values=one.values * np.float32(1.001))
    shown = LAW.on(one, 4)
    assert shown.meta["texture"] == {"seed": 4}
    assert "drawn as the radar would show it (seed 4)" in shown.meta["notes"][-1]
    np.testing.assert_array_equal(shown.values, LAW.on(one, 4).values)
    assert not np.array_equal(shown.values, LAW.on(one, 5).values)
    assert not np.array_equal(shown.values > 0, LAW.on(other, 4).values > 0)


def test_too_little_teaches_nothing() -> None:
    assert Texture.fitted(means(), np.zeros_like(means())) is None
    assert Texture.fitted(np.zeros_like(means()), means()) is None


def test_the_card_keeps_it() -> None:
    card = trained("gru", texture=LAW).card
    assert ModelCard.from_json(card.to_json()).texture == LAW
    assert card.needed_texture() == LAW
    with pytest.raises(Sd2Error, match="does not know the texture"):
        trained("gru").card.needed_texture()


@pytest.mark.parametrize("wrong", [{"looks": 0.0}, {"persistence": 1.0}, {"floor": -0.1}])
def test_laws_that_are_none(wrong: dict[str, float]) -> None:
    with pytest.raises(Sd2Error, match="A texture is"):
        replace(LAW, **wrong)
