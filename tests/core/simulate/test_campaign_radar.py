"""The target of a campaign: signs, levels, noise, and the same sum done otherwise."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from sd2core.fmcw import ProcessingOptions, WaveOptions
from sd2core.fmcw.options import Reflector
from sd2core.fmcw.sums import nufft
from sd2core.fmcw.wave import WaveScene
from sd2core.io.radar import named_radar
from sd2core.mesh.sequence import MeshSequence
from sd2core.radar_config import CLUTTER, PAPER_RADAR, Clutter, RadarConfig, Sampling
from sd2core.sensor import VelocityAxis, VirtualSensor
from sd2core.simulate.campaign import radar
from sd2core.simulate.campaign.radar import LinkBudget, TargetOptions, radar_target
from sd2core.timebase import Timebase

AXIS, NULLED = VelocityAxis(), (14, 15, 16)
SENSOR = VirtualSensor()
QUIET = TargetOptions(looks=40, link=None)


def plate(
    approach_mps: float, range_m: float, side_m: float = 0.2, cells: int = 12
) -> MeshSequence:
    """A square plate across the axis that is at a range in its middle frame."""
    times_s = np.arange(5) / 30.0
    line = np.linspace(-0.5 * side_m, 0.5 * side_m, cells + 1)
    x, y = (grid.ravel() for grid in np.meshgrid(line, line))
    z = range_m - approach_mps * (times_s - times_s[2])
    vertices = np.stack([np.stack([x, y, np.full_like(x, at)], axis=1) for at in z])
    corner = (np.arange((cells + 1) ** 2).reshape(cells + 1, -1)[:-1, :-1]).ravel()
    faces = np.concatenate(
        [
            np.stack([corner, corner + cells + 1, corner + 1], axis=1),
            np.stack([corner + 1, corner + cells + 1, corner + cells + 2], axis=1),
        ]
    )
    return MeshSequence(vertices.astype(np.float32), faces.astype(np.int32), Timebase(times_s))


def target(
    mesh: MeshSequence,
    options: TargetOptions = QUIET,
    config: RadarConfig = PAPER_RADAR,
    **more: object,
) -> NDArray[np.float32]:
    return radar_target(mesh, config, SENSOR, AXIS, NULLED, options=options, **more)  # type: ignore[arg-type]


@pytest.mark.one_in(3)
@pytest.mark.parametrize("approach_mps", [1.3, 0.6, -0.6, -1.3])
@pytest.mark.parametrize("options", [QUIET, TargetOptions()], ids=["quiet", "noisy"])
def test_what_approaches_is_positive(approach_mps: float, options: TargetOptions) -> None:
    values = target(plate(approach_mps, 2.2), options)
    peak = AXIS.centres_mps[values[1:-1].argmax(axis=1)]
    np.testing.assert_allclose(peak, approach_mps, atol=AXIS.bin_width_mps)


@pytest.mark.one_in(2)
@pytest.mark.parametrize("approach_mps", [0.9, -0.6])
@pytest.mark.parametrize("sampling", ["complex", "complex with image band"])
def test_i_and_q_show_what_real_samples_do(approach_mps: float, sampling: Sampling) -> None:
    both = replace(PAPER_RADAR, sampling=sampling)
    mesh = plate(approach_mps, 2.2)
    real, quadrature = (target(mesh, QUIET, config)[2] for config in (PAPER_RADAR, both))
    np.testing.assert_allclose(quadrature.sum(), real.sum(), rtol=0.1)
    assert quadrature.argmax() == real.argmax()
    noisy = target(mesh, TargetOptions(), both)[1:-1]
    peak = AXIS.centres_mps[noisy.argmax(axis=1)]
    np.testing.assert_allclose(peak, approach_mps, atol=AXIS.bin_width_mps)


def test_one_is_a_square_metre_of_rough_surface_at_the_reference_range() -> None:
    """0.04 m² at 2.2 m, and half as far 16 times as much (R to the -4)."""
    far = target(plate(1.3, 2.2))[2].sum()
    near = target(plate(1.3, 1.1))[2].sum()
    # 40 looks of one resolution cell each: their mean varies by 1 / sqrt(40).
    assert far == pytest.approx(0.04, rel=0.5)
    assert near / far == pytest.approx(16.0, rel=0.5)


def test_nulled_bins_are_empty_and_noise_alone_leaves_nothing() -> None:
    rubbish = target(plate(0.1, 2.0), TargetOptions())
    assert not rubbish[:, NULLED].any()
    still = target(
        plate(0.0, 2.0), TargetOptions(), reflectors=(Reflector((0.5, 0.0, 3.0), 0.002),)
    )
    assert not still.any()
    # What is left out is the noise: without the threshold it is everywhere.
    noisy = target(plate(0.0, 2.0), TargetOptions(above_noise=-math.inf))
    assert np.mean(np.delete(noisy, NULLED, axis=1) != 0.0) > 0.9


@pytest.mark.one_in(2)
@pytest.mark.parametrize(("clutter", "shown"), [("mean", True), (CLUTTER, False)])
def test_a_trunk_that_sways_leaves_no_ridge_beside_the_nulled_bins(
    monkeypatch: pytest.MonkeyPatch, clutter: Clutter, shown: bool
) -> None:
    """Half a square metre at 1.5 cm/s, as of a person who stands."""
    monkeypatch.setattr(radar, "PROCESSING", ProcessingOptions(clutter=clutter))
    swaying = target(plate(0.015, 2.2, side_m=0.7), TargetOptions())
    assert swaying.any() == shown
    hand = target(plate(0.6, 2.2, side_m=0.15), TargetOptions())
    assert hand.any(axis=1).all()


def test_clutter_goes_away_but_for_the_converter() -> None:
    mesh, room = plate(1.0, 2.0), (Reflector((0.3, 0.2, 3.1), 0.001),)
    with_it = target(mesh, QUIET, reflectors=room)
    np.testing.assert_allclose(with_it, target(mesh), rtol=1e-3, atol=1e-6)


def test_the_link_budget_is_the_radar_equation() -> None:
    """A plate's echo against kTB F, worked out in decibels by hand."""
    # 5 dBm + 5 dBi + 5 dBi - 4.2 dB - 22.0 dB = -11.2 dBm for an amplitude of 1, as the
    # mean square of a real sample of amplitude sqrt(2); -174 + 60 + 12 + 3 = -99 dBm.
    expected_db = -99.0 + 11.186 - 10.0 * math.log10(2.0)
    found = LinkBudget().noise_rms(PAPER_RADAR)
    assert 20.0 * math.log10(found) == pytest.approx(expected_db, abs=0.02)


def test_everybody_in_a_scene_is_seen_and_hides_who_is_behind() -> None:
    first, second = plate(1.0, 1.5), plate(-1.0, 2.2)
    aside = replace(second, vertices=second.vertices + np.float32([0.8, 0, 0]))
    looks = replace(QUIET, looks=400)
    alone, other = target(first, looks), target(aside, looks)
    both, covered = (target(replace(first, others=(one,)), looks) for one in (aside, second))
    np.testing.assert_allclose(both[:, 17:], alone[:, 17:], rtol=0.02, atol=1e-3 * alone.max())
    assert both[:, :14].sum() > 10.0 * alone[:, :14].sum()
    assert both[:, :14].sum() == pytest.approx(other[:, :14].sum(), rel=0.2)
    np.testing.assert_allclose(covered, alone, rtol=0.02, atol=1e-3 * alone.max())


def test_a_look_is_the_sum_that_the_nufft_makes() -> None:
    mesh = plate(0.9, 2.4, side_m=0.6, cells=6)
    scene, time_s = WaveScene(mesh, PAPER_RADAR, SENSOR), float(mesh.times_s[2])
    assert mesh.faces is not None
    turns = np.random.default_rng(1).random((2, len(mesh.faces)))
    phases = np.exp(2j * np.pi * turns).astype(np.complex64)
    found = radar._looks(scene, time_s, phases)
    out, back = scene.paths[0][None][0]
    for look, phase in zip(found, phases.astype(np.complex128), strict=True):
        moving = scene.scene.moving(time_s)
        echoes, rows = scene.facets(*moving, mesh.faces, None, out, back, phase)
        assert len(rows) == len(mesh.faces)
        expected = nufft(echoes, PAPER_RADAR).real
        np.testing.assert_allclose(look, expected, atol=2e-5 * np.abs(expected).max())


def test_a_long_frame_shows_how_velocities_change_in_it_and_is_not_clipped() -> None:
    """Of Wi-Fi's 0.1 s: a hand that turns round in them is seen coming and going."""
    wifi = named_radar("wifi-5ghz")
    times_s = np.arange(16) * 0.02
    still = plate(0.0, 1.5, side_m=0.3)
    sway_m = 0.1 * np.cos(2.0 * np.pi * (times_s - times_s[8]) / 0.25)
    vertices = still.vertices[:1] + np.stack([0 * sway_m, 0 * sway_m, sway_m], axis=1)[:, None]
    mesh = MeshSequence(vertices.astype(np.float32), still.faces, Timebase(times_s))
    scene = WaveScene(mesh, wifi, SENSOR)
    phases = np.ones((1, len(scene.faces)), np.complex64)
    found = radar._looks(scene, float(times_s[8]), phases)[0]
    rough = WaveScene(mesh, wifi, SENSOR, wave=WaveOptions(coherent=False))
    rough._random = phases[0].astype(np.complex128)
    expected = rough.frame(float(times_s[8]))[0]
    np.testing.assert_allclose(found, expected, atol=1e-3 * np.abs(expected).max())
    link = LinkBudget()
    samples, full_scale = radar._received(found[None], wifi, link, np.random.default_rng(0))
    assert full_scale == pytest.approx(link.full_scale * wifi.wavelength_m / 5e-3)
    assert np.abs(samples).max() < 1.0


def test_what_is_hidden_does_not_echo() -> None:
    near, far = plate(0.0, 1.5, side_m=0.6), plate(1.0, 2.5, side_m=0.2)
    assert near.faces is not None
    assert far.faces is not None
    both = MeshSequence(
        np.concatenate([near.vertices[:], far.vertices[:]], axis=1),
        np.concatenate([near.faces, far.faces + near.vertex_count]),
        near.timebase,
    )
    assert target(far)[2].sum() > 0.01
    assert target(both)[2].sum() < 1e-4


def test_the_same_seed_makes_the_same_bytes_and_another_does_not() -> None:
    mesh, options = plate(1.0, 2.0), TargetOptions(looks=2)
    one, again, other = (target(mesh, options, seed=[seed]) for seed in (1, 1, 2))
    assert one.tobytes() == again.tobytes()
    assert one.tobytes() != other.tobytes()
