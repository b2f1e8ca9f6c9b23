"""Listening: live maps are those of the files, and nothing is missing without being said."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sd2core.errors import Sd2Error
from sd2core.fmcw import LiveMap, ProcessingOptions, doppler_map
from sd2core.io.radar import load_capture
from sd2core.live import listening as listening_module
from sd2core.live import sources as sources_module
from sd2core.live.listening import Column, Listening
from sd2core.live.recording import GrowingRecording
from sd2core.live.sources import Dca1000Source, ReplaySource
from sd2core.maps import DopplerMap
from sd2core.radar_config import CLUTTER
from sd2core.recording.recording import open_recording
from sd2core.sensor import VelocityAxis
from tests.core.classify.classifiers import classifier
from tests.core.io.radar.acconeer_files import write_a121
from tests.core.io.radar.dca1000_files import TiRecording, words_of, write_ti
from tests.core.live.fast_captures import assert_same_samples, fast, fast_swipes
from tests.core.live.senders import packets_of, send

TI = TiRecording(frames=12, loops=32, receivers=4, transmitters=2)


def _columns(listening: Listening) -> list[Column]:
    """All columns of a source that ends."""
    found = []
    while not listening.is_over:
        if (column := listening.next_column(0.2)) is not None:
            found.append(column)
    listening.stop()
    return found


def _map_of(recording: GrowingRecording) -> DopplerMap:
    capture = open_recording(recording.folder).load_capture()
    return doppler_map(capture, axis=VelocityAxis(), clutter=CLUTTER)


def _assert_is_map(columns: list[Column], doppler: DopplerMap) -> None:
    assert [one.time_s for one in columns] == doppler.timebase.times_s.tolist()
    np.testing.assert_array_equal(np.stack([one.values for one in columns], 1), doppler.values)


def test_a_replayed_capture_is_recorded_and_shown_as_it_is(tmp_path: Path) -> None:
    capture = fast_swipes()
    recording = GrowingRecording(tmp_path / "walk.sd2")
    listening = Listening(ReplaySource(capture), recording)
    listening.start()
    began_s = time.monotonic()
    columns = _columns(listening)
    # It lasts as long as what it replays: 90 frames at 180/s.
    assert time.monotonic() - began_s > 89 / 180
    assert listening.counts.whole
    assert listening.counts.recorded == 90
    assert_same_samples(open_recording(recording.folder).load_capture(), capture)
    found = _map_of(recording)
    _assert_is_map(columns, found)
    # Of the file itself, in whatever blocks.
    expected = doppler_map(capture, axis=VelocityAxis(), clutter=CLUTTER)
    np.testing.assert_array_equal(found.values, expected.values)
    assert found.kind == "simulated"
    assert len(listening.latencies_s) == 90
    assert columns[40].level_db == pytest.approx(10 * np.log10(found.values[:, 40].sum()), abs=1e-4)


@pytest.mark.parametrize("clutter", ["none", "mean", "regression"])
def test_live_columns_are_those_of_any_capture(tmp_path: Path, clutter: str) -> None:
    """Of complex samples, several channels, distances, and frames too large for one block."""
    ti = replace(TI, samples=256, loops=128, frames=5)
    for path in (write_ti(tmp_path / "ti", ti), write_a121(tmp_path / "a.h5")):
        capture = load_capture(path)
        axis = VelocityAxis(48, 3.0)
        live = LiveMap(capture, axis, ProcessingOptions(clutter))
        frames = range(capture.frame_count)
        columns = [live.column(np.asarray(capture.samples[k : k + 1])) for k in frames]
        whole = doppler_map(capture, axis=axis, clutter=clutter)
        np.testing.assert_array_equal(np.stack(columns, 1), whole.values)


def test_a_filter_that_looks_ahead_is_refused() -> None:
    with pytest.raises(Sd2Error, match="averages over later frames"):
        LiveMap(fast_swipes(2), VelocityAxis(), ProcessingOptions("moving"))


@contextmanager
def _card(tmp_path: Path, ti: TiRecording = TI) -> Iterator[tuple[Dca1000Source, Path, bytes]]:
    """Source on a free port, the file that the same samples would be, and these samples."""
    path = write_ti(tmp_path / "ti", ti)
    source = Dca1000Source(path.with_suffix(".cfg"), port=0)
    assert source.address == "127.0.0.1"
    try:
        yield source, path, words_of(ti, ti.beat()).tobytes()
    finally:
        source.close()


def _received(source: Dca1000Source) -> int:
    counts = source.assembler.counts
    return counts.received + counts.duplicate + counts.invalid + source.foreign_packets


@pytest.mark.parametrize("lanes", [2, 4])
@pytest.mark.parametrize("output", [0, 1])
def test_packets_become_what_the_file_would_be(tmp_path: Path, lanes: int, output: int) -> None:
    ti = replace(TI, lanes=lanes, output=output)
    with _card(tmp_path, ti) as (source, path, content):
        recording = GrowingRecording(tmp_path / "walk.sd2")
        listening = Listening(source, recording)
        listening.start()
        packets = packets_of(content)
        for first in range(0, len(packets) - 4, 4):  # no packet in its place
            packets[first : first + 4] = reversed(packets[first : first + 4])
        packets[5:5] = [b"none of a card", packets[3], b"", bytes(2000)]
        send(packets, source.port, lambda: _received(source))
        columns = []
        while len(columns) < ti.frames:
            column = listening.next_column(2.0)
            assert column is not None, listening.counts
            columns.append(column)
        listening.stop()
        assert source.assembler.counts.duplicate == 1
        assert source.assembler.counts.invalid == 3 - 1  # 14 bytes may be a packet
        assert listening.counts.recorded == ti.frames
    file = load_capture(path)
    assert_same_samples(open_recording(recording.folder).load_capture(), file)
    expected = doppler_map(file, axis=VelocityAxis(), clutter=CLUTTER)
    _assert_is_map(columns, expected)
