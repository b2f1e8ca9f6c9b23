"""Frames without a person: every stretch between them is a clip of its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from doppler_scenes import CAMERA, sensor_at, wobbling

from sd2core.doppler import PRESETS, SynthesisOptions, Synthesizer
from sd2core.doppler.reference import reference_stretch
from sd2core.maps import DopplerMap
from sd2core.mesh.decimation import decimate
from sd2core.mesh.sequence import MeshSequence
from sd2core.timebase import Timebase

FRAMES = 40
HOLE = (17, 24)
THERE = np.ones(FRAMES, bool)
THERE[slice(*HOLE)] = False
THERE[31] = False
STRETCHES = ((0, 17), (24, 31), (32, 40))

WAYS = {
    "paper": PRESETS["paper"],
    "vid2doppler": PRESETS["vid2doppler"],
    "four moments": replace(PRESETS["paper"], oversampling=4),
    "three moments": replace(PRESETS["paper"], oversampling=3),
    "smooth paths": replace(PRESETS["paper"], trajectory_smoothing_s=0.05, oversampling=2),
    "shared masks": replace(PRESETS["paper"], mask_stride=4, visibility="depth"),
    "area": replace(PRESETS["paper"], weight="projected", range_law="frame"),
}


def holed(mesh: MeshSequence) -> MeshSequence:
    """The same with nobody in some frames, which hold the pose before."""
    known = np.maximum.accumulate(np.where(THERE, np.arange(FRAMES), 0))
    return replace(mesh, vertices=np.asarray(mesh.vertices)[known], present=THERE)


def cut(mesh: MeshSequence, start: int, stop: int) -> MeshSequence:
    return MeshSequence(
        mesh.read(start, stop), mesh.faces, Timebase(mesh.times_s[start:stop]), mesh.source
    )


@pytest.fixture(scope="module")
def whole() -> MeshSequence:
    return wobbling(FRAMES, divisions=2)


@pytest.mark.parametrize("way", WAYS)
def test_every_stretch_is_a_clip_of_its_own(whole: MeshSequence, way: str) -> None:
    options = WAYS[way]
    found = Synthesizer(holed(whole), options).map(sensor_at(0.3, 0.1, 0.0))
    assert found.present is not None
    np.testing.assert_array_equal(found.present, THERE)
    assert not found.values[:, ~THERE].any()
    assert found.values[:, THERE].any(axis=0).mean() > 0.8  # the rest is too fast for the axis
    for start, stop in STRETCHES:
        if options.mask_stride > 1 and start % options.mask_stride:
            continue  # which frames share a mask is counted from the clip's start
        alone = Synthesizer(cut(whole, start, stop), options).map(sensor_at(0.3, 0.1, 0.0))
        # Positions are kept around another origin, and a vertex at an edge between
        # bins may fall to its other side.
        difference = np.abs(found.values[:, start:stop] - alone.values).sum()
        assert difference < 0.02 * alone.values.sum()


@pytest.mark.parametrize("way", WAYS)
def test_frames_between_which_others_were_lost_begin_a_clip_of_their_own(
    whole: MeshSequence, way: str
) -> None:
    joined, options = cut(whole, 0, 32), WAYS[way]
    later_s = joined.times_s + 3.0 * (np.arange(32) >= 16)
    vertices = np.array(joined.vertices)
    vertices[16:, :, 2] += 0.4  # somewhere else meanwhile
    found = Synthesizer(
        replace(joined, vertices=vertices, timebase=Timebase(later_s)), options
    ).map(CAMERA)
    assert found.present is None  # somebody is there in every frame
    takes = (cut(whole, 0, 16), replace(cut(whole, 16, 32), vertices=vertices[16:]))
    for start, take in zip((0, 16), takes, strict=True):
        alone = Synthesizer(take, options).map(CAMERA).values
        difference = np.abs(found.values[:, start : start + 16] - alone).sum()
        assert difference < 0.02 * alone.sum()


@pytest.mark.parametrize("way", WAYS)
def test_away_from_the_hole_nothing_changes(whole: MeshSequence, way: str) -> None:
    options = WAYS[way]
    found = Synthesizer(holed(whole), options).map(CAMERA)
    before = Synthesizer(whole, options).map(CAMERA)
    numbers = np.arange(FRAMES)
    away = np.min([np.abs(numbers - gap) for gap in np.flatnonzero(~THERE)], axis=0)
    # Four sigmas of smoothing in time, of the paths and of the map, and the velocity's reach.
    far = away > 13
    assert far.sum() >= 4
    np.testing.assert_array_equal(found.values[:, far], before.values[:, far])
    changed = np.abs(found.values - before.values)[:, THERE].sum(axis=0) > 0
    assert changed.any()  # at the borders


def test_the_reference_in_double_precision_agrees(whole: MeshSequence) -> None:
    mesh = holed(whole)
    for way in ("paper", "vid2doppler", "smooth paths"):
        options = WAYS[way]
        raw = Synthesizer(mesh, options).stretch(CAMERA, 0, FRAMES).raw
        exact = reference_stretch(mesh, CAMERA, options, 0, FRAMES)
        assert not exact[:, ~THERE].any()
        assert np.abs(raw - exact).sum() < 0.01 * exact.sum()


def test_no_velocity_is_invented_where_someone_comes_back_elsewhere(whole: MeshSequence) -> None:
    mesh = holed(whole)
    vertices = np.array(mesh.vertices)
    vertices[HOLE[1] :, :, 0] += 1.5  # across the gap at 6 m/s
    moved = replace(mesh, vertices=vertices)
    options = replace(PRESETS["paper"], beyond="clip", visibility="none", oversampling=2)
    shares = Synthesizer(moved, options).map(CAMERA).meta["beyond_share"]
    still = Synthesizer(mesh, options).map(CAMERA).meta["beyond_share"]
    assert max(shares) < max(still) + 0.1


def test_a_stretch_does_not_see_where_it_was_cut(whole: MeshSequence) -> None:
    made = Synthesizer(holed(whole), "paper")
    every = made.map(CAMERA)
    part = made.map(CAMERA, frames=(20, 33))
    np.testing.assert_array_equal(part.values, every.values[:, 20:33])
    assert part.present is not None
    np.testing.assert_array_equal(part.present, THERE[20:33])
    assert made.map(CAMERA, frames=(2, 9)).present is None


def test_nothing_is_seen_of_nobody(whole: MeshSequence) -> None:
    made = Synthesizer(holed(whole), "paper")
    shares = np.array(made.map(CAMERA).meta["visible_share"])
    assert (shares[THERE] > 0).all()
    assert not shares[~THERE].any()
    assert not made.frame(CAMERA, 20).visible.any()
    assert not made.frame(CAMERA, 20).velocity_mps.any()


def test_a_frame_between_two_gaps_has_no_velocity(whole: MeshSequence) -> None:
    there = THERE.copy()
    there[25] = False  # frame 24 stands alone
    found = Synthesizer(replace(holed(whole), present=there), "paper").map(CAMERA)
    assert found.present is not None
    assert not found.present[24]
    assert not found.values[:, 24].any()


def test_the_map_says_how_much_is_empty(whole: MeshSequence, tmp_path: object) -> None:
    notes = Synthesizer(holed(whole), "paper").map(CAMERA).meta["notes"]
    assert notes == ["Without a person: 8 of 40 frames (0.27 s). Those columns are empty."]
    assert Synthesizer(whole, "paper").map(CAMERA).meta["notes"] == []


@pytest.mark.parametrize("options", [PRESETS["paper"], PRESETS["vid2doppler"]])
def test_nobody_at_all_gives_an_empty_map(whole: MeshSequence, options: SynthesisOptions) -> None:
    nobody = replace(whole, present=np.zeros(FRAMES, bool))
    found = Synthesizer(nobody, options).map(CAMERA)
    assert not found.values.any()
    assert found.present is not None
    assert not found.present.any()


def test_a_decimated_mesh_has_the_same_gaps(whole: MeshSequence) -> None:
    fewer = decimate(holed(whole), 0.5)
    assert fewer.vertex_count < whole.vertex_count
    assert fewer.present is not None
    np.testing.assert_array_equal(fewer.present, THERE)


def test_map_files_carry_the_gaps(whole: MeshSequence, tmp_path: object) -> None:
    from pathlib import Path

    folder = Path(str(tmp_path))
    found = Synthesizer(holed(whole), "paper").map(CAMERA)
    found.save(folder / "map.npz")
    read = DopplerMap.load(folder / "map.npz").shifted(2.0)
    assert read.present is not None
    np.testing.assert_array_equal(read.present, THERE)
    # Files from before have no such array, and maps without gaps write none.
    Synthesizer(whole, "paper").map(CAMERA).save(folder / "old.npz")
    with np.load(folder / "old.npz") as data:
        assert set(data.files) == {"values", "velocity_mps", "times_s", "meta"}
    assert DopplerMap.load(folder / "old.npz").present is None
