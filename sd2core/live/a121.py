"""Acconeer's A121 while it runs, by Acconeer's exploration tool in a process of its own.

The tool needs other versions of packages than this program; ``SD2_A121_PYTHON`` names the Python
that has it, and the process is :mod:`sd2core.live.a121_client`.
"""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.files.texts import errors_in, read_json
from sd2core.io.radar.acconeer import PULSE_WIDTHS_M, a121_radar
from sd2core.io.radar.growing import GrowingHead
from sd2core.live import a121_client
from sd2core.live.sources import Frame, Source, Take
from sd2core.processes import end_beside

PYTHON = "SD2_A121_PYTHON"
"""Environment variable that names the Python with the exploration tool."""

_INSTALL = (
    "Install acconeer-exptool in a Python environment of its own, and name that Python in"
    f" {PYTHON}; check that the sensor is plugged in"
)
_END_S = 5.0
_SESSION: dict[str, Any] = {
    "sweep_rate": 2400.0, "frame_rate": 25.0, "sweeps_per_frame": 32,
    "subsweeps": [
        {
            "start_point": 120, "num_points": 40, "step_length": 24, "hwaas": 8,
            "profile": "PROFILE_3",
        }
    ],
}  # fmt: skip
"""One person from 0.3 to 2.6 m, up to 3 m/s, where no session is given."""


class A121Source(Source):
    """Frames of an A121.

    Parameters
    ----------
    place : str
        IP address or serial port, ``usb``, or ``mock``; empty: wherever the tool finds it.
    session : path, optional
        Session of the exploration tool as JSON, of one sensor.

    Raises
    ------
    Sd2Error
        If the tool or the sensor is not there, or the session is none.
    """

    def __init__(self, place: str = "", session: Path | None = None) -> None:
        chosen = {"groups": [{"1": _SESSION}]} if session is None else read_json(session)
        self._saturated = 0
        self._process = subprocess.Popen(
            [os.environ.get(PYTHON, sys.executable), a121_client.__file__],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            start_new_session=True,  # Ctrl-C is for the one that listens, who ends it
        )
        try:
            settings = json.dumps({"place": place, "session": json.dumps(chosen)})
            with contextlib.suppress(OSError):  # it has ended; its answer is missing below
                self._input.write(settings.encode() + b"\n")
                self._input.flush()
            self._head, self.delay_s = self._described(self._next_message(), session)
        except BaseException:
            self.close()
            raise
        self.about = self._head.radar.name

    def head(self, start_unix_s: float) -> GrowingHead:
        """Description of the frames."""
        return self._head.model_copy(update={"start_unix_s": start_unix_s})

    def run(self, take: Take, stop: threading.Event) -> None:
        """Hand frames over until ``stop`` is set."""
        threading.Thread(target=self._end_after, args=(stop,), daemon=True).start()
        size, first_s = self._head.frame_bytes, None
        while len(read := self._output.read(a121_client.HEAD.size)) == a121_client.HEAD.size:
            failed, saturated, time_s, received_s = a121_client.HEAD.unpack(read)
            if failed:
                self._next_message()
            if len(content := self._output.read(size)) < size:
                break
            first_s = time_s if first_s is None else first_s
            self._saturated += saturated
            take(Frame(content, time_s - first_s, received_s))
        if not stop.is_set():
            raise Sd2Error("The exploration tool has ended", "a sensor that goes on", _INSTALL)

    def words(self, frame: Frame) -> NDArray[Any]:
        """Words of a frame, as they came."""
        return np.frombuffer(frame.content, "<i2").reshape(self._head.frame_shape)

    def doubts(self, *, at_end: bool) -> list[str]:
        """Whether the sensor is driven too far."""
        if not self._saturated:
            return []
        return [f"The sensor was saturated in {self._saturated:,} frames: lower its gain."]

    def silence(self) -> str:
        """Advice for when nothing comes."""
        return "Nothing comes from the A121: is it plugged in, and does no other program use it?"

    def close(self) -> None:
        """End the process."""
        end_beside(self._process, _END_S)
        self._output.close()

    @property
    def _input(self) -> Any:
        return self._process.stdin

    @property
    def _output(self) -> Any:
        return self._process.stdout

    def _end_after(self, stop: threading.Event) -> None:
        """End the process, so that no frame is waited for that does not come."""
        stop.wait()
        end_beside(self._process, _END_S)

    def _next_message(self) -> dict[str, Any]:
        """A line of JSON of the process; Sd2Error if it says that something failed."""
        line = self._output.readline()
        message: dict[str, Any] = json.loads(line) if line else {"failed": "it ended at once"}
        if "failed" in message:
            raise Sd2Error(
                f"Acconeer's exploration tool cannot measure ({message['failed']})",
                "an A121 that it finds",
                _INSTALL,
            )
        return message

    def _described(self, setup: dict[str, Any], session: Path | None) -> tuple[GrowingHead, float]:
        """Head of the frames, and the delay of half a burst of sweeps."""
        named = "the usual session" if session is None else session.name
        with errors_in(session or Path(named)):
            if not setup["frame_rate_hz"]:
                raise Sd2Error("The session states no frame rate", "frame_rate")
            radar = a121_radar(
                tuple(setup["ranges_m"]),
                max(PULSE_WIDTHS_M[one] for one in setup["profiles"]),
                setup["sweeps"],
                setup["sweep_s"],
                1.0 / setup["frame_rate_hz"],
            )
        head = GrowingHead(
            radar=radar,
            word="int16",
            full_scale_known=False,
            source=f"A121, configured by {named}",
            notes=(
                "Assumed: the phase grows with the distance, as in the exploration tool; walk"
                " towards the sensor to check.",
            ),
            start_unix_s=0.0,
        )
        return head, 0.5 * setup["sweeps"] * setup["sweep_s"]
