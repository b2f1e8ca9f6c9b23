"""Edits of the label set; spans follow a label that gets another name."""

from __future__ import annotations

from dataclasses import replace
from itertools import count

from sd2core.errors import Sd2Error
from sd2core.labels.colours import OFFERED
from sd2core.labels.edits import Edit
from sd2core.labels.label_set import Label, LabelSet
from sd2core.labels.spans import Labels

CLASSES = ("horizontal", "vertical", "background")
"""What the classifier tells apart."""


def set_label_set(labels: Labels, label_set: LabelSet) -> Edit:
    """Use another label set; spans keep their labels, also those it does not have."""
    return _edit("Change label set", labels, replace(labels, label_set=label_set))


def new_label(label_set: LabelSet) -> Label:
    """A label that the set has room for: a name, a colour and a digit that none has yet."""
    names = {one.name for one in label_set.labels}
    keys = {one.key for one in label_set.labels}
    colours = [one.colour for one in label_set.labels]
    return Label(
        next(name for number in count(1) if (name := f"label {number}") not in names),
        min((colour for _, colour in OFFERED), key=colours.count),
        next((digit for digit in "123456789" if digit not in keys), ""),
    )


def add_label(labels: Labels, label: Label, place: int | None = None) -> Edit:
    """Add a label, after the others or at a place among them (0: first)."""
    offered = list(labels.label_set.labels)
    offered.insert(len(offered) if place is None else place, label)
    return _edit("Add label", labels, _with(labels, offered))


def rename_label(labels: Labels, old: str, new: str) -> Edit:
    """Give a label another name, in the set and wherever it stands."""
    changed = _instead(labels, old, name=new)
    spans = tuple(replace(span, label=new) if span.label == old else span for span in labels.spans)
    return _edit("Rename label", labels, replace(changed, spans=spans))


def set_colour(labels: Labels, name: str, colour: str) -> Edit:
    """Show a label in another colour, ``#rrggbb``."""
    return _edit("Change colour of label", labels, _instead(labels, name, colour=colour))


def set_key(labels: Labels, name: str, key: str) -> Edit:
    """Mark a label with another key, or with none."""
    return _edit("Change key of label", labels, _instead(labels, name, key=key))


def set_class(labels: Labels, name: str, gesture_class: str) -> Edit:
    """Say what the classifier is to call a label; with nothing its spans are not learnt from."""
    changed = _instead(labels, name, gesture_class=gesture_class)
    return _edit("Change class of label", labels, changed)


def move_label(labels: Labels, name: str, place: int) -> Edit:
    """Put a label at a place among the others; 0 is the first."""
    moved = _known(labels, name)
    offered = [one for one in labels.label_set.labels if one != moved]
    offered.insert(place, moved)
    return _edit("Move label", labels, _with(labels, offered))


def remove_label(labels: Labels, name: str, instead: str | None = None) -> Edit:
    """Remove a label from the set; its spans keep it, or get another one of the set instead.

    The name of the step says what became of the spans.
    """
    gone = _known(labels, name)
    offered = [one for one in labels.label_set.labels if one != gone]
    spans, text = labels.spans, "Remove label"
    having = sum(span.label == name for span in spans)
    if having:
        whose = "1 span" if having == 1 else f"{having} spans"
        text += f", {whose} keep{'s' * (having == 1)} it"
    if having and instead is not None:
        if instead == name:
            raise Sd2Error(f"Spans of {name!r} were to get that label itself", "another label")
        _known(labels, instead)
        spans = tuple(replace(one, label=instead) if one.label == name else one for one in spans)
        text = f"Remove label, {whose} become {instead}"
    return _edit(text, labels, replace(_with(labels, offered), spans=spans))


def _known(labels: Labels, name: str) -> Label:
    found = labels.label_set.find(name)
    if found is None:
        raise Sd2Error(
            f"The set {labels.label_set.name!r} has no label {name!r}",
            f"one of {', '.join(one.name for one in labels.label_set.labels)}",
        )
    return found


def _instead(labels: Labels, which: str, **fields: str) -> Labels:
    known = _known(labels, which)
    changed = replace(known, **fields)
    offered = [changed if one == known else one for one in labels.label_set.labels]
    return _with(labels, offered)


def _with(labels: Labels, offered: list[Label]) -> Labels:
    return replace(labels, label_set=replace(labels.label_set, labels=tuple(offered)))


def _edit(name: str, before: Labels, after: Labels) -> Edit:
    return Edit(name, before if after == before else after)
