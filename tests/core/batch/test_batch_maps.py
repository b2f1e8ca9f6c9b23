"""Maps of a batch, and stretches of long clips, whose maps are those of the whole clip."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from moving_spheres import swinging_sphere

from sd2core.batch.denoising import denoise
from sd2core.batch.inputs import mesh_input_of
from sd2core.batch.synthesis import synthesise
from sd2core.denoise.files import describe_model, find_model
from sd2core.doppler import Synthesizer
from sd2core.doppler.options import chosen_options
from sd2core.io.mesh import load_mesh, save_mesh
from sd2core.maps import DopplerMap, joined
from sd2core.mesh.decimation import decimate
from sd2core.mesh.sequence import MeshSequence
from sd2core.options.synthesis import Synthesis
from sd2core.sensor import VelocityAxis, VirtualSensor
from sd2core.timebase import Timebase


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
def test_maps_of_stretches_are_columns_of_the_whole_map(told: Synthesis) -> None:
    mesh, sensor = decimate(_mesh(), told.vertices_kept or 1.0), VirtualSensor((0.4, 0.0, 0.0))

    def made(*frames: int) -> DopplerMap:
        stretch = (frames[0], frames[1])
        return Synthesizer(mesh, chosen_options(told)).map(sensor, frames=stretch)

    expected, found = made(0, 300), joined([made(0, 100), made(100, 200), made(200, 300)])
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
    synthesise(mesh, sensor, told, None, [tmp_path / "map.npz"])
    made = DopplerMap.load(tmp_path / "map.npz")
    expected = Synthesizer(load_mesh(tmp_path / "mesh.npz"), chosen_options(told)).map(sensor)
    np.testing.assert_array_equal(made.values, expected.values)
    assert made.meta["sensor"]["position_m"] == [0.4, 0.0, 0.0]
    assert made.meta["options"]["axis"] == asdict(VelocityAxis(64))


def test_a_denoised_map_is_drawn_as_the_radar_shows_it(tmp_path: Path) -> None:
    values = np.random.default_rng(2).random((32, 120)).astype(np.float32)
    values[[14, 15, 16]] = 0
    clock = Timebase(np.arange(120) / 30.0)
    path, file, plain, drawn = find_model("denoiser"), *(tmp_path / f"{one}.npz" for one in "abc")
    DopplerMap(values, VelocityAxis(), clock, "synthetic", null_bins=(14, 15, 16)).save(file)
    denoise(file, str(path), plain)
    denoise(file, str(path), drawn, texture=7)
    found = DopplerMap.load(drawn)
    expected = describe_model(path).needed_texture().on(DopplerMap.load(plain), 7)
    np.testing.assert_allclose(found.values, expected.values, rtol=1e-6)
    assert found.meta["texture"] == {"seed": 7}
