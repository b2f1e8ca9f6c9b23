"""The fit that is offered, under way, stopped, failed or done: one line over the window."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QProgressBar, QToolButton, QWidget

from sd2app.fit.clock import FitPlayback
from sd2app.fit.model import FitModel
from sd2app.fit.offer import FitOffer
from sd2app.fit.progress import left_in_words
from sd2app.widgets.panel import ElidedLabel

_STEPS = 1000
_HEIGHT = 40
"""Height in all states, so that the view below does not move."""


class FitBar(QFrame):
    """Offer, progress and end of a fit; hidden otherwise.

    ``begin`` asks for what a new fit needs, ``open_result`` opens the recording of a finished
    fit, ``resume`` continues a stopped one.
    """

    def __init__(
        self,
        fit: FitModel,
        follower: FitPlayback,
        offer: FitOffer,
        begin: Callable[[], None],
        open_result: Callable[[], None],
        resume: Callable[[], None],
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self.setObjectName("panel")
        self.setAccessibleName("Fit of a body")
        self.setMinimumHeight(_HEIGHT)
        self._fit, self._follower, self._offer = fit, follower, offer
        self._title = ElidedLabel(self)
        self._title.setObjectName("title")
        self._stage = ElidedLabel(self)
        self._stage.setObjectName("muted")
        self._reason = QLabel(self)
        self._reason.setObjectName("warning")
        self._reason.setWordWrap(True)
        self._reason.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self._bar = QProgressBar(self)
        self._bar.setFixedWidth(200)
        self._bar.setMaximumHeight(14)
        self._bar.setTextVisible(False)
        self._left = QLabel(self)
        self._left.setObjectName("muted")
        self._left.setMinimumWidth(self._left.fontMetrics().horizontalAdvance("about 55 min left"))
        self._buttons = {
            "begin": self._button("Fit a body…", "Choose person, height and place", begin),
            "follow": self._button("Follow", "Show each frame as it is worked on", self._toggle),
            "cancel": self._button("Cancel", "Stop; what is done can be continued", fit.cancel),
            "resume": self._button("Resume", "Continue where it stopped", resume),
            "discard": self._button("Discard", "Remove what was done", fit.discard),
            "open": self._button("Open", "Open the new recording", open_result),
            "close": self._button("✕", "Close this message", self._close),
        }
        self._buttons["follow"].setCheckable(True)
        self._lay_out()
        for signal in (fit.changed, follower.changed, offer.changed):
            signal.connect(self._refresh)
        self._refresh()

    def _lay_out(self) -> None:
        layout = QHBoxLayout(self)
        layout.setContentsMargins(12, 4, 4, 4)
        layout.setSpacing(8)
        layout.addWidget(self._title)
        layout.addWidget(self._reason, 1)
        layout.addWidget(self._stage, 1)
        layout.addWidget(self._bar)
        layout.addWidget(self._left)
        for button in self._buttons.values():
            layout.addWidget(button)

    def _button(self, text: str, tip: str, run: Callable[[], object]) -> QToolButton:
        button = QToolButton(self)
        button.setText(text)
        button.setToolTip(tip)
        button.setAccessibleName(tip)
        button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        if text != "✕":
            button.setObjectName("outlined")
        button.clicked.connect(lambda: run())
        return button

    # --- following the models -------------------------------------------------------------

    def _refresh(self) -> None:
        state = self._fit.state
        shown = {
            "idle": {"begin", "close"},
            "running": {"follow", "cancel"},
            "cancelling": {"follow", "cancel"},
            "stopped": {"begin", "resume", "discard", "close"},
            "failed": {"begin", "resume", "close"},
            "finished": {"open", "close"},
        }[state]
        for name, button in self._buttons.items():
            button.setVisible(name in shown)
        self._buttons["begin"].setText("Fit a body…" if state == "idle" else "Change…")
        self._buttons["resume"].setText("Try again" if state == "failed" else "Resume")
        self._bar.setVisible(self._fit.busy)
        self._left.setVisible(self._fit.busy)
        self._reason.setVisible(state == "failed")
        self._stage.setVisible(state != "failed")
        if state == "idle":
            self._show_offer()
        else:
            self._show_fit()
        self.setVisible(state != "idle" or self._offer.video is not None)

    def _show_offer(self) -> None:
        video = self._offer.video
        if video is not None:
            self._title.setText(f"{video.name} has no mesh")
            self._stage.setText("A body can be fitted to the person in it.")

    def _show_fit(self) -> None:
        request, state = self._fit.request, self._fit.state
        assert request is not None
        name = request.video.name
        self._title.setText(
            {
                "running": f"Fitting a body to {name}",
                "cancelling": "Cancelling…",
                "stopped": f"The fit of {name} was stopped",
                "failed": f"The fit of {name} failed",
                "finished": f"{request.folder.name} is ready",
            }[state]
        )
        self._stage.setText(self._stage_text())
        self._reason.setText(self._fit.text)
        self._buttons["cancel"].setEnabled(state == "running")
        self._buttons["follow"].setChecked(self._follower.following)
        self._buttons["follow"].setEnabled(self._follower.on_screen)
        self._show_progress()

    def _stage_text(self) -> str:
        progress, state = self._fit.progress, self._fit.state
        if state == "finished":
            return " ".join(self._fit.notes) or "A body was fitted to its video."
        if state == "stopped":
            reached = f" It had been {progress.text}." if progress and progress.stage else ""
            return f"It can be continued where it stopped.{reached}"
        return progress.text if progress is not None else ""

    def _show_progress(self) -> None:
        progress = self._fit.progress
        share = progress.share if progress is not None else None
        if share is None and progress is not None and progress.total:
            share = progress.done / progress.total  # the models, before the video is open
        # Without a maximum the bar says that it is busy.
        self._bar.setRange(0, 0 if share is None else _STEPS)
        if share is not None:
            self._bar.setValue(round(share * _STEPS))
        running = self._fit.state == "running" and progress is not None
        self._left.setText(left_in_words(progress.left_s) if running and progress else "")

    # --- what is clicked ------------------------------------------------------------------

    def _toggle(self) -> None:
        self._follower.set_following(self._buttons["follow"].isChecked())

    def _close(self) -> None:
        if self._fit.state == "idle":
            self._offer.decline()
        else:
            self._fit.dismiss()
