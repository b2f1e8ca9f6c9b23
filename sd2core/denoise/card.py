"""Description of a denoiser in its model file; reading it needs no torch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal, get_args

from sd2core.denoise.known import KnownMovements
from sd2core.denoise.network_card import CardKind, NetworkCard
from sd2core.denoise.registry import options_of_version_1
from sd2core.denoise.scaling import Scaling, null_columns
from sd2core.denoise.texture import Texture
from sd2core.errors import Sd2Error
from sd2core.mesh.vertex_parts import JOINTS, KINEMATICS, PARTS, QUANTITIES

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
class ModelCard(NetworkCard):
    """Description of a trained denoiser, without its weights.

    ``model`` is a name of :data:`sd2core.denoise.registry.MODELS` or ``FILTERS``.
    """

    KIND = CardKind("sd2-denoiser", VERSION, "model", "a model file written by `sd2 train`")

    scaling: Scaling
    trained_on: TrainedOn
    unit: str = "power"  # Meaning of the value 1 in the result.
    parts: tuple[str, ...] = ()
    """Parts of the body whose limb maps are the input; none: the map itself; ``kinematics`` alone:
    the map and how joints move."""
    texture: Texture | None = None  # Of the radar's maps about the answers; None: not known.
    known: KnownMovements | None = None  # What it learnt from; None: files of before do not say.

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.trained_on not in get_args(TrainedOn):
            raise Sd2Error(
                f"The model was trained on {self.trained_on!r}", f"one of {get_args(TrainedOn)}"
            )

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

    def needed_texture(self) -> Texture:
        """Texture of the radar's maps; Sd2Error if the model does not know it."""
        if self.texture is None:
            raise Sd2Error(
                f"The model {self.title or self.name} does not know the texture of a radar's maps",
                "one that was trained by this version, or later",
                "Train it again with `sd2 train`, or leave --texture out",
            )
        return self.texture

    def own_header(self) -> dict[str, Any]:
        """Return what only denoisers have, as JSON can hold it."""
        return {
            "scaling": self.scaling.to_json(),
            "trained_on": self.trained_on,
            "unit": self.unit,
            "parts": list(self.parts),
            "known": None if self.known is None else asdict(self.known),
            "texture": None if self.texture is None else asdict(self.texture),
        }

    @classmethod
    def parsed(cls, content: dict[str, Any]) -> dict[str, Any]:
        """Parse :meth:`own_header`, and the options of version 1."""
        before = {}
        if content["version"] < VERSION:
            before["options"] = options_of_version_1(str(content["model"]), content["options"])
        return before | {
            "scaling": Scaling.from_json(content["scaling"]),
            "trained_on": content["trained_on"],
            "unit": str(content["unit"]),
            "parts": tuple(str(part) for part in content.get("parts", ())),
            "known": KnownMovements.from_json(content.get("known")),
            "texture": Texture.from_json(content.get("texture")),
        }
