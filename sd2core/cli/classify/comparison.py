"""``sd2 classify table``: confusion matrices and learning curves of many trainings."""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sd2core.cli.classify.data import DATA_HELP, add_sources, clips_of
from sd2core.cli.classify.train import add_network, network_of
from sd2core.cli.command_parser import add_command
from sd2core.cli.options import positive_int, share
from sd2core.cli.output import finite, print_event, print_json, progress_bar

if TYPE_CHECKING:
    from sd2core.classify.comparison import Table, TableOptions
    from sd2core.classify.data import ClipSet
    from sd2core.denoise.live import TrainedDenoiser
    from sd2core.progress import Progress


def add_table(kinds: argparse._SubParsersAction) -> None:
    """Add ``table``."""
    parser = add_command(kinds, "table", handler=_table, description=DATA_HELP)
    add_sources(parser)
    parser.add_output("FOLDER", "the tables, figures and models to write", goes_on=True)
    parser.add_value("--seeds", positive_int, "N", "number of repetitions (default: 5; quick: 2)")
    text = "shares of the real data for the learning curve (default:"
    text += " 1%%,2%%,5%%,10%%,25%%,50%%,100%%; quick: 10%%,100%%)"
    parser.add_value("--shares", _shares, "LIST", text)
    parser.add_flag("--quick", "few trainings, for a first look")
    parser.add_flag(
        "--radar-only", "add no synthetic maps: compare networks and amounts of radar data only"
    )
    parser.add_flag(
        "--same-people", "judge other movements of the people trained on, instead of other people"
    )
    add_network(parser)
    parser.add_value("--steps", positive_int, "N", "batches per training")
    parser.add_json_and_progress()


def _shares(text: str) -> tuple[float, ...]:
    return tuple(sorted({share(part) for part in text.split(",")}))


def _table(options: argparse.Namespace) -> None:
    """Compare trainings with and without synthetic data.

    Trains on the radar's maps alone, and with synthetic maps of other movements added
    (0.4 frames for each real one), denoised or not, seen from the radar's own place or
    from others too; then with less and less of the real data. Everything is evaluated
    on the radar's maps of people not trained on, other ones for each seed. With one
    person, movements are kept apart instead.

    OUT gets table.md, table.json, confusion.png and curve.png, and a small file for
    every training: run again, only the missing ones are trained.

      sd2 classify table campaign.zarr --out tables
      sd2 classify table campaign.zarr --out tables --quick
      sd2 classify table anna=a.sd2 ben=b.sd2 --out own --seeds 2
    """
    from sd2core.classify.comparison import make_table
    from sd2core.classify.comparison_report import as_json, as_text

    known = clips_of(options.data, ("radar",) if options.radar_only else None)
    chosen = _options(options)
    folder: Path = options.out
    with _lines() if options.progress_json else progress_bar("Training", "run") as progress:
        table = make_table(folder / "runs", known, chosen, _denoiser(options, known), progress)
    content = finite(as_json(table))
    _write(folder, table, content)
    if options.progress_json:
        print_event("written", folder=str(folder))
    elif options.json:
        print_json(content)
    else:
        print(as_text(table))
        print(f"\nWrote {folder}")


@contextmanager
def _lines() -> Iterator[Progress]:
    """Print a JSON line for every finished training."""
    begun_s = time.monotonic()

    def report(done: int, total: int) -> None:
        print_event("run", done=done, total=total, elapsed_s=time.monotonic() - begun_s)

    yield report


def _options(options: argparse.Namespace) -> TableOptions:
    from sd2core.classify.comparison import QUICK_SHARES, SHARES, TableOptions
    from sd2core.classify.training import TrainOptions

    training = TrainOptions() if options.steps is None else TrainOptions(steps=options.steps)
    return TableOptions(
        same_people=options.same_people,
        seeds=options.seeds or (2 if options.quick else 5),
        shares=options.shares or (QUICK_SHARES if options.quick else SHARES),
        network=network_of(options),
        training=training,
    )


def _denoiser(options: argparse.Namespace, known: ClipSet) -> TrainedDenoiser | None:
    """Load the denoiser named, or the bundled one where it is made for such maps."""
    from sd2core.classify.comparison import fits
    from sd2core.classify.experiment import has_synthetic
    from sd2core.denoise.files import MAP_MODEL, load_model
    from sd2core.errors import Sd2Error

    if not has_synthetic(known):
        return None
    denoiser = load_model(options.denoiser or MAP_MODEL)
    if fits(known, denoiser):
        return denoiser
    if options.denoiser is not None:
        raise Sd2Error(
            f"The denoiser {options.denoiser} does not know maps of {known.axis.bins} bins up to"
            f" ±{known.axis.v_max_mps:g} m/s at {known.frame_rate_hz:.4g} frames/s alone",
            "a denoiser for such maps",
        )
    return None


def _write(folder: Path, table: Table, content: dict[str, Any]) -> None:
    from sd2core.classify.comparison_report import (
        as_markdown,
        curve_conditions,
        draw_confusions,
        draw_curve,
    )
    from sd2core.files.atomic import atomic_write_text
    from sd2core.files.figure_files import save_figure

    atomic_write_text(folder / "table.json", json.dumps(content, indent=1) + "\n")
    atomic_write_text(folder / "table.md", as_markdown(table))
    save_figure(draw_confusions(table), folder / "confusion.png")
    if len({one.share for one in curve_conditions(table)}) > 1:
        save_figure(draw_curve(table), folder / "curve.png")
