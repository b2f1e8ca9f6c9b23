"""``sd2 classify train``: train a classifier on labelled maps."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from sd2core.classify.defaults import DELAY_S, DELAYS_S, WIDTH, WIDTHS, FeatureKind, model_name
from sd2core.cli.classify.data import DATA_HELP, SourcesAndMaps, clips_of, split_of
from sd2core.cli.command_parser import command
from sd2core.cli.output import finite, print_event, print_facts, print_json
from sd2core.cli.recording_maps import parsed_maps
from sd2core.options.bounds import LEARNING_RATE, SEED, STEPS
from sd2core.options.kinds import Count, Typed
from sd2core.options.records import Group, OptionRecord, Place, given
from sd2core.options.shared import JsonAndProgress, KeptOut, Overwrite

if TYPE_CHECKING:
    from sd2core.classify.training import TrainOptions, Watch


class Network(OptionRecord):
    """The network to train.

    Parameters
    ----------
    model : NAME
        lstm (two LSTM layers, the paper's), s4 (two S4 layers), kernel (kernel ridge regression on
        windows of twice the delay, which learns most of few recordings), or that of a plug-in
        (default: lstm)
    features
        input per frame: whole columns (the default), or the strongest bin (the paper's)
    width : N
        units or channels of a layer (default: {default}; the paper's: 16)
    delay_s : S
        classify a frame so much later, with the frames after it known (default: {default}; the
        paper's: 0, at once)
    """

    GROUP = Group("network")

    model: Annotated[str, Typed(model_name)] = "lstm"
    features: FeatureKind = "columns"
    width: Annotated[int, WIDTHS] = WIDTH
    delay_s: Annotated[float, DELAYS_S] = DELAY_S


class Train(SourcesAndMaps, Overwrite, Network, KeptOut, JsonAndProgress):
    """Options of ``sd2 classify train``.

    Parameters
    ----------
    out : FILE.safetensors
        the classifier to write
    placements
        range synthesis: train on all places of the sensor, or the first only
    steps : N
        number of training steps
    patience : N
        end after so many validations without improvement
    learning_rate : RATE
        peak learning rate
    seed : N
        seed of all random numbers
    """

    out: Annotated[Path, Place(endings=(".safetensors",))]
    placements: Literal["all", "first"] = "all"
    steps: Annotated[int, STEPS] | None = None
    patience: Count | None = None
    learning_rate: Annotated[float, LEARNING_RATE] | None = None
    seed: Annotated[int, SEED] = 0


@command("train", Train, DATA_HELP)
def _train(options: Train) -> int:
    """Train a classifier on labelled maps.

    Some people are kept out for validation, some for `sd2 classify eval`.
    Ctrl-C ends the training early; the best so far is kept. The file
    FILE.json beside it describes the training.

      sd2 classify train campaign.zarr --out gestures.safetensors
      sd2 classify train set.zarr --maps radar,denoised --out both.safetensors
      sd2 classify train anna=a.sd2 anna=b.sd2 ben=c.sd2 --model s4 --out own.safetensors
    """
    import json
    import shlex

    from sd2core.classify.defaults import pace_kind
    from sd2core.classify.files import save_classifier
    from sd2core.classify.splitting import split_clips
    from sd2core.classify.training import train
    from sd2core.files.atomic import atomic_write_text
    from sd2core.processes import INTERRUPTED
    from sd2core.runs.pace import Throughput

    maps = parsed_maps(options.maps)
    known = clips_of(options.data, maps, options.denoiser)
    parts = split_clips(
        known,
        _kept_out(options, "validation"),
        _kept_out(options, "test"),
        first_only=options.placements == "first",
    )
    about = {
        "data": [str(one.path) for one in options.data],
        "maps": list(maps),
        "command": shlex.join(["sd2", *sys.argv[1:]]),
        "split": parts.to_json(),
    }
    chosen = _options(options)
    with _watching(options, chosen.steps) as watch:
        made = train(parts.training, parts.validation, known, chosen, about=about, watch=watch)
    pace = Throughput()
    for event in made.events:
        if event["event"] == "step":
            pace.take(event["step"], event["elapsed_s"])
    pace.keep(pace_kind(options.model, options.features, options.width))
    card = save_classifier(options.out, made.classifier)
    run = {"model": str(options.out), "card": card.to_json(), "events": made.events}
    atomic_write_text(options.out.with_suffix(".json"), json.dumps(finite(run), indent=1) + "\n")
    if options.progress_json:
        print_event("written", model=str(options.out))
    elif options.json:
        print_json({"interrupted": made.interrupted, **run})
    else:
        from sd2core.cli.info.model import describe_classifier_card

        description = describe_classifier_card(options.out, card)
        print_facts(f"Wrote {options.out}", description.facts)
    return INTERRUPTED if made.interrupted else 0


def _options(options: Train) -> TrainOptions:
    from sd2core.classify.training import TrainOptions

    names = ("model", "features", "delay_s", "seed", "steps", "patience", "learning_rate")
    return TrainOptions(options={"width": options.width}, **given(options, names))


def _kept_out(options: Train, part: Literal["validation", "test"]) -> Sequence[str] | None:
    """Return the people named, possibly none; otherwise those the data sets define."""
    named: tuple[str, ...] | None = getattr(options, f"{part}_subjects")
    return split_of(options.data, part) if named is None else named


@contextmanager
def _watching(options: Train, steps: int) -> Iterator[Watch]:
    """Show a bar on standard error, or print a JSON line for every event."""
    from sd2core.cli.bars import bar as bar_of

    if options.progress_json:
        yield lambda event: print_event(**event)
        return
    with bar_of("Training", "step", total=steps) as bar:

        def watch(event: dict[str, Any]) -> None:
            if event["event"] == "step":
                bar.update(event["step"] - bar.n)
            elif event["event"] == "check":
                bar.set_postfix_str(f"validation {event['validation_mean_recall']:.1%}")

        yield watch
