"""Settings of a training run: a frozen record, to and from TOML."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from sd2core.errors import Sd2Error
from sd2core.files.paths import located_path
from sd2core.files.toml import toml_lines
from sd2core.pairs.segments import LENGTH, OVERLAP
from sd2core.runs.pace import Kind
from sd2core.train.rules import Allowed, choice, flag, number, paths, refused, table, text, texts


@dataclass(frozen=True)
class ConfigKey:
    """One setting: its section, its name and the values that it may have."""

    section: str
    name: str
    default: Any
    allowed: str  # in words
    about: str


def _setting(
    about: str,
    checked: Allowed,
    default: Any = MISSING,
    *,
    optional: bool = False,
    factory: Any = None,
) -> Any:
    allowed, rule = checked
    metadata = {"about": about, "allowed": allowed, "rule": rule, "optional": optional}
    if factory is not None:
        return field(default_factory=factory, metadata=metadata)
    return field(default=default, metadata=metadata)


@dataclass(frozen=True)
class DataConfig:
    """Data to learn from; :func:`settings` has the meaning of every field."""

    pairs: tuple[Path, ...] = _setting("stores of pairs; several are mixed", paths())
    validation_subjects: tuple[str, ...] | None = _setting(
        "kept out to choose the best epoch (default: chosen by itself)",
        texts(),
        None,
        optional=True,
    )
    test_subjects: tuple[str, ...] | None = _setting(
        "kept out for `sd2 eval` (default: chosen by itself)", texts(), None, optional=True
    )
    segment_frames: int = _setting("frames of a segment", number(2, 10_000, whole=True), LENGTH)
    overlap_frames: int = _setting(
        "frames that neighbouring segments share", number(0, 9_999, whole=True), OVERLAP
    )
    placements: str = _setting(
        "range synthesis: learn from every place that the sensor was put at, or the first only",
        choice("all", "first"),
        "all",
    )
    segments: str = _setting(
        "cut at other places in every epoch (shifted by up to half a step), or always at the same",
        choice("shifted", "fixed"),
        "shifted",
    )
    range_factor: float = _setting(
        "range synthesis: scale input and target together as if the person were up to this"
        " many times nearer or farther; 1 is off",
        number(1.0, 4.0),
        1.0,
    )

    def __post_init__(self) -> None:
        _check(self, "data")
        if self.overlap_frames >= self.segment_frames:
            raise refused(
                "data.overlap_frames",
                self.overlap_frames,
                f"less than data.segment_frames, which is {self.segment_frames}",
            )


@dataclass(frozen=True)
class ModelConfig:
    """Model to train."""

    name: str = _setting("architecture, see `sd2 train --help`", text(), "s4")
    options: Mapping[str, Any] = _setting("options of the architecture", table(), factory=dict)

    def __post_init__(self) -> None:
        _check(self, "model")


@dataclass(frozen=True)
class TrainingConfig:
    """Optimisation settings."""

    batch_size: int = _setting("segments per step", number(1, 100_000, whole=True), 64)
    epochs: int = _setting("passes over all segments", number(1, 1_000_000, whole=True), 500)
    minutes: float | None = _setting(
        "train for this long instead of a number of epochs; the learning rate follows the clock",
        number(0.001, 1e5),
        None,
        optional=True,
    )
    learning_rate: float = _setting("at its highest", number(1e-8, 1.0), 3e-3)
    ssm_learning_rate: float = _setting(
        "the same for the parameters of the state space, which never decay",
        number(1e-8, 1.0),
        1e-3,
    )
    weight_decay: float = _setting("of AdamW, on matrices only", number(0.0, 1.0), 0.01)
    warm_up: float = _setting("share of the run in which the rate rises", number(0.0, 0.5), 0.03)
    final_rate: float = _setting("share of the rate at the end", number(0.0, 1.0), 0.01)
    clip_norm: float = _setting("gradients are clipped to it; 0 is off", number(0.0, 1e6), 1.0)
    early_stopping_epochs: int | None = _setting(
        "end after so many epochs without a better one (default: never)",
        number(1, 1_000_000, whole=True),
        None,
        optional=True,
    )
    select_by: str = _setting(
        "the best epoch is that of the lowest validation error of this kind",
        choice("rmse", "mae"),
        "rmse",
    )
    seed: int = _setting("of weights, order and dropout", number(0, 2**31 - 1, whole=True), 0)
    checkpoint_s: float = _setting(
        "seconds between checkpoints, at most", number(0.0, 86_400.0), 30.0
    )

    def __post_init__(self) -> None:
        _check(self, "training")


@dataclass(frozen=True)
class MachineConfig:
    """Settings of the machine: device, precision, threads, priority."""

    device: str = _setting(
        "auto takes a GPU where there is one", choice("auto", "cpu", "cuda"), "auto"
    )
    devices: int = _setting("processors of that kind", number(1, 64, whole=True), 1)
    precision: str = _setting(
        "auto is bf16 on GPUs that have it, else 32", choice("auto", "32", "bf16"), "auto"
    )
    threads: int | None = _setting(
        "of the CPU (default: as many as torch takes)",
        number(1, 1024, whole=True),
        None,
        optional=True,
    )
    nice: int = _setting("lower priority, 0 to 19", number(0, 19, whole=True), 0)
    deterministic: bool = _setting("refuse what is not reproducible", flag(), False)

    def __post_init__(self) -> None:
        _check(self, "machine")


@dataclass(frozen=True)
class TrainConfig:
    """All settings of a run."""

    data: DataConfig
    model: ModelConfig = field(default_factory=ModelConfig)
    training: TrainingConfig = field(default_factory=TrainingConfig)
    machine: MachineConfig = field(default_factory=MachineConfig)

    @property
    def pace_kind(self) -> Kind:
        """Kind of work whose items are steps, see :mod:`sd2core.runs.pace`."""
        model, machine = self.model, self.machine
        options = ",".join(f"{name}={value}" for name, value in sorted(model.options.items()))
        threads = machine.threads or "all"
        return (
            "train", model.name, options, self.training.batch_size,
            machine.device, machine.devices, machine.precision, f"{threads} threads",
        )  # fmt: skip

    def with_values(self, values: Mapping[str, Mapping[str, Any]]) -> TrainConfig:
        """Copy with settings replaced: ``{section: {name: value}}``."""
        changed = {
            section: replace(getattr(self, section), **dict(content))
            for section, content in values.items()
            if content
        }
        return replace(self, **changed)


_SECTIONS: dict[str, type] = {
    "data": DataConfig,
    "model": ModelConfig,
    "training": TrainingConfig,
    "machine": MachineConfig,
}


def settings() -> list[ConfigKey]:
    """Every setting with its default, its allowed values and its meaning."""
    return [
        ConfigKey(
            section,
            one.name,
            {} if one.default_factory is not MISSING else one.default,
            one.metadata["allowed"],
            one.metadata["about"],
        )
        for section, kind in _SECTIONS.items()
        for one in fields(kind)
    ]


def config_from(
    content: Mapping[str, Any], folder: Path, source: str = "The settings"
) -> TrainConfig:
    """Make settings from nested tables ``{section: {name: value}}``, as TOML gives them.

    Paths are relative to ``folder``; ``source`` is named in errors. Raises Sd2Error for
    unknown names and values that are not allowed.
    """
    _refuse_unknown(content, tuple(_SECTIONS), source, "section")
    sections: dict[str, Any] = {}
    for section, kind in _SECTIONS.items():
        table = content.get(section, {})
        if not isinstance(table, Mapping):
            raise refused(section, table, f"a section [{section}] with settings")
        names = tuple(one.name for one in fields(kind))
        _refuse_unknown(table, names, source, f"setting in [{section}]")
        sections[section] = dict(table)
    if "pairs" not in sections["data"]:
        raise Sd2Error(
            f"{source} name no pairs to learn from", 'pairs = ["campaign.zarr"] in [data]'
        )
    stored = paths()[1]("data.pairs", sections["data"]["pairs"])
    sections["data"]["pairs"] = tuple(located_path(str(path), folder) for path in stored)
    return TrainConfig(**{name: _SECTIONS[name](**table) for name, table in sections.items()})


def read_config(path: Path) -> TrainConfig:
    """Read a TOML file; paths in it are relative to its folder.

    Raises Sd2Error if it cannot be read, is no TOML, or holds what is not allowed.
    """
    path = Path(path)
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise Sd2Error(f"{path} does not exist", "a TOML file with settings") from None
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise Sd2Error(f"{path} cannot be read ({error})", "a TOML file with settings") from error
    return config_from(content, path.absolute().parent, str(path))


def config_text(config: TrainConfig, folder: Path) -> str:
    """Settings as TOML, with paths relative to a folder; :func:`read_config` reads them back."""
    lines = ["# Settings of `sd2 train`; docs/formats.md says what they mean."]
    for section in _SECTIONS:
        lines += ["", f"[{section}]"]
        record = getattr(config, section)
        values = {one.name: getattr(record, one.name) for one in fields(record)}
        tables = {name: value for name, value in values.items() if isinstance(value, Mapping)}
        plain = {name: value for name, value in values.items() if name not in tables}
        lines += toml_lines(plain, folder)
        for name, content in tables.items():
            lines += ["", f"[{section}.{name}]", *toml_lines(content, folder)]
    return "\n".join(lines) + "\n"


def _check(record: Any, section: str) -> None:
    for one in fields(record):
        value = getattr(record, one.name)
        if value is None and one.metadata["optional"]:
            continue
        object.__setattr__(record, one.name, one.metadata["rule"](f"{section}.{one.name}", value))


def _refuse_unknown(
    content: Mapping[str, Any], known: tuple[str, ...], source: str, what: str
) -> None:
    for name in content:
        if name not in known:
            raise Sd2Error(f"{source} has an unknown {what}: {name}", f"one of {', '.join(known)}")
