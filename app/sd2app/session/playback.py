"""The one clock of the window."""

from __future__ import annotations

from PySide6.QtCore import QElapsedTimer, QObject, Qt, QTimer, Signal

from sd2core.timebase import Timebase

SPEEDS = (0.1, 0.25, 0.5, 1.0, 1.5, 2.0, 4.0)
_TICK_MS = 5


class PlaybackModel(QObject):
    """Time, play state, speed, loop, and the half-open time range that is repeated.

    Its values are changed by its methods only, which tell so by a signal. The frame on screen
    follows from elapsed time, so a late frame is dropped rather than slowing the clock.
    """

    frame_changed = Signal(int)
    playing_changed = Signal(bool)
    speed_changed = Signal(float)
    loop_changed = Signal(bool)
    stretch_changed = Signal()

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.timebase = Timebase([0.0])  # frames that the clock steps through
        self.time_s = 0.0  # on screen: always the time of a frame while paused
        self.frame = 0  # of the timebase, on screen
        self.speed = 1.0  # seconds of recording per second
        self.loop = False  # start again at the end
        self.stretch_s: tuple[float, float] | None = None  # repeated until one seeks beyond it
        self._origin_s = 0.0
        self._elapsed = QElapsedTimer()
        self._timer = QTimer(self)
        self._timer.setTimerType(Qt.TimerType.PreciseTimer)
        self._timer.setInterval(_TICK_MS)
        self._timer.timeout.connect(self._tick)

    @property
    def playing(self) -> bool:
        """True while the clock runs."""
        return self._timer.isActive()

    def set_timebase(self, timebase: Timebase) -> None:
        """Clock another recording, from its first frame."""
        self.pause()
        self.set_stretch(None)
        self.timebase = timebase
        self._move_to(timebase.start_s, force=True)

    def extend(self, timebase: Timebase) -> None:
        """Clock the same recording with more frames; on its last one, go on to the newest."""
        at_end = self.frame >= len(self.timebase) - 1
        self.timebase = timebase
        if not self.playing:
            self._move_to(timebase.time_of(len(timebase) - 1 if at_end else self.frame))

    def play(self) -> None:
        """Run from here, or from the start when at the end."""
        if self.playing or len(self.timebase) < 2:
            return
        if self.frame >= len(self.timebase) - 1:
            self._move_to(self.stretch_s[0] if self.stretch_s else self.timebase.start_s)
        self._restart_clock()
        self._timer.start()
        self.playing_changed.emit(True)

    def play_stretch(self, start_s: float, end_s: float) -> None:
        """Repeat a time range from its start."""
        self.set_stretch((start_s, end_s))
        self.seek(start_s)
        self.play()

    def set_stretch(self, stretch_s: tuple[float, float] | None) -> None:
        """Repeat this time range from now on, or none."""
        if stretch_s != self.stretch_s:
            self.stretch_s = stretch_s
            self.stretch_changed.emit()

    def pause(self) -> None:
        """Stop on the frame that is on screen."""
        if not self.playing:
            return
        self._timer.stop()
        self._move_to(self.timebase.time_of(self.frame))
        self.playing_changed.emit(False)

    def toggle(self) -> None:
        """Play or pause."""
        if self.playing:
            self.pause()
        else:
            self.play()

    def seek(self, time_s: float) -> None:
        """Show the frame at ``time_s``, held inside the recording."""
        self.seek_frame(self.timebase.frame_at(time_s))

    def seek_frame(self, frame: int) -> None:
        """Show ``frame``, held inside the recording."""
        frame = min(max(frame, 0), len(self.timebase) - 1)
        time_s = self.timebase.time_of(frame)
        # Its first frame may have begun before it.
        if self.stretch_s is not None and not (
            self.timebase.frame_at(self.stretch_s[0]) <= frame and time_s < self.stretch_s[1]
        ):
            self.set_stretch(None)
        self._move_to(time_s)
        self._restart_clock()

    def step_frames(self, count: int) -> None:
        """Pause and go ``count`` frames on (or back)."""
        self.pause()
        self.seek_frame(self.frame + count)

    def step_seconds(self, seconds: float) -> None:
        """Go ``seconds`` on (or back)."""
        self.seek(self.time_s + seconds)

    def change_speed(self, steps: int) -> None:
        """Go ``steps`` along :data:`SPEEDS`."""
        index = min(max(SPEEDS.index(self.speed) + steps, 0), len(SPEEDS) - 1)
        if SPEEDS[index] != self.speed:
            self.speed = SPEEDS[index]
            self._restart_clock()
            self.speed_changed.emit(self.speed)

    def set_loop(self, loop: bool) -> None:
        """Start again at the end, or stop there."""
        if loop != self.loop:
            self.loop = loop
            self.loop_changed.emit(loop)

    def _restart_clock(self) -> None:
        self._origin_s = self.time_s
        self._elapsed.start()

    def _tick(self) -> None:
        time_s = self._origin_s + self._elapsed.nsecsElapsed() * 1e-9 * self.speed
        start_s, end_s = self.stretch_s or (self.timebase.start_s, self.timebase.end_s)
        if time_s < end_s:
            self._move_to(time_s)
        elif self.loop or self.stretch_s is not None:
            self._move_to(start_s + (time_s - start_s) % (end_s - start_s))
            self._restart_clock()
        else:
            self.pause()
            self.seek_frame(len(self.timebase) - 1)

    def _move_to(self, time_s: float, force: bool = False) -> None:
        frame = self.timebase.frame_at(time_s)
        self.time_s = time_s
        if frame != self.frame or force or not self.playing:
            self.frame = frame
            self.frame_changed.emit(frame)
