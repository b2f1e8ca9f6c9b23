"""Latency of live maps, from the last packet of a frame to its column, and packets lost.

A process of its own sends packets to the loopback address as a card does: 30 frames/s, each
spread over its chirps. The system may keep as many packets as `sd2 listen` asks for, or as Linux
gives where nobody changed it.
"""

from __future__ import annotations

import multiprocessing
import socket
import time
from pathlib import Path

import numpy as np
import pytest

from sd2core.live import sources
from sd2core.live.listening import Listening
from sd2core.live.reception import Reception
from sd2core.live.recording import GrowingRecording
from sd2core.live.sources import Dca1000Source
from tests.core.io.radar.dca1000_files import TiRecording, cfg_of, words_of
from tests.core.live.senders import packets_of

FRAMES_PER_S = 30
SECONDS = 5
ACTIVE = 0.6
"""Share of a frame in which samples are sent."""


def _send(recording: TiRecording, port: int) -> None:
    once = words_of(recording, recording.beat()).tobytes()
    frames = SECONDS * FRAMES_PER_S
    packets = packets_of(once * frames)
    each = len(packets) / frames
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        begin_s = time.monotonic()
        for number, one in enumerate(packets):
            frame, at = divmod(number, each)
            due_s = begin_s + (frame + ACTIVE * at / each) / FRAMES_PER_S
            if (left_s := due_s - time.monotonic()) > 0.0005:
                time.sleep(left_s)
            sender.sendto(one, ("127.0.0.1", port))


@pytest.mark.parametrize("waiting_bytes", [8 << 20, 208 << 10])
@pytest.mark.parametrize(
    ("receivers", "loops", "samples"), [(1, 64, 64), (4, 64, 128), (4, 128, 256), (4, 255, 256)]
)
def test_columns_come_within_two_frames(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    receivers: int,
    loops: int,
    samples: int,
    waiting_bytes: int,
) -> None:
    monkeypatch.setattr(sources, "SOCKET_BYTES", waiting_bytes // 2)  # Linux doubles what is asked
    radar = TiRecording(
        receivers=receivers, loops=loops, samples=samples, frames=1, frame_s=1 / FRAMES_PER_S
    )
    setup = tmp_path / "radar.cfg"
    text = cfg_of(radar).replace(f" {loops} 1 ", f" {loops} 0 ")
    # As many samples as that need a longer ramp than the tests' own.
    setup.write_text(text.replace(" 20 5 30 ", f" 20 5 {5 + samples / 4:g} "))
    source = Dca1000Source(setup, port=0)
    listening = Listening(Reception(source), GrowingRecording(tmp_path / "walk.sd2"))
    listening.start()
    sender = multiprocessing.get_context("spawn").Process(
        target=_send, args=(radar, source.port), daemon=True
    )
    sender.start()
    while sender.is_alive() or listening.next_column(0.2) is not None:
        listening.next_column(0.2)
    listening.stop()
    counts, packets = listening.counts, source.assembler.counts
    median_s, most_s = np.quantile(listening.latencies_s, (0.5, 0.95))
    size = counts.recorded * loops * receivers * samples * 4
    print(
        f"{receivers} × {loops} × {samples}, {size / SECONDS / 1e6:.1f} MB/s,"
        f" {source.waiting_bytes >> 10} KiB for packets: latency {1e3 * median_s:.1f} ms, 95 %"
        f" within {1e3 * most_s:.1f} ms; {packets.lost / (packets.received + packets.lost):.2%} of"
        f" {packets.received + packets.lost} packets lost; {counts}"
    )
    assert counts.dropped == counts.not_shown == 0
    if waiting_bytes >= 8 << 20:  # with less, frames wait for packets that were lost
        assert median_s < 2 / FRAMES_PER_S
