"""A radar that is received without a pause, whatever becomes of its frames."""

from __future__ import annotations

import math
import threading
import time
from array import array
from dataclasses import replace

import numpy as np

from sd2core.live.clocks import fit_line
from sd2core.live.sources import Frame, Source, Take

_SETTLE_S = 0.5
"""By then, what had arrived when a take ended has been handed over, or never will be."""


class Reception:
    """A source's frames, received in a thread of their own: handed to a take, and let go between.

    Each take begins at its own time 0; the source's clock is known by all frames since it began.

    Parameters
    ----------
    source : Source
        Is begun by the first take, and closed by :meth:`close`.
    """

    def __init__(self, source: Source) -> None:
        self.source = source
        self._lock = threading.Lock()
        self._take: Take | None = None  # that is recorded
        self._first_s = math.nan  # time of its first frame
        self._end_s = math.inf  # when it was to end
        self._has_settled = threading.Event()
        self._clock = array("d")  # time and arrival of every frame
        self._stop = threading.Event()
        self.error: BaseException | None = None  # that has stopped the source
        self._thread = threading.Thread(target=self._receive, name="sd2-reception", daemon=True)

    @property
    def is_over(self) -> bool:
        """True once the source gives no more."""
        return self._thread.ident is not None and not self._thread.is_alive()

    @property
    def rate(self) -> float:
        """Seconds of this computer per second of the source, see :func:`fit_line`."""
        with self._lock:
            times_s, arrivals_s = np.array(self._clock).reshape(-1, 2).T
        return fit_line(times_s, arrivals_s).rate

    def begin(self, take: Take) -> None:
        """Hand over the frames that arrive from now on, as a source does, until :meth:`end`."""
        with self._lock:
            self._take, self._first_s, self._end_s = take, math.nan, math.inf
        self._has_settled.clear()
        if self._thread.ident is None:
            self._thread.start()

    def end(self) -> None:
        """Hand over what has arrived by now, and nothing more."""
        self._end_s = time.monotonic()
        if self._thread.is_alive():
            self._has_settled.wait(_SETTLE_S)
        with self._lock:
            self._take = None

    def close(self) -> None:
        """End the source, and free what it holds."""
        self._stop.set()
        if self._thread.ident is not None:
            self._thread.join()
        self.source.close()

    def _receive(self) -> None:
        try:
            self.source.run(self._hand_over, self._stop)
        except BaseException as error:  # raised again where it is seen
            self.error = error

    def _hand_over(self, frame: Frame) -> None:
        with self._lock:
            self._clock.extend((frame.time_s, frame.received_s))
            if frame.received_s > self._end_s:
                self._has_settled.set()
            elif self._take is not None:
                is_first = math.isnan(self._first_s)
                if is_first:
                    self._first_s = frame.time_s
                lost = 0 if is_first else frame.lost  # what was lost before is of no take
                self._take(replace(frame, time_s=frame.time_s - self._first_s, lost=lost))
