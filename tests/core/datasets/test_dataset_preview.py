"""The preview sheet shows segments that are there, called what they are."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from lazy_sources import write_dataset
from made_sources import LABELS, source

from sd2core.datasets.preview import draw_preview, examples_of
from sd2core.datasets.reading import Dataset, open_dataset
from sd2core.datasets.source import KINDS
from sd2core.options.exporting import Exporting


@pytest.fixture
def dataset(tmp_path: Path) -> Dataset:
    sources = [
        source(f"r{number}", name, placement=place, frames=150,
               kinds=("synthetic", "simulated") if place == 0 else ("synthetic",))
        for number, name in enumerate(("anna", "ben", "carla"))
        for place in (0, 1)
    ]  # fmt: skip
    write_dataset(tmp_path / "set.npz", sources, Exporting(segment_frames=24, overlap_frames=4))
    return open_dataset(tmp_path / "set.npz")


def test_examples_are_of_different_people_and_of_their_label(dataset: Dataset) -> None:
    examples = examples_of(dataset, 3)
    for label in range(len(LABELS)):
        some = [one for one in examples if one.label == label]
        people = {one.words[0] for one in some}
        rows = dataset["segment_label"][:] == label
        there = {dataset.header.subjects[number] for number in dataset["subject"][:][rows]}
        assert len(people) == min(len(there), 3)
        assert len(some) == min(rows.sum(), 3)
    # Their strongest cell is 0 dB.
    for one in examples:
        for level in one.levels.values():
            assert np.nanmax(level) == pytest.approx(0.0)


def test_what_is_simulated_is_called_so(dataset: Dataset) -> None:
    figure = draw_preview("Swings", dataset.header, examples_of(dataset), len(dataset))
    said = [text.get_text() for text in figure.texts]
    assert "Swings" in said
    assert any("The radar is simulated." in text for text in said)
    assert "Radar\n(simulated)" in said
    assert not any("Radar (real)" in text for text in said)
    both = replace(dataset.header, kinds=(*dataset.header.kinds, "real"))
    beside = draw_preview("Swings", both, examples_of(dataset), len(dataset))
    assert not any("The radar is simulated." in text.get_text() for text in beside.texts)
    pictures = [axes for axes in figure.axes if axes.images]
    shown = sum(len(one.levels) for one in examples_of(dataset))
    assert len(pictures) == shown
    missing = [axes for axes in figure.axes if any(t.get_text() == "none" for t in axes.texts)]
    assert len(pictures) + len(missing) == 2 * len(examples_of(dataset))
    assert {kind for one in examples_of(dataset) for kind in one.levels} <= {*KINDS}
