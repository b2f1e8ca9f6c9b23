"""Fits of drawn takes, whose motion is known, and pairs of them with what a radar shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sd2core import PAPER_RADAR, MeshSequence, Sd2Error, Synthesizer, VirtualSensor
from sd2core.body.fit import Fitting, fit_motion, speed_mps
from sd2core.body.landmark_repair import repair_landmarks
from sd2core.body.landmarks import DEFAULT_MAX_GAP_S
from sd2core.body.lifter import Lifter, fit_law_terms
from sd2core.body.lifter_features import RATE_HZ
from sd2core.body.parts import synthetic_map
from sd2core.body.person_selection import FOUND
from sd2core.body.raw_track import RawTrack
from sd2core.body.skinning import pose_vertices
from sd2core.body.track import LANDMARKS, LandmarkTrack
from sd2core.compare.measures import line_of_sight_velocity
from sd2core.mesh.vertex_parts import PARTS
from sd2core.options.records import ARGUMENT
from sd2core.pairs.store import PairWriter
from sd2core.pairs.store import Take as Pair
from sd2core.pairs.summary import TakeKey
from sd2core.progress import Progress, silent
from sd2core.sensor import Vector, aimed_at, position_from_spherical
from sd2core.simulate.campaign.motion import LABELS
from sd2core.simulate.campaign.radar import TargetOptions, radar_target
from sd2core.simulate.campaign.scene import RANGES_M
from sd2core.simulate.campaign.takes import FITTED, OPTIONS, TRUE
from sd2core.timebase import Timebase
from tools.train_lifter.takes import Motion, Stage, Take, load_takes

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]

_MIN_MPS = 0.01
_WITHIN = 0.68


class FittedTake(NamedTuple):
    """Velocities of the 33 landmarks of one take, (T, 33)."""

    speed_mps: Floats  # in space, of the fitted ones
    # Along the line of sight.
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
    done, notes = repair_landmarks(raw, DEFAULT_MAX_GAP_S)
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
        lifted = lifter.lift(track, take.camera)
        fit = Fitting(track, take.camera, take.stature_m, lifted, None)
        fitted_m = np.concatenate([part.keypoints_m for part in fit.finished(silent)])
        times_s = track.timebase.times_s
        fitted_mps, true_mps = (
            line_of_sight_velocity(points_m, times_s)
            for points_m in (fitted_m, take.keypoints_m.astype(np.float64))
        )
        lifted_mps = take.stature_m * lifted.velocity_sigma
        fast_mps = speed_mps(fitted_m, times_s)
        fitted.append(FittedTake(fast_mps, fitted_mps, true_mps, lifted_mps))
    return fitted


def fit_law(takes: Sequence[Take], lifter: Lifter, progress: Progress = silent) -> Singles:
    """Law of the deviations of fits, by the errors in takes of people not learnt from.

    Powers by least squares on the logarithms of the errors; then the factor of each landmark that
    makes 68 % of its errors lie within.
    """
    fits = fitted_takes(takes, lifter, progress)
    errors = np.concatenate([np.abs(fit.fitted_mps - fit.true_mps) for fit in fits])
    terms = np.concatenate(
        [np.log(fit_law_terms(fit.lifted_sd_mps, fit.speed_mps)) for fit in fits]
    )
    logarithms = np.log(errors + _MIN_MPS)
    centred = (terms - terms.mean(axis=0)).reshape(-1, 2)
    powers = np.linalg.lstsq(centred, (logarithms - logarithms.mean(axis=0)).ravel())[0]
    ratios = errors / np.exp(terms @ powers)
    factors = np.log(np.quantile(ratios, _WITHIN, axis=0))
    return np.concatenate([powers, factors]).astype(np.float32)


_BESIDE_M = 0.25
_TRUNK = [LANDMARKS.index(f"{place}.{side}") for place in ("shoulder", "hip") for side in "LR"]
_GROUPS, _PLACEMENTS = 10, 2
_SAME_M = 1e-3


class Pairs(Motion):
    """Options of ``pairs``.

    Parameters
    ----------
    data : DATA
        folder of the takes
    out : FILE
        to write (.zarr)
    """

    data: Annotated[Path, ARGUMENT]
    out: Path


def make_pairs(options: Pairs, progress: Progress = silent) -> int:
    """Add a pair for every take in which the person is seen throughout; return their number.

    Each take is seen by two drawn radars, beside the camera and from anywhere around. Raises
    Sd2Error if the takes were not made with the same options.
    """
    writer = PairWriter(
        options.out,
        kind="simulated",
        axis=OPTIONS.axis,
        null_bins=OPTIONS.null_bins,
        frame_rate_hz=1.0 / PAPER_RADAR.frame_repetition_s,
        labels=LABELS,
        provenance={
            "made_by": "python -m tools.train_lifter pairs",
            "simulated": True,
            "radar": PAPER_RADAR.as_dict(),
            "synthesis": asdict(OPTIONS),
        },
        parts=PARTS,
    )
    made = 0
    takes, stage = load_takes(options.data), Stage(options.loaded())
    for number, take in enumerate(takes):
        progress(number, len(takes))
        scene = stage.drawn(options.generator(number), options, len(take.confidence))
        if not np.allclose(scene.keypoints_m, take.keypoints_m, atol=_SAME_M):
            raise Sd2Error(
                f"Take {number} shows another person, or other motion",
                "the seed, manner and motions that the takes were made with",
            )
        subject = f"{options.data.name}-{number % _GROUPS}"
        name = f"take-{number:05d}"
        if TakeKey(subject, name, 0) in writer.done:
            continue
        track = track_of(take)
        if not track.present.all():
            continue
        fitted = fit_motion(track, take.camera, stature_m=take.stature_m).mesh(FITTED)
        body = stage.space.load(TRUE, scene.shape)
        vertices = pose_vertices(body, scene.transforms)
        true = MeshSequence(vertices, body.faces, fitted.timebase, source="simulated body")
        synthesizer = Synthesizer(fitted, OPTIONS, threads=1)
        chest_m = tuple(take.keypoints_m[:, _TRUNK].mean(axis=(0, 1)).tolist())
        for placement in range(_PLACEMENTS):
            rng = options.generator(number, placement)
            sensor = _sensor(rng, chest_m, placement)
            radar = radar_target(
                true,
                PAPER_RADAR,
                sensor,
                OPTIONS.axis,
                OPTIONS.null_bins,
                seed=(options.seed, int(options.held_out), number, placement),
                options=TargetOptions().drawn(rng),
            )
            synthetic = synthetic_map(synthesizer, sensor, limbs=True)
            writer.append(
                Pair(
                    subject,
                    name,
                    np.ascontiguousarray(synthetic.values.T),
                    radar,
                    fitted.times_s,
                    np.zeros(len(fitted.times_s), np.int8),
                    np.array(sensor.position_m),
                    placement,
                    synthetic.limbs,
                )
            )
        made += 1
    progress(len(takes), len(takes))
    return made


def _sensor(rng: np.random.Generator, chest_m: Vector, placement: int) -> VirtualSensor:
    """One beside the camera, or anywhere around the person."""
    if placement:
        place_m = position_from_spherical(
            chest_m,
            float(rng.uniform(*RANGES_M)),
            float(rng.uniform(-180.0, 180.0)),
            float(rng.uniform(-10.0, 25.0)),
        )
    else:
        x_m, y_m = rng.uniform(-_BESIDE_M, _BESIDE_M, 2).tolist()
        place_m = (x_m, y_m, 0.0)
    return aimed_at(VirtualSensor(place_m), chest_m)
