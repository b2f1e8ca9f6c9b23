"""Denoisers that take the maps of the parts of the body."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch
from denoisers import CAUSAL, SMALL, energies, synthetic_map, trained
from numpy.typing import NDArray

from sd2core.denoise.card import KINEMATICS_COLUMNS, ModelCard
from sd2core.denoise.files import load_model, save_model
from sd2core.denoise.live import TrainedDenoiser
from sd2core.denoise.model import fit_standards
from sd2core.denoise.registry import FILTERS
from sd2core.errors import Sd2Error
from sd2core.maps import DopplerMap, LimbMaps
from sd2core.mesh.vertex_parts import JOINTS, KINEMATICS, QUANTITIES, mirrored_columns

PARTS = ("trunk", "forearm", "lower_leg")
MOVING = (KINEMATICS,)
SIDES = ("trunk", "forearm.L", "forearm.R", "lower_leg.L", "lower_leg.R")
NETWORKS = [name for name in SMALL if name not in FILTERS]


def split_map(frames: int, rate_hz: float = 30.0) -> DopplerMap:
    """A map of five limb maps."""
    limbs = np.stack([energies(frames, seed).T for seed in range(len(SIDES))])
    limbs[:, 14:17] = 0.0
    whole = limbs.sum(axis=0)
    return synthetic_map(whole.T, rate_hz, limbs=LimbMaps(SIDES, limbs))


def columns(doppler: DopplerMap) -> NDArray[np.float32]:
    assert doppler.limbs is not None
    return doppler.limbs.inputs(PARTS)


@pytest.mark.one_in(5)
@pytest.mark.parametrize("name", NETWORKS)
@pytest.mark.parametrize(("frames", "bins"), [(72, 32), (7, 20)])
def test_all_of_the_parts_count(name: str, frames: int, bins: int) -> None:
    network = trained(name, bins=bins, parts=PARTS).network.eval()
    values = torch.rand(2, frames, 3 * bins)
    with torch.no_grad():
        answer = network(values)
        assert answer.shape == (2, frames, bins)
        for part in range(3):
            other = values.clone()
            other[..., part * bins : (part + 1) * bins] += 1.0
            assert not torch.allclose(network(other), answer)


@pytest.mark.parametrize("name", NETWORKS)
def test_every_network_takes_kinematics(name: str) -> None:
    """Beside the map; what learnt them standardises them."""
    network = trained(name, parts=MOVING).network.eval()
    values = torch.randn(2, 72, 32 + KINEMATICS_COLUMNS) + 3.0
    with torch.no_grad():
        before = network(values)
        assert before.shape == (2, 72, 32)
        for column in (0, 32, 31 + KINEMATICS_COLUMNS):
            other = values.clone()
            other[..., column] += 1.0
            assert not torch.allclose(network(other), before)
        fit_standards(network, values.flatten(0, 1))
        moved = values.clone()
        moved[..., 32:] *= 5.0
        fitted = network(values)
        fit_standards(network, moved.flatten(0, 1))
        torch.testing.assert_close(network(moved), fitted, rtol=1e-3, atol=1e-3)
        if name in CAUSAL:
            first, state = network.chunk(moved[:, :11], network.initial_state(2))
            then, state = network.chunk(moved[:, 11, None], state)
            both = torch.cat([first, then], 1)
            torch.testing.assert_close(both, network(moved[:, :12]), rtol=1e-3, atol=1e-3)


def test_left_and_right_exchanged_twice_are_as_before() -> None:
    order, signs = mirrored_columns()
    values = np.random.default_rng(0).normal(size=(4, KINEMATICS_COLUMNS)).astype(np.float32)
    once = values[:, order] * signs
    np.testing.assert_array_equal(once[:, order] * signs, values)
    width = len(QUANTITIES)
    for left, right in (("hand.L", "hand.R"), ("knee.L", "knee.R"), ("trunk", "trunk")):
        one, two = (once[:, JOINTS.index(left) * width :], values[:, JOINTS.index(right) * width :])
        flipped = np.where(np.array(QUANTITIES) == "aside_m", -1.0, 1.0)
        np.testing.assert_array_equal(one[:, :width], two[:, :width] * flipped)


def test_a_body_that_stands_still_is_not_seen() -> None:
    model = trained("gru", parts=MOVING)
    values = np.random.default_rng(0).random((5, 32 + KINEMATICS_COLUMNS)).astype(np.float32)
    assert model.denoise_values(values).any(axis=1).all()
    values[3, :32] = 0.0
    assert model.denoise_values(values).any(axis=1).tolist() == [True, True, True, False, True]


def test_the_file_of_a_model_of_kinematics(tmp_path: Path) -> None:
    model = trained("s4", parts=MOVING)
    fit_standards(model.network, torch.randn(50, KINEMATICS_COLUMNS))
    save_model(tmp_path / "moving.safetensors", model)
    again = load_model(tmp_path / "moving.safetensors")
    assert (again.card.inputs, again.card.scaling.more) == ("kinematics", KINEMATICS_COLUMNS)
    values = np.random.default_rng(0).random((30, 32 + KINEMATICS_COLUMNS)).astype(np.float32)
    np.testing.assert_array_equal(again.denoise_values(values), model.denoise_values(values))


@pytest.mark.parametrize("name", [name for name in CAUSAL if name in NETWORKS])
def test_chunks_equal_the_whole(name: str) -> None:
    network = trained(name, parts=PARTS).network.eval()
    values = torch.rand(1, 30, 96)
    with torch.no_grad():
        first, state = network.chunk(values[:, :11], network.initial_state())
        rest, _ = network.chunk(values[:, 11:], state)
        torch.testing.assert_close(
            torch.cat([first, rest], 1), network(values), rtol=1e-5, atol=1e-5
        )


@pytest.mark.one_in(2)
@pytest.mark.parametrize("name", ["s4", "unet"])
def test_live_and_whole_maps(name: str) -> None:
    model, doppler = trained(name, parts=PARTS), split_map(90)
    denoised = model.denoise(doppler)
    assert denoised.limbs is None
    assert denoised.values.shape == doppler.values.shape
    live = model.live()
    stepped = np.stack([live.step(frame) for frame in columns(doppler)]).T
    if live.equals_batch:
        np.testing.assert_allclose(stepped, denoised.values, rtol=1e-3, atol=1e-7)
    assert stepped.shape == denoised.values.shape
    with pytest.raises(Sd2Error, match=r"shape \(1, 32\).*\(frames, 96\)"):
        live.step(doppler.values[:, 0])


def test_another_frame_rate_is_interpolated() -> None:
    model, doppler = trained("gru", parts=PARTS), split_map(40, rate_hz=20.0)
    assert model.denoise(doppler).values.shape == (32, 40)


def test_a_map_that_is_not_split_is_refused() -> None:
    model = trained("gru", parts=PARTS)
    with pytest.raises(Sd2Error, match=r"not split by the parts.*limb maps.*--limbs"):
        model.denoise(synthetic_map(energies(20)))
    # One that takes the map does not mind the limbs.
    split = split_map(20)
    plain = trained("gru")
    np.testing.assert_array_equal(
        plain.denoise(split).values, plain.denoise(synthetic_map(split.values.T)).values
    )


def test_the_file_says_what_goes_in(tmp_path: Path) -> None:
    model = trained("s4", parts=PARTS)
    save_model(tmp_path / "limbs.safetensors", model)
    again = load_model(tmp_path / "limbs.safetensors")
    assert (again.card.parts, again.card.inputs, again.card.features) == (PARTS, "limbs", 96)
    doppler = split_map(30)
    np.testing.assert_array_equal(again.denoise(doppler).values, model.denoise(doppler).values)
    old = model.card.to_json()
    del old["parts"]
    assert ModelCard.from_json(old).inputs == "map"
    with pytest.raises(Sd2Error, match="takes 3 maps and 0 numbers, its card says 1 and 0"):
        TrainedDenoiser(model.network, trained("s4").card)
