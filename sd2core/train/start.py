"""Start or resume of a run; torch is loaded after all checks.

::

    from sd2core.train.start import begin, go_on

    begin(config, Path("runs/first"))
    go_on(Path("runs/first"))        # after a kill or a stop
"""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write_text
from sd2core.files.lock import FileLock
from sd2core.options.training import ModelConfig, TrainConfig
from sd2core.runs.control import Control, signals_kept, write_control
from sd2core.runs.progress import Event, ProgressWriter
from sd2core.train.config import config_text, read_config
from sd2core.train.folder import TrainingFolder

if TYPE_CHECKING:
    from sd2core.train.loop import Outcome

Watch = Callable[[Event], None]
"""Told every line of progress as it is written."""


@dataclass(frozen=True)
class Ending:
    """Outcome of a run."""

    outcome: Literal["finished", "stopped", "cancelled"]
    best_epoch: int | None  # None without a validated epoch, like its errors
    validation_rmse: float | None
    validation_mae_mps: float | None
    model: Path | None  # the best one, where there is one
    interrupted: bool = False  # by Ctrl-C
    early_after: int | None = None  # epochs without a better one, after which it ended early


def begin(
    config: TrainConfig, out: Path, *, command: str = "", watch: Watch | None = None
) -> Ending:
    """Train a model in a new or empty folder, or where a run failed before it learnt anything.

    Parameters
    ----------
    config : TrainConfig
    out : Path
    command : str
        Kept with the model.
    watch : callable, optional
        Called with every event of the progress.

    Raises
    ------
    Sd2Error
        For what the user can mend; the run's folder then says it, too, if it was made.
    """
    config = with_start(config)
    check(config)
    folder = TrainingFolder(out)
    # A run that failed before it had learnt anything makes way for the next attempt.
    learnt = folder.last.exists() or folder.best.exists()
    if folder.exists and folder.state() == "failed" and not learnt:
        folder.discard()
    folder.make()
    # Held before it is described, or it would look like one whose process is gone.
    lock = folder.lock()
    try:
        folder.create(config.model.name)
        atomic_write_text(folder.config, config_text(config, folder.path))
        write_control(folder.control, "run")
        return _trained(folder, config, command, watch, resume=False, lock=lock)
    finally:
        lock.release()


def go_on(out: Path, *, watch: Watch | None = None) -> Ending:
    """Resume a run that was stopped, killed, or failed for a reason that is mended.

    On a CPU, with the same version of torch and the same number of threads, it ends with
    the very weights that it would have had otherwise, unless time limits it. Raises
    Sd2Error if there is nothing to resume.
    """
    folder = TrainingFolder(out)
    state = folder.state()
    if state == "finished":
        raise Sd2Error(
            f"The run {out} has finished",
            "one that was stopped or lost its process",
            "Start a new one in another folder",
        )
    config, resume = read_config(folder.config), folder.last.exists()
    lock = folder.lock()
    try:
        write_control(folder.control, "run")
        return _trained(folder, config, "", watch, resume=resume, lock=lock)
    finally:
        lock.release()


def with_start(config: TrainConfig) -> TrainConfig:
    """Settings with the kind of model that they go on from, if they go on from one.

    Raises Sd2Error if that is none, or other settings ask for another kind.
    """
    model = config.model
    if model.start is None:
        if model.frozen:
            raise Sd2Error("model.frozen is true, and no model is given", "model.start")
        return config
    from sd2core.denoise.files import describe_model

    card = describe_model(model.start)
    kind = {"name": card.model, "options": dict(card.options)}
    for key, value in {**kind, "inputs": card.inputs}.items():
        wanted = getattr(model, key)
        if wanted not in (value, getattr(ModelConfig(), key)):
            raise Sd2Error(
                f"The {key} of {model.start} is {value!r}, and {wanted!r} is asked for",
                "the model's own, or none",
                "Train a new model for another kind",
            )
    return config.with_values({"model": {**kind, "inputs": card.inputs}})


def check(config: TrainConfig) -> None:
    """Refuse at once what would fail when the work has begun.

    Raises Sd2Error for paths that are no store of pairs, unknown models and their options.
    """
    from sd2core.denoise.registry import is_network, network_names, options
    from sd2core.pairs.summary import is_pair_store

    for path in config.data.pairs:
        if not is_pair_store(path):
            what = "holds no pairs" if path.exists() else "does not exist"
            raise Sd2Error(
                f"{path} {what}", "a folder made by `sd2 simulate campaign` or `sd2 pairs`"
            )
    name = config.model.name
    if not is_network(name):
        raise Sd2Error(f"model.name is {name!r}", f"one of {', '.join(network_names())}")
    known = options(name)
    for option in config.model.options:
        if option not in known:
            raise Sd2Error(
                f"The model {name} has no option {option!r}", f"one of {', '.join(known)}"
            )


def _trained(
    folder: TrainingFolder,
    config: TrainConfig,
    command: str,
    watch: Watch | None,
    *,
    resume: bool,
    lock: FileLock,
) -> Ending:
    control = Control(folder.control)
    with ProgressWriter(folder.progress, watch) as writer, signals_kept():
        control.take_signals()
        folder.set_state("starting")
        try:
            from sd2core.train.run import carry_out

            outcome, position = carry_out(
                folder, config, writer, control, resume=resume, command=command
            )
        except BaseException as error:
            _note_failure(folder, writer, error)
            raise
        _say_end(folder, writer, outcome, position.best or {})
    if outcome == "cancelled":
        # Windows deletes no file that is open.
        lock.release()
        folder.discard()
    assert outcome != "failed"
    best, patience = position.best or {}, config.training.early_stopping_epochs
    is_early = outcome == "finished" and 0 < patience <= position.epochs_since_best
    return Ending(
        outcome=outcome,
        best_epoch=best.get("epoch"),
        validation_rmse=best.get("validation_rmse"),
        validation_mae_mps=best.get("validation_mae_mps"),
        model=folder.best if folder.best.exists() else None,
        interrupted=control.interrupted,
        early_after=patience if is_early else None,
    )


def _say_end(
    folder: TrainingFolder,
    writer: ProgressWriter,
    outcome: Outcome,
    best: Mapping[str, Any],
    error: Mapping[str, str] | None = None,
) -> None:
    writer.say(
        "end",
        outcome=outcome,
        best_epoch=best.get("epoch"),
        validation_rmse=best.get("validation_rmse"),
        validation_mae_mps=best.get("validation_mae_mps"),
        model=folder.best.name if folder.best.exists() else None,
        error=error,
    )
    folder.set_state(outcome)


def _note_failure(folder: TrainingFolder, writer: ProgressWriter, error: BaseException) -> None:
    """Record a failure: in words in the progress lines, in full in the log."""
    with folder.log.open("a", encoding="utf-8") as log:
        log.write(time.strftime("%Y-%m-%d %H:%M:%S\n"))
        log.write("".join(traceback.format_exception(error)) + "\n")
    if isinstance(error, MemoryError):
        remedy = "Choose a smaller batch or a smaller model"
        error = Sd2Error("There is not enough memory for this", remedy=remedy)
    elif not isinstance(error, Sd2Error):
        message = f"This should not happen ({type(error).__name__}: {error})"
        error = Sd2Error(message, remedy=f"Please report it, with {folder.log.name}")
    _say_end(folder, writer, "failed", {}, error.arguments)
