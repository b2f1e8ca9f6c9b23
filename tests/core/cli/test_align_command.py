"""``sd2 align``."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from types import SimpleNamespace

import pytest
import swinging_recordings
from cli_outcome import Sd2

from sd2core.cli import align
from sd2core.files.resources import resource_path
from sd2core.live.clocks import Clocks
from sd2core.live.recording import GrowingRecording
from sd2core.live.rehearsal import TestSource
from sd2core.live.sources import Frame
from sd2core.recording.recording import open_recording


@pytest.mark.slow
def test_the_sample_is_aligned_to_a_frame_and_saved(sd2: Sd2, tmp_path: Path) -> None:
    folder = tmp_path / "swipes.sd2"
    shutil.copytree(resource_path("swipes.sd2"), folder)
    recording = open_recording(folder)
    recording.radar_offset_s = -2.4
    recording.save()

    outcome = sd2("align", folder, "--json")
    assert outcome.code == 0, outcome.err
    (entry,) = json.loads(outcome.out)["recordings"]
    assert entry["offset_s"] == pytest.approx(0.0, abs=1 / 30)
    assert entry["before_s"] == -2.4
    assert entry["confidence"] > 0.99
    offsets_s, correlation = entry["curve"]["offset_s"], entry["curve"]["correlation"]
    assert max(correlation) == pytest.approx(entry["correlation"], abs=1e-3)
    # Five seconds around where it was.
    assert (offsets_s[0], offsets_s[-1]) == pytest.approx((-7.4, 2.6), abs=0.04)
    assert open_recording(folder).radar_offset_s == -2.4

    outcome = sd2("align", folder, "--save", "--within", "3")
    assert outcome.code == 0, outcome.err
    assert "(was -2.4 s)" in outcome.out
    assert open_recording(folder).radar_offset_s == entry["offset_s"]


def test_noise_is_refused_and_the_others_go_on(sd2: Sd2, tmp_path: Path) -> None:
    noise = swinging_recordings.recording(tmp_path / "noise.sd2", offset_s=0.5).folder
    bare = swinging_recordings.recording(tmp_path / "bare.sd2", radar=False).folder
    outcome = sd2("align", bare, noise, "--save", "--within", "2", "--json")
    assert outcome.code == 1
    first, second = json.loads(outcome.out)["recordings"]
    assert "no radar" in first["problem"]
    assert second["problem"]
    assert not second["saved"]
    assert open_recording(noise).radar_offset_s == 0.5
    assert "not aligned" in sd2("align", bare).out


def test_what_comes_with_the_program_is_not_changed(sd2: Sd2) -> None:
    outcome = sd2("align", resource_path("swipes.sd2"), "--save")
    assert outcome.code == 1
    assert "a recording of your own" in outcome.err


def test_what_another_saved_while_it_was_aligned_is_kept(
    sd2: Sd2, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = swinging_recordings.recording(tmp_path / "a.sd2").folder

    def found(*_: object) -> SimpleNamespace:
        theirs = open_recording(folder)
        theirs.title = "theirs"
        theirs.save()
        return SimpleNamespace(problem="", offset_s=0.5)

    monkeypatch.setattr(align, "_alignment", found)
    outcome = sd2("align", folder, "--save", "--json")
    assert outcome.code == 1
    (entry,) = json.loads(outcome.out)["recordings"]
    assert "since it was read: another title" in entry["problem"]
    assert not entry["saved"]
    assert open_recording(folder).title == "theirs"


def _kept_arrivals(folder: Path) -> Path:
    """A radar whose frames arrived 2 ms late, and a video that began 3 s before."""
    source, recording = TestSource(20.0), GrowingRecording(folder, keep_arrivals=True)
    head = source.head(0.0)
    for number in range(40):
        frame = Frame(10.0 + 0.05 * number, 0.05 * number, 103.002 + 0.05 * number)
        recording.append(source.words(frame), head, frame)
    recording.close()
    Clocks(video_first_s=100.0, video_delay_s=0.0, radar_delay_s=0.002).write(folder)
    return folder


def test_an_offset_is_put_right_by_the_arrivals(sd2: Sd2, tmp_path: Path) -> None:
    folder = _kept_arrivals(tmp_path / "take.sd2")
    outcome = sd2("align", folder, "--by-arrival", "--json")
    assert outcome.code == 0, outcome.err
    assert json.loads(outcome.out)["recordings"][0]["offset_s"] == pytest.approx(3.0)
    assert open_recording(folder).radar_offset_s == 0.0
    outcome = sd2("align", folder, "--by-arrival", "--camera-delay-ms", "50", "--save")
    assert "radar offset  3.05 s (was 0 s)" in outcome.out
    assert open_recording(folder).radar_offset_s == pytest.approx(3.05)
    # The delay is kept for the next time.
    outcome = sd2("align", folder, "--by-arrival")
    assert "3.05 s (was 3.05 s)" in outcome.out


def test_without_arrivals_it_is_said(sd2: Sd2, tmp_path: Path) -> None:
    bare = swinging_recordings.recording(tmp_path / "bare.sd2").folder
    outcome = sd2("align", bare, "--by-arrival")
    assert outcome.code == 1
    assert "does not say when its frames arrived" in outcome.out
