"""Inertial sensors beside the maps of a data set, on the same clock."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from lazy_sources import lazily, write_dataset
from made_sources import source

from sd2core.datasets.forecast import Counting
from sd2core.datasets.layout import Header, row_shapes
from sd2core.datasets.options import dataset_options
from sd2core.datasets.reading import open_dataset
from sd2core.datasets.recording_sources import Making
from sd2core.datasets.source import Source
from sd2core.datasets.sources import gather
from sd2core.errors import Sd2Error
from sd2core.imu.signals import InertialSignals
from sd2core.options.exporting import Exporting
from tests.small_pairs import write_pairs

PLACES = ("left-wrist", "right-foot")
OPTIONS = Exporting(segment_frames=24, overlap_frames=4, imu=PLACES)


def felt_by(one: Source, places: tuple[str, ...] = PLACES) -> Source:
    """The source with sensors that read a ramp in time, another for each channel."""
    times_s = one.times_s
    imu = {
        place: InertialSignals(
            times_s,
            np.outer(times_s, [1.0, 2.0, 3.0]) + number,
            np.outer(times_s, [4.0, 5.0, 6.0]) + number,
            {"cutoff_hz": 6.0, "at": place},
        )
        for number, place in enumerate(places)
    }
    return replace(one, imu=imu)


@pytest.mark.one_in(3)
@pytest.mark.parametrize("ending", [".zarr", ".h5", ".npz"])
def test_channels_are_written_and_read(tmp_path: Path, ending: str) -> None:
    out = tmp_path / f"set{ending}"
    slow = source("r3", "ben", rate_hz=25.0)
    for times in ((), (slow,)):  # the second time it grows
        sources = [felt_by(one) for one in (source("r1", "anna"), source("r2", "ben"), *times)]
        written = write_dataset(out, sources, OPTIONS)
    assert written.sources == 3
    with open_dataset(out) as dataset:
        assert dataset.header.imu == PLACES
        assert dataset["imu"].shape == (len(dataset), 24, 2, 6)
        start_s = dataset["start_s"][:]
        times_s = start_s[:, None] + np.arange(24) / 30.0  # also of what came at 25 Hz
        assert dataset["resampled"][:].any()
        for number in range(2):
            expected = times_s[..., None] * [1, 2, 3, 4, 5, 6] + number
            np.testing.assert_allclose(dataset["imu"][:, :, number], expected, atol=1e-5)
        told = next(iter(dataset.sources()))["provenance"]["imu"]
        assert told["right-foot"] == {"cutoff_hz": 6.0, "at": "right-foot"}


def test_the_card_states_places_rate_and_cut_off(tmp_path: Path) -> None:
    write_dataset(tmp_path / "set.h5", [felt_by(source())], OPTIONS)
    words = (tmp_path / "set.card.md").read_text(encoding="utf-8")
    assert "inertial sensors at left-wrist, right-foot, *simulated*" in words
    assert "(30 Hz)" in words
    assert "low-passed at 6 Hz" in words
    card = json.loads((tmp_path / "set.card.json").read_text(encoding="utf-8"))
    assert (card["imu"], card["imu_cutoff_hz"]) == (list(PLACES), [6.0, 6.0])


def test_without_sensors_nothing_speaks_of_them(tmp_path: Path) -> None:
    options = replace(OPTIONS, imu=())
    write_dataset(tmp_path / "with.zarr", [felt_by(source())], options)
    write_dataset(tmp_path / "set.zarr", [source()], options)
    files = [path for path in tmp_path.rglob("*") if path.suffix in (".json", ".md", ".jsonl")]
    own = [path for path in files if path.is_relative_to(tmp_path / "set.zarr")]
    own += [path for path in files if path.name.startswith("set.card")]
    assert len(own) > 10
    texts = [path.read_text(encoding="utf-8") for path in own]
    assert not [text for text in texts if re.search(r"\bimu|inertial", text)]
    with open_dataset(tmp_path / "with.zarr") as dataset:
        assert "imu" not in dataset.arrays
        description = dataset.header.as_dict()
        assert Header.from_dict(description, tmp_path) == dataset.header
        assert "imu" not in row_shapes(dataset.header)


def test_a_source_without_them_is_refused(tmp_path: Path) -> None:
    sources = [felt_by(source("r1")), source("r2"), felt_by(source("r3"), PLACES[:1])]
    written = write_dataset(tmp_path / "set.zarr", sources, OPTIONS)
    assert [one.key.recording for one in written.failed] == ["r2", "r3"]
    assert "no inertial sensor at left-wrist, right-foot" in written.failed[0].reason
    assert "no inertial sensor at right-foot" in written.failed[1].reason
    with pytest.raises(Sd2Error, match="begun with inertial sensors at"):
        write_dataset(tmp_path / "set.zarr", sources, replace(OPTIONS, imu=PLACES[:1]))


def test_pairs_have_no_body_to_put_them_on(tmp_path: Path) -> None:
    pairs = tmp_path / "pairs.zarr"
    write_pairs(pairs, ("s1",))
    with pytest.raises(Sd2Error, match=r"pairs\.zarr: no body"):
        gather([pairs], Making(imu=PLACES))


def test_sensors_have_the_clock_of_the_maps() -> None:
    one = source()
    shifted = InertialSignals(one.times_s + 0.01, *np.zeros((2, 100, 3)))
    with pytest.raises(Sd2Error, match="a clock of its own"):
        replace(one, imu={"head": shifted})


def test_the_forecast_counts_them() -> None:
    counting = Counting.of([lazily(felt_by(source()))])
    sizes = [
        counting.forecast(replace(OPTIONS, imu=places), 8).total_bytes for places in ((), PLACES)
    ]
    segments = counting.forecast(OPTIONS, 8).segments
    assert sizes[1] - sizes[0] == segments * 24 * 2 * 6 * 4


@pytest.mark.parametrize(
    ("wrong", "words"), [({"imu": ("knee",)}, "some of head"), ({"segment_frames": 5}, "6 or more")]
)
def test_options_that_cannot_be_are_refused(wrong: dict, words: str) -> None:
    with pytest.raises(Sd2Error, match=words):
        dataset_options(replace(OPTIONS, overlap_frames=1, **wrong))
