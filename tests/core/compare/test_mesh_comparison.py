from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from full_disk import full_disk
from matplotlib.figure import Figure

from sd2core.body.model import Body
from sd2core.body.rotations import about
from sd2core.compare.figure import draw_comparison
from sd2core.compare.joints import JOINTS, rows_of
from sd2core.compare.measures import common_times, map_l1
from sd2core.compare.meshes import compare_meshes
from sd2core.errors import Sd2Error
from sd2core.files.figure_files import save_figure
from sd2core.io.things import with_walls
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.walls import Wall
from sd2core.scattering.resampling import resample_mesh
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase
from tools.build_sample.swipes import posed

TIMES = np.arange(24) / 30.0


def waving(times_s: np.ndarray = TIMES) -> MeshSequence:
    """The coarse body 2.5 m off; its right elbow swings."""
    body = Body.load("low")
    turns = np.tile(np.eye(3), (len(times_s), len(body.skeleton), 1, 1))
    angle = 40.0 * np.sin(2.0 * np.pi * 1.2 * times_s)
    turns[:, body.skeleton.index["lowerarm01.R"]] = about(np.array([1.0, 0.0, 0.0]), angle)
    vertices = posed(body, turns) + np.array([0.0, 1.0, 2.5])
    return MeshSequence(vertices, body.faces, Timebase(times_s))


def changed(mesh: MeshSequence, vertices: np.ndarray) -> MeshSequence:
    return MeshSequence(vertices, mesh.faces, mesh.timebase)


@pytest.fixture(scope="module")
def mesh() -> MeshSequence:
    return waving()


def test_a_mesh_equals_itself(mesh: MeshSequence) -> None:
    found = compare_meshes([mesh, mesh], ["a", "b"])
    for one in found.differences:
        assert one.distance_m.max() == one.velocity_rms_mps.max() == one.map_l1 == 0.0
        assert (one.correlation == 1.0).all()
    assert found.notes == ()


def test_a_mesh_in_a_room_equals_itself_outside(mesh: MeshSequence) -> None:
    room = with_walls(mesh, [Wall(1.5, azimuth_deg=90.0, loss_db=0.0)])
    found = compare_meshes([room, mesh], ["a", "b"])
    assert found.differences[1].map_l1 == 0.0
    assert any("without walls and things" in note for note in found.notes)


def test_a_shift_is_a_distance_until_it_is_aligned(mesh: MeshSequence) -> None:
    aside = changed(mesh, np.asarray(mesh.vertices) + np.array([0.03, 0.0, 0.04]))
    apart = compare_meshes([mesh, aside], ["a", "b"]).differences[1]
    np.testing.assert_allclose(apart.distance_m, 0.05, atol=1e-9)
    aligned = compare_meshes([mesh, aside], ["a", "b"], alignment="root").differences[1]
    assert aligned.distance_m.max() < 1e-9
    # Velocities are not aligned: seen from elsewhere they differ a little.
    np.testing.assert_array_equal(aligned.velocity_rms_mps, apart.velocity_rms_mps)


def test_an_approach_is_a_difference_of_velocity(mesh: MeshSequence) -> None:
    nearer = np.asarray(mesh.vertices) - TIMES[:, None, None] * np.array([0.0, 0.0, 0.2])
    found = compare_meshes([mesh, changed(mesh, nearer)], ["a", "b"])
    pelvis, hand = rows_of(("pelvis", "hand.R"))
    assert found.differences[1].velocity_rms_mps[pelvis] == pytest.approx(0.2, abs=0.005)
    assert found.velocity_mps[1][:, pelvis] == pytest.approx(0.2, abs=0.005)
    assert found.differences[1].correlation[hand] > 0.98
    assert found.differences[1].map_l1 > 0.1


def test_a_hand_at_rest_does_not_spoil_the_correlation_of_both(mesh: MeshSequence) -> None:
    """The left one sways by a millimetre, the other way in the second mesh."""
    sway_m = 1e-3 * np.sin(8.0 * TIMES)[:, None, None] * np.array([0.0, 0.0, 1.0])
    vertices = np.asarray(mesh.vertices)
    left = vertices[..., :1] > vertices[0, :, 0].mean() + 0.1
    pair = [changed(mesh, vertices + sign * left * sway_m) for sign in (1, -1)]
    found = compare_meshes(pair, ["a", "b"])
    still, waves = rows_of(("hand.L", "hand.R"))
    assert found.differences[1].correlation[still] < -0.9
    assert found.differences[1].correlation[waves] > 0.9
    assert found.group_correlation(1, "hands") > 0.9


def test_the_maps_of_half_the_motion_differ(mesh: MeshSequence) -> None:
    vertices = np.asarray(mesh.vertices)
    half = 0.5 * (vertices + vertices.mean(axis=0))
    found = compare_meshes([mesh, changed(mesh, half)], ["a", "b"])
    one = found.differences[1]
    hand = JOINTS.index("hand.R")
    truth = np.sqrt((found.velocity_mps[0][:, hand] ** 2).mean())
    assert one.velocity_rms_mps[hand] == pytest.approx(0.5 * truth, rel=0.05)
    assert 0.2 < one.map_l1 < 2.0
    assert map_l1(found.maps[1], found.maps[0]) == one.map_l1


def test_jitter_belongs_to_the_mesh_that_has_it(mesh: MeshSequence) -> None:
    noise = np.random.default_rng(0).normal(scale=0.002, size=(len(TIMES), 1, 3))
    found = compare_meshes([mesh, changed(mesh, np.asarray(mesh.vertices) + noise)], ["a", "b"])
    calm, shaky = (one.jitter_mps3[JOINTS.index("ankle.L")] for one in found.differences)
    assert calm < 1e-6
    # Third differences of white noise: √20 per axis, three axes, 30³ of them per s³.
    assert shaky == pytest.approx(0.002 * np.sqrt(20 * 3) * 30**3, rel=0.25)


def test_other_frame_rates_are_compared_on_common_times(mesh: MeshSequence) -> None:
    other = waving(np.arange(60) / 75.0)
    found = compare_meshes([mesh, other], ["a", "b"])
    assert found.differences[1].distance_m.max() < 1e-3
    assert found.differences[1].velocity_rms_mps.max() < 0.02
    assert found.notes == ("b: interpolated to the frame times of a.",)


def test_only_common_times_are_compared(mesh: MeshSequence) -> None:
    late = MeshSequence(mesh.vertices[6:], mesh.faces, Timebase(TIMES[6:]))
    found = compare_meshes([mesh, late], ["a", "b"])
    assert len(found.times_s) == len(TIMES) - 6
    assert found.differences[1].distance_m.max() == 0.0
    assert found.notes == ("a: 18 of 24 frames are compared.",)
    with pytest.raises(Sd2Error, match="0 frames in common"):
        common_times([mesh, MeshSequence(mesh.vertices, mesh.faces, Timebase(TIMES + 9.0))])


def test_frames_without_a_person_do_not_count(mesh: MeshSequence) -> None:
    vertices = np.asarray(mesh.vertices).copy()
    vertices[10:14] = vertices[9]
    vertices[14:] += np.array([0.0, 0.0, 0.5])  # the person came back elsewhere
    there = np.ones(len(TIMES), bool)
    there[10:14] = False
    gap = replace(mesh, vertices=vertices, present=there)
    found = compare_meshes([mesh, gap], ["a", "b"], alignment="root")
    assert (found.measured == there).all()
    assert found.differences[1].distance_m.max() < 1e-9
    # Seen from half a metre further off, nothing else.
    assert found.differences[1].velocity_rms_mps.max() < 0.1
    assert np.abs(found.maps[0].values[:, 11:13]).max() == 0.0
    assert any("4 of 24 frames are left out" in note for note in found.notes)
    moved, _ = resample_mesh(gap, np.array([0.1, 0.3167, 0.40, 0.45, 0.5]))
    assert moved.presence.present.tolist() == [True, False, False, False, True]


def test_no_velocity_is_measured_across_a_gap_in_the_times(mesh: MeshSequence) -> None:
    later = Timebase(TIMES + 2.0 * (np.arange(24) >= 12))
    vertices = np.array(mesh.vertices)
    apart = vertices + np.array([0.0, 0.0, 1.0]) * (np.arange(24) >= 12)[:, None, None]
    here, there = (replace(mesh, vertices=one, timebase=later) for one in (vertices, apart))
    found = compare_meshes([here, there], ["a", "b"])
    assert found.differences[1].velocity_rms_mps.max() < 0.05  # 0.5 m/s across the gap
    assert found.notes == ()


def test_nobody_is_there_in_a_gap_of_the_times(mesh: MeshSequence) -> None:
    later = replace(mesh, timebase=Timebase(TIMES + 1.0 * (np.arange(24) >= 12)))
    times_s = np.arange(0.0, 1.7, 0.05)
    moved, interpolated = resample_mesh(later, times_s)
    assert interpolated
    beyond = (times_s > later.times_s[11] - 1e-6) & (times_s < later.times_s[12])
    np.testing.assert_array_equal(moved.presence.present, ~beyond)


def test_frames_at_the_same_times_are_not_touched(mesh: MeshSequence) -> None:
    again, interpolated = resample_mesh(mesh, TIMES[3:9] + 2e-5)
    assert not interpolated
    np.testing.assert_array_equal(again.vertices, mesh.vertices[3:9])


def test_a_surface_that_is_not_ours(mesh: MeshSequence) -> None:
    order = np.random.default_rng(3).permutation(mesh.vertex_count)
    back = np.argsort(order).astype(np.int32)
    other = MeshSequence(mesh.vertices[:, order], back[mesh.faces], mesh.timebase)
    found = compare_meshes([other, mesh], ["theirs", "ours"], reference=1)
    assert found.differences[0].distance_m.max() < 1e-9
    assert "each joint follows the vertices nearest" in found.notes[0]
    with pytest.raises(Sd2Error, match="None of the meshes is a surface of SD² Studio"):
        compare_meshes([other, other], ["theirs", "again"])


def test_a_point_cloud_makes_all_maps_count_everything(mesh: MeshSequence) -> None:
    cloud = MeshSequence(mesh.vertices, None, mesh.timebase)
    found = compare_meshes([mesh, cloud], ["a", "b"])
    assert found.differences[1].map_l1 < 1e-6
    assert any("no faces" in note for note in found.notes)


def test_surfaces_of_other_vertices_are_named_as_such(mesh: MeshSequence) -> None:
    vertices = np.asarray(mesh.vertices)
    doubled = MeshSequence(np.concatenate([vertices, vertices], axis=1), mesh.faces, mesh.timebase)
    found = compare_meshes([mesh, doubled], ["ours", "doubled"])
    assert sum("different vertices" in note for note in found.notes) == 1


def test_the_sensor_may_be_elsewhere(mesh: MeshSequence) -> None:
    nearer = np.asarray(mesh.vertices) - TIMES[:, None, None] * np.array([0.0, 0.0, 0.2])
    pair = [mesh, changed(mesh, nearer)]
    behind = compare_meshes(pair, ["a", "b"], sensor=VirtualSensor((0.0, 0.0, 6.0)))
    assert behind.velocity_mps[1][:, JOINTS.index("pelvis")] == pytest.approx(-0.2, abs=0.005)


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".png", ".svg"])
def test_the_figure_shows_every_mesh(mesh: MeshSequence, tmp_path: Path, suffix: str) -> None:
    found = compare_meshes([mesh, mesh, mesh], ["truth", "ours", "theirs"], reference=1)
    figure = draw_comparison(found)
    titles = [axes.get_title() for axes in figure.axes]
    assert [title.split("\n")[0] for title in titles if title] == ["truth", "ours", "theirs"]
    assert titles[1].endswith("reference")
    save_figure(draw_comparison(found), tmp_path / f"figure{suffix}")
    start = (tmp_path / f"figure{suffix}").read_bytes()[:200]
    assert {".png": b"PNG", ".svg": b"<?xml"}[suffix] in start


@pytest.fixture(scope="module")
def figure(mesh: MeshSequence) -> Figure:
    return draw_comparison(compare_meshes([mesh, mesh], ["a", "b"]))


@pytest.mark.parametrize(
    "suffix", [".png", *(pytest.param(one, marks=pytest.mark.slow) for one in (".svg", ".pdf"))]
)
def test_a_figure_is_whole_or_not_there(figure: Figure, tmp_path: Path, suffix: str) -> None:
    with full_disk(), pytest.raises(OSError, match="figure"):
        save_figure(figure, tmp_path / f"figure{suffix}")
    assert not list(tmp_path.iterdir())


def test_a_figure_of_another_kind_is_refused(mesh: MeshSequence, tmp_path: Path) -> None:
    found = compare_meshes([mesh, mesh], ["a", "b"])
    with pytest.raises(Sd2Error, match=r"\.png, \.svg, \.pdf"):
        save_figure(draw_comparison(found), tmp_path / "figure.bmp")
