"""Parts of ``recording.json``, checked when they are read. See ``docs/formats.md``."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    FiniteFloat,
    PositiveInt,
    StringConstraints,
    model_validator,
)

from sd2core.errors import Cure
from sd2core.files.turns import Turn, turned_further

FILE_NAME = "recording.json"

FARTHEST_S = 1e12
"""Times reach no farther from 0, where milliseconds still differ."""
Time = Annotated[FiniteFloat, Field(ge=-FARTHEST_S, le=FARTHEST_S)]
Pixels = Annotated[PositiveInt, Field(le=100_000)]
Focal = Annotated[FiniteFloat, Field(gt=0, le=1e6)]
"""A focal length in pixels; the window shows nothing through a longer one."""
PositiveFinite = Annotated[FiniteFloat, Field(gt=0)]
StoredPath = Annotated[str, StringConstraints(pattern=r"\S")]
"""A path that names something: nothing at all would be the recording's own folder."""


class Span(BaseModel):
    """A labelled stretch of time, half-open ``[start_s, end_s)``.

    Examples
    --------
    >>> import sd2core as sd2
    >>> span = sd2.Span(start_s=1.6, end_s=2.8, label="left-to-right")
    >>> round(span.end_s - span.start_s, 1)
    1.2
    """

    model_config = ConfigDict(extra="allow", frozen=True)

    start_s: Time
    end_s: Time
    label: str

    @model_validator(mode="after")
    def _ordered(self) -> Span:
        if not self.start_s < self.end_s:
            raise ValueError(f"the span ends at {self.end_s} s and starts at {self.start_s} s")
        return self


class MeshReading(BaseModel):
    """Options for reading a mesh file; see :func:`sd2core.io.mesh.load_mesh`."""

    model_config = ConfigDict(extra="allow", frozen=True)

    frames_per_s: PositiveFinite | None = None
    scale: PositiveFinite | None = None
    person: int | str | None = None
    image_size: tuple[Pixels, Pixels] | None = None
    focal_px: Focal | None = None
    distance_m: FiniteFloat | None = None
    turn: Turn | None = None
    body_model: StoredPath | None = None  # in full: what a recording keeps are the vertices

    def options(self) -> dict[str, Any]:
        """Arguments for ``load_mesh``: those that are given."""
        values = {name: getattr(self, name) for name in type(self).model_fields}
        return {name: value for name, value in values.items() if value is not None}

    def cured(self, cure: Cure) -> MeshReading:
        """Options with a setting that puts right what was read with these."""
        value: float | str | None = cure.value
        if cure.setting == "turn":
            value = turned_further(self.turn, str(cure.value))
        return self.model_copy(update={cure.setting: value})


class CameraEntry(BaseModel):
    """The camera that took the video."""

    model_config = ConfigDict(extra="allow", frozen=True)

    focal_px: Focal  # in pixels of a picture of width × height
    width: Pixels | None = None  # None: that of the recording's video
    height: Pixels | None = None
    source: str = ""  # of the focal length: user, metadata, default or simulated

    def focal_for(self, width: int, height: int) -> float:
        """Focal length in pixels of a picture of another size."""
        if self.width is None or self.height is None:
            return self.focal_px
        return self.focal_px * max(width, height) / max(self.width, self.height)
