"""Movements that a model has not learnt from stay the synthetic map's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from denoisers import energies, synthetic_map, trained
from hypothesis import given, settings
from hypothesis import strategies as st
from small_pairs import write_pairs

from sd2core.denoise.card import ModelCard
from sd2core.denoise.files import describe_model
from sd2core.denoise.known import KnownMovements
from sd2core.denoise.live import TrainedDenoiser
from sd2core.errors import Sd2Error
from sd2core.maps import DopplerMap, LimbMaps
from sd2core.mesh.vertex_parts import JOINTS, KINEMATICS, PARTS, QUANTITIES
from sd2core.options.training import DataConfig, ModelConfig, TrainConfig, TrainingConfig
from sd2core.pairs.store import read_pairs
from sd2core.sensor import VelocityAxis
from sd2core.train.start import begin

AXIS = VelocityAxis(32, 2.0)
KNOWN = KnownMovements(-0.5, 0.5, 0.6, 3.0)
CENTRES = AXIS.centres_mps


def frames_at(*bins: int, values: float = 1.0) -> np.ndarray:
    """Frames each with energy in one bin."""
    made = np.zeros((len(bins), 32), np.float32)
    made[np.arange(len(bins)), bins] = values
    return made


def knowing(name: str, **card: object) -> TrainedDenoiser:
    return TrainedDenoiser(
        trained(name, **card).network, replace(trained(name, **card).card, known=KNOWN)
    )


@given(bin_number=st.integers(0, 31))
def test_a_frame_is_strange_by_how_far_its_velocity_is_from_what_is_known(bin_number: int) -> None:
    share = KNOWN.strangeness(frames_at(bin_number), AXIS)[0]
    beyond = max(abs(CENTRES[bin_number]) - 0.5, 0.0)
    assert share == pytest.approx(min(beyond / 0.15, 1.0), abs=1e-5)


def test_what_two_models_know_is_known_together_at_the_last_ones_gain() -> None:
    together = KNOWN.together(KnownMovements(-0.7, 0.2, 0.3, 9.0))
    assert together == KnownMovements(-0.7, 0.5, 0.6, KNOWN.gain)
    assert KNOWN.together(None) == KNOWN


def test_what_is_spread_too_far_is_strange_and_an_empty_frame_is_not() -> None:
    both = frames_at(8) + frames_at(23)  # ±1 m/s: a mean of 0
    assert KNOWN.strangeness(both, AXIS)[0] == 1.0
    assert KNOWN.strangeness(np.zeros((1, 32), np.float32), AXIS)[0] == 0.0


@settings(max_examples=30)
@given(seed=st.integers(0, 10**6), gain=st.floats(0.01, 100.0))
def test_nothing_learnt_from_is_strange_but_what_is_rare(seed: int, gain: float) -> None:
    rng = np.random.default_rng(seed)
    inputs = [rng.random((200, 32)).astype(np.float32) for _ in range(3)]
    inputs[0][:20] = 0.0
    pairs = [(values, np.float32(gain) * values) for values in inputs]
    known = KnownMovements.of(pairs, AXIS)
    assert known is not None
    assert known.gain == pytest.approx(gain, rel=1e-4)
    shares = known.strangeness(np.concatenate(inputs), AXIS)
    assert (shares > 0).mean() < 0.01
    assert KnownMovements.of([(0 * inputs[0], inputs[1])], AXIS) is None


@pytest.mark.parametrize("parts", [(), ("trunk", "forearm"), (KINEMATICS,)])
@pytest.mark.parametrize("name", ["s4", "unet"])
def test_the_synthetic_map_is_passed_through(name: str, parts: tuple[str, ...]) -> None:
    model, plain = knowing(name, parts=parts), trained(name, parts=parts)
    slow = energies(40)
    slow[:, :12] = slow[:, 20:] = 0.0
    fast = frames_at(*[28] * 40, values=0.3)
    values = np.concatenate([slow, fast])
    limbs = np.zeros((len(PARTS), 32, 80), np.float32)
    limbs[0], limbs[3] = 0.25 * values.T, 0.75 * values.T
    rng = np.random.default_rng(0)
    moves = rng.normal(size=(len(JOINTS), len(QUANTITIES), 80)).astype(np.float32)
    doppler = synthetic_map(values, limbs=LimbMaps(PARTS, limbs, moves))
    denoised, as_before = model.denoise(doppler), plain.denoise(doppler)
    np.testing.assert_allclose(denoised.values[:, :40], as_before.values[:, :40], rtol=1e-6)
    passed = 3.0 * values.T[:, 40:]
    np.testing.assert_allclose(denoised.values[:, 40:], passed, rtol=1e-4, atol=1e-6)
    (note,) = denoised.meta["notes"]
    assert "40 of 80 frames move otherwise" in note
    assert "-0.50 to 0.50 m/s" in note
    assert "notes" not in as_before.meta
    if model.network.causal and parts != (KINEMATICS,):
        live = model.live()
        assert doppler.limbs is not None
        given_values = doppler.limbs.inputs(parts) if parts else values
        stepped = np.array([live.step(frame) for frame in given_values]).T
        np.testing.assert_allclose(stepped, denoised.values, rtol=1e-3, atol=1e-6)


@given(
    trust=st.just(0.0) | st.floats(0.01, 1.0),
    mine=st.floats(0.0, 10.0),
    theirs=st.floats(0.0, 10.0),
)
def test_amplitudes_are_mixed_as_trust_says(trust: float, mine: float, theirs: float) -> None:
    known = replace(KNOWN, trust=trust)
    answer, energies = frames_at(17, values=mine), frames_at(17, values=theirs)
    mixed = known.mixed(answer, energies, AXIS)[0, 17]
    wanted = (trust * np.sqrt(mine) + (1.0 - trust) * np.sqrt(KNOWN.gain * theirs)) ** 2
    assert mixed == pytest.approx(wanted, rel=1e-4, abs=1e-6)
    floored = known.mixed(answer, energies, AXIS, floor=2.0 * float(mixed) + 1e-3)[0, 17]
    assert floored == (0.0 if trust > 0.0 else pytest.approx(mixed))


@settings(max_examples=20)
@given(seed=st.integers(0, 10**6))
def test_who_answers_as_the_radar_is_trusted_and_who_answers_noise_is_not(seed: int) -> None:
    rng = np.random.default_rng(seed)
    shape = (6, 40, 32)
    radar = rng.gamma(1.0, size=shape).astype(np.float32)
    near = (radar * rng.uniform(0.5, 1.5, shape) / KNOWN.gain).astype(np.float32)
    noise = rng.gamma(1.0, size=shape).astype(np.float32)
    wide = replace(KNOWN, spread_mps=2.0)
    moving = np.ones(shape[:2], bool)
    moving[0] = False
    assert wide.trusting(radar, noise, radar, moving, AXIS).trust == 1.0
    assert wide.trusting(noise, near, radar, moving, AXIS).trust == 0.0
    assert wide.trusting(noise, near, radar, 0 * moving, AXIS) == wide


def test_a_run_learns_what_it_knows(tmp_path) -> None:  # type: ignore[no-untyped-def]
    pairs = write_pairs(tmp_path / "pairs.zarr")
    config = TrainConfig(
        DataConfig(pairs=(pairs,), segment_frames=24, overlap_frames=4),
        ModelConfig(name="gru", options={"channels": 4, "depth": 1}),
        TrainingConfig(epochs=1),
    )
    ending = begin(config, tmp_path / "run")
    assert ending.model is not None
    takes = read_pairs(pairs).of(["s1"]).takes
    wanted = KnownMovements.of(
        [(take.synthetic, take.radar) for take in takes], read_pairs(pairs).axis
    )
    known = describe_model(ending.model).known
    assert known is not None
    assert replace(known, trust=1.0) == wanted


def test_cards_of_before_and_nonsense() -> None:
    card = knowing("gru").card
    assert ModelCard.from_json(card.to_json()).known == KNOWN
    old = card.to_json()
    del old["known"]
    assert ModelCard.from_json(old).known is None
    untrusting = card.to_json()
    del untrusting["known"]["trust"]
    assert ModelCard.from_json(untrusting).known == KNOWN
    for wrong in ({"gain": -1.0}, {"slowest_mps": 2.0}, {"trust": 1.5}, {"other": 1.0}):
        content = card.to_json()
        content["known"] = {**content["known"], **wrong}
        with pytest.raises(Sd2Error):
            ModelCard.from_json(content)


def test_a_map_of_radar_units_is_not_touched_without_ranges() -> None:
    doppler: DopplerMap = synthetic_map(frames_at(28, 28, 28))
    plain = trained("gru")
    assert "notes" not in plain.denoise(doppler).meta
