"""A radar file that holds a map and labels, on the command line."""

from __future__ import annotations

import json
from pathlib import Path

import h5py
import numpy as np
import pytest
from cli_outcome import Sd2

from sd2core.io.kinds import kind_of
from sd2core.io.radar.kkt import FRAME_S, load_kkt
from sd2core.maps import DopplerMap


@pytest.fixture
def swing(tmp_path: Path) -> Path:
    """Ten frames, an echo that recedes, frames 2 to 5 labelled."""
    path = tmp_path / "swing.h5"
    values = np.zeros((2, 32, 32, 10), np.float16)
    values[0, 3, 20] = 2.0
    with h5py.File(path, "w") as file:
        file["DS1"] = values
        file["LABEL"] = np.isin(np.arange(10), (2, 3, 4)).astype(np.uint16)[:, None]
        file.create_group("DATA_CONFIG").attrs["Gesture_name"] = "Swing"
    return path


def test_info_says_what_is_there_and_what_is_assumed(sd2: Sd2, swing: Path) -> None:
    assert kind_of(swing) == "radar"
    out = sd2("info", swing).out
    for text in (
        "Radar map",
        "31 bins",
        "Swing",
        "0.070 to 0.175 s",
        "note: The file has no units",
    ):
        assert text in out
    data = json.loads(sd2("info", swing, "--json").out)
    assert data["kind"] == "radar"
    assert data["labels"][0]["label"] == "Swing"


def test_radar_writes_its_map(sd2: Sd2, swing: Path, tmp_path: Path) -> None:
    out = tmp_path / "map.npz"
    assert sd2("radar", swing, "--out", out).code == 0
    written = DopplerMap.load(out)
    np.testing.assert_array_equal(written.values, load_kkt(swing).doppler.values)
    assert written.kind == "real"


@pytest.mark.parametrize(
    "option", [("--bins", 16), ("--v-max", 3), ("--clutter", "mean"), ("--range", "0.5,4")]
)
def test_what_only_samples_allow_is_refused(
    sd2: Sd2, swing: Path, tmp_path: Path, option: tuple[str, object]
) -> None:
    outcome = sd2("radar", swing, "--out", tmp_path / "map.npz", *option)
    assert outcome.code == 1
    assert f"{option[0]} is given" in outcome.err
    assert not (tmp_path / "map.npz").exists()


@pytest.mark.parametrize("copied", [False, True])
def test_a_recording_is_made_of_it(sd2: Sd2, swing: Path, tmp_path: Path, copied: bool) -> None:
    folder = tmp_path / "swing.sd2"
    options = ("--radar-offset-s", 1.5, *(("--copy",) if copied else ()))
    made = sd2("import", "--out", folder, "--radar", swing, *options)
    assert made.code == 0, made.err
    if copied:
        swing.unlink()
    assert "Radar map" in sd2("info", folder).out
    out = tmp_path / "map.npz"
    assert sd2("radar", folder, "--out", out).code == 0
    np.testing.assert_allclose(DopplerMap.load(out).times_s, 1.5 + FRAME_S * np.arange(10))


def test_a_damaged_file_is_a_sentence(sd2: Sd2, swing: Path, tmp_path: Path) -> None:
    swing.write_bytes(swing.read_bytes()[:5000])
    for outcome in (
        sd2("info", swing),
        sd2("import", "--out", tmp_path / "a.sd2", "--radar", swing),
        sd2("radar", swing, "--out", tmp_path / "map.npz"),
    ):
        assert outcome.code == 1
        assert "swing.h5 cannot be read as HDF5" in outcome.err
        assert "Traceback" not in outcome.err


def test_its_labels_are_those_of_the_recording(sd2: Sd2, swing: Path, tmp_path: Path) -> None:
    data = json.loads(sd2("labels", "show", swing, "--json").out)
    assert [span["frames"] for span in data["spans"]] == [{"first": 2, "last": 4, "count": 3}]
    folder = tmp_path / "swing.sd2"
    assert sd2("import", "--out", folder, "--radar", swing, "--radar-offset-s", 1.5).code == 0
    moved = json.loads(sd2("labels", "show", folder, "--json").out)["spans"][0]
    assert moved["start_s"] == pytest.approx(1.5 + 2 * FRAME_S)
    assert moved["frames"] == {"first": 2, "last": 4, "count": 3}
