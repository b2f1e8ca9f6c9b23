"""Reading clips whose motion is known: what ``python -m tools.fitting clips`` writes."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sd2core import MeshSequence, Sd2Error, Span, load_mesh
from sd2core.body.camera import PinholeCamera

FORMAT = "sd2-fit-truth"
VERSION = 1

_EXPECTED = "a clip made by `python -m tools.fitting clips`"


@dataclass(frozen=True, eq=False)
class Truth:
    """One clip."""

    folder: Path
    description: Mapping[str, Any]  # as the program that made it describes the clip
    name: str
    kind: str  # ``swipes``, ``still``, ``walk``, ``turn`` or ``captured``
    speed: str  # of the swipes: ``slow``, ``normal`` or ``fast``
    hand: str  # ``L`` or ``R``: the one that swipes
    strokes: tuple[Span, ...]
    stature_m: float  # of the person, without shoes
    camera: PinholeCamera

    @property
    def video(self) -> Path:
        """The picture."""
        return self.folder / "video.mp4"

    def mesh(self) -> MeshSequence:
        """The true surface in the camera frame."""
        return load_mesh(self.folder / "mesh.zarr")


def read_truth(folder: Path) -> Truth:
    """Open one clip; Sd2Error if the folder holds none, or one of a later version."""
    path = Path(folder) / "truth.json"
    try:
        meta = json.loads(path.read_text("utf-8"))
        kind, version = meta["format"], meta["version"]
        if kind != FORMAT or version > VERSION:
            raise Sd2Error(
                f"{path} is of format {kind!r} version {version}", f"{FORMAT!r} up to {VERSION}"
            )
        clip, camera = meta["clip"], meta["camera"]
        return Truth(
            Path(folder),
            clip,
            clip["name"],
            **{name: clip["action"][name] for name in ("kind", "speed", "hand")},
            strokes=tuple(Span(**span) for span in meta["spans"]),
            stature_m=meta["stature_m"],
            camera=PinholeCamera(camera["width"], camera["height"], camera["focal_px"]),
        )
    except (OSError, KeyError, TypeError, ValueError) as error:
        raise Sd2Error(f"{path} cannot be read ({error})", _EXPECTED) from error


def truths_in(folder: Path) -> list[Truth]:
    """Clips in a folder by name; Sd2Error if there is none, or one cannot be read."""
    paths = sorted(folder.glob("[!.]*/truth.json"))
    if not paths:
        raise Sd2Error(
            f"{folder} holds no clip of known motion",
            "a folder made by `python -m tools.fitting clips`",
            f"Make it: python -m tools.fitting clips {folder}",
        )
    return [read_truth(path.parent) for path in paths]
