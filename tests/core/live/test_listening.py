"""Listening: live maps are those of the files, and nothing is missing without being said."""

from __future__ import annotations

import contextlib
import shutil
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
from sd2core.live.reception import Reception
from sd2core.live.recording import GrowingRecording
from sd2core.live.sources import Dca1000Source, ReplaySource
from sd2core.maps import DopplerMap
from sd2core.radar_config import CLUTTER
from sd2core.recording.recording import open_recording
from sd2core.sensor import VelocityAxis
from tests.core.classify.classifiers import classifier
from tests.core.io.radar.acconeer_files import write_a121
from tests.core.io.radar.dca1000_files import TiRecording, words_of, write_ti
from tests.core.live.fast_captures import assert_same_samples, fast_swipes
from tests.core.live.senders import packets_of, send

TI = TiRecording(frames=12, loops=32, receivers=4, transmitters=2)


@pytest.fixture(autouse=True)
def _patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """However busy the machine, no column is left out."""
    monkeypatch.setattr(listening_module, "_SHOWN_FRAMES", 1000)


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
    listening = Listening(Reception(ReplaySource(capture)), recording)
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


@pytest.mark.one_in(3)
@pytest.mark.parametrize("clutter", ["none", "mean", "regression"])
def test_live_columns_are_those_of_any_capture(tmp_path: Path, clutter: str) -> None:
    """Of complex samples, several channels, distances, and frames too large for one block."""
    ti = replace(TI, samples=128, loops=128, frames=3)
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
        reception, recording = Reception(source), GrowingRecording(tmp_path / "walk.sd2")
        listening = Listening(reception, recording)
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
        reception.close()
        assert source.assembler.counts.duplicate == 1
        assert source.assembler.counts.invalid == 3 - 1  # 14 bytes may be a packet
        assert listening.counts.recorded == ti.frames
    file = load_capture(path)
    assert_same_samples(open_recording(recording.folder).load_capture(), file)
    expected = doppler_map(file, axis=VelocityAxis(), clutter=CLUTTER)
    _assert_is_map(columns, expected)


def test_lost_packets_leave_zeros_and_gaps(tmp_path: Path) -> None:
    ti = replace(TI, frames=20)
    with _card(tmp_path, ti) as (source, path, content):
        reception, recording = Reception(source), GrowingRecording(tmp_path / "walk.sd2")
        listening = Listening(reception, recording)
        listening.start()
        size = len(content) // ti.frames
        packets = packets_of(content)
        each = -(-size // 1456)
        # One packet of frame 2, and all that touch frames 5 and 6.
        gone = {2 * size // 1456 + 3, *range(5 * size // 1456, 7 * size // 1456 + 1)}
        sent = [one for number, one in enumerate(packets) if number not in gone]
        assert each > 10
        send(sent, source.port, lambda: _received(source))
        columns = []
        while len(columns) < 18:
            column = listening.next_column(2.0)
            assert column is not None, listening.counts
            columns.append(column)
        listening.stop()
        reception.close()
        assert source.assembler.counts.lost == len(gone)
        assert any(f"Packets lost: {len(gone)}." in one for one in source.doubts(at_end=True))
    capture = open_recording(recording.folder).load_capture()
    there = [k for k in range(20) if k not in (5, 6)]
    np.testing.assert_allclose(capture.timebase.times_s, ti.frame_s * np.array(there), atol=1e-9)
    holed = bytearray(content)
    for number in gone:
        holed[number * 1456 : (number + 1) * 1456] = bytes(1456)
    path.write_bytes(holed)
    expected = load_capture(path).read(0, 20)[there]
    np.testing.assert_array_equal(capture.read(0, 18), expected)
    # Frames 4 and 7 share packets with what is gone.
    assert (listening.counts.lost, listening.counts.damaged) == (2, 3)
    notes = " ".join(capture.notes)
    assert "never received, a gap in time: 2." in notes
    assert "zeros in place of lost packets: 3, " in notes


def test_a_slow_disk_drops_frames_and_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(listening_module, "_BUFFER_BYTES", 0)  # the fewest frames that may wait
    recording = GrowingRecording(tmp_path / "walk.sd2")
    append, slow = recording.append, threading.Event()

    def slowly(*arguments: object, **options: object) -> None:
        if not slow.is_set():
            time.sleep(0.02)
        append(*arguments, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(recording, "append", slowly)
    capture = fast_swipes(60, faster=15.0)
    listening = Listening(Reception(ReplaySource(capture)), recording)
    listening.start()
    columns = _columns(listening)
    counts = listening.counts
    assert counts.dropped > 10
    assert counts.recorded + counts.dropped == 60
    assert not counts.whole
    found = open_recording(recording.folder).load_capture()
    assert f"too slow: {counts.dropped}." in " ".join(found.notes)
    # What is there is what was received at that time, and the map shows just that.
    places = np.searchsorted(capture.timebase.times_s, found.timebase.times_s - 1e-9)
    np.testing.assert_array_equal(found.read(0, found.frame_count), capture.read(0, 60)[places])
    _assert_is_map(columns, _map_of(recording))


def test_a_slow_window_loses_nothing_of_the_recording(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(listening_module, "_SHOWN_FRAMES", 32)
    capture = fast_swipes(80, faster=40.0)
    recording = GrowingRecording(tmp_path / "walk.sd2")
    listening = Listening(Reception(ReplaySource(capture)), recording)
    listening.start()
    time.sleep(80 / 1200 + 0.3)  # nobody asks for a column meanwhile
    columns = _columns(listening)
    counts = listening.counts
    assert (counts.recorded, counts.dropped) == (80, 0)
    assert counts.not_shown == 80 - len(columns) > 0
    assert_same_samples(open_recording(recording.folder).load_capture(), capture)


def test_what_cannot_be_stored_stops_listening(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recording = GrowingRecording(tmp_path / "walk.sd2")
    append = recording.append

    def fails(*arguments: object, **options: object) -> None:
        if recording.frames == 5:
            raise OSError(28, "No space left on device: free some", "walk")
        append(*arguments, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(recording, "append", fails)
    listening = Listening(Reception(ReplaySource(fast_swipes(30, 10.0))), recording)
    listening.start()
    with pytest.raises(OSError, match="free some"):
        _columns(listening)
    with pytest.raises(OSError, match="free some"):
        listening.stop()
    assert open_recording(recording.folder).load_capture().frame_count == 5
    GrowingRecording(recording.folder).close()  # nobody listens into it any more


@pytest.mark.parametrize("delay_frames", [0, 4])
def test_labels_are_those_of_the_map(tmp_path: Path, delay_frames: int) -> None:
    trained = classifier(delay_frames=delay_frames)
    recording = GrowingRecording(tmp_path / "walk.sd2")
    listening = Listening(
        Reception(ReplaySource(fast_swipes(60, 10.0))), recording, classifier=trained
    )
    listening.start()
    columns = _columns(listening)
    answers = trained.probabilities_of(np.stack([one.values for one in columns]))
    for number, column in enumerate(columns):
        if number < delay_frames:
            assert column.label is None
            continue
        answer = answers[number - delay_frames]
        assert column.label is not None
        assert column.label.name == trained.classes[answer.argmax()]
        assert column.label.probability == pytest.approx(answer.max(), abs=1e-5)


def test_a_gap_is_a_new_clip_to_the_classifier(tmp_path: Path) -> None:
    trained = classifier()
    capture = fast_swipes(40, 10.0)
    times_s = capture.timebase.times_s + 0.06 * (np.arange(40) >= 20)
    capture = replace(capture, timebase=type(capture.timebase)(times_s))
    listening = Listening(
        Reception(ReplaySource(capture)),
        GrowingRecording(tmp_path / "walk.sd2"),
        classifier=trained,
    )
    listening.start()
    columns = _columns(listening)
    alone = trained.probabilities_of(np.stack([one.values for one in columns[20:]]))
    assert columns[-1].label is not None
    assert columns[-1].label.probability == pytest.approx(alone[-1].max(), abs=1e-5)


def test_a_classifier_of_another_rate_is_refused(tmp_path: Path) -> None:
    capture = load_capture(write_ti(tmp_path, TI))  # 50 frames/s
    with pytest.raises(Sd2Error, match=r"gives 50 frames/s\. Expected: 30 frames/s"):
        Listening(
            Reception(ReplaySource(capture)),
            GrowingRecording(tmp_path / "a.sd2"),
            classifier=classifier(),
        )


def test_another_radar_is_not_appended(tmp_path: Path) -> None:
    recording = GrowingRecording(tmp_path / "walk.sd2")
    listening = Listening(Reception(ReplaySource(fast_swipes(3, 10.0))), recording)
    listening.start()
    _columns(listening)
    recording = GrowingRecording(tmp_path / "walk.sd2")
    with pytest.raises(Sd2Error, match="another radar or configuration"):
        Listening(Reception(ReplaySource(load_capture(write_ti(tmp_path / "ti", TI)))), recording)
    recording.close()


@pytest.mark.slow
def test_a_card_that_begins_again_goes_on_in_time(tmp_path: Path) -> None:
    card = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    with card, _card(tmp_path) as (source, _, content):
        reception, recording = Reception(source), GrowingRecording(tmp_path / "walk.sd2")
        listening = Listening(reception, recording)
        listening.start()
        for pause_s in (0.5, 0.0):
            send(packets_of(content), source.port, lambda: _received(source), card)
            time.sleep(pause_s)
        until_s = time.monotonic() + 5.0
        while listening.counts.recorded < 2 * TI.frames and time.monotonic() < until_s:
            listening.next_column(0.1)
        listening.stop()
        reception.close()
        assert source.assembler.counts.restarts == 1
    times_s = open_recording(recording.folder).load_capture().timebase.times_s
    assert len(times_s) == 2 * TI.frames
    steps_s = np.diff(times_s)
    assert steps_s[TI.frames - 1] > 0.25  # frames 0 to 11 pass in 0.22 s by the radar's clock
    np.testing.assert_allclose(np.delete(steps_s, TI.frames - 1), TI.frame_s, atol=1e-9)


@pytest.mark.parametrize("address", ["127.0.0.2", "127.0.0.1"])
def test_another_sender_is_left_out(tmp_path: Path, address: str) -> None:
    """One at another address, or another program at the same."""
    with _card(tmp_path) as (source, _, content), contextlib.ExitStack() as stack:
        packets = packets_of(content)
        card, other = (
            stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) for _ in range(2)
        )
        try:
            other.bind((address, 0))
        except OSError:
            pytest.skip("This system has one loopback address only")
        reception = Reception(source)
        listening = Listening(reception, GrowingRecording(tmp_path / "walk.sd2"))
        listening.start()
        send(packets[:40], source.port, lambda: _received(source), card)
        other.sendto(packets[100], ("127.0.0.1", source.port))
        send(packets[40:], source.port, lambda: _received(source), card)
        until_s = time.monotonic() + 5.0
        while listening.counts.recorded < TI.frames and time.monotonic() < until_s:
            listening.next_column(0.1)
        listening.stop()
        reception.close()
        assert listening.counts.whole
        assert listening.counts.recorded == TI.frames
        assert "Packets left out of another sender: 1." in source.doubts(at_end=True)


def test_a_recording_that_is_deleted_is_put_back_and_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sd2core.live.recording._LOOK_S", 0.0)
    recording = GrowingRecording(tmp_path / "walk.sd2")
    listening = Listening(Reception(ReplaySource(fast_swipes())), recording)
    listening.start()
    while listening.counts.recorded < 20:
        listening.next_column(0.1)
    recording.folder.rename(tmp_path / "gone")  # in one step, while it is written to
    shutil.rmtree(tmp_path / "gone")
    while not listening.is_over:
        listening.next_column(0.1)
    listening.stop()
    assert any("was deleted while it was recorded" in one for one in listening.doubts(at_end=True))
    assert_same_samples(open_recording(recording.folder).load_capture(), fast_swipes())


def test_another_configuration_than_the_radars_is_noticed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sources_module, "_JUDGED_S", 0.2)
    card = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    with card, _card(tmp_path) as (source, _, content):
        reception = Reception(source)
        listening = Listening(reception, GrowingRecording(tmp_path / "walk.sd2"))
        listening.start()
        size = len(content) // TI.frames
        for frame in range(TI.frames):  # at a third of the rate that the configuration says
            part = content[frame * size : (frame + 1) * size]
            sent = packets_of(content[: frame * size] + part)[frame * size // 1456 :]
            sent = [one for one in sent if len(one) == 1466 or frame == TI.frames - 1]
            send(sent, source.port, lambda: _received(source), card)
            time.sleep(3 * TI.frame_s)
        listening.stop()
        reception.close()
        (doubt,) = (one for one in source.doubts(at_end=True) if "MB/s" in one)
        assert "walk.cfg says" in doubt
        assert "probably runs with another configuration" in doubt


def test_what_cannot_be_listened_on_is_refused(tmp_path: Path) -> None:
    with _card(tmp_path) as (source, path, _):
        setup = path.with_suffix(".cfg")
        with pytest.raises(Sd2Error, match=rf"Port {source.port} of 127\.0\.0\.1 is in use"):
            Dca1000Source(setup, port=source.port)
        with pytest.raises(Sd2Error, match="cannot be listened on"):
            Dca1000Source(setup, "192.0.2.1")  # reserved for documentation
        with pytest.raises(Sd2Error, match="cannot be listened on"):
            Dca1000Source(setup, port=70000)
        with pytest.raises(Sd2Error, match="cannot be listened on"):
            Dca1000Source(setup, "ä" * 100)
        odd = setup.with_name("odd.cfg")
        odd.write_text(setup.read_text().replace(" 32 4000", " 33 4000").replace("15 3 0", "1 3 0"))
        with pytest.raises(Sd2Error, match="do not fill 2 lanes"):
            Dca1000Source(odd, port=0)
        assert "Nothing comes to 127.0.0.1" in source.silence()


def test_a_chosen_receiver_stays_chosen_when_listening_goes_on(tmp_path: Path) -> None:
    path = write_ti(tmp_path / "ti", TiRecording(frames=6, loops=32, receivers=3))
    recording = GrowingRecording(tmp_path / "walk.sd2")
    assert recording.channel == (None, None)
    listening = Listening(Reception(ReplaySource(path)), recording)
    listening.start()
    _columns(listening)
    chosen = open_recording(recording.folder)
    chosen.radar_receiver = 2
    chosen.save(chosen.load_capture().timebase)
    again = GrowingRecording(recording.folder)
    listening = Listening(Reception(ReplaySource(path)), again)
    listening.start()
    columns = _columns(listening)
    only = doppler_map(load_capture(path).channel(2), axis=VelocityAxis(), clutter=CLUTTER)
    np.testing.assert_array_equal(np.stack([one.values for one in columns], 1), only.values)
    assert open_recording(again.folder).load_every_channel().config.receivers == 3
