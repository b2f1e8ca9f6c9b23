"""Radars to listen to by name: the program's own, those of plug-ins, and captures replayed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from sd2core.errors import Sd2Error
from sd2core.live.rehearsal import TEST, TEST_RATE_HZ, TestSource
from sd2core.live.sources import DATA_PORT, LOOPBACK, Dca1000Source, ReplaySource, Source
from sd2core.plug_ins import Group

A121 = "a121"
"""Name of Acconeer's sensor."""
TI = "ti"
"""Name of TI's boards with a DCA1000 that are set up and started here."""


@dataclass(frozen=True)
class LiveRadar:
    """A radar that can be listened to.

    Parameters
    ----------
    open : callable
        Makes its :class:`~sd2core.live.sources.Source` of what users type behind the name,
        ``NAME:PLACE`` (empty without it), and of the file of ``--setup`` (None without one).
    """

    open: Callable[[str, Path | None], Source]

    def __post_init__(self) -> None:
        if not callable(self.open):
            raise Sd2Error(f"The way to open a radar is {self.open!r}", "a function")


LIVE_RADARS = Group("live_radars", LiveRadar, (TEST, A121, TI))
"""Radars to listen to of other packages."""


def open_radar(name: str, setup: Path | None = None) -> Source:
    """Radar by name, a DCA1000 by this computer's address, or a capture or recording to replay.

    Parameters
    ----------
    name : str
        ``test`` or ``test:RATE``, ``a121``, ``ti`` or a plug-in's, each with ``:PLACE`` behind it
        or not; with a set-up ``ADDRESS[:PORT]``; or a file.
    setup : path, optional
        What the radar runs with.

    Raises
    ------
    Sd2Error
        If there is no such radar.
    """
    word, _, place = name.partition(":")
    if word == TEST and (not place or place.isdecimal()):
        return TestSource(float(place or TEST_RATE_HZ))
    if word == A121:
        from sd2core.live.a121 import A121Source

        return A121Source(place, setup)
    if word == TI:
        from sd2core.live.ti import TiSource

        return TiSource(place, setup)
    if (plug_in := LIVE_RADARS.find(word)) is not None:
        return plug_in.use(lambda radar: radar.open(place, setup), Source)
    if setup is not None:
        return dca1000(name, setup)
    if not Path(name).exists():
        known = ", ".join((TEST, A121, TI, *LIVE_RADARS.names()))
        raise Sd2Error(
            f"{name} is no radar, and no file",
            f"{known}; or a capture or recording to replay",
            "Say --setup with the address of this computer that a DCA1000 sends to",
        )
    return replayed(Path(name))


def replayed(path: Path) -> Source:
    """Capture, or the one of a recording, at its own rate."""
    from sd2core.recording.recording import is_recording, open_recording

    return ReplaySource(open_recording(path).load_capture() if is_recording(path) else path)


def dca1000(place: str, setup: Path) -> Source:
    """DCA1000 that sends to ``ADDRESS[:PORT]``."""
    address, _, port = place.partition(":")
    if port and not (port.isascii() and port.isdigit()):
        raise Sd2Error(f"The port is {port!r}", "a number, as in 192.168.33.30:4098")
    return Dca1000Source(setup, address or LOOPBACK, int(port) if port else DATA_PORT)
