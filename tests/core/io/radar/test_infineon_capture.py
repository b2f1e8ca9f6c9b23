"""Reading and writing Infineon recording folders, whole and damaged."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sd2core.errors import Sd2Error
from sd2core.io.radar import load_capture
from sd2core.io.radar.infineon import write_capture
from sd2core.radar_config import PAPER_RADAR, RadarConfig

CONFIG = replace(PAPER_RADAR, receivers=3, chirps_per_frame=5, samples_per_chirp=9)
FRAMES = 7
START_UNIX_S = 1_653_497_563.25


@pytest.fixture
def cube() -> np.ndarray:
    shape = (FRAMES, CONFIG.receivers, CONFIG.chirps_per_frame, CONFIG.samples_per_chirp)
    return np.random.default_rng(1).integers(0, 4096, shape, dtype=np.uint16)


@pytest.fixture
def folder(tmp_path: Path, cube: np.ndarray) -> Path:
    times_s = np.arange(FRAMES) * CONFIG.frame_repetition_s
    return write_capture(
        tmp_path / "recording" / "RadarIfxAvian_00",
        cube,
        CONFIG,
        times_s,
        simulated=True,
        start_unix_s=START_UNIX_S,
        meta={"truth": {"velocity_mps": 1.3}},
    )


def edit_config(folder: Path, edit: Callable[[dict], object]) -> None:
    path = folder / "config.json"
    content = json.loads(path.read_text())
    edit(content["device_config"]["fmcw_single_shape"])
    path.write_text(json.dumps(content))


def write_times(folder: Path, times_s: np.ndarray) -> None:
    lines = [f"{time!r}\n" for time in (START_UNIX_S + times_s).tolist()]
    (folder / "radar_timestamp.csv").write_text("".join(lines))


@pytest.mark.parametrize("given", ["", "RadarIfxAvian_00", "RadarIfxAvian_00/radar.npy"])
def test_what_is_written_is_read_back_from_any_of_its_paths(
    folder: Path, cube: np.ndarray, given: str
) -> None:
    capture = load_capture(folder.parent / given)
    assert capture.config == CONFIG
    assert capture.config.name == CONFIG.name
    np.testing.assert_array_equal(capture.samples[:], cube)
    np.testing.assert_allclose(
        capture.timebase.times_s, np.arange(FRAMES) / 30.0, atol=5e-7, rtol=0
    )
    assert capture.start_unix_s == START_UNIX_S
    assert capture.simulated
    assert capture.meta["truth"] == {"velocity_mps": 1.3}
    assert capture.notes == ()


def test_samples_are_read_relative_to_full_scale(folder: Path, cube: np.ndarray) -> None:
    values = load_capture(folder).read(2, 4)
    np.testing.assert_array_equal(values, (cube[2:4].astype(np.float32) - 2048) / 2048)


def test_a_cube_that_is_cut_off_while_it_is_open_is_refused(folder: Path, cube: np.ndarray) -> None:
    capture = load_capture(folder)
    os.truncate(folder / "radar.npy", 300)
    with pytest.raises(Sd2Error, match=r"radar\.npy has become shorter"):
        capture.read(FRAMES - 1, FRAMES)


def test_real_capture(shared_data: Path) -> None:
    capture = load_capture(shared_data / "radar" / "infineon_people")
    assert capture.samples.shape == (31, 1, 64, 128)
    assert not capture.simulated
    assert capture.config.adc_bits == 12
    assert capture.config.v_max_mps == pytest.approx(3.138, abs=1e-3)
    assert capture.config.range_resolution_m == pytest.approx(0.1499, abs=1e-4)
    assert capture.start_unix_s == 1653497563.346703
    assert capture.timebase.times_s[-1] == pytest.approx(2.9997, abs=1e-4)
    assert len(capture.notes) == 1
    assert "jitter by up to 22 ms around 100 ms" in capture.notes[0]


def test_a_simulated_recording_has_no_date(tmp_path: Path, cube: np.ndarray) -> None:
    times_s = np.arange(FRAMES) * CONFIG.frame_repetition_s
    path = write_capture(tmp_path / "new", cube, CONFIG, times_s, simulated=True)
    capture = load_capture(path)
    assert capture.start_unix_s is None
    np.testing.assert_array_equal(capture.timebase.times_s, times_s)


def test_transmitters_in_turns_come_back_as_they_were_written(tmp_path: Path) -> None:
    config = replace(CONFIG, transmitters=2, receivers=3, chirps_per_frame=7)
    shape = (FRAMES, 6, 7, config.samples_per_chirp)
    cube = np.random.default_rng(1).integers(0, 4096, shape).astype(np.uint16)
    times_s = np.arange(FRAMES) * config.frame_repetition_s
    capture = load_capture(write_capture(tmp_path / "new", cube, config, times_s, simulated=True))
    assert capture.config == config
    np.testing.assert_array_equal(capture.samples[:], cube)


def test_an_older_recording_is_replaced_and_anything_else_is_not(
    folder: Path, cube: np.ndarray, tmp_path: Path
) -> None:
    times_s = np.arange(2) * CONFIG.frame_repetition_s
    write_capture(folder, cube[:2], CONFIG, times_s, simulated=False)
    capture = load_capture(folder)
    assert capture.frame_count == 2
    assert not capture.simulated
    precious = tmp_path / "thesis"
    precious.mkdir()
    (precious / "chapter.txt").write_text("years of work")
    with pytest.raises(Sd2Error, match="thesis exists and is not a radar recording"):
        write_capture(precious, cube, CONFIG, np.arange(FRAMES), simulated=True)
    assert (precious / "chapter.txt").read_text() == "years of work"
    assert sorted(entry.name for entry in folder.parent.iterdir()) == ["RadarIfxAvian_00"]


def test_nothing_is_left_when_writing_fails(
    tmp_path: Path, cube: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*args: object, **kwargs: object) -> None:
        raise OSError("No space left on device")

    monkeypatch.setattr(np, "save", full)
    with pytest.raises(OSError, match="No space"):
        write_capture(tmp_path / "new", cube, CONFIG, np.arange(FRAMES), simulated=True)
    assert list(tmp_path.iterdir()) == []


# Damaged recordings: (what is done to the folder, what the sentence must say).


def _cut_samples(folder: Path) -> None:
    path = folder / "radar.npy"
    path.write_bytes(path.read_bytes()[:-100])


def _cut_header(folder: Path) -> None:
    (folder / "radar.npy").write_bytes((folder / "radar.npy").read_bytes()[:20])


def _open_header(folder: Path) -> None:
    path = folder / "radar.npy"
    path.write_bytes(path.read_bytes().replace(b"}", b"{", 1))


def _floats(folder: Path) -> None:
    np.save(folder / "radar.npy", np.load(folder / "radar.npy").astype(np.float32))


def _one_frame_only(folder: Path) -> None:
    np.save(folder / "radar.npy", np.load(folder / "radar.npy")[0])


def _no_frames(folder: Path) -> None:
    np.save(folder / "radar.npy", np.load(folder / "radar.npy")[:0])


def _pickled(folder: Path) -> None:
    np.save(folder / "radar.npy", np.array([{"a": 1}], dtype=object), allow_pickle=True)


def _endless_header(folder: Path) -> None:
    path = folder / "radar.npy"
    path.write_bytes(path.read_bytes().replace(b"}", b" ", 1))


def _endless_shape(folder: Path) -> None:
    path = folder / "radar.npy"
    content = path.read_bytes()
    assert b", 9)" in content
    path.write_bytes(content.replace(b", 9)", b", %d)" % 10**30, 1))


def _a_pipe(folder: Path) -> None:
    (folder / "radar.npy").unlink()
    os.mkfifo(folder / "radar.npy")


DAMAGE: dict[str, tuple[Callable[[Path], object], str]] = {
    "cut samples": (_cut_samples, r"radar\.npy \(\d+ bytes\) cannot be read.*copy it again"),
    "cut header": (_cut_header, r"radar\.npy \(20 bytes\) cannot be read"),
    "endless header": (_endless_header, r"radar\.npy \(\d+ bytes\) cannot be read"),
    "endless shape": (_endless_shape, r"radar\.npy \(\d+ bytes\) cannot be read"),
    "a pipe": (_a_pipe, r"radar\.npy is a named pipe"),
    "wrong dtype": (_floats, r"radar\.npy holds float32\. Expected: uint16"),
    "three axes": (_one_frame_only, r"shape \(3, 5, 9\)\. Expected: \(frames, 3 receivers, 5"),
    "no frames": (_no_frames, r"shape \(0, 3, 5, 9\).*at least one frame"),
    "pickled objects": (_pickled, r"radar\.npy \(\d+ bytes\) cannot be read"),
    "open header": (_open_header, r"radar\.npy \(\d+ bytes\) cannot be read as an array"),
    "no samples": (lambda f: (f / "radar.npy").unlink(), r"radar\.npy is missing"),
    "no configuration": (lambda f: (f / "config.json").unlink(), r"config\.json is missing"),
    "not JSON": (
        lambda f: (f / "config.json").write_text("{"),
        r"config\.json cannot be read as JSON",
    ),
    "other device": (
        lambda f: (f / "config.json").write_text('{"device_config": {"other": 1}}'),
        r"config\.json: device_config\.fmcw_single_shape is missing",
    ),
    "missing key": (
        lambda f: edit_config(f, lambda shape: shape.pop("sample_rate_Hz")),
        r"config\.json: device_config\.fmcw_single_shape\.sample_rate_Hz is missing",
    ),
    "text for a number": (
        lambda f: edit_config(f, lambda shape: shape.update(sample_rate_Hz="fast")),
        r"sample_rate_Hz is 'fast'",
    ),
    "negative": (
        lambda f: edit_config(f, lambda shape: shape.update(chirp_repetition_time_s=-1)),
        r"chirp_repetition_time_s is -1 .*greater than 0",
    ),
    "endless sweep": (
        lambda f: edit_config(f, lambda shape: shape.update(end_frequency_Hz=np.inf)),
        r"config\.json: The radar's end_frequency_hz is inf",
    ),
    "gigahertz for hertz": (
        lambda f: edit_config(f, lambda s: s.update(start_frequency_Hz=60, end_frequency_Hz=61)),
        r"config\.json: The radar sweeps from 60 Hz to 61 Hz.*60 GHz is 60e9",
    ),
    "unknown turns": (
        lambda f: edit_config(f, lambda s: s.update(mimo_mode="bpm", tx_antennas=[1, 2])),
        r"config\.json: mimo_mode is 'bpm' with 2 transmitters",
    ),
    "turns without end": (
        lambda f: edit_config(f, lambda s: s.update(mimo_mode="tdm", tx_antennas=[1, 2])),
        r"config\.json: 5 chirps per frame of 2 transmitters in turns\. Expected: a multiple of 2",
    ),
    "counts beyond the converter": (
        lambda f: (f / "meta.json").write_text('{"adc_resolution": 8}'),
        r"radar\.npy holds a count of 40\d\d, but the converter is said to have 8 bits\."
        r" Expected: counts from 0 to 255",
    ),
    "sweep backwards": (
        lambda f: edit_config(f, lambda shape: shape.update(end_frequency_Hz=1e9)),
        r"config\.json: The chirp ends at 1e\+09 Hz",
    ),
    "other chirps": (
        lambda f: edit_config(f, lambda shape: shape.update(num_chirps_per_frame=4)),
        r"radar\.npy has shape \(7, 3, 5, 9\)\. Expected: \(frames, 3 receivers, 4 chirps",
    ),
    "other receivers": (
        lambda f: edit_config(f, lambda shape: shape.update(rx_antennas=[1])),
        r"radar\.npy has shape \(7, 3, 5, 9\)\. Expected: \(frames, 1 receivers",
    ),
    "meta of the wrong kind": (
        lambda f: (f / "meta.json").write_text('{"adc_resolution": "many"}'),
        r"meta\.json: adc_resolution is 'many'",
    ),
    "times with their numbers": (
        lambda f: (f / "radar_timestamp.csv").write_text("0,1.5\n1,1.6\n"),
        r"radar_timestamp\.csv, line 1: '0,1\.5' is not a time",
    ),
    "text among the times": (
        lambda f: (f / "radar_timestamp.csv").write_text("1.5\nnoon\n"),
        r"radar_timestamp\.csv, line 2: 'noon' is not a time",
    ),
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_damage_is_explained(folder: Path, damage: str) -> None:
    harm, sentence = DAMAGE[damage]
    harm(folder)
    with pytest.raises(Sd2Error, match=f"(?s){sentence}") as caught:
        load_capture(folder)
    assert str(folder) in str(caught.value)
    assert caught.value.expected


NOMINAL_S = CONFIG.frame_repetition_s
STEADY_S = np.arange(FRAMES) * NOMINAL_S
BURST_S = STEADY_S - np.array([0, 0, 0, 0.9, 0, 0, 0]) * NOMINAL_S
GAP_S = STEADY_S + np.array([0, 0, 0, 2, 2, 2, 2]) * NOMINAL_S
JITTER_S = STEADY_S + np.array([0, 0.2, 0, 0, 0.2, 0, 0]) * NOMINAL_S

# (times in the file, is the file's clock used?, what the note must say)
TIMES: dict[str, tuple[np.ndarray, bool, str]] = {
    "fewer": (STEADY_S[:5], False, "has 5 times for 7 frames, fewer than it should"),
    "more": (np.arange(9) * NOMINAL_S, False, "has 9 times for 7 frames, more"),
    "standing": (np.minimum(STEADY_S, STEADY_S[4]), False, "does not increase from frame 4 to 5"),
    "not a number": (STEADY_S + np.array([0, 0, 0, np.nan, 0, 0, 0]), False, "frame 2 to 3"),
    "endless": (np.append(STEADY_S[:-1], np.inf), False, "frame 5 to 6"),
    "beyond time": (np.append(STEADY_S[:-1], 1e308), False, "frame 5 to 6"),
    "burst": (BURST_S, False, "buffered before they got their time"),
    "gap": (GAP_S, True, "has 1 gap of up to 0.100 s"),
    "jitter": (JITTER_S, True, "jitter by up to 7 ms around 33 ms"),
    "slower": (1.1 * STEADY_S, True, "came every 36.7 ms; config.json says 33.3 ms"),
}


@pytest.mark.parametrize("case", TIMES)
def test_odd_times_are_noted(folder: Path, case: str) -> None:
    times_s, used, note = TIMES[case]
    write_times(folder, times_s)
    capture = load_capture(folder)
    assert len(capture.notes) == 1
    assert note in capture.notes[0]
    expected_s = times_s if used else STEADY_S
    np.testing.assert_allclose(capture.timebase.times_s, expected_s, atol=1e-6)
    assert capture.start_unix_s == START_UNIX_S


def test_one_frame_needs_no_time(tmp_path: Path, cube: np.ndarray) -> None:
    folder = write_capture(tmp_path / "one", cube[:1], CONFIG, [0.0], simulated=True)
    write_times(folder, np.array([np.nan]))
    capture = load_capture(folder)
    assert capture.timebase.times_s.tolist() == [0.0]
    assert capture.start_unix_s is None


@pytest.mark.parametrize("first_ms", [0.0, 1e3 * START_UNIX_S])
def test_times_in_milliseconds_are_suspected(folder: Path, first_ms: float) -> None:
    lines = [f"{time!r}\n" for time in (first_ms + 1e3 * STEADY_S).tolist()]
    (folder / "radar_timestamp.csv").write_text("".join(lines))
    capture = load_capture(folder)
    assert len(capture.notes) == 1
    assert "has steps of 33.3" in capture.notes[0]
    assert "looks like milliseconds" in capture.notes[0]
    np.testing.assert_allclose(capture.timebase.times_s, STEADY_S)
    assert capture.start_unix_s is None


def test_counts_beyond_the_converter_are_refused_in_later_frames_too(
    folder: Path, cube: np.ndarray
) -> None:
    cube[5, 0, 0, 0] = 5000
    np.save(folder / "radar.npy", cube)
    capture = load_capture(folder)
    with pytest.raises(Sd2Error, match=r"radar\.npy holds a count of 5000.*12 bits.*13 or more"):
        capture.read(4, 7)


def test_missing_times_are_noted(folder: Path) -> None:
    (folder / "radar_timestamp.csv").unlink()
    capture = load_capture(folder)
    np.testing.assert_allclose(capture.timebase.times_s, STEADY_S)
    assert capture.start_unix_s is None
    assert "radar_timestamp.csv is missing" in capture.notes[0]


def test_a_heading_above_the_times_is_allowed(folder: Path) -> None:
    path = folder / "radar_timestamp.csv"
    path.write_text("timestamp\n" + path.read_text())
    assert load_capture(folder).notes == ()


def test_resolution_of_the_converter_is_assumed_when_not_stated(folder: Path) -> None:
    (folder / "meta.json").unlink()
    capture = load_capture(folder)
    assert capture.config.adc_bits == 12
    assert not capture.simulated


def test_unsupported_paths_name_what_is_supported(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(Sd2Error, match=r"does not exist\. Expected: an Infineon recording"):
        load_capture(tmp_path / "absent")
    (tmp_path / "photos").mkdir()
    (tmp_path / "photos" / "cat.jpg").touch()
    with pytest.raises(Sd2Error, match=r"it holds cat\.jpg\. Expected: an Infineon recording"):
        load_capture(tmp_path / "photos")
    with pytest.raises(Sd2Error, match=r"cat\.jpg is not a radar recording"):
        load_capture(tmp_path / "photos" / "cat.jpg")
    (folder.parent / "RadarIfxAvian_01").mkdir()
    (folder.parent / "RadarIfxAvian_01" / "radar.npy").touch()
    with pytest.raises(Sd2Error, match=r"2 radar recordings \(RadarIfxAvian_00, RadarIfxAvian_01"):
        load_capture(folder.parent)


def test_a_cube_that_contradicts_its_configuration_is_not_written(
    tmp_path: Path, cube: np.ndarray
) -> None:
    other: RadarConfig = replace(CONFIG, receivers=1)
    with pytest.raises(Sd2Error, match="has shape"):
        write_capture(tmp_path / "new", cube, other, np.arange(FRAMES), simulated=True)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("layout", ["chirps in turn", "chirps of each", "channels"])
def test_transmitters_in_turns_are_told_apart_by_the_shape(tmp_path: Path, layout: str) -> None:
    """Counts say their transmitter, receiver and chirp, so that every sample has one place."""
    turns, receivers, chirps, samples, frames = 2, 3, 6, 9, 4
    stated = chirps if layout == "chirps in turn" else chirps * turns
    each = stated // turns if layout == "chirps in turn" else stated
    turn, receiver, chirp, sample = np.ogrid[:turns, :receivers, :each, :samples]
    named = 1000 * turn + 300 * receiver + 10 * chirp + sample  # (tx, rx, chirps, samples)
    if layout == "channels":
        cube = named.reshape(turns * receivers, each, samples)
    else:
        cube = named.transpose(1, 2, 0, 3).reshape(receivers, each * turns, samples)
    plain = replace(
        PAPER_RADAR,
        receivers=len(cube),
        chirps_per_frame=cube.shape[1],
        samples_per_chirp=samples,
        chirp_repetition_s=2e-4,
    )
    folder = write_capture(
        tmp_path / "made",
        np.repeat(cube[None], frames, axis=0).astype(np.uint16),
        plain,
        np.arange(frames) / 30.0,
        simulated=True,
    )
    edit_config(
        folder,
        lambda shape: shape.update(
            mimo_mode="tdm",
            tx_antennas=[1, 2],
            rx_antennas=[1, 2, 3],
            num_chirps_per_frame=stated,
        ),
    )
    capture = load_capture(folder)
    assert (capture.config.transmitters, capture.config.receivers) == (turns, receivers)
    assert capture.config.chirps_per_frame == each
    assert capture.config.v_max_mps == pytest.approx(plain.v_max_mps / turns)
    assert "divides v_max by 2" in capture.notes[0]
    found = capture.channel(receiver=3, transmitter=2).read(1, 3) * 2048.0 + 2048.0
    np.testing.assert_array_equal(found, np.stack([named[1, 2]] * 2)[:, None])


def test_transmitters_that_send_together_are_one(folder: Path, cube: np.ndarray) -> None:
    edit_config(folder, lambda shape: shape.update(tx_antennas=[1, 2]))
    capture = load_capture(folder)
    assert capture.config == CONFIG
    np.testing.assert_array_equal(capture.samples[:], cube)
