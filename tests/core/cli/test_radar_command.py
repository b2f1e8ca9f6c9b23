"""``sd2 radar`` on files of any radar: limits, channels, descriptions, recordings of them."""

from __future__ import annotations

import io
import json
from pathlib import Path

import numpy as np
import pytest
from cli_outcome import Sd2
from scipy.io import savemat

from sd2core.io.radar import load_capture
from sd2core.io.radar.described import read_description
from sd2core.io.radar.points import points_description
from sd2core.maps import DopplerMap
from sd2core.recording.recording import Recording, open_recording
from sd2core.sensor import VelocityAxis
from tests.core.io.radar.acconeer_files import write_a121
from tests.core.io.radar.dca1000_files import TiRecording, write_ti
from tests.core.io.radar.point_files import walk, write_csv

TI = TiRecording(transmitters=2, loops=32)
DESCRIBED = (
    "--carrier-hz=24e9",
    "--bandwidth-hz=2e8",
    "--sample-rate-hz=1e6",
    "--chirp-repetition-s=5e-4",
    "--frame-repetition-s=0.05",
)


def test_limits_and_assumptions_are_printed(sd2: Sd2, tmp_path: Path) -> None:
    path = write_ti(tmp_path, TI)
    outcome = sd2("radar", path)
    assert outcome.code == 0
    # c / f over 60.54 GHz, in turns of 100 us; 32 of these in a frame.
    for words in (
        "4.952 mm, at 60.54 GHz",
        "up to v_max ±12.380 m/s, in steps Δv of 0.774 m/s",
        "up to R_max 9.99 m, in steps ΔR of 0.312 m",
        "transmitters: 2",
        "note: 2 transmitters take turns",
    ):
        assert words in outcome.out, outcome.out
    told = json.loads(sd2("radar", path, "--json").out)
    assert told["transmitters"] == 2
    assert told["v_max_mps"] == pytest.approx(12.38, abs=0.001)
    same = json.loads(sd2("info", path, "--json").out)
    assert {key: same[key] for key in same} == told


def test_one_channel_is_chosen(sd2: Sd2, tmp_path: Path) -> None:
    path, out = write_ti(tmp_path / "ti", TI), tmp_path / "map.npz"
    assert sd2("radar", path, "--out", out, "--receiver", 2, "--transmitter", 1).code == 0
    one = DopplerMap.load(out)
    assert one.meta["radar"]["receivers"] == 1
    assert "transmitters" not in one.meta["radar"]
    assert {"Receiver 2 only.", "Transmitter 1 only."} <= set(one.meta["notes"])
    outcome = sd2("info", out)
    assert "60.54 GHz" in outcome.out
    outcome = sd2("radar", path, "--out", out, "--receiver", 3, "--overwrite")
    assert outcome.code == 1
    assert "Receiver 3" in outcome.err
    assert "1 to 2" in outcome.err
    outcome = sd2("radar", path, "--bins", 8)
    assert outcome.code == 1
    assert "--bins is given without --out" in outcome.err


def test_a_recording_keeps_the_channel_that_is_chosen(
    sd2: Sd2, tmp_path: Path, plate: Path
) -> None:
    path, out = write_ti(tmp_path / "ti", TI), tmp_path / "map.npz"
    folder = tmp_path / "a.sd2"
    outcome = sd2("import", "--out", folder, "--radar", path, "--receiver", 2)
    assert outcome.code == 0, outcome.err
    assert "radar channel  receiver 2" in outcome.out
    told = json.loads(sd2("info", folder, "--json").out)
    assert (told["radar_receiver"], told["radar_transmitter"]) == (2, None)
    assert told["radar"]["receivers"] == 1
    # Options replace the choice, each its own.
    for options, notes in (
        ((), {"Receiver 2 only."}),
        (("--receiver", 1), {"Receiver 1 only."}),
        (("--transmitter", 2), {"Receiver 2 only.", "Transmitter 2 only."}),
    ):
        assert sd2("radar", folder, "--out", out, "--overwrite", *options).code == 0
        only = {note for note in DopplerMap.load(out).meta["notes"] if note.endswith(" only.")}
        assert only == notes
        printed = json.loads(sd2("radar", folder, *options, "--json").out)["notes"]
        assert {note for note in printed if note.endswith(" only.")} == notes
    for files, receiver in ((("--radar", path), 3), (("--mesh", plate), 1)):
        outcome = sd2("import", "--out", tmp_path / "b.sd2", *files, "--receiver", receiver)
        assert outcome.code == 1
        assert "eceiver" in outcome.err
        assert not (tmp_path / "b.sd2").exists()


def test_every_kind_is_described_by_its_own_file(sd2: Sd2, tmp_path: Path) -> None:
    outcome = sd2("radar", write_a121(tmp_path / "a.h5"))
    assert "Acconeer A121, 60.5 GHz" in outcome.out
    assert "phase grows" in outcome.out
    assert sd2("radar", tmp_path / "a.h5", "--out", tmp_path / "map.npz").code == 0


def test_a_description_is_written_from_options(sd2: Sd2, tmp_path: Path) -> None:
    path = tmp_path / "walk.npy"
    np.save(path, np.random.default_rng(1).standard_normal((4, 2, 16, 20)).astype(np.float32))
    outcome = sd2("radar", "describe", path, *DESCRIBED, "--name", "My radar", "--sign", 1)
    assert outcome.code == 0, outcome.err
    assert "My radar" in outcome.out
    assert str(tmp_path / "walk.toml") in outcome.out
    description = read_description(tmp_path / "walk.toml")
    assert description.axes == ("frame", "receiver", "chirp", "sample")
    assert load_capture(path).config.receivers == 2
    # Described again it is replaced, but not by what does not fit.
    with path.with_suffix(".toml").open("a") as stream:
        stream.write("simulated = true\n")  # which no option says
    assert sd2("radar", "describe", path, *DESCRIBED, "--name", "Yours").code == 0
    again = read_description(path.with_suffix(".toml"))
    assert (again.name, again.simulated) == ("Yours", True)
    outcome = sd2("radar", "describe", path, *DESCRIBED, "--axes", "frame,chirp,sample")
    assert outcome.code == 1
    assert "array of shape (4, 2, 16, 20)" in outcome.err
    assert read_description(tmp_path / "walk.toml").name == "Yours"


def test_what_is_missing_is_asked_for_on_a_terminal_only(
    sd2: Sd2, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "walk.npy"
    np.save(path, np.eye(16, 20, dtype=np.complex64)[None].repeat(4, 0))
    monkeypatch.setattr("sys.stdin", io.StringIO(""))
    outcome = sd2("radar", "describe", path)
    assert outcome.code == 1
    assert "--carrier-hz is missing" in outcome.err
    assert not (tmp_path / "walk.toml").exists()
    answers = io.StringIO("sixty\n60e9\n1e9\n5e-4\n0.05\n2e6\n")
    monkeypatch.setattr(answers, "isatty", lambda: True)
    monkeypatch.setattr("sys.stdin", answers)
    outcome = sd2("radar", "describe", path)
    assert outcome.code == 0, outcome.err
    assert "'sixty' is not a number" in outcome.err
    found = read_description(tmp_path / "walk.toml")
    assert (found.carrier_hz, found.bandwidth_hz, found.sample_rate_hz) == (60e9, 1e9, 2e6)
    assert (found.chirp_repetition_s, found.frame_repetition_s) == (5e-4, 0.05)


def test_entries_of_a_description_are_for_describing(sd2: Sd2, tmp_path: Path) -> None:
    path = write_ti(tmp_path, TI)
    outcome = sd2("radar", path, "--carrier-hz", "24e9")
    assert outcome.code == 1
    assert "--carrier-hz is given" in outcome.err
    np.save(tmp_path / "own.npy", np.zeros((2, 8, 8), np.float32))
    outcome = sd2("radar", "describe", tmp_path / "own.npy", *DESCRIBED, "--receiver", 1)
    assert outcome.code == 1
    assert "--receiver is given to describe a file" in outcome.err
    outcome = sd2("radar", path, path)
    assert outcome.code == 1
    assert "Two files are given" in outcome.err
    outcome = sd2("radar", "describe", path)
    assert outcome.code == 1
    assert "cannot be described" in outcome.err


@pytest.mark.parametrize("kind", ["ti", "a121", "own"])
def test_recordings_take_every_kind_and_copy_what_belongs_to_it(
    sd2: Sd2, tmp_path: Path, kind: str
) -> None:
    if kind == "ti":
        path = write_ti(tmp_path / "here", TI, parts=2)
    elif kind == "a121":
        path = write_a121(tmp_path / "a.h5")
    else:
        path = tmp_path / "walk.npy"
        np.save(path, np.eye(16, 20, dtype=np.float32)[None].repeat(4, 0))
        assert sd2("radar", "describe", path, *DESCRIBED).code == 0
    folder = tmp_path / "made.sd2"
    outcome = sd2("import", "--out", folder, "--radar", path, "--copy")
    assert outcome.code == 0, outcome.err
    recording = open_recording(folder)
    assert not recording.holds_radar_map
    assert recording.radar is not None
    assert recording.radar.is_relative_to(folder)
    original, copy = load_capture(path), recording.load_capture()
    assert copy.config == original.config
    np.testing.assert_array_equal(copy.read(0, 3), original.read(0, 3))
    out = tmp_path / "map.npz"
    assert sd2("radar", folder, "--out", out).code == 0
    assert DopplerMap.load(out).kind == "real"
    assert sd2("radar", folder).code == 0


def test_a_recording_without_radar_has_no_limits(sd2: Sd2, tmp_path: Path, plate: Path) -> None:
    made = Recording.create(tmp_path / "made.sd2", mesh=plate)
    outcome = sd2("radar", made.folder)
    assert outcome.code == 1
    assert "Traceback" not in outcome.err


@pytest.mark.parametrize("name", ["iwr6843", "wifi-5ghz"])
def test_a_radar_is_simulated_by_its_name(sd2: Sd2, tmp_path: Path, plate: Path, name: str) -> None:
    folder = tmp_path / "made"
    outcome = sd2("simulate", "radar", plate, "--out", folder, "--radar", name)
    assert outcome.code == 0, outcome.err
    assert "unverified" in outcome.out
    assert sd2("radar", folder, "--out", tmp_path / "map.npz").code == 0
    doppler = DopplerMap.load(tmp_path / "map.npz")
    assert doppler.kind == "simulated"
    direct = tmp_path / "direct.npz"
    assert sd2("synth", plate, "--method", "fmcw", "--radar", name, "--out", direct).code == 0
    assert DopplerMap.load(direct).carrier_hz == doppler.carrier_hz
    outcome = sd2("radar", folder, "--out", tmp_path / "near.npz", "--range", "0.5,4")
    if name == "wifi-5ghz":
        assert outcome.code == 1
        assert "tells no ranges apart" in outcome.err
        assert "none: a continuous wave" in sd2("radar", folder).out
    else:
        assert outcome.code == 0


def test_a_radar_that_is_none_is_named(sd2: Sd2, tmp_path: Path, plate: Path) -> None:
    outcome = sd2("simulate", "radar", plate, "--out", tmp_path / "made", "--radar", "sonar")
    assert outcome.code == 1
    assert "There is no radar 'sonar'" in outcome.err


ADC = (
    *("--dataset", "adc", "--axes", "sample,chirp", "--carrier-hz", 60e9, "--bandwidth-hz", 1e9),
    *("--chirp-repetition-s", 1e-3),
)


def test_a_table_of_points_is_a_map_on_the_axis_asked_for(sd2: Sd2, tmp_path: Path) -> None:
    path, out = write_csv(tmp_path / "points.csv", walk()), tmp_path / "map.npz"
    assert sd2("radar", path, "--out", out, "--v-max", 4, "--bins", 16).code == 0
    assert DopplerMap.load(out).axis == VelocityAxis(16, 4.0)
    table = walk()
    # Nobody was detected in every fifth frame.
    sparse = write_csv(tmp_path / "sparse.csv", table[table[:, 0] % 5 > 0])
    for command in (("radar", sparse, "--out", out, "--overwrite"), ("info", out)):
        assert "nothing but zeros" not in sd2(*command).out
    outcome = sd2("radar", path, "--out", out, "--overwrite", "--clutter", "mean")
    assert outcome.code == 1
    assert "--clutter is given" in outcome.err
    folder = tmp_path / "a.sd2"
    assert sd2("import", "--radar", path, "--out", folder, "--copy").code == 0
    path.unlink()
    assert "200 frames" in sd2("info", folder).out


def test_what_a_table_of_points_lacks_is_described(sd2: Sd2, tmp_path: Path) -> None:
    table = walk()
    path = write_csv(tmp_path / "points.csv", table[:, :5], ("n", "a", "b", "c", "d"))
    for command in (("radar",), ("radar", "describe")):
        outcome = sd2(*command, path)
        assert outcome.code == 1
        assert "points.csv holds n, a, b, c, d" in outcome.err
        assert "--columns" in outcome.err
    columns = ("--columns", "frame,x,y,z,doppler")
    outcome = sd2("radar", "describe", path, *columns, "--frame-repetition-s", 0.05)
    assert outcome.code == 0, outcome.err
    assert "20.00 frames/s" in outcome.out
    assert "20.00 frames/s" in sd2("radar", path).out
    outcome = sd2("radar", "describe", path, *columns, "--carrier-hz", 60e9)
    assert outcome.code == 1
    assert "--carrier-hz is given for a table of points" in outcome.err


def test_what_is_said_of_points_later_adds_to_what_was_said(sd2: Sd2, tmp_path: Path) -> None:
    path = write_csv(tmp_path / "points.csv", walk()[:, :5], ("n", "a", "b", "c", "d"))
    assert sd2("radar", "describe", path, "--columns", "frame,x,y,z,doppler").code == 0
    for more in (("--frame-repetition-s", 0.05), ("--sign", -1)):
        assert sd2("radar", "describe", path, *more).code == 0
    found = points_description(path)
    assert found is not None
    assert (found.columns, found.frame_repetition_s, found.sign) == (
        ("frame", "x", "y", "z", "doppler"),
        0.05,
        -1,
    )


@pytest.mark.parametrize("name", ["points.csv", "points.tsv", "points.npy"])
def test_columns_that_nothing_names_are_asked_for(
    sd2: Sd2, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    path, table = tmp_path / name, walk()
    table[:, 4] += np.random.default_rng(1).normal(0.0, 0.01, len(table))  # no steps tell it
    if path.suffix == ".npy":
        np.save(path, table)
    else:  # by spaces, as NumPy writes tables
        np.savetxt(path, table)
    monkeypatch.setattr("sys.stdin", io.StringIO(""))
    for command in (("info",), ("radar",), ("radar", "describe")):
        outcome = sd2(*command, path)
        assert outcome.code == 1
        assert "--columns frame,x,y,z,doppler,intensity" in outcome.err
    answers = io.StringIO("frame,x,y,z,doppler,intensity\n")
    monkeypatch.setattr(answers, "isatty", lambda: True)
    monkeypatch.setattr("sys.stdin", answers)
    assert sd2("radar", "describe", path).code == 0
    assert "200 frames" in sd2("info", path).out


@pytest.mark.parametrize(
    ("given", "asked"),
    [
        ((), "--dataset is missing"),
        (("--dataset", "adc"), r"--axes is missing"),
        (("--dataset", "adc", "--axes", "sample,chirp"), "--carrier-hz is missing"),
        ((*ADC, "--range-start-m", 1), "--chirps-per-frame is missing"),
        ((*ADC, "--range-start-m", 1, "--chirps-per-frame", 8), "--range-step-m is missing"),
    ],
)
def test_every_fact_that_is_missing_is_asked_for_by_its_option(
    sd2: Sd2, tmp_path: Path, given: tuple[object, ...], asked: str
) -> None:
    path = tmp_path / "walk.mat"
    savemat(path, {"adc": np.ones((20, 64)) + 1j, "other": np.ones((3, 3))})
    outcome = sd2("radar", "describe", path, *given)
    assert outcome.code == 1
    assert asked in outcome.err
