"""A TI board with a DCA1000 that is set up by xwr: a board and a card that speak as documented."""

from __future__ import annotations

import os
import socket
import struct
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from sd2core.errors import Sd2Error
from sd2core.live import ti
from sd2core.live.listening import Listening
from sd2core.live.reception import Reception
from sd2core.live.recording import GrowingRecording
from sd2core.recording.recording import open_recording
from tests.core.io.radar.dca1000_files import TiRecording, cfg_of, words_of
from tests.core.live.senders import packets_of

RECORDING = TiRecording(frames=0, loops=16, receivers=2)
FILMED = TiRecording(frames=40, loops=16, receivers=2)
START, STOP, RESET, CONFIG_FPGA, CONFIG_RECORD, ALIVE, VERSION = 5, 6, 2, 3, 0x0B, 9, 0x0E


def test_what_does_not_stream_is_refused_before_anything_is_opened(tmp_path: Path) -> None:
    setup = tmp_path / "walk.cfg"
    for changes, words in (
        ({"lvdsStreamCfg": ""}, "does not let the board send samples"),
        ({"lvdsStreamCfg": "lvdsStreamCfg -1 0 0 0"}, "does not let the board send samples"),
        ({"frameCfg": "frameCfg 0 0 16 100 20 1 0"}, "stop after 100 frames"),
    ):
        setup.write_text(cfg_of(RECORDING, **changes), encoding="utf-8")
        with pytest.raises(Sd2Error, match=words):
            ti.TiSource("", setup)
    for none in (None, tmp_path / "walk.mmwave.json"):
        with pytest.raises(Sd2Error, match=r"without a \.cfg"):
            ti.TiSource("", none)


def test_commands_are_those_of_the_file_without_comments(tmp_path: Path) -> None:
    setup = tmp_path / "walk.cfg"
    text = "sensorStop\nflushCfg\n" + cfg_of(RECORDING) + "   % done\nsensorStart\n"
    setup.write_text(text, encoding="utf-8")
    commands = ti.commands_of(setup)
    assert commands[0].startswith("channelCfg ")
    assert commands[-1] == "lvdsStreamCfg -1 0 1 0"


def test_without_xwr_it_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    setup = tmp_path / "walk.cfg"
    setup.write_text(cfg_of(RECORDING), encoding="utf-8")
    monkeypatch.setitem(sys.modules, "xwr", None)
    with pytest.raises(Sd2Error, match="pip install xwr"):
        ti.TiSource("", setup)


class FakeHardware:
    """A board at a pseudo-terminal and a card at 127.0.0.2, of one log of what they were told.

    The board echoes a line, answers ``Done`` and prompts; the card answers packets
    ``5A A5 … AA EE`` by their code. Samples flow once the card records and the board has started.
    """

    def __init__(self, refused: str = "") -> None:
        import pty

        self.log: list[str] = []
        self.refused = refused
        self.is_deaf = False  # the card
        self._master, terminal = pty.openpty()
        self.port = os.ttyname(terminal)
        self._terminal = terminal
        self._commands = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._commands.bind(("127.0.0.2", 0))
        self._commands.settimeout(0.05)
        self._samples = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.card = ti.Card("127.0.0.1", "127.0.0.2", _free_port(), self._commands.getsockname()[1])
        self._is_recording = self._has_started = False
        self._over = threading.Event()
        self._threads = [
            threading.Thread(target=target) for target in (self._be_board, self._be_card)
        ]
        for thread in self._threads:
            thread.start()

    def close(self) -> None:
        self._over.set()
        for thread in self._threads:
            thread.join()
        for one in (self._commands, self._samples):
            one.close()
        os.close(self._master)
        os.close(self._terminal)

    def _be_board(self) -> None:
        import select

        line = b""
        while not self._over.is_set():
            if not select.select([self._master], [], [], 0.05)[0]:
                continue
            line += os.read(self._master, 4096)
            while b"\n" in line:
                told, line = line.split(b"\n", 1)
                self._take(told.decode().strip())

    def _take(self, told: str) -> None:
        self.log.append(told)
        answer = "Error -1" if self.refused and told.startswith(self.refused) else "Done"
        os.write(self._master, f"{told}\n{answer}\n\rmmwDemo:/>".encode())
        if told == "sensorStart" and self._is_recording:
            self._has_started = True
            threading.Thread(target=self._stream).start()

    def _be_card(self) -> None:
        while not self._over.is_set():
            try:
                packet, sender = self._commands.recvfrom(2048)
            except TimeoutError:
                continue
            head, code, size = struct.unpack_from("<HHH", packet)
            assert (head, packet[-2:], len(packet)) == (0xA55A, b"\xaa\xee", 8 + size)
            self.log.append(f"card {code}")
            self._is_recording |= code == START
            if code in (STOP, RESET):
                self._is_recording = self._has_started = False
            if not self.is_deaf:
                self._commands.sendto(struct.pack("<HHHH", 0xA55A, code, 0, 0xEEAA), sender)

    def _stream(self) -> None:
        content = words_of(FILMED, FILMED.beat()).tobytes()
        each = len(content) // FILMED.frames
        packets = packets_of(content)
        for number, packet in enumerate(packets):
            if not self._has_started:
                return
            self._samples.sendto(packet, (self.card.address, self.card.data_port))
            time.sleep(FILMED.frame_s * 1456 / each if number % 2 else 0.0)


def _free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


@pytest.fixture
def hardware(monkeypatch: pytest.MonkeyPatch) -> Iterator[FakeHardware]:
    pytest.importorskip("xwr", reason="xwr is not installed")
    if sys.platform != "linux":
        pytest.skip("a second address of this computer and a pseudo-terminal are needed")
    monkeypatch.setattr(ti, "_BOOT_S", 0.05)
    made = FakeHardware()
    yield made
    made.close()


@pytest.fixture
def setup(tmp_path: Path) -> Path:
    path = tmp_path / "walk.cfg"
    path.write_text(cfg_of(RECORDING) + "sensorStart\n", encoding="utf-8")
    return path


def test_board_and_card_are_set_up_started_and_stopped(
    hardware: FakeHardware, setup: Path, tmp_path: Path
) -> None:
    source = ti.TiSource(hardware.port, setup, hardware.card)
    card = [one for one in hardware.log if one.startswith("card")]
    told = [int(one.split()[1]) for one in card]
    assert told[:2] == [ALIVE, VERSION]
    assert told[-2:] == [STOP, RESET]
    assert {CONFIG_RECORD, CONFIG_FPGA} < set(told)
    assert START not in told
    board = [one for one in hardware.log if not one.startswith("card")]
    assert board == ["sensorStop", "flushCfg", *ti.commands_of(setup)]

    reception = Reception(source)
    listening = Listening(reception, GrowingRecording(tmp_path / "take.sd2"))
    hardware.log.clear()
    listening.start()
    until_s = time.monotonic() + 30.0
    while listening.counts.recorded < FILMED.frames and time.monotonic() < until_s:
        listening.next_column(0.05)
    assert hardware.log == [f"card {START}", "sensorStart"]
    listening.stop()
    reception.close()
    assert hardware.log[-2:] == [f"card {STOP}", f"card {RESET}"]
    assert listening.counts.whole
    capture = open_recording(tmp_path / "take.sd2").load_capture()
    expected = words_of(FILMED, FILMED.beat()).reshape(FILMED.frames, -1)
    assert capture.frame_count == FILMED.frames
    # What was sent is there: the power of each frame, whatever the order of its words.
    power = np.square(np.abs(capture.read(0, FILMED.frames))).sum(axis=(1, 2, 3))
    np.testing.assert_allclose(power, np.square(expected / 32768.0).sum(axis=1), rtol=1e-3)
    assert any("set up with walk.cfg by xwr" in note for note in capture.notes)


def test_a_line_that_the_board_refuses_is_named(hardware: FakeHardware, setup: Path) -> None:
    hardware.refused = "profileCfg"
    with pytest.raises(Sd2Error, match=r"walk\.cfg: the board refuses 'profileCfg .*Error -1"):
        ti.TiSource(hardware.port, setup, hardware.card)


def test_a_card_or_board_that_is_not_there_is_named(hardware: FakeHardware, setup: Path) -> None:
    with pytest.raises(Sd2Error, match="The board does not answer"):
        ti.TiSource("/dev/none", setup, hardware.card)
    hardware.is_deaf = True
    with pytest.raises(Sd2Error, match="The DCA1000 does not answer"):
        ti.TiSource(hardware.port, setup, hardware.card)
