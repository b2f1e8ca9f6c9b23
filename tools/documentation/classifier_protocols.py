"""The paper's Tables 2 and 3 on simulated campaigns, and what each step away from the paper costs.

A part of ``docs/classifier.md``, see :mod:`tools.documentation.classifier`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
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

HEADING = "## The paper's experiment"
FULL_HEADING = "## As many frames as the paper's"

SEED = 5
FULL_MINUTES = 54.0
"""A third of it is 32,400 frames; the paper's classes have about 30,000 each."""
RANDOM = replace(PAPER, order="random")
_PROTOCOLS = {
    "*paper*, to and fro": PAPER,
    "*paper*, random order": RANDOM,
    "*varied*": VARIED,
}
_STEPS = {
    "*paper*: one kind of swipe to and fro in a take": PAPER,
    "+ order: four kinds at random": RANDOM,
    "+ place of person, camera and radar": replace(RANDOM, place=True),
    "+ heading": replace(RANDOM, place=True, heading=True),
    "+ other movements: *varied*": VARIED,
}
_NETWORKS = {"ours": Network(), "the paper's": PAPER_NETWORK}
_CLASSES = ("horizontal", "vertical", "background")
ADDED: dict[Added, str] = {"nothing": "radar only", "denoised": "+ denoised"}
_GIVEN: dict[Added, list[list[float]]] = {
    "nothing": [[87.3, 5.3, 7.4], [6.8, 89.1, 4.1], [3.8, 4.1, 92.1]],
    "denoised": [[91.6, 4.0, 4.5], [4.1, 92.2, 3.7], [2.5, 3.2, 94.3]],
}
"""The paper's Tables 2 and 3, in per cent; rows are true classes."""

_TEXT = """\
{heading}

The paper's six people swipe for 15 s at a time before a radar and a camera that stay where they
are, and its classes have about 30,000 frames each. It does not say what its background is, how
frames are labelled, nor whether those judged were learnt from. `sd2 simulate campaign --protocol
paper` has everybody face radar and camera, 2.2 m ahead and 1.1 m above the floor; of three takes of
15 s one has horizontal swipes, to and fro, one vertical ones, and in one the hands hang. With
`--order random` two of three takes have all four swipes. A frame has a swipe's class within the
stroke alone; pauses, and hands that are brought to where a swipe begins, are background. *Varied*
is what the other campaigns of this page are.

This section was made, on {machine}, by

```
python -m tools.documentation.classifier --only protocols --protocol-minutes {minutes:g} \\
  --seeds {seeds}
```

Each campaign has {minutes:g} minutes of the same six people (seed {seed}). **The radar is
simulated.** Ours is the network {ours}; the paper's is
{paper}. Both have the same steps of training, the best of which is
chosen on a part that is not judged. Numbers are per cent of frames, mean ± standard deviation over
{seeds} seeds (each another split, draw and network). *Unseen*: of six people four are learnt from,
one chooses, one is judged, another one by every seed. *Same*: other takes of the people learnt from
are judged. What is added are synthetic maps of other takes, 0.4 frames for each of the radar's,
denoised by the bundled denoiser. {runs} trainings took {cpu_min:.0f} minutes of one core.

Mean of the three classes:

"""
_FULL_TEXT = """\
{heading}

The section above learns from a third of what the paper had. Here the two campaigns in which place,
heading and other movements are the paper's have {minutes:g} minutes each; all else is as above.
Made, on {machine}, by

```
python -m tools.documentation.classifier --only full-size --seeds {seeds}
```

{runs} trainings took {cpu_min:.0f} minutes of one core. Mean of the three classes:

"""
_STEPS_TEXT = """
### From *paper* to *varied*

Our network, radar only, unseen people. Each line varies what those above it vary; its cost is the
difference from the line above, of the same seeds.

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
        heading=HEADING,
        machine=this_machine(),
        minutes=minutes,
        seed=SEED,
        ours=network_of(Condition()),
        paper=network_of(Condition(network=PAPER_NETWORK)),
        seeds=seeds,
        runs=len(cpu_s),
        cpu_min=sum(cpu_s.values()) / 60.0,
    )
    return text + _results(tables) + _STEPS_TEXT + _lines(_step_rows(steps)) + "\n"


def full_size_section(out: Path, seeds: int) -> str:
    """Measure what is not measured yet of the full campaigns, and return the section."""
    known = {one: protocol_clips(out, one, FULL_MINUTES) for one in (PAPER, RANDOM)}
    tables = protocol_tables(out, known, seeds)
    runs = [run for table in tables.values() for run in table.runs]
    text = _FULL_TEXT.format(
        heading=FULL_HEADING,
        minutes=FULL_MINUTES,
        machine=this_machine(),
        seeds=seeds,
        runs=len(runs),
        cpu_min=sum(run.cpu_s for run in runs) / 60.0,
    )
    return text + _results(tables, " with as many frames") + "\n"


def _results(tables: Tables, apart: str = "") -> str:
    """Means, findings and both confusion tables; ``apart`` tells their headings from others."""
    text = means_table(tables) + "\n" + _findings(tables)
    for number, kind in enumerate(ADDED, start=2):
        text += f"\n### Table {number}{apart}: {ADDED[kind]}\n\n" + confusion_table(tables, kind)
    return text


Tables = Mapping[tuple[str, str], Table]
"""Of a protocol and whose takes are judged."""


def protocol_tables(out: Path, known: Mapping[Protocol, ClipSet], seeds: int) -> Tables:
    """Both networks of those protocols of the section whose clips are given."""
    everything = [Condition(network=n, added=kind) for n in _NETWORKS.values() for kind in ADDED]
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


def _confusions(table: Table, network: Network, added: Added) -> Floats:
    """Confusion of every seed, in per cent, (seeds, true classes, classes)."""
    at = [table.classes.index(name) for name in _CLASSES]
    runs = table.of(Condition(network=network, added=added))
    return 100.0 * np.array([shares(run.score.frames)[np.ix_(at, at)] for run in runs])


def _recalls(confusions: Floats) -> Floats:
    """Per cent of each class, (..., classes)."""
    return np.asarray(np.diagonal(confusions, axis1=-2, axis2=-1))


def _means(table: Table, network: Network, added: Added) -> Floats:
    """Mean recall of every seed, in per cent."""
    return np.asarray(_recalls(_confusions(table, network, added)).mean(axis=-1))


def _given_mean(kind: Added) -> float:
    return float(_recalls(np.array(_GIVEN[kind])).mean())


def means_table(tables: Tables) -> str:
    """Mean recalls beside the paper's."""
    head = [f"{who}, {words}" for who in _NETWORKS for words in (*ADDED.values(), "gain")]
    before, after = map(_given_mean, ADDED)
    given = [f"{before:.1f}", f"{after:.1f}", f"{after - before:+.1f}"]
    rows = [["protocol", "people", *head], ["the paper, real radar", "–", "", "", "", *given]]
    for (name, people), table in tables.items():
        cells = []
        for network in _NETWORKS.values():
            plain, added = (_means(table, network, kind) for kind in ADDED)
            cells += [_spread(plain), _spread(added), _spread(added - plain, "+")]
        rows.append([name, people, *cells])
    return _lines(rows)


def confusion_table(tables: Tables, kind: Added) -> str:
    """Confusion matrices of both networks side by side, and the paper's."""
    head = [f"{who}: {name}" for who in _NETWORKS for name in _CLASSES]
    rows = [["protocol", "people", "true", *head]]
    for name, values in zip(_CLASSES, _GIVEN[kind], strict=True):
        rows.append(["the paper, real radar", "–", name, "", "", "", *map(str, values)])
    for (protocol, people), table in tables.items():
        both = np.concatenate(
            [_confusions(table, network, kind) for network in _NETWORKS.values()], axis=-1
        )
        for row, name in enumerate(_CLASSES):
            rows.append([protocol, people, name, *map(_spread, both[:, row].T)])
    return _lines(rows)


def _step_rows(steps: Mapping[str, Table]) -> list[list[str]]:
    rows = [["what varies", *_CLASSES, "mean", "cost, points"]]
    before: Floats | None = None
    for name, table in steps.items():
        each = _recalls(_confusions(table, Network(), "nothing"))
        mean = each.mean(axis=-1)
        cost = "" if before is None else _spread(before - mean, "+")
        rows.append([name, *map(_spread, each.T), _spread(mean), cost])
        before = mean
    return rows


def _findings(tables: Tables) -> str:
    """Sentences from the numbers: the paper's means, and other people."""
    lines = []
    for kind, words in ADDED.items():
        found = {
            people: _means(table, Network(), kind)
            for (name, people), table in tables.items()
            if _PROTOCOLS[name] == PAPER
        }
        reached = ", ".join(
            f"{_spread(each)} % ({people} people), {each.mean() - _given_mean(kind):+.1f} points"
            for people, each in found.items()
        )
        lines.append(
            f"- To and fro, {words}, beside the paper's {_given_mean(kind):.1f} %: {reached}."
        )
    for name in dict.fromkeys(protocol for protocol, _ in tables):
        unseen, same = (
            _means(tables[name, who], Network(), "nothing") for who in ("unseen", "same")
        )
        lines.append(
            f"- {name}, radar only: unseen people {_spread(unseen)} %, the same people"
            f" {_spread(same)} %."
        )
    runs = tables["*paper*, to and fro", "unseen"].of(Condition())
    frames = (f"{np.mean([run.real[name] for run in runs]):,.0f} of {name}" for name in _CLASSES)
    lines.append(
        f"- To and fro, radar only, unseen people: learnt from {', '.join(frames)} (frames, mean"
        " over seeds; the paper: about 30,000 of each)."
    )
    return "\n".join(lines) + "\n"


def _spread(values: Floats, sign: str = "") -> str:
    text = f"{values.mean():{sign}.1f}"
    return text if len(values) < 2 else f"{text} ± {values.std(ddof=1):.1f}"


def _lines(rows: Sequence[Sequence[str]]) -> str:
    return "\n".join(markdown_table(rows)) + "\n"
