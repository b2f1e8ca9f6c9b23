"""A model of limbs or kinematics answers each person of a scene, and the answers add up."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from denoisers import energies, synthetic_map, trained

from sd2core.batch.denoising import denoise
from sd2core.denoise.files import save_model
from sd2core.errors import Sd2Error
from sd2core.maps import DopplerMap, LimbMaps
from sd2core.mesh.vertex_parts import JOINTS, KINEMATICS, PARTS, QUANTITIES

INPUTS = [("trunk", "forearm"), (KINEMATICS,)]


def one_person(frames: int, seed: int) -> LimbMaps:
    values = np.stack([energies(frames, 10 * seed + part).T for part in range(len(PARTS))])
    moves = np.random.default_rng(seed).normal(size=(len(JOINTS), len(QUANTITIES), frames))
    return LimbMaps(PARTS, values, moves.astype(np.float32))


def map_of(limbs: LimbMaps) -> DopplerMap:
    return synthetic_map(limbs.values.sum(axis=0).T, limbs=limbs)


def scene(frames: int = 90) -> tuple[DopplerMap, list[DopplerMap]]:
    """A map of two, and those of each alone."""
    each = [one_person(frames, seed) for seed in (1, 2)]
    return map_of(LimbMaps.of_persons(each, ("anna", "ben"))), [map_of(one) for one in each]


@pytest.mark.parametrize("parts", INPUTS)
@pytest.mark.parametrize("name", ["s4", "unet"])
def test_answers_add_up(name: str, parts: tuple[str, ...]) -> None:
    model, (both, each) = trained(name, parts=parts), scene()
    expected = sum(model.denoise(one).values for one in each)
    np.testing.assert_allclose(model.denoise(both).values, expected, rtol=1e-5, atol=1e-8)
    told: list[tuple[int, int]] = []
    model.denoise(both, lambda *one: told.append(one))
    assert told == sorted(told)
    assert told[-1] == (90, 90)


@pytest.mark.one_in(2)
@pytest.mark.parametrize("parts", INPUTS)
def test_live_frames_and_files_too(tmp_path: Path, parts: tuple[str, ...]) -> None:
    model, (both, _) = trained("s4", parts=parts), scene()
    there = np.ones(90, bool)
    there[40:45] = False
    both = replace(both, present=there)
    whole = model.denoise(both).values
    assert both.limbs is not None
    rows, live = both.limbs.inputs(parts), model.live()
    stepped = np.stack([live.step(row, known) for row, known in zip(rows, there, strict=True)])
    np.testing.assert_allclose(stepped.T, whole, rtol=1e-3, atol=1e-7)
    np.testing.assert_allclose(model.live().advance(rows, there).T, whole, rtol=1e-3, atol=1e-7)
    save_model(tmp_path / "model.safetensors", model)
    both.save(tmp_path / "both.npz")
    denoise(tmp_path / "both.npz", str(tmp_path / "model.safetensors"), tmp_path / "out.npz")
    found = DopplerMap.load(tmp_path / "out.npz").values
    np.testing.assert_allclose(found, whole, rtol=1e-3, atol=1e-7)


def test_each_person_is_had_back_as_alone(tmp_path: Path) -> None:
    both, each = scene(12)
    both.save(tmp_path / "both.npz")
    kept = DopplerMap.load(tmp_path / "both.npz").limbs
    assert kept is not None
    for one, alone in zip(kept.by_person, each, strict=True):
        assert alone.limbs is not None
        assert one.parts == PARTS
        np.testing.assert_array_equal(one.values, alone.limbs.values)
        np.testing.assert_array_equal(one.kinematics, alone.limbs.kinematics)
        assert one.by_person == (one,)


def test_somebody_whose_parts_are_not_known_is_not_left_out_silently() -> None:
    known = one_person(20, 1)
    whole = LimbMaps(("body",), known.values.sum(axis=0, keepdims=True))
    both = map_of(LimbMaps.of_persons([known, whole], ("anna", "box")))
    assert both.limbs is not None
    assert not both.limbs.of_everybody
    for parts in INPUTS:
        with pytest.raises(Sd2Error, match=r"whose parts are known.*the map alone"):
            trained("gru", parts=parts).denoise(both)
    with pytest.raises(Sd2Error, match="not of everybody"):
        both.limbs.inputs((KINEMATICS,))
    assert trained("gru").denoise(both).values.any()
