"""Senders of packets as a DCA1000 sends them, laid out without the receiver's own code."""

from __future__ import annotations

import contextlib
import socket
import time
from collections.abc import Callable, Iterable


def packets_of(
    content: bytes, size: int = 1456, first: int = 1, sent_before: int = 0
) -> list[bytes]:
    """Packets of samples: uint32 sequence number, 48-bit byte count, samples."""
    found = []
    for number, start in enumerate(range(0, len(content), size)):
        sequence = (first + number) % 2**32
        count = (sent_before + start) % 2**48
        head = sequence.to_bytes(4, "little") + count.to_bytes(6, "little")
        found.append(head + content[start : start + size])
    return found


def send(
    packets: Iterable[bytes],
    port: int,
    has_received: Callable[[], int],
    sender: socket.socket | None = None,
) -> None:
    """Send packets to the loopback address, no faster than they are received.

    ``has_received`` is the number of packets that arrived, of any kind, since before the call;
    ``sender`` is a socket to send them from, by default one of its own.
    """
    before = has_received()
    with contextlib.ExitStack() as stack:
        if sender is None:
            sender = stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
        for number, one in enumerate(packets):
            sender.sendto(one, ("127.0.0.1", port))
            until_s = time.monotonic() + 5.0
            while has_received() - before < number - 16 and time.monotonic() < until_s:
                time.sleep(0.001)
