"""What the tour of the sample shows, from the first look to a model of one's own."""

from __future__ import annotations

from operator import gt as shrank
from operator import lt as grew

from sd2app.denoise.model import DenoiseModel
from sd2app.labels.model import LabelsModel
from sd2app.maps.difference import DifferenceModel
from sd2app.session.session import Session
from sd2app.suggestions.model import SuggestionsModel
from sd2app.training.model import TrainingModel
from sd2app.training.result import ModelAdoption
from sd2app.welcome.tour import Step


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
