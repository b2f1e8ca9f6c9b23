"""What is unlikely about the samples of a capture is told, and nothing else is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sd2core.errors import Sd2Error
from sd2core.io.radar import load_capture
from tests.core.io.radar.dca1000_files import TiRecording, cfg_of, write_ti

PLAIN = TiRecording(frames=20)
WORDS = ("hold one value", "Nothing was recorded", "fill the whole range", "probably swapped")


def found(path: Path) -> list[str]:
    """Words of the notes of this kind."""
    return [words for words in WORDS if any(words in note for note in load_capture(path).notes)]


def rewrite(path: Path, words: np.ndarray) -> None:
    path.write_bytes(words.astype("<i2").tobytes())


@pytest.mark.parametrize("output", [0, 1, 2])
def test_a_recording_as_it_should_be_is_left_without_a_word(tmp_path: Path, output: int) -> None:
    assert found(write_ti(tmp_path, replace(PLAIN, output=output))) == []


@pytest.mark.parametrize("value", [0, -1, 700])
def test_a_capture_of_one_value_is_refused(tmp_path: Path, value: int) -> None:
    path = write_ti(tmp_path, PLAIN)
    rewrite(path, np.full_like(np.fromfile(path, "<i2"), value))
    with pytest.raises(Sd2Error, match=r"walk\.bin: all 20 frames .* hold one value.*radar sends"):
        load_capture(path)


@pytest.mark.parametrize("part", [slice(None, 9_000), slice(20_000, 25_000), slice(35_000, None)])
def test_zeros_for_a_part_of_the_time_are_told(tmp_path: Path, part: slice) -> None:
    path = write_ti(tmp_path, PLAIN)
    words = np.fromfile(path, "<i2")
    words[part] = 0
    rewrite(path, words)
    assert found(path) == ["hold one value"]


def test_a_receiver_without_a_signal_is_named(tmp_path: Path) -> None:
    path = write_ti(tmp_path, PLAIN)
    words = np.fromfile(path, "<i2").reshape(-1, PLAIN.receivers, 2 * PLAIN.samples)
    words[:, 1] = 0
    rewrite(path, words)
    assert found(path) == ["Nothing was recorded"]
    assert "channel 2 of 2" in " ".join(load_capture(path).notes)


def test_a_frame_period_in_another_unit_is_told(tmp_path: Path) -> None:
    path = write_ti(tmp_path, PLAIN)
    sent = f" {1e3 * PLAIN.frame_s:g} 1 0"
    text = cfg_of(PLAIN).replace(sent, sent.replace(" 1 0", "000 1 0"))
    path.with_suffix(".cfg").write_text(text)
    assert "The times are probably milliseconds" in load_capture(path).notes[-1]


@pytest.mark.parametrize("start", [b"MSTR", b"RPRC", b"\x7fELF"])
def test_firmware_is_refused_by_its_name(tmp_path: Path, start: bytes) -> None:
    path = write_ti(tmp_path, PLAIN)
    path.write_bytes(start + path.read_bytes()[4:])
    with pytest.raises(Sd2Error, match=r"walk\.bin is the firmware of a radar"):
        load_capture(path)


def test_bytes_that_are_no_samples_are_told(tmp_path: Path) -> None:
    path = write_ti(tmp_path, PLAIN)
    rng = np.random.default_rng(0)
    rewrite(path, rng.integers(-(2**15), 2**15, path.stat().st_size // 2))
    assert found(path) == ["fill the whole range"]
    # A loud recording is none of them.
    rewrite(path, np.fromfile(write_ti(tmp_path, PLAIN), "<i2") * 4)
    assert found(path) == []


@pytest.mark.parametrize("output", [1, 2])
@pytest.mark.parametrize("lanes", [2, 4])
def test_i_and_q_that_are_swapped_are_noticed_by_the_image_band(
    tmp_path: Path, lanes: int, output: int
) -> None:
    recording = replace(PLAIN, lanes=lanes, output=output, receivers=4, range_m=1.2)
    path = write_ti(tmp_path, recording)
    assert found(path) == []
    path.with_suffix(".cfg").write_text(cfg_of(replace(recording, q_first=True)))
    assert found(path) == ["probably swapped"]
