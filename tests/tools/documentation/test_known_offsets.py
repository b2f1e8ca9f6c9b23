"""Takes of real and simulated radars, shifted by known offsets."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sd2core.mocap.mars_pairs import make_mars_pairs
from sd2core.pairs.store import PairSet, read_pairs
from sd2core.simulate.campaign.making import make_campaign
from sd2core.simulate.campaign.takes import Campaign
from tools.documentation.alignment import OFFSETS_S, Tried, tried
from tools.documentation.measured import BUILD


@pytest.fixture(scope="module")
def mars(shared_data: Path, tmp_path_factory: pytest.TempPathFactory) -> PairSet:
    """Pairs of MARS: those in build/mars.zarr, else of the person with the fewest takes."""
    store = BUILD / "mars.zarr"
    if not store.exists():
        store = tmp_path_factory.mktemp("pairs") / "mars.zarr"
        make_mars_pairs([shared_data / "paired" / "mars_subject4"], store)
    return read_pairs(store)


def of(found: list[Tried], *ways: str) -> list[Tried]:
    return [one for one in found if one.way in ways]


@pytest.mark.slow
@pytest.mark.parametrize("subject", ["1", "4"])
def test_a_real_radar_shifted_by_known_offsets(mars: PairSet, subject: str) -> None:
    if subject not in mars.subjects:
        pytest.skip("no pairs of this person: sd2 pairs mars … --out build/mars.zarr")
    found = tried(mars, subject, OFFSETS_S)
    own = of(found, "moved")
    assert len(own) >= 81
    assert np.mean([one.error_s <= 0.1 for one in own]) >= 0.9
    # Of exercises that are done ten times alike some are refused; what is not is right.
    assert np.mean([one.refused for one in own]) <= 0.25
    assert np.mean([one.error_s <= 0.1 for one in own if not one.refused]) >= 0.98
    # What is not one motion is refused in most cases.
    assert np.mean([one.refused for one in of(found, "other take", "same exercise")]) >= 0.7


@pytest.mark.slow
def test_a_simulated_radar_shifted_by_known_offsets(tmp_path: Path) -> None:
    store = tmp_path / "campaign.zarr"
    make_campaign(store, Campaign(seed=1, take_seconds=12.0), subjects=1, minutes=0.4, processes=1)
    pairs = read_pairs(store)
    assert len(pairs.takes) == 2
    own = of(tried(pairs, pairs.subjects[0], OFFSETS_S[::2]), "moved", "cut")
    # To a frame, whichever way.
    assert [one.error_s for one in own if one.error_s > 1.0 / pairs.frame_rate_hz] == []
