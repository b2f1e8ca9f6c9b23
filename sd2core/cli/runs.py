"""``sd2 runs``: look at training runs and steer them."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, get_args

from sd2core.cli.command_parser import command
from sd2core.cli.output import Report, duration, print_facts, print_json, print_rows
from sd2core.errors import Sd2Error
from sd2core.options.records import ARGUMENT, Place
from sd2core.options.shared import Json

if TYPE_CHECKING:
    from sd2core.train.folder import RunStatus, TrainingFolder


Command = Literal["pause", "resume", "stop", "cancel"]
WORDS: tuple[Command, ...] = get_args(Command)


class Runs(Json):
    """Options of ``sd2 runs``.

    Parameters
    ----------
    folder : FOLDER
        a run, or a folder of runs (default: this one)
    pause
        keep a checkpoint and wait
    resume
        go on after --pause
    stop
        end it, and keep the best model and a checkpoint
    cancel
        end it, and delete what it made
    """

    folder: Annotated[Path, ARGUMENT] = Path()
    pause: Annotated[bool, Place(one_of="word")] = False
    resume: Annotated[bool, Place(one_of="word")] = False
    stop: Annotated[bool, Place(one_of="word")] = False
    cancel: Annotated[bool, Place(one_of="word")] = False


@command("runs", Runs)
def _runs(options: Runs) -> Report | None:
    """List training runs, and pause, stop or cancel one.

    Lists the runs of `sd2 train` in a folder: how far they are, how good, and whether
    their process is still there. A run that was stopped or lost its process is gone on
    with by `sd2 train --resume RUN`.

      sd2 runs
      sd2 runs runs/ --json
      sd2 runs runs/s4 --pause
      sd2 runs runs/s4 --resume
      sd2 runs runs/s4 --stop
    """
    from sd2core.train.folder import TrainingFolder, runs_in

    for word in WORDS:
        if getattr(options, word):
            return _steer(TrainingFolder(options.folder), word)
    runs = runs_in(options.folder)
    if options.json:
        print_json({"runs": [{"path": str(run.path), **asdict(run.status())} for run in runs]})
    elif len(runs) == 1 and runs[0].path == options.folder:
        _print_one(runs[0])
    else:
        _print_table(runs)
    return None


def _steer(run: TrainingFolder, word: Command) -> Report:
    state, data = run.state(), {"path": str(run.path), "told": word}
    if word == "cancel" and state in ("stopped", "died", "failed"):
        lock = run.lock()
        lock.release()
        run.discard()
        return Report(f"{run.path} is deleted", data)
    run.tell("run" if word == "resume" else word)
    return Report(f"{run.path} is told to {'go on' if word == 'resume' else word}", data)


def _print_one(run: TrainingFolder) -> None:
    status = run.status()
    more = {
        "file": str(run.best) if status.has_model else "",
        "error": status.error or "",
        "go on": f"sd2 train --resume {run.path}" if status.resumable else "",
    }
    print_facts(str(run.path), _facts(status) | more)


def _print_table(runs: list[TrainingFolder]) -> None:
    if not runs:
        print("There are no runs here. `sd2 train DATA --out RUN` makes one.")
        return
    rows: list[tuple[str, ...]] = [("run", "state", "model", "done", "time", "validation")]
    for run in runs:
        try:
            rows.append((run.path.name, *_facts(run.status()).values()))
        except Sd2Error as error:
            rows.append((run.path.name, "damaged", "", "", "", error.found))
    print_rows(rows)


def _facts(status: RunStatus) -> dict[str, str]:
    return {
        "state": status.state,
        "model": status.model,
        "done": _done(status),
        "time": _times(status),
        "validation": _validation(status),
    }


def _done(status: RunStatus) -> str:
    if status.epoch is None:
        return ""
    limit = f" of {status.epochs}" if status.epochs is not None else ""
    return f"{status.epoch}{limit} epochs"


def _times(status: RunStatus) -> str:
    if status.elapsed_s is None:
        return ""
    left = f", {duration(status.left_s)} left" if status.left_s is not None else ""
    return f"{duration(status.elapsed_s)}{left}"


def _validation(status: RunStatus) -> str:
    if status.validation_rmse is None:
        return ""
    mae_mps = status.validation_mae_mps
    return f"{status.validation_rmse:.4f}" + ("" if mae_mps is None else f", {mae_mps:.3f} m/s")
