"""Pairs of what a fit of each take shows and what a simulated radar shows of the person."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import numpy as np

from sd2core import PAPER_RADAR, MeshSequence, Sd2Error, Synthesizer, VirtualSensor
from sd2core.body.parts import synthetic_map
from sd2core.body.skinning import pose_vertices
from sd2core.body.track import LANDMARKS
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
from tools.fitting.whole_fit import fit_body, mesh_of
from tools.train_lifter.fits import track_of
from tools.train_lifter.takes import Motion, Stage, load_takes

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
        fitted = mesh_of(fit_body(track, take.camera, stature_m=take.stature_m), FITTED)
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
