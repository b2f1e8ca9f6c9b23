"""A simulated map from any place is that of a recording whose simulated radar stood there."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from swinging_recordings import recording

from sd2core.datasets.recording_sources import Making
from sd2core.datasets.simulating import Simulation, seed_of, simulated_map
from sd2core.datasets.source import Source
from sd2core.datasets.sources import gather
from sd2core.errors import Sd2Error
from sd2core.fmcw import LinkBudget, SignalOptions, WaveOptions, simulate_radar
from sd2core.io.radar.infineon import write_capture
from sd2core.mesh.sequence import MeshSequence
from sd2core.placements.body_extent import BodyExtent
from sd2core.placements.placements import PlacementGrid
from sd2core.progress import silent
from sd2core.radar_config import PAPER_RADAR
from sd2core.recording.recording import Recording
from sd2core.sensor import VelocityAxis, VirtualSensor
from sd2core.timebase import Timebase

GRID = PlacementGrid((1.0, 2.5), (30.0,))
KINDS = ("synthetic", "simulated", "real")
SIMULATED = Making(kinds=KINDS, placements=GRID, simulation=Simulation())
FEW_CHIRPS = replace(PAPER_RADAR, chirps_per_frame=16, samples_per_chirp=16)


def made(one: Recording, making: Making) -> list[Source]:
    return [lazy.load(silent) for lazy in gather([one.folder], making)]


def with_own_radar(folder: Path, mesh: Path, sensor: VirtualSensor) -> Recording:
    """A recording whose radar stood at a place, as ``sd2 simulate radar`` makes it."""
    folder.mkdir()
    moving = Recording(folder, mesh=mesh).load_mesh()
    capture = simulate_radar(
        moving,
        PAPER_RADAR,
        sensor=sensor,
        visibility="exact",
        wave=WaveOptions(coherent=False),
        options=SignalOptions(seed=seed_of(moving, sensor, Simulation()), link=LinkBudget()),
    )
    write_capture(
        folder / "radar",
        capture.samples,
        capture.config,
        capture.timebase.times_s,
        simulated=True,
        meta=capture.meta,
    )
    one = Recording.create(
        folder, mesh=mesh, radar=folder / "radar", radar_offset_s=moving.timebase.start_s
    )
    one.sensor = sensor
    one.save()
    return one


@pytest.mark.slow
@pytest.mark.parametrize("rate_hz", [30.0, 25.0], ids=["radar's rate", "another rate"])
def test_every_place_shows_what_a_radar_there_would_have_recorded(
    tmp_path: Path, rate_hz: float
) -> None:
    one = recording(tmp_path / "anna.sd2", radar=False, rate_hz=rate_hz)
    mesh = one.load_mesh()
    sources = made(one, SIMULATED)
    assert [tuple(source.maps) for source in sources] == [("synthetic", "simulated")] * 3
    target_m = BodyExtent.of(mesh).target_m
    sensors = [one.sensor, *(place.sensor(target_m) for place in GRID.places())]
    for number, (source, sensor) in enumerate(zip(sources, sensors, strict=True)):
        own = with_own_radar(tmp_path / f"own{number}.sd2", one.folder / "mesh.npz", sensor)
        (expected,) = made(own, Making(kinds=KINDS))
        there, found = expected.maps["simulated"], source.maps["simulated"]
        assert found.values.max() > 0
        np.testing.assert_allclose(found.values, there.values, rtol=1e-6, atol=0)
        np.testing.assert_array_equal(found.times_s, there.times_s)
        np.testing.assert_array_equal(source.known["simulated"], expected.known["simulated"])
        assert (found.unit, found.axis) == (there.unit, there.axis)
    # Nearer is stronger: the gain does not follow the scene.
    power = [source.maps["simulated"].values.sum() for source in sources[1:]]
    assert power[0] > 10 * power[1]


@pytest.mark.slow
def test_a_long_clip_has_nobody_where_nobody_is() -> None:
    mesh = _swaying_plate(620)
    simulation = Simulation(FEW_CHIRPS, seed=5)
    sensor, axis = VirtualSensor((0.2, 0.0, 0.0)), VelocityAxis()
    whole = simulated_map(mesh, sensor, simulation, axis)
    np.testing.assert_array_equal(whole.times_s, mesh.times_s)
    assert whole.present is not None
    assert np.flatnonzero(~whole.present).tolist() == list(range(300, 320))
    assert "first_frame_s" not in whole.meta["simulation"]


def test_mesh_place_and_seed_each_have_noise_of_their_own() -> None:
    mesh, sensor = _swaying_plate(4), VirtualSensor()
    other = replace(mesh, vertices=mesh.read(0, 4) + np.float32(0.01))
    seeds = {
        seed_of(mesh, sensor, Simulation()),
        seed_of(other, sensor, Simulation()),
        seed_of(mesh, VirtualSensor((0.1, 0.0, 0.0)), Simulation()),
        seed_of(mesh, sensor, Simulation(seed=1)),
    }
    assert len(seeds) == 4
    assert seed_of(_swaying_plate(4), sensor, Simulation()) in seeds


@pytest.mark.slow
def test_a_real_radar_stays_and_a_simulated_one_is_made_anew(tmp_path: Path) -> None:
    real = recording(tmp_path / "anna.sd2", simulated=False)
    own, *others = made(real, SIMULATED)
    assert tuple(own.maps) == ("synthetic", "real", "simulated")
    assert [tuple(source.maps) for source in others] == [("synthetic", "simulated")] * 2
    simulated = recording(tmp_path / "ben.sd2")
    own, *_ = made(simulated, SIMULATED)
    expected = simulated_map(
        simulated.load_mesh(), simulated.sensor, Simulation(), SIMULATED.synthesis.axis
    )
    assert np.array_equal(own.maps["simulated"].values, expected.values)


def test_points_without_a_surface_have_no_echo() -> None:
    points = replace(_swaying_plate(4), faces=None)
    with pytest.raises(Sd2Error, match="no faces"):
        simulated_map(points, VirtualSensor(), Simulation(), VelocityAxis())


def _swaying_plate(frames: int) -> MeshSequence:
    """Two triangles that come and go; for a while nobody is there."""
    times_s = np.arange(frames) / 30.0
    corners = np.array([[-0.3, -0.3, 0], [0.3, -0.3, 0], [0.3, 0.3, 0], [-0.3, 0.3, 0]])
    vertices = np.repeat(corners[None], frames, axis=0)
    vertices[:, :, 2] += 2.0 + 0.2 * np.sin(2 * np.pi * 0.5 * times_s)[:, None]
    present = np.ones(frames, bool)
    present[300:320] = False
    faces = np.array([[0, 2, 1], [0, 3, 2]], np.int32)
    return MeshSequence(
        vertices.astype(np.float32), faces, Timebase(times_s), "plate", present=present
    )
