"""The sample of two people: whole, on one floor, in each other's way for a while."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sd2core.doppler import PRESETS, Synthesizer
from sd2core.errors import Sd2Error
from sd2core.io.things import with_things
from sd2core.recording.recording import open_recording
from sd2core.sensor import VirtualSensor
from sd2core.simulate.two_people import two_people


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return two_people(tmp_path_factory.mktemp("demo") / "two.sd2").folder


def test_two_people_walk_on_one_floor_before_the_camera(made: Path) -> None:
    recording = open_recording(made)
    assert recording.simulated
    assert not recording.missing()
    scene = recording.load_mesh()
    assert scene.persons == ("Anna", "Bert")
    heights = []
    for body in scene.bodies:
        points = body.read(0, body.frame_count)
        assert np.isfinite(points).all()
        floor_m = points[..., 1].max(axis=1)
        np.testing.assert_allclose(floor_m, 1.1, atol=0.06)
        assert points[..., 2].min() > 1.2
        heights.append(np.ptp(points[0, :, 1]))
    assert heights == pytest.approx([1.68, 1.82], abs=0.08)
    across = scene.others[0].read(0, 240)[..., 0].mean(axis=1)
    assert across[0] > 1.5
    assert across[-1] < -1.5


def test_each_hides_the_other_for_a_while(made: Path) -> None:
    scene, sensor = with_things(open_recording(made).load_mesh(), []), VirtualSensor()
    plain = replace(PRESETS["paper"], null_bins=(), range_exponent=0.0)
    both, *each = (
        Synthesizer(body, plain).stretch(sensor, 0, 240, "exact").raw.sum(axis=0)
        for body in (scene, replace(scene, others=()), *scene.others)
    )
    assert (both <= sum(each) + 1e-12).all()
    assert (both < 0.8 * sum(each)).sum() > 5


def test_a_recording_is_not_written_over(made: Path) -> None:
    with pytest.raises(Sd2Error, match="is a recording already"):
        two_people(made)
