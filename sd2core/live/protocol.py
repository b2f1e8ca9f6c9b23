"""What a guided session records: who makes which gestures, in what order and for how long."""

from __future__ import annotations

import json
import random
import re
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import AfterValidator, Field, TypeAdapter
from pydantic_core import PydanticCustomError

from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write_text
from sd2core.files.resources import resource_path
from sd2core.files.texts import faults_in, read_text
from sd2core.files.toml import toml_lines
from sd2core.labels.colours import OFFERED
from sd2core.labels.label_set import GESTURES, Label, LabelSet
from sd2core.options.bounds import SEED, Bounds
from sd2core.options.kinds import Text
from sd2core.options.records import OptionError, OptionRecord
from sd2core.options.toml_files import parsed

PAPER = "paper"
"""Name of the protocol that comes with the program."""


def _name(text: str) -> str:
    if not re.fullmatch(r"\w[\w-]{0,39}", text):
        raise PydanticCustomError("name", "up to 40 letters, digits, - and _")
    return text


_Name = Annotated[str, AfterValidator(_name)]
"""Part of a recording's name."""
_Times = Annotated[int, Bounds(1, 1000, whole=True)]
_TakeS = Annotated[float, Bounds(0.0, 3600.0, above=True)]
_WaitS = Annotated[float, Bounds(0.0, 3600.0)]
_ReactionS = Annotated[float, Bounds(0.0, 2.0)]


class Take(NamedTuple):
    """One gesture of one person, to be recorded once."""

    person: str
    gesture: str
    repetition: int  # from 1

    @property
    def name(self) -> str:
        """Name of its recording, without the suffix."""
        return f"{self.person}-{self.gesture}-{self.repetition}"


class Gesture(OptionRecord):
    """Gesture that all people make.

    Parameters
    ----------
    name
        label of the recordings
    instruction
        sentence that the person reads
    gesture_class
        what a classifier learns; empty: as of the paper's label of this name, else the name
    """

    name: _Name
    instruction: Text
    gesture_class: str = ""


class Protocol(OptionRecord):
    """Protocol of a guided session: gestures, people, and how they are asked for.

    Parameters
    ----------
    format
        `sd2-protocol`
    version
        of the format
    title
        what the session is about
    people
        pseudonyms, in the order in which the people come
    gestures
        all of them
    repetitions
        rounds, in each of which a person makes every gesture once
    order
        of the gestures in a round
    seed
        of the random order
    take_s
        seconds that a gesture is made for
    pause_s
        seconds between two takes of a person
    countdown_s
        seconds before a take; recorded: the person stands still
    reaction_s
        seconds from the prompt to the first motion of the gesture
    video
        what becomes of it in takes that have a body; blur: the head is covered, drop: deleted
    consent
        text that a person agrees to before the first take; empty: nobody is asked
    """

    format: Literal["sd2-protocol"]
    version: Literal[1]
    title: Text
    people: Annotated[tuple[_Name, ...], Field(min_length=1)]
    gestures: Annotated[tuple[Gesture, ...], Field(min_length=1)]
    repetitions: _Times = 1
    order: Literal["fixed", "random"] = "random"
    seed: Annotated[int, SEED] = 1
    take_s: _TakeS = 15.0
    pause_s: _WaitS = 5.0
    countdown_s: _WaitS = 3.0
    reaction_s: _ReactionS = 0.3
    video: Literal["keep", "blur", "drop"] = "keep"
    consent: str = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        names = [take.name.casefold() for take in self.takes]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise OptionError(
                f"two recordings would be called {twice[0]}", "names that differ in more"
            )

    @property
    def takes(self) -> tuple[Take, ...]:
        """All that is to be recorded, in order.

        The order of one person does not depend on the others.
        """
        takes = []
        for person in self.people:
            for repetition in range(1, self.repetitions + 1):
                names = [gesture.name for gesture in self.gestures]
                if self.order == "random":
                    random.Random(f"{self.seed}/{person}/{repetition}").shuffle(names)
                takes += [Take(person, name, repetition) for name in names]
        return tuple(takes)

    @property
    def consent_text(self) -> str:
        """The text that people agree to, without blank lines around it."""
        return self.consent.strip()

    def gesture(self, name: str) -> Gesture:
        """The gesture of a name, which is one of them."""
        return next(one for one in self.gestures if one.name == name)

    @property
    def label_set(self) -> LabelSet:
        """Labels of the recordings: those of the gestures, and ``background``."""
        background = GESTURES.labels[-1]
        labels = [
            Label(
                one.name,
                known.colour if known else OFFERED[number % len(OFFERED)][1],
                str(number) if number < 10 else "",
                one.gesture_class or (known.gesture_class if known else one.name),
            )
            for number, one in enumerate(self.gestures, start=1)
            for known in [GESTURES.find(one.name)]
        ]
        if background.name not in {one.name for one in labels}:
            labels.append(Label(background.name, background.colour, "0", background.gesture_class))
        return LabelSet(self.title, tuple(labels))


def protocol_of(content: Mapping[str, Any]) -> Protocol:
    """Protocol of plain values, as files have them; Sd2Error names what is not allowed."""
    with faults_in("The protocol", "a protocol of a guided session"):
        return TypeAdapter(Protocol).validate_json(json.dumps(content))


def content_of(protocol: Protocol) -> dict[str, Any]:
    """All values of a protocol, for :func:`protocol_of`."""
    content = {one.name: getattr(protocol, one.name) for one in fields(protocol)}
    gestures = [dict(vars(one)) for one in protocol.gestures]
    return content | {"people": [*protocol.people], "gestures": gestures}


def write_protocol(path: Path, protocol: Protocol) -> None:
    """Write a file for :func:`read_protocol`, without what is as by default."""
    content, folder = content_of(protocol), path.parent
    gestures = content.pop("gestures")
    usual = {one.name: one.default for one in fields(protocol)}
    lines = toml_lines({k: v for k, v in content.items() if v != usual[k]}, folder)
    for one in gestures:
        lines += ["", "[[gestures]]", *toml_lines({k: v for k, v in one.items() if v}, folder)]
    atomic_write_text(path, "\n".join(lines) + "\n")


def read_protocol(source: Path | str) -> Protocol:
    """Read a TOML file, or the bundled protocol :data:`PAPER` by its name.

    Raises Sd2Error, with file, line and key, if it cannot be read or holds what is not allowed.
    """
    path = resource_path(f"protocols/{PAPER}.toml") if str(source) == PAPER else Path(source)
    if not path.exists():
        raise Sd2Error(f"There is no protocol {path}", f"a TOML file, or the name {PAPER}")
    text = read_text(path, "a protocol of a guided session (.toml)")
    return parsed(Protocol, text, str(path))
