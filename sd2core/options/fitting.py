"""Options of fitting a body to a video."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import Annotated, Literal

from sd2core.options.bounds import FIELD_OF_VIEW_DEG, STATURE_M
from sd2core.options.kinds import FILLED, NotNegative, Positive, Text
from sd2core.options.records import NOT_TYPED, OptionRecord, Place

Resolution = Literal["low", "medium", "high"]
LandmarkModel = Literal["full", "heavy"]
Stature = Annotated[float, STATURE_M]

FIT_CHOICES = (
    *("focal_px", "field_of_view_deg", "stature_m", "max_gap_s"),
    *("resolution", "landmark_model"),
)
"""Options that say how a body is fitted, and not to whom or where."""


def meshes_of(out: Path, numbers: Sequence[int]) -> list[Path]:
    """File of each person: as it is called for one, ``NAME-2.zarr`` for number 2 of several."""
    if len(numbers) < 2:
        return [out]
    return [out.with_name(f"{out.stem}-{number}{out.suffix}") for number in numbers]


class Fitting(OptionRecord):
    """How a body is fitted: section ``[fit]`` of a plan, and options of ``sd2 fit``.

    Parameters
    ----------
    stature_m : M
        how tall the person is, in metres (default: 1.72)
    stature_of
        in a plan: metres by subject, for whom the stature above does not hold
    focal_px : PX
        focal length in pixels (default: as the file says, or 56° across the longer side)
    field_of_view_deg : DEG
        instead of it, the angle across the longer side of the picture
    max_gap_s : S
        bridge gaps without the person up to this long; longer ones stay empty (default: 0.5)
    resolution
        1,229, 5,000 or 13,348 vertices
    landmark_model
        the network that finds the landmarks; full takes half the time and is a little less good
    models : FOLDER
        a folder with the landmark models
    """

    stature_m: Stature | None = None
    stature_of: Annotated[Mapping[Text, Stature], NOT_TYPED] = field(default_factory=dict)
    focal_px: Positive | None = None
    field_of_view_deg: Annotated[
        Annotated[float, FIELD_OF_VIEW_DEG] | None, Place(("--field-of-view",))
    ] = None
    max_gap_s: NotNegative | None = None
    resolution: Resolution = "medium"
    landmark_model: LandmarkModel = "heavy"
    models: Annotated[Path, FILLED] | None = None
