"""Description of a classifier in its file; reading it needs no torch."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.classify.defaults import DELAYS_S, FeatureKind
from sd2core.classify.features import Features
from sd2core.denoise.network_card import CardKind, NetworkCard
from sd2core.errors import Sd2Error
from sd2core.labels.label_set import check_name
from sd2core.labels.per_frame import BACKGROUND

FORMAT = "sd2-classifier"


@dataclass(frozen=True)
class ClassifierCard(NetworkCard):
    """Description of a trained classifier, without its weights.

    ``model`` is a name of :data:`sd2core.classify.defaults.MODELS`.
    """

    KIND = CardKind(FORMAT, 2, "classifier", "a classifier written by `sd2 classify train`")

    shown: FeatureKind  # what it sees of a frame
    classes: tuple[str, ...]  # in the order of its answers; at least two
    trained_on: tuple[str, ...]  # sd2core.maps.MapKind
    delay_frames: int = 0  # number of frames seen after one before it is answered

    def __post_init__(self) -> None:
        super().__post_init__()
        _ = self.features  # or fail
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

    @cached_property
    def features(self) -> Features:
        """Its input, computed from maps."""
        return Features(self.shown, self.axis, self.null_bins, self.frame_rate_hz)

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
        answer = np.full(len(self.classes), 1.0 / len(self.classes), np.float32)
        if self.background is not None:
            answer[:] = 0.0
            answer[self.background] = 1.0
        return answer

    def own_header(self) -> dict[str, Any]:
        """Return what only classifiers have, as JSON can hold it."""
        return {
            "features": self.shown,
            "classes": list(self.classes),
            "trained_on": list(self.trained_on),
            "delay_frames": self.delay_frames,
        }

    @classmethod
    def parsed(cls, content: dict[str, Any]) -> dict[str, Any]:
        """Parse :meth:`own_header`; those of version 1 are of 16 units where they do not say."""
        before = {"width": 16} if content["version"] < 2 else {}
        return {
            "options": {**before, **content["options"]},
            "shown": content["features"],
            "classes": tuple(map(str, content["classes"])),
            "trained_on": tuple(map(str, content["trained_on"])),
            "delay_frames": int(content.get("delay_frames", 0)),  # version 1 answers at once
        }
