"""The card beside a data set counts movements once, from wherever they were seen."""

from __future__ import annotations

from pathlib import Path

import pytest
from lazy_sources import write_dataset
from made_sources import source

from sd2core.datasets.card import card_paths, write_card
from sd2core.options.exporting import Exporting


@pytest.mark.parametrize("first", [0, 1])
def test_movements_count_once_from_whichever_places(tmp_path: Path, first: int) -> None:
    """Of a batch with placements the recordings' own sensors are not there."""
    out = tmp_path / "set.zarr"
    sources = [
        source(recording, "anna", placement=placement, frames=frames)
        for recording, frames in (("r1", 450), ("r2", 150))
        for placement in range(first, first + 3)
    ]
    write_dataset(out, sources, Exporting())
    card = write_card(out)
    assert card["recordings"] == 2
    assert card["placements"] == 3
    assert card["minutes"] == pytest.approx(20 / 60)
    text = card_paths(out)[0].read_text("utf-8")
    assert "from 2 recordings of 1 subject, 20 s, each seen from up to 3 places" in text


def test_long_ones_are_told_in_minutes(tmp_path: Path) -> None:
    out = tmp_path / "set.zarr"
    write_dataset(out, [source(frames=30 * 150)], Exporting())
    write_card(out)
    assert "2.5 minutes" in card_paths(out)[0].read_text("utf-8")
