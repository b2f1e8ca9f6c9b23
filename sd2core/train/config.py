"""Settings of a training run: a frozen record, to and from TOML."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import MISSING, dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from sd2core.errors import Sd2Error
from sd2core.files.paths import located_path
from sd2core.files.texts import errors_in, read_toml
from sd2core.files.toml import toml_lines
from sd2core.options import bounds
from sd2core.options.bounds import Bounds
from sd2core.pairs.segments import LENGTH, OVERLAP
from sd2core.runs.pace import Kind

Rule = Callable[[str, Any], Any]
"""``rule(key, value)`` gives the value as it is kept, or raises :class:`Sd2Error`."""


def refused(key: str, value: Any, allowed: str) -> Sd2Error:
    """Error for a value that is not allowed."""
    return Sd2Error(f"{key} is {value!r}", allowed)


def number(within: Bounds) -> Rule:
    """Rule for a number within bounds."""

    def rule(key: str, value: Any) -> Any:
        if not isinstance(value, int | float) or isinstance(value, bool) or value not in within:
            raise refused(key, value, within.words)
        return int(value) if within.whole else float(value)

    return rule


def choice(*values: str) -> Rule:
    """Rule for one of a few words."""

    def rule(key: str, value: Any) -> str:
        if value not in values:
            raise refused(key, value, f"one of {', '.join(values)}")
        return str(value)

    return rule


def flag(key: str, value: Any) -> bool:
    """Rule for true or false."""
    if not isinstance(value, bool):
        raise refused(key, value, "true or false")
    return value


def text(key: str, value: Any) -> str:
    """Rule for any text that is not empty."""
    if not isinstance(value, str) or not value:
        raise refused(key, value, "a text")
    return value


def texts(key: str, value: Any) -> tuple[str, ...]:
    """Rule for a list of texts."""
    if not isinstance(value, list | tuple) or not all(isinstance(one, str) for one in value):
        raise refused(key, value, "a list of texts")
    return tuple(value)


def paths(key: str, value: Any) -> tuple[Path, ...]:
    """Rule for at least one path."""
    fits = isinstance(value, list | tuple) and value
    if not fits or not all(isinstance(one, str | Path) and str(one) for one in value):
        raise refused(key, value, "a list of at least one path")
    return tuple(Path(one) for one in value)


def one_path(key: str, value: Any) -> Path:
    """Rule for a path."""
    return paths(key, [value])[0]


def table(key: str, value: Any) -> dict[str, Any]:
    """Rule for a flat table of plain values."""
    plain = isinstance(value, Mapping) and all(
        isinstance(one, bool | int | float | str) for one in value.values()
    )
    if not plain:
        raise refused(key, value, "a table of numbers, texts, true or false")
    return dict(value)


def _setting(rule: Rule | Bounds, default: Any = MISSING, *, factory: Any = MISSING) -> Any:
    if isinstance(rule, Bounds):
        rule = number(rule)
    return field(default=default, default_factory=factory, metadata={"rule": rule})


@dataclass(frozen=True)
class DataConfig:
    """Data to learn from."""

    pairs: tuple[Path, ...] = _setting(paths)  # Stores of pairs; several are mixed.
    # Kept out to choose the best epoch, and for `sd2 eval`; chosen by themselves by default.
    validation_subjects: tuple[str, ...] | None = _setting(texts, None)
    test_subjects: tuple[str, ...] | None = _setting(texts, None)
    segment_frames: int = _setting(Bounds(2, 10_000, whole=True), LENGTH)
    overlap_frames: int = _setting(Bounds(0, 9_999, whole=True), OVERLAP)  # Of neighbours.
    # Range synthesis: learn from every place that the sensor was put at, or the first only.
    placements: str = _setting(choice("all", "first"), "all")
    # Cut at other places in every epoch (shifted by up to half a step), or always at the same.
    segments: str = _setting(choice("shifted", "fixed"), "shifted")
    # Range synthesis: scale input and target together as if the person were up to this many
    # times nearer or farther; 1 is off.
    range_factor: float = _setting(bounds.RANGE_FACTOR, 1.0)

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

    name: str = _setting(text, "s4")  # Architecture, see `sd2 train --help`.
    options: Mapping[str, Any] = _setting(table, factory=dict)  # Of the architecture.
    # The map, as in the paper, that of each part of the body, or how its joints move.
    inputs: str = _setting(choice("map", "limbs", "kinematics"), "map")
    # Model file to go on from; name, options and inputs are then that model's.
    start: Path | None = _setting(one_path, None)  # noqa: RUF009 (a field)
    # Of a model to go on from only the last layers learn.
    frozen: bool = _setting(flag, False)

    def __post_init__(self) -> None:
        _check(self, "model")


@dataclass(frozen=True)
class TrainingConfig:
    """Optimisation settings."""

    batch_size: int = _setting(bounds.BATCH_SIZE, 64)  # Segments per step.
    epochs: int = _setting(bounds.EPOCHS, 500)  # Passes over all segments.
    # Instead of a number of epochs; the learning rate follows the clock.
    minutes: float | None = _setting(Bounds(0.001, 1e5), None)
    learning_rate: float = _setting(bounds.LEARNING_RATE, 3e-3)  # At its highest.
    # The same for the parameters of the state space, which never decay.
    ssm_learning_rate: float = _setting(bounds.LEARNING_RATE, 1e-3)
    weight_decay: float = _setting(Bounds(0.0, 1.0), 0.01)  # Of AdamW, on matrices only.
    warm_up: float = _setting(Bounds(0.0, 0.5), 0.03)  # Share of the run in which the rate rises.
    final_rate: float = _setting(Bounds(0.0, 1.0), 0.01)  # Share of the rate at the end.
    clip_norm: float = _setting(Bounds(0.0, 1e6), 1.0)  # Gradients are clipped to it; 0 is off.
    # End after so many epochs without a better one; 0: never.
    early_stopping_epochs: int = _setting(bounds.PATIENCE_EPOCHS, 100)
    # Rare velocities and weak takes count more, see :func:`sd2core.train.data.frame_weights`.
    balanced: bool = _setting(flag, False)
    # Of the errors of a frame's mean and peak velocity, in 1 / (m/s), beside that of the map.
    velocity_weight: float = _setting(Bounds(0.0, 100.0), 0.0)
    # The best epoch is that of the lowest validation error of this kind.
    select_by: str = _setting(choice("rmse", "mae"), "rmse")
    seed: int = _setting(bounds.SEED, 0)  # Of weights, order and dropout.
    checkpoint_s: float = _setting(Bounds(0.0, 86_400.0), 30.0)  # Between checkpoints, at most.

    def __post_init__(self) -> None:
        _check(self, "training")


@dataclass(frozen=True)
class MachineConfig:
    """Settings of the machine: device, precision, threads, priority."""

    device: str = _setting(choice("auto", "cpu", "cuda"), "auto")  # A GPU where there is one.
    devices: int = _setting(Bounds(1, 64, whole=True), 1)  # Processors of that kind.
    precision: str = _setting(choice("auto", "32", "bf16"), "auto")  # bf16 on GPUs that have it.
    threads: int | None = _setting(Bounds(1, 1024, whole=True), None)  # As many as torch takes.
    nice: int = _setting(Bounds(0, 19, whole=True), 0)  # Lower priority.
    deterministic: bool = _setting(flag, False)  # Refuse what is not reproducible.

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
            "train", model.name, model.inputs, options, self.training.batch_size,
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
        given = content.get(section, {})
        if not isinstance(given, Mapping):
            raise refused(section, given, f"a section [{section}] with settings")
        names = tuple(one.name for one in fields(kind))
        _refuse_unknown(given, names, source, f"setting in [{section}]")
        sections[section] = dict(given)
    if "pairs" not in sections["data"]:
        raise Sd2Error(
            f"{source} name no pairs to learn from", 'pairs = ["campaign.zarr"] in [data]'
        )
    stored = paths("data.pairs", sections["data"]["pairs"])
    sections["data"]["pairs"] = tuple(located_path(str(path), folder) for path in stored)
    if "start" in sections["model"]:
        start = one_path("model.start", sections["model"]["start"])
        sections["model"]["start"] = located_path(str(start), folder)
    return TrainConfig(**{name: _SECTIONS[name](**given) for name, given in sections.items()})


def read_config(path: Path) -> TrainConfig:
    """Read a TOML file; paths in it are relative to its folder.

    Raises Sd2Error if it cannot be read, is no TOML, or holds what is not allowed.
    """
    path = Path(path)
    content = read_toml(path, "a TOML file with settings")
    with errors_in(path):
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
        if value is None and one.default is None:
            continue
        object.__setattr__(record, one.name, one.metadata["rule"](f"{section}.{one.name}", value))


def _refuse_unknown(
    content: Mapping[str, Any], known: tuple[str, ...], source: str, what: str
) -> None:
    for name in content:
        if name not in known:
            raise Sd2Error(f"{source} has an unknown {what}: {name}", f"one of {', '.join(known)}")
