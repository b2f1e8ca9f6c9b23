"""Damage of a chunk is found, named, and ends no process."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zarr
from hypothesis import given, settings
from hypothesis import strategies as st
from numcodecs import Blosc, GZip, Shuffle, Zlib, Zstd
from zarr.codecs import BloscCodec, GzipCodec, ZstdCodec

from sd2core.errors import Sd2Error
from sd2core.files.chunk_codecs import DamagedChunkError, check_blosc_frame, check_zstd_frame
from sd2core.files.limits import VARIABLE
from sd2core.files.stores import StoredArray, array_in, create_array, create_group, open_group
from sd2core.io.kinds import is_dataset
from sd2core.io.mesh import load_mesh
from sd2core.pairs.summary import is_pair_store
from tests.damaged_files import change

ROWS, CHUNK = 40, 10
COMPRESSORS: dict[str, Any] = {
    "lz4": BloscCodec(cname="lz4", shuffle="shuffle"),
    "zstd": BloscCodec(cname="zstd", shuffle="bitshuffle"),
    "plain zstd": None,
}


def values() -> np.ndarray:
    """Rows of a smooth curve, which every codec makes smaller: (ROWS, 500)."""
    return np.cumsum(np.random.default_rng(3).normal(size=(ROWS, 500)), axis=1).astype(np.float32)


def store(path: Path, compressor: Any = None) -> Path:
    group = create_group(path)
    create_array(group, "a", data=values(), chunks=(CHUNK, 500), compressor=compressor)
    return path


def old_store(path: Path, compressor: Any = "auto", zarr_format: Any = 3) -> Path:
    """As stores were made without checksums."""
    group = zarr.open_group(str(path), mode="w", zarr_format=zarr_format)
    group.create_array("a", data=values(), chunks=(CHUNK, 500), compressors=compressor)
    return path


def opened(path: Path) -> StoredArray:
    return array_in(open_group(path), path, "a", "frames")


def chunk(path: Path, number: int) -> Path:
    return path / "a" / "c" / str(number) / "0"


FRAME = bytes(Blosc("lz4", shuffle=Blosc.SHUFFLE).encode(values()))


def test_a_whole_frame_passes() -> None:
    check_blosc_frame(FRAME)
    check_blosc_frame(FRAME[:16], len(FRAME))
    check_blosc_frame(bytes(Blosc().encode(b"")))


@given(st.integers(0, len(FRAME) - 1))
def test_a_frame_that_was_cut_is_refused(length: int) -> None:
    with pytest.raises(DamagedChunkError):
        check_blosc_frame(FRAME[:length])


@given(st.integers(4, 15), st.integers(0, 7))
def test_a_frame_whose_lengths_changed_is_refused(place: int, bit: int) -> None:
    frame = bytearray(FRAME)
    frame[place] ^= 1 << bit
    if 8 <= place < 12 and 0 < int.from_bytes(frame[8:12], "little") <= values().nbytes:
        return  # A block may be of any size up to the whole; the decoder checks what follows.
    if 4 <= place < 8 and int.from_bytes(frame[4:8], "little") <= values().nbytes:
        return  # Fewer bytes than the chunk has: found when they are put into its shape.
    with pytest.raises(DamagedChunkError):
        check_blosc_frame(frame, most_bytes=values().nbytes)


READ_ALL = """
import sys
from pathlib import Path
from sd2core.errors import Sd2Error
from sd2core.files.stores import array_in, open_group

folder = Path(sys.argv[1])
frame = sorted(file for file in folder.rglob("*") if file.is_file() and file.suffix != ".json"
               and not file.name.startswith("."))[1]
whole = frame.read_bytes()
refused = 0
for length in range(0, len(whole), max(len(whole) // 60, 1)):
    frame.write_bytes(whole[:length])
    try:
        array_in(open_group(folder), folder, "a", "frames")[...]
    except Sd2Error as error:
        refused += "frames 10 to 19 of a" in str(error)
print(refused, len(range(0, len(whole), max(len(whole) // 60, 1))))
"""


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["lz4", "zstd", "version 2"])
def test_no_cut_ends_the_process(tmp_path: Path, kind: str) -> None:
    version_2 = kind == "version 2"
    compressor = Blosc("lz4") if version_2 else COMPRESSORS[kind]
    path = old_store(tmp_path / "old.zarr", compressor, 2 if version_2 else 3)
    root = Path(__file__).parents[3]
    child = subprocess.run(
        [sys.executable, "-c", READ_ALL, str(path)],
        env={**os.environ, "PYTHONPATH": str(root)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert child.returncode == 0, child.stderr
    refused, tried = map(int, child.stdout.split())
    assert refused == tried > 50


@pytest.mark.parametrize("kind", COMPRESSORS)
def test_every_changed_bit_is_found_and_the_rest_is_read(tmp_path: Path, kind: str) -> None:
    path = store(tmp_path / "new.zarr", COMPRESSORS[kind])
    assert opened(path).checksums
    assert np.array_equal(opened(path)[...], values())
    file = chunk(path, 2)
    whole = file.read_bytes()
    rng = np.random.default_rng(5)
    for _ in range(20):
        changed = bytearray(whole)
        changed[rng.integers(len(whole))] ^= 1 << rng.integers(8)
        file.write_bytes(changed)
        array = opened(path)
        with pytest.raises(Sd2Error, match=r"new\.zarr.*frames 20 to 29 of a \(a/c/2/0"):
            array[15:25]
        assert np.array_equal(array[:20], values()[:20])
        assert np.array_equal(array[30:], values()[30:])
        assert [(one.start, one.stop) for one in array.damage("checksums")] == [(20, 30)]


@pytest.mark.parametrize("kind", COMPRESSORS)
def test_a_missing_chunk_is_not_filled_in(tmp_path: Path, kind: str) -> None:
    path = store(tmp_path / "new.zarr", COMPRESSORS[kind])
    chunk(path, 3).unlink()
    with pytest.raises(Sd2Error, match=r"frames 30 to 39 of a \(a/c/3/0 is missing"):
        opened(path)[35]
    assert np.array_equal(opened(path)[:30], values()[:30])


def test_chunks_of_zeros_are_on_disk(tmp_path: Path) -> None:
    group = create_group(tmp_path / "new.zarr")
    create_array(group, "a", data=np.zeros((ROWS, 3)), chunks=(CHUNK, 3), fill_value=0)
    assert not opened(tmp_path / "new.zarr").damage("values")
    assert all(chunk(tmp_path / "new.zarr", number).is_file() for number in range(ROWS // CHUNK))


def test_old_stores_stay_readable(tmp_path: Path) -> None:
    for number, (compressor, zarr_format) in enumerate(
        (
            ("auto", 3),
            (BloscCodec(cname="lz4"), 3),
            (None, 3),
            (Blosc(), 2),
            ("auto", 2),
            (None, 2),
        )
    ):
        path = old_store(tmp_path / f"{number}.zarr", compressor, zarr_format)
        array = opened(path)
        assert not array.checksums
        assert np.array_equal(array[...], values())
        assert not array.damage("values")


def test_shards_are_verified_as_files(tmp_path: Path) -> None:
    group = zarr.open_group(str(tmp_path / "s.zarr"), mode="w")
    group.create_array("a", data=values(), chunks=(5, 500), shards=(CHUNK, 500))
    assert not opened(tmp_path / "s.zarr").damage("values")
    change(chunk(tmp_path / "s.zarr", 2))
    array = opened(tmp_path / "s.zarr")
    assert np.array_equal(array[:20], values()[:20])
    chunk(tmp_path / "s.zarr", 2).write_bytes(b"cut")
    assert [(one.start, one.stop) for one in array.damage("values")] == [(20, 30)]
    with pytest.raises(Sd2Error, match="frames 20 to 29 of a"):
        array[25]


def test_a_zip_that_changed_is_named(tmp_path: Path) -> None:
    path = store(tmp_path / "new.zarr")
    packed = zipped(path)
    assert np.array_equal(opened(packed)[...], values())
    content = bytearray(packed.read_bytes())
    content[content.index(chunk(path, 1).read_bytes()) + 100] ^= 4
    packed.write_bytes(content)
    assert [(one.start, one.stop) for one in opened(packed).damage("values")] == [(10, 20)]
    with pytest.raises(Sd2Error, match=r"frames 10 to 19 of a"):
        opened(packed)[12]


def test_codecs_that_are_not_known_to_be_safe_are_refused(tmp_path: Path) -> None:
    group = zarr.open_group(str(tmp_path / "f.zarr"), mode="w", zarr_format=2)
    group.create_array("a", data=values(), filters=[Shuffle(4)])
    with pytest.raises(Sd2Error, match="coded by shuffle"):
        opened(tmp_path / "f.zarr")
    text = zarr.open_group(str(tmp_path / "t.zarr"), mode="w", zarr_format=2)
    text.create_array("a", shape=(2,), dtype="S3")
    with pytest.raises(Sd2Error, match="plain numbers"):
        opened(tmp_path / "t.zarr")


@pytest.mark.parametrize("text", ["", "{", "[" * 100_000, '{"zarr_format": 9}', "null", '"x"'])
@pytest.mark.parametrize("name", ["zarr.json", "a/zarr.json"])
def test_a_damaged_description_is_refused(tmp_path: Path, name: str, text: str) -> None:
    path = store(tmp_path / "new.zarr")
    (path / name).write_text(text)
    with pytest.raises(Sd2Error, match=r"new\.zarr.*cannot be read as a Zarr group"):
        opened(path)


def test_nobody_opens_zarr_another_way() -> None:
    root = Path(__file__).parents[3]
    files = [file for room in ("sd2core", "app", "tools") for file in (root / room).rglob("*.py")]
    assert len(files) > 500
    opening = ("zarr.open", "zarr.create", "zarr.group", "zarr.load", ".create_array(")
    ways = {
        str(file.relative_to(root))
        for file in files
        if any(word in file.read_text(encoding="utf-8") for word in opening)
    }
    assert ways == {"sd2core/files/stores.py"}


@pytest.mark.parametrize("packed", [False, True])
def test_a_shape_that_a_store_cannot_hold_is_refused_until_the_limit_is_raised(
    tmp_path: Path, packed: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = old_store(tmp_path / "a.zarr")
    change_text(path / "a" / "zarr.json", "40,\n    500", "40,\n    500000")
    change_text(path / "a" / "zarr.json", "10,\n        500", "10,\n        500000")
    if packed:
        path = zipped(path)
    monkeypatch.setenv(VARIABLE, "0.001")
    with pytest.raises(Sd2Error, match=rf"{path.name} declares 80\.0 MB.*{VARIABLE} to 0\.2"):
        open_group(path)
    monkeypatch.setenv(VARIABLE, "0.2")
    assert opened(path).shape == (40, 500_000)


@pytest.mark.parametrize("packed", [False, True])
def test_a_description_without_end_is_refused(
    tmp_path: Path, packed: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = store(tmp_path / "a.zarr")
    (path / "a" / "zarr.json").write_text("[" * 200_000)
    if packed:
        path = zipped(path, zipfile.ZIP_DEFLATED)
    monkeypatch.setenv(VARIABLE, "0.001")
    with pytest.raises(Sd2Error, match=rf"{path.name}/a/zarr\.json declares 1\.6 MB"):
        open_group(path)


def test_chunks_without_end_are_refused(tmp_path: Path) -> None:
    path = old_store(tmp_path / "a.zarr")
    change_text(path / "a" / "zarr.json", "40,\n    500", "40000000,\n    1")
    change_text(path / "a" / "zarr.json", "10,\n        500", "1,\n        1")
    with pytest.raises(Sd2Error, match=r"a\.zarr declares 40,000,000 chunks"):
        open_group(path)


def test_a_pipe_in_a_store_is_not_opened(tmp_path: Path) -> None:
    for place in ("zarr.json", "a/zarr.json", "a/c/1/0"):
        path = store(tmp_path / f"{place.count('/')}.zarr")
        (path / place).unlink()
        os.mkfifo(path / place)
        for reading in (open_group, is_pair_store, is_dataset, load_mesh):
            if place == "zarr.json" or reading in (open_group, load_mesh):
                with pytest.raises(Sd2Error, match=rf"{place} is a named pipe"):
                    reading(path)


BOMBS: dict[str, tuple[Any, Any, Any]] = {
    # By codec: as Zarr's version 3 and version 2 have it.
    "blosc": (BloscCodec(cname="zstd"), Blosc("zstd"), Blosc("zstd")),
    "zstd": (ZstdCodec(), Zstd(), Zstd()),
    "gzip": (GzipCodec(), GZip(), GZip()),
    "zlib": (None, Zlib(), Zlib()),
}


@pytest.mark.one_in(3)
@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("codec", BOMBS)
def test_a_chunk_that_inflates_is_refused(
    tmp_path: Path, codec: str, version: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    if BOMBS[codec][3 - version] is None:
        return
    monkeypatch.setenv(VARIABLE, "0.001")
    path = old_store(tmp_path / "a.zarr", BOMBS[codec][3 - version], version)
    np.testing.assert_array_equal(opened(path)[...], values())
    place = chunk(path, 1) if version == 3 else path / "a" / "1.0"
    place.write_bytes(bytes(BOMBS[codec][2].encode(bytes(6 * 10**6))))
    with pytest.raises(Sd2Error, match=r"frames 10 to 19 of a .*(decodes to|header says)"):
        opened(path)[...]


@given(st.binary(max_size=300_000) | st.integers(0, 300_000).map(bytes), st.booleans())
@settings(max_examples=20, deadline=None)
def test_zstd_decodes_to_what_its_frame_says(content: bytes, told: bool) -> None:
    frame = bytes(Zstd().encode(content))
    if not told:
        frame = size_taken_out(frame)
        assert bytes(Zstd().decode(frame)) == content
    check_zstd_frame(frame, len(content))
    if len(content) > 2**18:
        with pytest.raises(DamagedChunkError, match="decodes to"):
            check_zstd_frame(frame, len(content) - 2**18)


def size_taken_out(frame: bytes) -> bytes:
    """Frame of zstd with a window of 8 MB in place of the size of its content."""
    flags = frame[4]
    width = (1, 2, 4, 8)[flags >> 6]
    start = 5 if flags & 32 else 6
    return frame[:4] + bytes([flags & 0b00000100, 13 << 3]) + frame[start + width :]


def zipped(path: Path, how: int = zipfile.ZIP_STORED) -> Path:
    packed = path.with_name(f"{path.name}.zip")
    with zipfile.ZipFile(packed, "w", how) as archive:
        for file in path.rglob("*"):
            archive.write(file, file.relative_to(path))
    return packed


def change_text(path: Path, before: str, after: str) -> None:
    text = path.read_text()
    assert before in text
    path.write_text(text.replace(before, after, 1))


@pytest.mark.one_in(2)
@pytest.mark.parametrize("how", ["reading", "writing"])
def test_the_end_of_a_process_waits_for_zarr_on_a_busy_machine(tmp_path: Path, how: str) -> None:
    path = store(tmp_path / "a.zarr")
    opening = "open_group" if how == "reading" else "create_group"
    script = f"""
import time
from pathlib import Path
from sd2core.files.stores import {opening}
{opening}(Path({str(path)!r}))
from zarr.core.sync import _get_loop
_get_loop().call_soon_threadsafe(time.sleep, 0.5)  # as if the system did not let it run
"""
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert done.stderr == ""
