"""``sd2 train``: pairs of synthetic and radar Doppler to a model that turns one into the other."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sd2core.cli.command_parser import command
from sd2core.cli.output import Report, counted, picked, tell_lost
from sd2core.errors import Sd2Error
from sd2core.options.training import DataConfig, Train, TrainConfig

if TYPE_CHECKING:
    from sd2core.train.start import Ending, Watch

_BACKGROUND_NICE = 10


@command("train", Train)
def _train(options: Train) -> int | Report:
    """Train a denoiser that turns synthetic Doppler into what a radar would show.

    Learns from pairs of synthetic and radar Doppler of the same movement, as
    `sd2 simulate campaign` and `sd2 pairs` make them. By default as in the paper:
    segments of 72 frames that overlap by 10, batches of 64, 500 epochs, root mean
    square error. Some people are kept out to choose the best epoch by, some for
    `sd2 eval`.

    RUN is a folder. It can be stopped with Ctrl-C or killed at any moment;
    `sd2 train --resume RUN` goes on, with the result that it would have had. `sd2 runs`
    shows runs and steers them. RUN/best.safetensors is the model.

    All settings may stand in a TOML file (docs/formats.md); options go before it.
    `--show-settings` prints them.

      sd2 train campaign.zarr --out runs/s4
      sd2 train campaign.zarr --model gru --minutes 30 --out runs/gru
      sd2 train campaign.zarr --inputs limbs --out runs/limbs
      sd2 train campaign.zarr mars.zarr --test-subjects s6 --seed 1 --out runs/both
      sd2 train settings.toml --epochs 100 --out runs/short
      sd2 train --resume runs/s4
      sd2 train mine.zarr --from denoiser --learning-rate 0.0005 --out runs/mine
      sd2 train campaign.zarr --set channels=64 --set dropout=0.1 --show-settings
    """
    from sd2core.train.config import config_text
    from sd2core.train.start import begin, check, go_on, with_start

    if options.resume is not None:
        with _bar(f"Training {options.resume.name}") as watch:
            ending = go_on(options.resume, watch=watch)
        return _report(options.resume, ending)
    config = _config(options)
    if options.show_settings:
        config = with_start(config)
        check(config)
        print(config_text(config, Path.cwd()), end="")
        return 0
    if options.out is None:
        raise Sd2Error("No folder for the run is given", "sd2 train DATA --out RUN")
    command = shlex.join(["sd2", *sys.argv[1:]])
    with _bar(f"Training {options.out.name}") as watch:
        ending = begin(config, options.out, command=command, watch=watch)
    return _report(options.out, ending)


def _config(options: Train) -> TrainConfig:
    from sd2core.train.config import read_config

    files = [path for path in options.inputs if path.suffix == ".toml"]
    pairs = tuple(path for path in options.inputs if path.suffix != ".toml")
    if len(files) > 1:
        raise Sd2Error(f"{files[0]} and {files[1]} are given", "one file with settings")
    if files:
        config = read_config(files[0])
        if pairs:
            config = config.with_values({"data": {"pairs": pairs}})
    elif pairs:
        config = TrainConfig(DataConfig(pairs=pairs))
    else:
        raise Sd2Error(
            "Nothing to learn from is given",
            "a file with settings (.toml) or stores of pairs",
            "Make some with `sd2 simulate campaign`",
        )
    values = {name: dict(getattr(options, name)) for name in ("data", "model", "training")}
    beside = {"threads": 1, "nice": _BACKGROUND_NICE} if options.background else {}
    values["machine"] = beside | dict(options.machine)
    model, training = values["model"], values["training"]
    if "start" in model:
        from sd2core.denoise.files import find_model

        model["start"] = find_model(str(model["start"]))
    if "epochs" in training:
        # Asked for now, it holds before a time limit of the file.
        training.setdefault("minutes", None)
    # Options of another architecture would not fit.
    another = model.get("name", config.model.name) != config.model.name
    if options.set or another:
        model["options"] = ({} if another else dict(config.model.options)) | dict(options.set)
    return config.with_values(values)


@contextmanager
def _bar(what: str) -> Iterator[Watch]:
    """Steps, or seconds where time is the limit, on standard error."""
    from sd2core.cli.bars import bar as bar_of

    with bar_of(what, "step") as bar:
        minutes: float | None = None

        def watch(event: dict[str, Any]) -> None:
            nonlocal minutes
            kind = event["event"]
            if kind == "start":
                minutes = event["minutes"]
                tell_lost(event.get("frames_lost", 0))
                bar.unit = "step" if minutes is None else "s"
                steps = (event["epochs"] or 0) * event["steps_per_epoch"]
                bar.total = steps if minutes is None else round(60 * minutes)
                bar.initial = event["steps_done"] if minutes is None else 0
                bar.n = bar.initial
                bar.refresh()
            elif kind == "step":
                done = event["step"] if minutes is None else round(event["elapsed_s"])
                bar.update(min(done, bar.total) - bar.n)
            elif kind == "epoch":
                mae_mps = event["validation_mae_mps"]
                shown = f", {mae_mps:.3f} m/s" if mae_mps is not None else ""
                bar.set_postfix_str(f"validation {event['validation_rmse']:.4f}{shown}")
            elif kind in ("paused", "resumed", "stopping", "cancelling"):
                bar.set_postfix_str(kind)

        yield watch


def _report(run: Path, ending: Ending) -> Report:
    from sd2core.processes import INTERRUPTED

    data = {
        "run": str(run),
        **picked(ending, "outcome", "best_epoch", "validation_rmse", "validation_mae_mps"),
        "model": None if ending.model is None else str(ending.model),
    }
    facts = {}
    if ending.best_epoch is not None:
        facts["best epoch"] = str(ending.best_epoch)
        facts["validation"] = f"RMSE {ending.validation_rmse:.4f}"
        if ending.validation_mae_mps is not None:
            facts["validation"] += (
                f", peak velocity off by {ending.validation_mae_mps:.3f} m/s on average"
            )
    if ending.model is not None:
        facts["model"] = str(ending.model)
    if ending.early_after is not None:
        facts["ended early"] = (
            f"none of the last {counted(ending.early_after, 'epoch')} was better"
            " (--early-stopping 0 trains on)"
        )
    if ending.outcome == "stopped":
        facts["go on"] = f"sd2 train --resume {run}"
    code = INTERRUPTED if ending.interrupted else 0
    return Report(f"{run} has {_WORDS[ending.outcome]}", data, facts, code=code)


_WORDS = {"finished": "finished", "stopped": "been stopped", "cancelled": "been discarded"}
