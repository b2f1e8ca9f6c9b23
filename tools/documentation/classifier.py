"""Makes ``classifier.md`` and its pictures: ``make classifier``, an hour.

::

    python -m tools.documentation.classifier [--campaign gestures.zarr] [--large campaign.zarr]

Trainings with and without synthetic data. Without ``--campaign`` one is made: six people, 36
minutes, three places of the sensor, of another seed than the bundled denoiser's, so of other
people. ``--large`` is the denoiser's (``make denoiser`` leaves it in ``build/denoiser``); only its
radar is used. What was trained before is not trained again: the folder ``--out`` keeps every run.
``--only`` measures some sections, and leaves the others as the page has them.
"""

from __future__ import annotations

import argparse
import json
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from sd2core.accuracy.cache import this_machine
from sd2core.files.tables import markdown_table
from tools.documentation.classifier_protocols import (
    FULL_HEADING,
    HEADING,
    full_size_section,
    protocols_section,
)
from tools.documentation.measured import write_page
from tools.documentation.places import BUILD, DOCS, IMAGES
from tools.documentation.runs import campaign_of, printed, sd2, sections, table_below

SEED = 2
SAMPLE = "resources/swipes.sd2"
NAME = "classifier.md"

HEAD = """\
# The gesture classifier

How well are gestures recognised, and when do synthetic data help? **Every radar here is
simulated**; for a real one see [real gestures](real-gestures.md). That synthetic data help a
classifier on a real radar has not been shown. Made by

```sh
make classifier
```

{given}on {machine}. Features and networks: [decision 37](decisions/0037-gesture-classifiers.md).
Numbers are per cent, mean ± standard deviation over {seeds} seeds (each other people to judge,
another draw and network). *Frames*: share found, mean over horizontal, vertical and background;
*gestures*: whole ones.

"""
CAMPAIGN_HEADING = "On a simulated campaign"
CAMPAIGN = """
{minutes:.0f} minutes of {people} people from {places} places (`sd2 simulate campaign --sensors
{places} --seed {seed}`): `sd2 classify table` trained {runs} classifiers, with equally many steps,
in {cpu_min:.0f} minutes of one core, and judged them on people not learnt from. Networks there, and
on the {large_minutes:.0f} minutes that the bundled denoiser learnt from:

{networks}

What is added to all of the radar's data: maps of other movements, of which there is only video.
*Moved sensors*: also as the other places see them. *Radar of the same movements*: what added maps
are at best. The bundled denoiser learnt from other people.

{added}

Learning curve, frames:

{curve}

{helps}

![Learning curve](images/classifier-curve.png)

![Confusion matrices](images/classifier-confusion.png)

{sample}

"""
LIMITS_HEADING = "What this cannot say"
LIMITS = """
- Anything about a real radar ([not simulated](decisions/0026-the-simulated-campaign.md)).
- Longer trainings gain less by what is added
  ([decision 37](decisions/0037-gesture-classifiers.md)).
- Whether the task is the paper's: it tells neither its background nor who is judged.
"""


def main() -> None:
    """Measure what is asked for and write the page."""
    options = _options()
    kept = sections((DOCS / NAME).read_text("utf-8"))
    page = _head(options)
    for name, (heading, measure) in _SECTIONS.items():
        text = measure(options) if name in options.only else kept[heading]
        page += f"## {heading}\n{text}"
    write_page(NAME, f"{page}## {LIMITS_HEADING}\n{LIMITS}")


def _head(options: argparse.Namespace) -> str:
    given = f"with `--shares {options.shares}`, " if options.shares else ""
    return HEAD.format(given=given, machine=this_machine(), seeds=options.seeds)


def _campaign(options: argparse.Namespace) -> str:
    """All but the paper's experiment."""
    folder: Path = options.out
    campaign, large = options.campaign, options.large
    if campaign is None:
        campaign = campaign_of(
            folder, options.minutes, "--sensors", 3, "--seed", SEED, "--workers", 2
        )
    if large is None:
        large = campaign_of(folder / "large", options.large_minutes, "--seed", 1)
    shares = ("--shares", options.shares) if options.shares else ()
    text = _table(campaign, folder / "table", "--seeds", options.seeds, *shares)
    told = json.loads((folder / "table" / "table.json").read_text("utf-8"))
    for name in ("curve", "confusion"):
        shutil.copyfile(folder / "table" / f"{name}.png", IMAGES / f"classifier-{name}.png")
    radar_only = ("--radar-only", "--seeds", options.seeds, "--shares", "100%")
    more = _table(large, folder / "large-table", *radar_only)
    facts = json.loads(printed("info", campaign, "--json"))
    minutes = sum(facts["minutes_of_subject"].values()) / facts["placements"]
    runs = [run for one in told["conditions"] for run in one["runs"]]
    return CAMPAIGN.format(
        minutes=minutes,
        seed=SEED,
        people=len(facts["minutes_of_subject"]),
        places=facts["placements"],
        runs=len(runs),
        cpu_min=sum(run["cpu_s"] for run in runs) / 60.0,
        large_minutes=options.large_minutes,
        networks=networks_table(
            {f"{minutes:.0f} min": text, f"{options.large_minutes:.0f} min": more}
        ),
        added=added_table(text),
        curve=curve_table(text),
        helps=where_it_helps(told),
        sample=_sample(campaign, folder),
    )


def _table(campaign: Path, out: Path, *options: object) -> str:
    """What ``sd2 classify table`` says, in Markdown."""
    sd2("classify", "table", campaign, "--out", out, *options)
    return (out / "table.md").read_text("utf-8")


_SECTIONS = {
    "campaign": (CAMPAIGN_HEADING, _campaign),
    "protocols": (
        HEADING,
        lambda options: protocols_section(
            options.out / "protocols", options.protocol_minutes, options.seeds
        ),
    ),
    "full-size": (
        FULL_HEADING,
        lambda options: full_size_section(options.out / "full-size", options.seeds),
    ),
}


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--campaign", type=Path, help="a simulated campaign that is there already")
    parser.add_argument("--minutes", type=float, default=36.0, help="of the campaign (default: 36)")
    parser.add_argument("--large", type=Path, help="the denoiser's campaign, where it is there")
    parser.add_argument(
        "--large-minutes", type=float, default=168.0, help="of that one (default: 168)"
    )
    parser.add_argument(
        "--only", nargs="+", choices=_SECTIONS, default=tuple(_SECTIONS), help="sections to measure"
    )
    parser.add_argument(
        "--protocol-minutes", type=float, default=18.0, help="of its campaigns (default: 18)"
    )
    parser.add_argument("--seeds", type=int, default=5, help="default: 5")
    parser.add_argument("--shares", help="of the real data, as `sd2 classify table` has them")
    parser.add_argument("--out", type=Path, default=BUILD / "classifier", help="of all runs")
    return parser.parse_args()


def networks_table(tables: Mapping[str, str]) -> str:
    """Networks on all of the radar's data of campaigns, by their names."""
    heading = "Networks, all of the radar's data, equal steps of training:"
    rows: list[list[str]] = []
    for name, text in tables.items():
        own = table_below(text, heading, "network", "frames", "gestures")
        own[0][1] = f"{name}: frames"
        rows = [[*row, *more[1:]] for row, more in zip(rows, own, strict=True)] if rows else own
    return "\n".join(markdown_table(rows))


def added_table(text: str) -> str:
    """What is added to all of the radar's data, of ``sd2 classify table``."""
    heading = "What is added to all of the radar's data:"
    rows = table_below(text, heading, "trained on", "frames", "gain, points")
    return "\n".join(markdown_table(rows))


def curve_table(text: str) -> str:
    """Recall with less and less of the radar's data, and what is gained by added maps."""
    gains = ("gain + synthetic", "gain + denoised synthetic")
    rows = table_below(
        text, "Learning curve, frames:", "share of radar data", "frames", "radar only", *gains
    )
    return "\n".join(markdown_table(rows))


def where_it_helps(told: Mapping[str, Any]) -> str:
    """Sentence on the shares at which more is gained than the standard deviation over seeds."""
    words = []
    for added in ("synthetic", "denoised"):
        shares = sorted(
            one["share"]
            for one in told["conditions"]
            if one["added"] == added
            and not one["moved"]
            and one["gain"]["mean"] > one["gain"]["sd"]
        )
        words.append(f"{', '.join(f'{share:.0%}' for share in shares) or 'no share'} ({added})")
    return f"More than its standard deviation over seeds is gained at {' and '.join(words)}."


def _sample(campaign: Path, out: Path) -> str:
    """Sentence on the bundled recording, of a person whom no training has seen."""
    model = out / "sample.safetensors"
    sd2("classify", "train", campaign, "--maps", "radar,denoised", "--out", model)
    told = {
        maps: json.loads(
            printed("classify", "eval", SAMPLE, "--maps", maps, "--model", model, "--json")
        )
        for maps in ("radar", "denoised")
    }
    return sample_words(told)


def sample_words(told: Mapping[str, Mapping[str, Any]]) -> str:
    """Sentence on scores of the bundled recording by its maps."""
    words = []
    for maps, score in told.items():
        gestures = np.array(score["gestures"])
        words.append(
            f"{100 * score['mean_recall_frames']:.1f} % of the frames and {np.trace(gestures)} of"
            f" {gestures.sum()} swipes of the {maps} map"
        )
    return f"Found in the bundled sample, a person no training has seen: {', '.join(words)}."


if __name__ == "__main__":
    main()
