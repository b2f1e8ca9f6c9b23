from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from sd2core.errors import Sd2Error
from sd2core.maps import DopplerMap, LimbMaps, joined
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase


def map_of(values, **changes) -> DopplerMap:
    values = np.asarray(values, np.float32)
    given = {
        "axis": VelocityAxis(values.shape[0], 2.0),
        "timebase": Timebase.regular(values.shape[1], 30.0),
        "kind": "synthetic",
        "unit": "share of vertices",
        "meta": {"sensor": [0.0, 0.0, 0.0]},
    } | changes
    return DopplerMap(values=values, **given)


@settings(max_examples=25)
@given(
    hnp.arrays(np.float32, st.tuples(st.integers(2, 40), st.integers(1, 30)),
               elements=st.floats(0, 100, width=32))
)  # fmt: skip
def test_a_saved_map_comes_back_whole(tmp_path_factory, values):
    path = tmp_path_factory.mktemp("map") / "map.npz"
    before = map_of(values, null_bins=(1,), unseen_bins=(0,))
    before.save(path)
    after = DopplerMap.load(path)
    np.testing.assert_array_equal(after.values, before.values)
    np.testing.assert_array_equal(after.times_s, before.times_s)
    assert after.axis == before.axis
    for name in ("kind", "unit", "null_bins", "unseen_bins", "meta"):
        assert getattr(after, name) == getattr(before, name)


def test_limb_maps_come_back_and_follow_the_frames(tmp_path):
    values = np.arange(24, dtype=np.float32).reshape(4, 6)
    limbs = LimbMaps(("arm", "rest"), np.stack([0.25 * values, 0.75 * values]))
    before = map_of(values, limbs=limbs)
    before.save(tmp_path / "map.npz")
    after = DopplerMap.load(tmp_path / "map.npz")
    assert after.limbs.parts == ("arm", "rest")
    np.testing.assert_array_equal(after.limbs.values, limbs.values)
    cut = [before.between(0, 2), before.between(2, 6)]
    np.testing.assert_array_equal(cut[1].limbs.values, limbs.values[..., 2:])
    whole = joined([cut[0], cut[1].shifted(1.0)])
    np.testing.assert_array_equal(whole.values, values)
    assert whole.limbs is None
    with pytest.raises(Sd2Error, match=r"\(4, 6\), its limb maps of \(4, 5\)"):
        replace(before, limbs=limbs.between(0, 5))


def test_mean_and_peak_velocity():
    values = np.zeros((4, 3))
    values[:, 0] = [0, 0, 1, 1]
    values[:, 1] = [3, 0, 0, 1]
    doppler_map = map_of(values)
    np.testing.assert_allclose(doppler_map.mean_velocity_mps(), [1.0, -0.75, np.nan])
    np.testing.assert_allclose(doppler_map.peak_velocity_mps(), [0.5, -1.5, np.nan])


def test_a_shift_moves_only_the_clock():
    doppler_map = map_of(np.ones((4, 3)))
    shifted = doppler_map.shifted(0.25)
    np.testing.assert_allclose(shifted.times_s, doppler_map.times_s + 0.25)
    assert shifted.values is doppler_map.values


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"axis": VelocityAxis(5, 2.0)}, "(5 bins, 3 frames)"),
        ({"kind": "guessed"}, "'guessed'"),
        ({"null_bins": (4,)}, "bins from 0 to 3"),
    ],
)
def test_a_map_that_contradicts_itself_is_explained(changes, words):
    with pytest.raises(Sd2Error) as caught:
        map_of(np.ones((4, 3)), **changes)
    assert words in str(caught.value)


def test_files_that_are_no_map_are_explained(tmp_path):
    text = tmp_path / "text.npz"
    text.write_text("not a zip file")
    with pytest.raises(Sd2Error, match=r"text\.npz cannot be read"):
        DopplerMap.load(text)
    other = tmp_path / "other.npz"
    np.savez(other, vertices=np.zeros(3))
    with pytest.raises(Sd2Error, match=r"has no meta, times_s, values, velocity_mps"):
        DopplerMap.load(other)
    with pytest.raises(Sd2Error, match=r"missing\.npz"):
        DopplerMap.load(tmp_path / "missing.npz")


def test_a_newer_format_is_refused(tmp_path):
    path = tmp_path / "map.npz"
    map_of(np.ones((4, 3))).save(path)
    with np.load(path) as data:
        arrays = dict(data)
    meta = json.loads(str(arrays["meta"]))
    arrays["meta"] = json.dumps(meta | {"version": 99})
    np.savez(path, **arrays)
    with pytest.raises(Sd2Error, match="version 99"):
        DopplerMap.load(path)


@pytest.mark.parametrize("meta", [{"notes": "by hand"}, {"options": "none"}, {"beyond_share": 2}])
def test_what_could_not_be_read_again_is_not_saved(tmp_path, meta):
    with pytest.raises(Sd2Error, match=rf"map\.npz: {next(iter(meta))}"):
        map_of(np.ones((4, 3)), meta=meta).save(tmp_path / "map.npz")
    assert not any(tmp_path.iterdir())


def test_numbers_of_numpy_in_a_provenance_are_plain_ones(tmp_path):
    numbers = {"turned": np.int64(3), "weights": [np.float32(0.5)], "sure": np.bool_(True)}
    axis = VelocityAxis(np.int64(4), np.float32(2.0))
    map_of(np.ones((4, 3)), axis=axis, meta=numbers).save(tmp_path / "map.npz")
    read = DopplerMap.load(tmp_path / "map.npz")
    assert (read.meta, read.axis) == (numbers, axis)
    assert type(read.meta["turned"]) is int


def test_a_failed_write_leaves_the_old_file(tmp_path):
    path = tmp_path / "map.npz"
    map_of(np.ones((4, 3))).save(path)
    before = path.read_bytes()
    with pytest.raises(TypeError):
        map_of(np.ones((4, 3)), meta={"own": object()}).save(path)
    for value in (np.nan, np.inf):
        with pytest.raises(Sd2Error, match="NaN or infinite"):
            map_of(np.full((4, 3), value)).save(path)
    assert path.read_bytes() == before
    assert [entry.name for entry in tmp_path.iterdir()] == ["map.npz"]


@pytest.mark.parametrize(
    "changes",
    [
        {"values": np.full((4, 3), np.nan, np.float32)},
        {"times_s": np.array(["a", "b", "c"])},
        {"meta": json.dumps([1])},
        {"meta": '{"format": "sd2-doppler-map", "version": 1, "v_max_mps": "abc"}'},
        {"meta": "[" * 100_000},
    ],
)
def test_a_damaged_map_is_explained(tmp_path, changes):
    path = tmp_path / "map.npz"
    map_of(np.ones((4, 3))).save(path)
    with np.load(path) as data:
        arrays = dict(data) | changes
    np.savez(path, **arrays)
    with pytest.raises(Sd2Error, match=r"map\.npz"):
        DopplerMap.load(path)
