"""Actions of labels that a hand does not draw: suggested, of files, of another person."""

from __future__ import annotations

from sd2app.feature import Action, disagree, has_content, has_spans, has_suggestions

SUGGESTIONS: tuple[Action, ...] = (
    Action(
        "suggest", "Labels", "Suggest spans", ("F",),
        "Find where something moves in a map; each suggestion is then accepted or rejected",
        lambda w: w.context.suggestions.start(),
        lambda c: not c.suggestions.finders[0].why_not, separator_before=True, edits_labels=True,
    ),
    Action(
        "accept_suggestion", "Labels", "Accept suggestion", ("Y",),
        "Take the one that is selected, or the next; a label's own key takes it as that",
        lambda w: w.context.suggestions.accept(), has_suggestions, edits_labels=True,
    ),
    Action(
        "reject_suggestion", "Labels", "Reject suggestion", ("W",),
        "Let the one that is selected go, or the next; it is not suggested again",
        lambda w: w.context.suggestions.reject(), has_suggestions, edits_labels=True,
    ),
    Action(
        "accept_suggestions", "Labels", "Accept all suggestions", ("Shift+Y",),
        "Take all that there is room for",
        lambda w: w.context.suggestions.accept_all(), has_suggestions, edits_labels=True,
    ),
    Action(
        "reject_suggestions", "Labels", "Reject all suggestions", ("Shift+W",),
        "Let all go; they are not suggested again",
        lambda w: w.context.suggestions.reject_all(), has_suggestions, edits_labels=True,
    ),
)  # fmt: skip

LABEL_FILES: tuple[Action, ...] = (
    Action(
        "import_labels", "Labels", "Import labels…", ("Ctrl+I",),
        "Take the labels of a file: SD² Studio, table, Audacity, ELAN, Praat, BORIS, MNE",
        lambda w: w.label_files.import_labels(), has_content, separator_before=True,
        edits_labels=True,
    ),
    Action(
        "export_labels", "Labels", "Export labels…", ("Ctrl+Shift+I",),
        "Write the labels for another program, and say what its file cannot hold",
        lambda w: w.label_files.export_labels(), has_content,
    ),
    Action(
        "cut_out", "Labels", "Export cut-outs…", ("Ctrl+Shift+X",),
        "Write video, mesh and maps of each span into a folder of its own, with an index",
        lambda w: w.label_files.cut_out(), has_spans,
    ),
)  # fmt: skip

COMPARING: tuple[Action, ...] = (
    Action(
        "compare_labels", "Labels", "Compare with another's labels…", ("Ctrl+K",),
        "Show how far another person's labels agree with these, and where they do not",
        lambda w: w.label_files.compare_labels(), has_content, separator_before=True,
    ),
    Action(
        "next_disagreement", "Labels", "Next disagreement", ("Shift+N",),
        "Go to where the labels differ next",
        lambda w: w.context.agreement.step(1), disagree,
    ),
    Action(
        "previous_disagreement", "Labels", "Previous disagreement", ("Shift+P",),
        "Go to where the labels differ before",
        lambda w: w.context.agreement.step(-1), disagree,
    ),
    Action(
        "end_comparison", "Labels", "End the comparison of labels", (),
        "Take the other's labels away",
        lambda w: w.context.agreement.clear(), lambda c: c.agreement.active,
    ),
)  # fmt: skip
