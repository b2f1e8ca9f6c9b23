"""Synthesizers that share prepared blocks count the same as those that do not."""

from __future__ import annotations

import gc
import weakref
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from doppler_scenes import RAW, cached_mask, sensor_at, wobbling

from sd2core.doppler import PRESETS, Synthesizer
from sd2core.doppler.options import SynthesisOptions
from sd2core.files.resources import resource_path
from sd2core.io.things import with_walls
from sd2core.mesh.decimation import decimate
from sd2core.mesh.made_vertices import shifted, shifted_like, unshifted
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.velocity_uncertainty import VelocityUncertainty
from sd2core.mesh.walls import Wall
from sd2core.recording.recording import open_recording
from sd2core.sensor import Vector, VirtualSensor

BASE = PRESETS["paper"]
OTHERS = {
    "stride": replace(BASE, mask_stride=5),
    "all bins": replace(BASE, null_bins=()),
    "facing": replace(BASE, visibility="facing"),
    "depth 128": replace(BASE, visibility="depth", depth_resolution=128),
    "depth 256": replace(BASE, visibility="depth"),
    "area": replace(BASE, weight="area"),
}


@pytest.fixture(scope="module")
def mesh() -> MeshSequence:
    """Frames of the sample in which the hand moves; :data:`PART` has others on both sides."""
    return open_recording(resource_path("swipes.sd2")).load_mesh().between(54, 76)


PART = (6, 16)


@pytest.mark.one_in(3)
@pytest.mark.parametrize("name", OTHERS)
def test_a_shared_block_changes_no_map(mesh: MeshSequence, name: str) -> None:
    first, sensor = Synthesizer(mesh, BASE), VirtualSensor()
    first.stretch(sensor, *PART)
    options: SynthesisOptions = OTHERS[name]
    shared = Synthesizer(mesh, options, blocks_of=first)
    assert shared.prepared.budget is first.prepared.budget
    alone = Synthesizer(mesh, options)
    np.testing.assert_array_equal(
        shared.stretch(sensor, *PART).values, alone.stretch(sensor, *PART).values
    )
    # Nor has the other's visibility changed the first one's.
    np.testing.assert_array_equal(
        first.stretch(sensor, *PART).values, Synthesizer(mesh, BASE).stretch(sensor, *PART).values
    )


def test_other_knots_are_not_shared(mesh: MeshSequence) -> None:
    first = Synthesizer(mesh, BASE)
    other = Synthesizer(mesh, replace(BASE, oversampling=3), blocks_of=first)
    assert other.prepared.budget is not first.prepared.budget


@pytest.mark.one_in(3)
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
def test_masks_are_shared_by_what_they_depend_on(
    mesh: MeshSequence, other: SynthesisOptions, shared: bool
) -> None:
    first, sensor = Synthesizer(mesh, BASE), VirtualSensor()
    first.stretch(sensor, *PART)
    second = Synthesizer(mesh, other, blocks_of=first)
    assert (cached_mask(second, sensor, PART) is not None) == shared
    again = second.stretch(sensor, *PART)
    np.testing.assert_array_equal(
        again.values, Synthesizer(mesh, other).stretch(sensor, *PART).values
    )


def test_depth_masks_of_another_resolution_are_not_shared(mesh: MeshSequence) -> None:
    coarse = Synthesizer(mesh, OTHERS["depth 128"])
    coarse.stretch(VirtualSensor(), *PART)
    fine = Synthesizer(mesh, OTHERS["depth 256"], blocks_of=coarse)
    assert cached_mask(coarse, VirtualSensor(), PART, "depth") is not None
    assert cached_mask(fine, VirtualSensor(), PART, "depth") is None


SWAYING, BREATHING = wobbling(20), wobbling(20, seed=3)
BESIDE, BEHIND = (1.5, 0.0, 0.4), (0.1, 0.0, 1.0)


def scene(by_m: Vector, other: MeshSequence = BREATHING) -> MeshSequence:
    """Two decimated bodies, the second put elsewhere."""
    return decimate(replace(SWAYING, others=(shifted(other, by_m),)), 0.5)


@pytest.mark.one_in(5)
@pytest.mark.parametrize("visibility", ["none", "facing", "depth", "exact"])
@pytest.mark.parametrize("changes", [{}, {"mask_stride": 3}, {"count": "expected"}], ids=str)
def test_a_body_that_is_put_elsewhere_takes_its_blocks_along(
    visibility: Any, changes: dict[str, Any]
) -> None:
    sensor, chosen = sensor_at(0.3, -0.2, -1.5), replace(RAW, **changes)
    sigma = np.full((20, 1), 0.1)
    known = VelocityUncertainty(("all",), np.zeros(BREATHING.vertex_count, int), sigma, sigma)
    other, walls = replace(BREATHING, uncertainty=known), [Wall(2.5, azimuth_deg=90)]
    scenes = [with_walls(scene(by_m, other), walls) for by_m in (BESIDE, BEHIND)]
    first = Synthesizer(scenes[0], chosen)

    def raw(maker: Synthesizer) -> Any:
        return maker.stretch(sensor, 0, 20, visibility).raw

    before = raw(first)
    moved = shifted_like(unshifted(scenes[0].others[0])[0], scenes[1].others[0])
    shared = Synthesizer(replace(scenes[0], others=(moved,)), chosen, blocks_of=first)
    of_body, of_first = shared.bodies[1].prepared, first.bodies[1].prepared
    assert of_body.budget is of_first.budget
    np.testing.assert_array_equal(raw(shared), raw(Synthesizer(scenes[1], chosen)))
    # Nor does what is made there change the map from here, walls included.
    np.testing.assert_array_equal(raw(first), before)
    assert not np.array_equal(raw(shared), before)


@pytest.mark.parametrize("visibility", ["none", "exact"])
def test_it_counts_as_the_same_vertices_there_do(visibility: Any) -> None:
    sensor, chosen = sensor_at(0.3, -0.2, -1.5), replace(RAW, velocity_sigma_bins=1.0)
    elsewhere = scene(BEHIND)
    (other,) = elsewhere.others
    there = replace(other, vertices=other.read(0, 20))
    made, expected = (
        Synthesizer(one, chosen).stretch(sensor, 0, 20, visibility).values
        for one in (elsewhere, replace(elsewhere, others=(there,)))
    )
    assert np.abs(made - expected).sum() < 0.01 * expected.sum()


def test_while_a_body_is_moved_it_hides_from_where_it_is() -> None:
    """With the masks of where it was, each of what it hides of itself alone."""
    sensor = VirtualSensor()
    first = Synthesizer(scene((0.6, 0.0, 1.0)), RAW)
    first.stretch(sensor, 0, 20, "exact")
    moved = shifted_like(unshifted(first.mesh.others[0])[0], scene(BEHIND).others[0])
    there = Synthesizer(replace(first.mesh, others=(moved,)), RAW, blocks_of=first)
    frozen = there.stretch(sensor, 0, 20, "frozen")
    assert frozen.quality == "frozen"
    exact, facing = (there.stretch(sensor, 0, 20, one) for one in ("exact", "facing"))
    off = [np.abs(one.raw - exact.raw).sum() for one in (frozen, facing)]
    assert off[0] < 0.5 * off[1]


@pytest.mark.parametrize("others", [0, 1])
def test_what_was_prepared_is_let_go_with_its_synthesizer(mesh: MeshSequence, others: int) -> None:
    """At once, not when Python looks for circles: it is hundreds of megabytes."""
    scene = replace(mesh, others=(replace(mesh, person="ben"),) * others, person="anna")
    gc.collect()
    gc.disable()
    try:
        made = Synthesizer(scene, BASE, threads=1)
        made.stretch(VirtualSensor(), *PART)
        prepared = weakref.ref(made.prepared)
        del made
        assert prepared() is None
    finally:
        gc.enable()
