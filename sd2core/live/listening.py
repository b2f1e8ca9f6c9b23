"""Frames of a radar into a recording and a Doppler map, while they come.

They are handed over in a thread of their own, which never waits: a second one stores them, and the
caller's makes the map. Where storing cannot follow and the buffer is full, frames are
dropped and counted; where the caller cannot, their columns are left out of the live map only.
"""

from __future__ import annotations

import queue
import threading
import time
from collections import deque
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sd2core.denoise.resample_to_model import SAME_RATE
from sd2core.errors import Sd2Error
from sd2core.fmcw.chain import ProcessingOptions
from sd2core.fmcw.live import LiveMap
from sd2core.live.counts import Counts
from sd2core.live.reception import Reception
from sd2core.live.recording import GrowingRecording, wall_clock_s
from sd2core.live.sources import Frame
from sd2core.radar_config import CLUTTER, RadarConfig
from sd2core.sensor import VelocityAxis

if TYPE_CHECKING:
    from sd2core.classify.live import TrainedClassifier

_BUFFER_BYTES = 64 << 20
"""Frames that may wait for the disk."""
_MIN_FRAMES = 8
_SHOWN_FRAMES = 32
"""Frames that may wait for the map."""
_KEPT_LATENCIES = 10_000
_GAP_FRAMES = 1.5


class Label(NamedTuple):
    """Answer of a classifier."""

    name: str
    probability: float


class Column(NamedTuple):
    """Column of the live map."""

    time_s: float  # in the recording
    received_unix_s: float  # wall-clock time at which the frame was complete
    values: NDArray[np.float32]  # (bins,)
    label: Label | None

    @property
    def level_db(self) -> float:
        """Power of the column relative to 1, minus infinity where there is none."""
        power = float(self.values.sum(dtype=np.float64))
        return 10.0 * float(np.log10(power)) if power > 0 else -np.inf


class Listening:
    """A radar being recorded, with its live map.

    The recording is closed at the end; the reception goes on. The classifier is asked about every
    column of the map, which then has its axis; its card must be of the radar's frame rate. Raises
    Sd2Error when the radar does not fit the recording or the classifier.
    """

    def __init__(
        self,
        reception: Reception,
        recording: GrowingRecording,
        *,
        classifier: TrainedClassifier | None = None,
    ) -> None:
        source = reception.source
        head = source.head(0.0)
        recording.check(head)
        self.counts = Counts()
        self._reception, self._source, self._recording = reception, source, recording
        self._labeller = None if classifier is None else _Labeller(classifier, head.radar)
        axis = VelocityAxis() if classifier is None else classifier.card.axis
        self._head = head
        self._channel = recording.channel
        like = head.as_capture(np.zeros(head.frame_shape, head.word_type))
        self._map = LiveMap(like.channel(*self._channel), axis, ProcessingOptions(CLUTTER))
        size = max(_BUFFER_BYTES // head.frame_bytes, _MIN_FRAMES)
        self._to_store: queue.Queue[tuple[Frame, int]] = queue.Queue(size)
        self._to_show: queue.Queue[tuple[float, NDArray[Any], Frame]] = queue.Queue(_SHOWN_FRAMES)
        self._dropped = 0  # since the last frame that was taken
        self._ends = threading.Event()
        self._error: BaseException | None = None  # of storing
        self._latencies_s: deque[float] = deque(maxlen=_KEPT_LATENCIES)
        self._last_received_s = time.monotonic()
        self._storing = threading.Thread(target=self._store, name="sd2-store", daemon=True)

    @property
    def axis(self) -> VelocityAxis:
        """Velocity axis of the live map."""
        return self._map.axis

    @property
    def is_over(self) -> bool:
        """True once there are no more columns to come."""
        return not self._storing.is_alive() and self._to_show.empty()

    @property
    def silent_s(self) -> float:
        """Time since the last frame, or the start."""
        return time.monotonic() - self._last_received_s

    @property
    def latencies_s(self) -> list[float]:
        """Times from a frame's last packet to its column, of the last 10,000 columns."""
        return list(self._latencies_s)

    def doubts(self, *, at_end: bool) -> list[str]:
        """Sentences on what looks wrong with source and recording."""
        doubts = self._source.doubts(at_end=at_end)
        if self._recording.times_put_back:
            doubts.append(
                f"{self._recording.folder} was deleted while it was recorded: all that was received"
                " was written there again."
            )
        return doubts

    def start(self) -> None:
        """Begin to listen."""
        self._last_received_s = time.monotonic()
        self._reception.begin(self._take)
        self._storing.start()

    def next_column(self, timeout_s: float) -> Column | None:
        """Column of the next frame; None where none comes within the time.

        Raises what stopped the listening, such as OSError of a full disk.
        """
        try:
            time_s, words, frame = self._to_show.get(timeout=timeout_s)
        except queue.Empty:
            self._check()
            return None
        alone = self._head.as_capture(words)
        values = self._map.column(alone.channel(*self._channel).samples[0:1])
        label = None if self._labeller is None else self._labeller.label(time_s, values)
        self._latencies_s.append(time.monotonic() - frame.received_s)
        return Column(time_s, wall_clock_s(frame.received_s), values, label)

    def stop(self) -> None:
        """Stop, store what was received, and close the recording.

        Raises what kept a frame from being received or stored.
        """
        self._reception.end()
        self._ends.set()
        if self._storing.is_alive():
            self._storing.join()
        self._recording.close(self._dropped)
        self._check()

    def _check(self) -> None:
        if (error := self._error or self._reception.error) is not None:
            raise error

    def _take(self, frame: Frame) -> None:
        """Put a frame into the buffer, or count it as dropped."""
        self._last_received_s = frame.received_s
        self.counts.lost += frame.lost
        try:
            self._to_store.put_nowait((frame, self._dropped))
            self._dropped = 0
        except queue.Full:
            self._dropped += 1
            self.counts.dropped += 1

    def _store(self) -> None:
        try:
            while True:
                no_more = self._ends.is_set() or self._reception.is_over
                try:
                    self._store_one(*self._to_store.get(timeout=0.05))
                except queue.Empty:
                    if no_more:
                        return
        except BaseException as error:  # raised again where it is seen
            self._error = error

    def _store_one(self, frame: Frame, dropped: int) -> None:
        words = self._source.words(frame)
        # Time 0 by the wall clock; of the radar's clock there is no more.
        head = self._source.head(wall_clock_s(frame.received_s) - frame.time_s)
        # Shown before it is stored: a slow disk does not hold the map up.
        time_s = self._recording.time_of(frame.time_s, head)
        try:
            self._to_show.put_nowait((time_s, words, frame))
        except queue.Full:
            self.counts.not_shown += 1
        self._recording.append(words, head, frame, dropped)
        self.counts.recorded += 1
        self.counts.damaged += frame.missing_bytes > 0


class _Labeller:
    """Classifier that is asked about columns; after a gap it begins again."""

    def __init__(self, classifier: TrainedClassifier, radar: RadarConfig) -> None:
        self._classifier = classifier
        self._frame_s = radar.frame_repetition_s
        rate_hz, known_hz = 1.0 / self._frame_s, classifier.card.frame_rate_hz
        if abs(rate_hz / known_hz - 1.0) > SAME_RATE:
            raise Sd2Error(
                f"The radar gives {rate_hz:.4g} frames/s",
                f"{known_hz:.4g} frames/s, for the classifier"
                f" {classifier.card.title or classifier.card.name}",
                "Set the radar to that rate, or label the recording afterwards with"
                " `sd2 classify apply`",
            )
        self._session = classifier.live()
        self._before_s: float | None = None
        self._last: Label | None = None

    def label(self, time_s: float, values: NDArray[np.float32]) -> Label | None:
        """Newest answer after a column; that is to a frame the card's delay before."""
        if self._before_s is not None and time_s - self._before_s > _GAP_FRAMES * self._frame_s:
            self._session = self._classifier.live()
            self._last = None
        self._before_s = time_s
        answers = self._session.advance(values[None])
        if len(answers):
            best = int(answers[-1].argmax())
            self._last = Label(self._classifier.classes[best], float(answers[-1][best]))
        return self._last
