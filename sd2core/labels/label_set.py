"""Label sets: labels with a colour, a key and a class for the classifier."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace

from sd2core.errors import Sd2Error

_COLOUR = re.compile(r"#[0-9a-f]{6}")
LONGEST_NAME = 200
UNKNOWN = "#8a8f98"
"""Colour of labels outside the set."""


@dataclass(frozen=True)
class Label:
    """Label with its colour, key and class."""

    name: str  # Not empty, at most :data:`LONGEST_NAME` characters, one line.
    colour: str  # ``#rrggbb``, lower case.
    key: str = ""  # Character that marks with it, or empty.
    # Class that the classifier learns for it; empty for spans that are not learnt from.
    gesture_class: str = ""

    def __post_init__(self) -> None:
        check_name(self.name, "label")
        if not _COLOUR.fullmatch(self.colour):
            raise Sd2Error(
                f"The colour of the label {self.name!r} is {self.colour!r}", "#rrggbb, lower case"
            )
        check_text(self.gesture_class, "class of a label")
        if len(self.key) > 1 or self.key.isspace() or not self.key.isprintable():
            raise Sd2Error(f"The key of the label {self.name!r} is {self.key!r}", "one character")


@dataclass(frozen=True)
class LabelSet:
    """Labels of a project, in the order in which they are offered.

    Names differ, and keys as well; lower and upper case are one key.
    """

    name: str
    labels: tuple[Label, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "labels", tuple(self.labels))
        check_text(self.name, "name of a label set")
        for what, values in (
            ("name", [one.name for one in self.labels]),
            ("key", [one.key.casefold() for one in self.labels if one.key]),
        ):
            twice = sorted({value for value in values if values.count(value) > 1})
            if twice:
                raise Sd2Error(
                    f"Labels of the set {self.name!r} share the {what} {', '.join(twice)}",
                    f"a {what} of its own for every label",
                )

    def find(self, name: str) -> Label | None:
        """Return the label of that name, or None."""
        return next((one for one in self.labels if one.name == name), None)

    def colour_of(self, name: str) -> str:
        """Return the ``#rrggbb`` of a label, or of the first one of a class; grey for others."""
        return next((one.colour for one in (self.find(name), *self.of_class(name)) if one), UNKNOWN)

    def of_class(self, name: str) -> tuple[Label, ...]:
        """Return the labels of a class of the classifier."""
        return tuple(one for one in self.labels if one.gesture_class == name)


def with_own_keys(labels: Iterable[Label], taken: Iterable[str] = ()) -> list[Label]:
    """Return labels without the keys that are taken, or that one before them has."""
    keys = {key.casefold() for key in taken}
    result = []
    for label in labels:
        if label.key.casefold() in keys:
            label = replace(label, key="")
        keys.add(label.key.casefold())
        result.append(label)
    return result


def check_name(name: str, what: str) -> None:
    """Raise an error for a name that no file and no menu can hold."""
    if not name.strip() or len(name) > LONGEST_NAME or not name.isprintable():
        raise Sd2Error(
            f"The name of a {what} is {name[: LONGEST_NAME + 1]!r}",
            f"one line of 1 to {LONGEST_NAME} characters",
        )


def check_text(text: str, what: str) -> None:
    """Raise an error for a text that no file can hold: half of a character (a lone surrogate)."""
    if not text.isascii() and any("\ud800" <= one <= "\udfff" for one in text):
        raise Sd2Error(f"The {what} is {text[:LONGEST_NAME]!r}", "whole characters")


# Two blues and two oranges (Okabe and Ito, colour universal design): classes differ in hue for
# every kind of colour vision, directions in lightness, and each has a name and a key besides.
GESTURES = LabelSet(
    "Gestures of the paper",
    (
        Label("left-to-right", "#0072b2", "1", "horizontal"),
        Label("right-to-left", "#56b4e9", "2", "horizontal"),
        Label("up-to-down", "#d55e00", "3", "vertical"),
        Label("down-to-up", "#e69f00", "4", "vertical"),
        Label("background", "#999999", "5", "background"),
    ),
)
"""The default: the paper's four swipes and what is none of them."""
