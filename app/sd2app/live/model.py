"""Listening to a radar in a process beside the window, and its recording on screen."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from PySide6.QtCore import QObject

from sd2app.background.latest import delayed
from sd2app.live.process import COMMAND, ListenRequest, SteeredCommand, picture_in
from sd2app.session.content import Content
from sd2app.session.session import Session
from sd2core.errors import Sd2Error
from sd2core.live.counts import Counts
from sd2core.maps import DopplerMap
from sd2core.radar_config import CLUTTER
from sd2core.recording.recording import FILE_NAME, open_recording
from sd2core.timebase import Timebase

_TELL_MS = 100
"""Numbers that change faster cannot be read."""
_LATENCIES = 100


class LiveModel(SteeredCommand):
    """``sd2 listen`` in a process of its own, so that no frame is lost while the window is busy.

    Its ``changed``, of state, counts, level and latency, comes at most ten times a second.

    Its columns are added to the map on screen as they come. Where the user opens another recording
    meanwhile, listening goes on, and :meth:`show` comes back to it.
    """

    first_event = "listening"

    def __init__(self, session: Session, parent: QObject, command: Sequence[str] = COMMAND) -> None:
        super().__init__(parent, command)
        self._session, self._document = session, session.document
        self.counts = Counts()
        self.pictures = self.pictures_dropped = 0  # of the camera
        self.level_db: float | None = None  # of the newest column
        self._map: DopplerMap | None = None
        self._new: list[tuple[float, list[float]]] = []  # columns not on the map yet
        self.received_unix_s = 0.0  # of the newest column
        self._latencies_s: deque[float] = deque(maxlen=_LATENCIES)
        self._reference = 0.0  # that was set here: the strongest bin so far is 0 dB
        self._is_linked = True  # false until the recording names its video
        self._is_shown = True  # false where the recording cannot be read
        self._teller = delayed(self.changed.emit, _TELL_MS, self)
        self._painted = delayed(self._note_latency, 0, self)
        self._document.changed.connect(self._begin_when_open)
        self._document.failed.connect(self._fail_to_open)
        self._document.opened.connect(self._leave_with_recording)

    # --- what is known --------------------------------------------------------------------

    @property
    def on_screen(self) -> bool:
        """True while the recording is the one that is open."""
        recording, request = self._document.recording, self.request
        return recording is not None and request is not None and recording.folder == request.folder

    @property
    def can_be_shown(self) -> bool:
        """True while there is something to show, and something else is open."""
        return self._map is not None and not self.on_screen

    @property
    def can_go_on(self) -> bool:
        """True where it can be listened to again; what was filmed is not continued."""
        ended = self.state in ("stopped", "failed")
        return ended and self.request is not None and not self.request.camera

    @property
    def latency_s(self) -> float | None:
        """Median time from a frame's reception to the screen, of the last hundred."""
        return float(np.median(self._latencies_s)) if self._latencies_s else None

    # --- steering -------------------------------------------------------------------------

    def start(self, request: ListenRequest) -> None:
        """Listen; a recording that is there is opened and continued."""
        if self.busy:
            return
        self.request, self.text, self._map = request, "", None
        self.counts, self.level_db = Counts(), None
        self.pictures = self.pictures_dropped = 0
        self._latencies_s.clear()
        if not (request.folder / FILE_NAME).is_file():
            self._listen()
            return
        self._set_state("opening")
        # Columns are of this filter; the others look ahead, or are the user's choice afterwards.
        self._document.set_clutter(CLUTTER)
        if self.on_screen:
            self._begin_when_open()
        else:
            self._document.open([request.folder])

    def go_on(self) -> None:
        """Listen again to the same, into the same recording."""
        if self.request is not None:
            self.start(self.request)

    def stop(self) -> None:
        """Stop, and keep what was received."""
        if self.state == "opening":
            self._set_state("stopped")
        else:
            super().stop()

    def dismiss(self) -> None:
        """Forget it, once it has ended."""
        if not self.busy:
            self._set_state("idle")

    def _leave_with_recording(self) -> None:
        """Forget what has ended once another recording is open, or none."""
        if not self.on_screen:
            self.dismiss()

    def show(self) -> None:
        """Show the recording again, in place of what was opened meanwhile."""
        if self.can_be_shown and self.busy:
            self._follow()
        elif self.can_be_shown and self.request is not None:
            self._document.open([self.request.folder])

    # --- the process ----------------------------------------------------------------------

    def _begin_when_open(self) -> None:
        """Listen once the recording that is continued is open, with its map."""
        if self.state != "opening" or not self.on_screen or self._document.maps_capture:
            return
        radar_map = self._document.radar_map
        if radar_map is None and self._document.capture is not None:
            return  # about to be made
        if radar_map is not None:
            self._map = radar_map
        self._listen()

    def _fail_to_open(self, reason: str) -> None:
        if self.state == "opening":
            self.text = reason
            self._set_state("failed")

    def _listen(self) -> None:
        assert self.request is not None
        self._new, self._is_shown = [], True
        self._is_linked = not self.request.camera
        self._launch(self.request.words())

    def _taken(self) -> None:
        try:
            self._show_new()
        except (Sd2Error, OSError) as error:
            # Frames are stored all the same.
            self.warned.emit(f"What comes cannot be shown: {error}")
            self._is_shown = False
        if not self._teller.isActive():
            self._teller.start()

    def _take(self, event: dict[str, Any]) -> None:
        match event["event"]:
            case "doubt":
                self.warned.emit(str(event["text"]))
            case "column":
                self._new.append((float(event["time_s"]), list(event["values"])))
                self.level_db = event["level_db"]
                self.received_unix_s = float(event["received_unix_s"])
                self.counts = Counts.of(event)
            case "frames" | "end" | "clocks" | "preview" as kind:
                self.pictures = int(event.get("pictures", self.pictures))
                self.pictures_dropped = int(event.get("pictures_dropped", self.pictures_dropped))
                self._is_linked = bool(event.get("linked", True))
                if kind in ("frames", "end"):
                    self.counts = Counts.of(event)
                elif kind == "preview" and self.on_screen:
                    self._session.video.show_live(picture_in(event))

    def _end(self, code: int, error_text: str) -> None:
        if self.on_screen:
            try:
                self._document.end_growth()
            except (Sd2Error, OSError) as error:
                self.warned.emit(str(error))
            self._show_video()
        super()._end(code, error_text)

    # --- on screen ------------------------------------------------------------------------

    def _show_new(self) -> None:
        """Add the columns that came to the map, and show it."""
        if not self._new or not self._is_shown or not self._is_linked:
            return
        is_first = self._map is None
        before = self._map or self._first_map()
        if before is None:
            return
        self._map, self._new = extended(before, self._new), []
        is_longer = is_first or self._map is not before
        if not (is_first or self.on_screen):
            return
        if is_first or not self._document.growing:
            self._follow()
        elif is_longer:
            self._document.grow(self._map)
        if is_longer:
            self._keep_reference()
            self._painted.start()

    def _show_video(self) -> None:
        """Open what was filmed with its video, unless there are edits that would be lost."""
        assert self.request is not None
        if not self.request.camera or not (self.request.folder / FILE_NAME).is_file():
            return
        if self._document.modified:
            self.warned.emit("Save the recording and open it again: then its video is shown.")
        else:
            self._document.open([self.request.folder])

    def _first_map(self) -> DopplerMap | None:
        """Map of what is stored by now; None before there is something."""
        assert self.request is not None
        if not (self.request.folder / FILE_NAME).is_file():
            return None
        from sd2core.fmcw.processing import doppler_map
        from sd2core.sensor import VelocityAxis

        capture = open_recording(self.request.folder).load_capture()
        return doppler_map(capture, axis=VelocityAxis(), clutter=CLUTTER)

    def _follow(self) -> None:
        """Show the recording, which grows."""
        assert self.request is not None
        assert self._map is not None
        recording = open_recording(self.request.folder)
        timebase = self._map.timebase.shifted(recording.radar_offset_s)
        content = Content(
            recording, timebase, capture=recording.load_every_channel(), radar_map=self._map
        )
        self._document.follow(content)
        # On the newest frame, the clock goes on to those that come.
        self._session.playback.seek_frame(len(self._session.playback.timebase) - 1)
        self._reference = self._session.maps.real.reference

    def _keep_reference(self) -> None:
        """Keep 0 dB at the strongest bin so far, unless the user has set it."""
        real = self._session.maps.real
        if real.map is None or real.reference != self._reference:
            return
        strongest = float(real.map.values[:, -1].max())
        if strongest > self._reference:
            real.set_reference(strongest)
            self._reference = strongest

    def _note_latency(self) -> None:
        """Note how long the newest frame took: the window has just been painted."""
        self._latencies_s.append(time.time() - self.received_unix_s)


def extended(doppler: DopplerMap, columns: Iterable[tuple[float, Sequence[float]]]) -> DopplerMap:
    """Map with columns at its end, each a time in seconds and the values of its bins.

    Those that are not later than the last, or of another number of bins, are left out; without any
    it is the same map.
    """
    times_s, values = [float(doppler.times_s[-1])], []
    for time_s, column in columns:
        if time_s > times_s[-1] and len(column) == doppler.axis.bins:
            times_s.append(time_s)
            values.append(np.array(column, np.float32))
    if not values:
        return doppler
    return replace(
        doppler,
        values=np.column_stack([doppler.values, *values]),
        timebase=Timebase(np.concatenate([doppler.times_s, times_s[1:]])),
        present=None,
    )
