"""Training of a model from settings, or from a checkpoint on."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import torch

from sd2core.denoise.card import PARTS_OF, ModelCard, maps_in
from sd2core.denoise.files import load_model, save_model
from sd2core.denoise.known import KnownMovements
from sd2core.denoise.live import TrainedDenoiser
from sd2core.denoise.model import Denoiser, fit_standards, parameter_count
from sd2core.denoise.registry import build, options
from sd2core.denoise.scaling import Scaling, whole_map
from sd2core.denoise.texture import Texture
from sd2core.errors import Sd2Error
from sd2core.files.tables import counted
from sd2core.options.training import TrainConfig
from sd2core.processes import end_with_parent, lower_priority
from sd2core.runs.control import Control
from sd2core.runs.progress import ProgressWriter
from sd2core.train.checkpoint import Checkpoint, Position, read_checkpoint
from sd2core.train.data import TrainingData, prepare, read_mixed
from sd2core.train.denoiser_loop import DenoiserLoop
from sd2core.train.evaluation import check_fits, learnt_from
from sd2core.train.folder import TrainingFolder
from sd2core.train.learner import Learner
from sd2core.train.loop import Outcome
from sd2core.train.machine import device_of, machine_words, precision_of, settled
from sd2core.train.ranks import Ranks, joined, others
from sd2core.train.steps import Batches
from sd2core.train.validate import Validation, Validator

_SHOWS = 0.4
"""Share of the frames in which a cell must show, or it is empty in a denoised map."""
_NAMED = 12
"""No more people are named in a card's words."""


def carry_out(
    folder: TrainingFolder,
    config: TrainConfig,
    writer: ProgressWriter,
    control: Control,
    *,
    resume: bool,
    command: str,
    rank: int = 0,
    meeting: Path | None = None,
) -> tuple[Outcome, Position]:
    """Train a model in a folder that is made, and locked by this process.

    Where several processes compute, the first starts the others.

    Parameters
    ----------
    folder : TrainingFolder
    config : TrainConfig
    writer : ProgressWriter
    control : Control
    resume : bool
        Goes on from the last checkpoint.
    command : str
        Goes onto the model's card.
    rank : int
        Number of the process, 0 for the first.
    meeting : Path, optional
        File at which all processes meet; the first makes it.

    Raises
    ------
    Sd2Error
        For what the user can mend.
    """
    lower_priority(config.machine.nice)
    ranks = Ranks(rank, config.machine.devices)
    kind = device_of(config.machine)
    device = torch.device(kind, rank) if kind == "cuda" else torch.device(kind)
    if kind == "cuda":
        torch.cuda.set_device(device)
    start = read_checkpoint(folder.last) if resume else None
    threads = config.machine.threads or max(1, torch.get_num_threads() // ranks.count)
    if start is not None:
        # Sums over other numbers of threads differ in their last digits.
        threads = config.machine.threads or int(start.about["threads"])
    parts = PARTS_OF[config.model.inputs]
    data = prepare(read_mixed(config.data.pairs), config.data, parts)
    digest = data.digest
    if start is not None and start.about["data_digest"] != digest:
        raise Sd2Error(
            "The segments are not those that the run began with: its pairs have changed, or it"
            " was begun by a version that cut them otherwise",
            "the same pairs, split and cut in the same way",
            "Start a new run, or go on with the version that began this one",
        )
    precision = precision_of(config.machine, kind)
    model = None if config.model.start is None else _start(config.model.start, data)
    with settled(config.machine, threads), ExitStack() as stack:
        scaling = Scaling.fitted(
            (take.inputs(parts) for take in data.training_takes),
            (take.radar for take in data.training_takes),
            data.pairs.null_bins,
            parts=maps_in(parts),
        )
        if model is not None:
            # Its first layers know the input as it was; the radar may be another.
            scaling = replace(scaling, input=model.card.scaling.input)
        network = _network(config, data, scaling, model, start)
        machine = machine_words(kind, precision, threads)
        learnt_pairs = [(take.synthetic, take.radar) for take in data.training_takes]
        known = KnownMovements.of(learnt_pairs, data.pairs.axis)
        if model is not None and known is not None:
            known = known.together(model.card.known)
        before = () if model is None else learnt_from(model.card, "training", "validation")
        facts = _Facts(config, data, scaling, command, machine, known, before)
        validator = Validator.of(
            data.validation, scaling, data.pairs.axis, data.pairs.null_bins
        ).on(device)
        if ranks.count > 1:
            if meeting is None:
                beside = others(ranks.count, _beside, folder.path, config, resume)
                meeting = stack.enter_context(beside)
            stack.enter_context(joined(ranks, meeting, device))
        learnt = config.training
        drawn = learnt.batch_size, learnt.seed, config.data.range_factor
        loop = DenoiserLoop(
            config,
            folder,
            writer,
            control,
            Learner(network, data.training, validator, config),
            Batches(data.training, *drawn, rank, ranks.count),
            validator,
            start or Checkpoint({}, {}, Position(), {"data_digest": digest, "threads": threads}),
            lambda best, live, epoch: facts.save(folder.best, network, best, live, epoch),
            ranks,
            mixed=precision == "bf16-mixed",
        )
        _say_start(writer, loop, config, data, network, kind, resumed=start is not None)
        # It may have been killed between its last checkpoint and its last line.
        return loop.run(), loop.position


def _beside(path: Path, config: TrainConfig, resume: bool, rank: int, meeting: Path) -> None:
    """Compute as another of several processes; the first one writes."""
    end_with_parent()
    folder = TrainingFolder(path)
    control = Control(folder.control)
    control.take_signals()
    with ProgressWriter(Path(os.devnull)) as writer:
        carry_out(
            folder, config, writer, control, resume=resume, command="", rank=rank, meeting=meeting
        )


def _start(path: Path, data: TrainingData) -> TrainedDenoiser:
    """The model to go on from."""
    start = load_model(path)
    remedy = "Make the pairs like those that the model learnt from, or train a new one"
    check_fits(start.card, data.pairs, remedy)
    return start


def _network(
    config: TrainConfig,
    data: TrainingData,
    scaling: Scaling,
    start: TrainedDenoiser | None,
    checkpoint: Checkpoint | None,
) -> Denoiser:
    torch.manual_seed(config.training.seed)
    network = build(
        config.model.name,
        data.pairs.axis.bins,
        maps_in(data.parts),
        scaling.more,
        **config.model.options,
    )
    if start is None:
        fit_standards(network, torch.from_numpy(data.training.inputs))
    else:
        network.load_state_dict(start.network.state_dict())
        if config.model.frozen:
            for name, parameter in network.named_parameters():
                parameter.requires_grad_(not {"head", "skip"}.isdisjoint(name.split(".")))
    length = config.data.segment_frames
    if network.window not in (None, length):
        raise Sd2Error(
            f"Segments are {length} frames long, and the model {config.model.name} looks at"
            f" {network.window} frames together",
            f"data.segment_frames = {network.window}",
        )
    if checkpoint is not None:
        try:
            network.load_state_dict(checkpoint.weights)
        except RuntimeError as error:
            raise Sd2Error(
                "The last checkpoint is of another model than the settings say",
                "the settings that the run began with",
                "Put config.toml back as it was, or start a new run",
            ) from error
    return network


def _say_start(
    writer: ProgressWriter,
    loop: DenoiserLoop,
    config: TrainConfig,
    data: TrainingData,
    network: Denoiser,
    device: str,
    *,
    resumed: bool,
) -> None:
    split, position, minutes = data.split, loop.position, config.training.minutes
    writer.say(
        "start",
        model=config.model.name,
        parameters=parameter_count(network),
        device=device,
        epochs=None if minutes is not None else config.training.epochs,
        minutes=minutes,
        steps_per_epoch=loop.epoch_steps,
        train_segments=len(data.training),
        validation_segments=len(data.validation),
        training_subjects=list(split.training),
        validation_subjects=list(split.validation),
        test_subjects=list(split.test),
        split_by_take=split.by_take,
        kind=data.pairs.kind,
        frames_lost=data.pairs.lost_frames,
        resumed=resumed,
        epochs_done=position.epoch,
        steps_done=position.steps_done,
        unix_s=int(time.time()),
    )


@dataclass(frozen=True, eq=False)
class _Facts:
    """Facts of the run that the model file keeps."""

    config: TrainConfig
    data: TrainingData
    scaling: Scaling
    command: str
    machine: dict[str, Any]
    known: KnownMovements | None
    before: Sequence[str]  # People whom the model that it goes on from has learnt from.

    def save(
        self, path: Path, network: Denoiser, best: Validation, live: Validation | None, epoch: int
    ) -> None:
        training = network.training
        try:
            save_model(path, TrainedDenoiser(network, self.card(best, live, epoch)))
        finally:
            network.train(training)

    def card(self, best: Validation, live: Validation | None, epoch: int) -> ModelCard:
        config, pairs, split = self.config, self.data.pairs, self.data.split
        name = config.model.name
        scaling = self.scaling
        # Here, because only the best epochs need it.
        held_out, axis, known = self.data.validation, pairs.axis, self.known
        answers, radar = best.answers, held_out.targets
        if known is not None:
            maps = held_out.inputs[..., : held_out.inputs.shape[-1] - scaling.more]
            whole = whole_map(maps, axis.bins)
            known = known.trusting(answers, whole, radar, held_out.moving, axis)
            answers = known.mixed(answers, whole, axis)
        kept_bins = [one for one in range(axis.bins) if one not in pairs.null_bins]
        texture = Texture.fitted(answers[..., kept_bins], radar[..., kept_bins])
        if texture is not None:
            floor = max(scaling.floor, texture.mean_that_shows(_SHOWS))
            scaling = replace(scaling, floor=floor)
        return ModelCard(
            model=name,
            options={**options(name), **config.model.options},
            scaling=scaling,
            axis=axis,
            null_bins=pairs.null_bins,
            frame_rate_hz=pairs.frame_rate_hz,
            trained_on=pairs.kind,
            parts=self.data.parts,
            known=known,
            texture=texture,
            about={
                "data": self._data_words(),
                "command": self.command,
                "metrics": {
                    **_errors("validation", best),
                    **({} if live is None else _errors("live_validation", live)),
                    "epoch": epoch,
                },
                "limits": self._limits(),
                "subjects": {
                    "training": list(dict.fromkeys([*split.training, *self.before])),
                    "validation": list(split.validation),
                    "test": list(split.test),
                },
                "seed": config.training.seed,
                **({} if config.model.start is None else {"start": config.model.start.name}),
                "machine": self.machine,
                "provenance": pairs.provenance,
            },
        )

    def _data_words(self) -> str:
        pairs, split = self.data.pairs, self.data.split
        names = ", ".join(path.name for path in self.config.data.pairs)
        frames = sum(len(take.times_s) for take in self.data.training_takes)
        few = len(split.training) <= _NAMED
        people = f" ({', '.join(split.training)})" if few else ""
        return (
            f"{names}: {counted(len(split.training), 'person', 'people')}{people},"
            f" {frames / pairs.frame_rate_hz / 60:.1f} min of {pairs.kind} radar"
            f" at {pairs.frame_rate_hz:g} frames/s"
        )

    def _limits(self) -> str:
        stores = self.data.pairs.provenance.get("mixed", [self.data.pairs.provenance])
        sentences = [
            f"Knows movements like those of"
            f" {counted(len(self.data.split.training), 'person', 'people')}"
            f"{_named('movements', map(_movements, stores))}"
            f"{_named('before', map(_radar, stores))}."
        ]
        if self.data.pairs.kind == "simulated":
            sentences.append("Learnt from a simulated radar; nothing is said about a real one.")
        if self.data.split.by_take:
            sentences.append("Validated on other minutes of the same people, not on other people.")
        return " ".join(sentences)


def _named(what: str, words: Iterable[str]) -> str:
    """Part of a sentence with all different words; nothing where none is known."""
    known = list(dict.fromkeys(word for word in words if word))
    return f"; {what}: {', '.join(known)}" if known else ""


def _movements(store: Mapping[str, Any]) -> str:
    """Movements in a store of pairs, as far as its provenance says."""
    campaign = store.get("made_by") == "sd2 simulate campaign"
    moves = store.get("protocol", {}).get("movements", "swipes") if campaign else ""
    return {"both": "swipes and recorded motion", "captured": "recorded motion"}.get(moves, moves)


def _radar(store: Mapping[str, Any]) -> str:
    """Radar of a store of pairs, as far as its provenance says."""
    radar = store.get("radar", "")
    name = str(radar.get("name", "")) if isinstance(radar, Mapping) else str(radar)
    drawn = store.get("protocol", {}).get("drawn_radars")
    return f"{name} with surfaces and noise drawn" if name and drawn else name


def _errors(name: str, validation: Validation) -> dict[str, float | None]:
    mae_mps = validation.mae_mps if math.isfinite(validation.mae_mps) else None
    return {f"{name}_rmse": validation.rmse, f"{name}_mae_mps": mae_mps}
