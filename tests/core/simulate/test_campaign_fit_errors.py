"""Errors of fits: what is drawn has the stated statistics, and files keep them."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sd2core.errors import Sd2Error
from sd2core.simulate.campaign.fit_errors import FitErrors, GroupErrors

SPREAD = np.array([[0.04, 0.01], [0.01, 0.09]])
KNOWN = GroupErrors(
    gain=np.array([[0.1, 0.5, 0.0], [0.0, 0.0, -0.3]]),
    bias=np.diag([0.01, 0.0]),
    spread=SPREAD,
    length=0.4,
    mixing=1.0,
)


@pytest.fixture(scope="module")
def bundled() -> FitErrors:
    return FitErrors.load()


def test_errors_have_the_stated_covariance() -> None:
    """Over many clips, at two poses a known distance apart."""
    apart = 0.5
    poses = np.array([[0.2, -0.1], [0.2 + apart, -0.1]])
    rng = np.random.default_rng(0)
    drawn = np.array([KNOWN.draw(rng)(poses) for _ in range(4000)])  # (clips, poses, errors)
    np.testing.assert_allclose(drawn.mean(axis=0), [[0.2, 0.03], [0.45, 0.03]], atol=0.02)
    centred = drawn - drawn.mean(axis=0)
    same = np.einsum("ci,cj->ij", centred[:, 0], centred[:, 0]) / len(drawn)
    other = np.einsum("ci,cj->ij", centred[:, 0], centred[:, 1]) / len(drawn)
    kernel = 1.0 / (1.0 + apart**2 / (2.0 * 0.4**2))
    np.testing.assert_allclose(same, SPREAD + KNOWN.bias, rtol=0.08, atol=0.003)
    np.testing.assert_allclose(other, kernel * SPREAD + KNOWN.bias, rtol=0.12, atol=0.003)


def test_errors_come_back_from_disk(bundled: FitErrors, tmp_path: Path) -> None:
    bundled.save(tmp_path / "errors.json")
    again = FitErrors.load(tmp_path / "errors.json")
    for group, one in bundled.groups.items():
        np.testing.assert_array_equal(again.groups[group].gain, one.gain)
    assert again.as_dict() == bundled.as_dict()


def test_a_damaged_file_is_refused(bundled: FitErrors, tmp_path: Path) -> None:
    path = tmp_path / "errors.json"
    replace(bundled, groups={"arm": bundled.groups["arm"]}).save(path)
    with pytest.raises(Sd2Error, match="leg, place, trunk"):
        FitErrors.load(path)
    said = json.loads(path.read_text())
    path.write_text(json.dumps(said | {"version": 99}))
    with pytest.raises(Sd2Error, match="version 99"):
        FitErrors.load(path)
    with pytest.raises(Sd2Error, match="does not exist"):
        FitErrors.load(tmp_path / "nothing.json")
