"""Frames of samples from the UDP packets of a DCA1000 capture card, whatever arrives.

A packet is a sequence number from 1 on (uint32), the number of bytes that were sent before (48
bits), both little-endian, and up to 1,456 bytes of samples: Texas Instruments, *DCA1000EVM Data
Capture Card User's Guide* (SPRUIJ4), section on the format of raw data packets. Samples are put
where the byte count says, so that order does not matter; the sequence number tells duplicates and
a restart of the card.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import NamedTuple

HEADER_BYTES = 10
PAYLOAD_BYTES = 1456
"""Largest number of bytes of samples in a packet."""
WINDOW_PACKETS = 64
"""A packet that is this much later than others is given up, and its frame handed out without it."""

_HEADER = struct.Struct("<IIH")
_FAR_PACKETS = 4096
"""A packet this far from the newest is believed once the one after it is there as well."""
_SEQUENCES = 2**32
_COUNTS = 2**48


class RawFrame(NamedTuple):
    """Bytes of one frame."""

    number: int  # counted from when the card began
    data: bytearray  # zero where nothing was received
    missing_bytes: int
    lost: int  # frames before this one of which nothing was handed out
    received_s: float  # of the packet that was received last
    stream: int  # counts how often the card began again


@dataclass
class PacketCounts:
    """Number of packets by what became of them."""

    received: int = 0
    invalid: int = 0  # no packet of this kind, or of no stream
    duplicate: int = 0
    late: int = 0  # their frame was handed out before, or began before listening
    lost: int = 0  # never received, or not yet
    restarts: int = 0


class _Packet(NamedTuple):
    sequence: int
    sent_before: int  # in bytes
    samples: memoryview

    @property
    def is_first(self) -> bool:
        """True for the first packet after a card began."""
        return self.sequence == 1 and self.sent_before == 0

    def is_followed_by(self, other: _Packet) -> bool:
        """True if the other one is the next of the same stream."""
        return (
            other.sequence == (self.sequence + 1) % _SEQUENCES
            and other.sent_before == (self.sent_before + len(self.samples)) % _COUNTS
        )


class _Open:
    """Frame that is not complete yet."""

    def __init__(self, frame_bytes: int) -> None:
        self.data = bytearray(frame_bytes)
        self.missing = frame_bytes
        self.received_s = 0.0


class FrameAssembler:
    """Assemble frames of a fixed size from packets in any order.

    Frames come in order. One that lacks packets comes with zeros in their place, once
    ``window_packets`` later ones are there; of one that lacks all nothing comes. Listening may
    begin at any packet: the first frame is then the first whole one.

    Examples
    --------
    >>> from sd2core.live.packets import FrameAssembler, packet
    >>> frames = FrameAssembler(frame_bytes=4)
    >>> frames.take(packet(2, 2, b"cd"), 0.1)
    []
    >>> [(one.number, bytes(one.data)) for one in frames.take(packet(1, 0, b"ab"), 0.2)]
    [(0, b'abcd')]
    """

    def __init__(self, frame_bytes: int, window_packets: int = WINDOW_PACKETS) -> None:
        self.counts = PacketCounts()
        self._frame_bytes = frame_bytes
        self._window = window_packets
        self._open: dict[int, _Open] = {}
        self._lost_frames = 0
        self._next: int | None = None  # frame to hand out; None before the first packet
        self._seen: set[int] = set()
        self._alone: _Packet | None = None  # that fits nothing so far
        # Of the packet sent last, by its sequence number: the number, its byte count, its end.
        self._newest = self._count = self._end = 0
        self._first = 0  # smallest sequence number
        self._largest = 0  # samples of a packet, in bytes

    def take(self, datagram: bytes | memoryview, received_s: float) -> list[RawFrame]:
        """Take a packet; returns the frames that are ready by it."""
        if not 0 < len(datagram) - HEADER_BYTES <= PAYLOAD_BYTES:
            self.counts.invalid += 1
            return []
        sequence, low, high = _HEADER.unpack_from(datagram)
        given = _Packet(sequence, low | high << 32, memoryview(datagram)[HEADER_BYTES:])
        if self._next is None:
            self._begin(given)
        elif not self._continues(given):
            return self._take_elsewhere(given, received_s)
        return self._accept(given, received_s)

    def finish(self) -> list[RawFrame]:
        """Hand out what waits for packets that do not come; a frame without its end stays."""
        complete = [number for number, one in self._open.items() if one.missing <= 0]
        return self._ready(max(complete, default=-1) + 1)

    def _begin(self, first: _Packet) -> None:
        """Begin a stream with a packet."""
        self._first, self._newest = first.sequence, first.sequence - 1
        self._count = self._end = first.sent_before
        # The last packet of all is a short one; those before it were full.
        before = first.sent_before // max(first.sequence - 1, 1)
        self._largest = max(len(first.samples), min(before, PAYLOAD_BYTES))
        self._seen.clear()
        self._open.clear()
        # Near the beginning the first packets may still be on their way.
        early = first.sent_before <= self._window * self._largest
        self._next = 0 if early else -(-first.sent_before // self._frame_bytes)

    def _from_newest(self, given: _Packet) -> tuple[int, int]:
        """Packets from the newest one to this, and its byte count, beyond all wraps."""
        step = _signed(given.sequence - self._newest, _SEQUENCES)
        return step, self._count + _signed(given.sent_before - self._count, _COUNTS)

    def _continues(self, given: _Packet) -> bool:
        """True if a packet fits the stream of the newest one, near it."""
        step, place = self._from_newest(given)
        if not self._agree(step, place):
            return False
        return abs(step) <= _FAR_PACKETS and not (given.is_first and step < -self._window)

    def _agree(self, step: int, place: int) -> bool:
        """True if so many packets can hold the bytes that were sent between."""
        between, sent = (step - 1, place - self._end) if step > 0 else (-step, self._count - place)
        return between <= sent <= between * PAYLOAD_BYTES

    def _take_elsewhere(self, given: _Packet, received_s: float) -> list[RawFrame]:
        """Take a packet of a card that began again, or of a stream that went on unheard.

        Unless it is the first packet of all, the one after it is waited for: a stray one is none.
        """
        before, self._alone = self._alone, None
        together = [given]
        if not given.is_first:
            if before is None or not before.is_followed_by(given):
                self.counts.invalid += before is not None
                self._alone = given._replace(samples=memoryview(bytes(given.samples)))
                return []
            together = [before, given]
        ready = []
        step, place = self._from_newest(together[0])
        if given.is_first or step <= 0 or not self._agree(step, place):
            ready = self.finish()
            self.counts.restarts += 1
            self._begin(together[0])
        for one in together:
            ready += self._accept(one, received_s)
        return ready

    def _accept(self, given: _Packet, received_s: float) -> list[RawFrame]:
        """Put the samples of a packet of this stream in their place."""
        step, place = self._from_newest(given)
        sequence = self._newest + step
        if sequence in self._seen:
            self.counts.duplicate += 1
            return []
        self._seen.add(sequence)
        self.counts.received += 1
        # Of those between the first and the newest, this one is not lost.
        self.counts.lost += max(step, self._first - sequence, 0) - 1
        self._first = min(self._first, sequence)
        if step > 0:
            size = len(given.samples)
            self._newest, self._count, self._end = sequence, place, place + size
            self._largest = max(self._largest, size)
            if len(self._seen) > 2 * _FAR_PACKETS:
                self._seen = {one for one in self._seen if one > sequence - _FAR_PACKETS}
        self._place(given.samples, place, received_s)
        window = self._window * self._largest
        return self._ready((self._end - window) // self._frame_bytes)

    def _place(self, samples: memoryview, place: int, received_s: float) -> None:
        """Copy samples into the frames that they belong to."""
        assert self._next is not None
        late = False
        while len(samples):
            number, at = divmod(place, self._frame_bytes)
            piece = samples[: self._frame_bytes - at]
            samples, place = samples[len(piece) :], place + len(piece)
            if number < self._next:
                late = True
                continue
            frame = self._open.get(number)
            if frame is None:
                frame = self._open[number] = _Open(self._frame_bytes)
            frame.data[at : at + len(piece)] = piece
            frame.missing -= len(piece)
            frame.received_s = received_s
        self.counts.late += late

    def _ready(self, before: int) -> list[RawFrame]:
        """Frames in order: complete ones, and those of numbers below ``before`` as they are."""
        ready = []
        while self._next is not None:
            frame = self._open.get(self._next)
            if frame is None and self._next < before:
                following = min(before, min(self._open, default=before))
                self._lost_frames += following - self._next
                self._next = following
            elif frame is not None and (frame.missing <= 0 or self._next < before):
                ready.append(
                    RawFrame(
                        self._next,
                        frame.data,
                        max(frame.missing, 0),
                        self._lost_frames,
                        frame.received_s,
                        self.counts.restarts,
                    )
                )
                del self._open[self._next]
                self._lost_frames = 0
                self._next += 1
            else:
                break
        return ready


def packet(sequence: int, count: int, samples: bytes) -> bytes:
    """Packet of a sequence number, a byte count and samples, as the card sends it."""
    count %= _COUNTS
    return _HEADER.pack(sequence % _SEQUENCES, count & 0xFFFFFFFF, count >> 32) + samples


def _signed(difference: int, modulus: int) -> int:
    """Difference of two counters that wrap around, the one of the smallest size."""
    return (difference + modulus // 2) % modulus - modulus // 2
