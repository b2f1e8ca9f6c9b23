"""Plan of a study: a frozen record, checked strictly. See ``docs/formats.md``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal, get_args

from pydantic import AfterValidator, Field, FiniteFloat, model_validator
from pydantic_core import PydanticCustomError

from sd2core.batch.plan import Section
from sd2core.classify.defaults import (
    CLASSIFIERS,
    DELAY_S,
    DELAYS_S,
    WIDTH,
    WIDTHS,
    FeatureKind,
    model_names,
)
from sd2core.datasets.labelled_source import LabelledSource
from sd2core.denoise.card import Inputs
from sd2core.files.paths import located_path
from sd2core.files.texts import read_text
from sd2core.files.toml import section_lines, toml_lines
from sd2core.options.kinds import Share, Text
from sd2core.options.toml_files import parsed
from sd2core.pairs.segments import OVERLAP

Added = Literal[
    "synthetic", "synthetic+texture", "denoised", "denoised+texture", "simulated", "radar"
]
"""What is added to the real maps. Of those of whom there is only video: their maps plainly, as the
fold's denoiser makes them, each also with the radar's texture. What a simulated radar saw of
the bodies in ``video``. Or what the radar saw of those who are filmed, the yardstick."""

ADDED: tuple[Added, ...] = get_args(Added)
OF_VIDEO: tuple[Added, ...] = tuple(one for one in ADDED if one != "simulated")


def _learner_name(name: str) -> str:
    if name != "ridge" and name not in CLASSIFIERS:
        raise PydanticCustomError("name", f"one of ridge, {', '.join(model_names())}")
    return name


class Learner(Section):
    """Section ``[[classifiers]]``: what learns, and how."""

    model: Annotated[str, AfterValidator(_learner_name)] = "ridge"
    """Ridge regression on what a window shows, or a model of ``sd2 classify train``."""
    window_s: Annotated[FiniteFloat, Field(gt=0, le=60)] = 3.0
    """Time that ridge regression looks at."""
    # The others are not those of ridge regression.
    features: FeatureKind = "columns"
    width: Annotated[int, Field(ge=WIDTHS.low, le=WIDTHS.high)] = WIDTH
    delay_s: Annotated[FiniteFloat, Field(ge=DELAYS_S.low, le=DELAYS_S.high)] = DELAY_S
    steps: Annotated[int, Field(ge=1)] | None = None

    @property
    def title(self) -> str:
        """Name of the model, its features and its delay."""
        if self.model == "ridge":
            return f"ridge, {self.window_s:g} s"
        shown = "columns" if self.features == "columns" else "strongest bin"
        late = f"after {self.delay_s:g} s" if self.delay_s else "at once"
        name = "kernel" if self.model == "kernel" else f"{self.model.upper()} {self.width}"
        return f"{name}, {shown}, {late}"


class Denoiser(Section):
    """Section ``[denoiser]``: how the denoiser of every fold learns."""

    file: Text | None = None
    """One that is there, by file or name, in place of one that learns in every fold."""
    model: Text = "s4"
    inputs: Inputs = "kinematics"
    options: dict[str, Any] = Field(default_factory=dict)
    steps: Annotated[int, Field(ge=1, le=1_000_000)] = 1_000
    """About so many batches are learnt from, whatever the amount of data."""
    minutes: Annotated[FiniteFloat, Field(gt=0, le=600)] | None = None
    """In place of ``steps``: what comes of it depends on the machine, and on what else it does."""
    segment_frames: Annotated[int, Field(ge=8, le=10_000)] = 24
    velocity_weight: Annotated[FiniteFloat, Field(ge=0)] = 1.0


class StudyPlan(Section):
    """Plan of a study: data, amounts, what is added, and how often."""

    format: Literal["sd2-study"] = "sd2-study"
    version: Literal[2] = 2
    title: Text
    out: Text  # folder of the results, relative to the plan's folder
    data: Annotated[tuple[Text, ...], Field(min_length=1)]
    """What a radar saw, as of ``sd2 classify``: pairs, data sets, recordings, radar files, or
    folders of them; ``PERSON=PATH`` names who is in recordings and radar files."""
    video: tuple[Text, ...] = ()
    """Pairs or data sets of further movements of which there is only video: those of people in
    ``data`` are added where these are filmed, those of others always."""
    labels: Text | None = None
    """Table of labels of takes (``sd2 pairs label``); None: those of the pairs."""
    classes: dict[str, str] = Field(default_factory=dict)
    """Class of a label; others are not learnt. Without any, as ``sd2 classify`` has them."""
    folds: Literal["people", "files"] = "people"
    """Who or what is kept apart: people, or parts into which all movements are dealt."""
    parts: Annotated[int, Field(ge=2, le=100)] = 5
    """Parts of the movements, of ``folds = "files"``; dealt anew by every seed."""
    turns: Literal["all", "once"] = "all"
    """Every ordered pair of who is judged and who is filmed is a fold, or everybody is judged
    once."""
    shares: Annotated[tuple[Share, ...], Field(min_length=1)] = (0.05, 0.1, 0.25, 0.5, 1.0)
    """Of the real frames of each class."""
    added: tuple[Added, ...] | None = None
    """None: what the data allow."""
    speeds: tuple[Annotated[FiniteFloat, Field(ge=0.25, le=4)], ...] = ()
    """Added maps are also played at these speeds: twice as fast, velocities are twice as large."""
    placements: bool = False
    """Range synthesis: maps as other placements of the sensor see them are added, too."""
    seeds: Annotated[int, Field(ge=1, le=1000)] = 3
    """Draws of the real frames, with a denoiser of its own each."""
    added_weight: Annotated[FiniteFloat, Field(gt=0, le=10)] = 0.3
    """Weight of all added frames together, beside 1 of the real ones."""
    classifiers: Annotated[tuple[Learner, ...], Field(min_length=1)] = (Learner(),)
    """The first is used for all; the others learn from all real data alone."""
    denoiser: Denoiser = Field(default_factory=Denoiser)

    @model_validator(mode="after")
    def _complete(self) -> StudyPlan:
        if self.denoiser.segment_frames <= OVERLAP:
            raise ValueError(f"segment_frames must be more than {OVERLAP}")
        return self

    @property
    def wanted(self) -> tuple[Added, ...]:
        """Kinds of synthetic data to add."""
        if self.added is not None:
            return self.added
        return ADDED if self.video else OF_VIDEO

    @property
    def learns_denoisers(self) -> bool:
        """True if a condition needs the fold's denoiser; a texture is known by it as well."""
        return self.denoiser.file is None and any(
            "denoised" in one or "texture" in one for one in self.wanted
        )


def study_text(plan: StudyPlan, folder: Path) -> str:
    """Write a plan as TOML, without what is as by default; paths in it stay as they are."""
    settings = plan.model_dump(mode="json", exclude_defaults=True)
    sections = {name: settings.pop(name) for name in ("classes", "denoiser") if name in settings}
    learners = settings.pop("classifiers", [])
    lines = toml_lines({"format": plan.format, "version": plan.version, **settings}, folder)
    for name, content in sections.items():
        lines += section_lines(name, content, folder)
    for one in learners:
        lines += ["", "[[classifiers]]", *toml_lines(one or {"model": "ridge"}, folder)]
    return "\n".join(lines) + "\n"


def read_study(path: Path) -> StudyPlan:
    """Read a TOML file; paths in the plan that is returned are absolute.

    Raises Sd2Error, with file, line and key, if it cannot be read or holds what is not allowed.
    """
    text = read_text(path, "a plan of a study (.toml)")
    plan = parsed(StudyPlan, text, str(path))
    folder = Path(path).absolute().parent

    def located(stored: str) -> str:
        return str(located_path(stored, folder))

    def source(stored: str) -> str:
        if Path(located(stored)).exists():
            return located(stored)
        path, person = LabelledSource.parsed(stored)
        return f"{person}={located(str(path))}" if person else located(stored)

    changes: dict[str, Any] = {
        "out": located(plan.out),
        "data": tuple(map(source, plan.data)),
        "video": tuple(map(located, plan.video)),
        "labels": None if plan.labels is None else located(plan.labels),
    }
    if (file := plan.denoiser.file) is not None and Path(located(file)).exists():
        changes["denoiser"] = plan.denoiser.model_copy(update={"file": located(file)})
    return plan.model_copy(update=changes)
