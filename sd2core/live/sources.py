"""Sources of live frames: a DCA1000 by UDP, and captures replayed at their own rate."""

from __future__ import annotations

import errno
import math
import os
import socket
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.io.radar import load_capture
from sd2core.io.radar.capture import RadarCapture
from sd2core.io.radar.dca1000 import FrameDecoder
from sd2core.io.radar.growing import GrowingHead
from sd2core.io.radar.ti_setup import read_setup
from sd2core.live.packets import HEADER_BYTES, PAYLOAD_BYTES, FrameAssembler, RawFrame

LOOPBACK = "127.0.0.1"
DATA_PORT = 4098
"""Port that the card sends samples to."""

SOCKET_BYTES = 8 << 20
"""Asked of the system for packets that wait; it may give less."""
_PAUSE_S = 0.2
"""After so long without a packet, none is on its way any more."""
_FALLEN_SILENT_S = 1.0
"""After so long, another sender may follow: a card that was started again."""
_JUDGED_S = 3.0
_RATE_TOLERANCE = 0.2
_AHEAD_S = 2.0
"""A frame is not received so long before it is taken: its number is wrong."""


@dataclass(frozen=True, eq=False)
class Frame:
    """A frame as it came."""

    content: Any  # what the source's `words` turns into samples
    time_s: float  # since the source's first frame, by the radar's clock
    received_s: float  # monotonic clock, when it was complete
    missing_bytes: int = 0
    lost: int = 0  # frames before this one that were sent, and not received


Take = Callable[[Frame], None]


@runtime_checkable
class Source(Protocol):
    """Source of frames; a class of one inherits what it need not say otherwise."""

    about: str = "A radar"  # and the place that frames come from, in words
    delay_s: float = 0.0  # from the middle of a burst of chirps to when its frame has arrived

    def head(self, start_unix_s: float) -> GrowingHead:
        """Description of the frames; ``start_unix_s`` is the wall-clock time of the first one."""

    def run(self, take: Take, stop: threading.Event) -> None:
        """Hand frames over as they come, until there are no more or ``stop`` is set."""

    def words(self, frame: Frame) -> NDArray[Any]:
        """Words of a frame to be stored, see :meth:`GrowingHead.as_stored`."""

    def doubts(self, *, at_end: bool) -> list[str]:
        """Sentences on what looks wrong; while listening, packets may still be on their way."""
        return []

    def silence(self) -> str:
        """Advice for when nothing comes; empty where that is no fault."""
        return ""

    def close(self) -> None:
        """Free what it holds."""
        return


class ReplaySource(Source):
    """Frames of a capture at the times at which they were taken.

    Parameters
    ----------
    capture : path or RadarCapture
        Anything that :func:`~sd2core.io.radar.load_capture` opens, or what it opened.
    """

    def __init__(self, capture: RadarCapture | Path | str) -> None:
        if not isinstance(capture, RadarCapture):
            capture = load_capture(capture)
        self._capture = capture
        self._head = self.head(0.0)
        simulated = " (simulated)" if capture.simulated else ""
        self.about = f"{capture.config.name}{simulated}, replayed from {capture.source}"

    def head(self, start_unix_s: float) -> GrowingHead:
        """Description of the frames."""
        capture = self._capture
        return GrowingHead(
            radar=capture.config,
            word="uint16" if capture.samples.dtype.kind == "u" else "float32",
            full_scale_known=capture.full_scale_known,
            simulated=capture.simulated,
            replayed=True,
            source=capture.source,
            notes=(
                *(f"Of what was replayed: {note}" for note in capture.notes),
                f"Replayed from {capture.source}.",
            ),
            start_unix_s=start_unix_s,
        )

    def run(self, take: Take, stop: threading.Event) -> None:
        """Hand frames over at their times."""
        capture = self._capture
        times_s = capture.timebase.times_s - capture.timebase.start_s
        begin_s = time.monotonic()
        for number, time_s in enumerate(times_s):
            if stop.wait(max(begin_s + time_s - time.monotonic(), 0.0)):
                return
            samples = np.asarray(capture.samples[number : number + 1])[0]
            take(Frame(samples, float(time_s), time.monotonic()))

    def words(self, frame: Frame) -> NDArray[Any]:
        """Words of a frame, as the capture holds them."""
        return self._head.as_stored(frame.content)


class Dca1000Source:
    """Frames of a DCA1000 that sends its packets to this computer.

    Parameters
    ----------
    setup : path
        Configuration that the radar runs with, as for files (:mod:`sd2core.io.radar.ti_setup`).
    address, port
        Of this computer, to which the card sends. Port 0 is any free one.
    opened : socket, optional
        Instead, a socket that it sends to.

    Raises
    ------
    Sd2Error
        When the configuration is damaged, or the address cannot be listened on.
    """

    def __init__(
        self,
        setup: Path,
        address: str = LOOPBACK,
        port: int = DATA_PORT,
        *,
        opened: socket.socket | None = None,
    ) -> None:
        self._setup_path = setup
        self._setup = read_setup(setup)
        self._decoder = FrameDecoder(self._setup, str(setup))
        self.assembler = FrameAssembler(self._decoder.frame_bytes)
        self.foreign_packets = 0  # from another address or port than the first packet
        self.jumps = 0  # of frame numbers, into the future
        self._stored_as = self.head(0.0)
        self._anchor: RawFrame | None = None  # first frame since the card began, or began again
        self._anchor_s = self._last_s = 0.0
        self._first_s = 0.0  # when the first frame was received, by the monotonic clock
        self._sent: tuple[int, float, int] | None = None  # restarts, time and place judged from
        self._rate_doubt: str | None = None
        self._is_judged = False
        self._socket = _listening_socket(address, port) if opened is None else opened
        self.address, self.port = self._socket.getsockname()[:2]
        radar = self._setup.config
        self.about = f"{radar.name}, from a DCA1000 to {self.address}:{self.port}"
        self.delay_s = 0.5 * radar.chirps_per_frame * radar.chirp_repetition_s
        # What the system keeps of packets that wait, with its own overhead.
        self.waiting_bytes = self._socket.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)

    def head(self, start_unix_s: float) -> GrowingHead:
        """Description of the frames."""
        setup = self._setup
        return GrowingHead(
            radar=setup.config,
            word="int16",
            source=f"DCA1000, configured by {self._setup_path.name}",
            notes=(
                *setup.notes,
                *self._decoder.notes,
                f"Times are those of the radar: a frame every"
                f" {1e3 * setup.config.frame_repetition_s:g} ms, as {self._setup_path.name} says.",
            ),
            start_unix_s=start_unix_s,
        )

    def run(self, take: Take, stop: threading.Event) -> None:
        """Receive packets until ``stop`` is set."""
        # Longer than any packet, so that a longer one is noticed.
        buffer = memoryview(bytearray(HEADER_BYTES + PAYLOAD_BYTES + 1))
        sender, heard_s = None, -math.inf
        self._socket.settimeout(_PAUSE_S)
        while not stop.is_set():
            try:
                size, address = self._socket.recvfrom_into(buffer)
            except TimeoutError:
                for raw in self.assembler.finish():
                    take(self._frame(raw))
                continue
            received_s = time.monotonic()
            if address != sender and received_s < heard_s + _FALLEN_SILENT_S:
                self.foreign_packets += 1
                continue
            sender, heard_s = address, received_s
            for raw in self.assembler.take(buffer[:size], received_s):
                take(self._frame(raw))
        for raw in self.assembler.finish():
            take(self._frame(raw))

    def words(self, frame: Frame) -> NDArray[Any]:
        """Words of a frame, in the order of captures."""
        return self._stored_as.as_stored(self._decoder.samples(frame.content))

    def doubts(self, *, at_end: bool) -> list[str]:
        """Sentences on what looks wrong with packets and rate."""
        counts, doubts = self.assembler.counts, []
        if counts.invalid:
            doubts.append(
                "Packets left out that are none of a DCA1000, or do not fit the others:"
                f" {counts.invalid:,}."
            )
        if self.foreign_packets:
            doubts.append(f"Packets left out of another sender: {self.foreign_packets:,}.")
        if self.jumps:
            doubts.append(
                f"Frame numbers jumped into the future: {self.jumps:,} times. Frames stand where"
                " they were received."
            )
        if at_end and counts.lost:
            doubts.append(f"Packets lost: {counts.lost:,}.")
        if self.waiting_bytes < SOCKET_BYTES and (counts.lost or not at_end):
            doubts.append(
                f"The system keeps only {self.waiting_bytes / 1e3:,.0f} kB of packets that wait,"
                " and may lose some; on Linux,"
                f" `sysctl -w net.core.rmem_max={SOCKET_BYTES}` allows more."
            )
        if self._rate_doubt is not None:
            doubts.append(self._rate_doubt)
        return doubts

    def silence(self) -> str:
        """Advice for when nothing comes."""
        address = f"{self.address}:{self.port}"
        if self.assembler.counts.received:
            return (
                f"Packets come no longer to {address}, or make no whole frame. Check that the radar"
                f" still runs, and runs with {self._setup_path.name}."
            )
        return (
            f"Nothing comes to {address}. Check that the radar runs and the DCA1000 was told to"
            " record, that it sends to an address of this computer (as a rule 192.168.33.30; then"
            f" say --dca1000 192.168.33.30) and to port {self.port}, and that no firewall is in"
            " between."
        )

    def close(self) -> None:
        """Free the port."""
        self._socket.close()

    def _frame(self, raw: RawFrame) -> Frame:
        """Frame at its time: by the radar's clock from when the card began, or began again."""
        period_s = self._setup.config.frame_repetition_s
        if self._anchor is None:
            self._anchor, self._first_s = raw, raw.received_s
        elif raw.stream != self._anchor.stream:
            self._anchor_s = max(raw.received_s - self._first_s, self._last_s + period_s)
            self._anchor = raw
        before_s, lost = self._last_s, raw.lost
        self._last_s = self._anchor_s + (raw.number - self._anchor.number) * period_s
        arrived_s = raw.received_s - self._first_s
        if self._last_s > arrived_s + _AHEAD_S:
            # Numbers that jumped: what they skip was never sent.
            self.jumps += 1
            self._anchor, self._anchor_s = raw, max(arrived_s, before_s + period_s)
            self._last_s = self._anchor_s
            lost = max(round((self._last_s - before_s) / period_s) - 1, 0)
        self._judge_rate(raw)
        return Frame(raw.data, self._last_s, raw.received_s, raw.missing_bytes, lost)

    def _judge_rate(self, raw: RawFrame) -> None:
        """Compare how fast frames come with the configuration, once."""
        if self._is_judged:
            return
        if self._sent is None or self._sent[0] != raw.stream:
            self._sent = (raw.stream, raw.received_s, raw.number)
            return
        passed_s = raw.received_s - self._sent[1]
        if passed_s < _JUDGED_S:
            return
        self._is_judged = True
        period_s = self._setup.config.frame_repetition_s
        share = (raw.number - self._sent[2]) * period_s / passed_s
        if abs(share - 1.0) > _RATE_TOLERANCE:
            size = self._decoder.frame_bytes
            self._rate_doubt = (
                f"{1e-6 * share * size / period_s:.3g} MB/s come;"
                f" {self._setup_path.name} says {1e-6 * size / period_s:.3g} MB/s (frames of"
                f" {size:,} bytes every {1e3 * period_s:g} ms): the radar probably runs with"
                " another configuration, and samples are out of place."
            )


def _listening_socket(address: str, port: int) -> socket.socket:
    """UDP socket on an address; Sd2Error if it is not to be had."""
    listener = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, SOCKET_BYTES)
        listener.bind((address, port))
    except (OSError, OverflowError, TypeError, ValueError) as error:  # the last two for odd names
        listener.close()
        place = f"{address}:{port}"
        number = error.errno if isinstance(error, OSError) else None
        if number == errno.EADDRINUSE:
            raise Sd2Error(
                f"Port {port} of {address} is in use",
                "a port that nothing listens on",
                "Stop the other program (mmWave Studio, another `sd2 listen`), or give another"
                " port as ADDRESS:PORT",
            ) from error
        words = os.strerror(number) if number is not None and number > 0 else str(error)
        raise Sd2Error(
            f"{place} cannot be listened on ({words})",
            "an address of this computer; a DCA1000 sends to 192.168.33.30 unless it is told"
            " otherwise",
            "Give the network card that address, or name the one that it has",
        ) from error
    return listener
