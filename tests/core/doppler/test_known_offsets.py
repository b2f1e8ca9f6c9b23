"""Takes of real and simulated radars, shifted by known offsets; ``-s`` prints what is found."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest
from guide_pages import REPOSITORY

from sd2core.doppler.alignment import align
from sd2core.errors import Sd2Error
from sd2core.maps import DopplerMap, MapKind
from sd2core.mocap.mars_pairs import make_mars_pairs
from sd2core.pairs.store import PairSet, Take, read_pairs
from sd2core.simulate.campaign.making import make_campaign
from sd2core.simulate.campaign.takes import Campaign
from sd2core.timebase import Timebase

OFFSETS_S = (-3.0, -2.25, -1.5, -0.75, 0.0, 0.75, 1.5, 2.25, 3.0)


@pytest.fixture(scope="module")
def mars(shared_data: Path, tmp_path_factory: pytest.TempPathFactory) -> PairSet:
    """Pairs of MARS: those in build/mars.zarr, else of the person with the fewest takes."""
    store = REPOSITORY / "build" / "mars.zarr"
    if not store.exists():
        store = tmp_path_factory.mktemp("pairs") / "mars.zarr"
        make_mars_pairs([shared_data / "paired" / "mars_subject4"], store)
    return read_pairs(store)


def maps_of(pairs: PairSet, take: Take) -> tuple[DopplerMap, DopplerMap]:
    """Maps of a take, both from 0 s on."""

    def made(values: np.ndarray, kind: MapKind) -> DopplerMap:
        return DopplerMap(values.T, pairs.axis, Timebase(take.times_s - take.times_s[0]), kind)

    return made(take.synthetic, "synthetic"), made(take.radar, pairs.kind)


def outcome(synthetic: DopplerMap, radar: DopplerMap, offset_s: float) -> tuple[float, bool]:
    """Error of an offset, infinite where none is right, and whether it is refused."""
    try:
        found = align(synthetic, radar)
    except Sd2Error:
        return np.inf, True
    return abs(found.offset_s - offset_s), bool(found.problem)


def tried(pairs: PairSet, subject: str, offsets_s: tuple[float, ...]) -> dict[str, np.ndarray]:
    """Outcomes (n, 2) of one person's maps, with their own radar and with that of other takes.

    Of their own the times are moved, or so much is cut from either map that both begin and end at
    other moments of the motion.
    """
    takes = [take for take in pairs.takes if take.subject == subject and take.placement == 0]
    found = defaultdict(list)
    for take in takes:
        synthetic, radar = maps_of(pairs, take)
        for offset_s in offsets_s:
            found["moved"].append(outcome(synthetic, radar.shifted(-offset_s), offset_s))
            frames = round(abs(offset_s) * pairs.frame_rate_hz)  # whole ones can be cut
            kept = len(take.times_s) - frames
            parts = [(0, kept), (frames, frames + kept)][:: 1 if offset_s >= 0 else -1]
            ours, theirs = (
                each.between(*part).shifted(-each.times_s[part[0]])
                for each, part in zip((synthetic, radar), parts, strict=True)
            )
            cut_s = np.copysign(frames / pairs.frame_rate_hz, offset_s)
            found["cut"].append(outcome(ours, theirs, cut_s))
        for other in takes:
            if other is not take:
                # A MARS take is named by its part and the exercise.
                alike = other.name.rpartition("-")[2] == take.name.rpartition("-")[2]
                way = "same exercise" if pairs.kind == "real" and alike else "other take"
                found[way].append(outcome(synthetic, maps_of(pairs, other)[1], np.inf))
    ways = {way: np.array(own) for way, own in found.items()}
    for way, own in ways.items():
        refused = own[:, 1] == 1
        print(f"{subject}, {way}: {100 * refused.mean():.0f} % of {len(own)} refused")
        if way in ("moved", "cut"):
            taken = own[~refused, 0]
            right, median_ms = (taken <= 0.1).mean(), 1e3 * np.median(taken)
            print(f"{100 * right:.0f} % of the rest within 0.1 s, median {median_ms:.0f} ms")
    return ways


@pytest.mark.slow
@pytest.mark.parametrize("subject", ["1", "4"])
def test_a_real_radar_shifted_by_known_offsets(mars: PairSet, subject: str) -> None:
    if subject not in mars.subjects:
        pytest.skip("no pairs of this person: sd2 pairs mars … --out build/mars.zarr")
    found = tried(mars, subject, OFFSETS_S)
    errors_s, refused = found["moved"].T
    assert len(errors_s) >= 81
    assert np.mean(errors_s <= 0.1) >= 0.9
    # Of exercises that are done ten times alike some are refused; what is not is right.
    assert refused.mean() <= 0.25
    assert np.mean(errors_s[refused == 0] <= 0.1) >= 0.98
    # What is not one motion is refused in most cases.
    others = np.concatenate([own for way, own in found.items() if way not in ("moved", "cut")])
    assert others[:, 1].mean() >= 0.7


@pytest.mark.slow
def test_a_simulated_radar_shifted_by_known_offsets(tmp_path: Path) -> None:
    store = tmp_path / "campaign.zarr"
    make_campaign(store, Campaign(seed=1, take_seconds=12.0), subjects=1, minutes=0.4, processes=1)
    pairs = read_pairs(store)
    assert len(pairs.takes) == 2
    found = tried(pairs, pairs.subjects[0], OFFSETS_S[::2])
    # To a frame, whichever way.
    assert np.concatenate([found["moved"], found["cut"]])[:, 0].max() <= 1.0 / pairs.frame_rate_hz
