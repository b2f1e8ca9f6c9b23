from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zarr
from numpy.typing import NDArray

from sd2core.accuracy.sample import take_sample
from sd2core.doppler import PRESETS
from sd2core.errors import Sd2Error
from sd2core.io.mesh import load_mesh, save_mesh
from sd2core.mesh.decimation import decimate
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.velocity_uncertainty import VelocityUncertainty
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase
from tools.build_sample.sample import write_compact_mesh

FRAMES = 6


def ball() -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    import trimesh

    shape = trimesh.creation.icosphere(subdivisions=2, radius=0.85)
    steps = np.linspace(2.0, 1.5, FRAMES)[:, None, None] * np.array([0, 0, 1.0])
    return (shape.vertices[None] + steps).astype(np.float32), shape.faces.astype(np.int32)


def known(vertices: int, frames: int = FRAMES) -> VelocityUncertainty:
    random = np.random.default_rng(3)
    return VelocityUncertainty(
        ("hand", "rest"),
        np.arange(vertices) % 2,
        random.uniform(0.1, 0.4, (frames, 2)),
        random.uniform(0.01, 0.05, (frames, 2)),
    )


@pytest.fixture
def mesh() -> MeshSequence:
    vertices, faces = ball()
    return MeshSequence(
        vertices, faces, Timebase.regular(FRAMES, 30.0), uncertainty=known(vertices.shape[1])
    )


def same(found: VelocityUncertainty | None, expected: VelocityUncertainty | None) -> None:
    assert found is not None
    assert expected is not None
    assert found.limbs == expected.limbs
    for name in ("vertex_limb", "along_mps", "across_mps"):
        given, wanted = getattr(found, name), getattr(expected, name)
        assert given.dtype == wanted.dtype
        np.testing.assert_array_equal(given, wanted)


# --- the mixture --------------------------------------------------------------------------


def test_a_sensor_at_the_camera_sees_what_the_camera_sees_badly() -> None:
    limb_m = np.array([[[0.3, -0.2, 2.0], [0.0, 0.5, 3.0]]])
    found = known(4).towards((0.0, 0.0, 0.0), limb_m, start=2)
    np.testing.assert_allclose(found[0], known(4).along_mps[2], rtol=1e-6)


def test_a_sensor_aside_sees_what_the_camera_sees_well() -> None:
    limb_m = np.array([[[0.0, 0.0, 2.0], [0.0, 0.0, 2.0]]])
    found = known(4).towards((5.0, 0.0, 2.0), limb_m)
    np.testing.assert_allclose(found[0], known(4).across_mps[0], rtol=1e-6)


def test_in_between_it_is_what_random_velocities_give() -> None:
    limb_m, sensor = np.array([0.4, 0.1, 2.5]), np.array([1.5, -0.5, 0.5])
    sigma = known(4)
    found = sigma.towards(sensor, np.stack([limb_m, limb_m])[None])[0]
    random = np.random.default_rng(1)
    axis = limb_m / np.linalg.norm(limb_m)
    towards = (sensor - limb_m) / np.linalg.norm(sensor - limb_m)
    for limb in range(2):
        noise = random.normal(size=(200_000, 3)) * sigma.across_mps[0, limb]
        along = random.normal(size=(200_000, 1)) * sigma.along_mps[0, limb]
        velocity = noise - (noise @ axis)[:, None] * axis + along * axis
        assert (velocity @ towards).std() == pytest.approx(found[limb], rel=0.01)


def test_on_the_sensor_the_worse_is_taken() -> None:
    limb_m = np.zeros((1, 2, 3))
    np.testing.assert_allclose(
        known(4).towards((0.0, 0.0, 0.0), limb_m)[0], known(4).along_mps[0], rtol=1e-6
    )


# --- who carries it -----------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".npz", ".zarr", ".zarr.zip"])
def test_files_carry_it(mesh: MeshSequence, tmp_path: Path, suffix: str) -> None:
    save_mesh(mesh, tmp_path / f"m{suffix}")
    same(load_mesh(tmp_path / f"m{suffix}").uncertainty, mesh.uncertainty)
    save_mesh(replace(mesh, uncertainty=None), tmp_path / f"plain{suffix}")
    assert load_mesh(tmp_path / f"plain{suffix}").uncertainty is None


def test_the_compact_form_carries_it(mesh: MeshSequence, tmp_path: Path) -> None:
    write_compact_mesh(mesh, tmp_path / "m.zarr")
    same(load_mesh(tmp_path / "m.zarr").uncertainty, mesh.uncertainty)


def test_it_follows_scale_and_frame_rate(mesh: MeshSequence, tmp_path: Path) -> None:
    save_mesh(mesh, tmp_path / "m.npz")
    read = load_mesh(tmp_path / "m.npz", scale=0.5, frames_per_s=90.0).uncertainty
    assert read is not None
    assert mesh.uncertainty is not None
    np.testing.assert_allclose(read.along_mps, 1.5 * mesh.uncertainty.along_mps, rtol=1e-5)
    np.testing.assert_allclose(read.across_mps, 1.5 * mesh.uncertainty.across_mps, rtol=1e-5)


def test_a_decimated_mesh_keeps_the_limbs_of_its_vertices(mesh: MeshSequence) -> None:
    vertices = mesh.read(0, 1)[0]
    limbs = (vertices[:, 0] > 0).astype(np.uint8)
    assert mesh.uncertainty is not None
    split = replace(mesh, uncertainty=replace(mesh.uncertainty, vertex_limb=limbs))
    fewer = decimate(split, 0.3)
    assert fewer.vertex_count < mesh.vertex_count
    assert fewer.uncertainty is not None
    np.testing.assert_array_equal(fewer.uncertainty.vertex_limb, fewer.frame(0)[:, 0] > 0)


def test_sampled_frames_keep_theirs() -> None:
    frames = 450
    vertices = np.random.default_rng(0).normal(size=(frames, 4, 3))
    mesh = MeshSequence(
        vertices, None, Timebase.regular(frames, 30.0), uncertainty=known(4, frames)
    )
    sample = take_sample(mesh, VirtualSensor(), PRESETS["paper"])
    found = sample.of(mesh).uncertainty
    assert found is not None
    np.testing.assert_array_equal(found.along_mps, known(4, frames).along_mps[sample.frames])


# --- what is wrong ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"vertex_limb": [0, 2]}, "vertex_limb runs from 0 to 2"),
        ({"vertex_limb": [0.0, 1.0]}, "vertex_limb is of type float64"),
        ({"limbs": ()}, "names 0 limbs"),
        ({"along_mps": np.zeros((5, 2))}, "across_mps is of type"),
        ({"along_mps": -np.ones((FRAMES, 2))}, "along_mps holds numbers that are negative"),
        ({"across_mps": np.full((FRAMES, 2), np.nan)}, "across_mps holds numbers"),
        ({"across_mps": np.zeros((FRAMES, 3))}, "across_mps is of type"),
    ],
)
def test_what_does_not_fit_is_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(Sd2Error, match=message):
        replace(known(4), **changes)


def test_that_of_another_mesh_is_refused(mesh: MeshSequence) -> None:
    for other in (known(7), known(mesh.vertex_count, 5)):
        with pytest.raises(Sd2Error, match="its uncertainty is of"):
            replace(mesh, uncertainty=other)


def test_half_of_it_in_a_file_is_explained(mesh: MeshSequence, tmp_path: Path) -> None:
    save_mesh(mesh, tmp_path / "m.zarr")
    group = zarr.open_group(str(tmp_path / "m.zarr"), mode="r+")
    del group["vertex_limb"]
    with pytest.raises(Sd2Error, match=r"m\.zarr holds limb_velocity_sigma_mps and"):
        load_mesh(tmp_path / "m.zarr")


def test_limbs_without_names_are_numbered(mesh: MeshSequence, tmp_path: Path) -> None:
    save_mesh(mesh, tmp_path / "m.npz")
    with np.load(tmp_path / "m.npz") as data:
        arrays = {name: data[name] for name in data.files if name != "limbs"}
    np.savez(tmp_path / "m.npz", **arrays)
    read = load_mesh(tmp_path / "m.npz").uncertainty
    assert read is not None
    assert read.limbs == ("limb 0", "limb 1")
