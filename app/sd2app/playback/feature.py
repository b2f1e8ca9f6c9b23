"""The clock in the window: playing, stepping, and the time axis."""

from __future__ import annotations

from collections.abc import Sequence

from sd2app.feature import Action, Feature
from sd2app.session.session import Session


class PlaybackFeature(Feature):
    """Actions of the clock and of the time window."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self.changing = (session.playback.playing_changed, session.playback.loop_changed)

    def actions(self) -> Sequence[Action]:
        """Play, step, speed, zoom."""
        s = self._session
        playback, span, enabled = s.playback, s.span, s.has_content
        return (
            Action(
                "play", "Play", "Play", ("Space",), "Play or pause", playback.toggle, enabled,
                lambda: playback.playing, icon="play",
            ),
            Action(
                "previous_frame", "Play", "Previous frame", ("Left",), "One frame back",
                lambda: playback.step_frames(-1), enabled, icon="previous",
            ),
            Action(
                "next_frame", "Play", "Next frame", ("Right",), "One frame on",
                lambda: playback.step_frames(1), enabled, icon="next",
            ),
            Action(
                "back_second", "Play", "Back one second", ("Shift+Left",), "One second back",
                lambda: playback.step_seconds(-1.0), enabled,
            ),
            Action(
                "on_second", "Play", "On one second", ("Shift+Right",), "One second on",
                lambda: playback.step_seconds(1.0), enabled,
            ),
            Action(
                "first_frame", "Play", "First frame", ("Home", "Ctrl+Left"), "Go to the start",
                lambda: playback.seek_frame(0), enabled, icon="first",
            ),
            Action(
                "last_frame", "Play", "Last frame", ("End", "Ctrl+Right"), "Go to the end",
                lambda: playback.seek_frame(len(playback.timebase) - 1), enabled, icon="last",
            ),
            Action(
                "slower", "Play", "Slower", (",",), "Play slower",
                lambda: playback.change_speed(-1), icon="slower",
            ),
            Action(
                "faster", "Play", "Faster", (".",), "Play faster",
                lambda: playback.change_speed(1), icon="faster",
            ),
            Action(
                "loop", "Play", "Loop", ("L",), "Start again at the end",
                lambda: playback.set_loop(not playback.loop),
                checked=lambda: playback.loop, icon="loop",
            ),
            Action(
                "zoom_in", "View", "Zoom in on time", ("+", "="),
                "Show less time, around the cursor",
                lambda: span.zoom(0.7, playback.time_s), enabled,
            ),
            Action(
                "zoom_out", "View", "Zoom out", ("-",), "Show more time",
                lambda: span.zoom(1.0 / 0.7, playback.time_s), enabled,
            ),
            Action(
                "zoom_fit", "View", "Whole recording", ("0",), "Show all of it", span.fit, enabled
            ),
        )  # fmt: skip
