"""Description of a denoiser in its model file; reading it needs no torch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal, get_args

from sd2core.denoise.known import KnownMovements
from sd2core.denoise.registry import options_of_version_1
from sd2core.denoise.scaling import Scaling, null_columns
from sd2core.denoise.texture import Texture
from sd2core.errors import Sd2Error
from sd2core.files.texts import damage_in
from sd2core.mesh.vertex_parts import JOINTS, KINEMATICS, PARTS, QUANTITIES
from sd2core.options.bounds import FRAME_RATE_HZ
from sd2core.sensor import VelocityAxis

FORMAT = "sd2-denoiser"
VERSION = 2

DENOISER_PARTS = ("trunk", "upper_arm", "forearm", "thigh", "lower_leg")
"""Parts of the body whose limb maps a new model takes. Both sides together: apart they gain
nothing with real radar (docs/real-pairs.md)."""

KINEMATICS_COLUMNS = len(JOINTS) * len(QUANTITIES) + len(PARTS)
"""Numbers per frame that :data:`~sd2core.mesh.vertex_parts.KINEMATICS` are."""

Inputs = Literal["map", "limbs", "kinematics"]
"""Input of a denoiser: the map as in the paper, that of each part, or how joints move."""

PARTS_OF: Mapping[str, tuple[str, ...]] = {
    "map": (),
    "limbs": DENOISER_PARTS,
    "kinematics": (KINEMATICS,),
}
"""What a new model's input is made of (:attr:`ModelCard.parts`)."""


def maps_in(parts: Sequence[str]) -> int:
    """Number of maps in an input of these parts; none, or kinematics: the map itself."""
    return max(1, len(parts))


TrainedOn = Literal["simulated", "real"]
"""Origin of the training targets: a simulated radar or a real one."""


@dataclass(frozen=True)
class ModelCard:
    """Description of a trained denoiser, without its weights."""

    model: str  # A name of :data:`sd2core.denoise.registry.MODELS` or ``FILTERS``.
    options: Mapping[str, Any]  # Options of the network.
    scaling: Scaling
    axis: VelocityAxis
    null_bins: tuple[int, ...]  # Bins that are zero on purpose, in the input and in the result.
    frame_rate_hz: float
    trained_on: TrainedOn
    unit: str = "power"  # Meaning of the value 1 in the result.
    parts: tuple[str, ...] = ()
    """Parts of the body whose limb maps are the input; none: the map itself; ``kinematics`` alone:
    the map and how joints move."""
    texture: Texture | None = None  # Of the radar's maps about the answers; None: not known.
    known: KnownMovements | None = None  # What it learnt from; None: files of before do not say.
    title: str = ""  # Name in lists; the file's name if it is empty.
    # ``data``, ``command``, ``metrics``, ``limits`` and other content for JSON.
    about: Mapping[str, Any] = field(default_factory=dict)
    parameters: int = 0  # Number of learned parameters; known when the card comes from a file.
    package: str = ""  # Of the plug-in that has the network; empty: this program has it.
    path: Path | None = None  # File that holds the card.

    def __post_init__(self) -> None:
        if self.frame_rate_hz not in FRAME_RATE_HZ:
            raise Sd2Error(f"The model's frame rate is {self.frame_rate_hz}", FRAME_RATE_HZ.words)
        if self.trained_on not in get_args(TrainedOn):
            raise Sd2Error(
                f"The model was trained on {self.trained_on!r}", f"one of {get_args(TrainedOn)}"
            )
        object.__setattr__(self, "null_bins", self.axis.checked_bins(self.null_bins, "null_bins"))

    @property
    def inputs(self) -> Inputs:
        """Kind of input."""
        if self.more:
            return "kinematics"
        return "limbs" if self.parts else "map"

    @property
    def maps(self) -> int:
        """Number of maps in the input."""
        return maps_in(self.parts)

    @property
    def more(self) -> int:
        """Number of numbers per frame in the input, after the maps."""
        return KINEMATICS_COLUMNS if self.parts == (KINEMATICS,) else 0

    @property
    def features(self) -> int:
        """Numbers per frame of the input: the bins of all its maps, one map after the other."""
        return self.axis.bins * self.maps + self.more

    @property
    def null_features(self) -> list[int]:
        """Numbers of the input that are zero on purpose."""
        return null_columns(self.null_bins, self.axis.bins, self.maps)

    @property
    def name(self) -> str:
        """Name of the file, without its suffix; the kind of model before there is a file."""
        return self.path.stem if self.path is not None else self.model

    def needed_texture(self) -> Texture:
        """Texture of the radar's maps; Sd2Error if the model does not know it."""
        if self.texture is None:
            raise Sd2Error(
                f"The model {self.title or self.name} does not know the texture of a radar's maps",
                "one that was trained by this version, or later",
                "Train it again with `sd2 train`, or leave --texture out",
            )
        return self.texture

    def to_json(self) -> dict[str, Any]:
        """Content of the header of a model file."""
        return {
            "format": FORMAT,
            "version": VERSION,
            "model": self.model,
            "options": dict(self.options),
            "scaling": self.scaling.to_json(),
            "axis": {"bins": self.axis.bins, "v_max_mps": self.axis.v_max_mps},
            "null_bins": list(self.null_bins),
            "frame_rate_hz": self.frame_rate_hz,
            "trained_on": self.trained_on,
            "unit": self.unit,
            "parts": list(self.parts),
            "known": None if self.known is None else asdict(self.known),
            "texture": None if self.texture is None else asdict(self.texture),
            "title": self.title,
            "about": dict(self.about),
            "parameters": self.parameters,
            **({"package": self.package} if self.package else {}),
        }

    @classmethod
    def from_json(cls, content: dict[str, Any], path: Path | None = None) -> ModelCard:
        """Card from the content of :meth:`to_json`.

        Raises Sd2Error for other content, or a newer version.
        """
        where = "The model" if path is None else str(path)
        with damage_in(where, "a model file written by `sd2 train`"):
            if content["format"] != FORMAT or not isinstance(content["version"], int):
                raise ValueError(f"format {content['format']!r}")
            if content["version"] > VERSION:
                raise Sd2Error(
                    f"{where} is of version {content['version']}",
                    f"a denoiser up to version {VERSION}",
                    "Use the version of SD² Studio that made it, or a newer one",
                )
            name, chosen = str(content["model"]), dict(content["options"])
            if content["version"] < VERSION:
                chosen = options_of_version_1(name, chosen)
            return cls(
                model=name,
                options=chosen,
                scaling=Scaling.from_json(content["scaling"]),
                axis=VelocityAxis(
                    int(content["axis"]["bins"]), float(content["axis"]["v_max_mps"])
                ),
                null_bins=tuple(content["null_bins"]),
                frame_rate_hz=float(content["frame_rate_hz"]),
                trained_on=content["trained_on"],
                unit=str(content["unit"]),
                parts=tuple(str(part) for part in content.get("parts", ())),
                known=KnownMovements.from_json(content.get("known")),
                texture=Texture.from_json(content.get("texture")),
                title=str(content["title"]),
                about=dict(content["about"]),
                parameters=int(content["parameters"]),
                package=str(content.get("package", "")),
                path=path,
            )
