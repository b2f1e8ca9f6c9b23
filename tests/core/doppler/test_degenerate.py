"""Input that nobody wants but everybody has: sense, never NaN."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from doppler_scenes import CAMERA, RAW, moving, options, plate, sensor_at, sphere, wobbling

from sd2core.doppler import PRESETS, Synthesizer
from sd2core.errors import Sd2Error
from sd2core.mesh.sequence import MeshSequence
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase

EVERY = ("none", "facing", "depth", "exact", "frozen")
ANY_PRESET = pytest.mark.parametrize("preset", list(PRESETS))
ANY_VISIBILITY = pytest.mark.parametrize("visibility", EVERY)


def assert_sensible(mesh: MeshSequence, sensor: VirtualSensor, preset: Any, visibility: Any) -> Any:
    maker = Synthesizer(mesh, preset)
    stretch = maker.stretch(sensor, 0, mesh.frame_count, visibility)
    for values in (stretch.values, stretch.visible_share, stretch.beyond_share):
        assert np.isfinite(values).all()
        assert (values >= 0).all()
    frame = maker.frame(sensor, mesh.frame_count // 2, visibility)
    assert np.isfinite(frame.velocity_mps).all()
    assert np.isfinite(frame.range_m).all()
    return stretch


@ANY_PRESET
@ANY_VISIBILITY
def test_sensor_on_a_vertex(preset: str, visibility: str) -> None:
    mesh = wobbling(8, divisions=2)
    point = np.asarray(mesh.vertices)[4, 17].astype(float)
    assert_sensible(mesh, sensor_at(*point), preset, visibility)


@ANY_PRESET
@ANY_VISIBILITY
def test_sensor_inside_the_body(preset: str, visibility: str) -> None:
    mesh = wobbling(8, divisions=2)
    middle = np.asarray(mesh.vertices)[4, :162].mean(axis=0)
    stretch = assert_sensible(mesh, sensor_at(*middle.astype(float)), preset, visibility)
    if visibility in ("depth", "exact"):
        assert stretch.visible_share[4] > 0.3  # the ball around the sensor


@ANY_PRESET
@ANY_VISIBILITY
def test_sensor_a_thousand_kilometres_away(preset: str, visibility: str) -> None:
    mesh = wobbling(8, divisions=2)
    stretch = assert_sensible(mesh, sensor_at(6e5, 0.0, -8e5), preset, visibility)
    if preset == "vid2doppler":
        assert stretch.values.sum() > 0.1
    direction = np.array([0.6, 0.0, -0.8])
    vertices = np.asarray(mesh.vertices, float)
    frame = Synthesizer(mesh, "paper").frame(sensor_at(6e5, 0.0, -8e5), 4, "none")
    truth = (vertices[5] - vertices[3]) @ direction * 15
    np.testing.assert_allclose(frame.velocity_mps, truth, atol=1e-4)


@ANY_PRESET
@ANY_VISIBILITY
def test_one_frame_gives_an_empty_map(preset: str, visibility: str) -> None:
    mesh = wobbling(1, divisions=2)
    assert not assert_sensible(mesh, CAMERA, preset, visibility).values.any()
    bare = options(velocity=PRESETS[preset].velocity)
    assert not assert_sensible(mesh, CAMERA, bare, visibility).values.any()


@ANY_PRESET
@ANY_VISIBILITY
def test_a_still_body_gives_an_empty_map(preset: str, visibility: str) -> None:
    vertices, faces = sphere(0.3, 2)
    mesh = moving(vertices, faces, np.tile([0.1, 0.0, 2.0], (6, 1)), np.arange(6) / 30)
    assert not assert_sensible(mesh, CAMERA, preset, visibility).values.any()


@ANY_PRESET
@ANY_VISIBILITY
def test_zero_visible_vertices(preset: str, visibility: str) -> None:
    # Only the ball moves, and a still wall all round hides it.
    inner, inner_faces = sphere(0.2, 1)
    wall, wall_faces = sphere(1.0, 2)
    times = np.arange(6) / 30
    swaying = inner[None] + np.stack([0 * times, 0 * times, 0.1 * np.sin(9 * times)], 1)[:, None]
    positions = np.concatenate([swaying, np.tile(wall, (6, 1, 1))], axis=1)
    positions += np.array([0.0, 0.0, 3.0])
    faces = np.concatenate([inner_faces, wall_faces + len(inner)]).astype(np.int32)
    mesh = MeshSequence(positions, faces, Timebase(times), "in a box")
    stretch = assert_sensible(mesh, CAMERA, preset, visibility)
    if visibility == "exact":
        assert not stretch.values.any()


@ANY_PRESET
@ANY_VISIBILITY
def test_zero_area_faces(preset: str, visibility: str) -> None:
    vertices, _ = plate(0.3, 4)
    flat = np.array([[0, 1, 2], [3, 3, 4], [5, 5, 5]], np.int32)
    path = np.stack([np.zeros(6), np.zeros(6), 2 - 0.04 * np.arange(6)], axis=1)
    mesh = moving(vertices, flat, path, np.arange(6) / 30)
    assert_sensible(mesh, CAMERA, preset, visibility)
    area = options(weight="area", velocity=PRESETS[preset].velocity)
    assert not assert_sensible(mesh, CAMERA, area, visibility).values.any()


@ANY_VISIBILITY
def test_coordinates_of_a_million_metres(visibility: str) -> None:
    mesh = wobbling(10, divisions=2)
    offset = np.array([1e6, -1e6, 1e6])
    far = MeshSequence(
        np.asarray(mesh.vertices, float) + offset, mesh.faces, mesh.timebase, "far out"
    )
    here = assert_sensible(mesh, CAMERA, RAW, visibility)
    there = assert_sensible(far, sensor_at(*offset), RAW, visibility)
    # Doubles at a million metres end at 1e-10 m: a vertex may still change bins.
    assert np.abs(there.values - here.values).max() <= 12 / mesh.vertex_count


def test_a_vertex_that_is_not_a_number_is_named() -> None:
    mesh = wobbling(6, divisions=1)
    vertices = np.asarray(mesh.vertices).copy()
    vertices[3, 5, 1] = np.nan
    broken = MeshSequence(vertices, mesh.faces, mesh.timebase, "broken.npz")
    with pytest.raises(Sd2Error, match=r"broken\.npz: vertex 5 of frame 3 is"):
        Synthesizer(broken).map(CAMERA)
