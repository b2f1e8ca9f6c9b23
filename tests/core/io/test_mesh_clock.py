"""Clocks of mesh files: names, units, numbers of frames."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sd2core.errors import Sd2Error
from sd2core.io.mesh import load_mesh, save_mesh
from sd2core.io.unpacking import unpack_npz
from sd2core.mesh.sequence import MeshSequence
from sd2core.timebase import Timebase

POSE = np.random.default_rng(0).uniform((-0.3, -0.9, 2.5), (0.3, 0.9, 2.9), (60, 3))
FRAMES = 12
BODY = POSE - np.array([0, 0, 0.01]) * np.arange(FRAMES)[:, None, None]
TIMES_S = np.arange(FRAMES) / 25
DATES = np.datetime64("2026-03-01T10:00:00", "us") + (TIMES_S * 1e6).astype("m8[us]")


def read(path: Path, **arrays: object) -> MeshSequence:
    np.savez(path / "m.npz", vertices=BODY, **arrays)
    return load_mesh(path / "m.npz")


def remarks(mesh: MeshSequence) -> list[str]:
    return [note for note in mesh.notes if "no faces" not in note]


@pytest.mark.parametrize(
    "name", ["fps", "FPS", "frame_rate", "frameRate", "mocap_framerate", "mocap_frame_rate"]
)
@pytest.mark.parametrize(
    "value", [25, 25.0, np.array([25.0]), "25", "25000/1000", np.array([25025, 1001])]
)
def test_a_rate_has_many_names(tmp_path: Path, name: str, value: object) -> None:
    mesh = read(tmp_path, **{name: value})
    np.testing.assert_allclose(mesh.times_s, TIMES_S)
    assert remarks(mesh) == []


@pytest.mark.parametrize(
    ("name", "per_s"),
    [
        ("times_s", 1),
        ("timestamps", 1),
        ("timestamps_ms", 1e3),
        ("time_us", 1e6),
        ("frame_times_ns", 1e9),
        ("timestamps_milliseconds", 1e3),
        ("times_microseconds", 1e6),
        ("time_min", 1 / 60),
    ],
)
def test_a_unit_in_the_name_is_taken_at_its_word(tmp_path: Path, name: str, per_s: float) -> None:
    mesh = read(tmp_path, **{name: TIMES_S * per_s})
    np.testing.assert_allclose(mesh.times_s, TIMES_S, atol=1e-9)
    assert remarks(mesh) == []


@pytest.mark.parametrize(
    ("per_s", "unit"), [(1e3, "milliseconds"), (1e6, "microseconds"), (1e9, "nanoseconds")]
)
def test_a_unit_by_plausibility_is_told(tmp_path: Path, per_s: float, unit: str) -> None:
    mesh = read(tmp_path, times=TIMES_S * per_s)
    np.testing.assert_allclose(mesh.times_s, TIMES_S, atol=1e-9)
    (note,) = remarks(mesh)
    assert unit in note


def test_own_times_are_never_changed_but_judged(tmp_path: Path) -> None:
    mesh = read(tmp_path, times_s=TIMES_S * 1e3)
    np.testing.assert_array_equal(mesh.times_s, TIMES_S * 1e3)
    (finding,) = mesh.findings
    assert "milliseconds: pass --fps 25" in str(finding)
    assert str(finding) in mesh.notes
    cured = load_mesh(tmp_path / "m.npz", frames_per_s=finding.cure.value)
    np.testing.assert_allclose(cured.times_s, TIMES_S)
    assert cured.findings == ()


@pytest.mark.parametrize(
    "dates", [DATES, DATES.astype("f8") / 1e6, DATES.astype("i8"), DATES - DATES[0]]
)
def test_dates_count_from_the_first(tmp_path: Path, dates: np.ndarray) -> None:
    mesh = read(tmp_path, timestamps=dates)
    np.testing.assert_allclose(mesh.times_s, TIMES_S, atol=1e-6)
    # Time spans are no dates.
    assert any("dates" in note for note in mesh.notes) == (dates.dtype.kind != "m")


def test_dates_that_are_none_are_refused(tmp_path: Path) -> None:
    dates = DATES.copy()
    dates[3] = np.datetime64("NaT")
    with pytest.raises(Sd2Error, match="1 of 12 are NaT"):
        read(tmp_path, times=dates)


def test_dates_survive_being_unpacked(tmp_path: Path) -> None:
    np.savez(tmp_path / "m.npz", vertices=BODY, times=DATES)
    unpack_npz(tmp_path / "m.npz", tmp_path / "m.zarr")
    np.testing.assert_allclose(load_mesh(tmp_path / "m.zarr").times_s, TIMES_S, atol=1e-6)


def test_a_single_time_or_number_says_nothing_of_frames(tmp_path: Path) -> None:
    mesh = read(tmp_path, fps=25, time=np.array(123.4), frame_number=np.array(7))
    np.testing.assert_allclose(mesh.times_s, TIMES_S)


@pytest.mark.parametrize("kind", [".npz", ".zarr"])
def test_missing_frame_ids_are_time_without_a_person(tmp_path: Path, kind: str) -> None:
    ids = np.where(np.arange(FRAMES) < 5, np.arange(FRAMES), np.arange(FRAMES) + 20)
    path = tmp_path / "m.npz"
    np.savez(path, vertices=BODY, frame_ids=ids, fps=25)
    if kind == ".zarr":
        unpack_npz(path, path := tmp_path / "m.zarr")
    mesh = load_mesh(path)
    assert mesh.times_s[-1] == pytest.approx(31 / 25)
    assert "20 video frames hold no mesh" in " ".join(mesh.notes)
    # No velocity is measured from before the gap to after it.
    before, after = np.searchsorted(mesh.times_s, [4 / 25, 25 / 25 - 1e-9])
    assert not mesh.presence.present[before : after + 1].all()
    assert mesh.findings == ()


def test_attributes_of_a_store_hold_the_rate(tmp_path: Path) -> None:
    import zarr

    save_mesh(MeshSequence(BODY, None, Timebase(TIMES_S)), tmp_path / "m.zarr")
    group = zarr.open_group(tmp_path / "m.zarr")
    del group["times_s"]
    group.attrs["frame_rate"] = 25
    np.testing.assert_allclose(load_mesh(tmp_path / "m.zarr").times_s, TIMES_S)


@pytest.mark.parametrize("kind", [".npz", ".zarr"])
def test_frames_in_one_point_are_without_a_person(tmp_path: Path, kind: str) -> None:
    vertices = BODY.copy()
    vertices[4] = 0
    vertices[9] = 0.25
    path = tmp_path / "m.npz"
    np.savez(path, vertices=vertices, times_s=TIMES_S)
    if kind == ".zarr":
        unpack_npz(path, path := tmp_path / "m.zarr")
    mesh = load_mesh(path)
    np.testing.assert_array_equal(np.flatnonzero(~mesh.presence.present), [4, 9])
    assert "2 frames hold no body" in " ".join(mesh.notes)
    assert mesh.findings == ()


@pytest.mark.parametrize("kind", [".npz", ".zarr"])
@pytest.mark.parametrize(
    ("turn", "made"),
    [("x180", lambda p: p * [1, -1, -1]), ("x90", lambda p: p[..., [0, 2, 1]] * [1, 1, -1])],
)
def test_a_turn_gives_back_the_cameras_frame(tmp_path: Path, kind: str, turn, made) -> None:
    path = tmp_path / "m.npz"
    np.savez(path, vertices=made(BODY), times_s=TIMES_S)
    if kind == ".zarr":
        unpack_npz(path, path := tmp_path / "m.zarr")
    mesh = load_mesh(path, turn=turn, distance_m=0.5)
    np.testing.assert_allclose(mesh.read(0, FRAMES), BODY + np.array([0, 0, 0.5]), atol=1e-6)
    with pytest.raises(Sd2Error, match=r"'x45'.*x90, x180"):
        load_mesh(path, turn="x45")
