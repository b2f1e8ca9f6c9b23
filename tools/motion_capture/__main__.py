"""``python -m tools.motion_capture``: bodies in the motion of real people."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from sd2core import MeshSequence, Sd2Error, Timebase
from sd2core.body.fitted import fitted_vertices
from sd2core.body.initial import Pose
from sd2core.body.mesh_refining import refined
from sd2core.body.model import vertex_normals
from sd2core.body.parts import body_parts
from sd2core.body.rig import KeypointSpace
from sd2core.body.rotations import from_vector
from sd2core.body.shape import ShapeSpace
from sd2core.cli.output import progress_bar
from sd2core.compare.measures import line_of_sight_velocity, rms
from sd2core.mocap.body_motion import RATE_HZ, BodyMotion
from sd2core.options.kinds import Count
from sd2core.options.records import ARGUMENT, OptionRecord
from sd2core.progress import Progress, silent
from tools.command_line import tool
from tools.motion_capture.catalogue import drive_bodies

Floats = NDArray[np.float64]


TUNED_ON = frozenset({"cmu01", "cmu02", "cmu05", "cmu08", "cmu49", "cmu127"})
"""Persons by whose motion something of the smoothing was chosen.

Tried on them and lost: stiffness by Stein's unbiased estimate of the risk, for every coordinate or
limb, and energies of jerks less the jitter's (what lasts in the jitter is taken for motion, or all
motion for jitter); jitter by differences of fourth to sixth order; jerks or jitter common to a
limb; limbs smoothed about their middle. Limits on acceleration instead of jerk leave 3 % more.
"""

_WHITE_M, _LASTING_M = 0.006, 0.010
_MIN_FRAMES, _MAX_FRAMES = 36, 300
_ABOVE_FLOOR_M = 1.0  # of the camera
_NEAREST_M = 4.0


def wandering(generator: np.random.Generator, frames: int, count: int) -> Floats:
    """Noise (T, count, 3) of standard deviation 1 that is forgotten within half a second."""
    share = np.exp(-1.0 / 15.0)
    noise = generator.normal(size=(frames, count, 3))
    noise[1:] *= np.sqrt(1.0 - share**2)
    return np.asarray(lfilter([1.0], [1.0, -share], noise, axis=0))


def jittering(mesh: MeshSequence, white_m: float, lasting_m: float, seed: int) -> MeshSequence:
    """The mesh with jitter, half of its variance common to all limbs, depth twice as uncertain."""
    generator = np.random.default_rng(seed)
    parts = body_parts(mesh)
    assert parts is not None
    frames, limbs = mesh.frame_count, len(parts.names)
    white = generator.normal(size=(frames, limbs + 1, 3))
    lasting = wandering(generator, frames, limbs + 1)
    jitter = (white_m * white + lasting_m * lasting) / np.sqrt(2.0) * [1.0, 1.0, 2.0]
    moved = mesh.read(0, frames) + jitter[:, parts.numbers] + jitter[:, -1:]
    return replace(mesh, vertices=moved)


def facing(vertices: NDArray[np.floating], normals: NDArray[np.floating]) -> NDArray[np.bool_]:
    """Vertices that look towards the camera."""
    return np.asarray((vertices * normals).sum(axis=-1) < 0)


def measure_refining(folder: Path, progress: Progress = silent) -> dict[str, tuple[float, float]]:
    """RMS errors of velocity (m/s) with jitter and after smoothing, by trial.

    Of vertices that face the camera; of all motions in a folder by persons that nothing was tuned
    on. Raises Sd2Error if there are none.
    """
    paths = sorted(folder.glob("*.npz"))
    space = ShapeSpace()
    keypoints = KeypointSpace(space)
    errors = {}
    for done, path in enumerate(paths):
        progress(done, len(paths))
        motion = BodyMotion.load(path)
        if motion.person not in TUNED_ON and len(motion) >= _MIN_FRAMES:
            errors[motion.trial] = _errors(_before_camera(motion, space, keypoints))
    progress(len(paths), len(paths))
    if not errors:
        raise Sd2Error(f"{folder} holds no motion to measure on", "what `drive` made of CMU's")
    return errors


def _before_camera(motion: BodyMotion, space: ShapeSpace, keypoints: KeypointSpace) -> MeshSequence:
    frames = min(len(motion), _MAX_FRAMES)
    pose = Pose(from_vector(motion.vectors[:frames]), motion.translation_m[:frames])
    body = space.load("low", motion.shape)
    posed = fitted_vertices(body, keypoints.rig(motion.shape), pose)[:].astype(np.float64)
    posed[..., 0] -= posed[..., 0].mean()
    posed[..., 1] += _ABOVE_FLOOR_M
    posed[..., 2] += _NEAREST_M - posed[..., 2].min()
    return MeshSequence(posed, body.faces, Timebase.regular(frames, RATE_HZ))


def _errors(true: MeshSequence) -> tuple[float, float]:
    noisy = jittering(true, _WHITE_M, _LASTING_M, seed=1)
    faces = true.faces
    assert faces is not None
    vertices = true.read(0, true.frame_count)
    seen = np.stack([facing(one, vertex_normals(one, faces)) for one in vertices[1:-1]])
    known = line_of_sight_velocity(vertices, true.times_s)[1:-1]

    def error(mesh: MeshSequence) -> float:
        moved = line_of_sight_velocity(mesh.read(0, mesh.frame_count), mesh.times_s)[1:-1]
        return rms((moved - known)[seen])

    return error(noisy), error(refined(noisy))


class Drive(OptionRecord):
    """Options of ``drive``.

    Parameters
    ----------
    source : SOURCE
        folder of motion capture
    out : OUT
        folder of the bodies' motions
    processes : P
        at work at once
    """

    source: Annotated[Path, ARGUMENT]
    out: Annotated[Path, ARGUMENT]
    processes: Count = 2


class Refining(OptionRecord):
    """Options of ``refining``.

    Parameters
    ----------
    motions : MOTIONS
        what `drive` made
    """

    motions: Annotated[Path, ARGUMENT]


def _drive(options: Drive) -> None:
    """Drive a body by every recording of a folder.

    All recordings of one person drive one body of that person's measures. Stopped and
    started again it goes on where it was.
    """
    with progress_bar("Driving bodies", unit="recording") as progress:
        notes = drive_bodies(options.source, options.out, options.processes, progress)
    print("\n".join([*notes, f"Wrote {options.out}"]))


def _refining(options: Refining) -> None:
    """Measure `sd2 refine` on recorded motion with jitter."""
    with progress_bar("Smoothing", unit="recording") as progress:
        errors = measure_refining(options.motions, progress)
    for trial, (before, after) in errors.items():
        print(f"{trial:12} {before:.3f} -> {after:.3f} m/s ({after / before:.2f})")
    before, after = np.array(list(errors.values())).T
    print(
        f"{len(errors)} recordings: {before.mean():.2f} -> {after.mean():.3f} m/s, ratio"
        f" {np.mean(after / before):.2f} (mean), {np.max(after / before):.2f} (greatest),"
        f" below half in {np.sum(after < 0.5 * before)}"
    )


main = tool("motion_capture", _drive, _refining)


if __name__ == "__main__":
    sys.exit(main())
