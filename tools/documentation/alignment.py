"""Print the tables of docs/decisions/0056-alignment.md.

::

    sd2 pairs mars mars_subject1 mars_subject4 --out mars.zarr
    sd2 simulate campaign --people 2 --minutes 3 --out small.zarr
    python -m tools.documentation.alignment mars.zarr small.zarr

Of every take, maps are aligned whose offset is known: with the radar's times moved by it, or with
so much cut from either map that both begin and end at other moments of the motion. And every map
of a mesh is aligned with the radar of every other take of its person, which does not belong to it.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from sd2core.doppler.alignment import align
from sd2core.errors import Sd2Error
from sd2core.maps import DopplerMap, MapKind
from sd2core.pairs.store import PairSet, Take, read_pairs
from sd2core.timebase import Timebase
from tools.documentation.measured import table

OFFSETS_S = (-3.0, -2.25, -1.5, -0.75, 0.0, 0.75, 1.5, 2.25, 3.0)

Way = Literal["moved", "cut", "other take", "same exercise"]
NAMES: dict[Way, str] = {
    "moved": "same take, times moved",
    "cut": "same take, both cut",
    "other take": "another take",
    "same exercise": "another take of the same exercise",
}


@dataclass(frozen=True)
class Tried:
    """Outcome of aligning one synthetic map with one radar's."""

    way: Way
    error_s: float  # infinite where no offset is right
    refused: bool


def tried(pairs: PairSet, subject: str, offsets_s: tuple[float, ...]) -> list[Tried]:
    """Align all maps of one person, with their own radar and with that of other takes."""
    takes = [take for take in pairs.takes if take.subject == subject and take.placement == 0]
    outcomes = []
    for take in takes:
        for offset_s in offsets_s:
            synthetic, radar = maps_of(pairs, take)
            outcomes.append(outcome("moved", synthetic, radar.shifted(-offset_s), offset_s))
            # To whole frames, which are what can be cut.
            frames = round(abs(offset_s) * pairs.frame_rate_hz)
            kept = len(take.times_s) - frames
            early, late = (0, kept), (frames, frames + kept)
            ours, theirs = (early, late) if offset_s >= 0 else (late, early)
            outcomes.append(
                outcome(
                    "cut",
                    from_zero(synthetic.between(*ours)),
                    from_zero(radar.between(*theirs)),
                    float(np.copysign(frames / pairs.frame_rate_hz, offset_s)),
                )
            )
        for other in takes:
            if other is not take:
                same = pairs.kind == "real" and exercise(other) == exercise(take)
                way: Way = "same exercise" if same else "other take"
                maps = maps_of(pairs, take)[0], maps_of(pairs, other)[1]
                outcomes.append(outcome(way, *maps, float("inf")))
    return outcomes


def exercise(take: Take) -> str:
    """Number of the exercise of a MARS take, the same in all parts."""
    return take.name.rpartition("-")[2]


def maps_of(pairs: PairSet, take: Take) -> tuple[DopplerMap, DopplerMap]:
    """Maps of a take, both from 0 s on."""

    def made(values: np.ndarray, kind: MapKind) -> DopplerMap:
        return DopplerMap(values.T, pairs.axis, Timebase(take.times_s - take.times_s[0]), kind)

    return made(take.synthetic, "synthetic"), made(take.radar, pairs.kind)


def from_zero(doppler: DopplerMap) -> DopplerMap:
    """Map whose clock begins with it."""
    return doppler.shifted(-doppler.timebase.start_s)


def outcome(way: Way, synthetic: DopplerMap, radar: DopplerMap, offset_s: float) -> Tried:
    """Align; what cannot be aligned at all is refused."""
    try:
        alignment = align(synthetic, radar)
    except Sd2Error:
        return Tried(way, float("inf"), True)
    return Tried(way, abs(alignment.offset_s - offset_s), bool(alignment.problem))


def rows(name: str, outcomes: list[Tried]) -> Iterator[tuple[str, ...]]:
    """Lines of the table: one for each way."""
    for way, words in NAMES.items():
        own = [one for one in outcomes if one.way == way]
        if not own:
            continue
        errors_s = np.array([one.error_s for one in own])
        taken = np.array([not one.refused for one in own])
        right = errors_s <= 0.1
        yield (
            name,
            words,
            f"{len(own)}",
            f"{100 * (~taken).mean():.0f} %",
            *(
                (
                    f"{100 * right.mean():.0f} %",
                    f"{100 * right[taken].mean():.0f} %" if taken.any() else "",
                    f"{1e3 * np.median(errors_s[taken]):.0f} ms" if taken.any() else "",
                )
                if np.isfinite(errors_s).any()
                else ("", "", "")
            ),
        )


def main() -> None:
    """Print the table for the stores that are named."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("pairs", type=Path, nargs="+", metavar="PAIRS")
    options = parser.parse_args()
    lines: list[list[str]] = []
    for path in options.pairs:
        pairs = read_pairs(path)
        for subject in pairs.subjects:
            lines += rows(f"{path.stem}, {subject}", tried(pairs, subject, OFFSETS_S))
    heading = (
        "person", "maps", "tried", "refused", "within 0.1 s, all", "of those not refused",
        "median error",
    )  # fmt: skip
    print(table((heading, *lines)))


if __name__ == "__main__":
    main()
