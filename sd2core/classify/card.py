"""Description of a classifier in its file; reading it needs no torch."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.classify.defaults import DELAYS_S
from sd2core.classify.features import Features
from sd2core.errors import Sd2Error
from sd2core.files.texts import damage_in
from sd2core.labels.label_set import check_name
from sd2core.options.bounds import FRAME_RATE_HZ
from sd2core.sensor import VelocityAxis

FORMAT = "sd2-classifier"
VERSION = 2

BACKGROUND = "background"
"""The class of frames in which there is none of the gestures."""


@dataclass(frozen=True)
class ClassifierCard:
    """Description of a trained classifier, without its weights."""

    model: str  # a name of sd2core.classify.defaults.MODELS
    options: Mapping[str, Any]  # of the network
    features: Features  # its input, and the maps that it is computed from
    classes: tuple[str, ...]  # in the order of its answers; at least two
    trained_on: tuple[str, ...]  # sd2core.maps.MapKind
    delay_frames: int = 0  # number of frames seen after one before it is answered
    title: str = ""  # shown in lists; the file's name where it is empty
    about: Mapping[str, Any] = field(default_factory=dict)
    """``data``, ``command``, ``metrics`` and what else fits into JSON."""
    parameters: int = 0  # number of weights; known when the card comes from a file
    package: str = ""  # Of the plug-in that has the network; empty: this program has it.
    path: Path | None = None

    def __post_init__(self) -> None:
        if self.frame_rate_hz not in FRAME_RATE_HZ:
            raise Sd2Error(
                f"The classifier's frame rate is {self.frame_rate_hz}", FRAME_RATE_HZ.words
            )
        if len(self.classes) < 2 or len(set(self.classes)) < len(self.classes):
            raise Sd2Error(
                f"The classes are {', '.join(self.classes) or 'none'}", "two or more, each once"
            )
        for name in self.classes:
            check_name(name, "class")
        if self.delay_s not in DELAYS_S:
            raise Sd2Error(
                f"The classifier answers {self.delay_s:g} s late", f"0 to {DELAYS_S.high:g} s"
            )

    @property
    def name(self) -> str:
        """Name of the file, without its ending; the kind of model before there is a file."""
        return self.path.stem if self.path is not None else self.model

    @property
    def axis(self) -> VelocityAxis:
        """Velocity axis of the maps."""
        return self.features.axis

    @property
    def null_bins(self) -> tuple[int, ...]:
        """Bins that are set to zero."""
        return self.features.null_bins

    @property
    def frame_rate_hz(self) -> float:
        """Frame rate of the maps."""
        return self.features.frame_rate_hz

    @property
    def delay_s(self) -> float:
        """Delay of an answer after its frame."""
        return self.delay_frames / self.frame_rate_hz

    @property
    def background(self) -> int | None:
        """Index of the background class; None where there is none."""
        return self.classes.index(BACKGROUND) if BACKGROUND in self.classes else None

    def no_person(self) -> NDArray[np.float32]:
        """Answer to a frame without a person, (classes,).

        Background, or where that is none of the classes nothing is known: all the same.
        """
        found = np.full(len(self.classes), 1.0 / len(self.classes), np.float32)
        if self.background is not None:
            found[:] = 0.0
            found[self.background] = 1.0
        return found

    def to_json(self) -> dict[str, Any]:
        """Return the header of a model file."""
        return {
            "format": FORMAT,
            "version": VERSION,
            "model": self.model,
            "options": dict(self.options),
            "features": self.features.kind,
            "axis": {"bins": self.axis.bins, "v_max_mps": self.axis.v_max_mps},
            "null_bins": list(self.null_bins),
            "frame_rate_hz": self.frame_rate_hz,
            "classes": list(self.classes),
            "trained_on": list(self.trained_on),
            "delay_frames": self.delay_frames,
            "title": self.title,
            "about": dict(self.about),
            "parameters": self.parameters,
            **({"package": self.package} if self.package else {}),
        }

    @classmethod
    def from_json(cls, content: dict[str, Any], path: Path | None = None) -> ClassifierCard:
        """Parse the header of a model file."""
        where = "The classifier" if path is None else str(path)
        with damage_in(where, "a classifier written by `sd2 classify train`"):
            if content["format"] != FORMAT or not isinstance(content["version"], int):
                raise ValueError(f"format {content['format']!r}")
            if content["version"] > VERSION:
                raise Sd2Error(
                    f"{where} is of version {content['version']}",
                    f"a classifier up to version {VERSION}",
                    "Use the version of SD² Studio that made it, or a newer one",
                )
            # Those of version 1 are of 16 units where they do not say, and answer at once.
            before = {"width": 16} if content["version"] < 2 else {}
            return cls(
                model=str(content["model"]),
                options={**before, **content["options"]},
                features=Features(
                    content["features"],
                    VelocityAxis(int(content["axis"]["bins"]), float(content["axis"]["v_max_mps"])),
                    tuple(map(int, content["null_bins"])),
                    float(content["frame_rate_hz"]),
                ),
                classes=tuple(map(str, content["classes"])),
                trained_on=tuple(map(str, content["trained_on"])),
                delay_frames=int(content.get("delay_frames", 0)),
                title=str(content["title"]),
                about=dict(content["about"]),
                parameters=int(content["parameters"]),
                package=str(content.get("package", "")),
                path=path,
            )
