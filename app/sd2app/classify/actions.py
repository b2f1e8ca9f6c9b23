"""Actions of the gesture classifier."""

from __future__ import annotations

from sd2app.feature import Action

FINDING: tuple[Action, ...] = (
    Action(
        "find_gestures", "Labels", "Find gestures", ("Shift+G",),
        "Suggest what the classifier takes for gestures; each is then accepted or rejected",
        lambda w: w.context.suggestions.start(w.context.gestures),
        lambda c: not c.gestures.why_not, edits_labels=True,
        why_not=lambda c: c.gestures.why_not,
    ),
)  # fmt: skip

CLASSIFIERS: tuple[Action, ...] = (
    Action(
        "open_classifier", "Model", "Open classifier file…", (),
        "Say which gesture each frame shows, with a classifier of your own (.safetensors)",
        lambda w: w.class_dialogs.open_classifier(),
    ),
    Action(
        "classifier_card", "Model", "About this classifier…", (),
        "What it is shown, what it learned from, and how well it did",
        lambda w: w.class_dialogs.show_card(), lambda c: c.classify.card is not None,
    ),
    Action(
        "show_classes", "Model", "Probabilities of gestures", ("Shift+I",),
        "Show under the maps how probable each gesture is, and which one is on screen",
        lambda w: w.context.classify.set_shown(not w.context.classify.shown),
        lambda c: c.classify.path is not None,
        lambda c: c.classify.shown and c.classify.path is not None,
        why_not=lambda c: "" if c.classify.path is not None else "No classifier is in use",
    ),
    Action(
        "train_classifier", "Model", "Train a classifier…", ("Shift+C",),
        "Learn gestures from labelled maps, beside the window",
        lambda w: w.show_training("classifiers"),
    ),
)  # fmt: skip
