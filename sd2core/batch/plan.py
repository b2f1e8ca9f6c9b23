"""Plan of a batch: a frozen record, checked strictly. See ``docs/formats.md``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Annotated, Any, Literal, get_args

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    FiniteFloat,
    field_validator,
    model_validator,
)

from sd2core.datasets.options import dataset_options
from sd2core.doppler.options import chosen_options
from sd2core.errors import Sd2Error
from sd2core.options.exporting import Exporting
from sd2core.options.fitting import Fitting
from sd2core.options.kinds import Text
from sd2core.options.shared import Denoising, Simulating
from sd2core.options.synthesis import Synthesis
from sd2core.placements.placements import Placements, placements_from_dict
from sd2core.sensor import Vector, VirtualSensor, aimed_at

FORMAT: Literal["sd2-batch-plan"] = "sd2-batch-plan"
VERSION: Literal[1] = 1

Step = Literal["inspect", "fit", "synthesise", "denoise", "simulate", "export"]
"""What is done, in this order; ``inspect`` is the look at what a recording holds."""

STEPS: tuple[Step, ...] = get_args(Step)


class Section(BaseModel):
    """Base of the sections of plans: strict, and nothing unknown."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class Recordings(Section):
    """Section ``[recordings]``: the input files and their subjects."""

    files: Annotated[tuple[Text, ...], Field(min_length=1)]
    """Recordings (``.sd2``), videos and meshes, by name or by pattern, relative to the plan's
    folder; ``**`` is any number of folders."""
    subjects: Literal["recording", "folder"] = "recording"
    """Subject of a recording that ``subject_of`` does not name: whom it names itself, or else one
    per recording; or one per folder."""
    subject_of: Mapping[Text, Text] = Field(default_factory=dict)
    """Pattern of a file's name, or of the end of its path, to a subject; the first that fits
    holds."""


class BatchPlan(Section):
    """Plan of a batch. A step whose section is absent is not done."""

    format: Literal["sd2-batch-plan"] = FORMAT
    version: Literal[1] = VERSION
    out: Text  # folder of the results, relative to the plan's folder
    recordings: Recordings
    placements: Mapping[str, Any] = Field(default_factory=lambda: {"kind": "recording"})
    """Sensor positions: ``kind = "recording"`` (each recording's own sensor, the camera where it
    has none), ``kind = "positions"`` with ``positions_m``, or a spec of
    :func:`~sd2core.placements.placements.placements_from_dict` (``"grid"``, ``"cloud"``),
    around the body of each recording. With ``own = true`` the recording's own sensor besides."""
    fit: Fitting | None = None
    synthesise: Synthesis | None = None
    denoise: Denoising | None = None
    simulate: Simulating | None = None
    export: Exporting | None = None

    @field_validator("synthesise", "export")
    @classmethod
    def _made(cls, section: Any) -> Any:
        try:
            if isinstance(section, Synthesis):
                chosen_options(section)
            elif isinstance(section, Exporting):
                dataset_options(section)
        except Sd2Error as error:
            raise ValueError(str(error)) from None
        return section

    @field_validator("placements")
    @classmethod
    def _placed(cls, content: Mapping[str, Any]) -> Mapping[str, Any]:
        _placements(content)
        return content

    @model_validator(mode="after")
    def _complete(self) -> BatchPlan:
        if self.fit is None and self.synthesise is None:
            raise ValueError("nothing is to be done: give a section [fit] or [synthesise]")
        for name in ("denoise", "simulate", "export"):
            if getattr(self, name) is not None and self.synthesise is None:
                raise ValueError(
                    f"[{name}] goes with synthetic maps: give a section [synthesise] as well"
                )
        split = self.synthesise is not None and self.synthesise.limbs
        if self.export is not None and self.export.limbs and not split:
            raise ValueError("[export] limbs needs limbs = true in [synthesise] as well")
        if self.synthesise is not None and self.export is not None:
            made, wanted = chosen_options(self.synthesise), self.export.null_bins
            allowed = range(made.axis.bins)
            if wanted is not None and not {*made.null_bins} <= {*wanted} <= {*allowed}:
                raise ValueError(
                    f"[export] null_bins is {list(wanted)}; expected bins up to {allowed[-1]}, and"
                    f" those among them that [synthesise] empties: {list(made.null_bins)}"
                )
        return self

    @property
    def placement_count(self) -> int:
        """Number of placements per recording."""
        if self.synthesise is None:
            return 0
        own, places = _placements(self.placements)
        return own + len(places if isinstance(places, tuple) else places.places())

    def sensors(self, own: VirtualSensor, target_m: Vector) -> dict[int, VirtualSensor]:
        """Return the sensors around one recording, by the number of the placement.

        ``own`` is the recording's own one, whose number is 0; ``target_m`` is the position
        of its body.
        """
        with_own, places = _placements(self.placements)
        if isinstance(places, tuple):
            others: Sequence[VirtualSensor] = [VirtualSensor(position_m=one) for one in places]
        else:
            others = places.sensors(target_m)
        if own.beam is not None:
            others = [replace(aimed_at(one, target_m), beam=own.beam) for one in others]
        return ({0: own} if with_own else {}) | dict(enumerate(others, start=1))


class _Positions(Section):
    kind: Literal["positions"]
    positions_m: Annotated[
        tuple[tuple[FiniteFloat, FiniteFloat, FiniteFloat], ...], Field(min_length=1)
    ]


def _placements(content: Mapping[str, Any]) -> tuple[bool, Placements | tuple[Vector, ...]]:
    """Parse placements: the recording's own sensor or not, and the other places."""
    given = dict(content)
    kind, own = given.get("kind"), given.pop("own", False)
    if kind == "recording":
        if len(content) > 1:
            raise ValueError('kind = "recording" takes nothing else')
        return True, ()
    if not isinstance(own, bool):
        raise ValueError("own is true or false")
    if kind == "positions":
        return own, _Positions.model_validate(given, strict=False).positions_m
    if kind not in ("grid", "cloud"):
        raise ValueError(f'kind is {kind!r}; expected "recording", "positions", "grid" or "cloud"')
    try:
        return own, placements_from_dict(given)
    except Sd2Error as error:
        raise ValueError(str(error)) from None
