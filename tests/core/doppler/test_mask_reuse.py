"""Masks that serve several frames, and masks by depth buffer, in the whole chain."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from doppler_scenes import RAW, cached_mask, options, sensor_at, wobbling
from oracles.plain_maps import plainly

from sd2core.doppler import PRESETS, Synthesizer

NEAR = sensor_at(0.3, -0.2, 0.1)
NEXT = sensor_at(0.32, -0.2, 0.1)
OCCLUSION = pytest.mark.parametrize("visibility", ["depth", "exact"])


@OCCLUSION
def test_every_frame_is_its_own_mask(visibility: Any) -> None:
    mesh = wobbling(24)
    plain = Synthesizer(mesh, options()).map(NEAR, visibility=visibility)
    told = Synthesizer(mesh, options(mask_stride=1)).map(NEAR, visibility=visibility)
    np.testing.assert_array_equal(told.values, plain.values)
    assert told.meta["mask_stride"] == 1
    assert told.meta["visibility"] == visibility


@OCCLUSION
@pytest.mark.parametrize("stride", [2, 5, 100])
def test_the_nearest_frame_serves(visibility: Any, stride: int) -> None:
    """Everything live, so that masks are complete and can be compared with single frames."""
    frames = 23
    mesh = wobbling(frames)
    wide = options(mask_stride=stride, beyond="clip")
    maker = Synthesizer(mesh, wide)
    made = maker.map(NEAR, visibility=visibility)
    mask = cached_mask(maker, NEAR, visibility=visibility)
    assert mask is not None
    every = Synthesizer(mesh, replace(wide, mask_stride=1))
    serving = range(0, frames, stride)
    single = {t: every.frame(NEAR, t, visibility).visible for t in serving}
    for frame in range(frames):
        nearest = min(serving, key=lambda t, frame=frame: (abs(t - frame), -t))
        np.testing.assert_array_equal(mask[frame] > 0, single[nearest])
        np.testing.assert_array_equal(maker.frame(NEAR, frame, visibility).visible, mask[frame] > 0)
    assert made.meta["mask_stride"] == stride
    assert made.meta["visibility"] == visibility
    assert maker.map(NEAR, visibility="facing").meta["mask_stride"] == 1


@OCCLUSION
def test_a_serving_frame_tests_what_its_neighbours_need(visibility: Any) -> None:
    """With nulled bins few vertices are tested; the map must not depend on which."""
    mesh = wobbling(40)
    some = Synthesizer(mesh, replace(RAW, null_bins=tuple(range(8, 24)), mask_stride=6))
    all_of_it = Synthesizer(mesh, replace(RAW, mask_stride=6, beyond="clip"))
    values = some.map(NEAR, visibility=visibility).values
    live = [*range(1, 8), *range(24, 31)]  # clipping fills the outermost
    np.testing.assert_array_equal(
        values[live], all_of_it.map(NEAR, visibility=visibility).values[live]
    )


@OCCLUSION
def test_frozen_reuses_shared_masks(visibility: Any) -> None:
    maker = Synthesizer(wobbling(20), options(visibility=visibility, mask_stride=4))
    made = maker.stretch(NEAR, 0, 20)
    frozen = maker.stretch(NEAR, 0, 20, "frozen")
    assert (made.quality, frozen.quality) == (visibility, "frozen")
    np.testing.assert_array_equal(frozen.values, made.values)
    assert maker.map(NEXT, visibility="frozen").meta["mask_stride"] == 4


@OCCLUSION
def test_where_nothing_moved_a_kept_mask_is_the_same_as_a_new_one(visibility: Any) -> None:
    mesh = wobbling(20)
    maker = Synthesizer(mesh, options(visibility=visibility))
    for place in (NEAR, NEXT):
        maker.map(place)
    for place in (NEXT, NEAR):
        anew = Synthesizer(mesh, options(visibility=visibility)).map(place)
        np.testing.assert_array_equal(maker.map(place, visibility="frozen").values, anew.values)


@OCCLUSION
def test_the_nearest_place_serves(visibility: Any) -> None:
    """Whichever was made last: what is reused is what counting with that mask gives."""
    mesh = wobbling(20)
    both = Synthesizer(mesh, options(visibility=visibility))
    places = {offset: sensor_at(0.3 + offset, -0.2, 0.1) for offset in (0.0, 0.4)}
    alone = {offset: Synthesizer(mesh, options(visibility=visibility)) for offset in places}
    for offset, place in places.items():
        both.map(place)
        alone[offset].map(place)
    for moved, nearest in ((0.05, 0.0), (0.15, 0.0), (0.25, 0.4), (0.6, 0.4)):
        there = sensor_at(0.3 + moved, -0.2, 0.1)
        expected = alone[nearest].map(there, visibility="frozen").values
        other = alone[0.4 - nearest].map(there, visibility="frozen").values
        np.testing.assert_array_equal(both.map(there, visibility="frozen").values, expected)
        assert (expected != other).any()


@pytest.mark.parametrize("resolution", [128, 256])
def test_depth_of_a_ball_before_another_errs_at_its_outline_only(resolution: Any) -> None:
    """Convex and closed, each ball shows its own front without error (see test_depth.py)."""
    mesh = wobbling(30)
    chosen = options(visibility="depth", depth_resolution=resolution)
    depth = Synthesizer(mesh, chosen)
    exact = Synthesizer(mesh, options())
    half = mesh.vertex_count // 2
    for frame in range(0, 30, 5):
        seen, truth = (maker.frame(NEAR, frame).visible for maker in (depth, exact))
        np.testing.assert_array_equal(seen[half:], truth[half:])  # the near ball
        # A rim of 1.6 pixels about the near ball, of half the far one's radius r, is
        # 1.6 π r of its front's π r² pixels, at r = N / 4 or more: 6.4 / N of half its vertices.
        assert (seen != truth)[:half].sum() <= 3.2 / resolution * half


@OCCLUSION
@pytest.mark.parametrize("preset", list(PRESETS))
def test_numpy_finds_the_same(
    monkeypatch: pytest.MonkeyPatch, visibility: Any, preset: str
) -> None:
    chosen = replace(PRESETS[preset], mask_stride=3)
    mesh = wobbling(9, divisions=2)
    compiled = Synthesizer(mesh, chosen).map(NEAR, visibility=visibility)
    plainly(monkeypatch)
    plain = Synthesizer(mesh, chosen).map(NEAR, visibility=visibility)
    np.testing.assert_allclose(plain.values, compiled.values, atol=1e-6)
