"""Training of a model from settings, or from a checkpoint on."""

from __future__ import annotations

import os
import time
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import torch

from sd2core.denoise.card import PARTS_OF, maps_in
from sd2core.denoise.files import load_model
from sd2core.denoise.known import KnownMovements
from sd2core.denoise.live import TrainedDenoiser
from sd2core.denoise.model import Denoiser, fit_standards, parameter_count
from sd2core.denoise.registry import build
from sd2core.denoise.scaling import Scaling
from sd2core.errors import Sd2Error
from sd2core.processes import end_with_parent, lower_priority
from sd2core.runs.control import Control
from sd2core.runs.progress import ProgressWriter
from sd2core.train.checkpoint import Checkpoint, Position, read_checkpoint
from sd2core.train.config import TrainConfig
from sd2core.train.data import Order, TrainingData, prepare, read_mixed
from sd2core.train.denoiser_loop import DenoiserLoop
from sd2core.train.evaluation import check_fits
from sd2core.train.folder import TrainingFolder
from sd2core.train.learner import Learner
from sd2core.train.loop import Outcome
from sd2core.train.machine import device_of, machine_words, precision_of, settled
from sd2core.train.model_card import Facts
from sd2core.train.ranks import Ranks, joined, others
from sd2core.train.steps import Batches
from sd2core.train.validate import Exam


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

    ``resume`` goes on from the last checkpoint; ``command`` goes onto the model's card. Where
    several processes compute, the first starts the others, which get their ``rank`` and the file
    at which all meet. Raises Sd2Error for what the user can mend.
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
            (take.inputs(parts) for take in data.learnt_takes),
            (take.radar for take in data.learnt_takes),
            data.pairs.null_bins,
            parts=maps_in(parts),
        )
        if model is not None:
            # Its first layers know the input as it was; the radar may be another.
            scaling = replace(scaling, input=model.card.scaling.input)
        network = _network(config, data, scaling, model, start)
        machine = machine_words(kind, precision, threads)
        learnt_pairs = [(take.synthetic, take.radar) for take in data.learnt_takes]
        known = KnownMovements.of(learnt_pairs, data.pairs.axis)
        if model is not None and known is not None:
            known = known.together(model.card.known)
        facts = Facts(config, data, scaling, command, machine, known)
        exam = Exam.of(data.validation, scaling, data.pairs.axis, data.pairs.null_bins).on(device)
        if ranks.count > 1:
            if meeting is None:
                beside = others(ranks.count, _beside, folder.path, config, resume)
                meeting = stack.enter_context(beside)
            stack.enter_context(joined(ranks, meeting, device))
        learnt = config.training
        order = Order(len(data.training), learnt.batch_size, learnt.seed, config.data.range_factor)
        loop = DenoiserLoop(
            config,
            folder,
            writer,
            control,
            Learner(network, data.training, exam, config),
            Batches(order, data.training, rank, ranks.count),
            exam,
            start or Checkpoint({}, {}, Position(), {"data_digest": digest, "threads": threads}),
            lambda found, live, epoch: facts.save(folder.best, network, found, live, epoch),
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
        resumed=resumed,
        epochs_done=position.epoch,
        steps_done=position.steps_done,
        unix_s=int(time.time()),
    )
