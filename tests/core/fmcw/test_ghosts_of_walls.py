"""Simulated radar signals by way of walls: range, Doppler, level, and what hides them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.fmcw.options import Mirror, Reflector, SignalOptions, WaveOptions
from sd2core.fmcw.processing import range_doppler
from sd2core.fmcw.simulation import simulate_radar
from sd2core.fmcw.wave import WaveScene
from sd2core.io.things import with_things, with_walls
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.things import Thing
from sd2core.mesh.walls import Wall
from sd2core.radar_config import PAPER_RADAR
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase

WALL = Wall.named("right", 1.5, 6.0)
CAMERA = VirtualSensor()
ROUGH = WaveOptions(coherent=False)


def facet(velocity_mps: float = 1.0, turned: float = 0.4) -> MeshSequence:
    """A facet of a centimetre at 3 m that comes nearer, turned between sensor and image."""
    times_s = np.arange(9) / 30
    corners = 0.005 * np.array([[0, -1, 0], [-1, 1, 0], [1, 1, 0]])
    cos, sin = math.cos(turned), math.sin(turned)
    corners = corners @ np.array([[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]])
    path = np.array([0, 0, 3.0]) - velocity_mps * times_s[:, None] * [0, 0, 1.0]
    faces = np.array([[0, 1, 2]], np.int32)
    mesh = MeshSequence(path[:, None] + corners, faces, Timebase(times_s))
    a, b, c = mesh.frame(0)
    assert np.cross(b - a, c - a)[2] < 0  # it faces the camera
    return mesh


def echoes(mesh: MeshSequence, wave: WaveOptions = ROUGH) -> tuple[NDArray[np.float64], ...]:
    """Ranges, rates and powers of all echoes at one receiver in the fifth frame."""
    scene = WaveScene(mesh, PAPER_RADAR, CAMERA, "facing", wave)
    position, velocity = scene.scene.moving(4 / 30)
    found = [
        scene.echoes(position, velocity, seen, wall=wall)
        for wall, seen in scene.scene.seen(4 / 30).items()
    ]
    range_m, rate_mps = (
        np.concatenate([getattr(one, name) for one in found]) for name in ("range_m", "rate_mps")
    )
    return range_m, rate_mps, np.concatenate([np.abs(one.terms[0]) ** 2 for one in found])


def test_both_ways_have_their_range_rate_and_level() -> None:
    range_m, rate_mps, power = echoes(with_walls(facet(), [WALL]))
    depth_m = 3.0 - 4 / 30
    image_m = math.hypot(depth_m, 2 * WALL.distance_m)
    assert len(range_m) == 3
    # Receivers stand a few millimetres beside the transmitter.
    assert range_m[1:] == pytest.approx([0.5 * (depth_m + image_m)] * 2, abs=3e-3)
    assert -rate_mps[1:] == pytest.approx([0.5 * (1 + depth_m / image_m)] * 2, abs=1e-3)
    # Of the constant-gamma law: cosines of both ends.
    to_image = np.array([2 * WALL.distance_m, 0, -depth_m]) / image_m
    a, b, c = facet().frame(4)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal)
    cosines = normal @ [0, 0, -1], normal @ to_image
    expected = 0.5 * sum(cosines) / cosines[0] * (depth_m / image_m) ** 2 * 10**-0.6
    assert power[1:] / power[0] == pytest.approx([expected] * 2, rel=5e-3)


def test_the_map_has_the_ghost_where_it_belongs() -> None:
    scene = with_walls(facet(-0.9, 0.7), [replace(WALL, loss_db=0.0)])
    capture = simulate_radar(scene, PAPER_RADAR, options=SignalOptions(snr_db=math.inf))
    frame = 4
    depth_m = 3.0 + 0.9 * float(capture.timebase.times_s[frame])
    image_m = math.hypot(depth_m, 2 * WALL.distance_m)
    found = range_doppler(capture, frame)
    beyond = found.range_m > depth_m + 0.3
    gate, velocity_bin = np.unravel_index(found.values[beyond].argmax(), found.values[beyond].shape)
    resolution_m = PAPER_RADAR.range_resolution_m
    assert found.range_m[beyond][gate] == pytest.approx(0.5 * (depth_m + image_m), abs=resolution_m)
    velocity_mps = -0.5 * 0.9 * (1 + depth_m / image_m)
    assert found.axis.centres_mps[velocity_bin] == pytest.approx(
        velocity_mps, abs=found.axis.bin_width_mps
    )


def test_several_walls_add_up_and_a_deaf_one_adds_nothing() -> None:
    floor = Wall.named("floor", 1.0, 3.0)
    mesh = facet()

    def signal(*walls: Wall, wave: WaveOptions = ROUGH) -> NDArray[np.float64]:
        scene = WaveScene(with_walls(mesh, walls), PAPER_RADAR, CAMERA, "exact", wave)
        return scene.frame(4 / 30)

    alone, both = signal(), signal(WALL, floor)
    each = [signal(wall) - alone for wall in (WALL, floor)]
    assert all(np.abs(one).max() > 0.05 * np.abs(alone).max() for one in each)
    np.testing.assert_allclose(both - alone, sum(each), atol=1e-9 * np.abs(both).max())
    deaf = signal(replace(WALL, loss_db=100.0))
    np.testing.assert_allclose(deaf, alone, atol=1e-4 * np.abs(alone).max())
    # The image method is that of the mirror of two rays, without the ray that it mirrors twice.
    mirror = Mirror.of(WALL)
    two_rays = signal(wave=WaveOptions(coherent=False, mirror=mirror))
    twice = two_rays - signal(WALL)
    assert np.abs(twice).max() < np.abs(each[0]).max()


@pytest.mark.parametrize("visibility", ["facing", "exact"])
def test_a_thing_on_either_leg_hides_the_ghost_only(visibility: str) -> None:
    mesh, place = facet(), np.array([1.5, 0.0, 1.4])
    legs = [0.5 * place, 0.5 * (place + np.array([0.0, 0.0, 2.85]))]
    for x, _, z in legs:
        box = Thing("box", (x, 0.5, z), size_m=(0.2, 1.0, 0.2))
        scene = with_walls(with_things(mesh, [box]), [WALL])
        found = WaveScene(scene, PAPER_RADAR, CAMERA, visibility).scene.seen(4 / 30)
        assert found[None] is not None
        assert found[WALL] is not None
        assert (found[None].all(), found[WALL].any()) == (True, False)


def test_static_points_and_things_have_ghosts_too() -> None:
    point = Reflector((0.3, 0.0, 2.0), 0.1)
    alone = WaveScene(facet(), PAPER_RADAR, CAMERA).static((point,))
    walled = WaveScene(with_walls(facet(), [WALL]), PAPER_RADAR, CAMERA).static((point,))
    assert np.abs(walled - alone).max() > 0.05 * np.abs(alone).max()
    # A point behind the wall has none.
    behind = Reflector((1.7, 0.0, 2.0), 0.1)
    np.testing.assert_array_equal(
        *(
            WaveScene(mesh, PAPER_RADAR, CAMERA).static((behind,))
            for mesh in (facet(), with_walls(facet(), [WALL]))
        )
    )
    box = Thing("box", (0.2, 0.5, 2.0))
    clutter = [
        WaveScene(mesh, PAPER_RADAR, CAMERA).static(())
        for mesh in (with_things(facet(), [box]), with_walls(with_things(facet(), [box]), [WALL]))
    ]
    assert np.abs(clutter[1] - clutter[0]).max() > 0.05 * np.abs(clutter[0]).max()


def test_a_scene_has_walls_or_a_wave_has_a_mirror() -> None:
    with pytest.raises(Sd2Error, match="one of the two"):
        WaveScene(
            with_walls(facet(), [WALL]), PAPER_RADAR, CAMERA,
            wave=WaveOptions(mirror=Mirror.ground(1.0)),
        )  # fmt: skip
