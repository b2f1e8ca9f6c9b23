"""Fits with all of their arrays in memory."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

import numpy as np

from sd2core.body.camera import PinholeCamera
from sd2core.body.fit import Fitting
from sd2core.body.fitted import BodyFit, FittedMotion, Pose, mean_over_limbs
from sd2core.body.lifter import LiftedTrack
from sd2core.body.model import Resolution
from sd2core.body.track import LandmarkTrack
from sd2core.mesh.sequence import MeshSequence
from sd2core.progress import Progress, silent


def fit_body(
    track: LandmarkTrack,
    camera: PinholeCamera,
    *,
    stature_m: float | None = None,
    lifted: LiftedTrack | None = None,
    workspace: Path | None = None,
    progress: Progress = silent,
) -> BodyFit:
    """Fit a body to landmarks, whose depth the bundled lifter gives where it is not given."""
    parts = list(Fitting(track, camera, stature_m, lifted, workspace).finished(progress))
    arrays = {
        field.name: np.concatenate([getattr(part, field.name) for part in parts])
        for field in fields(BodyFit)
        if field.name not in ("timebase", "shape")
    }
    return BodyFit(timebase=track.timebase, shape=parts[0].shape, **arrays)


def mesh_of(fit: BodyFit, resolution: Resolution) -> MeshSequence:
    """The moving surface, posed where it is read."""
    motion = FittedMotion(
        timebase=fit.timebase,
        shape=fit.shape,
        pose=Pose(fit.turns, fit.translation_m),
        present=fit.present,
        along_sd_mps=mean_over_limbs(fit.along_sd_mps),
        across_sd_mps=mean_over_limbs(fit.across_sd_mps),
        seen=np.isfinite(fit.residual_m).mean(axis=0),
        residual_m=float(np.nanmean(fit.residual_m)),
        quality=float(fit.quality.mean()),
    )
    return motion.mesh(resolution)
