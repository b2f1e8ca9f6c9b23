"""What the cards of denoisers and of classifiers have in common; reading them needs no torch."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass, field
from pathlib import Path
from typing import Any, ClassVar, NamedTuple, TypeVar

from sd2core.errors import Sd2Error
from sd2core.files.texts import check_version, damage_in
from sd2core.options.bounds import FRAME_RATE_HZ
from sd2core.sensor import VelocityAxis

Card = TypeVar("Card", bound="NetworkCard")


class CardKind(NamedTuple):
    """Format of a kind of card, and the words for it in errors."""

    format: str
    version: int  # The latest, which is written.
    noun: str  # As in "The model's frame rate".
    written: str  # What such a file is, and which command writes it.


@dataclass(frozen=True)
class NetworkCard:
    """Description of a trained network, without its weights."""

    KIND: ClassVar[CardKind]

    model: str  # A name of the networks that this program or a plug-in has.
    options: Mapping[str, Any]  # Options of the network.
    axis: VelocityAxis  # Of the maps that it knows.
    null_bins: tuple[int, ...]  # Bins that are zero on purpose, in the input and in a map made.
    frame_rate_hz: float
    _: KW_ONLY
    title: str = ""  # Name in lists; the file's name if it is empty.
    about: Mapping[str, Any] = field(default_factory=dict)
    """``data``, ``command``, ``metrics``, ``limits`` and what else fits into JSON."""
    parameters: int = 0  # Number of learned parameters; known when the card comes from a file.
    package: str = ""  # Of the plug-in that has the network; empty: this program has it.
    path: Path | None = None  # File that holds the card.

    @property
    def name(self) -> str:
        """Name of the file, without its suffix; the kind of network before there is a file."""
        return self.path.stem if self.path is not None else self.model

    def __post_init__(self) -> None:
        if self.frame_rate_hz not in FRAME_RATE_HZ:
            raise Sd2Error(
                f"The {self.KIND.noun}'s frame rate is {self.frame_rate_hz}", FRAME_RATE_HZ.words
            )
        object.__setattr__(self, "null_bins", self.axis.checked_bins(self.null_bins, "null_bins"))

    def own_header(self) -> dict[str, Any]:
        """Return what only this kind of card has, as JSON can hold it."""
        raise NotImplementedError

    @classmethod
    def parsed(cls, content: dict[str, Any]) -> dict[str, Any]:
        """Parse :meth:`own_header`, and options that are written otherwise in earlier versions."""
        raise NotImplementedError

    def to_json(self) -> dict[str, Any]:
        """Return the header of a model file."""
        return {
            "format": self.KIND.format,
            "version": self.KIND.version,
            "model": self.model,
            "options": dict(self.options),
            "axis": {"bins": self.axis.bins, "v_max_mps": self.axis.v_max_mps},
            "null_bins": list(self.null_bins),
            "frame_rate_hz": self.frame_rate_hz,
            **self.own_header(),
            "title": self.title,
            "about": dict(self.about),
            "parameters": self.parameters,
            **({"package": self.package} if self.package else {}),
        }

    @classmethod
    def from_json(cls: type[Card], content: dict[str, Any], path: Path | None = None) -> Card:
        """Parse the header of a model file.

        Raises Sd2Error for other content, or a newer version.
        """
        kind = cls.KIND
        where = f"The {kind.noun}" if path is None else str(path)
        with damage_in(where, kind.written):
            check_version(content, where, kind.format, kind.version)
            axis = content["axis"]
            common = {
                "model": str(content["model"]),
                "options": dict(content["options"]),
                "axis": VelocityAxis(int(axis["bins"]), float(axis["v_max_mps"])),
                "null_bins": tuple(content["null_bins"]),
                "frame_rate_hz": float(content["frame_rate_hz"]),
                "title": str(content["title"]),
                "about": dict(content["about"]),
                "parameters": int(content["parameters"]),
                "package": str(content.get("package", "")),
            }
            return cls(**{**common, **cls.parsed(content)}, path=path)
