"""Comparison of drawn errors with measured ones: disturbed clips, scored as fits are."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from sd2core.body.shape import ShapeSpace
from sd2core.body.skinning import pose_vertices
from sd2core.io.mesh import load_mesh
from sd2core.mesh.sequence import MeshSequence
from sd2core.progress import Progress, silent
from sd2core.simulate.campaign.fit_errors import FitErrors
from sd2core.timebase import Timebase
from tools.fitting.clip_score import ClipScore, score_clip
from tools.fitting.clips import RESOLUTION, clip_named, scene
from tools.fitting.report import reach_table
from tools.fitting.truth import Truth

SHOWN = (
    "hands during gestures, line-of-sight velocity: RMS error",
    "hands during gestures, line-of-sight velocity: correlation",
    "wrists during gestures, line-of-sight velocity: RMS error",
    "wrists during gestures, line-of-sight velocity: correlation",
    "elbows during gestures, line-of-sight velocity: RMS error",
    "elbows during gestures, line-of-sight velocity: correlation",
    "fast swipes: peak hand speed kept, along the line of sight",
    "fast swipes: peak hand speed kept, in space",
    "who stands still: false velocity, RMS over vertices",
    "Doppler map of the gestures, relative L1",
    "joints: mean distance",
    "joints: mean distance from the pelvis",
)
"""Rows of :func:`~tools.fitting.report.reach_table` that are compared."""


class Likeness(NamedTuple):
    """One figure of measured fits and of disturbed bodies.

    Parameters
    ----------
    drawn : tuple of float
        One for each draw of errors.
    """

    what: str
    unit: str
    measured: float
    drawn: tuple[float, ...]


def disturb(truth: Truth, errors: FitErrors, rng: np.random.Generator) -> MeshSequence:
    """A clip's true body with drawn errors."""
    space = ShapeSpace()
    known = scene(clip_named(truth.name), space)
    drawn = errors.draw(rng)
    shape = drawn.shape(known.shape)
    transforms = drawn.transforms(known.skeleton, known.transforms, space.skeleton(shape))
    body = space.load(RESOLUTION, shape)
    vertices = pose_vertices(body, transforms)
    return MeshSequence(vertices, body.faces, Timebase(known.times_s), "disturbed body")


def compare_errors(
    truths: Sequence[Truth],
    fits: Path,
    errors: FitErrors,
    draws: int,
    progress: Progress = silent,
) -> list[Likeness]:
    """Score kept fits and disturbed bodies of the same clips.

    Parameters
    ----------
    fits : Path
        Folder with ``NAME.zarr``, as ``python -m tools.fitting score --keep`` leaves them.
    draws : int
        Of errors, with seeds 0, 1 ...
    progress : Progress
        Counts clips that are scored.
    """
    total, done = (draws + 1) * len(truths), 0
    tables = []
    for draw in range(-1, draws):
        scores: list[ClipScore] = []
        for number, truth in enumerate(truths):
            progress(done, total)
            mesh = (
                load_mesh(fits / f"{truth.name}.zarr")
                if draw < 0
                else disturb(truth, errors, np.random.default_rng([draw, number]))
            )
            scores.append(score_clip(truth, mesh))
            done += 1
        tables.append({row.what: row for row in reach_table(scores)})
    progress(total, total)
    return [
        Likeness(
            what,
            tables[0][what].unit,
            tables[0][what].value,
            tuple(table[what].value for table in tables[1:]),
        )
        for what in SHOWN
    ]
