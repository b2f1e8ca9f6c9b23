"""One take of a simulated campaign: a motion, what a fit of its video would be, both maps."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.body.limbs import LIMBS, vertex_limbs
from sd2core.body.model import Body, Resolution
from sd2core.body.parts import synthetic_map
from sd2core.body.rotations import Floats
from sd2core.body.shape import BodyShape, ShapeSpace
from sd2core.body.skinning import pose_vertices
from sd2core.doppler import PRESETS, Synthesizer
from sd2core.doppler.options import SynthesisOptions
from sd2core.errors import Sd2Error
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.velocity_uncertainty import VelocityUncertainty
from sd2core.mocap.body_motion import Role
from sd2core.pairs.store import Take
from sd2core.radar_config import PAPER_RADAR, RadarConfig
from sd2core.simulate.campaign.captured import CapturedMotions
from sd2core.simulate.campaign.fit_errors import FitErrors
from sd2core.simulate.campaign.motion import perform
from sd2core.simulate.campaign.protocol import VARIED, Protocol
from sd2core.simulate.campaign.radar import PROCESSING, TargetOptions, radar_target
from sd2core.simulate.campaign.scene import kept_away, random_setting, random_subject
from sd2core.simulate.gait import GRID_HZ
from sd2core.timebase import Timebase

FITTED: Resolution = "medium"
"""The surface that ``sd2 fit`` writes by default: shares of vertices depend on it."""

TRUE: Resolution = "low"
"""Echoes of a rough surface depend little on how finely it is cut (decision 26)."""

OPTIONS = PRESETS["paper"]
"""Synthesis of the maps, where a campaign has no other axis."""

_STATED = 0.3
"""Standard deviation of the logarithm of a stated error over the true one: of a body, of a limb."""

_TAKE = 0  # subjects have 1 in this place of the seed
_MOTION, _SETTING, _FIT, _RADAR = range(4)


@dataclass(frozen=True)
class Campaign:
    """Settings that all takes of a campaign share."""

    seed: int = 0
    take_seconds: float = 15.0
    placements: int = 1  # Sensors that see every take.
    radar: RadarConfig = PAPER_RADAR
    target: TargetOptions = field(default_factory=TargetOptions)
    limbs: bool = False  # The input is also split by the parts of the body.
    protocol: Protocol = VARIED
    motions: Path | None = None  # Folder of recorded motions, for a protocol that has them.
    role: Role = "learn"  # People of that folder.
    # Factor of the errors of a take's fit, drawn between these; 1: as measured, 0: none.
    error_sizes: tuple[float, float] = (1.0, 1.0)
    synthesis: SynthesisOptions = OPTIONS  # Its axis is that of the radar's maps, too.

    def __post_init__(self) -> None:
        if self.seed < 0:
            raise Sd2Error(f"The seed is {self.seed}", "0 or more")
        if not 2.0 <= self.take_seconds <= 600.0:
            raise Sd2Error(f"A take of {self.take_seconds:g} s", "2 to 600 s")
        if self.placements < 1:
            raise Sd2Error(f"{self.placements} placements", "at least one")
        if (self.motions is None) != (self.protocol.movements == "swipes"):
            raise Sd2Error(
                f"Movements {self.protocol.movements} and recorded motions from {self.motions}",
                "recorded motions for movements captured or both, and for those only",
                "Say with --motions where they are",
            )
        steps = GRID_HZ * self.radar.frame_repetition_s
        pacing = self.protocol.others and self.protocol.movements != "captured"
        if pacing and abs(steps - round(steps)) > 1e-6:
            raise Sd2Error(
                f"People pace, and {1.0 / self.radar.frame_repetition_s:g} frames/s",
                f"a rate that {GRID_HZ:g} is a multiple of",
                "Choose another one, e.g. --rate 24",
            )
        least, most = self.error_sizes
        if not 0.0 <= least <= most <= 10.0:
            raise Sd2Error(f"Errors of fits {least:g} to {most:g} times as large", "0 to 10 times")

    @property
    def frames(self) -> int:
        """Number of radar frames in one take."""
        return round(self.take_seconds / self.radar.frame_repetition_s)

    def provenance(self) -> dict[str, Any]:
        """Settings that determine the takes, without their number."""
        return {
            "made_by": "sd2 simulate campaign",
            "simulated": True,
            "seed": self.seed,
            "take_seconds": self.take_seconds,
            "radar": self.radar.as_dict(),
            "target": {**self.target.provenance(), "clutter": PROCESSING.clutter},
            "surfaces": {"synthetic": FITTED, "radar": TRUE},
            "synthesis": asdict(self.synthesis),
            **self.protocol.provenance(),
            # Campaigns of before say nothing: their errors were as measured.
            **({} if self.error_sizes == (1.0, 1.0) else {"error_sizes": self.error_sizes}),
        }


def motions_of(campaign: Campaign, space: ShapeSpace) -> CapturedMotions | None:
    """Recorded motions of a campaign, if it has any."""
    if campaign.motions is None:
        return None
    return CapturedMotions(campaign.motions, campaign.role, space)


class TakeMaker:
    """Maker of the takes of one campaign; each depends on its numbers alone.

    ``errors`` are those of fits to its videos; by default there are none.
    """

    def __init__(self, campaign: Campaign, errors: FitErrors | None = None) -> None:
        self._campaign = campaign
        self._errors = errors
        self._space = ShapeSpace()
        self._captured = motions_of(campaign, self._space)
        self._bodies: dict[Resolution, tuple[Body, Floats]] = {
            resolution: (Body.load(resolution), self._space.directions_m(resolution))
            for resolution in (TRUE, FITTED)
        }

    def make(self, subject_number: int, number: int) -> list[Take]:
        """One take as every placement sees it, by the numbers of subject and take from 0 on."""
        campaign = self._campaign
        rngs = [
            np.random.default_rng([campaign.seed, _TAKE, subject_number, number, part])
            for part in range(_RADAR)
        ]
        subject = random_subject(self._space, campaign.seed, subject_number)
        skeleton = self._space.skeleton(subject.shape)
        times_s = campaign.radar.frame_repetition_s * np.arange(campaign.frames, dtype=np.float64)
        setting = random_setting(
            rngs[_SETTING],
            subject.shape.stature_m,
            campaign.placements,
            campaign.radar,
            campaign.protocol,
        )
        if self._captured is not None and campaign.protocol.captured(number):
            performed = self._captured.perform(
                rngs[_MOTION], subject, subject_number, skeleton, times_s
            )
            times_s = times_s[: len(performed.label)]
            setting = setting.turned(rngs[_SETTING])
        else:
            performed = perform(
                rngs[_MOTION],
                subject,
                skeleton,
                self._space.base_skeleton,
                times_s,
                protocol=campaign.protocol,
                number=number,
            )
        transforms = setting.place(skeleton.transforms(*performed.motion))
        if performed.kind == "captured":
            transforms = kept_away(transforms)
        true = self._mesh(TRUE, subject.shape, transforms, times_s)
        fitted = self._fitted(rngs[_FIT], subject.shape, transforms, true)
        synthesizer = Synthesizer(fitted, campaign.synthesis, threads=1)
        seed = [campaign.seed, _TAKE, subject_number, number, _RADAR]
        target = campaign.target
        if campaign.protocol.drawn_radars:
            target = target.drawn(np.random.default_rng([*seed, _TAKE]))
        takes = []
        for placement, sensor in enumerate(setting.sensors):
            radar = radar_target(
                true,
                campaign.radar,
                sensor,
                campaign.synthesis.axis,
                campaign.synthesis.null_bins,
                reflectors=setting.reflectors,
                seed=[*seed, placement],
                options=target,
            )
            synthetic = synthetic_map(synthesizer, sensor, limbs=campaign.limbs)
            takes.append(
                Take(
                    subject.name,
                    take_name(number),
                    np.ascontiguousarray(synthetic.values.T),
                    radar,
                    times_s,
                    performed.label,
                    np.array(sensor.position_m),
                    placement,
                    synthetic.limbs,
                )
            )
        return takes

    def _fitted(
        self, rng: np.random.Generator, shape: BodyShape, transforms: Floats, true: MeshSequence
    ) -> MeshSequence:
        """The mesh that a fit of this take's video might give, with the errors that it states."""
        if self._errors is None:
            return self._mesh(FITTED, shape, transforms, true.times_s)
        drawn = self._errors.draw(rng)
        drawn = drawn.scaled(float(rng.uniform(*self._campaign.error_sizes)))
        wrong_shape = drawn.shape(shape)
        held = drawn.transforms(
            self._space.skeleton(shape), transforms, self._space.skeleton(wrong_shape)
        )
        fitted = self._mesh(FITTED, wrong_shape, held, true.times_s)
        wrong = self._mesh(TRUE, wrong_shape, held, true.times_s)
        low, medium = (self._bodies[resolution][0] for resolution in (TRUE, FITTED))
        sizes = limb_errors(true, wrong, vertex_limbs(low))
        # A fit is right about its errors on average, and about a clip's to half as much again.
        sizes *= np.exp(rng.normal(0.0, _STATED, (2, 1)) + rng.normal(0.0, _STATED, sizes.shape))
        stated = np.repeat(sizes[:, None], len(true.times_s), axis=1)
        return replace(
            fitted, uncertainty=VelocityUncertainty(LIMBS, vertex_limbs(medium), *stated)
        )

    def _mesh(
        self, resolution: Resolution, shape: BodyShape, transforms: Floats, times_s: Floats
    ) -> MeshSequence:
        body = self._space.shaped(*self._bodies[resolution], shape)
        vertices = pose_vertices(body, transforms)
        return MeshSequence(vertices, body.faces, Timebase(times_s), source="simulated body")


def limb_errors(true: MeshSequence, fitted: MeshSequence, limbs: NDArray[np.uint8]) -> Floats:
    """Errors of limbs' velocities, m/s: along the camera's line of sight and across, (2, L).

    Root mean squares over a clip of two meshes of the same vertices, whose limbs are given, (V,).
    """
    places_m = np.asarray(true.vertices, np.float64)
    off_mps = np.gradient(np.asarray(fitted.vertices, np.float64) - places_m, true.times_s, axis=0)
    line = places_m / np.linalg.norm(places_m, axis=2, keepdims=True)
    along = np.einsum("tvk,tvk->tv", off_mps, line) ** 2
    across = 0.5 * ((off_mps**2).sum(axis=2) - along)
    squares = np.stack([each.mean(axis=0) for each in (along, across)])  # (2, V)
    counts = np.bincount(limbs, minlength=len(LIMBS))
    return np.sqrt([np.bincount(limbs, each, len(LIMBS)) / counts for each in squares.clip(0.0)])


def take_name(number: int) -> str:
    """``take-0001``, ``take-0002`` … of a subject's takes from 0 on."""
    return f"take-{number + 1:04d}"
