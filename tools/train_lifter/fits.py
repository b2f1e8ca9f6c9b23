"""Fits of drawn takes, whose motion is known: what ``sd2 fit`` would make of their landmarks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sd2core.body.fit import speed_mps
from sd2core.body.fitted import BodyFit
from sd2core.body.landmark_repair import repair_landmarks
from sd2core.body.landmarks import DEFAULT_MAX_GAP_S
from sd2core.body.lifter import LiftedInParts, Lifter, fit_law_terms
from sd2core.body.lifter_features import RATE_HZ
from sd2core.body.person_selection import FOUND
from sd2core.body.raw_track import RawTrack
from sd2core.body.track import LandmarkTrack
from sd2core.compare.measures import line_of_sight_velocity
from sd2core.progress import Progress, silent
from sd2core.timebase import Timebase
from tools.fitting.whole_fit import fit_body
from tools.train_lifter.takes import Take

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]

_MIN_MPS = 0.01
_WITHIN = 0.68


class FittedTake(NamedTuple):
    """Velocities of the 33 landmarks of one take along the line of sight, (T, 33)."""

    fit: BodyFit
    track: LandmarkTrack
    fitted_mps: Floats
    true_mps: Floats
    lifted_sd_mps: Floats  # deviations of the lifter's


def track_of(take: Take) -> LandmarkTrack:
    """Landmarks of a take, repaired as those of a video are."""
    frames = len(take.confidence)
    present = take.confidence >= FOUND
    raw = RawTrack(
        times_s=np.arange(frames) / RATE_HZ,
        present=present,
        bridged=np.zeros(frames, bool),
        **{
            name: np.where(_like(present, getattr(take, name)), getattr(take, name), np.nan)
            for name in ("image_px", "depth_px", "world_m")
        },
        visibility=np.where(present[:, None], take.visibility, 0.0).astype(np.float32),
    )
    repaired: list[RawTrack] = []
    notes = repair_landmarks(raw.part, raw.times_s, present, DEFAULT_MAX_GAP_S, repaired.append)
    (done,) = repaired
    arrays = {name: value for name, value in vars(done).items() if name != "times_s"}
    return LandmarkTrack(
        timebase=Timebase(raw.times_s),
        width=take.camera.width,
        height=take.camera.height,
        confidence=np.where(present, take.confidence, 0.0).astype(np.float32),
        silhouette_frames=np.empty(0, np.intp),
        silhouettes=np.empty((0, 1, 1), np.uint8),
        notes=notes,
        **arrays,
    )


def repaired(take: Take) -> Take:
    """A take with its landmarks as the lifter gets them; frames that stay empty as they were."""
    track = track_of(take)
    arrays = {
        name: np.where(_like(track.present, own := getattr(take, name)), getattr(track, name), own)
        for name in ("image_px", "depth_px", "world_m", "visibility")
    }
    sure = np.where(track.bridged, 0.0, take.confidence).astype(np.float32)
    return replace(take, confidence=sure, **arrays)


def _like(present: NDArray[np.bool_], values: NDArray[np.float32]) -> NDArray[np.bool_]:
    return present.reshape(-1, *(1,) * (values.ndim - 1))


def fitted_takes(
    takes: Sequence[Take], lifter: Lifter, progress: Progress = silent
) -> list[FittedTake]:
    """Fit takes in which the person is seen throughout; the person's height is known."""
    fitted = []
    for number, take in enumerate(takes):
        progress(number, len(takes))
        track = track_of(take)
        if not track.present.all():
            continue
        lifted = LiftedInParts(lifter, track, take.camera)
        fit = fit_body(
            track, take.camera, stature_m=take.stature_m, lift=lambda *_, lifted=lifted: lifted
        )
        times_s = track.timebase.times_s
        fitted_mps, true_mps = (
            line_of_sight_velocity(points_m, times_s)
            for points_m in (fit.keypoints_m, take.keypoints_m.astype(np.float64))
        )
        lifted_mps = take.stature_m * lifted.part(0, len(track)).velocity_sigma
        fitted.append(FittedTake(fit, track, fitted_mps, true_mps, lifted_mps))
    return fitted


def fit_law(takes: Sequence[Take], lifter: Lifter, progress: Progress = silent) -> Singles:
    """Law of the deviations of fits, by the errors in takes of people not learnt from.

    Powers by least squares on the logarithms of the errors; then the factor of each landmark that
    makes 68 % of its errors lie within.
    """
    fits = fitted_takes(takes, lifter, progress)
    errors = np.concatenate([np.abs(fit.fitted_mps - fit.true_mps) for fit in fits])
    terms = np.concatenate(
        [
            np.log(
                fit_law_terms(
                    fit.lifted_sd_mps, speed_mps(fit.fit.keypoints_m, fit.track.timebase.times_s)
                )
            )
            for fit in fits
        ]
    )
    logarithms = np.log(errors + _MIN_MPS)
    centred = (terms - terms.mean(axis=0)).reshape(-1, 2)
    powers = np.linalg.lstsq(centred, (logarithms - logarithms.mean(axis=0)).ravel())[0]
    ratios = errors / np.exp(terms @ powers)
    factors = np.log(np.quantile(ratios, _WITHIN, axis=0))
    return np.concatenate([powers, factors]).astype(np.float32)
