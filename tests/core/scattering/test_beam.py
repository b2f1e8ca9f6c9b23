"""The beam of the antennas: what directions it weighs how, everywhere alike."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2core.cli.reading import looking
from sd2core.doppler.options import PRESETS, SynthesisOptions
from sd2core.doppler.reference import reference_stretch
from sd2core.doppler.synthesizer import Synthesizer
from sd2core.errors import Sd2Error
from sd2core.files.resources import resource_path
from sd2core.fmcw.options import Mirror, Reflector, WaveOptions
from sd2core.fmcw.wave import WaveScene
from sd2core.io.beam_files import find_beam, read_beam
from sd2core.io.mesh import load_mesh
from sd2core.mesh.sequence import MeshSequence
from sd2core.options.shared import Looking
from sd2core.radar_config import PAPER_RADAR
from sd2core.scattering.beam import (
    beam_of_cuts,
    half_power_rim,
    one_way,
    sensor_axes,
    share_in_beam,
)
from sd2core.scattering.beam_kernels import beam_tables, weigh_by_beam
from sd2core.scattering.echo_paths import echo_paths
from sd2core.sensor import Beam, VirtualSensor, aimed_at, direction_from_angles
from sd2core.timebase import Timebase

NARROW = Beam(40.0, 20.0)


def two_way_gain(sensor: VirtualSensor, points_m: np.ndarray) -> np.ndarray:
    return echo_paths(sensor)[0].gain(points_m, np.array([sensor.position_m]))


angles = st.floats(-179.0, 179.0)


@pytest.fixture(scope="module")
def body() -> MeshSequence:
    return load_mesh(resource_path("swipes.sd2") / "mesh.zarr").between(62, 68)


def towards(sensor: VirtualSensor, across_deg: float, up_deg: float) -> np.ndarray:
    """Point at 2 m in a direction by the sensor's own axes, (3, 1)."""
    right, down, ahead = direction_from_angles(across_deg, up_deg)
    along = np.array([right, down, ahead]) @ sensor_axes(sensor)
    return (np.asarray(sensor.position_m) + 2.0 * along)[:, None]


@given(angles, st.floats(-89.0, 89.0), angles, st.floats(-89.0, 89.0))
def test_power_is_halved_once_a_way_at_half_the_width(azimuth, elevation, x, y) -> None:
    sensor = VirtualSensor((0.01 * x, 0.01 * y, 1.0), azimuth, elevation, NARROW)
    for across, up, passed in ((0, 0, 1.0), (20, 0, 0.25), (-20, 0, 0.25), (0, 10, 0.25)):
        gain = two_way_gain(sensor, towards(sensor, across, up))[0]
        assert gain == pytest.approx(passed, rel=1e-6)
    assert two_way_gain(replace(sensor, beam=None), towards(sensor, 90, 0))[0] == 1.0


@given(st.floats(1.0, 360.0), st.floats(1.0, 360.0), angles, st.floats(-89.0, 89.0), angles, angles)
def test_compiled_and_plain_weights_agree(across_deg, up_deg, azimuth, elevation, x, y) -> None:
    sensor = VirtualSensor((0.5, -0.2, 0.1), azimuth, elevation, Beam(across_deg, up_deg))
    points = np.array([[0.02 * x, 0.3, -1.0], [0.01 * y, 0.0, 0.2], [1.5, -2.0, 0.0]])
    plain = two_way_gain(sensor, points)
    weight = np.full(3, 3.0, np.float32)
    weigh_by_beam(*points, *sensor.position_m, *beam_tables(sensor), weight)
    # Between entries of the table of a beam of one degree a thousandth of the most is missed.
    np.testing.assert_allclose(weight, 3.0 * plain, rtol=2e-3, atol=3e-3 / across_deg)


def test_a_table_with_the_numbers_of_a_normal_curve_is_that_beam(tmp_path: Path) -> None:
    degrees = np.arange(-180.0, 181.0)
    rows = [
        (angle, *(10.0 * math.log10(float(one_way(NARROW, *pair))) - 3.5 for pair in pairs))
        for angle in degrees
        for pairs in [((angle, 0.0), (0.0, angle))]
    ]
    path = tmp_path / "antenna.csv"
    lines = ["angle_deg;azimuth_db;elevation_db", *(";".join(map(str, row)) for row in rows)]
    path.write_text("\n".join(lines))
    beam = find_beam(str(path))
    assert (beam.azimuth_width_deg, beam.elevation_width_deg) == pytest.approx((40, 20), abs=0.05)
    across, up = np.meshgrid(np.arange(-30.0, 31.0, 10.0), np.arange(-12.0, 13.0, 4.0))
    np.testing.assert_allclose(one_way(beam, across, up), one_way(NARROW, across, up), rtol=1e-9)


@pytest.mark.parametrize(
    ("apart", "point"), [(",", "."), (", ", "."), (";", ","), ("\t", ","), ("  ", ".")]
)
def test_tables_of_beams_are_taken_as_programs_write_them(
    tmp_path: Path, apart: str, point: str
) -> None:
    rows = [(-9.5, -3.5, -6.0), (0.0, 0.0, 0.0), (9.5, -3.5, -6.0)]
    path = tmp_path / "antenna.csv"
    lines = [apart.join(str(one).replace(".", point) for one in row) for row in rows]
    path.write_text("\n".join([apart.join(("angle", "azimuth", "elevation")), *lines]))
    assert read_beam(path).cuts == tuple(rows)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("0,-3\n", "1 is '0,-3'"),
        ("-9,0,0\n0,0,0\nnine,0,0\n", "line 3 is 'nine,0,0'"),
        ("-9,0,0\n0,0,0\n", "2 lines of numbers"),
        ("1,0,0\n2,0,0\n3,0,0\n", "go from 1 to 3"),
        ("-9,0,0\n0,nan,0\n9,0,0\n", "line 2"),
    ],
)
def test_a_table_that_is_none_is_refused(tmp_path: Path, text: str, says: str) -> None:
    path = tmp_path / "antenna.csv"
    path.write_text(text)
    with pytest.raises(Sd2Error, match=says) as refused:
        read_beam(path)
    assert str(path) in str(refused.value)


def test_beams_are_named_typed_or_refused() -> None:
    assert find_beam("none") is None
    assert find_beam("56,28") == find_beam("iwr1443") == Beam(56.0, 28.0)
    for text in ("wide", "56", "1,2,3"):
        with pytest.raises(Sd2Error, match="two widths as 56,28"):
            find_beam(text)
    with pytest.raises(Sd2Error, match="elevation_width_deg is 0"):
        find_beam("56,0")
    with pytest.raises(Sd2Error, match=r"nowhere\.csv does not exist"):
        find_beam("nowhere.csv")


@pytest.mark.parametrize("aim", ["", "10", "nan,0", "361,0", "10,91", "forwards"])
def test_a_direction_that_is_none_is_refused(aim: str) -> None:
    with pytest.raises(Sd2Error, match=f"--aim is '{aim}'"):
        looking(VirtualSensor(), Looking(aim=aim), pytest.fail)
    assert looking(VirtualSensor(), Looking(aim="-190,90"), pytest.fail).azimuth_deg == -190.0


@pytest.mark.parametrize("null_db", [-60.0, -250.0, -9000.0])
def test_an_antenna_that_is_blind_ahead_is_weighed_to_the_sides(null_db: float) -> None:
    sides = beam_of_cuts(np.array([[-10, 0, 0], [0, null_db, null_db], [10, 0, 0]], float))
    sensor = VirtualSensor((0.0, 0.0, 0.0), beam=sides)
    points = [towards(sensor, *way) for way in ((10, 10), (-10, -10), (0, 10), (10, 0), (0, 0))]
    x, y, z = places = np.hstack(points)
    weight = np.ones(places.shape[1], np.float32)
    weigh_by_beam(x, y, z, 0.0, 0.0, 0.0, *beam_tables(sensor), weight)
    np.testing.assert_allclose(weight, two_way_gain(sensor, places), rtol=0.01, atol=1e-6)
    assert weight[0] == pytest.approx(1.0, abs=1e-3)


def test_the_rim_has_half_the_power() -> None:
    skewed = beam_of_cuts(
        np.array([[-90, -40, -12], [-10, -6, -3], [0, 0, 0], [60, -6, -3], [90, -9, -40]], float)
    )
    for beam in (NARROW, skewed):
        right, down, ahead = half_power_rim(beam).T
        across, up = np.degrees(np.arctan2(right, ahead)), np.degrees(np.arcsin(-down))
        np.testing.assert_allclose(one_way(beam, across, up), 0.5, atol=0.03)


@pytest.mark.parametrize(
    "options",
    [
        PRESETS["paper"],
        PRESETS["vid2doppler"],
        SynthesisOptions(range_exponent=0.0, weight="projected"),
        SynthesisOptions(range_law="frame", weight="area", count="plain"),
    ],
)
@pytest.mark.parametrize("turned_deg", [0.0, 25.0])
def test_maps_agree_with_the_reference(body, options, turned_deg) -> None:
    sensor = VirtualSensor((0.3, 0, 0), azimuth_deg=turned_deg, beam=NARROW)
    found = Synthesizer(body, options).stretch(sensor, 1, 4).raw
    np.testing.assert_allclose(
        found, reference_stretch(body, sensor, options, 1, 4), rtol=1e-5, atol=1e-9
    )
    assert found.sum() > 0


def test_what_is_aimed_at_counts_and_limbs_add_up(body) -> None:
    from sd2core.body.parts import body_parts

    maker = Synthesizer(body)
    middle = tuple(body.frame(2).mean(axis=0).tolist())
    aimed = aimed_at(VirtualSensor(beam=NARROW), middle)
    alike = maker.map(replace(aimed, beam=None)).values
    inside = maker.limb_maps(aimed, body_parts(body))
    behind = maker.map(replace(aimed, azimuth_deg=aimed.azimuth_deg + 180.0)).values
    assert 0.05 * alike.sum() < inside.values.sum() < 0.9 * alike.sum()
    assert behind.sum() < 1e-9 * alike.sum()
    np.testing.assert_allclose(inside.limbs.values.sum(axis=0), inside.values, atol=1e-7)
    # Without a beam the direction changes nothing, to the last bit.
    turned = maker.map(replace(aimed, beam=None, azimuth_deg=170.0)).values
    np.testing.assert_array_equal(turned, alike)
    wide = maker.map(replace(aimed, beam=Beam(360.0, 360.0))).values
    assert wide.sum() == pytest.approx(alike.sum(), rel=0.1)


@pytest.mark.parametrize("coherent", [True, False])
def test_a_radar_signal_weakens_as_the_point_that_it_comes_from(coherent: bool) -> None:
    facet = np.array([[-1.0, 0, 0], [0, 1, 0], [1, -1, 0]]) * 1e-3 + [0.4, -0.3, 2.0]
    mesh = MeshSequence(
        np.stack([facet] * 3), np.array([[0, 1, 2]], np.int32), Timebase(np.arange(3) / 30.0)
    )
    wave = WaveOptions(coherent=coherent)
    plain = VirtualSensor(azimuth_deg=6.0, elevation_deg=3.0)
    beamed = replace(plain, beam=NARROW)
    signals = [
        np.abs(WaveScene(mesh, PAPER_RADAR, sensor, "facing", wave).frame(1 / 30)).max()
        for sensor in (plain, beamed)
    ]
    passed = two_way_gain(beamed, facet.mean(axis=0)[:, None])[0]
    # Receivers stand a few millimetres beside the transmitter.
    assert signals[1] / signals[0] == pytest.approx(math.sqrt(passed), rel=2e-3)


def test_reflectors_and_mirror_images_are_weighed_too(body) -> None:
    point = Reflector((0.5, 0.0, 2.0), 0.1)
    beamed = VirtualSensor(beam=NARROW)
    powers = []
    for sensor in (VirtualSensor(), beamed):
        scene = WaveScene(body, PAPER_RADAR, sensor)
        powers.append(np.abs(scene.static((point,))).max())
    gain = two_way_gain(beamed, np.array(point.position_m)[:, None])[0]
    assert powers[1] / powers[0] == pytest.approx(math.sqrt(gain), rel=2e-3)
    # A wall behind a sensor that looks away from the body: only its image sees it.
    mirror = Mirror.wall(-1.0, reflection=1.0)
    away = VirtualSensor(azimuth_deg=180.0, beam=NARROW)
    seen = np.abs(WaveScene(body, PAPER_RADAR, away).frame(body.times_s[2])).max()
    scene = WaveScene(body, PAPER_RADAR, away, "facing", WaveOptions(mirror=mirror))
    assert np.abs(scene.frame(body.times_s[2])).max() > 100 * seen


def test_two_beams_for_one_antenna_are_refused(body) -> None:
    with pytest.raises(Sd2Error, match=r"40° × 20°.*one of the two"):
        WaveScene(
            body, PAPER_RADAR, VirtualSensor(beam=NARROW), "facing", WaveOptions(beam_width_deg=9)
        )


def test_the_share_in_the_beam_counts_the_echo_not_the_vertices() -> None:
    sensor = VirtualSensor(beam=NARROW)
    points = np.array([[0.0, 2.0, 0.1], [0.0, 0.0, 0.0], [2.0, 2.0, 2.0]])
    assert share_in_beam(sensor, points, np.array([1.0, 2.0, 1.0])) == pytest.approx(0.5)
    assert share_in_beam(sensor, points, np.zeros(3)) is None
    assert share_in_beam(VirtualSensor(), points, np.ones(3)) is None


def test_a_sensor_survives_as_plain_values() -> None:
    table = ((-90.0, -20.0, -9.0), (0.0, 0.0, 0.0), (90.0, -20.0, -9.0))
    for beam in (None, NARROW, Beam(30.0, 20.0, table)):
        sensor = VirtualSensor((1, 2, 3), 4.0, 5.0, beam)
        assert VirtualSensor.from_dict(sensor.as_dict()) == sensor
    # What an earlier version drew, and did not apply.
    assert VirtualSensor.from_dict({"field_of_view_deg": 90.0}) == VirtualSensor()
    assert "beam" not in VirtualSensor().as_dict()
