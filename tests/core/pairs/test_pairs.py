"""Takes survive the way to disk and back, whole or not at all."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2core.errors import Sd2Error
from sd2core.maps import LimbMaps
from sd2core.pairs.segments import cut, join, segment_starts
from sd2core.pairs.store import LOCK_NAME, PairWriter, Take, read_pairs
from sd2core.pairs.summary import INDEX_NAME, TakeKey, is_pair_store
from sd2core.sensor import VelocityAxis
from tests.damaged_files import change, lose, states_of

HEADER: dict[str, Any] = {
    "kind": "simulated",
    "axis": VelocityAxis(8, 2.0),
    "null_bins": (3, 4),
    "frame_rate_hz": 30.0,
    "labels": ("background", "swipe"),
    "provenance": {"seed": 3},
}


def take(name: str, frames: int = 20, subject: str = "s1", placement: int = 0) -> Take:
    rng = np.random.default_rng(len(name) + frames + placement)
    return Take(
        subject=subject,
        name=name,
        synthetic=rng.random((frames, 8), np.float32),
        radar=rng.random((frames, 8), np.float32),
        times_s=np.arange(frames) / 30.0,
        label=rng.integers(0, 2, frames).astype(np.int8),
        sensor_position_m=rng.normal(size=3),
        placement=placement,
    )


def same(one: Take, other: Take) -> bool:
    return one.key == other.key and all(
        np.array_equal(getattr(one, name), getattr(other, name))
        for name in ("synthetic", "radar", "times_s", "label", "sensor_position_m")
    )


def test_what_is_written_is_read(tmp_path: Path) -> None:
    takes = [take("a", 20), take("b", 7), take("b", 9, "s2"), take("b", 9, "s2", placement=1)]
    writer = PairWriter(tmp_path / "pairs.zarr", **HEADER)
    for each in takes:
        writer.append(each)
    pairs = read_pairs(tmp_path / "pairs.zarr")
    assert all(same(*two) for two in zip(pairs.takes, takes, strict=True))
    assert pairs.subjects == ("s1", "s2")
    assert pairs.frames == 45
    assert (pairs.kind, pairs.axis, pairs.null_bins) == ("simulated", HEADER["axis"], (3, 4))
    assert pairs.provenance == {"seed": 3}
    assert [each.title for each in pairs.of(["s2"]).takes] == ["s2/b", "s2/b@1"]
    assert len(pairs.placements(first_only=True).takes) == 3


def test_limb_maps_come_along(tmp_path: Path) -> None:
    path, parts = tmp_path / "pairs.zarr", ("trunk", "forearm.L", "forearm.R")
    writer = PairWriter(path, **HEADER, parts=parts)
    rng = np.random.default_rng(1)
    takes = []
    for name, frames in (("a", 20), ("b", 7)):
        limbs = LimbMaps(parts, rng.random((3, 8, frames), np.float32))
        takes.append(replace(take(name, frames), limbs=limbs))
        writer.append(takes[-1])
    with pytest.raises(Sd2Error, match=r"split into the parts \[\]"):
        writer.append(take("c"))
    again = read_pairs(path)
    assert again.has_limbs
    for found, wanted in zip(again.takes, takes, strict=True):
        assert found.limbs is not None
        assert wanted.limbs is not None
        assert found.limbs.parts == parts
        np.testing.assert_array_equal(found.limbs.values, wanted.limbs.values)
        values = wanted.limbs.values
        columns = np.concatenate([values[0], values[1] + values[2]]).T
        np.testing.assert_array_equal(found.inputs(("trunk", "forearm")), columns)
        np.testing.assert_array_equal(found.inputs(), found.synthetic)
    with pytest.raises(Sd2Error, match="no part 'tail'"):
        again.takes[0].inputs(("tail",))
    with pytest.raises(Sd2Error, match="begun with parts"):
        PairWriter(path, **HEADER)
    with pytest.raises(Sd2Error, match=r"limb maps are of shape \(3, 8, 19\)"):
        replace(takes[0], limbs=takes[0].limbs.between(0, 19))  # type: ignore[union-attr]


def test_what_is_not_split_says_so() -> None:
    with pytest.raises(Sd2Error, match=r"s1/a is not split.*--limbs"):
        take("a").inputs(("trunk",))


def test_parts_of_one_person_become_one_subject(tmp_path: Path) -> None:
    """Stores of MARS recordings once had a subject for each part."""
    path = tmp_path / "mars.zarr"
    header = {**HEADER, "provenance": {"made_by": "sd2 pairs mars"}}
    writer = PairWriter(path, **header)
    for subject in ("1-test", "1-validate", "4-test"):
        writer.append(take("stretch-01", 20, subject))
    pairs = read_pairs(path)
    assert pairs.subjects == ("1", "4")
    assert [each.title for each in pairs.of(["1"]).takes] == [
        "1/test-stretch-01",
        "1/validate-stretch-01",
    ]
    assert TakeKey("1", "test-stretch-01", 0) in PairWriter(path, **header).done
    PairWriter(path, **header).append(take("test-stretch-02", 20, "1"))
    assert len(read_pairs(path).of(["1"]).takes) == 3


def test_a_killed_writer_loses_only_the_take_it_was_at(tmp_path: Path) -> None:
    path = tmp_path / "pairs.zarr"
    PairWriter(path, **HEADER).append(take("a"))
    writer = PairWriter(path, **HEADER)
    writer.append(take("torn", 30))
    index = path / INDEX_NAME
    index.write_bytes(index.read_bytes()[:-9])

    assert [each.name for each in read_pairs(path).takes] == ["a"]
    again = PairWriter(path, **HEADER)
    assert again.done == {TakeKey("s1", "a", 0)}
    again.append(take("b", 11))
    assert [each.name for each in read_pairs(path).takes] == ["a", "b"]
    assert same(read_pairs(path).takes[1], take("b", 11))


def test_two_do_not_write_the_same_takes(tmp_path: Path) -> None:
    path = tmp_path / "pairs.zarr"
    writer, other = PairWriter(path, **HEADER), PairWriter(path, **HEADER)
    writer.append(take("a"))
    with pytest.raises(Sd2Error, match="Another process writes to"):
        other.append(take("a"))
    writer.append(take("b"))
    assert [each.name for each in read_pairs(path).takes] == ["a", "b"]
    assert not (path / LOCK_NAME).exists()


def test_a_begun_store_goes_on_only_with_the_same_settings(tmp_path: Path) -> None:
    PairWriter(tmp_path / "p", **HEADER).append(take("a"))
    with pytest.raises(Sd2Error, match=r"begun with frame_rate_hz 30.0.*10.0"):
        PairWriter(tmp_path / "p", **{**HEADER, "frame_rate_hz": 10.0})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"synthetic": np.ones((20, 9), np.float32)}, "shape"),
        ({"radar": np.full((20, 8), -1, np.float32)}, "radar holds values that are negative"),
        ({"synthetic": np.full((20, 8), np.nan, np.float32)}, "not finite"),
        ({"label": np.zeros(19, np.int8)}, "19 labels"),
    ],
)
def test_a_take_that_does_not_fit_together_is_refused(change: Any, message: str) -> None:
    with pytest.raises(Sd2Error, match=message):
        replace(take("a"), **change)


def test_a_take_of_another_set_is_refused(tmp_path: Path) -> None:
    writer = PairWriter(tmp_path / "p", **HEADER)
    writer.append(take("a"))
    with pytest.raises(Sd2Error, match="already holds the take s1/a"):
        writer.append(take("a"))
    with pytest.raises(Sd2Error, match="labels from"):
        writer.append(replace(take("b"), label=np.full(20, 2, np.int8)))
    wide = np.zeros((20, 9), np.float32)
    with pytest.raises(Sd2Error, match="9 bins"):
        writer.append(replace(take("b"), synthetic=wide, radar=wide))


def test_what_is_no_set_of_pairs_is_named(tmp_path: Path) -> None:
    with pytest.raises(Sd2Error, match="holds no pairs"):
        read_pairs(tmp_path)
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(Sd2Error, match="new or empty folder"):
        PairWriter(tmp_path, **HEADER)
    path = tmp_path / "p"
    PairWriter(path, **HEADER)
    assert is_pair_store(path)
    with pytest.raises(Sd2Error, match="no take yet"):
        read_pairs(path)


def test_a_newer_version_and_a_damaged_index_are_named(tmp_path: Path) -> None:
    path = tmp_path / "p"
    PairWriter(path, **HEADER).append(take("a"))
    index = path / INDEX_NAME
    whole = index.read_text()
    index.write_text("{}\n" + whole)
    with pytest.raises(Sd2Error, match="line 1 cannot be read"):
        read_pairs(path)
    index.write_text(whole.replace('"stop": 20', '"stop": 2000'))
    with pytest.raises(Sd2Error, match="shorter than"):
        read_pairs(path)
    index.write_text(whole)
    header = json.loads((path / "zarr.json").read_text())
    header["attributes"]["version"] = 2
    (path / "zarr.json").write_text(json.dumps(header))
    with pytest.raises(Sd2Error, match="version 2"):
        read_pairs(path)


@given(st.integers(1, 400), st.integers(1, 80), st.data())
def test_windows_cover_every_frame_and_join_to_what_they_were(
    frames: int, length: int, data: st.DataObject
) -> None:
    overlap = data.draw(st.integers(0, length - 1))
    starts = segment_starts(frames, length, overlap)
    if frames < length:
        assert len(starts) == 0
        return
    assert starts[0] == 0
    assert starts[-1] + length == frames
    steps = np.diff(starts)
    assert (steps > 0).all()
    assert (steps[:-1] == length - overlap).all()
    assert (steps <= length - overlap).all()
    values = np.random.default_rng(frames).random((frames, 3), np.float32)
    windows = cut(values, starts, length)
    assert np.array_equal(windows[0], values[:length])
    np.testing.assert_allclose(join(windows, starts, frames), values, rtol=1e-6)


def test_where_windows_overlap_the_one_farther_from_its_end_counts_more() -> None:
    windows = np.stack([np.zeros((10, 1)), np.ones((10, 1))]).astype(np.float32)
    joined = join(windows, np.array([0, 6]), 16)[:, 0]
    assert (joined[:6] == 0).all()
    assert (joined[10:] == 1).all()
    np.testing.assert_allclose(joined[6:10], [0.2, 0.4, 0.6, 0.8], rtol=1e-6)


def test_an_overlap_as_long_as_the_window_is_refused() -> None:
    with pytest.raises(Sd2Error, match="72 frames overlap by 72"):
        segment_starts(100, 72, 72)


@pytest.mark.parametrize("damage", [change, lose])
def test_frames_in_a_damaged_chunk_are_read_around_and_told(
    tmp_path: Path, damage: Callable[[Path], None]
) -> None:
    path = tmp_path / "pairs.zarr"
    writer = PairWriter(path, **HEADER)
    takes = [take("a", 2000), take("b", 5000), take("c", 100), take("d", 3000)]
    for each in takes:
        writer.append(each)
    # Chunks of 2250 frames: the second is within b, the fourth holds the end of b, c, and of d.
    for number in (1, 3):
        damage(path / "radar" / "c" / str(number) / "0")
    pairs = read_pairs(path)
    kept = [
        takes[0],
        takes[1].part(slice(0, 250)),
        takes[1].part(slice(2500, 4750)),
        takes[3].part(slice(9000 - 7100, 3000)),
    ]
    assert all(same(*two) for two in zip(pairs.takes, kept, strict=True))
    assert pairs.provenance["frames_lost"] == {"s1/b": 2500, "s1/c": 100, "s1/d": 1900}
    assert pairs.lost_frames == 4500


def test_pairs_of_which_nothing_is_left_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "pairs.zarr"
    PairWriter(path, **HEADER).append(take("a"))
    lose(path / "times_s" / "c" / "0")
    with pytest.raises(Sd2Error, match=r"pairs\.zarr .*frames 0 to 19 of times_s"):
        read_pairs(path)


@pytest.mark.parametrize("times_s", [[0.0, 0.0, 0.1], [0.0, 0.2, 0.1], [0.0, 0.1, np.nan]])
def test_times_of_a_take_increase(times_s: list[float]) -> None:
    with pytest.raises(Sd2Error, match="s1/a: its times do not increase"):
        replace(take("a", 3), times_s=np.array(times_s))


def test_a_store_comes_into_being_whole(tmp_path: Path) -> None:
    folder = tmp_path / "work"
    folder.mkdir()
    with states_of(folder, tmp_path) as left:
        PairWriter(folder / "pairs.zarr", **HEADER)
    assert len(left) >= 5
    for state in left:
        path = state / "pairs.zarr"
        assert not path.exists()
        PairWriter(path, **HEADER).append(take("a"))
        assert same(read_pairs(path).takes[0], take("a"))


def test_pairs_that_an_earlier_version_left_half_made_are_begun_anew(tmp_path: Path) -> None:
    path = tmp_path / "pairs.zarr"
    PairWriter(path, **HEADER)
    shutil.rmtree(path / "radar")
    shutil.rmtree(path / "label")
    PairWriter(path, **HEADER).append(take("a"))
    assert same(read_pairs(path).takes[0], take("a"))
