"""Recordings of the A121: real ones, a made-up target, and what does not fit."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sd2core.errors import Sd2Error
from sd2core.fmcw import doppler_map, range_doppler
from sd2core.io.kinds import kind_of
from sd2core.io.radar import holds_map, load_capture
from tests.core.io.radar.acconeer_files import FRAMES, PARTS, POINTS, SWEEPS, write_a121

ENTRY = "sessions/session_0/group_0/entry_0"


@pytest.fixture
def real(shared_data: Path) -> Path:
    folder = shared_data / "radar" / "acconeer_a121"
    if not folder.is_dir():
        pytest.skip(f"no recordings of an A121 at {folder}")
    return folder


def test_a_real_stream_of_water_flows_one_way(real: Path) -> None:
    """128 sweeps at 3 kHz, four points from 1.39 m: a surface at 45 degrees, below 1 m/s."""
    capture = load_capture(real / "surface_velocity_default.h5")
    config = capture.config
    assert (config.chirps_per_frame, config.samples_per_chirp) == (128, 4)
    assert config.v_max_mps == pytest.approx(3000.0 * 299_792_458.0 / 60.5e9 / 4.0)
    assert config.ranges_m[0] == pytest.approx(554 * 0.00250227400101721)
    assert len(capture.timebase) == 44
    assert capture.timebase.duration_s == pytest.approx(44 * 128 / 3000.0, rel=0.01)
    doppler = doppler_map(capture, clutter="mean")
    mean, velocity_mps = doppler.values.mean(axis=1), doppler.axis.centres_mps
    away = mean[(velocity_mps > -1.0) & (velocity_mps < -0.2)].sum()
    nearer = mean[(velocity_mps > 0.2) & (velocity_mps < 1.0)].sum()
    fast = np.abs(velocity_mps) > 1.5
    assert away > 1.8 * nearer
    assert mean[(velocity_mps > -0.7) & (velocity_mps < -0.2)].mean() > 3.0 * mean[fast].mean()


def test_a_real_person_reaches_out_and_back(real: Path) -> None:
    """For a second and a half, echoes move from the first point to the second, and back.

    Frequencies are then positive and negative: the phase grows with the distance.
    """
    capture = load_capture(real / "presence-medium_range_no_timeout.h5")
    assert (capture.config.chirps_per_frame, capture.config.samples_per_chirp) == (16, 11)
    assert any("4 subsweeps" in note for note in capture.notes)
    assert any("No sweep rate is set" in note for note in capture.notes)
    energy = doppler_map(capture, clutter="mean", range_m=(0.25, 0.45)).values
    there = energy.sum(axis=0) / np.median(energy.sum(axis=0))
    assert capture.timebase.times_s[there.argmax()] == pytest.approx(9.0, abs=0.1)
    assert there.max() > 5.0
    assert np.count_nonzero(there > 2.5) < 10

    def mean_mps(frames: slice) -> float:
        cells = energy[:, frames].sum(axis=1)
        return float(cells @ doppler_map(capture).axis.centres_mps / cells.sum())

    def share_of_second(frame: int) -> float:
        cells = range_doppler(capture, frame, clutter="mean").range_profile
        return float(cells[1] / cells[:2].sum())

    assert mean_mps(slice(105, 110)) < -0.2 < 0.2 < mean_mps(slice(113, 116))
    assert share_of_second(106) < 0.3 < 0.6 < share_of_second(109)  # it recedes
    assert share_of_second(113) > 0.6 > 0.4 > share_of_second(114)  # it comes back


@settings(max_examples=20, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(velocity_mps=st.floats(-2.2, 2.2))
def test_a_target_has_its_velocity_at_its_point(tmp_path: Path, velocity_mps: float) -> None:
    capture = load_capture(write_a121(tmp_path / "a.h5", velocity_mps))
    doppler = doppler_map(capture)
    off = np.abs(doppler.peak_velocity_mps() - velocity_mps)
    assert off.max() < 0.51 * capture.config.velocity_resolution_mps + 1e-9
    assert doppler.values.sum(axis=0) == pytest.approx((3000.0 / 32768.0) ** 2, rel=2e-3)
    found = range_doppler(capture, 2)
    assert found.range_m[found.range_profile.argmax()] == pytest.approx(324 * 0.0025)
    assert not doppler_map(capture, range_m=(0.4, 0.8)).values.any()  # without point 3


def test_what_a_recording_says_is_kept(tmp_path: Path) -> None:
    path = write_a121(tmp_path / "a.h5")
    assert kind_of(path) == "radar"
    assert not holds_map(path)
    capture = load_capture(path)
    assert capture.samples.shape == (FRAMES, 1, SWEEPS, POINTS)
    assert capture.config.range_max_m == pytest.approx(348 * 0.0025)
    assert capture.config.range_resolution_m == pytest.approx(0.32)
    np.testing.assert_allclose(capture.timebase.times_s, 0.1 * np.arange(FRAMES))
    with pytest.raises(Sd2Error, match="No distance lies between 3 m and 4 m"):
        doppler_map(capture, range_m=(3.0, 4.0))


def _sensor(path: Path, **changes: Any) -> None:
    with h5py.File(path, "r+") as file:
        place = "sessions/session_0/session_config"
        content = json.loads(file[place][()])
        content["groups"][0]["1"].update(changes)
        del file[place]
        file[place] = json.dumps(content)


def test_frames_without_a_rate_are_placed_by_the_ticks(tmp_path: Path) -> None:
    path = write_a121(tmp_path / "a.h5")
    _sensor(path, frame_rate=None, sweep_rate=None)
    capture = load_capture(path)
    assert any("by the ticks a frame comes every 100.0 ms" in note for note in capture.notes)
    assert capture.config.chirp_repetition_s == pytest.approx(1.0 / 3000.0)
    path = write_a121(tmp_path / "b.h5", **{f"{ENTRY}/result/tick": np.zeros(FRAMES, int)})
    capture = load_capture(path)
    assert any("The ticks do not increase" in note for note in capture.notes)
    np.testing.assert_allclose(capture.timebase.times_s, 0.1 * np.arange(FRAMES))


def test_what_is_left_out_is_said(tmp_path: Path) -> None:
    path = write_a121(tmp_path / "a.h5")
    with h5py.File(path, "r+") as file:
        file.copy(ENTRY, "sessions/session_0/group_0/entry_1")
        file.copy("sessions/session_0", "sessions/session_1")
        del file[f"{ENTRY}/result/data_saturated"]
        file[f"{ENTRY}/result/data_saturated"] = np.arange(FRAMES) < 2
    notes = load_capture(path).notes
    assert "The first of 2 sessions is taken." in notes
    assert "The first of 2 sensors is taken." in notes
    assert f"The sensor was saturated in 2 of {FRAMES} frames." in notes


FAULTS: dict[str, tuple[dict[str, Any], str]] = {
    "another generation": ({"generation": "a111"}, "of the sensor generation 'a111'"),
    "no frames": ({f"{ENTRY}/result/frame": None}, "has no array .*result/frame"),
    "real frames": (
        {f"{ENTRY}/result/frame": np.zeros((2, SWEEPS, POINTS))},
        "result/frame is float64",
    ),
    "no entry": ({f"{ENTRY}/metadata": "{}"}, "base_step_length_m is missing"),
    "another sensor": ({f"{ENTRY}/sensor_id": 3}, "has no sensor 3 in its first group"),
    "few ticks": ({f"{ENTRY}/result/tick": np.arange(2)}, f"has 2 ticks for {FRAMES} frames"),
    "no JSON": ({f"{ENTRY}/metadata": "metres"}, "cannot be read as JSON"),
    "no configuration": (
        {"sessions/session_0/session_config": '{"groups": [{"1": {"sweeps_per_frame": 16}}]}'},
        "subsweeps is missing",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_what_does_not_fit_is_refused_in_a_sentence(tmp_path: Path, fault: str) -> None:
    changes, sentence = FAULTS[fault]
    path = write_a121(tmp_path / "faulty.h5", **changes)
    with pytest.raises(Sd2Error, match=rf"(?s)faulty\.h5.*{sentence}|{sentence}.*faulty\.h5"):
        load_capture(path)


def test_other_sweeps_than_configured_are_refused(tmp_path: Path) -> None:
    path = write_a121(tmp_path / "a.h5")
    _sensor(path, sweeps_per_frame=8)
    with pytest.raises(Sd2Error, match=r"has shape \(6, 16, 5\).*8 sweeps, 5 points"):
        load_capture(path)


def test_a_recording_of_2022_is_read_as_one_of_today(tmp_path: Path) -> None:
    today = load_capture(write_a121(tmp_path / "a.h5"))
    path = write_a121(tmp_path / "b.h5")
    with h5py.File(path, "r+") as file:
        file.move("sessions/session_0", "session")
        del file["sessions"]
    then = load_capture(path)
    np.testing.assert_array_equal(then.read(0, FRAMES), today.read(0, FRAMES))
    assert (then.config, then.notes) == (today.config, today.notes)


@pytest.mark.parametrize("step_s", [0.005, 0.0037])
def test_frames_of_one_sweep_are_joined(step_s: float, tmp_path: Path) -> None:
    """A target that approaches at 0.2 m/s, 70 sweeps, their times in whole milliseconds."""
    times_s, still_m = step_s * np.arange(70), 0.9
    turns = 2.0 * (still_m - 0.2 * times_s) * 60.5e9 / 299_792_458.0
    frame = np.zeros((70, 1, POINTS), PARTS)
    wave = 3000.0 * np.exp(2j * np.pi * turns)
    frame["real"][:, 0, 3], frame["imag"][:, 0, 3] = np.rint(wave.real), np.rint(wave.imag)
    changes = {
        "frame": frame,
        "tick": (1e3 * times_s + 1e-6).astype(int),
        "data_saturated": np.zeros(70, bool),
    }
    changed = {f"{ENTRY}/result/{name}": value for name, value in changes.items()}
    path = write_a121(tmp_path / "a.h5", **changed)
    _sensor(path, sweeps_per_frame=1, sweep_rate=None, frame_rate=None)
    capture = load_capture(path)
    assert capture.samples.shape == (2, 1, 32, POINTS)
    assert capture.config.chirp_repetition_s == pytest.approx(step_s, rel=0.01)
    np.testing.assert_allclose(capture.timebase.times_s, [0.0, 32 * step_s], atol=1e-3)
    assert any("32 are taken as one, their sweeps" in note for note in capture.notes)
    assert any("The last 6 frames" in note for note in capture.notes)
    off = np.abs(doppler_map(capture).peak_velocity_mps() - 0.2)
    assert off.max() < 0.51 * capture.config.velocity_resolution_mps


@pytest.mark.parametrize(
    ("service", "way"), [("sparse", "Real values"), ("iq", "--axes chirp,receiver,sample")]
)
def test_the_older_sensor_is_named_with_what_can_be_done(
    tmp_path: Path, service: str, way: str
) -> None:
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        file["data"] = np.ones((5, 1, 4))
        file["mode"], file["sensor_config_dump"] = service, "{}"
    assert not holds_map(path)
    with pytest.raises(Sd2Error, match=rf"a\.h5 is .* A111.*{service}.*{way}"):
        load_capture(path)


def test_an_hdf5_file_of_no_known_radar_is_called_so(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        file["iq"], file["t"] = np.ones((5, 4)), np.arange(5)
    assert not holds_map(path)
    with pytest.raises(Sd2Error, match=r"does not say what radar.*iq, t.*radar describe") as caught:
        load_capture(path)
    assert "DS1" not in str(caught.value)
