"""Texts in HDF5 files: read as the library writes them, or refused."""

from __future__ import annotations

from itertools import count
from pathlib import Path

import h5py
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sd2core.errors import Sd2Error
from sd2core.files.hdf5_files import member_of, text_of

_numbers = count()
texts = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), max_size=300)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(written=st.lists(texts, min_size=1, max_size=30), long=st.integers(0, 9000))
def test_texts_come_back_as_they_were_written(
    tmp_path: Path, written: list[str], long: int
) -> None:
    path = tmp_path / f"{next(_numbers)}.h5"
    written = [*written, "é" * long]
    with h5py.File(path, "w") as file:
        for number, text in enumerate(written):
            file[f"group/{number}"] = text
        file["fixed"] = b"of eight"
    with h5py.File(path, "r") as file:
        for number, text in enumerate(written):
            name = f"group/{number}"
            assert text_of(member_of(file, path, name), path, name) == text
        assert text_of(member_of(file, path, "fixed"), path, "fixed") == "of eight"


@pytest.mark.parametrize("damage", ["length", "address", "number", "size", "endless"])
def test_a_damaged_heap_is_refused(tmp_path: Path, damage: str) -> None:
    path = tmp_path / "damaged.h5"
    with h5py.File(path, "w") as file:
        file["text"] = "some words"
        start = file["text"].id.get_offset()
    address = int.from_bytes(path.read_bytes()[start + 4 : start + 12], "little")
    place, length = {
        "length": (start, 4),
        "address": (start + 4, 8),
        "number": (start + 12, 4),
        "size": (address + 8, 8),
        "endless": (address + 24, 8),  # of the first text: the library goes round there for ever
    }[damage]
    content = bytearray(path.read_bytes())
    content[place : place + length] = b"\x7f" * length
    if damage == "endless":
        content[place : place + length] = (2**64 - 16).to_bytes(8, "little")
        content[start + 12 : start + 16] = b"\x02\0\0\0"
    path.write_bytes(content)
    with h5py.File(path, "r") as file, pytest.raises(Sd2Error, match=r"text of .*damaged\.h5"):
        text_of(member_of(file, path, "text"), path, "text")
