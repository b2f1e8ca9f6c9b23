"""Signals of several bodies before one radar add up, and who is hidden does not echo."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from moving_spheres import swinging_sphere

from sd2core.fmcw.options import SignalOptions, WaveOptions
from sd2core.fmcw.reference import converged_frame
from sd2core.fmcw.simulation import simulate_radar
from sd2core.fmcw.spectra import frame_spectra
from sd2core.fmcw.wave import WaveScene
from sd2core.mesh.sequence import MeshSequence
from sd2core.radar_config import PAPER_RADAR
from sd2core.sensor import VirtualSensor

CAMERA = VirtualSensor()
EITHER = pytest.mark.parametrize("visibility", ["facing", "exact"])


def ball(*by_m: float, size: float = 1.0) -> MeshSequence:
    """It swings towards the camera and back, seen from outside."""
    mesh = swinging_sphere(12)
    assert mesh.faces is not None
    points = np.asarray(mesh.vertices, np.float64)
    middle = points.mean(axis=1, keepdims=True)
    moved = middle + size * (points - middle) + (np.array(by_m) if by_m else 0.0)
    return replace(mesh, vertices=moved, faces=np.fliplr(mesh.faces))


def signal(mesh: MeshSequence, visibility: Any = "facing", **wave: Any) -> Any:
    return WaveScene(mesh, PAPER_RADAR, CAMERA, visibility, WaveOptions(**wave), 5).frame(0.1)


@EITHER
@pytest.mark.parametrize("motion", ["constant", "interpolated"])
def test_those_apart_add_up(visibility: Any, motion: Any) -> None:
    one, other = ball(), ball(1.0, 0.2, 0.4)
    scene = signal(replace(one, others=(other,)), visibility, motion=motion)
    alone = [signal(mesh, visibility, motion=motion) for mesh in (one, other)]
    np.testing.assert_array_equal(scene, alone[0] + alone[1])


@EITHER
def test_who_is_behind_somebody_is_silent(visibility: Any) -> None:
    one, behind = ball(), ball(0, 0, 0.5, size=0.5)
    for scene in (replace(one, others=(behind,)), replace(behind, others=(one,))):
        np.testing.assert_array_equal(signal(scene, visibility), signal(one, visibility))
    gone = replace(one, present=np.zeros(12, bool))
    heard = signal(replace(behind, others=(gone,)), visibility)
    np.testing.assert_array_equal(heard, signal(behind, visibility))


def test_rough_surfaces_of_two_have_phases_of_their_own() -> None:
    one, other = ball(), ball(0.5, 0, 0)
    both = signal(replace(one, others=(other,)), coherent=False)
    alone = [signal(mesh, coherent=False) for mesh in (one, other)]
    assert not np.allclose(both, alone[0] + alone[1], atol=0.1 * np.abs(both).max())
    assert not np.allclose(both, alone[0], atol=0.1 * np.abs(both).max())


def test_the_reference_and_single_frames_are_of_all() -> None:
    one, other = ball(), ball(0.8, 0, 0)
    scene = replace(one, others=(other,))
    limit = converged_frame(WaveScene(scene, PAPER_RADAR, CAMERA), 0.1, most_cuts=1)
    each = [
        converged_frame(WaveScene(mesh, PAPER_RADAR, CAMERA), 0.1, most_cuts=1).signal
        for mesh in (one, other)
    ]
    np.testing.assert_allclose(limit.signal, each[0] + each[1], rtol=1e-9, atol=1e-12)
    columns = frame_spectra(scene, PAPER_RADAR, [0.1])
    assert not np.allclose(columns, frame_spectra(one, PAPER_RADAR, [0.1]), rtol=1e-2)


def test_a_capture_of_a_scene_says_who_was_there_and_when() -> None:
    there = np.arange(12) < 6
    one, other = replace(ball(), present=there, person="anna"), ball(0.8, 0, 0)
    quiet = SignalOptions(snr_db=math.inf)
    made = simulate_radar(replace(one, others=(other,)), PAPER_RADAR, options=quiet)
    assert made.meta["simulation"]["bodies"] == ["anna", "person 2"]
    assert np.ptp(np.asarray(made.samples)[-1].astype(float)) > 0
    seen = np.ones((12, len(one.faces)), bool)  # type: ignore[arg-type]
    given = simulate_radar(
        replace(one, others=(other,)), PAPER_RADAR, options=quiet, visibility=seen
    )
    assert given.samples.shape == made.samples.shape
