"""Frames from packets that come in any order, twice, or never."""

from __future__ import annotations

import random

from hypothesis import assume, given
from hypothesis import strategies as st

from sd2core.live.packets import FrameAssembler, RawFrame
from tests.core.live.senders import packets_of

WINDOW = 8

streams = st.fixed_dictionaries(
    {
        "frame_bytes": st.integers(3, 90),
        "size": st.integers(2, 40),
        "frames": st.integers(1, 12),
        "seed": st.integers(0, 2**32),
    }
)


def _content(frame_bytes: int, frames: int, rng: random.Random) -> bytes:
    # No zeros: what is missing is told from what was sent.
    return bytes(rng.randrange(1, 256) for _ in range(frame_bytes * frames))


def _disordered(packets: list[bytes], rng: random.Random, by: int = WINDOW - 1) -> list[bytes]:
    """Packets, each of which at most ``by`` others overtake."""
    places = [(number + rng.uniform(0, by), one) for number, one in enumerate(packets)]
    return [one for _, one in sorted(places)]


def _taken(assembler: FrameAssembler, packets: list[bytes]) -> list[RawFrame]:
    found = [frame for number, one in enumerate(packets) for frame in assembler.take(one, number)]
    return found + assembler.finish()


@given(streams)
def test_frames_are_whole_in_any_order(stream: dict[str, int]) -> None:
    rng = random.Random(stream["seed"])
    size = stream["frame_bytes"]
    content = _content(size, stream["frames"], rng)
    packets = packets_of(content, stream["size"])
    arriving = _disordered(packets, rng, WINDOW // 2 - 1)  # those that come twice come later yet
    twice = rng.sample(arriving, len(arriving) // 3)
    for one in twice:
        # After the first, within the window.
        at = arriving.index(one)
        arriving.insert(min(at + 1 + rng.randrange(3), len(arriving)), one)
    assembler = FrameAssembler(size, WINDOW)
    found = _taken(assembler, arriving)
    assert [one.number for one in found] == list(range(stream["frames"]))
    assert b"".join(one.data for one in found) == content
    assert all((one.missing_bytes, one.lost, one.stream) == (0, 0, 0) for one in found)
    counts = assembler.counts
    assert (counts.received, counts.duplicate) == (len(packets), len(twice))
    assert (counts.lost, counts.late, counts.restarts, counts.invalid) == (0, 0, 0, 0)


@given(streams, st.sets(st.integers(0, 500)))
def test_what_never_comes_is_zero_and_counted(stream: dict[str, int], gone: set[int]) -> None:
    rng = random.Random(stream["seed"])
    size, length = stream["frame_bytes"], stream["size"]
    content = _content(size, stream["frames"], rng)
    packets = packets_of(content, length)
    kept = [number for number in range(len(packets)) if number not in gone]
    holed = bytearray(len(content))
    for number in kept:
        part = slice(number * length, (number + 1) * length)
        holed[part] = content[part]
    assembler = FrameAssembler(size, WINDOW)
    found = _taken(assembler, _disordered([packets[number] for number in kept], rng, by=3))
    before = -1
    for one in found:
        expected = holed[one.number * size : (one.number + 1) * size]
        assert one.data == expected
        assert one.missing_bytes == expected.count(0)
        skipped = holed[(before + 1) * size : one.number * size]
        assert one.lost * size == len(skipped)
        assert not any(skipped)
        before = one.number
    whole = [k for k in range(stream["frames"]) if 0 not in holed[k * size : (k + 1) * size]]
    if kept and kept[0] * length <= WINDOW * length:  # it began at the beginning
        assert set(whole) <= {one.number for one in found}
    if kept:
        assert assembler.counts.lost == kept[-1] - kept[0] + 1 - len(kept)
    assert assembler.counts.received == len(kept)


@given(streams, st.integers(0, 60), st.integers(1, 2000))
def test_counters_wrap_around(stream: dict[str, int], packets_left: int, bytes_left: int) -> None:
    rng = random.Random(stream["seed"])
    size = stream["frame_bytes"]
    begin = 2**48 - bytes_left
    ahead = -begin % size  # of a frame that was under way
    content = _content(1, ahead, rng) + _content(size, stream["frames"], rng)
    packets = packets_of(content, stream["size"], 2**32 - packets_left, begin)
    found = _taken(FrameAssembler(size, WINDOW), _disordered(packets, rng, by=0))
    assert b"".join(one.data for one in found) == content[ahead:]
    assert [one.number for one in found] == [
        (begin + ahead) // size + k for k in range(stream["frames"])
    ]


@given(streams, st.integers(1, 4000), st.integers(0, 2**40))
def test_a_packet_whose_numbers_contradict_each_other_is_refused(
    stream: dict[str, int], ahead: int, sent: int
) -> None:
    rng = random.Random(stream["seed"])
    size = stream["frame_bytes"]
    content = _content(size, stream["frames"], rng)
    packets = packets_of(content, stream["size"])
    half = len(packets) // 2
    end = half * stream["size"]
    assume(half and not ahead - 1 <= sent - end <= (ahead - 1) * 1456)
    wrong = packets_of(b"\xff" * 8, 8, half + ahead, sent)
    assume(wrong[0] not in packets)
    assembler = FrameAssembler(size, WINDOW)
    found = _taken(assembler, packets[:half] + wrong + packets[half:])
    assert b"".join(one.data for one in found) == content
    assert (assembler.counts.lost, assembler.counts.restarts) == (0, 0)


@given(streams, st.integers(1, 12))
def test_a_card_that_begins_again_is_a_new_stream(stream: dict[str, int], again: int) -> None:
    rng = random.Random(stream["seed"])
    size = stream["frame_bytes"]
    first, second = (_content(size, frames, rng) for frames in (stream["frames"], again))
    # Sequence numbers that are far ahead, as after hours.
    packets = packets_of(first, stream["size"], 10**6 + 1, 10**6 * size)
    assembler = FrameAssembler(size, WINDOW)
    found = _taken(assembler, packets + packets_of(second, stream["size"]))
    assert assembler.counts.restarts == 1
    assert b"".join(one.data for one in found) == first + second
    assert [one.stream for one in found] == [0] * stream["frames"] + [1] * again
    assert [one.number for one in found if one.stream] == list(range(again))


def test_a_short_stream_that_begins_again_is_no_duplicate() -> None:
    content = bytes(range(1, 201))
    packets = packets_of(content, 10)  # twenty packets, fewer than a card counts to be lost
    assembler = FrameAssembler(50, WINDOW)
    found = _taken(assembler, packets + packets)
    assert b"".join(one.data for one in found) == content + content
    assert (assembler.counts.restarts, assembler.counts.duplicate) == (1, 0)


def test_a_frame_waits_for_the_window_and_no_longer() -> None:
    packets = packets_of(bytes(range(1, 201)), 10)
    del packets[2]  # of the first frame
    assembler = FrameAssembler(50, WINDOW)
    ready = [len(assembler.take(one, 0.0)) for one in packets]
    # Byte 50 ends the first frame; eight packets of 10 bytes later, byte 130, it is given up.
    assert ready.index(2) == 130 // 10 - 2
    assert sum(ready) == 4


def test_hours_without_a_packet_take_no_memory() -> None:
    assembler = FrameAssembler(50, WINDOW)
    early = packets_of(bytes(range(1, 101)), 10)
    late = packets_of(bytes(range(1, 101)), 10, first=2**30, sent_before=50 * 2**32)
    found = _taken(assembler, early + late)
    assert [one.lost for one in found] == [0, 0, 2**32 - 2, 0]
    assert (assembler.counts.restarts, assembler.counts.lost) == (0, 2**30 - 11)


@given(streams, st.integers(0, 2**32 - 1), st.integers(0, 2**48 - 1))
def test_a_stray_packet_changes_nothing(stream: dict[str, int], first: int, before: int) -> None:
    rng = random.Random(stream["seed"])
    size = stream["frame_bytes"]
    content = _content(size, stream["frames"], rng)
    packets = packets_of(content, stream["size"], 10**5, 2**40)
    stray = packets_of(b"stray", first=first, sent_before=before)
    near = abs(first - 10**5) < 5000 or abs(before - 2**40) < 5000 or (first, before) == (1, 0)
    assume(not near)
    at = rng.randrange(1, len(packets) + 1)
    calm, disturbed = FrameAssembler(size, WINDOW), FrameAssembler(size, WINDOW)
    found = _taken(disturbed, packets[:at] + stray + packets[at:])
    assert [one[:4] for one in found] == [one[:4] for one in _taken(calm, packets)]
    assert (disturbed.counts.lost, disturbed.counts.restarts) == (0, 0)


@given(st.lists(st.binary(max_size=60)), streams)
def test_anything_may_arrive(datagrams: list[bytes], stream: dict[str, int]) -> None:
    assembler = FrameAssembler(stream["frame_bytes"], WINDOW)
    found = _taken(assembler, datagrams)
    assert assembler.counts.invalid >= sum(len(one) <= 10 for one in datagrams)
    assert all(len(one.data) == stream["frame_bytes"] for one in found)
    assert all(0 <= one.missing_bytes <= stream["frame_bytes"] for one in found)
