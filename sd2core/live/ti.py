"""TI's radar boards with a DCA1000, set up and started by the package ``xwr``.

The lines of the ``.cfg`` go to the board as they are, so that the board runs with what the capture
is described by; ``xwr`` speaks to board and card, in the order in which its authors start them.
"""

from __future__ import annotations

import contextlib
import logging
import re
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sd2core.errors import Sd2Error
from sd2core.files.texts import read_text
from sd2core.io.radar.growing import GrowingHead
from sd2core.io.radar.ti_setup import read_setup
from sd2core.live.sources import DATA_PORT, SOCKET_BYTES, Dca1000Source, Take

_BOOT_S = 2.0
"""A board that was reset takes commands again by then."""
_OWN = ("sensorStop", "flushCfg", "sensorStart")
"""Commands that are sent when it is time for them, wherever they stand in the file."""
_INSTALL = "Install it with: pip install xwr (the extra [ti])"


@dataclass(frozen=True)
class Card:
    """Addresses of a DCA1000, by default those that it leaves the factory with."""

    address: str = "192.168.33.30"  # of this computer
    card_address: str = "192.168.33.180"
    data_port: int = DATA_PORT
    command_port: int = 4096


class TiSource(Dca1000Source):
    """Frames of a board that is set up here.

    Parameters
    ----------
    place : str
        Serial port of the board's commands; empty: the first that calls itself XDS110.
    setup : path
        ``.cfg`` of the mmWave SDK, for the SDK's demo, which runs on the board.
    card : Card

    Raises
    ------
    Sd2Error
        When ``xwr``, board or card are not there, or the board refuses a line.
    """

    def __init__(self, place: str, setup: Path | None, card: Card | None = None) -> None:
        if setup is None or setup.suffix.lower() != ".cfg":
            raise Sd2Error("A radar of TI is to be set up without a .cfg", "--setup FILE.cfg")
        lines = commands_of(setup)
        card = card or Card()
        self._capture, self._radar = _xwr()
        with contextlib.ExitStack() as stack:
            with self._answering("The DCA1000 does not answer", "Check its power and cable"):
                self._card = self._capture.DCA1000EVM(
                    card.address, card.card_address, card.data_port, card.command_port,
                    socket_buffer=SOCKET_BYTES,
                )  # fmt: skip
                stack.callback(self._card.config_socket.close)
                stack.callback(self._card.data_socket.close)
                four = read_setup(setup).lanes == 4
                lvds = self._capture.defines.LVDS
                self._card.setup(lvds=lvds.FOUR_LANE if four else lvds.TWO_LANE)
                self._card.stop()
                self._card.reset_ar_device()
            time.sleep(_BOOT_S)
            self._card.flush()
            with self._answering("The board does not answer", "Check its USB cable and its switch"):
                self._board = self._radar.XWRBase(place or None)
                stack.callback(self._board.port.close)
                self._board.stop()
            for line in ("flushCfg", *lines):
                with self._answering(f"{setup}: the board refuses '{line}'", "Change that line"):
                    self._board.send(line)
            super().__init__(setup, opened=self._card.data_socket)
            self.about += f", set up at {self._board.port.port}"
            self._close = stack.pop_all().close

    def head(self, start_unix_s: float) -> GrowingHead:
        """Description of the frames."""
        from importlib.metadata import version

        head = super().head(start_unix_s)
        note = f"The board was set up with {self._setup_path.name} by xwr {version('xwr')}."
        return head.model_copy(update={"notes": (*head.notes, note)})

    def run(self, take: Take, stop: threading.Event) -> None:
        """Start card and board, and receive packets until ``stop`` is set."""
        try:
            with self._answering("The radar does not start", "Check its power, and its .cfg"):
                self._card.start()
                self._board.start()
            super().run(take, stop)
        finally:
            # A board that is busy does not hear a command: it is reset, as at the start.
            with contextlib.suppress(OSError, self._capture.DCAError):
                self._card.stop()
                self._card.reset_ar_device()

    def silence(self) -> str:
        """Advice for when nothing comes."""
        return (
            "The board was started, and nothing comes from the DCA1000: check the ribbon cable"
            " between both, and the card's switches (16 bits, as it is configured by software)."
        )

    def close(self) -> None:
        """Let go of board and card."""
        self._close()

    @contextlib.contextmanager
    def _answering(self, message: str, remedy: str) -> Iterator[None]:
        try:
            yield
        except (OSError, self._capture.DCAError, self._radar.XWRError) as error:
            why = " ".join(str(error).split()) or type(error).__name__
            raise Sd2Error(f"{message} ({why})", "board and card as docs say", remedy) from error


def commands_of(setup: Path) -> list[str]:
    """Lines of a ``.cfg`` that set a board up; Sd2Error where it would not stream samples."""
    text = read_text(setup, "a .cfg of the mmWave SDK", errors="replace")
    lines = [re.split("%|#|//", line, maxsplit=1)[0].strip() for line in text.splitlines()]
    words = [line.split() for line in lines if line]
    streamed = [one[1:] for one in words if one[0] == "lvdsStreamCfg"]
    if not streamed or streamed[-1][2:3] != ["1"]:
        raise Sd2Error(
            f"{setup} does not let the board send samples to a DCA1000",
            "a line such as 'lvdsStreamCfg -1 0 1 0'",
        )
    if read_setup(setup).frames:
        raise Sd2Error(
            f"{setup} lets the board stop after {read_setup(setup).frames} frames",
            "0, without end, as the fourth number of frameCfg",
        )
    return [" ".join(one) for one in words if one[0] not in _OWN]


def _xwr() -> tuple[Any, Any]:
    """Parts of the package ``xwr`` for the card and for the board."""
    try:
        from xwr import capture, radar
    except ImportError as error:
        raise Sd2Error(f"xwr is not there ({error})", "the package xwr", _INSTALL) from error
    for part in ("DCA1000EVM", "AWR1843"):  # what goes wrong is raised, and need not be printed
        logging.getLogger(f"xwr/{part}").addHandler(logging.NullHandler())
    return capture, radar
