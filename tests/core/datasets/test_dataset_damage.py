"""A store comes into being whole or is begun anew, and damage to it is named."""

from __future__ import annotations

import errno
import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
from lazy_sources import write_dataset
from made_sources import source
from test_dataset_writing import OPTIONS, contents, several, tree

from sd2core.datasets import store
from sd2core.datasets.index import header_of
from sd2core.datasets.layout import row_shapes
from sd2core.datasets.reading import open_dataset
from sd2core.errors import Sd2Error
from tests.damaged_files import change, cut, lose, states_of


@pytest.mark.slow
@pytest.mark.parametrize("ending", [".zarr", ".h5"])
def test_a_writer_that_ends_while_it_creates_its_store_can_be_repeated(
    tmp_path: Path, ending: str
) -> None:
    sources = [source("r1", "anna"), source("r1", "dora", frames=30)]
    folder = tmp_path / "work"
    folder.mkdir()
    with states_of(folder, tmp_path) as left:
        write_dataset(folder / f"set{ending}", sources, OPTIONS)
    born = [
        state
        for state in left
        if not any(state.glob("*/sources.jsonl")) and not (state / "set.h5").is_file()
    ]
    assert len(born) > len(row_shapes(header_of(sources[0], OPTIONS)))
    for state in born if ending == ".zarr" else born[::4]:
        out = state / f"set{ending}"
        assert write_dataset(out, sources, OPTIONS).added == 2
        found = contents(out)
        for name, values in contents(folder / out.name).items():
            assert np.array_equal(values, found[name]), (state.name, name)
        assert [path.name for path in state.iterdir() if path.suffix == ".partial"] == []


def test_what_an_earlier_version_left_half_made_is_begun_anew(tmp_path: Path) -> None:
    sources = [source("r1", "anna")]
    out = tmp_path / "set.zarr"
    store.SegmentStore.begin(out, header_of(sources[0], OPTIONS))
    (out / ".sd2-lock").touch()
    shutil.rmtree(out / "subject")
    shutil.rmtree(out / "available")
    assert write_dataset(out, sources, OPTIONS).added == 1
    write_dataset(tmp_path / "whole.zarr", sources, OPTIONS)
    assert tree(out) == tree(tmp_path / "whole.zarr")


def test_a_full_disk_at_the_start_leaves_nothing_in_the_way(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls = 0
    replace_file = Path.replace

    def full(self: Path, target: Path) -> Path:
        nonlocal calls
        calls += 1
        if calls > 7:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(target))
        return replace_file(self, target)

    out = tmp_path / "set.zarr"
    with monkeypatch.context() as patched:
        patched.setattr(Path, "replace", full)
        with pytest.raises(OSError, match="No space left"):
            write_dataset(out, [source("r1", "anna")], OPTIONS)
    assert calls > 7
    assert write_dataset(out, [source("r1", "anna")], OPTIONS).added == 1


def test_a_folder_with_other_files_is_not_begun_anew(tmp_path: Path) -> None:
    out = tmp_path / "set.zarr"
    out.mkdir()
    (out / ".sd2-lock").touch()
    (out / "thesis.tex").write_text("years of work")
    with pytest.raises(Sd2Error, match="holds no data set"):
        write_dataset(out, several(), OPTIONS)
    assert (out / "thesis.tex").read_text() == "years of work"


def test_a_data_set_without_its_list_of_sources_is_not_written_over(tmp_path: Path) -> None:
    out = tmp_path / "set.zarr"
    write_dataset(out, several(), OPTIONS)
    lose(out / store.SOURCES_NAME)
    before = tree(out)
    with pytest.raises(Sd2Error, match=r"set\.zarr lacks its list of sources"):
        write_dataset(out, several(), OPTIONS)
    assert tree(out) == before


@pytest.mark.one_in(3)
@pytest.mark.parametrize("damage", [cut, change, lose])
def test_segments_of_a_damaged_chunk_are_named_and_the_others_are_read(
    tmp_path: Path, damage: Callable[[Path], None]
) -> None:
    out = tmp_path / "set.zarr"
    write_dataset(out, [source("r1", "anna", frames=1000)], OPTIONS)  # 50 segments in two chunks
    truth = contents(out)["synthetic"]
    damage(out / "synthetic" / "c" / "1" / "0" / "0")
    with open_dataset(out) as dataset:
        assert np.array_equal(dataset["synthetic"][:32], truth[:32])
        with pytest.raises(Sd2Error, match=r"set\.zarr.*segments 32 to 49 of synthetic"):
            dataset["synthetic"][40]


def test_a_kind_that_comes_late_leaves_no_chunk_out(tmp_path: Path) -> None:
    out = tmp_path / "set.zarr"
    write_dataset(out, [source("r1", "anna", frames=1000)], OPTIONS)
    write_dataset(
        out,
        [source("r1", "anna", frames=1000), source("r2", "ben", kinds=("synthetic", "simulated"))],
        OPTIONS,
    )
    with open_dataset(out) as dataset:
        assert not any(array.damage("values") for array in dataset.arrays.values())
        assert not dataset["simulated"][:50].any()
        assert dataset["simulated"][50:].any()


def test_hdf5_has_checksums_and_names_what_is_damaged(tmp_path: Path) -> None:
    out = tmp_path / "set.h5"
    write_dataset(out, [source("r1", "anna", frames=1000)], OPTIONS)
    truth = contents(out)["synthetic"]
    with h5py.File(out, "r") as file:
        at = file["synthetic"].id.get_chunk_info(1).byte_offset
    content = bytearray(out.read_bytes())
    content[at + 200] ^= 16
    out.write_bytes(content)
    with open_dataset(out) as dataset:
        assert np.array_equal(dataset["synthetic"][:32], truth[:32])
        with pytest.raises(Sd2Error, match=r"set\.h5 cannot be read: segments 32 to 49 of synth"):
            dataset["synthetic"][40]


def test_what_a_data_set_in_hdf5_has_elsewhere_is_refused(tmp_path: Path) -> None:
    out = tmp_path / "set.h5"
    write_dataset(out, several(), OPTIONS)
    for name in ("meta", "sources", "synthetic", "start_s"):
        linked = tmp_path / f"{name}.h5"
        shutil.copy(out, linked)
        with h5py.File(linked, "a") as file:
            del file[name]
            file[name] = h5py.ExternalLink(str(out), name)
        with (
            pytest.raises(Sd2Error, match=rf"{name} of .*{name}\.h5 is a link to elsewhere"),
            open_dataset(linked) as found,
        ):
            list(found.sources())


def test_sources_that_together_are_larger_than_the_limit_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "set.h5"
    write_dataset(out, several(), OPTIONS)
    with open_dataset(out) as found:
        first = len(json.dumps(next(found.sources())))
        monkeypatch.setenv("SD2_READ_LIMIT_GB", str((first + 10) / 1e9))
        monkeypatch.setattr("sd2core.files.limits.MULTIPLE", 0)
        lines = found.sources()
        next(lines)
        with pytest.raises(Sd2Error, match=r"sources of .*set\.h5 declares"):
            next(lines)
