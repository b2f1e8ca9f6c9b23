"""Things before a radar hide facets, and echo from where they stand without moving."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from moving_spheres import swinging_sphere

from sd2core.fmcw.cutting import pieces_of
from sd2core.fmcw.options import Mirror, SignalOptions, WaveOptions
from sd2core.fmcw.processing import doppler_map
from sd2core.fmcw.simulation import simulate_radar
from sd2core.fmcw.wave import WaveScene
from sd2core.io.things import with_things
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.things import Thing
from sd2core.radar_config import PAPER_RADAR
from sd2core.sensor import Beam, VirtualSensor

CAMERA = VirtualSensor()
FINE = replace(
    PAPER_RADAR, end_frequency_hz=PAPER_RADAR.start_frequency_hz + 3e9, samples_per_chirp=128
)
"""A radar with range cells of 5 cm."""
QUIET = SignalOptions(snr_db=math.inf)
WALL = Thing("screen", (0.0, 20.0, 1.0), size_m=(40.0, 40.0, 0.02))
EITHER = pytest.mark.parametrize("visibility", ["facing", "exact"])


def ball() -> MeshSequence:
    """It swings towards the camera and back."""
    mesh = swinging_sphere(12)
    assert mesh.faces is not None
    return replace(mesh, faces=np.fliplr(mesh.faces))  # seen from outside


def scene(*things: Thing, visibility: Any = "facing", sensor: VirtualSensor = CAMERA, **wave: Any):
    """A ball that comes nearer, among things."""
    mesh = with_things(ball(), things)
    seed = wave.pop("seed", 0)
    return WaveScene(mesh, FINE, sensor, visibility, WaveOptions(**wave), seed)


def range_power(signal: Any) -> Any:
    """Power of the first chirp over range, in sixteenths of the radar's range cells."""
    samples = signal[0, 0] * np.hanning(signal.shape[2])
    return np.abs(np.fft.rfft(samples, 16 * len(samples))) ** 2


@EITHER
def test_what_a_wall_hides_does_not_echo(visibility: Any) -> None:
    assert scene(visibility=visibility).frame(0.1).any()
    assert not scene(WALL, visibility=visibility).frame(0.1).any()


@EITHER
def test_half_a_ball_echoes_past_half_a_wall(visibility: Any) -> None:
    """The signal is that of the facets whose line of sight passes beside it."""
    half = Thing("screen", (-20.0, 20.0, 1.0), size_m=(40.0, 40.0, 1e-3))
    mesh = ball()
    assert mesh.faces is not None
    seen = scene(visibility=visibility).scene.visible(0.1)
    centres = mesh.frame(mesh.timebase.nearest_frame(0.1)).astype(float)[mesh.faces].mean(axis=1)
    right = centres[:, 0] > 0
    expected = right if seen is None else right & seen
    found = scene(half, visibility=visibility).scene.visible(0.1)
    assert found is not None
    sure = np.abs(centres[:, 0]) > 1e-3
    np.testing.assert_array_equal(found[sure], expected[sure])
    every = np.repeat(found[None], mesh.frame_count, axis=0)
    given = WaveScene(mesh, FINE, CAMERA, every).frame(0.1)
    np.testing.assert_allclose(scene(half, visibility=visibility).frame(0.1), given)


@pytest.mark.parametrize("number", [1, 4])
def test_things_are_cut_finely_while_there_is_room(number: int) -> None:
    """Whatever the pieces, their area is that of the things."""
    walls = [replace(WALL, position_m=(0.0, 20.0, float(place))) for place in range(number)]
    around = with_things(ball(), walls).surroundings
    assert around is not None

    def area_m2(corners: Any) -> float:
        sides = corners[:, 1:] - corners[:, :1]
        return float(0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum())

    pieces = pieces_of(around, 0.01)
    assert 10_000 < len(pieces) <= 100_000
    assert area_m2(pieces) == pytest.approx(area_m2(around.vertices_m[around.faces]))


def test_without_things_nothing_is_added() -> None:
    assert not scene().static(()).any()
    beside = Thing("box", (3.0, 0.0, 2.0))
    np.testing.assert_array_equal(scene(beside).frame(0.1), scene().frame(0.1))


@pytest.mark.parametrize("range_m", [1.2, 2.5])
def test_clutter_lies_at_the_range_of_the_thing_and_does_not_move(range_m: float) -> None:
    box = Thing("box", (0.0, 0.1, range_m + 0.1), size_m=(0.2, 0.2, 0.2))  # its front is there
    signal = scene(box).static(())
    assert np.ptp(signal, axis=1).max() < 1e-6 * np.abs(signal).max()
    peak_m = range_power(signal).argmax() / 16 * FINE.range_resolution_m
    assert peak_m == pytest.approx(range_m, abs=2 * FINE.range_resolution_m)


def test_its_power_is_that_of_a_rough_surface_however_it_is_cut() -> None:
    """Facets of area A seen square on at R: (lambda / 2)² A / R⁴, half of it in a real signal."""
    range_m, area_m2 = 2.0, 0.3**2
    screen = Thing("screen", (0.0, 0.15, range_m + 0.01), size_m=(0.3, 0.3, 0.02))
    power = [np.mean(scene(screen, seed=seed).static(()) ** 2) for seed in range(60)]
    expected = 0.5 * (0.5 * FINE.wavelength_m) ** 2 * area_m2 / range_m**4
    assert np.mean(power) == pytest.approx(expected, rel=0.25)


def test_pieces_cover_the_surface_and_are_small() -> None:
    around = with_things(ball(), [Thing("table", (0, 1, 2), 30.0)]).surroundings
    assert around is not None
    pieces = pieces_of(around, 0.1)
    areas = [
        np.linalg.norm(np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0]), axis=1).sum()
        for c in (around.vertices_m[around.faces], pieces)
    ]
    assert areas[0] == pytest.approx(areas[1])
    assert np.linalg.norm(pieces - np.roll(pieces, 1, axis=1), axis=2).max() <= 0.1 + 1e-9
    huge = with_things(ball(), [WALL]).surroundings
    assert huge is not None
    assert 10_000 < len(pieces_of(huge, 0.01)) <= 100_000


def test_a_thing_behind_another_one_and_beside_the_beam_is_silent() -> None:
    near = Thing("screen", (0.0, 0.15, 1.0), size_m=(0.3, 0.3, 0.02))
    hidden = Thing("box", (0.0, 0.1, 2.1), size_m=(0.2, 0.2, 0.2))
    both, alone = (range_power(scene(*things).static(())) for things in ((near, hidden), (hidden,)))
    at = alone.argmax()
    assert both[at] < 1e-2 * alone[at]
    aside = VirtualSensor(azimuth_deg=90, beam=Beam(20, 20))
    box = Thing("box", (0.0, 0.1, 2.0), size_m=(0.2, 0.2, 0.2))
    quiet, loud = (np.abs(scene(box, sensor=at).static(())).max() for at in (aside, CAMERA))
    assert quiet < 1e-6 * loud


def hidden_pieces(*things: Thing, time_s: float = 0.1) -> tuple[Any, Any, Any]:
    """Middles of the pieces of things that echo, which the body hides, and vertices of the ball."""
    made = scene(*things)
    pieces = made._pieces
    assert pieces is not None
    mesh = made.scene.mesh
    vertices = mesh.frame(mesh.timebase.nearest_frame(time_s)).astype(float)
    points = pieces.centres_m[pieces.seen[None]]
    return points, made.scene.hidden_by_bodies(time_s, points), vertices


def test_the_shadow_of_a_ball_is_that_of_a_sphere() -> None:
    """Hidden is what lies beyond it within the cone of lines that touch it, as seen from here."""
    screen = Thing("screen", (0.1, 1.0, 4.0), 20.0, (2.0, 2.0, 0.02))
    before = Thing("box", (0.05, 0.1, 1.0), size_m=(0.05, 0.05, 0.05))
    points, hidden, ball_m = hidden_pieces(screen, before)
    middle = 0.5 * (ball_m.min(axis=0) + ball_m.max(axis=0))
    radius_m = np.linalg.norm(ball_m - middle, axis=1).max()
    away, along = np.linalg.norm(points, axis=1), points @ middle / np.linalg.norm(points, axis=1)
    past_m = np.sqrt(np.maximum(middle @ middle - along**2, 0.0))  # of the line to the middle
    beyond = away > along
    inside, outside = (
        beyond & (past_m < 0.93 * radius_m),
        ~beyond | (past_m > radius_m),
    )
    assert inside.sum() > 20
    assert hidden[inside].all()
    assert not hidden[outside].any()


def test_a_box_behind_the_ball_is_silent_while_it_is_hidden() -> None:
    behind = Thing("box", (0.0, 0.05, 3.5), size_m=(0.1, 0.1, 0.1))
    before = Thing("box", (0.0, 0.02, 0.6), size_m=(0.04, 0.04, 0.04))
    beside = Thing("box", (1.0, 0.05, 3.5), size_m=(0.1, 0.1, 0.1))
    made = scene(behind)
    np.testing.assert_allclose(made.shadow(0.1), made.static(()))
    for seen in (before, beside):
        assert scene(seen).shadow(0.1) is None
    np.testing.assert_allclose(
        scene(behind, beside).static(()) - scene(behind, beside).shadow(0.1),
        scene(behind, beside)._of_pieces(beside_of(behind, beside)),
    )


def beside_of(behind: Thing, beside: Thing) -> Any:
    """Pieces of the second of two boxes that are seen."""
    pieces = scene(behind, beside)._pieces
    assert pieces is not None
    return pieces.seen[None] & (pieces.centres_m[:, 0] > 0.5)


def test_a_capture_has_clutter_only_while_nobody_hides_it() -> None:
    mesh = ball()
    aside = np.where(np.arange(mesh.frame_count) < mesh.frame_count // 2, 0.0, 1.5)
    stepping = replace(mesh, vertices=mesh.vertices + aside[:, None, None] * [1.0, 0.0, 0.0])
    behind = Thing("box", (0.0, 0.15, 3.65), size_m=(0.3, 0.3, 0.3))
    with_box, without = (
        simulate_radar(one, FINE, options=QUIET).samples[...].astype(float)
        for one in (with_things(stepping, [behind]), stepping)
    )
    # Each has its own gain and middle; both show the ball alone in the first frame.
    gain, middle = np.polyfit(without[0].ravel(), with_box[0].ravel(), 1)
    left = with_box - gain * without - middle
    assert np.abs(left[0]).max() < 0.05 * np.abs(left[-1]).max()


def test_it_is_seen_in_a_floor_as_well() -> None:
    box = Thing("box", (0.0, 0.1, 2.0), size_m=(0.2, 0.2, 0.2))
    floor = Mirror.ground(1.0)
    assert not np.allclose(scene(box, mirror=floor).static(()), scene(box).static(()))


def test_a_capture_holds_the_clutter_and_says_so() -> None:
    mesh = ball()
    box = Thing("box", (0.4, 0.1, 1.0), size_m=(0.2, 0.2, 0.2))
    with_box, without = (
        simulate_radar(one, PAPER_RADAR, options=QUIET) for one in (with_things(mesh, [box]), mesh)
    )
    assert with_box.meta["simulation"]["things"][0]["shape"] == "box"
    assert "things" not in without.meta["simulation"]
    raw, cleared = (doppler_map(with_box, clutter=clutter).values for clutter in ("none", "mean"))
    still = raw.shape[0] // 2
    assert raw[still - 1 : still + 1].sum() > 0.5 * raw.sum()
    moving = doppler_map(without, clutter="mean").values
    shares = [np.abs(one / one.sum()) for one in (cleared, moving)]
    assert np.abs(shares[0] - shares[1]).sum() < 0.1
