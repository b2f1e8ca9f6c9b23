"""The paper's Tables 2 and 3 on simulated campaigns, and what each step away from the paper costs.

A part of ``docs/classifier.md``, see :mod:`tools.documentation.classifier`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from sd2core.accuracy.cache import this_machine
from sd2core.body.rotations import Floats
from sd2core.classify.comparison import Table, TableOptions, make_table
from sd2core.classify.comparison_report import network_of
from sd2core.classify.data import ClipSet, clips_of_pairs, merged
from sd2core.classify.experiment import PAPER as PAPER_NETWORK
from sd2core.classify.experiment import Added, Condition, Network
from sd2core.classify.metrics import shares
from sd2core.cli.output import progress_bar
from sd2core.denoise.files import MAP_MODEL, load_model
from sd2core.files.tables import markdown_table
from sd2core.pairs.store import read_pairs
from sd2core.simulate.campaign.making import make_campaign
from sd2core.simulate.campaign.protocol import PAPER, VARIED, Protocol
from sd2core.simulate.campaign.takes import Campaign

HEADING = "The paper's experiment"
FULL_HEADING = "As many frames as the paper's"

SEED = 5
FULL_MINUTES = 54.0
"""A third of it is 32,400 frames; the paper's classes have about 30,000 each."""
RANDOM = replace(PAPER, order="random")
_PROTOCOLS = {
    "to and fro": PAPER,
    "random order": RANDOM,
    "varied": VARIED,
}
_STEPS = {
    "to and fro": PAPER,
    "random order": RANDOM,
    "place": replace(RANDOM, place=True),
    "heading": replace(RANDOM, place=True, heading=True),
    "other movements": VARIED,
}
OURS = Network()
CLASSES = ("horizontal", "vertical", "background")
ADDED: dict[Added, str] = {"nothing": "radar only", "denoised": "+ denoised"}
GIVEN: dict[Added, list[list[float]]] = {
    "nothing": [[87.3, 5.3, 7.4], [6.8, 89.1, 4.1], [3.8, 4.1, 92.1]],
    "denoised": [[91.6, 4.0, 4.5], [4.1, 92.2, 3.7], [2.5, 3.2, 94.3]],
}
"""The paper's Tables 2 and 3, in per cent; rows are true classes."""

_TEXT = """
The paper's six people swipe for 15 s at a time before a fixed radar and camera: `sd2 simulate
campaign --protocol paper` ([decision 54](decisions/0054-protocols.md)). *To and fro* has one kind
of swipe in a take, *random order* all four; *varied* is the campaign above. {minutes:g} minutes of
each, by

```sh
python -m tools.documentation.classifier --only protocols --protocol-minutes {minutes:g} \\
  --seeds {seeds}
```

on {machine}: {runs} trainings, {cpu_min:.0f} minutes of one core. *Unseen*: people not learnt from;
*same*: other takes of those who were. *Ours*: {ours}; *the paper's network*: {paper}. *Gain*: by
denoised maps of other takes. The paper has {given:.1f} on a real radar, and gains {gain:.1f}.

"""
_FULL_TEXT = """
The same with {minutes:g} minutes of each, by

```sh
python -m tools.documentation.classifier --only full-size --seeds {seeds}
```

on {machine}: {runs} trainings, {cpu_min:.0f} minutes of one core.

"""


def protocols_section(out: Path, minutes: float, seeds: int) -> str:
    """Measure what is not measured yet, and return the section in Markdown."""
    known = {one: protocol_clips(out, one, minutes) for one in _STEPS.values()}
    tables = protocol_tables(out, known, seeds)
    steps = {
        name: _table(out, known[one], [Condition()], TableOptions(seeds))
        for name, one in _STEPS.items()
    }
    cpu_s = {id(run): run.cpu_s for table in tables.values() for run in table.runs}
    between = [table for name, table in steps.items() if _STEPS[name].name == "between"]
    cpu_s |= {id(run): run.cpu_s for table in between for run in table.runs}
    text = _TEXT.format(
        machine=this_machine(),
        minutes=minutes,
        ours=network_of(Condition()),
        paper=network_of(Condition(network=PAPER_NETWORK)),
        seeds=seeds,
        given=given_mean("nothing"),
        gain=given_mean("denoised") - given_mean("nothing"),
        runs=len(cpu_s),
        cpu_min=sum(cpu_s.values()) / 60.0,
    )
    return f"{text}{means_table(tables)}\n{step_words(steps)}\n\n"


def full_size_section(out: Path, seeds: int) -> str:
    """Measure what is not measured yet of the full campaigns, and return the section."""
    known = {one: protocol_clips(out, one, FULL_MINUTES) for one in (PAPER, RANDOM)}
    tables = protocol_tables(out, known, seeds)
    runs = [run for table in tables.values() for run in table.runs]
    text = _FULL_TEXT.format(
        minutes=FULL_MINUTES,
        machine=this_machine(),
        seeds=seeds,
        runs=len(runs),
        cpu_min=sum(run.cpu_s for run in runs) / 60.0,
    )
    return f"{text}{means_table(tables)}\n{learnt_words(tables)}\n\n"


Tables = Mapping[tuple[str, str], Table]
"""Of a protocol and whose takes are judged."""


def protocol_tables(out: Path, known: Mapping[Protocol, ClipSet], seeds: int) -> Tables:
    """Both networks of those protocols of the section whose clips are given."""
    everything = [Condition(network=n, added=kind) for n in (OURS, PAPER_NETWORK) for kind in ADDED]
    return {
        (name, people): _table(out, known[one], everything, TableOptions(seeds, same_people=same))
        for name, one in _PROTOCOLS.items()
        if one in known
        for people, same in (("unseen", False), ("same", True))
    }


def protocol_campaign(out: Path, protocol: Protocol, minutes: float) -> Path:
    """A campaign of six people; what is there of it is not made again."""
    varying = [name for name in ("place", "heading", "others") if getattr(protocol, name)]
    path = out / f"{'-'.join([protocol.order, *varying])}.zarr"
    with progress_bar(f"Simulating {path.stem}", unit="take") as progress:
        make_campaign(path, Campaign(SEED, protocol=protocol), minutes=minutes, progress=progress)
    return path


def protocol_clips(out: Path, protocol: Protocol, minutes: float) -> ClipSet:
    """Radar and synthetic maps of a campaign."""
    pairs = read_pairs(protocol_campaign(out, protocol, minutes))
    return merged([clips_of_pairs(pairs, kind) for kind in ("simulated", "synthetic")])


def _table(
    out: Path, known: ClipSet, conditions: Sequence[Condition], options: TableOptions
) -> Table:
    with progress_bar("Training", "run") as progress:
        denoiser = load_model(MAP_MODEL)
        return make_table(out / "runs", known, options, denoiser, progress, conditions)


def confusions(table: Table, added: Added, network: Network = OURS) -> Floats:
    """Confusion of every seed, in per cent, (seeds, true classes, classes)."""
    at = [table.classes.index(name) for name in CLASSES]
    runs = table.of(Condition(network=network, added=added))
    return 100.0 * np.array([shares(run.score.frames)[np.ix_(at, at)] for run in runs])


def means(table: Table, added: Added, network: Network = OURS) -> Floats:
    """Mean recall of every seed, in per cent."""
    found = confusions(table, added, network)
    return np.asarray(np.diagonal(found, axis1=1, axis2=2).mean(axis=-1))


def given_mean(kind: Added) -> float:
    """Mean recall of the paper's table, in per cent."""
    return float(np.diagonal(GIVEN[kind]).mean())


def means_table(tables: Tables) -> str:
    """Mean recalls of frames, and what ours gains by what is added."""
    rows = [["protocol, people", "ours", "gain", "the paper's network"]]
    for (name, people), table in tables.items():
        plain, added = (means(table, kind) for kind in ADDED)
        theirs = means(table, "nothing", PAPER_NETWORK)
        cells = (spread(plain), spread(added - plain, "+"), spread(theirs))
        rows.append([f"{name}, {people}", *cells])
    return "\n".join(markdown_table(rows)) + "\n"


def step_words(steps: Mapping[str, Table]) -> str:
    """Sentence on what each step away from the paper costs, of the same seeds."""
    words = []
    for before, after in pairwise(steps):
        cost = means(steps[before], "nothing") - means(steps[after], "nothing")
        words.append(f"{after} {spread(cost)}")
    return (
        "What each step from *to and fro* to *varied* costs ours with unseen people, in points:"
        f" {'; '.join(words)}."
    )


def learnt_words(tables: Tables) -> str:
    """Sentence on how many frames of each class were learnt from."""
    runs = tables["to and fro", "unseen"].of(Condition())
    frames = (f"{np.mean([run.real[name] for run in runs]):,.0f} {name}" for name in CLASSES)
    words = ", ".join(frames)
    return f"Learnt from, to and fro, unseen: {words} frames; the paper: about 30,000 each."


def spread(values: Floats, sign: str = "") -> str:
    """Mean over seeds and standard deviation."""
    text = f"{values.mean():{sign}.1f}"
    return text if len(values) < 2 else f"{text} ± {values.std(ddof=1):.1f}"
