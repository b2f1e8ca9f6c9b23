"""Fit of a short clip with everything in memory, to be measured frame by frame."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.body.camera import PinholeCamera
from sd2core.body.fit import Fitting, Lift
from sd2core.body.fitted import PER_FRAME, BodyFit, FittedMotion, Pose, mean_over_limbs
from sd2core.body.model import Resolution
from sd2core.body.track import Landmarks
from sd2core.mesh.sequence import MeshSequence
from sd2core.progress import Progress, silent


def fit_body(
    track: Landmarks,
    camera: PinholeCamera,
    *,
    stature_m: float | None = None,
    lift: Lift | None = None,
    workspace: Path | None = None,
    progress: Progress = silent,
) -> BodyFit:
    """Fit a body to landmarks, with everything in memory.

    ``lift`` gives the landmarks their depth, by default the bundled lifter; the rest is as in
    :func:`~sd2core.body.fit.fit_motion`.
    """
    fitting = Fitting(track, camera, stature_m, lift, workspace)
    parts = list(fitting.finished(progress))

    def joined(name: str) -> NDArray[Any]:
        return np.concatenate([getattr(part, name) for part in parts])

    return BodyFit(
        timebase=track.timebase,
        shape=parts[0].shape,
        **{name: joined(name) for name in PER_FRAME},
    )


def mesh_of(fit: BodyFit, resolution: Resolution) -> MeshSequence:
    """The moving surface, posed where it is read."""
    motion = FittedMotion(
        timebase=fit.timebase,
        shape=fit.shape,
        poses=Pose(fit.turns, fit.translation_m).at,
        present=fit.present,
        along_sd_mps=mean_over_limbs(fit.along_sd_mps),
        across_sd_mps=mean_over_limbs(fit.across_sd_mps),
        seen=np.isfinite(fit.residual_m).mean(axis=0),
        residual_m=float(np.nanmean(fit.residual_m)),
        quality=float(fit.quality.mean()),
    )
    return motion.mesh(resolution)
