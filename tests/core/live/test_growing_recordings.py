"""Recordings that grow: whole at any moment, continued, and never mixed up."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sd2core.cli.info.description import describe_capture
from sd2core.errors import Sd2Error
from sd2core.io.kinds import kind_of
from sd2core.io.radar import load_capture
from sd2core.io.radar.growing import ENTRY, GrowingHead, Word
from sd2core.live.recording import GrowingRecording
from sd2core.live.sources import Frame
from sd2core.radar_config import PAPER_RADAR, RadarConfig, Sampling
from sd2core.recording.recording import Recording, open_recording
from tests.full_disk import full_disk

SMALL = replace(PAPER_RADAR, samples_per_chirp=4, chirps_per_frame=3)
HEAD = GrowingHead(radar=SMALL, word="uint16", start_unix_s=1.7e9)


def _frame(number: int, head: GrowingHead = HEAD) -> np.ndarray:
    samples = np.full(head.frame_shape, 2048 + number, head.word_type)
    samples[..., -1] -= 7  # something changes, as in what a radar gives
    return samples


def _filled(folder: Path, frames: int, head: GrowingHead = HEAD) -> Path:
    recording = GrowingRecording(folder)
    for number in range(frames):
        recording.append(_frame(number, head), head, Frame(None, number / 30, 0.0))
    recording.close()
    return recording.folder


def test_a_recording_is_whole_after_every_frame(tmp_path: Path) -> None:
    recording = GrowingRecording(tmp_path / "walk")
    assert not recording.folder.exists()  # nothing is left behind where nothing comes
    for number in range(4):
        recording.append(_frame(number), HEAD, Frame(None, 0.1 * number, 0.0))
        opened = open_recording(tmp_path / "walk.sd2")
        capture = opened.load_capture()
        assert kind_of(opened.radar) == "radar"
        assert capture.frame_count == number + 1
        np.testing.assert_array_equal(
            capture.samples[0:9], np.concatenate([[_frame(one)] for one in range(number + 1)])
        )
        np.testing.assert_array_equal(capture.timebase.times_s, 0.1 * np.arange(number + 1))
        assert capture.start_unix_s == 1.7e9
        assert capture.notes == ()
    recording.close()
    assert {one.name for one in opened.radar.iterdir()} == {
        "live.json",
        "live.samples",
        "live.index",
    }


@pytest.mark.parametrize("sampling", ["real", "complex"])
@pytest.mark.parametrize("word", ["int16", "float32"])
def test_every_kind_of_sample_comes_back(tmp_path: Path, sampling: Sampling, word: Word) -> None:
    radar = replace(SMALL, sampling=sampling, transmitters=2, receivers=3, adc_bits=16)
    head = HEAD.model_copy(update={"radar": radar, "word": word})
    rng = np.random.default_rng(0)
    frames = rng.integers(-(2**15), 2**15, (5, 6, 3, 4, 2)).astype(np.float32) / 2**15
    samples = frames[..., 0] if sampling == "real" else frames.view(np.complex64)[..., 0]
    samples = samples[..., ::-1]  # of any layout in memory
    recording = GrowingRecording(tmp_path / "walk.sd2")
    for number, one in enumerate(samples):
        recording.append(head.as_stored(one), head, Frame(None, number / 30, 0.0))
    recording.close()
    capture = load_capture(recording.radar)
    assert capture.config == radar
    np.testing.assert_array_equal(capture.read(0, 5), samples)


configs = st.builds(
    RadarConfig,
    start_frequency_hz=st.just(60e9),
    end_frequency_hz=st.floats(60.1e9, 64e9),
    samples_per_chirp=st.integers(2, 9),
    chirps_per_frame=st.integers(2, 9),
    chirp_repetition_s=st.floats(1e-5, 1e-3),
    frame_repetition_s=st.floats(0.02, 1.0),
    sample_rate_hz=st.floats(1e5, 1e7),
    receivers=st.integers(1, 4),
    adc_bits=st.integers(1, 16),
    name=st.text(max_size=9).filter(lambda text: text.isprintable()),
    sampling=st.sampled_from(["real", "complex", "complex with image band"]),
    transmitters=st.integers(1, 3),
)


@given(configs)
def test_a_head_says_the_same_after_writing(config: RadarConfig) -> None:
    head = GrowingHead(radar=config, word="int16", notes=("a", "b"), start_unix_s=0.1)
    again = GrowingHead.model_validate_json(head.model_dump_json())
    assert again == head
    assert again.radar.name == config.name


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=25)
@given(st.integers(0, 23), st.integers(0, 23))
def test_what_a_kill_tore_is_left_out_and_written_again(
    tmp_path: Path, of_samples: int, of_index: int
) -> None:
    folder = tmp_path / f"{of_samples}-{of_index}-{time.monotonic_ns()}.sd2"
    _filled(folder, 3)
    # Samples are written before their entry, so that they are torn first.
    with (folder / "radar" / "live.samples").open("ab") as stream:
        stream.write(b"\xff" * (HEAD.frame_bytes if of_index else of_samples))
    with (folder / "radar" / "live.index").open("ab") as stream:
        stream.write(b"\xff" * of_index)
    assert open_recording(folder).load_capture().frame_count == 3
    _filled(folder, 2)
    capture = open_recording(folder).load_capture()
    np.testing.assert_array_equal(
        capture.samples[0:5][:, 0, 0, 0], 2048 + np.array([0, 1, 2, 0, 1])
    )


def test_continuing_goes_on_by_the_wall_clock(tmp_path: Path) -> None:
    folder = _filled(tmp_path / "walk.sd2", 3)
    _filled(folder, 3, HEAD.model_copy(update={"start_unix_s": 1.7e9 + 60.0}))
    # A clock that was set back does not turn times round.
    _filled(folder, 1, HEAD.model_copy(update={"start_unix_s": 1.6e9}))
    capture = open_recording(folder).load_capture()
    first_s = np.arange(3) / 30
    np.testing.assert_allclose(
        capture.timebase.times_s, [*first_s, *(60 + first_s), 60 + 3 / 30], rtol=0, atol=1e-9
    )
    assert capture.notes == ("Listening was stopped and continued 2 times.",)


def test_what_says_that_it_has_a_frame_can_be_opened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recording = GrowingRecording(tmp_path / "walk.sd2")
    frames_before: list[int] = []
    make = recording._make_recording

    def slowly() -> None:
        frames_before.append(recording.frames)
        make()

    monkeypatch.setattr(recording, "_make_recording", slowly)
    recording.append(_frame(0), HEAD, Frame(None, 0.0, 0.0))
    assert (frames_before, recording.frames) == ([0], 1)
    recording.close()


def test_losses_are_told_and_kept(tmp_path: Path) -> None:
    recording = GrowingRecording(tmp_path / "walk.sd2")
    recording.append(_frame(0), HEAD, Frame(None, 0.0, 0.0))
    recording.append(_frame(1), HEAD, Frame(None, 1.0, 0.0, lost=2), dropped=4)
    recording.append(_frame(2), HEAD, Frame(None, 1.1, 0.0, missing_bytes=24))
    recording.close(dropped=5)
    _filled(recording.folder, 1)
    capture = load_capture(recording.radar)
    # 4 are there; 4 and 5 were dropped, 2 lost: what is damaged is there.
    assert capture.frames_missing == 11
    described = describe_capture(recording.radar, capture)
    assert described.facts["time"].startswith("4 of 15 frames, ")
    assert (described.data["frames"], described.data["frames_missing"]) == (4, 11)
    assert "4 of 15 frames" in repr(capture)
    notes = " ".join(capture.notes)
    assert "too slow: 9." in notes
    assert "never received, a gap in time: 2." in notes
    assert "zeros in place of lost packets: 1, 24 bytes in all" in notes


def test_what_does_not_belong_is_refused(tmp_path: Path) -> None:
    folder = _filled(tmp_path / "walk.sd2", 2)
    other = HEAD.model_copy(update={"radar": replace(SMALL, chirps_per_frame=5)})
    recording = GrowingRecording(folder)
    with pytest.raises(Sd2Error, match="of another radar or configuration"):
        recording.check(other)
    with pytest.raises(Sd2Error, match=r"word of .* is uint16"):
        recording.check(HEAD.model_copy(update={"word": "int16"}))
    with pytest.raises(Sd2Error, match="Another process listens into"):
        GrowingRecording(folder)
    recording.close()
    GrowingRecording(folder).close()
    Recording.create(tmp_path / "own.sd2", radar=folder / "radar")
    with pytest.raises(Sd2Error, match="no radar was recorded into it"):
        GrowingRecording(tmp_path / "own.sd2")
    (tmp_path / "some.sd2" / "radar").mkdir(parents=True)
    with pytest.raises(Sd2Error, match="no radar was recorded into it"):
        GrowingRecording(tmp_path / "some.sd2")
    with pytest.raises(Sd2Error, match="does not exist"):
        GrowingRecording(tmp_path / "none" / "walk.sd2")


def test_a_recording_without_its_json_is_completed(tmp_path: Path) -> None:
    folder = _filled(tmp_path / "walk.sd2", 2)
    (folder / "recording.json").unlink()  # killed between the first frame and its recording
    assert load_capture(folder / "radar").frame_count == 2
    _filled(folder, 1)
    assert open_recording(folder).load_capture().frame_count == 3


def test_a_full_disk_leaves_whole_frames(tmp_path: Path) -> None:
    recording = GrowingRecording(tmp_path / "walk.sd2")
    for number in range(100):
        recording.append(_frame(number), HEAD, Frame(None, number / 30, 0.0))
    with full_disk(HEAD.frame_bytes * 100 + 7), pytest.raises(OSError, match="free some"):
        recording.append(_frame(100), HEAD, Frame(None, 100 / 30, 0.0))
    recording.close()
    assert load_capture(recording.radar).frame_count == 100
    assert (recording.radar / "live.index").stat().st_size == 100 * ENTRY.itemsize


def test_damaged_files_are_refused_in_words(tmp_path: Path) -> None:
    folder = _filled(tmp_path / "walk.sd2", 3) / "radar"
    head, index = folder / "live.json", folder / "live.index"
    whole = head.read_text()
    for found, text in (
        ("word is 'int8'", whole.replace("uint16", "int8")),
        ("at most", whole.replace('"samples_per_chirp": 4', '"samples_per_chirp": 400000000')),
        ("chirps_per_frame is 0", whole.replace('"chirps_per_frame": 3', '"chirps_per_frame": 0')),
        ("bits", whole.replace('"adc_bits": 12', '"adc_bits": 4000')),
        ("uint16", whole.replace('"sampling": "real"', '"sampling": "complex"')),
    ):
        assert text != whole
        head.write_text(text)
        with pytest.raises(Sd2Error, match=found):
            load_capture(folder)
    head.write_text(whole)
    entries = np.fromfile(index, ENTRY)
    entries["time_s"][1] = 5.0
    entries.tofile(index)
    with pytest.raises(Sd2Error, match=r"live\.index.*Frame 2 is at"):
        load_capture(folder)
    index.write_bytes(b"")
    with pytest.raises(Sd2Error, match="holds 0 whole frames"):
        load_capture(folder)
    index.unlink()
    with pytest.raises(Sd2Error, match=r"live\.index does not exist"):
        load_capture(folder)
