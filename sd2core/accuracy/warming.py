"""Work on a scene of three triangles that calls every compiled kernel as all work does."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sd2core.body.camera import PinholeCamera
from sd2core.body.model import Body
from sd2core.body.shaping import silhouette
from sd2core.body.skinning import pose_vertices
from sd2core.doppler.options import SynthesisOptions
from sd2core.doppler.synthesizer import Synthesizer
from sd2core.fmcw.options import WaveOptions
from sd2core.fmcw.wave import WaveScene
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.things import Surroundings, Thing
from sd2core.mesh.velocity_uncertainty import VelocityUncertainty
from sd2core.numerics.raster import interpolate
from sd2core.radar_config import PAPER_RADAR
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase

_FRAMES = 9
_FAR_M = 1e5
"""Where single precision is not enough."""

_PLAIN = SynthesisOptions(count="plain")
_OPTIONS = (
    _PLAIN,
    replace(_PLAIN, null_bins=()),
    replace(_PLAIN, visibility="depth"),
    replace(_PLAIN, visibility="facing"),
    replace(_PLAIN, visibility="facing", weight="area"),
    replace(_PLAIN, visibility="facing", weight="projected"),
    SynthesisOptions(),
)


def call_kernels() -> Iterator[None]:
    """Call every kernel with all types that it is used with; yields between pieces of work."""
    sensor = VirtualSensor()
    meshes = _mesh(np.zeros(3, np.float32)), _mesh(np.array([0.0, 0.0, _FAR_M]))
    for mesh in meshes:
        for options in _OPTIONS:
            Synthesizer(mesh, options, threads=1).map(sensor)
            yield
        facing = replace(_PLAIN, visibility="facing")
        Synthesizer(mesh, facing, threads=1).stretch(sensor, 0, _FRAMES, shares=False)
        yield
    scene = WaveScene(meshes[0], PAPER_RADAR, sensor, wave=WaveOptions(model="direct"))
    scene.frame(0.1)
    yield
    body = Body.load("low")
    rest = np.tile(np.eye(3), (1, len(body.skeleton), 1, 1))
    (vertices_m,) = pose_vertices(body, body.skeleton.transforms(rest, np.array([[0, 0, 3.0]])))
    silhouette(vertices_m, body.faces, PinholeCamera(64, 48, 60.0))
    corners, triangle = np.ascontiguousarray(vertices_m[:3, :2]), np.array([[0, 1, 2]], np.int32)
    pixel, owner = np.zeros(1, np.intp), np.zeros((1, 1), np.int32)
    nearness, values = np.ones(3, np.float32), np.empty((1, 2), np.float32)
    interpolate(corners, nearness, triangle, pixel, pixel, owner, corners, values)
    yield


def _mesh(away_m: NDArray[np.floating]) -> MeshSequence:
    """Three triangles, of which the first moves and the last is away, beside a box."""
    places_m = np.random.default_rng(0).normal((0.0, 0.0, 4.0), size=(_FRAMES, 3, 3, 3))
    places_m[:] = places_m[0]
    places_m[:, 0, :, 2] += 0.1 * np.arange(_FRAMES)[:, None]
    places_m[:, 2] += away_m
    deviations = np.full((_FRAMES, 1), 0.1, np.float32)
    box = Thing("box", (0.0, 1.0, 2.0))
    return MeshSequence(
        places_m.reshape(_FRAMES, 9, 3).astype(away_m.dtype),
        np.arange(9, dtype=np.int32).reshape(3, 3),
        Timebase.regular(_FRAMES, 30.0),
        uncertainty=VelocityUncertainty(("all",), np.zeros(9, np.uint8), deviations, deviations),
        surroundings=Surroundings.of((box,), (box.placed(),)),
    )
