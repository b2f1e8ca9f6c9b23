"""Plan of a study: a frozen record, checked strictly. See ``docs/formats.md``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal, get_args

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, StringConstraints, model_validator

from sd2core.batch.plan_file import parsed
from sd2core.denoise.card import Inputs
from sd2core.files.paths import located_path
from sd2core.files.texts import read_text
from sd2core.pairs.segments import OVERLAP

Added = Literal["synthetic", "synthetic+texture", "denoised", "denoised+texture", "radar"]
"""What is added to the real maps: the maps of one person of whom there is only video, plainly, as
the fold's denoiser makes them, each also with the radar's texture; or what the radar saw of them,
the yardstick."""

ADDED: tuple[Added, ...] = get_args(Added)

Text = Annotated[str, StringConstraints(pattern=r"\S")]
Share = Annotated[FiniteFloat, Field(gt=0, le=1)]


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class Denoiser(_Section):
    """Section ``[denoiser]``: how the denoiser of every fold learns."""

    model: Text = "s4"
    inputs: Inputs = "kinematics"
    options: dict[str, Any] = Field(default_factory=dict)
    minutes: Annotated[FiniteFloat, Field(gt=0, le=600)] = 0.5
    segment_frames: Annotated[int, Field(ge=8, le=10_000)] = 24
    velocity_weight: Annotated[FiniteFloat, Field(ge=0)] = 1.0


class StudyPlan(_Section):
    """Plan of a study: data, amounts, what is added, and how often."""

    format: Literal["sd2-study"] = "sd2-study"
    version: Literal[1] = 1
    title: Text
    out: Text  # folder of the results, relative to the plan's folder
    pairs: tuple[Text, ...] = ()
    """Stores of pairs of a real radar, of three people or more."""
    recordings: tuple[Text, ...] = ()
    """Recordings with a mesh, a radar and labels, instead of pairs."""
    subjects: tuple[Text, ...] = ()
    """Person of each recording."""
    labels: Text | None = None
    """Table of labels of takes (``sd2 pairs label``); None: those of the pairs."""
    classes: dict[str, str] = Field(default_factory=dict)
    """Class of a label; without any, each label is a class. Others are not learnt."""
    shares: Annotated[tuple[Share, ...], Field(min_length=1)] = (0.05, 0.1, 0.25, 0.5, 1.0)
    """Of the real frames of each class."""
    added: tuple[Added, ...] = ADDED
    speeds: tuple[Annotated[FiniteFloat, Field(ge=0.25, le=4)], ...] = ()
    """Added maps are also played at these speeds: twice as fast, velocities are twice as large."""
    seeds: Annotated[int, Field(ge=1, le=1000)] = 3
    """Draws of the real frames, with a denoiser of its own each."""
    added_weight: Annotated[FiniteFloat, Field(gt=0, le=10)] = 0.3
    """Weight of all added frames together, beside 1 of the real ones."""
    window_s: Annotated[FiniteFloat, Field(gt=0, le=60)] = 3.0
    """Time that the classifier looks at."""
    denoiser: Denoiser = Field(default_factory=Denoiser)

    @model_validator(mode="after")
    def _complete(self) -> StudyPlan:
        if bool(self.pairs) == bool(self.recordings):
            raise ValueError("give either pairs or recordings")
        if self.subjects and len(self.subjects) != len(self.recordings):
            raise ValueError("give a subject for each recording")
        if self.denoiser.segment_frames <= OVERLAP:
            raise ValueError(f"segment_frames must be more than {OVERLAP}")
        return self


def read_study(path: Path) -> StudyPlan:
    """Read a TOML file; paths in the plan that is returned are absolute.

    Raises Sd2Error, with file, line and key, if it cannot be read or holds what is not allowed.
    """
    text = read_text(path, "a plan of a study (.toml)")
    plan = parsed(StudyPlan, text, str(path))
    folder = Path(path).absolute().parent

    def located(stored: str) -> str:
        return str(located_path(stored, folder))

    return plan.model_copy(
        update={
            "out": located(plan.out),
            "pairs": tuple(map(located, plan.pairs)),
            "recordings": tuple(map(located, plan.recordings)),
            "labels": None if plan.labels is None else located(plan.labels),
        }
    )
