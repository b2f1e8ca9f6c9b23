"""Synthesizers that share prepared blocks count the same as those that do not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from doppler_scenes import cached_mask

from sd2core.doppler import PRESETS, Synthesizer
from sd2core.doppler.options import SynthesisOptions
from sd2core.files.resources import resource_path
from sd2core.recording.recording import open_recording
from sd2core.sensor import VirtualSensor

BASE = PRESETS["paper"]
OTHERS = {
    "stride": replace(BASE, mask_stride=5),
    "all bins": replace(BASE, null_bins=()),
    "facing": replace(BASE, visibility="facing"),
    "depth 128": replace(BASE, visibility="depth", depth_resolution=128),
    "depth 256": replace(BASE, visibility="depth"),
    "area": replace(BASE, weight="area"),
}


@pytest.mark.parametrize("name", OTHERS)
def test_a_shared_block_changes_no_map(name: str) -> None:
    mesh = open_recording(resource_path("swipes.sd2")).load_mesh()
    first, sensor = Synthesizer(mesh, BASE), VirtualSensor()
    first.stretch(sensor, 60, 70)
    options: SynthesisOptions = OTHERS[name]
    shared = Synthesizer(mesh, options, blocks_of=first)
    assert shared.prepared.budget is first.prepared.budget
    alone = Synthesizer(mesh, options)
    np.testing.assert_array_equal(
        shared.stretch(sensor, 60, 70).values, alone.stretch(sensor, 60, 70).values
    )
    # Nor has the other's visibility changed the first one's.
    np.testing.assert_array_equal(
        first.stretch(sensor, 60, 70).values, Synthesizer(mesh, BASE).stretch(sensor, 60, 70).values
    )


def test_other_knots_are_not_shared() -> None:
    mesh = open_recording(resource_path("swipes.sd2")).load_mesh()
    first = Synthesizer(mesh, BASE)
    other = Synthesizer(mesh, replace(BASE, oversampling=3), blocks_of=first)
    assert other.prepared.budget is not first.prepared.budget


@pytest.mark.parametrize(
    ("other", "shared"),
    [
        (replace(BASE, weight="area"), True),
        (replace(BASE, range_law="frame", velocity_sigma_bins=0.0), True),
        (replace(BASE, depth_resolution=128), True),
        (replace(BASE, null_bins=()), False),
        (replace(BASE, beyond="wrap"), False),
        (replace(BASE, mask_stride=5), False),
    ],
    ids=["weight", "range law", "pixels of another test", "nulled bins", "beyond", "stride"],
)
def test_masks_are_shared_by_what_they_depend_on(other: SynthesisOptions, shared: bool) -> None:
    mesh = open_recording(resource_path("swipes.sd2")).load_mesh()
    first, sensor = Synthesizer(mesh, BASE), VirtualSensor()
    first.stretch(sensor, 60, 70)
    second = Synthesizer(mesh, other, blocks_of=first)
    assert (cached_mask(second, sensor, (60, 70)) is not None) == shared
    again = second.stretch(sensor, 60, 70)
    np.testing.assert_array_equal(
        again.values, Synthesizer(mesh, other).stretch(sensor, 60, 70).values
    )


def test_depth_masks_of_another_resolution_are_not_shared() -> None:
    mesh = open_recording(resource_path("swipes.sd2")).load_mesh()
    coarse = Synthesizer(mesh, OTHERS["depth 128"])
    coarse.stretch(VirtualSensor(), 60, 70)
    fine = Synthesizer(mesh, OTHERS["depth 256"], blocks_of=coarse)
    assert cached_mask(coarse, VirtualSensor(), (60, 70), "depth") is not None
    assert cached_mask(fine, VirtualSensor(), (60, 70), "depth") is None
