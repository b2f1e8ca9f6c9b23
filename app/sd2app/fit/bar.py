"""A notice that offers a fit, and a line about the one under way, stopped, failed or done."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtWidgets import QLabel

from sd2app.fit.model import FitModel
from sd2app.fit.on_screen import FitOnScreen
from sd2app.widgets.notices import Notice
from sd2app.widgets.panel import ElidedLabel, ProgressBar, StateBar, sentence
from sd2app.widgets.text import about

_STATES = {
    "running": ("Fitting a body to {video}", ("follow", "cancel")),
    "cancelling": ("Cancelling…", ("follow", "cancel")),
    "stopped": ("The fit of {video} was stopped", ("change", "resume", "discard", "close")),
    "failed": ("The fit of {video} failed", ("change", "resume", "close")),
    "finished": ("{made} is ready", ("open", "close")),
}
"""What a fit's state is called, and the buttons that are of use then."""


class FitOffer(Notice):
    """Offers to fit a body where there is a video and no mesh; ``begin`` asks what it needs."""

    def __init__(self, on_screen: FitOnScreen, begin: Callable[[], None]) -> None:
        tip = "Choose person, height and place"
        buttons = (("begin", "Fit a body…", tip, begin),)
        super().__init__("Offer of a fit", buttons, on_screen.decline)
        self._on_screen = on_screen
        on_screen.changed.connect(self._refresh)

    def _refresh(self) -> None:
        video = self._on_screen.offered
        if video is None:
            self.show_words("", "")
        else:
            text = "A body can be fitted to the person in it."
            self.show_words(f"{video.name} has no mesh", text)


class FitBar(StateBar):
    """Progress and end of a fit; hidden otherwise.

    ``change`` asks again for what a fit needs, ``open_result`` opens the recording of a finished
    fit, ``resume`` continues a stopped one, ``discard`` asks if it may be deleted.
    """

    def __init__(
        self,
        fit: FitModel,
        on_screen: FitOnScreen,
        change: Callable[[], None],
        open_result: Callable[[], None],
        resume: Callable[[], None],
        discard: Callable[[], None],
    ) -> None:
        super().__init__("Fit of a body")
        self._fit, self._on_screen = fit, on_screen
        self._title = ElidedLabel(self, "title")
        self._stage = ElidedLabel(self, "muted")
        self._reason = sentence("", "warning")
        self._bar = ProgressBar("", width_px=200)
        self._left = QLabel(self)
        self._left.setObjectName("muted")
        self._left.setMinimumWidth(self._left.fontMetrics().horizontalAdvance("about 55 min left"))
        buttons = {
            # First, so that it never comes to where another button was.
            "discard": ("Discard…", "Delete what was done", discard),
            "change": ("Change…", "Choose person, height and place again", change),
            "follow": ("Follow", "Show each frame as it is worked on", self._follow),
            "cancel": ("Cancel", "Stop; what is done can be continued", fit.cancel),
            "resume": ("Resume", "Continue where it stopped", resume),
            "open": ("Open", "Open the new recording", open_result),
            "close": ("✕", "Close this message", fit.dismiss),
        }
        parts = (self._title, (self._reason, 1), (self._stage, 1), self._bar, self._left)
        self.lay_out(parts, buttons, spacing_px=8)
        self._buttons["follow"].setCheckable(True)
        on_screen.changed.connect(self._refresh)
        self._refresh()

    # --- following the models -------------------------------------------------------------

    def _refresh(self) -> None:
        fit, state, request = self._fit, self._fit.state, self._fit.request
        self.setVisible(state != "idle")
        if state == "idle" or request is None:
            return
        words, buttons = _STATES[state]
        self.show_buttons(buttons)
        self._title.setText(words.format(video=request.video.name, made=request.folder.name))
        self._stage.setText(self._stage_text())
        self._reason.setText(fit.text)
        self._reason.setVisible(state == "failed")
        self._stage.setVisible(state != "failed")
        self._buttons["resume"].setText("Try again" if state == "failed" else "Resume")
        self._buttons["cancel"].setEnabled(state == "running")
        self._buttons["follow"].setChecked(self._on_screen.following)
        self._buttons["follow"].setEnabled(self._on_screen.visible)
        self._bar.setVisible(fit.busy)
        self._left.setVisible(fit.busy)
        self._show_progress()

    def _stage_text(self) -> str:
        progress, state = self._fit.progress, self._fit.state
        if state == "finished":
            return self._fit.notes or "A body was fitted to its video."
        if state == "stopped":
            reached = f" It had been {progress.text}." if progress and progress.stage else ""
            return f"It can be continued where it stopped.{reached}"
        return progress.text if progress is not None else ""

    def _show_progress(self) -> None:
        progress = self._fit.progress
        share = progress.share if progress is not None else None
        if share is None and progress is not None and progress.total:
            share = progress.done / progress.total  # the models, before the video is open
        self._bar.show_share(share)
        left_s = progress.left_s if progress and self._fit.state == "running" else None
        self._left.setText("" if left_s is None else f"{about(left_s)} left")

    def _follow(self) -> None:
        self._on_screen.set_following(self._buttons["follow"].isChecked())
