"""The frames that plans are tried on."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from accuracy_scenes import FPS, ball, steady, waving
from hypothesis import given
from hypothesis import strategies as st

from sd2core.accuracy import choose
from sd2core.accuracy.cache import clip_fingerprint
from sd2core.accuracy.plans import MASK_STRIDES
from sd2core.accuracy.sample import KEPT, Sample, take_sample
from sd2core.doppler import PRESETS
from sd2core.mesh.sequence import MeshSequence
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase

PAPER = PRESETS["paper"]
CAMERA = VirtualSensor()


def clip(frames: int) -> MeshSequence:
    vertices = np.random.default_rng(frames).normal(size=(frames, 4, 3)).astype(np.float32)
    return MeshSequence(vertices, None, Timebase.regular(frames, 30.0))


def sampled(frames: int) -> tuple[MeshSequence, Sample]:
    mesh = clip(frames)
    return mesh, take_sample(mesh, CAMERA, PAPER)


@given(st.integers(1, 700))
def test_runs_are_what_they_say(frames: int) -> None:
    mesh, sample = sampled(frames)
    small = sample.of(mesh)
    assert small.frame_count == len(sample.frames)
    np.testing.assert_array_equal(small.times_s, mesh.times_s[sample.frames])
    for run in sample.runs:
        np.testing.assert_array_equal(
            small.read(run.start, run.stop), mesh.read(run.frames.start, run.frames.stop)
        )


@given(st.integers(1, 700))
def test_runs_do_not_overlap_and_some_are_to_choose_on(frames: int) -> None:
    _, sample = sampled(frames)
    seen = [frame for run in sample.runs for frame in run.frames]
    assert len(set(seen)) == len(seen)
    assert sample.chosen_on
    assert set(sample.chosen_on) <= set(sample.runs)


@pytest.mark.parametrize("frames", [12, 45, 89])
def test_a_short_clip_is_compared_whole(frames: int) -> None:
    _, sample = sampled(frames)
    assert sorted(frame for run in sample.runs for frame in run.frames) == list(range(frames))
    assert {run.weight for run in sample.runs} == {1.0}


@pytest.mark.parametrize("frames", [40, 89, 450])
def test_neighbours_of_a_run_are_neighbours_in_the_clip(frames: int) -> None:
    """What a run's velocities and reused masks look at must be its own surroundings."""
    _, sample = sampled(frames)
    for run, stride in itertools.product(sample.runs, MASK_STRIDES):
        for local in range(run.start, run.stop):
            serving = (local + stride // 2) // stride * stride
            for other in (serving, local - 1, local + 1):
                inside = min(max(other, 0), len(sample.frames) - 1)
                assert sample.frames[inside] - sample.frames[local] == inside - local


def test_the_liveliest_frames_are_among_them() -> None:
    mesh = ball(steady((0, 0, 2), (0, 0, 0)), fineness=1, frames=400)
    vertices = mesh.read(0, 400)
    vertices[200:240] += np.linspace(0, 1, 40, dtype=np.float32)[:, None, None]
    vertices[240:] += 1
    sample = take_sample(mesh, CAMERA, PAPER)
    assert any(run.frames.start >= 200 and run.frames.stop <= 240 for run in sample.runs)
    assert all(len(run.frames) == KEPT for run in sample.runs if 0 < run.first < 380)


def test_of_gestures_with_long_pauses_the_gestures_are_sampled() -> None:
    """Of pauses an empty map is right whatever the plan is."""
    starts_s = np.arange(10.0, 300.0, 20.0)
    mesh = ball(waving(starts_s), fineness=1, frames=9000)
    sample = take_sample(mesh, CAMERA, PAPER)
    beside = [np.abs((run.first + 5) / FPS - starts_s - 0.75).min() for run in sample.runs]
    # One for the rest of the clip, which has hardly any weight.
    assert np.median(beside) < 0.75


def test_where_one_of_several_people_moves_is_sampled() -> None:
    gesture_s = np.array([5.0])
    still, gone = ball(steady((0, 0, 2), (0, 0, 0)), frames=400), np.ones(400, bool)
    gone[140:210] = False
    scene = replace(still, present=gone, others=(ball(waving(gesture_s), frames=400),))
    liveliest = take_sample(scene, CAMERA, PAPER).chosen_on[0]
    assert abs((liveliest.first + 5) / FPS - gesture_s[0] - 0.75) < 0.75


def test_runs_lie_where_somebody_is_and_keep_the_gaps() -> None:
    frames = 450
    mesh = clip(frames)
    present = np.ones(frames, bool)
    present[100:300] = False
    gone = replace(mesh, present=present)
    sample = take_sample(gone, CAMERA, PAPER)
    for run in sample.runs:
        assert present[run.frames.start : run.frames.stop].any()
    small = sample.of(gone)
    np.testing.assert_array_equal(small.presence.present, present[sample.frames])


def test_a_short_clip_with_a_gap_is_sampled_whole_with_its_gap() -> None:
    mesh = ball(steady((0.0, 0.0, 3.0), (0.0, 0.0, -1.0)), fineness=2, frames=24)
    present = np.ones(24, bool)
    present[7:13] = False
    gone = replace(mesh, present=present)
    small = take_sample(gone, CAMERA, PAPER).of(gone)
    np.testing.assert_array_equal(small.present, present)


def test_plans_are_compared_on_clips_with_gaps() -> None:
    mesh = ball(steady((0.0, 0.0, 3.0), (0.0, 0.0, -1.0)), fineness=2, frames=24)
    present = np.ones(24, bool)
    present[7:13] = False
    choice = choose(replace(mesh, present=present), VirtualSensor(), tolerance=0.05)
    assert choice.holds
    assert choice.errors.l1 <= 0.05
    nobody = choose(replace(mesh, present=present & False), VirtualSensor(), tolerance=0.05)
    assert nobody.holds


def test_another_gap_makes_another_scene() -> None:
    mesh = clip(20)
    one, two = np.ones(20, bool), np.ones(20, bool)
    one[3], two[4] = False, False
    names = {clip_fingerprint(replace(mesh, present=which)) for which in (None, one, two)}
    assert len(names) == 3
