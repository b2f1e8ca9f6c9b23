"""Frames without a person, from a mesh file to what ``sd2`` says of its maps."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest
from cli_outcome import Sd2

from sd2core.maps import DopplerMap


@pytest.fixture
def holed(plate: Path) -> Path:
    with np.load(plate) as data:
        arrays = dict(data)
    arrays["vertices"][5:8] = np.nan
    np.savez(plate, **arrays)
    return plate


def test_info_says_where_nobody_is(sd2: Sd2, holed: Path) -> None:
    assert "in 3 of 12 frames (0.10 s), first at 0.17 s" in sd2("info", holed).out
    data = json.loads(sd2("info", holed, "--json").out)
    assert data["frames_without_person"] == 3


def test_info_is_silent_where_somebody_is_throughout(sd2: Sd2, plate: Path) -> None:
    assert "no person" not in sd2("info", plate).out
    assert json.loads(sd2("info", plate, "--json").out)["frames_without_person"] == 0


@pytest.mark.parametrize("method", ["histogram", "fmcw"])
def test_synth_says_that_those_columns_are_empty(
    sd2: Sd2, holed: Path, tmp_path: Path, method: str
) -> None:
    out = tmp_path / "map.npz"
    said = sd2("synth", holed, "--out", out, "--method", method)
    assert (said.code, said.err.count("Traceback")) == (0, 0)
    assert "Without a person: 3 of " in said.out
    doppler = DopplerMap.load(out)
    assert doppler.present is not None
    absent = np.flatnonzero(~doppler.present)
    assert ((doppler.times_s[absent] > 4 / 30) & (doppler.times_s[absent] < 8 / 30)).all()
    power = doppler.values.sum(axis=0)
    # A radar's noise goes on without anybody.
    assert power[absent].max() <= (0.0 if method == "histogram" else 0.05 * power.max())
    assert json.loads(sd2("info", out, "--json").out)["frames_without_person"] == len(absent)


@pytest.fixture
def fitted(plate: Path) -> Path:
    """The plate, as if fitted: its velocity is known to ±0.2 m/s."""
    with np.load(plate) as data:
        arrays = dict(data)
    frames, vertices = arrays["vertices"].shape[:2]
    sigma = np.full((frames, 2), (0.2, 0.05), np.float32)
    np.savez(
        plate,
        **arrays,
        limbs=["plate", "rest"],
        vertex_limb=np.zeros(vertices, np.uint8),
        limb_velocity_sigma_mps=sigma,
        limb_velocity_sigma_across_mps=0.1 * sigma,
    )
    return plate


def test_synth_adds_how_well_values_are_known(sd2: Sd2, fitted: Path, tmp_path: Path) -> None:
    out = tmp_path / "map.npz"
    assert sd2("synth", fitted, "--out", out).code == 0
    assert DopplerMap.load(out).uncertainty is None
    said = sd2("synth", fitted, "--out", out, "--uncertainty", "--overwrite")
    assert said.code == 0
    known = DopplerMap.load(out).uncertainty
    assert known is not None
    assert known.sd.max() > 0


def test_synth_and_info_state_one_accuracy(sd2: Sd2, fitted: Path, tmp_path: Path) -> None:
    out = tmp_path / "map.npz"
    for wish in ((), ("--tolerance", "20%")):
        said = sd2("synth", fitted, "--out", out, "--overwrite", *wish)
        assert said.code == 0
        accuracy = DopplerMap.load(out).accuracy
        assert accuracy.total == math.hypot(accuracy.body, accuracy.arithmetic or 0.0)
        assert (accuracy.arithmetic is not None) == bool(wish)
        line = f"{accuracy} (relative L1)"
        assert line in said.out
        assert line in sd2("info", out).out
        told = json.loads(sd2("info", out, "--json").out)["accuracy"]
        assert told == {**asdict(accuracy), "total": accuracy.total}


def test_info_says_how_well_velocities_are_known(sd2: Sd2, fitted: Path) -> None:
    said = sd2("info", fitted).out
    assert "known to ±0.05 m/s (rest) to ±0.20 m/s (plate)" in said


def test_what_is_not_known_is_refused(sd2: Sd2, plate: Path, tmp_path: Path) -> None:
    out = tmp_path / "map.npz"
    said = sd2("synth", plate, "--out", out, "--uncertainty")
    assert said.code == 1
    assert "does not say how well its velocities are known" in said.err
    assert not out.exists()


def test_a_radar_signal_has_none(sd2: Sd2, fitted: Path, tmp_path: Path) -> None:
    said = sd2("synth", fitted, "--out", tmp_path / "m.npz", "--uncertainty", "--method", "fmcw")
    assert said.code == 1
    assert "--uncertainty is given with --method fmcw" in said.err


def test_synth_spreads_what_is_not_known(sd2: Sd2, fitted: Path, tmp_path: Path) -> None:
    plain, out = tmp_path / "plain.npz", tmp_path / "map.npz"
    assert "plain" in sd2("synth", fitted, "--out", plain, "--count", "plain").out
    said = sd2("synth", fitted, "--out", out, "--uncertainty")
    assert " expected\n" in said.out
    spread = DopplerMap.load(out)
    assert spread.meta["count"] == "expected"
    assert np.abs(spread.values - DopplerMap.load(plain).values).max() > 0.01
    assert spread.uncertainty is not None
    chosen = sd2(
        *("synth", fitted, "--out", out, "--count", "plain", "--tolerance", "5%", "--overwrite")
    )
    assert chosen.code == 0, chosen.err
    assert DopplerMap.load(out).meta["count"] == "plain"
    said = sd2("ladder", fitted, "--count", "plain", "--quick", "--tolerance", "5%")
    assert said.code == 0, said.err
    said = sd2("ladder", fitted, "--count", "expected", "--method", "fmcw")
    assert said.code == 1
    assert "--count is given with --method fmcw" in said.err


def test_vid2doppler_counts_plainly(sd2: Sd2, fitted: Path, tmp_path: Path) -> None:
    out = tmp_path / "map.npz"
    assert sd2("synth", fitted, "--out", out, "--preset", "vid2doppler").code == 0
    assert DopplerMap.load(out).meta["count"] == "plain"
    said = sd2("synth", fitted, "--preset", "vid2doppler", "--count", "expected", "--out", "b.npz")
    assert said.code == 1
    assert "that tool counts each vertex in one bin" in said.err
