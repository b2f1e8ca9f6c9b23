"""Expected maps: each vertex is the normal distribution of its velocity."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from doppler_scenes import CAMERA, RAW, sensor_at, wobbling
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from oracles.plain_maps import plainly
from scipy.special import ndtr

from sd2core.doppler import PRESETS, SynthesisOptions, Synthesizer, expected
from sd2core.doppler.expected import spread_over_bins
from sd2core.doppler.histogram import counting_of
from sd2core.doppler.limb_kernels import fine_kernel
from sd2core.doppler.options import chosen_options
from sd2core.doppler.reference import reference_stretch
from sd2core.errors import Sd2Error
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.velocity_uncertainty import VelocityUncertainty
from sd2core.mesh.vertex_parts import VertexParts
from sd2core.options.synthesis import Synthesis
from sd2core.progress import Cancelled
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase

FRAMES = 24
EXPECTED = replace(RAW, visibility="none")
PAPER = PRESETS["paper"]
ASIDE = sensor_at(0.4, 0.1, 0.2)
BIN_MPS = RAW.axis.bin_width_mps


def scene(sigma_mps: float | NDArray[Any] = 0.1, across_mps: float | None = None) -> MeshSequence:
    """Two balls that sway at a walking hand's speed, the farther one of two limbs."""
    mesh = wobbling(FRAMES)
    still = mesh.frame(0)
    moving = still + np.float32(0.3) * (mesh.read(0, FRAMES) - still)
    limbs = np.repeat([0, 2], mesh.vertex_count // 2)
    limbs[: mesh.vertex_count // 2 : 2] = 1
    along = np.broadcast_to(np.asarray(sigma_mps, float), (FRAMES, 3)) * [1.0, 0.7, 1.3]
    across = along if across_mps is None else np.full((FRAMES, 3), across_mps)
    known = VelocityUncertainty(("far", "even", "near"), limbs, along, across)
    return replace(mesh, vertices=moving, uncertainty=known)


def off(found: NDArray[Any], truth: NDArray[Any]) -> float:
    """Relative L1."""
    return float(np.abs(found - truth).sum() / np.abs(truth).sum())


def raw_of(mesh: MeshSequence, options: SynthesisOptions, **how: Any) -> NDArray[np.float64]:
    return Synthesizer(mesh, options).stretch(ASIDE, 0, mesh.frame_count, **how).raw


@example(speed_mps=2.0, sigma_mps=0.0625, beyond="drop")
@given(
    speed_mps=st.floats(-3.0, 3.0),
    sigma_mps=st.floats(0.02, 2.0),
    beyond=st.sampled_from(["drop", "wrap", "clip"]),
)
def test_one_vertex_is_a_normal_distribution(
    speed_mps: float, sigma_mps: float, beyond: Any
) -> None:
    times = np.arange(5) / 30.0
    path = np.stack([0 * times, 0 * times, 50.0 - speed_mps * times], axis=1)[:, None]
    known = VelocityUncertainty(
        ("all",), np.zeros(1, int), np.full((5, 1), sigma_mps), np.full((5, 1), 9.0)
    )
    mesh = MeshSequence(path, None, Timebase(times), uncertainty=known)
    found = Synthesizer(mesh, replace(EXPECTED, beyond=beyond)).stretch(CAMERA, 2, 3).raw[:, 0]
    edges = RAW.axis.edges_mps
    turns = np.arange(-8, 9)[:, None] * 2 * RAW.axis.v_max_mps if beyond == "wrap" else 0.0
    spread_mps = expected.SIGMA_FACTOR * sigma_mps
    below = ndtr((edges - speed_mps + turns) / spread_mps).reshape(-1, len(edges))
    if beyond == "clip":
        below[:, 0], below[:, -1] = 0.0, 1.0
    share = np.diff(below).sum(axis=0)
    # The axis is closed: what is at its end is put a thousandth of a bin inside.
    inside_mps = 1e-3 * BIN_MPS
    at_end = 0.0 <= RAW.axis.v_max_mps - speed_mps <= inside_mps
    np.testing.assert_allclose(found, share, atol=5e-4 + 0.4 * at_end * inside_mps / spread_mps)
    if beyond != "drop":
        assert found.sum() == pytest.approx(1.0, abs=1e-9)


@pytest.mark.one_in(5)
@pytest.mark.parametrize("sigma_bins", [0.02, 0.1, 0.3, 0.5, 0.7, 1.0, 3.0])
@pytest.mark.parametrize("beyond", ["drop", "wrap", "clip"])
def test_it_is_what_spreading_each_vertex_gives(sigma_bins: float, beyond: Any) -> None:
    mesh = scene(sigma_bins * BIN_MPS)
    options = replace(PAPER, beyond=beyond, axis=VelocityAxis(16, 1.0), null_bins=(7, 8))
    assert off(raw_of(mesh, options), reference_stretch(mesh, ASIDE, options, 0, FRAMES)) < 2e-3


@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    "changes",
    [
        {"weight": "area"},
        {"weight": "projected", "range_law": "frame"},
        {"oversampling": 3, "range_exponent": 2.5},
        {"trajectory_smoothing_s": 0.05, "null_bins": ()},
    ],
    ids=["area", "projected", "moments", "smooth"],
)
@pytest.mark.parametrize("compiled", [True, False])
def test_options_of_the_plain_map(
    monkeypatch: pytest.MonkeyPatch, changes: dict[str, Any], compiled: bool
) -> None:
    if not compiled:
        plainly(monkeypatch)
    mesh, options = scene(np.linspace(0.0, 0.4, FRAMES)[:, None], 0.05), replace(PAPER, **changes)
    assert off(raw_of(mesh, options), reference_stretch(mesh, ASIDE, options, 0, FRAMES)) < 2e-3


def test_a_vertex_that_stands_for_several_counts_as_many() -> None:
    mesh = scene()
    every = np.random.default_rng(0).integers(1, 5, mesh.vertex_count)
    mesh = replace(mesh, faces=None, vertex_counts=every)
    options = replace(EXPECTED, beyond="clip")
    found = Synthesizer(mesh, options).stretch(ASIDE, 0, FRAMES)
    np.testing.assert_allclose(found.raw.sum(axis=0), 1.0)
    np.testing.assert_array_equal(found.visible_share, 1.0)
    assert off(found.raw, reference_stretch(mesh, ASIDE, options, 0, FRAMES)) < 2e-3


@pytest.mark.one_in(5)
@pytest.mark.parametrize("beyond", ["drop", "wrap", "clip"])
@pytest.mark.parametrize("visibility", ["none", "facing", "depth", "exact"])
def test_what_is_known_is_the_plain_map(visibility: Any, beyond: Any) -> None:
    options = replace(PAPER, visibility=visibility, beyond=beyond, mask_stride=3)
    options = replace(options, axis=VelocityAxis(16, 0.5), null_bins=(), weight="area")
    spread = Synthesizer(scene(0.0), options).stretch(ASIDE, 0, FRAMES)
    plain = Synthesizer(scene(0.0), replace(options, count="plain")).stretch(ASIDE, 0, FRAMES)
    np.testing.assert_allclose(spread.raw, plain.raw, rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(spread.values, plain.values, rtol=1e-5, atol=1e-9)
    np.testing.assert_array_equal(spread.visible_share, plain.visible_share)
    np.testing.assert_allclose(spread.beyond_share, plain.beyond_share, rtol=1e-6)
    assert plain.beyond_share is not None
    assert plain.beyond_share.max() > 0


def test_a_mesh_that_says_nothing_has_the_plain_map_bit_for_bit() -> None:
    mesh = replace(scene(), uncertainty=None)
    for options in (PAPER, replace(PAPER, visibility="facing", beyond="wrap")):
        spread = Synthesizer(mesh, options).map(ASIDE)
        plain = Synthesizer(mesh, replace(options, count="plain")).map(ASIDE)
        np.testing.assert_array_equal(spread.values, plain.values)
        assert spread.meta["count"] == "plain"


@settings(max_examples=12)
@given(st.integers(0, 1000), st.sampled_from(["drop", "wrap", "clip"]))
def test_no_cell_is_below_nothing_by_a_rounding(seed: int, beyond: Any) -> None:
    rng = np.random.default_rng(seed)
    place, weight = rng.uniform(10.0, 22.0, 300), rng.uniform(0.0, 1e-3, 300)
    sigma = rng.uniform(0.05, 0.5, 300)
    counting = counting_of(replace(RAW, beyond=beyond))
    shares = spread_over_bins(place, weight, sigma, counting)
    assert (shares >= 0).all()
    assert shares.sum() <= weight.sum() * (1 + 1e-9)


@pytest.mark.parametrize("visibility", ["none", "facing", "depth", "exact", "frozen"])
def test_nothing_is_lost_of_what_is_seen(visibility: Any) -> None:
    """Also of vertices in emptied bins, whose visibility the plain map does not look at."""
    maker = Synthesizer(scene(0.3), replace(PAPER, beyond="wrap", range_exponent=0.0))
    if visibility == "frozen":
        maker.map(ASIDE)
    found = maker.stretch(ASIDE, 0, FRAMES, visibility)
    other = replace(maker.options, null_bins=(), visibility="exact")
    whole = Synthesizer(scene(0.3), other).stretch(
        ASIDE, 0, FRAMES, "exact" if visibility == "frozen" else visibility
    )
    np.testing.assert_allclose(whole.raw.sum(axis=0), whole.visible_share, rtol=1e-6)
    nulled = list(PAPER.null_bins)
    assert whole.raw[nulled].sum() > 0
    assert not found.raw[nulled].any()
    kept = np.delete(np.arange(RAW.axis.bins), nulled)
    np.testing.assert_array_equal(found.raw[kept], whole.raw[kept])


def test_parts_of_the_body_add_up() -> None:
    mesh = scene()
    numbers = (np.arange(mesh.vertex_count) % 5).astype(np.uint8)
    numbers[numbers == 4] = 0
    parts = VertexParts(("a", "b", "c", "d"), numbers)
    whole = Synthesizer(mesh, PAPER).map(ASIDE)
    split = Synthesizer(mesh, PAPER).limb_maps(ASIDE, parts)
    assert split.limbs is not None
    np.testing.assert_allclose(split.values, whole.values, rtol=1e-3, atol=2e-5)
    np.testing.assert_allclose(split.limbs.values.sum(axis=0), split.values, rtol=1e-5, atol=1e-7)
    # A part's map is that of its vertices, each by the deviation of its own limb.
    only = replace(mesh, faces=None)
    options = replace(EXPECTED, time_sigma_s=0.0)
    found = Synthesizer(only, options).limb_maps(ASIDE, parts).limbs
    mine = np.flatnonzero(numbers == 2)
    assert mesh.uncertainty is not None
    alone = replace(
        only, vertices=only.read(0, FRAMES)[:, mine], uncertainty=mesh.uncertainty.of_vertices(mine)
    )
    share = len(mine) / mesh.vertex_count
    truth = share * reference_stretch(alone, ASIDE, options, 0, FRAMES)
    assert found is not None
    assert off(found.values[2], truth) < 5e-3  # limbs' places are means of fewer vertices


@pytest.mark.parametrize("visibility", ["facing", "exact"])
def test_stretches_blocks_and_threads_change_nothing(visibility: Any) -> None:
    options = replace(PAPER, visibility=visibility, mask_stride=2)
    mesh = scene()
    whole = Synthesizer(mesh, options, threads=1).stretch(ASIDE, 0, FRAMES).values
    for how in ({"threads": 2}, {"block_frames": 5}, {"memory_budget_bytes": 1, "block_frames": 4}):
        other = Synthesizer(mesh, options, **how)
        cut = [other.stretch(ASIDE, a, b).values for a, b in ((0, 7), (7, 20), (20, FRAMES))]
        np.testing.assert_allclose(np.concatenate(cut, axis=1), whole, rtol=1e-5, atol=2e-7)


def test_plain_and_expected_maps_share_their_blocks() -> None:
    mesh = scene()
    plain = Synthesizer(mesh, replace(PAPER, count="plain"))
    before = plain.map(ASIDE).values
    spread = Synthesizer(mesh, PAPER, blocks_of=plain).map(ASIDE).values
    np.testing.assert_array_equal(spread, Synthesizer(mesh, PAPER).map(ASIDE).values)
    np.testing.assert_array_equal(plain.map(ASIDE).values, before)


def test_frames_without_a_person_are_empty() -> None:
    present = np.ones(FRAMES, bool)
    present[8:12] = False
    found = Synthesizer(replace(scene(), present=present), PAPER).map(ASIDE)
    assert not found.values[:, 8:12].any()
    assert found.values[:, 7].any()
    assert found.values[:, 12].any()


def test_one_frame_and_many_need_the_same_machine_code() -> None:
    maker = Synthesizer(scene(), EXPECTED)
    for stop in (1, FRAMES):
        maker.stretch(ASIDE, 0, stop)
    kernel: Any = fine_kernel
    assert len({str(arguments[7]) for arguments in kernel.signatures}) == 1


@pytest.mark.parametrize("sigma_mps", [0.1, 0.3, 0.5])
def test_the_uncertainty_of_cells_expects_the_same(sigma_mps: float) -> None:
    options = replace(PAPER, null_bins=(), visibility="facing")
    # The map spreads less than the mesh's deviations, the cells' uncertainty by all of them.
    spread = Synthesizer(scene(sigma_mps / expected.SIGMA_FACTOR), options).map(ASIDE)
    cells = Synthesizer(scene(sigma_mps), options).uncertainty(ASIDE)
    assert off(cells.expected, spread.values) < 1e-3


def test_it_stops_when_it_is_no_longer_wanted() -> None:
    def stop(done: int, total: int) -> None:
        if done:
            raise Cancelled

    with pytest.raises(Cancelled):
        Synthesizer(scene(), PAPER, threads=1).map(ASIDE, progress=stop)


def test_vid2doppler_counts_in_one_bin() -> None:
    assert PRESETS["vid2doppler"].count == "plain"
    options = SynthesisOptions(velocity="vid2doppler")
    found = Synthesizer(scene(), options).map(ASIDE)
    plain = Synthesizer(replace(scene(), uncertainty=None), options).map(ASIDE)
    np.testing.assert_array_equal(found.values, plain.values)
    assert found.meta["count"] == found.meta["options"]["count"] == "plain"
    with pytest.raises(Sd2Error, match="vid2doppler"):
        chosen_options(Synthesis(preset="vid2doppler", count="expected"))
    with pytest.raises(Sd2Error, match="count is 'mean'"):
        replace(PRESETS["paper"], count="mean")
