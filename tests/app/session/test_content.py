from __future__ import annotations

import h5py
import numpy as np
import pytest

from sd2app.session.content import load_content, recording_of
from sd2core.errors import Sd2Error
from sd2core.fmcw.processing import doppler_map
from sd2core.io.radar import companions
from sd2core.io.radar.described import RadarDescription, write_description
from sd2core.sensor import VelocityAxis
from tests.core.io.radar.acconeer_files import write_a121
from tests.core.io.radar.dca1000_files import TiRecording, write_ti


def test_a_model_is_no_part_of_a_recording_and_says_where_it_belongs(tmp_path):
    path = tmp_path / "own.safetensors"
    path.write_bytes(b"weights")
    with pytest.raises(Sd2Error, match=r"is a model.*under Model"):
        recording_of([path])


def test_a_data_set_is_no_part_of_a_recording_either(tmp_path):
    path = tmp_path / "gestures.h5"
    with h5py.File(path, "w") as file:
        file.attrs["format"] = "sd2-dataset"
    with pytest.raises(Sd2Error, match=r"is a data set.*preview sheet"):
        recording_of([path])


def test_a_radar_file_with_a_map_shows_it_and_brings_its_labels(tmp_path):
    path = tmp_path / "swing.h5"
    values = np.zeros((2, 32, 32, 10), np.float16)
    values[0, 3, 20] = 2.0
    with h5py.File(path, "w") as file:
        file["DS1"] = values
        file["LABEL"] = np.isin(np.arange(10), (2, 3)).astype(np.uint16)[:, None]
    recording = recording_of([path])
    recording.radar_offset_s = 0.5
    content = load_content(recording, lambda *_: None)
    assert content.capture is None
    assert content.radar_map.kind == "real"
    assert content.timebase.start_s == 0.5
    assert [span.label for span in content.radar_labels.spans] == ["gesture"]
    assert any("no units" in note for note in content.notes)


def test_a_damaged_radar_file_is_the_problem_that_is_named(tmp_path):
    path = tmp_path / "swing.h5"
    path.write_bytes(b"nothing of the kind")
    with pytest.raises(Sd2Error, match=r"swing\.h5 cannot be read as HDF5"):
        load_content(recording_of([path]), lambda *_: None)


@pytest.mark.parametrize("kind", ["dca1000", "a121", "described"])
def test_a_capture_of_any_radar_is_shown(tmp_path, kind):
    if kind == "dca1000":
        path = write_ti(tmp_path / "ti", TiRecording(transmitters=2))
    elif kind == "a121":
        path = write_a121(tmp_path / "a.h5")
    else:
        path = tmp_path / "wave.npy"
        np.save(path, np.exp(1j * np.arange(60)).reshape(3, 20, 1).astype(np.complex64))
        wave = RadarDescription(
            axes=("frame", "chirp", "sample"),
            carrier_hz=5.8e9,
            bandwidth_hz=0.0,
            chirp_repetition_s=1e-3,
            frame_repetition_s=0.05,
        )
        write_description(wave, path)
    content = load_content(recording_of([path, *companions(path)]), lambda *_: None)
    assert content.problems == ()
    assert content.capture is not None
    assert doppler_map(content.capture, axis=VelocityAxis()).axis.bins == 32
    assert content.notes[: len(content.capture.notes)] == content.capture.notes
