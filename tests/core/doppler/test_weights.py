"""What a vertex counts, on surfaces whose answer is known."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from doppler_scenes import RAW, moving, options, plate, sensor_at, sphere

from sd2core.doppler import Synthesizer
from sd2core.sensor import VirtualSensor

TIMES_S = np.arange(6) / 30
FAR = sensor_at(0.0, 0.0, -1e5)


def approaching(vertices: Any, faces: Any, velocity_mps: float = 1.3) -> Any:
    path = np.stack([0 * TIMES_S, 0 * TIMES_S, 4.0 - velocity_mps * TIMES_S], axis=1)
    return moving(vertices, faces, path, TIMES_S)


def in_its_bin(mesh: Any, sensor: VirtualSensor, **changes: Any) -> Any:
    """Values of the bin in which everything is; the others are asserted to be empty."""
    values = Synthesizer(mesh, options(**changes)).map(sensor).values
    number = RAW.axis.bin_of(1.3)
    others = np.delete(values, number, axis=0)
    assert not others.any()
    return values[number]


@pytest.mark.parametrize("visibility", ["none", "facing", "exact"])
@pytest.mark.parametrize("angle_deg", [0.0, 30.0, 60.0, 80.0])
def test_a_tilted_plate_gives_its_cosine(visibility: Any, angle_deg: float) -> None:
    vertices, faces = plate(0.5)
    cos, sin = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    tilted = vertices @ np.array([[1, 0, 0], [0, cos, sin], [0, -sin, cos]])
    mesh = approaching(tilted, faces)
    share = in_its_bin(mesh, FAR, weight="projected", visibility=visibility)
    # Coordinates of single precision, 4 m from the clip's origin.
    np.testing.assert_allclose(share, cos, atol=2e-5)
    area = in_its_bin(mesh, FAR, weight="area", visibility=visibility)
    np.testing.assert_allclose(area, 1.0, atol=2e-5)


def test_a_plate_from_behind_turns_nothing_to_the_sensor() -> None:
    vertices, faces = plate(0.5)
    mesh = approaching(vertices, np.ascontiguousarray(faces[:, ::-1]))
    assert not in_its_bin(mesh, FAR, weight="projected", visibility="exact").any()


@pytest.mark.parametrize("visibility", ["none", "facing", "exact"])
def test_a_sphere_shows_a_quarter_of_its_surface(visibility: Any) -> None:
    # A disc of πr² of 4πr²: what is turned away counts nothing, seen or not.
    mesh = approaching(*sphere(0.4, divisions=5))
    share = in_its_bin(mesh, FAR, weight="projected", visibility=visibility)
    # Along the horizon a vertex's fan is half turned away: one ring of 2 % of the radius.
    np.testing.assert_allclose(share, 0.25, atol=1e-3)


def test_constant_gamma_with_the_range_law() -> None:
    # A cosθ / R⁴ of a small plate, tilted, at two ranges.
    vertices, faces = plate(0.01)
    cos, sin = np.cos(0.7), np.sin(0.7)
    tilted = vertices @ np.array([[1, 0, 0], [0, cos, sin], [0, -sin, cos]])
    mesh = approaching(tilted, faces)
    for distance_m in (0.0, 7.0):
        chosen = {"weight": "projected", "range_exponent": 4.0, "visibility": "none"}
        share = in_its_bin(mesh, sensor_at(0, 0, -distance_m), **chosen)
        range_m = 4.0 - 1.3 * TIMES_S + distance_m
        # The plate is 0.01 m wide: R varies by a quarter of a percent at most.
        np.testing.assert_allclose(share, cos * (2.2 / range_m) ** 4, rtol=1e-3)


def test_the_unit_says_what_is_counted() -> None:
    mesh = approaching(*plate(0.5))
    assert Synthesizer(mesh, options(weight="projected")).unit == "share of the surface × cos θ"
