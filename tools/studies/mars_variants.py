"""Simulated pairs of MARS' movements as they were not recorded: more video for a study.

The bodies that a Kinect's skeletons drive (``sd2 pairs mars``), seen once more from other places
(``places``: within 25 degrees and 0.8 to 1.25 times as far), as bodies of other shape
(``shapes``), or turned left to right (``mirrored``). The radar of these pairs is simulated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from sd2core.body.rig import KeypointSpace
from sd2core.body.shape import ShapeSpace
from sd2core.cli.bars import bar
from sd2core.io.radar.mars import FRAMES_PER_S, mars_parts, read_mars
from sd2core.mesh.vertex_parts import PARTS
from sd2core.mocap.driving import KINECT_MARKERS, DrivenClip, puppet_of
from sd2core.mocap.mars_pairs import MarsChoices, body_doppler, seen_of, skeleton_clip
from sd2core.mocap.radar_place import RadarPlace, estimate_place
from sd2core.pairs.store import PairWriter, Take, TakeKey
from sd2core.sensor import VirtualSensor, aimed_at, position_from_spherical, spherical_from_position
from sd2core.simulate.campaign.radar import radar_at, radar_target
from sd2core.version import __version__

Variant = Literal["places", "shapes", "mirrored"]
VARIANTS: tuple[Variant, ...] = get_args(Variant)
CHOICES = MarsChoices(limbs=True)
_AWAY_DEG, _FARTHER = 25.0, (0.8, 1.25)


def make_variants(folders: Sequence[Path], out: Path, variant: Variant, seed: int = 1) -> None:
    """Write the takes of a variant that are not there."""
    synthesis = CHOICES.synthesis
    writer = PairWriter(
        out,
        kind="simulated",
        axis=synthesis.axis,
        null_bins=synthesis.null_bins,
        frame_rate_hz=FRAMES_PER_S,
        labels=("background",),
        provenance={
            "made_by": f"SD² Studio {__version__}, tools.studies.mars_variants",
            "variant": variant,
            "seed": seed,
        },
        parts=PARTS,
    )
    with bar(f"Simulating {variant}", "folder", total=len(folders)) as shown:
        for folder in folders:
            stretches = {
                TakeKey(part.subject, f"{part.name}-stretch-{number:02d}", 0): stretch
                for part in (read_mars(folder, name) for name in mars_parts(folder))
                for number, stretch in enumerate(part.stretches, start=1)
            }
            if not {*stretches} <= writer.done:
                clips = [skeleton_clip(one) for one in stretches.values()]
                puppet = puppet_of(clips, KINECT_MARKERS)
                driven = [puppet.pose(clip) for clip in clips]
                place = estimate_place(
                    [seen_of(a, b) for a, b in zip(driven, stretches.values(), strict=True)]
                )
                for number, (key, one) in enumerate(zip(stretches, driven, strict=True)):
                    if key not in writer.done:
                        rng = np.random.default_rng([seed, int(key.subject), number])
                        writer.append(_take(key, one, place, variant, rng))
            shown.update(1)


def _take(
    key: TakeKey, one: DrivenClip, place: RadarPlace, variant: Variant, rng: np.random.Generator
) -> Take:
    if variant == "shapes":
        space = ShapeSpace()
        shape = space.random(rng)
        puppet = replace(one.puppet, shape=shape, keypoints=KeypointSpace(space).of(shape))
        one = replace(one, puppet=puppet)
    else:
        place = replace(place, position_m=_elsewhere(one, place, variant, rng))
    found = body_doppler(one, CHOICES, place)
    times_s = one.clip.times_s
    mesh = one.mesh(times_s + place.offset_s, "low")
    axis = CHOICES.synthesis.axis
    sensor = aimed_at(VirtualSensor(place.position_m), _middle(one))
    radar = radar_target(
        mesh,
        radar_at(FRAMES_PER_S, axis.bins),
        sensor,
        axis,
        (),
        seed=rng.integers(2**31, size=2).tolist(),
    )
    label = np.zeros(len(times_s), np.int8)
    synthetic = np.ascontiguousarray(found.values.T)
    position = np.array(place.position_m)
    return Take(key.subject, key.name, synthetic, radar, times_s, label, position, 0, found.limbs)


def _middle(one: DrivenClip) -> tuple[float, float, float]:
    x, y, z = one.landmarks_m.mean(axis=(0, 1)).tolist()
    return x, y, z


def _elsewhere(
    one: DrivenClip, place: RadarPlace, variant: Variant, rng: np.random.Generator
) -> tuple[float, float, float]:
    """A place near the radar's, or its mirror image in the plane from the camera to the body."""
    x, y, z = place.position_m
    middle = _middle(one)
    if variant == "mirrored":
        return 2.0 * middle[0] - x, y, z
    range_m, azimuth_deg, elevation_deg = spherical_from_position(middle, place.position_m)
    return position_from_spherical(
        middle,
        range_m * float(rng.uniform(*_FARTHER)),
        azimuth_deg + float(rng.uniform(-_AWAY_DEG, _AWAY_DEG)),
        elevation_deg + float(rng.uniform(-10.0, 10.0)),
    )
