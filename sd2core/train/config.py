"""Files with the settings of a training run."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

from sd2core.files.paths import located_path
from sd2core.files.texts import read_text
from sd2core.files.toml import section_lines
from sd2core.options.toml_files import parsed
from sd2core.options.training import DataConfig as DataConfig
from sd2core.options.training import MachineConfig as MachineConfig
from sd2core.options.training import ModelConfig as ModelConfig
from sd2core.options.training import TrainConfig as TrainConfig
from sd2core.options.training import TrainingConfig as TrainingConfig


def read_config(path: Path) -> TrainConfig:
    """Read a TOML file; paths in it are relative to its folder.

    Raises Sd2Error, with file, line and key, if it cannot be read, is no TOML, or holds what is
    not allowed.
    """
    path = Path(path)
    text = read_text(path, "a TOML file with settings")
    return config_from(text, path.absolute().parent, str(path))


def config_from(text: str, folder: Path, source: str = "The settings") -> TrainConfig:
    """Parse settings from TOML; paths relative to ``folder`` become absolute.

    Raises Sd2Error as :func:`read_config`.
    """
    config = parsed(TrainConfig, text, source)
    pairs = tuple(located_path(str(path), folder) for path in config.data.pairs)
    start = config.model.start
    if start is not None:
        start = located_path(str(start), folder)
    return config.with_values({"data": {"pairs": pairs}, "model": {"start": start}})


def config_text(config: TrainConfig, folder: Path) -> str:
    """Settings as TOML, with paths relative to a folder; :func:`read_config` reads them back."""
    lines = ["# Settings of `sd2 train`; docs/formats.md says what they mean."]
    for section in fields(config):
        record = getattr(config, section.name)
        values = {one.name: getattr(record, one.name) for one in fields(record)}
        lines += section_lines(section.name, values, folder)
    return "\n".join(lines) + "\n"
