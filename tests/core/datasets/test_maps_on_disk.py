"""What was computed of a recording before is read again, by whichever command, to the bit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lazy_sources import write_dataset
from swinging_recordings import FRAMES, recording

from sd2core.batch.folder import BatchFolder
from sd2core.batch.inputs import MeshInput, Origin, inspect
from sd2core.batch.synthesis import synthesise
from sd2core.cli.recording_maps import MapName, maps_of
from sd2core.datasets import kept_maps
from sd2core.datasets.reading import open_dataset
from sd2core.datasets.recording_sources import Making, recording_sources
from sd2core.doppler import Synthesizer
from sd2core.maps import DopplerMap
from sd2core.mesh.walls import Wall
from sd2core.options.exporting import Exporting
from sd2core.options.synthesis import Synthesis
from sd2core.progress import silent
from sd2core.recording.recording import MeshReading, Recording, open_recording
from sd2core.sensor import VirtualSensor


@pytest.fixture
def swinging(tmp_path: Path, compiled_kernels: None) -> Recording:
    return recording(tmp_path / "anna.sd2", radar=False)


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Grows with every map that is counted."""
    calls: list[int] = []

    def noted(name: str) -> None:
        made: Callable[..., DopplerMap] = getattr(Synthesizer, name)

        def note(*given: Any, **more: Any) -> DopplerMap:
            calls.append(1)
            return made(*given, **more)

        monkeypatch.setattr(Synthesizer, name, note)

    noted("map")
    noted("limb_maps")
    return calls


def synthetic(folder: Path, **making: Any) -> DopplerMap:
    """The map that a data set would be cut from."""
    (source,) = recording_sources([folder], ["anna"], Making(kinds=("synthetic",), **making))
    return source.load(silent).maps["synthetic"]


def test_a_second_export_counts_nothing_and_holds_the_same(
    swinging: Recording, counted: list[int], tmp_path: Path
) -> None:
    written = []
    for name, length in (("first.zarr", 40), ("again.zarr", 40), ("longer.zarr", FRAMES)):
        sources = recording_sources([swinging.folder], ["anna"], Making(kinds=("synthetic",)))
        options = Exporting(kinds=("synthetic",), segment_frames=length, overlap_frames=0)
        write_dataset(tmp_path / name, sources, options)
        with open_dataset(tmp_path / name) as dataset:
            written.append(np.concatenate(dataset["synthetic"][:]))
    assert counted == [1]
    plain = Synthesizer(swinging.load_mesh()).map(swinging.sensor).values.T
    for values in written:
        np.testing.assert_array_equal(values, plain)


def test_what_one_command_counted_others_read_with_all_that_is_said_of_it(
    swinging: Recording, counted: list[int]
) -> None:
    made = synthetic(swinging.folder)
    read = maps_of(open_recording(swinging.folder), ("synthetic",))["synthetic"]
    assert counted == [1]
    np.testing.assert_array_equal(read.values, made.values)
    assert read.meta["visible_share"] == made.meta["visible_share"]
    assert (read.unit, read.null_bins, read.axis) == (made.unit, made.null_bins, made.axis)


def test_what_a_denoiser_made_is_read_too(
    swinging: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    names: tuple[MapName, ...] = ("denoised",)
    made = maps_of(open_recording(swinging.folder), names)["denoised"]
    monkeypatch.setattr(kept_maps, "denoised", None)  # nothing can be denoised any more
    read = maps_of(open_recording(swinging.folder), names)["denoised"]
    np.testing.assert_array_equal(read.values, made.values)
    assert read.meta["denoiser"]["name"] == made.meta["denoiser"]["name"]
    replace(swinging, sensor=VirtualSensor((0.1, 0.0, 0.0))).save()
    with pytest.raises(TypeError):
        maps_of(open_recording(swinging.folder), names)


@pytest.mark.parametrize(
    "changes",
    [
        {"sensor": VirtualSensor((0.1, 0.0, 0.0))},
        {"walls": (Wall(1.0, 90.0),)},
        {"mesh_reading": MeshReading(scale=1.1)},
    ],
)
def test_whatever_a_map_depends_on_is_counted_anew(
    swinging: Recording, counted: list[int], changes: dict[str, Any]
) -> None:
    before = synthetic(swinging.folder)
    changed = replace(swinging, **changes)
    changed.save()
    made = synthetic(swinging.folder)
    assert counted == [1, 1]
    plain = Synthesizer(changed.load_mesh()).map(changed.sensor)
    np.testing.assert_array_equal(made.values, plain.values)
    assert not np.array_equal(made.values, before.values)


def test_one_frame_of_the_mesh_is_enough(swinging: Recording, counted: list[int]) -> None:
    before, place = synthetic(swinging.folder), swinging.folder / "mesh.npz"
    with np.load(place) as arrays:
        content = dict(arrays)
    content["vertices"][40, :, 2] += 0.02
    np.savez(place, **content)
    assert not np.array_equal(synthetic(swinging.folder).values, before.values)
    assert counted == [1, 1]


def test_a_file_that_is_damaged_or_of_an_older_key_is_passed_over(
    swinging: Recording, counted: list[int]
) -> None:
    made = synthetic(swinging.folder)
    folder = kept_maps.user_cache("maps")
    (file,) = folder.iterdir()
    file.rename(folder / f"{32 * '0'}.npz")
    np.testing.assert_array_equal(synthetic(swinging.folder).values, made.values)
    assert len(counted) == 2
    file.write_bytes(file.read_bytes()[:200])
    np.testing.assert_array_equal(synthetic(swinging.folder).values, made.values)
    assert len(counted) == 3
    assert {one.name for one in folder.iterdir()} == {file.name, f"{32 * '0'}.npz"}


def test_those_used_last_stay_within_the_limit(
    swinging: Recording, counted: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    made = [kept_maps.kept_map(f"{n}", lambda: synthetic(swinging.folder)) for n in range(3)]
    size_bytes = max(one.stat().st_size for one in kept_maps.user_cache("maps").iterdir())
    monkeypatch.setattr(kept_maps, "LIMIT_BYTES", 3 * size_bytes)
    assert kept_maps.found_map("0") is not None
    kept_maps.kept_map("3", lambda: made[0])
    there = [kept_maps.found_map(f"{n}") is not None for n in range(4)]
    assert there == [True, False, True, True]


def test_a_folder_that_cannot_be_written_to_is_no_error(
    swinging: Recording, counted: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setattr(kept_maps, "user_cache", lambda name: tmp_path / "file" / name)
    for _ in range(2):
        synthetic(swinging.folder)
    assert len(counted) == 2


def test_a_batch_takes_a_map_that_an_export_has_counted(
    swinging: Recording, counted: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = synthetic(swinging.folder)
    mesh = known_mesh(swinging)
    out = tmp_path / "map.npz"
    synthesise(mesh, swinging.sensor, Synthesis(), None, [out])
    assert counted == [1]
    np.testing.assert_array_equal(DopplerMap.load(out).values, made.values)
    synthesise(mesh, swinging.sensor, Synthesis(left_out=("walls",)), None, [out])
    assert counted == [1, 1]
    assert len([*kept_maps.user_cache("maps").iterdir()]) == 1  # it has a folder of its own


def known_mesh(one: Recording) -> MeshInput:
    """Mesh of a recording as a batch knows it."""
    folder = BatchFolder(one.folder.with_name("batch"))
    found = inspect(folder, Origin(str(one.folder), "anna.sd2", "anna"))
    assert found.mesh is not None
    return found.mesh
