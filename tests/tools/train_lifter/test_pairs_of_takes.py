"""Pairs of drawn takes: what their fits show, and what a radar sees of the same people."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sd2core.errors import Sd2Error
from sd2core.mesh.vertex_parts import QUANTITIES
from sd2core.pairs.store import read_pairs
from tools.train_lifter.fits import Pairs, make_pairs
from tools.train_lifter.takes import Take, take_path


@pytest.mark.slow
def test_a_take_gives_two_pairs_once(takes: list[Take], tmp_path: Path) -> None:
    folder, out = tmp_path / "people", tmp_path / "fits.zarr"
    folder.mkdir()
    for number, take in enumerate(takes[:1]):
        take.save(take_path(folder, number))
    options = Pairs(data=folder, out=out, seed=7)
    assert make_pairs(options) == 1
    assert make_pairs(options) == 0
    pairs = read_pairs(out)
    assert pairs.kind == "simulated"
    assert [(take.subject, take.placement) for take in pairs.takes] == [
        ("people-0", 0),
        ("people-0", 1),
    ]
    for take in pairs.takes:
        assert take.radar.any()
        assert take.limbs is not None
        moves = take.limbs.kinematics
        assert moves is not None
        # A fit says how badly it knows.
        assert (moves[:, QUANTITIES.index("sigma_mps")] > 0).all()
    assert np.abs(pairs.takes[0].sensor_position_m).max() <= 0.25
    with pytest.raises(Sd2Error, match="Take 0 shows another person"):
        make_pairs(Pairs(data=folder, out=tmp_path / "other.zarr", seed=8))
