"""A number that is none is named wherever it first matters; large ones are judged."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from sd2core.doppler import Synthesizer
from sd2core.errors import Sd2Error
from sd2core.fmcw.simulation import simulate_radar
from sd2core.io.mesh import load_mesh, save_mesh
from sd2core.mesh.sequence import MeshSequence
from sd2core.radar_config import PAPER_RADAR
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase

FACES = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]], np.int32)
FRAMES, FRAME, VERTEX, AXIS = 12, 7, 2, 1
WRONG = pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf], ids=str)


def tetrahedron(value: float, dtype: Any = np.float32) -> NDArray[Any]:
    corners = np.array([[0.0, 0, 2], [1, 0, 2], [0, 1, 2], [0, 0, 3]])
    vertices = np.tile(corners, (FRAMES, 1, 1)).astype(dtype)
    vertices[FRAME, VERTEX, AXIS] = value
    return vertices


def naming(file: str, value: float) -> str:
    """What every message says: file, vertex, frame and the numbers."""
    return rf"{file}: vertex {VERTEX} of frame {FRAME} is at \(0, {value:g}, 2\)"


@WRONG
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_npz(tmp_path: Path, value: float, dtype: Any) -> None:
    path = tmp_path / "odd.npz"
    np.savez(path, vertices=tetrahedron(value, dtype), faces=FACES, fps=30.0)
    with pytest.raises(Sd2Error, match=naming(r"odd\.npz", value)):
        load_mesh(path)


@WRONG
def test_zarr_is_checked_when_it_is_read(tmp_path: Path, value: float) -> None:
    import zarr

    path = tmp_path / "odd.zarr"
    group = zarr.open_group(str(path), mode="w")
    group.create_array("vertices", data=tetrahedron(value), chunks=(2, 4, 3))
    group.create_array("faces", data=FACES)
    group.create_array("times_s", data=np.arange(FRAMES) / 30.0)
    mesh = load_mesh(path)
    mesh.read(0, FRAME)
    for start, stop in ((0, FRAMES), (FRAME, FRAME + 1), (FRAME - 1, FRAME + 3)):
        with pytest.raises(Sd2Error, match=naming(r"odd\.zarr", value)):
            mesh.read(start, stop)
    with pytest.raises(Sd2Error, match=naming(r"odd\.zarr", value)):
        mesh.vertices[FRAME]


@WRONG
@pytest.mark.parametrize("name", ["new.npz", "new.zarr"])
def test_saving(tmp_path: Path, name: str, value: float) -> None:
    mesh = MeshSequence(tetrahedron(value), FACES, Timebase.regular(FRAMES, 30.0), "given")
    with pytest.raises(Sd2Error, match=naming("given", value)):
        save_mesh(mesh, tmp_path / name)
    assert not (tmp_path / name).exists()


@WRONG
@pytest.mark.parametrize("preset", ["paper", "vid2doppler"])
def test_counting(preset: str, value: float) -> None:
    mesh = MeshSequence(tetrahedron(value), FACES, Timebase.regular(FRAMES, 30.0), "given")
    with pytest.raises(Sd2Error, match=naming("given", value)):
        Synthesizer(mesh, preset).map(VirtualSensor())


@WRONG
def test_radar_signal(value: float) -> None:
    mesh = MeshSequence(tetrahedron(value), FACES, Timebase.regular(FRAMES, 30.0), "given")
    with pytest.raises(Sd2Error, match=naming("given", value)):
        simulate_radar(mesh, PAPER_RADAR)


@pytest.mark.parametrize(
    ("dtype", "offset_m", "rate_hz", "said"),
    [
        (np.float32, 0.0, 30.0, False),
        (np.float32, 300.0, 30.0, False),
        (np.float32, 1e6, 30.0, True),
        (np.float32, 1e6, 1e-3, False),
        (np.float32, 0.0, 1e4, True),
        (np.float64, 1e6, 1e4, False),
    ],
)
def test_coordinates_that_the_file_has_rounded_too_much(
    tmp_path: Path, dtype: Any, offset_m: float, rate_hz: float, said: bool
) -> None:
    path = tmp_path / "far.npz"
    exact = tetrahedron(1.0, np.float64) + offset_m
    exact += 0.01 * np.random.default_rng(0).normal(size=exact.shape)
    np.savez(path, vertices=exact.astype(dtype), faces=FACES, fps=rate_hz)
    mesh = load_mesh(path, scale=1.0)
    assert any("stored in single precision" in note for note in mesh.notes) == said
    wrong = mesh.read(0, FRAMES).astype(np.float64) - exact
    error_mps = np.abs(wrong[2:] - wrong[:-2]).max() * 0.5 * rate_hz
    # Noted from 1 % of a bin of 0.125 m/s; what is said is an upper bound, reached
    # within a factor of a few by the worst of these 48 places.
    assert error_mps <= 1.25e-3 or said
    if said:
        assert error_mps >= 1.25e-3 / 8


@WRONG
def test_one_file_per_frame(tmp_path: Path, value: float) -> None:
    for frame, corners in enumerate(tetrahedron(value)):
        lines = [f"v {x} {y} {z}" for x, y, z in corners.tolist()]
        lines += [f"f {a} {b} {c}" for a, b, c in (FACES + 1).tolist()]
        (tmp_path / f"frame{frame}.obj").write_text("\n".join(lines))
    with pytest.raises(Sd2Error, match=naming(tmp_path.name, value)):
        load_mesh(tmp_path)


@pytest.mark.one_in(5)
@pytest.mark.parametrize("suffix", [".npz", ".zarr"])
@pytest.mark.parametrize(
    ("dtype", "kept"),
    [
        ("f2", "f4"), ("f4", "f4"), ("f8", "f8"), (">f8", "f8"), ("i2", "f4"), ("i4", "f8"),
        ("i8", "f8"), ("u1", "f4"),
    ],
)  # fmt: skip
def test_no_type_of_number_is_rounded(tmp_path: Path, dtype: str, kept: str, suffix: str) -> None:
    # 2^24 + 1 is the first whole number that single precision does not hold.
    largest = {"f2": 2048, "f4": 2**24, "i2": 32767, "u1": 255}.get(dtype, 2**24 + 1)
    vertices = np.tile(np.arange(12).reshape(4, 3), (3, 1, 1)).astype(dtype)
    vertices[1, 2, 0] = largest
    path = tmp_path / f"whole{suffix}"
    if suffix == ".npz":
        np.savez(path, vertices=vertices, faces=FACES, fps=30.0)
    else:
        import zarr

        group = zarr.open_group(str(path), mode="w")
        group.create_array("vertices", data=vertices, chunks=(2, 4, 3))
        group.create_array("times_s", data=np.arange(3) / 30.0)
    mesh = load_mesh(path, scale=1.0)
    assert np.dtype(mesh.vertices.dtype).newbyteorder("=") == np.dtype(kept)
    assert mesh.read(0, 3)[1, 2, 0] == largest
