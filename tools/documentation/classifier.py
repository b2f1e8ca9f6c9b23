"""Measure docs/classifier.md: trainings with and without synthetic data, on a simulated campaign.

::

    python -m tools.documentation.classifier [--campaign gestures.zarr] [--large campaign.zarr]

Without ``--campaign`` one is made: six people, 36 minutes, three places of the sensor, of
another seed than the bundled denoiser's, so of other people. ``--large`` is the denoiser's
(``make denoiser`` leaves it in ``build/denoiser``); only its radar is used. What was trained
before is not trained again: the folder ``--out`` keeps every run. ``--only`` measures
a part, and puts it into the page that is there.
"""

from __future__ import annotations

import argparse
import json
import shutil
from pathlib import Path

from sd2core.accuracy.cache import this_machine
from tools.documentation.classifier_protocols import (
    FULL_HEADING,
    HEADING,
    full_size_section,
    protocols_section,
)
from tools.documentation.places import BUILD, DOCS, IMAGES
from tools.documentation.runs import campaign_of, printed, sd2

SEED = 2
SAMPLE = "resources/swipes.sd2"
PAGE = DOCS / "classifier.md"

HEAD = """\
# The gesture classifier

What it recognises, and when synthetic data help it, measured. Made by

```
make classifier
```

{here}on {machine}. What is learnt from, what features and networks are and why is
[decision 37](decisions/0037-gesture-classifiers.md).

## On a simulated campaign

`{campaign}` made {minutes:.0f} minutes of {people} people; each take is seen from {places} places.
**The radar is simulated.** The denoiser is the bundled one, which learnt from a campaign of another
seed, so from other people. `{table}` trained {runs} classifiers in {cpu_min:.0f} minutes of
one core.

Of the takes of the people who are learnt from, five in seven are there as the radar saw them, and
two in seven, 0.4 times as many frames, as video only: what is added are other movements than the
radar saw. With less of the radar's data the video stays as much as it was. All trainings have
equally many steps; the best is chosen on as small a share of the radar's data. *Moved sensors* is
range synthesis: the added movements also as other places of the sensor see them, so more frames.
*Moved, frames* judges the radar's maps from those places; *radar of the same movements* is what
added maps are at best.

"""
CURVE = """
![Learning curve](images/classifier-curve.png)

![Confusion matrices](images/classifier-confusion.png)

"""
LARGE = """\
## With more of the radar's data

`{made}` made {minutes:.0f} minutes of {people} people, the campaign
that the bundled denoiser learnt from; here only its simulated radar is used: `{command}`.

"""
REAL_HEADING = "## On real radar"
REAL = f"""\
{REAL_HEADING}

Trained on recordings of a real radar and evaluated on others:
[real-gestures.md](real-gestures.md).

"""
SAMPLE_HEAD = """\
## On the sample recording

`{train}`, then the maps of the bundled sample (simulated, one person), whom no training has seen.
Its simulated radar has noise in every cell, which a campaign's targets do not have.

"""


def main() -> None:
    """Measure and write."""
    options = _options()
    before, _, after = PAGE.read_text("utf-8").partition(REAL_HEADING)
    before, _, full = before.partition(FULL_HEADING)
    before, _, protocols = before.partition(HEADING)
    protocols, full = f"{HEADING}{protocols}", f"{FULL_HEADING}{full}"
    if options.only in (None, "campaign"):
        before, _, after = _page(options).partition(REAL_HEADING)
    if options.only in (None, "protocols"):
        folder = options.out / "protocols"
        protocols = protocols_section(folder, options.protocol_minutes, options.seeds)
    if options.only in (None, "full-size"):
        full = full_size_section(options.out / "full-size", options.seeds)
    PAGE.write_text(f"{before}{protocols}{full}{REAL_HEADING}{after.rstrip()}\n", "utf-8")


def _page(options: argparse.Namespace) -> str:
    """All but the paper's experiment."""
    folder: Path = options.out
    campaign = options.campaign
    made = f"sd2 simulate campaign --people 6 --minutes {options.minutes:g} --out gestures.zarr"
    made += f" --sensors 3 --seed {SEED} --out gestures.zarr"
    if campaign is None:
        campaign = campaign_of(
            folder, options.minutes, "--sensors", 3, "--seed", SEED, "--workers", 2
        )
    tables = folder / "table"
    chosen = ["--seeds", options.seeds, *(["--shares", options.shares] if options.shares else [])]
    sd2("classify", "table", campaign, "--out", tables, *chosen)
    told = json.loads((tables / "table.json").read_text("utf-8"))
    page = [_head(options, campaign, told, made), (tables / "table.md").read_text("utf-8")]
    for name in ("curve", "confusion"):
        shutil.copyfile(tables / f"{name}.png", IMAGES / f"classifier-{name}.png")
    page.append(CURVE)
    page.append(_findings(told))
    page.append(_large(options, folder))
    page.append(REAL)
    page.append(_sample(campaign, folder))
    return "".join(page)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--campaign", type=Path, help="a simulated campaign that is there already")
    parser.add_argument("--minutes", type=float, default=36.0, help="of the campaign (default: 36)")
    parser.add_argument("--large", type=Path, help="the denoiser's campaign, where it is there")
    parser.add_argument(
        "--large-minutes", type=float, default=168.0, help="of that one (default: 168)"
    )
    parser.add_argument(
        "--only",
        choices=("campaign", "protocols", "full-size"),
        help="everything but the paper's experiment; that one in all its variants; or that with as"
        " many frames as the paper's",
    )
    parser.add_argument(
        "--protocol-minutes", type=float, default=18.0, help="of its campaigns (default: 18)"
    )
    parser.add_argument("--seeds", type=int, default=5, help="default: 5")
    parser.add_argument("--shares", help="of the real data, as `sd2 classify table` has them")
    parser.add_argument("--out", type=Path, default=BUILD / "classifier", help="of all runs")
    return parser.parse_args()


def _head(options: argparse.Namespace, campaign: Path, told: dict, made: str) -> str:
    facts = json.loads(printed("info", campaign, "--json"))
    runs = [run for one in told["conditions"] for run in one["runs"]]
    given = [f"--seeds {options.seeds}"] if options.seeds != 5 else []
    given += [f"--minutes {options.minutes:g}"] if options.minutes != 36 else []
    given += [f"--shares {options.shares}"] if options.shares else []
    return HEAD.format(
        here=f"here with `{' '.join(given)}`, " if given else "here ",
        machine=this_machine(),
        campaign=made,
        minutes=sum(facts["minutes_of_subject"].values()) / facts["placements"],
        people=len(facts["minutes_of_subject"]),
        places=facts["placements"],
        table=f"sd2 classify table gestures.zarr --out tables --seeds {options.seeds}"
        + (f" --shares {options.shares}" if options.shares else ""),
        runs=len(runs),
        cpu_min=sum(run["cpu_s"] for run in runs) / 60.0,
    )


def _findings(told: dict) -> str:
    """Sentences about the table, from its numbers."""
    conditions = told["conditions"]

    def of(**wanted: object) -> dict:
        default = {"share": 1.0, "added": "nothing", "moved": False, "network": told["network"]}
        wanted = default | wanted
        return next(c for c in conditions if all(c[key] == value for key, value in wanted.items()))

    def percent(one: dict, key: str = "mean_recall_frames") -> str:
        return f"{100 * one[key]['mean']:.1f} ± {100 * one[key]['sd']:.1f} %"

    lines = ["### What that says", ""]
    lines.append(
        f"- The {told['radar']} radar's data only, unseen people: {percent(of())} of the frames"
        " (mean over classes),"
        f" {percent(of(), 'mean_recall_gestures')} of the gestures. The paper reports 87 to 92 %"
        " per class, of a sensor and movements of its own."
    )
    s4, hasty = ({**told["network"], **other} for other in ({"model": "s4"}, {"delay_s": 0.0}))
    lines.append(
        f"- S4 on the same columns: {percent(of(network=s4))}, the LSTM {percent(of())}; the LSTM"
        f" that answers at once: {percent(of(network=hasty))}."
    )
    for added, name in (("denoised", "denoised synthetic"), ("synthetic", "synthetic")):
        shares = sorted({c["share"] for c in conditions if c["added"] == added and not c["moved"]})
        gains = [(share, of(share=share, added=added)["gain"]) for share in shares]
        words = ", ".join(
            f"{100 * gain['mean']:+.1f} ± {100 * gain['sd']:.1f} at {share:.0%}"
            for share, gain in gains
        )
        lines.append(f"- Adding {name} maps changes the mean recall by {words} (points).")
        helps = [share for share, gain in gains if gain["mean"] > gain["sd"]]
        if helps:
            lines.append(
                "  More than its standard deviation over seeds is gained with"
                f" {', '.join(f'{share:.0%}' for share in helps)} of the radar's data."
            )
        else:
            lines.append("  Nowhere is that more than its standard deviation over seeds.")
    lines.append(
        "- Trainings are short. Longer ones help most where there is little to learn from, and gain"
        " less by what is added: [decision 37](decisions/0037-gesture-classifiers.md)."
    )
    return "\n".join([*lines, "", ""])


def _large(options: argparse.Namespace, out: Path) -> str:
    campaign, minutes = options.large, options.large_minutes
    if campaign is None:
        campaign = campaign_of(out / "large", minutes, "--seed", 1)
    how = ("--radar-only", "--seeds", options.seeds, "--shares", "30%,100%")
    sd2("classify", "table", campaign, "--out", out / "large-table", *how)
    facts = json.loads(printed("info", campaign, "--json"))["minutes_of_subject"]
    words = LARGE.format(
        made=f"sd2 simulate campaign --people 6 --minutes {minutes:g} --seed 1 --out campaign.zarr",
        minutes=sum(facts.values()),
        people=len(facts),
        command=_command(["classify", "table", "campaign.zarr", "--out", "tables", *how], {}),
    )
    return words + (out / "large-table" / "table.md").read_text("utf-8") + "\n"


def _sample(campaign: Path, out: Path) -> str:
    model = out / "sample.safetensors"
    train = ["classify", "train", campaign, "--maps", "radar,denoised", "--out", model]
    sd2(*train)
    shown = {str(campaign): "gestures.zarr", str(model): "g.safetensors"}
    parts = [SAMPLE_HEAD.format(train=_command(train, shown))]
    for maps in ("radar", "denoised"):
        evaluate = ["classify", "eval", SAMPLE, "--maps", maps, "--model", model]
        parts.append(f"`{_command(evaluate, shown)}`:\n\n```\n{printed(*evaluate)}```\n\n")
    return "".join(parts)


def _command(arguments: list[object], shown: dict[str, str]) -> str:
    return " ".join(["sd2", *(shown.get(str(one), str(one)) for one in arguments)])


if __name__ == "__main__":
    main()
