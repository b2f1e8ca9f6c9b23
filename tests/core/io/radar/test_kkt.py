"""Gesture recordings of the K60168A: what they say, what is assumed, what is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from kkt_files import maps, write_kkt

from sd2core.errors import Sd2Error
from sd2core.io.radar import holds_map, load_capture, load_recorded_map
from sd2core.io.radar.kkt import BIN_WIDTH_MPS, FRAME_S, TRACK, load_kkt

FRAMES = 12


def test_an_echo_is_squared_summed_over_range_and_turned_round(tmp_path: Path) -> None:
    values = maps(FRAMES)
    values[0, 7, 20] = 3.0
    doppler = load_kkt(write_kkt(tmp_path / "a.h5", DS1=values)).doppler
    assert doppler.kind == "real"
    assert doppler.values.shape == (31, FRAMES)
    # Four bins above the middle one is receding.
    expected = np.zeros((31, FRAMES))
    expected[15 - 4] = 2.0**2 + 3.0**2
    np.testing.assert_array_equal(doppler.values, expected)
    np.testing.assert_allclose(doppler.peak_velocity_mps(), -4 * BIN_WIDTH_MPS)


def test_the_bin_of_zero_doppler_is_at_zero_velocity(tmp_path: Path) -> None:
    values = np.zeros_like(maps(FRAMES))
    values[0, 0, 16] = 1.0
    doppler = load_kkt(write_kkt(tmp_path / "a.h5", DS1=values)).doppler
    np.testing.assert_allclose(doppler.peak_velocity_mps(), 0.0, atol=1e-12)


def test_the_largest_half_precision_number_is_squared_without_overflow(tmp_path: Path) -> None:
    values = np.full_like(maps(2), np.finfo(np.float16).max)
    doppler = load_kkt(
        write_kkt(tmp_path / "a.h5", 2, DS1=values, LABEL=np.zeros((2, 1), np.uint16))
    ).doppler
    assert np.isfinite(doppler.values).all()
    np.testing.assert_allclose(doppler.values, 32 * 65504.0**2, rtol=1e-6)


def test_labels_are_runs_of_marked_frames(tmp_path: Path) -> None:
    marks = np.array([1, 1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 1], np.uint16)
    for shape in ((12, 1), (12,)):
        labels = load_kkt(write_kkt(tmp_path / "a.h5", LABEL=marks.reshape(shape))).labels
        found = [(span.start_s, span.end_s) for span in labels.spans]
        np.testing.assert_allclose(found, FRAME_S * np.array([[0, 2], [4, 5], [10, 12]]))
        assert {(s.label, s.track, s.origin) for s in labels.spans} == {("Wave", TRACK, "import")}
        assert labels.label_set.find("Wave") is not None


def test_a_background_has_no_spans(tmp_path: Path) -> None:
    path = write_kkt(tmp_path / "a.h5", LABEL=np.zeros((FRAMES, 1), np.uint16), name="Background")
    assert load_kkt(path).labels.spans == ()


def test_what_is_assumed_is_said(tmp_path: Path) -> None:
    recorded = load_kkt(write_kkt(tmp_path / "a.h5"))
    assert "no units" in recorded.notes[0]
    assert "nothing is known" in recorded.notes[0]
    assert recorded.doppler.meta["velocity_assumed"]
    assert "Description" not in recorded.doppler.meta["recorded_by"]
    recorded.doppler.save(tmp_path / "a.npz")
    assert type(recorded.doppler).load(tmp_path / "a.npz").meta["notes"] == list(recorded.notes)


@pytest.mark.parametrize(
    "name", ["Wave", b"Wave", np.array(["Wave"], dtype=object), np.array([b"Wave"]), " Wave "]
)
def test_the_name_may_be_stored_in_several_ways(tmp_path: Path, name: Any) -> None:
    assert load_kkt(write_kkt(tmp_path / "a.h5", name=name)).gesture == "Wave"


@pytest.mark.parametrize("name", [None, "", "two\nlines", "x" * 201, np.array([], np.float64)])
def test_without_a_usable_name_the_labels_are_called_gesture(tmp_path: Path, name: Any) -> None:
    recorded = load_kkt(write_kkt(tmp_path / "a.h5", name=name))
    assert {span.label for span in recorded.labels.spans} == {"gesture"}
    assert any("does not name its gesture" in note for note in recorded.notes)


def counter(*values: int) -> np.ndarray:
    return np.repeat(np.array(values)[:, None], 2, axis=1).astype(np.uint16)


def test_frames_that_the_counter_leaves_out_leave_a_gap(tmp_path: Path) -> None:
    marks = np.array([[0], [1], [1], [0]], np.uint16)
    path = write_kkt(tmp_path / "a.h5", 4, LABEL=marks, FRAME_COUNT=counter(65534, 65535, 3, 4))
    recorded = load_kkt(path)
    np.testing.assert_allclose(recorded.timebase.times_s, FRAME_S * np.array([0, 1, 5, 6]))
    assert any("leaves out 3 frames" in note for note in recorded.notes)
    (span,) = recorded.labels.spans
    np.testing.assert_allclose((span.start_s, span.end_s), FRAME_S * np.array([1, 6]))


@pytest.mark.parametrize("count", [counter(5, 5, 6, 7), counter(5, 6, 4, 7)])
def test_a_counter_that_does_not_count_up_is_not_used(tmp_path: Path, count: np.ndarray) -> None:
    label = np.zeros((4, 1), np.uint16)
    recorded = load_kkt(write_kkt(tmp_path / "a.h5", 4, LABEL=label, FRAME_COUNT=count))
    np.testing.assert_allclose(recorded.timebase.times_s, FRAME_S * np.arange(4))
    assert any("does not count up" in note for note in recorded.notes)


@pytest.mark.parametrize("count", [None, np.zeros(3), np.zeros((FRAMES, 2))])
def test_without_a_counter_frames_are_placed_evenly(tmp_path: Path, count: Any) -> None:
    recorded = load_kkt(write_kkt(tmp_path / "a.h5", FRAME_COUNT=count))
    np.testing.assert_allclose(recorded.timebase.times_s, FRAME_S * np.arange(FRAMES))
    assert len(recorded.notes) == 1


def test_one_frame_is_enough(tmp_path: Path) -> None:
    recorded = load_kkt(write_kkt(tmp_path / "a.h5", 1, LABEL=np.ones((1, 1), np.uint16)))
    assert len(recorded.timebase) == 1
    assert len(recorded.labels.spans) == 1


def spoiled(value: float) -> np.ndarray:
    values = maps(FRAMES)
    values[0, 5, 6, 7] = value
    return values


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"DS1": None}, "has no DS1; it holds DATA_CONFIG, FRAME_COUNT, LABEL"),
        ({"LABEL": None}, "has no LABEL"),
        ({"DS1": maps(FRAMES)[:1]}, r"of shape \(1, 32, 32, 12\)"),
        ({"DS1": maps(FRAMES)[:, :16]}, r"of shape \(2, 16, 32, 12\)"),
        ({"DS1": maps(FRAMES)[0]}, r"of shape \(32, 32, 12\)"),
        ({"DS1": maps(0), "LABEL": np.zeros((0, 1), int)}, r"of shape \(2, 32, 32, 0\)"),
        ({"DS1": maps(FRAMES).astype(np.int16)}, "DS1 of .* is int16"),
        ({"DS1": b"text"}, "DS1 of .* of shape"),
        ({"LABEL": np.zeros((FRAMES + 1, 1), int)}, r"of shape \(13, 1\), DS1 has 12 frames"),
        ({"LABEL": np.zeros((FRAMES, 1))}, "LABEL of .* is float64"),
        ({"LABEL": np.full((FRAMES, 1), 2)}, "is 2 in frame 0"),
        ({"DS1": spoiled(np.nan)}, r"holds nan in frame 7 \(range 5, Doppler bin 6\)"),
        ({"DS1": spoiled(np.inf)}, "holds inf in frame 7"),
        ({"DS1": spoiled(-1.0)}, "holds -1 in frame 7"),
        ({"DS1": h5py.Empty("f2")}, "DS1 of .* is no array"),
    ],
)
def test_what_no_such_recording_holds_is_refused(
    tmp_path: Path, changes: dict[str, Any], words: str
) -> None:
    with pytest.raises(Sd2Error, match=words) as caught:
        load_kkt(write_kkt(tmp_path / "bad.h5", **changes))
    assert "bad.h5" in caught.value.found
    assert caught.value.expected


def test_a_group_in_place_of_the_maps_is_refused(tmp_path: Path) -> None:
    path = write_kkt(tmp_path / "bad.h5", DS1=None)
    with h5py.File(path, "a") as file:
        file.create_group("DS1")
    with pytest.raises(Sd2Error, match=r"DS1 of .* is no array"):
        load_kkt(path)


def test_numbers_in_another_file_are_not_fetched(tmp_path: Path) -> None:
    whole = write_kkt(tmp_path / "whole.h5")
    path = write_kkt(tmp_path / "link.h5", DS1=None)
    with h5py.File(path, "a") as file:
        file["DS1"] = h5py.ExternalLink(str(whole), "DS1")
    with pytest.raises(Sd2Error, match="link to elsewhere"):
        load_kkt(path)
    path = write_kkt(tmp_path / "virtual.h5", DS1=None)
    layout = h5py.VirtualLayout((2, 32, 32, FRAMES), np.float16)
    layout[...] = h5py.VirtualSource(str(whole), "DS1", (2, 32, 32, FRAMES))
    with h5py.File(path, "a") as file:
        file.create_virtual_dataset("DS1", layout)
    with pytest.raises(Sd2Error, match="lies in another file"):
        load_kkt(path)
    raw = tmp_path / "raw.bin"
    raw.write_bytes(maps(FRAMES).tobytes())
    path = write_kkt(tmp_path / "external.h5", DS1=None)
    with h5py.File(path, "a") as file:
        file.create_dataset(
            "DS1", (2, 32, 32, FRAMES), np.float16, external=[(str(raw), 0, raw.stat().st_size)]
        )
    with pytest.raises(Sd2Error, match="lies in another file"):
        load_kkt(path)


def test_a_claim_of_very_many_frames_is_refused_before_they_are_read(tmp_path: Path) -> None:
    path = write_kkt(tmp_path / "huge.h5", DS1=None)
    with h5py.File(path, "a") as file:
        file.create_dataset("DS1", (2, 32, 32, 10**9), np.float16, chunks=(1, 8, 8, 256))
    with pytest.raises(Sd2Error, match=r"DS1 of .*huge\.h5 declares 4\.1 TB"):
        load_kkt(path)


def test_a_file_that_is_cut_off_is_refused_wherever_it_ends(tmp_path: Path) -> None:
    path = write_kkt(tmp_path / "cut.h5")
    whole = path.read_bytes()
    for share in (0.0, 0.001, 0.1, 0.5, 0.99):
        path.write_bytes(whole[: int(share * len(whole))])
        with pytest.raises(Sd2Error, match=r"cut\.h5 (is not an HDF5 file|cannot be read)"):
            load_kkt(path)


def test_what_is_no_hdf5_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "text.h5"
    path.write_text("hello")
    with pytest.raises(Sd2Error, match="cannot be read as HDF5"):
        load_kkt(path)
    with pytest.raises(Sd2Error, match=r"none\.h5 does not exist"):
        load_kkt(tmp_path / "none.h5")
    with pytest.raises(Sd2Error, match="cannot be read as HDF5"):
        load_kkt(tmp_path)


def test_a_map_is_not_taken_for_raw_samples(tmp_path: Path) -> None:
    path = write_kkt(tmp_path / "a.H5")
    assert holds_map(path)
    assert load_recorded_map(path).gesture == "Wave"
    with pytest.raises(Sd2Error, match="no raw samples"):
        load_capture(path)


def test_the_real_recordings_open_with_their_labels(shared_data: Path) -> None:
    # Half-open frames of the labelled gesture, read off the files.
    known = {
        "Stone__ThirdGesture_0001": (16, 56),
        "Stone__ThirdGesture_0014": (12, 41),
        "Swing_Left__SecondGesture_0001": (22, 46),
        "Swing_Left__SecondGesture_0041": (12, 34),
        "Swing_Right__FirstGesture_0001": (24, 62),
        "Swing_Right__FirstGesture_0041": (17, 45),
        "background__Background_0001": None,
        "background__Background_0041": None,
    }
    paths = sorted((shared_data / "radar" / "kkt_gestures").glob("*.h5"))
    assert len(paths) == len(known)
    for path, (start, frames) in zip(paths, sorted(known.items()), strict=True):
        assert path.name.startswith(start)
        recorded = load_kkt(path)
        assert recorded.doppler.values.shape == (31, 70)
        assert recorded.gesture == start.split("_")[-2]
        assert len(recorded.notes) == 1
        found = [
            recorded.timebase.frames_between(s.start_s, s.end_s) for s in recorded.labels.spans
        ]
        assert found == ([] if frames is None else [frames])
        if frames is None:
            # Nothing but what stands still: it is at zero velocity.
            assert recorded.doppler.values.mean(axis=1).argmax() == 15


def test_echoes_above_the_middle_move_to_higher_ranges(shared_data: Path) -> None:
    """What the sign of the velocity rests on, see docs/formats.md."""
    for path in sorted((shared_data / "radar" / "kkt_gestures").glob("Swing*.h5")):
        with h5py.File(path) as file:
            power = np.square(file["DS1"][0].astype(np.float64))
        # The hand: ranges and bins away from what stands still, above the quiet level.
        moving = power - np.quantile(power, 0.25, axis=2, keepdims=True)
        near_zero = np.isin(np.arange(32), (0, *range(13, 20)))
        moving = np.maximum(moving, 0)[:28, ~near_zero]
        at = (moving.sum(axis=1) * np.arange(28)[:, None]).sum(axis=0) / moving.sum(axis=(0, 1))
        bins = np.flatnonzero(~near_zero)[:, None] - 16
        towards = (moving.sum(axis=0) * bins).sum(axis=0) / moving.sum(axis=(0, 1))
        speed = np.gradient(np.convolve(at, np.ones(5) / 5, "same"))
        strong = np.zeros(70, bool)
        strong[np.argsort(moving.sum(axis=(0, 1)))[-28:]] = True
        strong[:3] = strong[-3:] = False
        assert np.corrcoef(speed[strong], towards[strong])[0, 1] > 0.5
