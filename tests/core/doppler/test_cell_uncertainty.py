"""The uncertainty of a map's cells against its cases of certainty and against chance."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from doppler_scenes import CAMERA, reference_velocities, sensor_at, wobbling
from numpy.typing import NDArray
from oracles.plain_maps import plainly

from sd2core.doppler import PRESETS, SynthesisOptions, Synthesizer
from sd2core.doppler.smoothing import smooth
from sd2core.errors import Sd2Error
from sd2core.maps import CellUncertainty, DopplerMap
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.velocity_uncertainty import VelocityUncertainty
from sd2core.sensor import Beam, VelocityAxis, VirtualSensor
from sd2core.timebase import Timebase

FRAMES = 12
ALL = replace(PRESETS["paper"], visibility="none", range_exponent=0.0)
"""What one can work out in a few lines of NumPy: every vertex counts alike."""


def scene(sigma: float | NDArray[Any] = 0.0, across: float = 0.0) -> MeshSequence:
    """Two balls that sway at a walking hand's speed, each a limb."""
    mesh = wobbling(FRAMES, divisions=2)
    still = mesh.frame(0)
    mesh = replace(mesh, vertices=still + np.float32(0.3) * (mesh.read(0, FRAMES) - still))
    half = mesh.vertex_count // 2
    limbs = (np.arange(mesh.vertex_count) >= half).astype(np.uint8)
    along = np.broadcast_to(np.asarray(sigma, float), (FRAMES, 2))
    return replace(
        mesh,
        uncertainty=VelocityUncertainty(
            ("far", "near"), limbs, along, np.full((FRAMES, 2), across)
        ),
    )


def by_chance(
    mesh: MeshSequence, sensor: VirtualSensor, options: SynthesisOptions, draws: int = 2000
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Mean and deviation of maps whose limbs are faster by random velocities."""
    known, bins = mesh.uncertainty, options.axis.bins
    assert known is not None
    edges = options.axis.edges_mps
    random = np.random.default_rng(2).normal(size=(draws, len(known.limbs)))
    raw = np.zeros((draws, bins, mesh.frame_count))
    for frame in range(mesh.frame_count):
        moments = reference_velocities(mesh, sensor, options, frame)
        wrong = (random * known.along_mps[frame])[:, known.vertex_limb]  # (draws, V)
        for velocity in moments:
            now = velocity + wrong
            if options.beyond == "clip":
                now = np.clip(now, edges[0], edges[-1] - 1e-9)
            if options.beyond == "wrap":
                now = edges[0] + np.mod(now - edges[0], edges[-1] - edges[0])
            number = np.floor((now - edges[0]) / options.axis.bin_width_mps).astype(int)
            on_axis = (number >= 0) & (number < bins)
            slot = np.arange(draws)[:, None] * bins + number
            counted = np.bincount(slot[on_axis], minlength=draws * bins).reshape(draws, bins)
            raw[:, :, frame] += counted / (len(moments) * mesh.vertex_count)
    raw[:, list(options.null_bins)] = 0
    times_s = mesh.times_s
    maps = np.stack([smooth(one, times_s, 0, 0, mesh.frame_count, options) for one in raw])
    return maps.mean(axis=0), maps.std(axis=0)


@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    "options",
    [
        ALL,
        replace(ALL, beyond="wrap", axis=VelocityAxis(32, 0.8), null_bins=(15, 16)),
        replace(ALL, beyond="clip", axis=VelocityAxis(16, 0.8), null_bins=()),
        replace(ALL, oversampling=3, null_after_smoothing=False),
    ],
    ids=["drop", "wrap", "clip", "moments"],
)
def test_it_is_what_chance_makes_of_the_map(options: SynthesisOptions) -> None:
    sigma = np.stack([np.linspace(0.1, 0.3, FRAMES), np.full(FRAMES, 0.05)], axis=1)
    mesh = scene(sigma)
    found = Synthesizer(mesh, options).uncertainty(CAMERA)
    mean, deviation = by_chance(mesh, CAMERA, options)
    largest = deviation.max()
    assert largest > 0.01
    # Means of two thousand draws are known to 2.2 % of a deviation, deviations to some 1.6 %.
    np.testing.assert_allclose(found.expected, mean, atol=0.08 * largest)
    np.testing.assert_allclose(found.sd, deviation, atol=0.05 * largest)


@pytest.mark.parametrize("way", ["paper", "vid2doppler", "area", "frame law", "moments"])
@pytest.mark.parametrize("compiled", [True, False])
def test_a_map_that_is_known_is_its_own_expectation(
    monkeypatch: pytest.MonkeyPatch, way: str, compiled: bool
) -> None:
    options = {
        "paper": PRESETS["paper"],
        "vid2doppler": PRESETS["vid2doppler"],
        "area": replace(PRESETS["paper"], weight="projected", visibility="facing"),
        "frame law": replace(PRESETS["paper"], range_law="frame", beyond="wrap"),
        "moments": replace(PRESETS["paper"], oversampling=4, beyond="clip"),
    }[way]
    made = Synthesizer(scene(), options)
    doppler = made.map(sensor_at(0.3, 0.0, 0.2))
    if not compiled:
        plainly(monkeypatch)
    found = made.uncertainty(sensor_at(0.3, 0.0, 0.2))
    assert not found.sd.any()
    # A vertex on an edge between bins may be counted on its other side.
    assert np.abs(found.expected - doppler.values).sum() < 0.01 * doppler.values.sum()


def test_both_forms_of_the_counting_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    made = Synthesizer(scene(0.2), replace(PRESETS["paper"], oversampling=2))
    compiled = made.uncertainty(CAMERA)
    plainly(monkeypatch)
    plain = made.uncertainty(CAMERA)
    largest = compiled.sd.max()
    np.testing.assert_allclose(compiled.sd, plain.sd, atol=2e-3 * largest)
    np.testing.assert_allclose(compiled.expected, plain.expected, atol=2e-3 * largest)


def test_one_limb_of_one_velocity_gives_the_normal_distribution() -> None:
    """A plate that approaches: the expected column is a bell, the deviation a Bernoulli's."""
    from scipy.stats import norm

    times = np.arange(FRAMES) / 30.0
    grid = np.stack(np.meshgrid([-0.01, 0.01], [-0.01, 0.01], [0.0]), -1).reshape(-1, 3)
    speed_mps = 0.5 + 0.125 / 16  # in the middle of one of the parts that bins are cut into
    # What is narrower than the grid of the random number is the worst case for it.
    path = np.stack([0 * times, 0 * times, 500.0 - speed_mps * times], axis=1)
    known = VelocityUncertainty(
        ("all",), np.zeros(4, int), np.full((FRAMES, 1), 0.2), np.ones((FRAMES, 1))
    )
    mesh = MeshSequence(path[:, None] + grid[None], None, Timebase(times), uncertainty=known)
    options = replace(ALL, null_bins=(), velocity_sigma_bins=0.0, time_sigma_s=0.0)
    found = Synthesizer(mesh, options).uncertainty(CAMERA)
    edges = options.axis.edges_mps
    share = np.diff(norm.cdf(edges, loc=speed_mps, scale=0.2))
    np.testing.assert_allclose(found.expected[:, 5], share, atol=0.01)
    np.testing.assert_allclose(found.sd[:, 5] ** 2, share * (1 - share), atol=0.015)


@pytest.mark.parametrize("sigma", [5.0, 1e4])
def test_what_is_not_known_at_all_may_be_anywhere(sigma: float) -> None:
    found = Synthesizer(scene(sigma), replace(ALL, beyond="wrap")).uncertainty(CAMERA)
    # Folded back, every bin is as likely as another.
    inner = found.expected[:11]  # away from the bins that are nulled
    np.testing.assert_allclose(inner, 1 / 32, rtol=0.05)
    lost = Synthesizer(scene(sigma), ALL).uncertainty(CAMERA)
    assert 0 < lost.expected.sum(axis=0).max() < 0.5


def test_a_sensor_aside_of_the_camera_knows_more() -> None:
    made = Synthesizer(scene(0.3, across=0.03), PRESETS["paper"])
    ahead, aside = (made.uncertainty(place) for place in (CAMERA, sensor_at(2.2, 0.0, 2.2)))
    assert aside.sd.sum() < 0.5 * ahead.sd.sum()


def test_a_beam_that_the_map_leaves_out_is_left_out_here() -> None:
    """The expected map had a ninth of the map's echo."""
    narrow = replace(CAMERA, beam=Beam(10.0, 10.0), azimuth_deg=15.0)
    alone, without = (
        Synthesizer(scene(0.2), left_out=parts).uncertainty(place)
        for place, parts in ((CAMERA, ()), (narrow, ("beam",)))
    )
    np.testing.assert_array_equal(without.expected, alone.expected)
    np.testing.assert_array_equal(without.sd, alone.sd)


def test_pieces_fit_together() -> None:
    made = Synthesizer(scene(0.2), PRESETS["paper"])
    whole, part = made.uncertainty(CAMERA), made.uncertainty(CAMERA, frames=(4, 9))
    np.testing.assert_allclose(part.sd, whole.sd[:, 4:9], rtol=1e-4, atol=1e-7)
    np.testing.assert_allclose(part.expected, whole.expected[:, 4:9], rtol=1e-4, atol=1e-7)


def test_where_nobody_is_nothing_is_uncertain() -> None:
    there = np.ones(FRAMES, bool)
    there[5:8] = False
    made = Synthesizer(replace(scene(0.2), present=there), PRESETS["paper"])
    found = made.uncertainty(CAMERA)
    assert not found.sd[:, ~there].any()
    assert not found.expected[:, ~there].any()
    assert found.sd[:, there].any(axis=0).all()


def test_nulled_bins_stay_empty_and_the_rest_can_only_lose() -> None:
    found = Synthesizer(scene(0.2), ALL).uncertainty(CAMERA)
    assert not found.sd[list(ALL.null_bins)].any()
    assert found.expected.min() >= 0
    assert found.expected.sum(axis=0).max() <= 1 + 1e-6


def test_a_mesh_that_says_nothing_is_refused() -> None:
    with pytest.raises(Sd2Error, match="does not say how well its velocities are known"):
        Synthesizer(wobbling(FRAMES)).uncertainty(CAMERA)
    with pytest.raises(IndexError):
        Synthesizer(scene(0.1)).uncertainty(CAMERA, frames=(3, 99))


def test_it_stops_when_asked() -> None:
    class Stop(Exception):
        pass

    def stop(done: int, total: int) -> None:
        raise Stop

    with pytest.raises(Stop):
        Synthesizer(scene(0.1)).uncertainty(CAMERA, progress=stop)


def test_map_files_carry_it(tmp_path: Path) -> None:
    made = Synthesizer(scene(0.2), PRESETS["paper"])
    doppler = replace(made.map(CAMERA), uncertainty=made.uncertainty(CAMERA))
    doppler.save(tmp_path / "map.npz")
    read = DopplerMap.load(tmp_path / "map.npz").uncertainty
    assert read is not None
    assert doppler.uncertainty is not None
    np.testing.assert_array_equal(read.sd, doppler.uncertainty.sd)
    np.testing.assert_array_equal(read.expected, doppler.uncertainty.expected)
    with pytest.raises(Sd2Error, match="its uncertainty of"):
        replace(doppler, uncertainty=CellUncertainty(np.zeros((2, 2)), np.zeros((2, 2))))
    with pytest.raises(Sd2Error, match="expected is of shape"):
        CellUncertainty(np.zeros((2, 2)), np.zeros((2, 3)))
