"""Settings of a training: sections of its file, and options of ``sd2 train``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from sd2core.options import bounds
from sd2core.options.bounds import Bounds
from sd2core.options.kinds import Assignment, Names, Typed
from sd2core.options.records import (
    ARGUMENTS,
    NOT_TYPED,
    Group,
    OptionError,
    OptionRecord,
    Place,
    Section,
    changed_flags,
)
from sd2core.options.shared import Json, SegmentFrames

if TYPE_CHECKING:
    from sd2core.runs.pace import Kind

LEARNING = Group("network and training")
MACHINE = Group("machine")


class DataConfig(SegmentFrames):
    """Section ``[data]``: what is learnt from.

    Parameters
    ----------
    pairs : LIST
        stores of pairs; several are mixed
    validation_subjects : LIST
        kept out to choose the best epoch by, separated by commas (default: a sixth of all, at
        least one, from the end of the list), or none: then the last fifth of everybody's takes
    test_subjects : LIST
        kept out for `sd2 eval`, or none (default: as many)
    placements
        range synthesis: learn from all places of the sensor, or the first only
    segments
        cut at other places in every epoch, or always at the same
    range_factor : FACTOR
        range synthesis: scale input and target together, as if the person were up to F times
        nearer or farther (default: 1, off)
    """

    GROUP = Group("data")

    pairs: Annotated[tuple[Path, ...], NOT_TYPED]
    validation_subjects: Names | None = None
    test_subjects: Names | None = None
    placements: Literal["all", "first"] = "all"
    segments: Literal["shifted", "fixed"] = "shifted"
    range_factor: Annotated[float, bounds.RANGE_FACTOR] = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.pairs:
            raise OptionError("pairs is empty", "a list of at least one path")


class ModelConfig(OptionRecord):
    """Section ``[model]``: model to train.

    Parameters
    ----------
    name : NAME
        s4 (the paper's), s4d, s4-serial, gru, unet or swin (default: s4)
    options : NAME=VALUE
        options of that kind of model
    inputs
        learn from the map, from that of each part of the body, or from how its joints move;
        the pairs must hold both (--limbs)
    start : FILE|NAME
        go on from a model with pairs of one's own; name, options and inputs are that model's
    frozen
        with --from: let the last layers learn alone, for very few pairs
    """

    GROUP = LEARNING

    name: Annotated[str, Place(("--model",))] = "s4"
    options: Annotated[Mapping[str, bool | int | float | str], NOT_TYPED] = field(
        default_factory=dict
    )
    inputs: Literal["map", "limbs", "kinematics"] = "map"
    start: Annotated[Path | None, Typed(str), Place(("--from",))] = None  # or a name
    frozen: bool = False


class TrainingConfig(OptionRecord):
    """Section ``[training]``: settings of the optimisation.

    Parameters
    ----------
    batch_size : N
        segments of a batch
    epochs : N
        passes over all segments
    minutes : MIN
        train for so long instead, at most; the learning rate follows the clock
    learning_rate : RATE
        at its highest
    ssm_learning_rate : RATE
        the same for the parameters of state spaces
    weight_decay : W
        of AdamW, on matrices only; the parameters of state spaces never decay
    warm_up : SHARE
        share of the training in which the learning rate rises
    final_rate : SHARE
        share of the learning rate that is left at the end
    clip_norm : NORM
        gradients are clipped to it; 0 is off
    early_stopping_epochs : N
        end after N epochs without a better one, 0: never
    balanced
        let frames of rare velocities and of weak takes count more, so that fast movements are
        not shown too slow, and far ones not too coarsely (default: all frames alike, as in the
        paper)
    velocity_weight : W
        learn the mean and the peak velocity of a frame beside the map: weight of 1 m/s beside
        the error of the map (default: 0, as in the paper)
    select_by
        what makes an epoch the best: error of the map, or of the peak velocity
    seed : N
        seed of all random numbers
    checkpoint_s : S
        between checkpoints, at most
    """

    GROUP = LEARNING

    batch_size: Annotated[int, bounds.BATCH_SIZE] = 64
    epochs: Annotated[int, bounds.EPOCHS] = 500
    minutes: Annotated[float, Bounds(0.001, 1e5)] | None = None
    learning_rate: Annotated[float, bounds.LEARNING_RATE] = 3e-3
    ssm_learning_rate: Annotated[float, bounds.LEARNING_RATE] = 1e-3
    weight_decay: Annotated[float, Bounds(0.0, 1.0), NOT_TYPED] = 0.01
    warm_up: Annotated[float, Bounds(0.0, 0.5), NOT_TYPED] = 0.03
    final_rate: Annotated[float, Bounds(0.0, 1.0), NOT_TYPED] = 0.01
    clip_norm: Annotated[float, Bounds(0.0, 1e6), NOT_TYPED] = 1.0
    early_stopping_epochs: Annotated[int, bounds.PATIENCE_EPOCHS, Place(("--early-stopping",))] = (
        100
    )
    balanced: bool = False
    velocity_weight: Annotated[float, Bounds(0.0, 100.0)] = 0.0
    select_by: Literal["rmse", "mae"] = "rmse"
    seed: Annotated[int, bounds.SEED] = 0
    checkpoint_s: Annotated[float, Bounds(0.0, 86_400.0), NOT_TYPED] = 30.0


class MachineConfig(OptionRecord):
    """Section ``[machine]``: device, precision, threads, priority.

    Parameters
    ----------
    device
        where to compute (default: a GPU where there is one)
    devices : N
        number of GPUs
    precision
        of matrix products (default: bf16 on GPUs that have it, else 32)
    threads : N
        of the CPU
    nice : N
        lower the priority, 0 to 19
    deterministic
        refuse operations whose result may differ from run to run (on GPUs; a CPU has none)
    """

    GROUP = MACHINE

    device: Literal["auto", "cpu", "cuda"] = "auto"
    devices: Annotated[int, Bounds(1, 64, whole=True)] = 1
    precision: Literal["auto", "32", "bf16"] = "auto"
    threads: Annotated[int, Bounds(1, 1024, whole=True)] | None = None
    nice: Annotated[int, Bounds(0, 19, whole=True)] = 0
    deterministic: bool = False


@dataclass(frozen=True)
class TrainConfig:
    """All settings of a training, as they stand in its file.

    Parameters
    ----------
    data : DataConfig
        What is learnt from.
    model : ModelConfig
        Model to train.
    training : TrainingConfig
        Settings of the optimisation.
    machine : MachineConfig
        Device, precision, threads, priority.
    """

    data: DataConfig
    model: ModelConfig = field(default_factory=ModelConfig)
    training: TrainingConfig = field(default_factory=TrainingConfig)
    machine: MachineConfig = field(default_factory=MachineConfig)

    __pydantic_config__ = OptionRecord.__pydantic_config__

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


class Train(Json):
    """Options of ``sd2 train``: its files, and what is given of each section of the settings.

    Parameters
    ----------
    inputs : CONFIG.toml|DATA
        a file with settings, or one or several stores of pairs, which are mixed
    out : RUN
        the folder of the run; new
    resume : RUN
        go on with a run that was stopped or killed
    show_settings
        print all settings as TOML and train nothing
    set : NAME=VALUE
        an option of the model, e.g. channels=64; may be given several times
    background
        one thread and nice 10, to work beside it
    """

    inputs: Annotated[tuple[Path, ...], ARGUMENTS] = ()
    out: Path | None = None
    resume: Path | None = None
    show_settings: bool = False
    model: Annotated[Mapping[str, Any], Section(ModelConfig)] = field(default_factory=dict)
    training: Annotated[Mapping[str, Any], Section(TrainingConfig)] = field(default_factory=dict)
    data: Annotated[Mapping[str, Any], Section(DataConfig)] = field(default_factory=dict)
    machine: Annotated[Mapping[str, Any], Section(MachineConfig)] = field(default_factory=dict)
    set: Annotated[tuple[Assignment, ...], Place(many="again"), LEARNING] = ()
    background: Annotated[bool, MACHINE] = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.resume is None:
            return
        if self.inputs:
            raise OptionError(f"--resume is given with {self.inputs[0]}", "the run alone")
        if others := [one for one in changed_flags(self) if one not in ("--resume", "--json")]:
            raise OptionError(
                f"--resume is given with {others[0]}",
                "the run alone, which goes on with its own settings",
            )
