"""``sd2 train``: pairs of synthetic and radar Doppler to a model that turns one into the other."""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sd2core.cli.command_parser import Options, add_command
from sd2core.cli.options import flag, given, positive_float, positive_int, within
from sd2core.cli.output import picked, print_facts, print_json
from sd2core.errors import Sd2Error
from sd2core.options import bounds
from sd2core.processes import INTERRUPTED

if TYPE_CHECKING:
    from sd2core.train.config import TrainConfig
    from sd2core.train.start import Ending, Watch

_BACKGROUND_NICE = 10

_OPTIONS = {
    "data": "validation_subjects test_subjects segment_frames overlap_frames placements segments"
    " range_factor",
    "model": "model model_inputs from frozen",
    "training": "epochs minutes batch_size learning_rate ssm_learning_rate early_stopping balanced"
    " velocity_weight select_by seed",
    "machine": "device devices precision threads nice deterministic",
}
"""Options that are settings, by their section."""
_RENAMED = {
    "model": "name",
    "model_inputs": "inputs",
    "from": "start",
    "early_stopping": "early_stopping_epochs",
}
_SETTINGS = {
    option: (section, _RENAMED.get(option, option))
    for section, options in _OPTIONS.items()
    for option in options.split()
}


def add_commands(commands: argparse._SubParsersAction) -> None:
    """Add ``train``."""
    parser = add_command(commands, "train", handler=_train)
    text = "a file with settings, or one or several stores of pairs, which are mixed"
    parser.add_value("inputs", Path, "CONFIG.toml|DATA", text, nargs="*")
    parser.add_output("RUN", "the folder of the run; new", required=False, goes_on=True)
    parser.add_value("--resume", Path, "RUN", "go on with a run that was stopped or killed")
    parser.add_flag("--show-settings", "print all settings as TOML and train nothing")
    _add_learning(parser)
    _add_data(parser)
    _add_machine(parser)
    parser.add_json()


def _add_learning(parser: Options) -> None:
    group = parser.add_argument_group("network and training")
    group.add_value(
        "--model", str, "NAME", "s4 (the paper's), s4d, s4-serial, gru, unet or swin (default: s4)"
    )
    group.add_argument(
        "--inputs",
        dest="model_inputs",
        choices=("map", "limbs", "kinematics"),
        help="learn from the map, from that of each part of the body, or from how its joints move;"
        " the pairs must hold both (--limbs) (default: map)",
    )
    text = "an option of the model, e.g. channels=64; may be given several times"
    group.add_value("--set", _option, "NAME=VALUE", text, [], action="append")
    text = "go on from a model with pairs of one's own"
    group.add_value("--from", str, "FILE|NAME", text)
    text = "with --from: let the last layers learn alone, for very few pairs"
    group.add_argument("--frozen", action="store_true", default=None, help=text)
    text = "passes over all segments (default: 500)"
    group.add_value("--epochs", within(bounds.EPOCHS), "N", text)
    text = "train for so long instead; the learning rate follows the clock"
    group.add_value("--minutes", positive_float, "MIN", text)
    text = "segments of a batch (default: 64)"
    group.add_value("--batch-size", within(bounds.BATCH_SIZE), "N", text)
    text = "at its highest (default: 0.003)"
    group.add_value("--learning-rate", within(bounds.LEARNING_RATE), "RATE", text)
    text = "the same for the parameters of state spaces (default: 0.001)"
    group.add_value("--ssm-learning-rate", within(bounds.LEARNING_RATE), "RATE", text)
    text = "end after N epochs without a better one, 0: never (default: 100)"
    group.add_value("--early-stopping", within(bounds.PATIENCE_EPOCHS), "N", text)
    text = "learn the mean and the peak velocity of a frame beside the map: weight of 1 m/s"
    text += " beside the error of the map (default: 0, as in the paper)"
    group.add_value("--velocity-weight", float, "W", text)
    group.add_argument(
        "--balanced",
        action="store_true",
        default=None,
        help="let frames of rare velocities and of weak takes count more, so that fast movements"
        " are not shown too slow, and far ones not too coarsely (default: all frames alike, as in"
        " the paper)",
    )
    text = "what makes an epoch the best: error of the map, or of the peak velocity (default: rmse)"
    group.add_choice("--select-by", ("rmse", "mae"), text)
    group.add_value("--seed", within(bounds.SEED), "N", "seed of all random numbers (default: 0)")


def _add_data(parser: Options) -> None:
    group = parser.add_argument_group("data")
    group.add_people_kept_out(
        "kept out to choose the best epoch by, separated by commas (default: a sixth of all, at"
        " least one, from the end of the list), or none: then the last fifth of everybody's"
        " takes",
        "kept out for `sd2 eval`, or none (default: as many)",
    )
    group.add_value("--segment-frames", positive_int, "N", "length of a segment (default: 72)")
    group.add_value("--overlap-frames", int, "N", "frames that neighbours share (default: 10)")
    text = "cut at other places in every epoch, or always at the same (default: shifted)"
    group.add_choice("--segments", ("shifted", "fixed"), text)
    text = "range synthesis: learn from all places of the sensor, or the first only (default: all)"
    group.add_choice("--placements", ("all", "first"), text)
    text = "range synthesis: scale input and target together, as if the person were up to F"
    text += " times nearer or farther (default: 1, off)"
    group.add_value("--range-factor", within(bounds.RANGE_FACTOR), "FACTOR", text)


def _add_machine(parser: Options) -> None:
    group = parser.add_argument_group("machine")
    group.add_choice(
        "--device", ("auto", "cpu", "cuda"), "where to compute (default: a GPU where there is one)"
    )
    group.add_value("--devices", positive_int, "N", "number of GPUs (default: 1)")
    text = "of matrix products (default: bf16 on GPUs that have it, else 32)"
    group.add_choice("--precision", ("auto", "32", "bf16"), text)
    group.add_value("--threads", positive_int, "N", "of the CPU")
    group.add_value("--nice", int, "N", "lower the priority, 0 to 19")
    group.add_flag("--background", f"one thread and nice {_BACKGROUND_NICE}, to work beside it")
    text = "refuse operations whose result may differ from run to run (on GPUs; a CPU has none)"
    group.add_argument("--deterministic", action="store_true", default=None, help=text)


def _option(text: str) -> tuple[str, Any]:
    name, sign, value = text.partition("=")
    if not name or not sign or not value:
        raise argparse.ArgumentTypeError(f"{text!r} is not NAME=VALUE, e.g. channels=64")
    if value in ("true", "false"):
        return name, value == "true"
    for kind in (int, float):
        try:
            return name, kind(value)
        except ValueError:
            continue
    return name, value


def _train(options: argparse.Namespace) -> int:
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
        _refuse_with_resume(options)
        with _bar(f"Training {options.resume.name}") as watch:
            ending = go_on(options.resume, watch=watch)
        return _say_ending(options, options.resume, ending)
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
    return _say_ending(options, options.out, ending)


def _refuse_with_resume(options: argparse.Namespace) -> None:
    refused = list(given(options, (*_SETTINGS, "out")))
    refused += ["set"] * bool(options.set) + ["background"] * options.background
    refused += ["show_settings"] * options.show_settings
    if options.inputs:
        raise Sd2Error(f"--resume is given with {options.inputs[0]}", "the run alone")
    if refused:
        raise Sd2Error(
            f"--resume is given with {flag(refused[0])}",
            "the run alone, which goes on with its own settings",
        )


def _config(options: argparse.Namespace) -> TrainConfig:
    from sd2core.train.config import DataConfig, TrainConfig, read_config

    files = [path for path in options.inputs if path.suffix == ".toml"]
    pairs = tuple(path for path in options.inputs if path.suffix != ".toml")
    if len(files) > 1:
        raise Sd2Error(f"{files[0]} and {files[1]} are given", "one file with settings")
    if files:
        config = read_config(files[0])
        if pairs:
            config = config.with_values({"data": {"pairs": pairs}})
    elif pairs:
        config = TrainConfig(DataConfig(pairs))
    else:
        raise Sd2Error(
            "Nothing to learn from is given",
            "a file with settings (.toml) or stores of pairs",
            "Make some with `sd2 simulate campaign`",
        )
    values: dict[str, dict[str, Any]] = {}
    start = getattr(options, "from")
    if start is not None:
        from sd2core.denoise.files import find_model

        setattr(options, "from", find_model(start))
    if options.background:
        values["machine"] = {"threads": 1, "nice": _BACKGROUND_NICE}
    for option, value in given(options, _SETTINGS).items():
        section, name = _SETTINGS[option]
        values.setdefault(section, {})[name] = value
    if options.epochs is not None and options.minutes is None:
        # Asked for now, it holds before a time limit of the file.
        values["training"]["minutes"] = None
    if options.set:
        # Options of another architecture would not fit.
        same = options.model in (None, config.model.name)
        kept = dict(config.model.options) if same else {}
        values.setdefault("model", {})["options"] = kept | dict(options.set)
    elif options.model not in (None, config.model.name):
        values["model"]["options"] = {}
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


def _say_ending(options: argparse.Namespace, run: Path, ending: Ending) -> int:
    if options.json:
        print_json(
            {
                "run": str(run),
                **picked(ending, "outcome", "best_epoch", "validation_rmse", "validation_mae_mps"),
                "model": None if ending.model is None else str(ending.model),
            }
        )
    else:
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
        if ending.outcome == "stopped":
            facts["go on"] = f"sd2 train --resume {run}"
        print_facts(f"{run} has {_WORDS[ending.outcome]}", facts)
    return INTERRUPTED if ending.interrupted else 0


_WORDS = {"finished": "finished", "stopped": "been stopped", "cancelled": "been discarded"}
