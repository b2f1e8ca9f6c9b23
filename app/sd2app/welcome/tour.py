"""The tour of the sample: steps that point at a thing and wait until the hand has done it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from operator import gt as shrank
from operator import lt as grew
from typing import Any

from PySide6.QtCore import QObject, QTimer, Signal

from sd2app.background.latest import delayed
from sd2app.denoise.model import DenoiseModel
from sd2app.feature import always
from sd2app.labels.model import LabelsModel
from sd2app.maps.difference import DifferenceModel
from sd2app.session.session import Session
from sd2app.settings import Settings
from sd2app.suggestions.model import SuggestionsModel
from sd2app.training.model import TrainingModel
from sd2app.training.result import ModelAdoption

_LOOK_MS = 150
_PRAISE_MS = 900
"""Time for which a step is seen to be done before the next."""
_STEP = "tour/step"


@dataclass(frozen=True)
class Step:
    """Step of the tour, in words and as a question to the models.

    ``targets`` are accessible names of what to point at, the first that is on screen.
    ``reached`` compares ``state`` as it was at the start of the step with what it is now.
    Names of actions in braces stand for their keys. Without what it ``needs``, the step before
    is to be done again.
    """

    title: str
    words: str
    targets: tuple[str, ...]
    state: Callable[[], Any]
    reached: Callable[[Any, Any], bool]
    needs: Callable[[], bool] = always


class TourModel(QObject):
    """Place in the tour, kept in the settings, so that it goes on where it was left.

    ``can_show`` tells if the sample is open, ``open_sample`` opens it; without it the tour rests.
    """

    changed = Signal()

    def __init__(
        self,
        steps: Sequence[Step],
        settings: Settings,
        can_show: Callable[[], bool],
        open_sample: Callable[[], object],
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self.steps = tuple(steps)
        self._settings, self._can_show, self._open_sample = settings, can_show, open_sample
        self.wanted = False  # the user takes the tour now
        self.done = False  # the step on screen was just done
        self.over = False  # the last one was
        self._before: Any = None
        self._looking = QTimer(self, interval=_LOOK_MS)
        self._looking.timeout.connect(self.look)
        self._praise = delayed(self.skip, _PRAISE_MS, self)

    @property
    def kept(self) -> int:
        """Number of the step to go on with, from 0."""
        stored = self._settings.stored(_STEP, 0)
        return stored if 0 <= stored < len(self.steps) else 0

    @property
    def step(self) -> Step | None:
        """Step on screen; None while the tour rests."""
        return self.steps[self.kept] if self.wanted and not self.over and self._can_show() else None

    def begin(self) -> None:
        """Take the tour, or go on with it, on the sample."""
        self.wanted, self.over = True, False
        if self._can_show():
            self._enter()
        else:
            self._open_sample()

    def follow_document(self) -> None:
        """Go on where the sample has been opened; rest where something else was."""
        if self.wanted and self._can_show():
            self._enter()
        elif self.wanted:
            self.leave()

    def leave(self) -> None:
        """Let the tour rest, for later."""
        self.wanted = self.over = self.done = False
        self._looking.stop()
        self._praise.stop()
        self.changed.emit()

    def skip(self) -> None:
        """Go to the next step that has what it needs, or end the tour."""
        if not self.wanted:
            return
        later = range(self.kept + 1, len(self.steps))
        number = next((one for one in later if self.steps[one].needs()), None)
        self.over = number is None
        self._settings.set_value(_STEP, number or 0)
        self._enter()

    def back(self) -> None:
        """Go to the step before."""
        self._settings.set_value(_STEP, max(self.kept - 1, 0))
        self._enter()

    def look(self) -> None:
        """Find out if the step was done."""
        step = self.step
        if step is not None and not self.done and step.reached(self._before, step.state()):
            self.done = True
            self._praise.start()
            self.changed.emit()

    def _enter(self) -> None:
        while self.kept and not self.steps[self.kept].needs():
            self._settings.set_value(_STEP, self.kept - 1)
        self.done = False
        self._praise.stop()
        step = self.step
        if step is None:
            self._looking.stop()
        else:
            self._before = step.state()
            self._looking.start()
        self.changed.emit()


def tour_steps(
    session: Session,
    labels: LabelsModel,
    denoise: DenoiseModel,
    difference: DifferenceModel,
    suggestions: SuggestionsModel,
    training: TrainingModel,
    adoption: ModelAdoption,
) -> tuple[Step, ...]:
    """Steps over the models of the window; each ends by what the hand has done to them."""
    playback, sensor = session.playback, session.sensor

    def labelled() -> int:
        return len(labels.labels.decided)

    def rest_s() -> float | None:
        return None if playback.playing else playback.time_s

    def in_gesture() -> float | None:
        """The time on screen at rest, where a label says that there is a gesture."""
        now_s = rest_s()
        spans = labels.labels.spans
        within = now_s is not None and any(one.start_s <= now_s < one.end_s for one in spans)
        return now_s if within else None

    def place() -> object:
        return None if sensor.dragging else sensor.sensor.position_m

    def moved(before: object, now: object) -> bool:
        return now is not None and now != before

    return (
        Step(
            "Play it",
            "{play} plays, and stops again. Video, body and maps run on one clock.",
            ("Video",), rest_s, moved,
        ),
        Step(
            "Find a gesture",
            "An arch in this map is a swipe: the hand comes nearer, above zero, and goes away,"
            " below. Click into one; the labels at the bottom say where they are.",
            ("Synthetic map",), in_gesture, moved,
        ),
        Step(
            "Move the radar",
            "Drag the sensor in this view to the side of the body, and let go. The synthetic"
            " map follows: it is what a radar there would see.",
            ("Scene",), place, moved,
        ),
        Step(
            "Take it back",
            "{undo} puts the sensor where it was. Everything that you change can be undone.",
            ("Scene",), place, moved, lambda: session.document.undo_stack.canUndo(),
        ),
        Step(
            "Denoise with another model",
            "A network makes of the synthetic map what a radar would show, noise and all."
            " Click here and choose another one.",
            ("Denoiser:", "Denoised map"), lambda: denoise.card and denoise.card.path, moved,
        ),
        Step(
            "Compare with the radar",
            "{difference} shows where the denoised map and the radar's differ.",
            ("Real map", "Denoised map"), lambda: difference.shown, grew,
        ),
        Step(
            "Take a label away",
            "Click the second labelled span, and press {delete_spans}. You will find it again.",
            ("Labels",), labelled, shrank,
        ),
        Step(
            "Find it again",
            "{find_gestures} lets the classifier that comes with SD² Studio look for gestures."
            " What it finds is suggested, dashed.",
            ("Suggestions", "Labels"), lambda: len(suggestions.pending), grew,
        ),
        Step(
            "Decide",
            "{accept_suggestion} accepts the suggestion, {reject_suggestion} rejects it; the key"
            " of a label accepts it as that.",
            ("Labels",), lambda: len(suggestions.pending), shrank,
            lambda: bool(suggestions.pending),
        ),
        Step(
            "Label by hand",
            "Go to where nothing is labelled. {label} begins a span; a second later {label} ends"
            " it.",
            ("Labels",), labelled, grew,
        ),
        Step(
            "Make pairs to learn from",
            "In the panel Train ({show_train}), choose Add pairs → Make of this recording: each"
            " synthetic frame beside what the radar saw.",
            ("Add pairs", "Train"), lambda: len(training.setup.data), grew,
        ),
        Step(
            "Train for a minute",
            "Press Start training. The curves fall while the model learns, and all else goes"
            " on. Stop ends it when you like; the best so far is kept.",
            ("Start training", "Train"), lambda: training.run and training.run.path, moved,
            lambda: bool(training.setup.data),
        ),
        Step(
            "Use it",
            "When the training has ended, press Use this model: its map takes the place of the"
            " one before. One recording is little to learn from, and it shows.",
            ("Use this model", "Stop", "Train"), lambda: adoption.run, moved,
            lambda: training.run is not None,
        ),
    )  # fmt: skip
