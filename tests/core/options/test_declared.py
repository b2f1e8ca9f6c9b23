"""Numbers that files declare are refused in words where nobody can have written them."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
import zarr
from lazy_sources import write_dataset

from sd2core.datasets.card import describe_dataset
from sd2core.datasets.clips import clips_of_dataset
from sd2core.datasets.reading import open_dataset
from sd2core.errors import Sd2Error
from sd2core.files.stores import array_in, open_group
from sd2core.maps import DopplerMap
from sd2core.options.bounds import Bounds
from sd2core.options.declared import DeclaredColumn, column_bounds
from sd2core.options.exporting import Exporting
from sd2core.sensor import MAX_BINS, VelocityAxis
from sd2core.timebase import Timebase
from tests.core.datasets.made_sources import source


@cache
def written() -> dict[str, bytes]:
    with TemporaryDirectory() as folder:
        sources = [source("r1", "anna"), source("r1", "ben")]
        write_dataset(Path(folder) / "set.npz", sources, Exporting(segment_frames=20))
        return {file.name: file.read_bytes() for file in Path(folder).iterdir()}


def dataset(folder: Path) -> Path:
    for name, content in written().items():
        (folder / name).write_bytes(content)
    return folder / "set.npz"


def changed(path: Path, **arrays: Any) -> None:
    with np.load(path) as archive:
        content = dict(archive)
    for name, change in arrays.items():
        content[name] = change(content[name])
    np.savez_compressed(path, **content)


def put(value: Any) -> Any:
    def change(values: np.ndarray) -> np.ndarray:
        values = np.array(values)
        values.reshape(-1)[0] = value
        return values

    return change


@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("column", "value"),
    [("subject", 700_000_000), ("subject", -1), ("segment_label", 30_000), ("label", -1),
     ("split", 3), ("source", 2), ("placement", -5), ("purity", np.nan), ("start_s", np.inf)],
)  # fmt: skip
def test_columns_of_a_data_set_are_judged_by_whoever_reads_them(
    tmp_path: Path, column: str, value: float
) -> None:
    path = dataset(tmp_path)
    changed(path, **{column: put(value)})

    def read_all() -> None:
        with open_dataset(path) as opened:
            describe_dataset(opened)
            clips_of_dataset(opened, "synthetic")

    with pytest.raises(Sd2Error, match=rf"set\.npz: {column} holds"):
        read_all()


def test_what_was_written_is_within_the_bounds(tmp_path: Path) -> None:
    with open_dataset(dataset(tmp_path)) as opened:
        for name in column_bounds(1, 1, 1, 1):
            if name in opened.arrays:
                assert len(opened[name][:]) == len(opened)
        assert describe_dataset(opened)["sources"] == 2


@pytest.mark.parametrize(
    "change",
    [{"length": 0}, {"frame_rate_hz": -1}, {"bins": 50_000_000}, {"subjects": ["anna", "anna"]},
     {"labels": []}, {"null_bins": [8]}, {"splits": {"train": ["nobody"]}}, {"min_share": 7}],
)  # fmt: skip
def test_headers_of_data_sets(tmp_path: Path, change: dict[str, Any]) -> None:
    path = dataset(tmp_path)
    changed(path, meta=lambda text: np.array(json.dumps(json.loads(str(text)) | change)))
    with pytest.raises(Sd2Error, match=r"set\.npz"):
        open_dataset(path)


@pytest.mark.parametrize(
    "change",
    [{"frames": -1}, {"stop": "all"}, {"frame_rate_hz": 0}, {"provenance": {"maps": {"x": {}}}},
     {"classes": ["a"]}, {"provenance": {"maps": {"synthetic": {"plan": "fast"}}}}],
)  # fmt: skip
def test_sources_of_data_sets(tmp_path: Path, change: dict[str, Any]) -> None:
    path = dataset(tmp_path)

    def told(lines: np.ndarray) -> np.ndarray:
        return np.array([json.dumps(json.loads(str(one)) | change) for one in lines])

    changed(path, sources=told)
    with open_dataset(path) as opened, pytest.raises(Sd2Error, match=r"set\.npz: source 1"):
        list(opened.sources())


@pytest.mark.parametrize(
    "meta",
    [{"notes": "one"}, {"visible_share": []}, {"visible_share": [[0.5]]}, {"beyond_share": [2.0]},
     {"sensor": {"position_m": [0, 1]}}, {"plan": "fast"}, {"body_error_l1": "0.3"},
     {"body_error_l1": -1.0}, {"mask_stride": 0}, {"visible_share": [float("nan")]}],
)  # fmt: skip
def test_metadata_of_maps(tmp_path: Path, meta: dict[str, Any]) -> None:
    path = tmp_path / "map.npz"
    values, clock = np.zeros((4, 3), np.float32), Timebase.regular(3, 10.0)
    plain = DopplerMap(values, VelocityAxis(4), clock, "synthetic", meta={"more": [1]})
    with pytest.raises(Sd2Error, match=rf"map\.npz: {next(iter(meta))}"):
        replace(plain, meta=plain.meta | meta).save(path)
    plain.save(path)
    assert DopplerMap.load(path).meta == plain.meta

    def told(text: np.ndarray) -> np.ndarray:
        return np.array(json.dumps(json.loads(str(text)) | {"provenance": plain.meta | meta}))

    changed(path, meta=told)
    with pytest.raises(Sd2Error, match=rf"map\.npz: its provenance: {next(iter(meta))}"):
        DopplerMap.load(path)


def test_an_axis_has_as_many_bins_as_can_be() -> None:
    assert VelocityAxis(MAX_BINS).bins == MAX_BINS
    with pytest.raises(Sd2Error, match="50000000 bins"):
        VelocityAxis(50_000_000)


def test_a_column_is_judged_where_it_is_read() -> None:
    column = DeclaredColumn(np.array([0, 1, 9]), "it", Bounds(0, 1, whole=True))
    assert column[:2].tolist() == [0, 1]
    assert (len(column), column.shape) == (3, (3,))
    with pytest.raises(Sd2Error, match="it holds 9"):
        column[:]


def test_a_chunk_takes_the_memory_that_its_array_declares(tmp_path: Path) -> None:
    group = zarr.open_group(str(tmp_path / "s.zarr"), mode="w")
    group.create_array("values", shape=(8,), dtype="float64", chunks=(8,))[:] = 1.0
    read = array_in(open_group(tmp_path / "s.zarr"), tmp_path / "s.zarr", "values", "rows")
    assert read[:].sum() == 8.0
    description = tmp_path / "s.zarr" / "values" / "zarr.json"
    told = json.loads(description.read_text())
    told["chunk_grid"]["configuration"]["chunk_shape"] = [2**27]
    description.write_text(json.dumps(told))
    with pytest.raises(Sd2Error, match=r"declares 1\.1 GB"):
        open_group(tmp_path / "s.zarr")
