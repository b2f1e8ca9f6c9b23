"""Long clips in stretches give the maps of the whole clip."""

from __future__ import annotations

from dataclasses import asdict, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from moving_spheres import swinging_sphere

from sd2core.batch.denoising import denoise
from sd2core.batch.exporting import parts_of
from sd2core.batch.inputs import mesh_input_of
from sd2core.batch.synthesis import LONGEST_FRAMES, stretches_of, synthesise
from sd2core.denoise.files import describe_model, find_model, load_model
from sd2core.doppler import Synthesizer
from sd2core.doppler.options import chosen_options
from sd2core.io.mesh import load_mesh, save_mesh
from sd2core.maps import DopplerMap, joined
from sd2core.mesh.sequence import MeshSequence
from sd2core.options.exporting import Exporting
from sd2core.options.synthesis import Synthesis
from sd2core.sensor import VelocityAxis, VirtualSensor
from sd2core.timebase import Timebase


@given(st.integers(1, 10**7), st.integers(1, 10**5))
def test_stretches_cover_a_clip_once(frames: int, longest: int) -> None:
    stretches = stretches_of(frames, max(longest, -(-frames // 1000)))
    assert stretches[0][0] == 0
    assert stretches[-1][1] == frames
    for (_, stop), (start, _) in pairwise(stretches):
        assert stop == start
    lengths = [stop - start for start, stop in stretches]
    assert max(lengths) - min(lengths) <= 1
    assert max(lengths) <= max(longest, -(-frames // 1000))


def test_ten_minutes_are_one_stretch() -> None:
    assert stretches_of(LONGEST_FRAMES) == [(0, LONGEST_FRAMES)]
    assert len(stretches_of(LONGEST_FRAMES + 1)) == 2


@given(st.integers(0, 3), st.integers(-400, 400), st.integers(2, 400), st.floats(0.0, 0.99))
def test_parts_to_export_give_the_segments_of_the_whole(
    number: int, more: int, segment: int, overlapping: float
) -> None:
    export = Exporting(segment_frames=segment, overlap_frames=int(overlapping * segment))
    step = segment - export.overlap_frames
    frames = max(number * (LONGEST_FRAMES // step) * step + more, 1)
    parts = parts_of(frames, export)
    starts = [one for start, stop in parts for one in range(start, stop - segment + 1, step)]
    assert starts == list(range(0, frames - segment + 1, step))
    assert all(0 <= start < stop <= frames for start, stop in parts)


def _mesh(frames: int = 300) -> MeshSequence:
    """With uneven times, and nobody for a while."""
    mesh = swinging_sphere(frames)
    times_s = mesh.times_s + 0.004 * np.sin(np.arange(frames))
    present = np.ones(frames, bool)
    present[95:130] = False
    return replace(mesh, timebase=Timebase(times_s), present=present)


@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    "told",
    [
        Synthesis(),
        Synthesis(trajectory_smoothing_s=0.1, time_sigma_s=0.2),
        Synthesis(oversampling=2, visibility="facing"),
        Synthesis(mask_stride=7),
        Synthesis(visibility="depth", depth_resolution=128, mask_stride=4),
        Synthesis(vertices_kept=0.5, range_law="frame"),
        Synthesis(preset="vid2doppler"),
    ],
    ids=["paper", "smooth", "oversampled", "shared masks", "depth", "decimated", "vid2doppler"],
)
def test_maps_of_stretches_are_columns_of_the_whole_map(told: Synthesis, tmp_path: Path) -> None:
    path = tmp_path / "mesh.zarr"
    save_mesh(_mesh(), path)
    mesh = mesh_input_of(path, "name")
    sensor = VirtualSensor(position_m=(0.4, 0.0, 0.0))
    whole = tmp_path / "whole.npz"
    synthesise(mesh, sensor, told, (0, 300), None, [whole])
    parts = []
    for number, stretch in enumerate(stretches_of(300, 110)):
        out = tmp_path / f"{number}.npz"
        synthesise(mesh, sensor, told, stretch, None, [out])
        parts.append(DopplerMap.load(out))
    expected, found = DopplerMap.load(whole), joined(parts)
    np.testing.assert_array_equal(found.times_s, expected.times_s)
    assert found.present is not None
    np.testing.assert_array_equal(found.present, expected.present)
    # Sums along velocity are taken for more or fewer columns at once, which may round a last
    # digit of double precision otherwise; in single precision that is hardly ever seen.
    np.testing.assert_allclose(found.values, expected.values, rtol=3e-7, atol=0)


def test_a_map_names_sensor_and_options(tmp_path: Path) -> None:
    save_mesh(swinging_sphere(20), tmp_path / "mesh.npz")
    sensor, told = VirtualSensor(position_m=(0.4, 0.0, 0.0)), Synthesis(bins=64)
    mesh = mesh_input_of(tmp_path / "mesh.npz", "name")
    synthesise(mesh, sensor, told, (0, 20), None, [tmp_path / "map.npz"])
    made = DopplerMap.load(tmp_path / "map.npz")
    expected = Synthesizer(load_mesh(tmp_path / "mesh.npz"), chosen_options(told)).map(sensor)
    np.testing.assert_array_equal(made.values, expected.values)
    assert made.meta["sensor"]["position_m"] == [0.4, 0.0, 0.0]
    assert made.meta["options"]["axis"] == asdict(VelocityAxis(64))


def test_denoised_stretches_are_those_of_the_whole_map(tmp_path: Path) -> None:
    frames = 3 * 2400
    rng = np.random.default_rng(4)
    # Bursts of motion with rests between, as a person at work.
    strength = np.maximum(np.sin(np.arange(frames) / 140.0), 0) * rng.random(frames)
    values = (0.05 * rng.random((32, frames)) * strength).astype(np.float32)
    values[[14, 15, 16]] = 0
    present = np.ones(frames, bool)
    present[3000:3040] = False
    whole = DopplerMap(
        values,
        VelocityAxis(),
        Timebase(np.arange(frames) / 30.0),
        "synthetic",
        null_bins=(14, 15, 16),
        present=present,
    )
    path = find_model("denoiser")
    expected = load_model(path).denoise(whole)
    files = []
    for start, stop in stretches_of(frames, 2400):
        files.append(tmp_path / f"{start}.npz")
        whole.between(start, stop).save(files[-1])
    outs = [tmp_path / f"denoised{number}.npz" for number in range(len(files))]
    denoise(files, str(path), "digest", outs)
    found = joined([DopplerMap.load(out) for out in outs])
    np.testing.assert_array_equal(found.times_s, expected.times_s)
    assert found.meta == expected.meta
    np.testing.assert_array_equal(found.values, expected.values)


def test_a_denoised_map_is_drawn_as_the_radar_shows_it_in_stretches_too(tmp_path: Path) -> None:
    values = np.random.default_rng(2).random((32, 120)).astype(np.float32)
    values[[14, 15, 16]] = 0
    clock = Timebase(np.arange(120) / 30.0)
    whole = DopplerMap(values, VelocityAxis(), clock, "synthetic", null_bins=(14, 15, 16))
    path = find_model("denoiser")
    law = describe_model(path).needed_texture()
    for lengths in ([(0, 120)], [(0, 50), (50, 120)]):
        files, plain, drawn = (
            [tmp_path / f"{kind}{len(lengths)}-{start}.npz" for start, _ in lengths]
            for kind in ("synthetic", "plain", "drawn")
        )
        for file, (start, stop) in zip(files, lengths, strict=True):
            whole.between(start, stop).save(file)
        denoise(files, str(path), "digest", plain)
        denoise(files, str(path), "digest", drawn, texture=7)
        expected = law.on(joined([DopplerMap.load(one) for one in plain]), 7)
        found = joined([DopplerMap.load(one) for one in drawn])
        np.testing.assert_allclose(found.values, expected.values, rtol=1e-6)
        assert found.meta["texture"] == {"seed": 7}
