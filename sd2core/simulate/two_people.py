"""A sample scene: two people walk past each other behind a table."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sd2core.body.shape import BodyShape, ShapeSpace
from sd2core.body.skinning import pose_vertices
from sd2core.io.mesh import save_mesh
from sd2core.mesh.bodies import Body
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.things import Thing
from sd2core.recording.recording import Recording, new_folder
from sd2core.simulate.gait import Path as Way
from sd2core.simulate.gait import gait
from sd2core.simulate.limbs import arm_length_m
from sd2core.timebase import Timebase

_FRAMES_PER_S, _FRAMES = 30, 240
_FLOOR_M = 1.1
"""Height of the camera above it."""

Turns = tuple[tuple[float, ...], tuple[float, ...]]
"""Times in seconds, and values at these times."""


def two_people(folder: Path) -> Recording:
    """Make a recording of two simulated people, a table and a radar at the camera.

    Anna comes nearer, turns and walks away; Bert crosses the room behind her.

    Raises Sd2Error if ``folder`` is a recording already.
    """
    folder = new_folder(folder)
    folder.mkdir(exist_ok=True)
    anna = _walker(
        0.0, 1.68, 4.4, ((0.6, 3.2, 4.8, 7.4), (0.0, 2.2, 2.2, 0.2)), ((3.3, 4.6), (0, 180))
    )
    bert = _walker(1.0, 1.82, 3.6, ((0.8, 6.4), (0.0, 4.4)), ((0.0, 8.0), (0.0, 0.0)))
    for name, mesh in (("anna", anna), ("bert", bert)):
        save_mesh(mesh, folder / f"{name}.zarr")
    # Bert's own way leads to the camera; here it leads across, from right to left.
    crossing = Body(str(folder / "bert.zarr"), (2.1, 0.0, 0.3), turn_deg=90, person="Bert")
    return Recording.create(
        folder,
        mesh=folder / "anna.zarr",
        bodies=(crossing,),
        things=(Thing("table", (-0.5, _FLOOR_M, 1.3)),),
        title="Two people and a table",
        subject="Anna",
        simulated=True,
    )


def _walker(
    gender: float, stature_m: float, away_m: float, forward: Turns, yaw: Turns
) -> MeshSequence:
    """Somebody who walks towards the camera from some metres away, as far as ``forward`` says."""
    space = ShapeSpace()
    shape = BodyShape(space.coefficients(gender=gender), stature_m)
    skeleton, body = space.skeleton(shape), space.load("low", shape)
    clock = Timebase.regular(_FRAMES, _FRAMES_PER_S)
    way = Way(lambda t: np.interp(t, *forward), lambda t: np.interp(t, *yaw))
    scale = arm_length_m(skeleton) / arm_length_m(space.base_skeleton)
    motion = gait(skeleton, np.arange(_FRAMES) / _FRAMES_PER_S, way, scale)
    place = motion.translation_m + np.array([0.0, _FLOOR_M, away_m])
    vertices = pose_vertices(body, skeleton.transforms(motion.rotations, place))
    return MeshSequence(vertices, body.faces, clock, "simulated walk")
