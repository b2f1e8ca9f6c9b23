"""Settings of a run: what is refused, and that TOML loses nothing."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2core.errors import Sd2Error
from sd2core.options.training import (
    DataConfig,
    MachineConfig,
    ModelConfig,
    TrainConfig,
    TrainingConfig,
)
from sd2core.train.config import config_from, config_text, read_config

NAMES = st.text(st.characters(codec="utf-8", exclude_categories=("Cs",)), min_size=1)
SHARES = st.floats(0.0, 0.5)


@st.composite
def configs(draw: st.DrawFn) -> TrainConfig:
    names = draw(st.lists(st.text("abc ä'\"\\", min_size=1), min_size=1, max_size=3))
    frames = draw(st.integers(2, 500))
    return TrainConfig(
        DataConfig(
            pairs=tuple(Path("/data") / name.replace("\\", "_") for name in names),
            validation_subjects=draw(st.none() | st.lists(NAMES).map(tuple)),
            segment_frames=frames,
            overlap_frames=draw(st.integers(0, frames - 1)),
            range_factor=draw(st.floats(1.0, 4.0)),
        ),
        ModelConfig(
            name=draw(NAMES),
            options=draw(st.dictionaries(NAMES, st.booleans() | st.integers() | SHARES | NAMES)),
            inputs=draw(st.sampled_from(["map", "limbs", "kinematics"])),
        ),
        TrainingConfig(
            minutes=draw(st.none() | st.floats(0.01, 1000.0)),
            learning_rate=draw(st.floats(1e-8, 1.0)),
            seed=draw(st.integers(0, 2**31 - 1)),
        ),
        MachineConfig(deterministic=draw(st.booleans())),
    )


@given(configs())
def test_toml_and_back(config: TrainConfig) -> None:
    folder = Path("/somewhere/run")
    again = config_from(config_text(config, folder), folder)
    assert again == config


def test_paths_are_relative_to_the_file(tmp_path: Path) -> None:
    (tmp_path / "settings").mkdir()
    path = tmp_path / "settings" / "a.toml"
    path.write_text('[data]\npairs = ["../campaign.zarr", "/far/mars.zarr"]\n')
    config = read_config(path)
    assert config.data.pairs == (tmp_path / "campaign.zarr", Path("/far/mars.zarr"))
    # As the paper has it.
    assert (config.data.segment_frames, config.data.overlap_frames) == (72, 10)
    assert (config.training.batch_size, config.training.epochs) == (64, 500)
    assert config.model == ModelConfig(name="s4")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "training.epochs = 0",
            "epochs is 0. Expected: a whole number from 1 to 1,000,000",
        ),
        ("training.epochs = 2.5", r"training.epochs is 2.5"),
        ("training.epochs = true", "training.epochs is True"),
        ("training.learning_rate = nan", "training.learning_rate is nan"),
        ("training.select_by = 'loss'", "is 'loss'. Expected: 'rmse' or 'mae'"),
        ("machine.device = 'tpu'", "machine.device is 'tpu'. Expected: 'auto', 'cpu' or 'cuda'"),
        ("machine.deterministic = 1", "machine.deterministic is 1. Expected: a valid boolean"),
        ("data.overlap_frames = 72", "overlap_frames is 72. Expected: less than segment_frames"),
        ("data.test_subjects = 'anna'", "data.test_subjects is 'anna'. Expected: a valid array"),
        ("model.options.channels = [1]", r"line 2: model.options.channels.*is \[1\]"),
        ("model = 's4'", "model is 's4'"),
        ("training.epoch = 3", "line 2: training.epoch is not known"),
        ("trainer.epochs = 3", "trainer is not known"),
    ],
)
def test_what_is_refused_and_how(text: str, said: str) -> None:
    with pytest.raises(Sd2Error, match=said):
        config_from(f"data.pairs = ['a']\n{text}\n", Path("/"))


def test_no_pairs() -> None:
    with pytest.raises(Sd2Error, match="data is missing"):
        config_from("", Path("/"))
    with pytest.raises(Sd2Error, match="data: pairs is empty"):
        config_from("data.pairs = []", Path("/"))


def test_what_is_no_toml(tmp_path: Path) -> None:
    with pytest.raises(Sd2Error, match="does not exist"):
        read_config(tmp_path / "a.toml")
    (tmp_path / "a.toml").write_text("[data")
    with pytest.raises(Sd2Error, match="cannot be read"):
        read_config(tmp_path / "a.toml")


def test_replacing_checks_too() -> None:
    config = TrainConfig(DataConfig(pairs=(Path("a"),)))
    assert config.with_values({"training": {"epochs": 3}}).training.epochs == 3
    with pytest.raises(Sd2Error, match="epochs is -1"):
        config.with_values({"training": {"epochs": -1}})
