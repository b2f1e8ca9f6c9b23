"""Simulated pairs of a K60168A's gestures, which ``tools.documentation.studies`` makes.

Bodies of the program before a radar on a table make three movements of a hand as the sensor's
recordings seem to show them: to one side past the sensor, to the other, and a fist that is pushed
towards it and drawn back. Sizes, radii, speeds, places and rests are drawn for every take.
Synthetic maps and a simulated 60 GHz radar have the bins and the frame rate of the recordings;
what stands still is added as such a sensor shows it, with the side lobes of a spectrum without
taper.
"""

from __future__ import annotations

from dataclasses import astuple, dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sd2core.body.model import Body, Resolution
from sd2core.body.rotations import Floats
from sd2core.body.shape import ShapeSpace
from sd2core.body.skinning import pose_vertices
from sd2core.cli.bars import bar
from sd2core.doppler import PRESETS, Synthesizer
from sd2core.io.radar.kkt import BIN_WIDTH_MPS, FRAME_S
from sd2core.mesh.sequence import MeshSequence
from sd2core.pairs.store import PairWriter, Take
from sd2core.pairs.summary import TakeKey
from sd2core.radar_config import PAPER_RADAR
from sd2core.sensor import VelocityAxis, VirtualSensor
from sd2core.simulate.campaign.motion import Move, arm_through_time
from sd2core.simulate.campaign.radar import TargetOptions, radar_target
from sd2core.simulate.campaign.scene import random_subject
from sd2core.simulate.limbs import ArmPose, arm_length_m, reach, relax_fingers, turn_torso
from sd2core.simulate.people.signals import wander
from sd2core.timebase import Timebase
from sd2core.version import __version__

LABELS = ("background", "FirstGesture", "SecondGesture", "ThirdGesture")
FRAMES = 70
AXIS = VelocityAxis(31, 31 * BIN_WIDTH_MPS / 2)
_CHIRPS = 16
_PEOPLE, _TAKES, _SEED = 8, 8, 1
"""Takes are of each person and label."""
RADAR = replace(
    PAPER_RADAR,
    name="60 GHz, 16 chirps, as a K60168A's bins",
    chirps_per_frame=_CHIRPS,
    chirp_repetition_s=PAPER_RADAR.wavelength_m / (2 * 32 * BIN_WIDTH_MPS),
    frame_repetition_s=FRAME_S,
)
SYNTHESIS = replace(PRESETS["paper"], axis=AXIS, null_bins=(), visibility="facing")
RESOLUTION: Resolution = "low"
_RADIUS_M = (0.12, 0.5)
"""Nearest the wrist comes to the sensor."""
_STROKES_S = {1: (0.5, 1.0), 2: (0.45, 0.9), 3: (0.4, 0.8)}
_NEAREST = {1: (0.15, 0.5), 2: (0.35, 0.65)}
"""Share of the way at which the hand is nearest."""
_SPREAD = np.array([8.0, 6.0, 0.03, 0.1, 0.1, 0.1, 15.0, 10.0, 2.0])
_SIZES = {1: (0.4, 0.8), 2: (0.7, 1.0), 3: (0.4, 0.9)}
"""Share of the way that is gone."""
_BACK_S = (0.15, 0.5)
_STILL_DB = (-10.0, 3.0)
"""Echo of what stands still, against the loudest moving cell of the take."""
_NOISE_DB = (-30.0, -22.0)


def _pose(azimuth_deg: float, elevation_deg: float, reach_m: float) -> Floats:
    own = ArmPose(azimuth_deg, elevation_deg, reach_m, 0.5, 0.9, 0.3, 30.0, 0.0, 0.0)
    return np.array(astuple(own))


_RIGHT, _LEFT = _pose(-50.0, -15.0, 0.45), _pose(32.0, -15.0, 0.42)
_NEAR, _AHEAD = _pose(-5.0, -15.0, 0.28), _pose(-5.0, -15.0, 0.5)
_WAYS = {1: (_LEFT, _RIGHT), 2: (_RIGHT, _LEFT), 3: (_NEAR, _AHEAD)}


@dataclass(frozen=True, eq=False)
class Deed:
    """Movement of the hand in one take."""

    moves: list[Move]
    label: NDArray[np.int8]
    nearest_s: float  # When the hand is nearest to the sensor.


def drawn_deed(rng: np.random.Generator, number: int, times_s: Floats) -> Deed:
    """Draw the movement of a gesture's number, or a hand that rests or wanders (0)."""
    label = np.zeros(len(times_s), np.int8)
    begin_s = float(rng.uniform(0.3, 1.2))
    moves: list[Move] = []

    def move(start_s: float, length_s: float, to: Floats) -> float:
        bow = rng.normal(0.0, 1.0, 9) * [3.0, 5.0, 0.03, 0, 0, 0, 5.0, 5.0, 0]
        skew = float(np.exp(rng.normal(0.0, 0.2)))
        moves.append(Move(start_s, start_s + length_s, to, bow, skew))
        return start_s + length_s

    if number == 0:
        first = _NEAR + 0.7 * _SPREAD * rng.standard_normal(9)
        move(-1.0, 0.5, first)
        if rng.random() < 0.3:
            move(begin_s, float(rng.uniform(0.8, 1.5)), first + 0.5 * _SPREAD)
        return Deed(moves, label, 0.0)
    way = [pose + _SPREAD * rng.standard_normal(9) for pose in _WAYS[number]]
    way[1] = way[0] + rng.uniform(*_SIZES[number]) * (way[1] - way[0])
    move(-1.0, 0.5, way[0])
    length_s = float(rng.uniform(*_STROKES_S[number]))
    end_s = move(begin_s, length_s, way[1])
    nearest_s = end_s
    if number == 3:
        share = rng.uniform(0.4, 1.0)
        end_s = move(end_s + float(rng.uniform(0.0, 0.08)), float(rng.uniform(*_BACK_S)),
                     way[1] + share * (way[0] - way[1]))  # fmt: skip
    else:
        nearest_s = begin_s + length_s * float(rng.uniform(*_NEAREST[number]))
    late_s = float(rng.uniform(0.15, 0.5))
    label[(times_s >= begin_s + float(rng.uniform(-0.05, 0.1))) & (times_s < end_s + late_s)] = (
        number
    )
    back_s = end_s + late_s + float(rng.uniform(0.0, 0.4))
    if rng.random() < 0.6:
        move(back_s, float(rng.uniform(0.5, 1.0)), way[0])
    return Deed(moves, label, nearest_s)


def made_take(space: ShapeSpace, seed: int, person: int, number: int, index: int) -> Take:
    """Simulate one take."""
    rng = np.random.default_rng([seed, person, number, index])
    subject = random_subject(space, seed, person)
    skeleton = space.skeleton(subject.shape)
    times_s = FRAME_S * np.arange(FRAMES, dtype=np.float64)
    deed = drawn_deed(rng, number, times_s)
    rotations = np.tile(np.eye(3), (FRAMES, len(skeleton), 1, 1))
    scale = arm_length_m(skeleton) / arm_length_m(space.base_skeleton)
    arm = arm_through_time(deed.moves, times_s)
    arm[:, :3] += [0.5, 0.5, 0.002] * wander(rng, times_s, 2.0, 3)
    turn_torso(skeleton, rotations, times_s + float(rng.uniform(0.0, 60.0)), np.zeros(FRAMES))
    relax_fingers(skeleton, rotations)
    reach(skeleton, rotations, "R", arm, scale)
    transforms = skeleton.transforms(rotations)
    wrist = skeleton.index["wrist.R"]
    heads = skeleton.heads_m[wrist]
    path = np.einsum("tij,j->ti", transforms[:, wrist, :, :3], heads) + transforms[:, wrist, :, 3]
    nearest = path[min(round(deed.nearest_s / FRAME_S), FRAMES - 1)]
    away = rng.uniform(*_RADIUS_M)
    aside = rng.normal(0.0, 0.05, 2)
    # The sensor is at the origin, before the hand where it is nearest.
    transforms[..., 3] += np.array([aside[0], aside[1], away + 0.1]) - nearest
    body = space.shaped(Body.load(RESOLUTION), space.directions_m(RESOLUTION), subject.shape)
    mesh = MeshSequence(
        pose_vertices(body, transforms), body.faces, Timebase(times_s), source="simulated body"
    )
    sensor = VirtualSensor((0.0, 0.0, 0.0))
    synthetic = Synthesizer(mesh, SYNTHESIS, threads=1).map(sensor)
    options = TargetOptions(looks=int(rng.choice([1, 2, 4])), above_noise=0.0)
    radar = radar_target(mesh, RADAR, sensor, AXIS, (), seed=[seed, person, number, index],
                         options=options)  # fmt: skip
    still = rng.uniform(*_STILL_DB, 2)
    noise_db = float(rng.uniform(*_NOISE_DB))
    maps = []
    for values in (np.ascontiguousarray(synthetic.values.T), radar):
        # A hand that rests has no cell that is loud.
        loudest = float(values.max()) * (1.0 if number else 20.0) or 1.0
        maps.append(with_still(values / loudest, rng, float(still.mean()), noise_db))
    return Take(
        f"simulated {person + 1}", f"{LABELS[number]}-{index:02d}", maps[0], maps[1], times_s,
        deed.label, np.zeros(3),
    )  # fmt: skip


def with_still(
    energies: NDArray[np.floating], rng: np.random.Generator, still_db: float, noise_db: float
) -> NDArray[np.float32]:
    """Add still echoes and noise to a map, (frames, bins), relative to 1."""
    bins = np.arange(energies.shape[1]) - energies.shape[1] // 2
    # Of a spectrum without taper.
    lobes = np.sinc((bins + rng.uniform(-0.5, 0.5)) / rng.uniform(1.2, 2.4)) ** 2
    times_s = FRAME_S * np.arange(len(energies), dtype=np.float64)
    level = 10.0 ** ((still_db + 2.0 * wander(rng, times_s, 1.0, 1)[:, 0]) / 10.0)
    noise = rng.gamma(4.0, 10.0 ** (noise_db / 10.0) / 4.0, energies.shape)
    return (energies + level[:, None] * lobes + noise).astype(np.float32)


def make_pairs(out: Path) -> None:
    """Simulate the takes of each person and label that are not there."""
    writer = PairWriter(
        out,
        kind="simulated",
        axis=AXIS,
        null_bins=(),
        frame_rate_hz=1.0 / FRAME_S,
        labels=LABELS,
        provenance={
            "made_by": f"SD² Studio {__version__}, tools.studies.hand_gestures",
            "seed": _SEED,
            "radar": RADAR.name,
        },
    )
    space = ShapeSpace()
    wanted = list(product(range(_TAKES), range(_PEOPLE), range(len(LABELS))))
    with bar("Simulating", "take", total=len(wanted)) as shown:
        for index, person, number in wanted:
            key = TakeKey(f"simulated {person + 1}", f"{LABELS[number]}-{index:02d}", 0)
            if key not in writer.done:
                writer.append(made_take(space, _SEED, person, number, index))
            shown.update(1)
