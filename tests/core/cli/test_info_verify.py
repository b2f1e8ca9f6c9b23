"""Damage as a user meets it: a broken copy of the sample, and ``sd2 info --verify``."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import zarr
from cli_outcome import Sd2
from zarr.codecs import BloscCodec

from sd2core.files.resources import resource_path
from sd2core.io.mesh import load_mesh
from tests.damaged_files import change, cut, lose
from tests.small_pairs import write_pairs

CHUNK = Path("vertices/c/1/0/0")
"""Of the sample's mesh: frames 150 to 299."""


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """A copy of the sample."""
    return Path(shutil.copytree(resource_path("swipes.sd2"), tmp_path / "swipes.sd2"))


@pytest.fixture
def old_mesh(tmp_path: Path) -> Path:
    """The sample's mesh as it was written before there were checksums."""
    mesh = load_mesh(resource_path("swipes.sd2") / "mesh.zarr")
    path = tmp_path / "old.zarr"
    group = zarr.open_group(str(path), mode="w")
    codec = BloscCodec(cname="zstd", shuffle="shuffle")
    group.create_array("vertices", data=mesh.read(0, 450), chunks=(150, 5000, 3), compressors=codec)
    group.create_array("faces", data=mesh.faces)
    group.create_array("times_s", data=mesh.times_s)
    return path


@pytest.mark.parametrize(
    "damage",
    [change, *(pytest.param(one, marks=pytest.mark.slow) for one in (cut, lose))],
)
def test_a_broken_copy_of_the_sample_is_told_and_the_rest_of_it_used(
    sd2: Sd2, recording: Path, damage: Callable[[Path], None]
) -> None:
    assert "every chunk has its checksum" in sd2("info", recording, "--verify").out
    damage(recording / "fit.zarr" / CHUNK)
    refused = sd2("info", recording, "--verify")
    assert refused.code == 1
    assert f"fit.zarr is damaged: frames 150 to 299 of vertices ({CHUNK}" in refused.err
    told = sd2("info", recording)
    assert told.code == 0
    assert "note: fit.zarr is damaged: frames 150 to 299 of vertices" in told.out
    assert "in 150 of 450 frames (5.00 s), first at 5.00 s" in told.out
    out = recording.parent / "map.npz"
    assert sd2("synth", recording / "fit.zarr", "--out", out, "--visibility", "none").code == 0
    found = np.load(out)["values"]
    assert not found[:, 150:300].any()
    whole = recording.parent / "whole.npz"
    mesh = resource_path("swipes.sd2") / "fit.zarr"
    sd2("synth", mesh, "--out", whole, "--visibility", "none")
    # Smoothing reaches across the border, from frames that are there only.
    for frames in (slice(0, 120), slice(330, 450)):
        assert np.array_equal(found[:, frames], np.load(whole)["values"][:, frames])


@pytest.mark.slow
def test_no_length_of_a_chunk_of_an_old_mesh_ends_the_command(sd2: Sd2, old_mesh: Path) -> None:
    chunk = old_mesh / CHUNK
    content = chunk.read_bytes()
    for length in np.linspace(0, len(content) - 1, 30).astype(int):
        chunk.write_bytes(content[:length])
        told = sd2("info", old_mesh)
        assert told.code == 0
        assert "frames 150 to 299 of vertices" in told.out


@pytest.mark.slow
def test_an_old_mesh_is_verified_as_far_as_it_can_be(sd2: Sd2, old_mesh: Path) -> None:
    told = sd2("info", old_mesh, "--verify")
    assert told.code == 0
    assert "faces, times_s came without checksums" in told.out
    assert json.loads(sd2("info", old_mesh, "--verify", "--json").out)["verified"] == {
        "arrays": ["vertices", "faces", "times_s"],
        "without_checksums": ["vertices", "faces", "times_s"],
    }
    cut(old_mesh / CHUNK)
    refused = sd2("info", old_mesh, "--verify")
    assert refused.code == 1
    assert "frames 150 to 299 of vertices" in refused.err


@pytest.mark.parametrize("damage", [cut, change, lose])
def test_damaged_pairs_say_which_frames(
    sd2: Sd2, tmp_path: Path, damage: Callable[[Path], None]
) -> None:
    path = write_pairs(tmp_path / "p.zarr", ("s1", "s2"))
    assert "every chunk has its checksum" in sd2("info", path, "--verify").out
    for name in ("radar", "label"):
        damage(next(file for file in (path / name / "c").rglob("*") if file.is_file()))
    refused = sd2("info", path, "--verify")
    assert refused.code == 1
    assert "frames 0 to" in refused.err
    assert "of radar (radar/c/0/0" in refused.err
    assert "of label (label/c/0" in refused.err
    assert "cannot be read: frames 0 to 599 of radar" in sd2("info", path).err


@pytest.mark.usefixtures("without_sheet")
@pytest.mark.parametrize("ending", [".zarr", pytest.param(".h5", marks=pytest.mark.slow)])
def test_a_damaged_data_set_says_which_segments(sd2: Sd2, tmp_path: Path, ending: str) -> None:
    pairs = write_pairs(tmp_path / "p.zarr", ("s1", "s2"))
    out = tmp_path / f"set{ending}"
    assert sd2("export", pairs, "--out", out, "--kinds", "synthetic").code == 0
    assert "every chunk has its checksum" in sd2("info", out, "--verify").out
    if ending == ".zarr":
        change(out / "synthetic" / "c" / "0" / "0" / "0")
    else:
        import h5py

        with h5py.File(out, "r") as file:
            at = file["synthetic"].id.get_chunk_info(0).byte_offset
        content = bytearray(out.read_bytes())
        content[at + 50] ^= 1
        out.write_bytes(content)
    refused = sd2("info", out, "--verify")
    assert refused.code == 1
    assert f"set{ending} is damaged: segments 0 to" in refused.err
    assert "of synthetic" in refused.err


def test_files_without_chunks_have_nothing_to_verify(sd2: Sd2, plate: Path) -> None:
    assert "not stored in chunks" in sd2("info", plate, "--verify").out
