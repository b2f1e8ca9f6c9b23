"""Pairs of a scene keep the limb maps of everybody; a model of limbs does not learn from them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from small_pairs import AXIS, LABELS, split, take

from sd2core.errors import Sd2Error
from sd2core.maps import LimbMaps
from sd2core.mesh.vertex_parts import KINEMATICS
from sd2core.pairs.store import PairSet, PairWriter, read_pairs
from sd2core.train.config import DataConfig
from sd2core.train.data import prepare


@pytest.fixture
def pairs(tmp_path: Path) -> PairSet:
    """Two takes, each of two people."""
    writer = None
    for number, subject in enumerate(("s1", "s2")):
        each = [split(take(subject, "t0", 90, seed)) for seed in (2 * number, 2 * number + 1)]
        limbs = LimbMaps.of_persons([one.limbs for one in each], ("anna", "ben"))
        whole = np.sum([one.synthetic for one in each], axis=0)
        writer = writer or PairWriter(
            tmp_path / "scene.zarr", kind="simulated", axis=AXIS, null_bins=(),
            frame_rate_hz=30.0, labels=LABELS, provenance={}, parts=limbs.parts,
        )  # fmt: skip
        writer.append(replace(each[0], synthetic=whole, limbs=limbs))
    return read_pairs(tmp_path / "scene.zarr")


def test_everybody_comes_back(pairs: PairSet) -> None:
    first = pairs.takes[0].limbs
    assert first is not None
    assert first.persons == ("anna", "ben")
    for seed, one in enumerate(first.by_person):
        alone = split(take("s1", "t0", 90, seed)).limbs
        assert alone is not None
        np.testing.assert_array_equal(one.values, alone.values)
        np.testing.assert_array_equal(one.kinematics, alone.kinematics)


def test_only_the_map_can_be_learnt_from(pairs: PairSet, tmp_path: Path) -> None:
    config = DataConfig(
        pairs=(tmp_path / "scene.zarr",), segment_frames=30, validation_subjects=("s2",)
    )
    assert len(prepare(pairs, config).training.inputs)
    with pytest.raises(Sd2Error, match=r"s1/t0.* shows anna and ben.*inputs = map"):
        prepare(pairs, config, (KINEMATICS,))
