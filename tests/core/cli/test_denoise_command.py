"""``sd2 denoise`` and ``sd2 info`` of a model."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import torch
from cli_outcome import Sd2

import sd2core
from sd2core.denoise import files
from sd2core.denoise.card import ModelCard
from sd2core.denoise.files import save_model
from sd2core.denoise.live import TrainedDenoiser
from sd2core.denoise.registry import build
from sd2core.denoise.scaling import Compression, Scaling
from sd2core.maps import DopplerMap
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase

NULLED = (14, 15, 16)


@pytest.fixture
def model(tmp_path: Path) -> Path:
    torch.manual_seed(0)
    card = ModelCard(
        model="gru",
        options={"channels": 4},
        scaling=Scaling(Compression(0.01), Compression(1e-6)),
        axis=VelocityAxis(),
        null_bins=NULLED,
        frame_rate_hz=30.0,
        trained_on="simulated",
        title="Tiny",
        about={"data": "noise", "metrics": {"mae_mps": 0.123456}, "limits": ["none"]},
    )
    path = tmp_path / "tiny.safetensors"
    save_model(path, TrainedDenoiser(build("gru", channels=4), card))
    return path


@pytest.fixture
def synthetic(tmp_path: Path) -> Path:
    values = np.random.default_rng(0).exponential(0.01, size=(32, 40)).astype(np.float32)
    values[list(NULLED)] = 0.0
    path = tmp_path / "map.npz"
    DopplerMap(
        values, VelocityAxis(), Timebase.regular(40, 30.0), "synthetic", null_bins=NULLED
    ).save(path)
    return path


@pytest.fixture(autouse=True)
def no_own_models(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(files, "user_models_folder", lambda: tmp_path / "own")


def test_what_is_written_is_what_the_model_says(
    sd2: Sd2, synthetic: Path, model: Path, tmp_path: Path
) -> None:
    out = tmp_path / "denoised.npz"
    outcome = sd2("denoise", synthetic, "--out", out, "--model", model)
    assert outcome.code == 0, outcome.err
    assert "gated recurrent network; learnt from a simulated radar" in outcome.out
    denoised = DopplerMap.load(out)
    expected = sd2core.load_model(model).denoise(DopplerMap.load(synthetic))
    np.testing.assert_array_equal(denoised.values, expected.values)
    assert denoised.values.any()
    assert denoised.kind == "denoised"


def test_json(sd2: Sd2, synthetic: Path, model: Path, tmp_path: Path) -> None:
    outcome = sd2("denoise", synthetic, "--out", tmp_path / "d.npz", "--model", model, "--json")
    told = json.loads(outcome.out)
    assert told["map_kind"] == "denoised"
    assert told["provenance"]["denoiser"]["title"] == "Tiny"


def test_by_name(sd2: Sd2, synthetic: Path, model: Path, tmp_path: Path) -> None:
    (tmp_path / "own").mkdir()
    model.rename(tmp_path / "own" / "mine.safetensors")
    outcome = sd2("denoise", synthetic, "--out", tmp_path / "d.npz", "--model", "mine")
    assert outcome.code == 0, outcome.err
    outcome = sd2("denoise", synthetic, "--out", tmp_path / "e.npz", "--model", "yours")
    assert outcome.code == 1
    assert "no model called 'yours'" in outcome.err
    assert "mine" in outcome.err


def test_a_map_that_does_not_fit_is_explained(
    sd2: Sd2, synthetic: Path, model: Path, tmp_path: Path
) -> None:
    denoised = tmp_path / "denoised.npz"
    assert sd2("denoise", synthetic, "--out", denoised, "--model", model).code == 0
    outcome = sd2("denoise", denoised, "--out", tmp_path / "twice.npz", "--model", model)
    assert outcome.code == 1
    assert "kind 'denoised'" in outcome.err
    assert "sd2 synth" in outcome.err
    assert not (tmp_path / "twice.npz").exists()


@pytest.mark.parametrize("what", ["mesh", "model"])
def test_what_is_no_map_is_named(
    sd2: Sd2, plate: Path, model: Path, tmp_path: Path, what: str
) -> None:
    path = plate if what == "mesh" else model
    outcome = sd2("denoise", path, "--out", tmp_path / "d.npz", "--model", model)
    assert outcome.code == 1
    assert f"it is of kind {what}" in outcome.err
    assert (f"sd2 synth {plate}" in outcome.err) == (what == "mesh")


def test_no_file_is_overwritten_by_mistake(
    sd2: Sd2, synthetic: Path, model: Path, tmp_path: Path
) -> None:
    outcome = sd2("denoise", synthetic, "--out", model, "--model", model, "--overwrite")
    assert outcome.code == 1
    mesh = tmp_path / "mesh.npz"
    np.savez(mesh, vertices=np.zeros((2, 3, 3)), times_s=[0, 1])
    outcome = sd2("denoise", synthetic, "--out", mesh, "--model", model, "--overwrite")
    assert outcome.code == 1
    assert "is a mesh" in outcome.err


def test_a_file_that_is_no_model(sd2: Sd2, synthetic: Path, tmp_path: Path) -> None:
    outcome = sd2("denoise", synthetic, "--out", tmp_path / "d.npz", "--model", synthetic)
    assert outcome.code == 1
    assert f"{synthetic} is no model file" in outcome.err


def test_info(sd2: Sd2, model: Path) -> None:
    outcome = sd2("info", model)
    assert outcome.code == 0
    for words in ("Tiny", "32 bins of 0.125 m/s", "30 frames/s", "noise", "0.1235", "14, 15, 16"):
        assert words in outcome.out
    told = json.loads(sd2("info", model, "--json").out)
    assert told["kind"] == "model"
    assert told["about"]["metrics"]["mae_mps"] == 0.123456


def test_info_of_a_denoiser_by_its_name_and_in_its_run(sd2: Sd2, model: Path) -> None:
    told = sd2("info", "denoiser")
    assert told.code == 0
    assert "denoiser.safetensors" in told.out
    assert "denoiser-nobodys does not exist" in sd2("info", "denoiser-nobodys").err
    (model.parent / "run").mkdir()
    inside = model.rename(model.parent / "run" / "best.safetensors")
    assert f"`sd2 info {inside}`" in sd2("info", inside.parent).err
    assert "metrics, MAE 0.1235 m/s" in " ".join(sd2("info", inside).out.split())
