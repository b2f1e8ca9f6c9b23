"""What is counted, and how much."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from doppler_scenes import CAMERA, RAW, moving, options, plate, sensor_at, wobbling
from oracles.counting import relative_range
from oracles.plain_maps import plainly
from oracles.surfaces import vertex_area_vectors, vertex_areas

from sd2core.doppler import PRESETS, SynthesisOptions, Synthesizer, synthesizer
from sd2core.doppler.masks import VisibilityMasks
from sd2core.errors import Sd2Error
from sd2core.mesh.sequence import MeshSequence
from sd2core.progress import Cancelled
from sd2core.scattering.amplitude import projected_areas, range_weight
from sd2core.scattering.velocity import radial_velocity
from sd2core.sensor import VelocityAxis, VirtualSensor

SENSOR = sensor_at(0.3, -0.2, 0.1)


def restated(mesh: MeshSequence, chosen: SynthesisOptions, sensor: VirtualSensor) -> np.ndarray:
    """The histogram before smoothing, by ``np.histogram``, in double precision."""
    maker = Synthesizer(mesh, chosen)
    edges = chosen.axis.edges_mps
    values = np.zeros((chosen.axis.bins, mesh.frame_count))
    for index in range(mesh.frame_count):
        frame = maker.frame(sensor, index)
        velocity = frame.velocity_mps.astype(float)
        if chosen.beyond == "clip":
            velocity = np.clip(velocity, edges[0], edges[-1])
        elif chosen.beyond == "wrap":
            velocity = (velocity - edges[0]) % (edges[-1] - edges[0]) + edges[0]
        weight = np.ones(len(velocity))
        total = weight.sum()
        if chosen.weight != "count":
            points = np.ascontiguousarray(mesh.frame(index).T[None])
            weight = vertex_areas(points, mesh.faces)[0].astype(float)
            total = weight.sum()
        if chosen.weight == "projected":
            vectors = vertex_area_vectors(points, mesh.faces)[0]
            weight = projected_areas(points[0], vectors, np.asarray(sensor.position_m))
        weight = weight * range_weight(
            frame.range_m, chosen.range_exponent, chosen.reference_range_m
        )
        seen = frame.visible
        values[:, index] = np.histogram(velocity[seen], edges, weights=weight[seen])[0] / total
    values[list(chosen.null_bins)] = 0
    return values


@pytest.mark.one_in(5)
@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"visibility": "facing"},
        {"visibility": "none", "beyond": "clip"},
        {"beyond": "wrap", "axis": VelocityAxis(20, 0.7)},
        {"beyond": "clip", "axis": VelocityAxis(7, 0.5), "null_bins": (3,)},
        {"weight": "area"},
        {"weight": "area", "range_exponent": 4.0, "visibility": "none"},
        {"weight": "projected"},
        {"weight": "projected", "range_exponent": 4.0, "visibility": "none"},
        {"range_exponent": 4.0},
        {"range_exponent": 3.0},
        {"range_exponent": 2.5, "reference_range_m": 1.0},
        {"range_exponent": 6.0},
        {"range_exponent": 1.0},
        {"axis": VelocityAxis(254, 3.0)},
        {"axis": VelocityAxis(2, 1.0)},
    ],
    ids=str,
)
def test_against_numpy(changes: dict[str, Any]) -> None:
    mesh, chosen = wobbling(16), options(**changes)
    values = Synthesizer(mesh, chosen).map(SENSOR).values
    expected = restated(mesh, chosen, SENSOR)
    # Single precision may move a vertex across the edge between two bins.
    difference = np.abs(values - expected)
    one_vertex = expected.sum(axis=0).max() / mesh.vertex_count * 8
    assert difference.max() <= one_vertex
    assert (difference > 1e-5 * expected.max()).mean() < 0.01


def test_maps_wait_for_the_kernels_and_can_be_cancelled_meanwhile(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def compiling(check: Any) -> None:
        check()
        pytest.fail("it goes on")

    def cancel(done: int, total: int) -> None:
        assert done == 0 < total
        raise Cancelled

    maker = Synthesizer(wobbling(10), options())
    monkeypatch.setattr(synthesizer, "await_kernels", compiling)
    for work in (maker.map, maker.prepare):
        with pytest.raises(Cancelled):
            work(progress=cancel)


@pytest.mark.one_in(5)
@pytest.mark.parametrize("visibility", ["none", "facing", "exact"])
@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"weight": "area", "range_exponent": 4.0},
        {"weight": "projected"},
        {"weight": "projected", "range_exponent": 4.0},
        {"oversampling": 3, "null_bins": (15, 16)},
        {"oversampling": 4},
    ],
    ids=str,
)
def test_plain_form_gives_the_same(
    visibility: Any, changes: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    mesh = wobbling(10)
    chosen = options(visibility=visibility, **changes)
    compiled = Synthesizer(mesh, chosen).stretch(SENSOR, 0, 10)
    plainly(monkeypatch)
    plain = Synthesizer(mesh, chosen).stretch(SENSOR, 0, 10)
    np.testing.assert_allclose(plain.visible_share, compiled.visible_share, atol=1e-6)
    # Fused multiplication rounds once instead of twice: an edge case in the literal
    # sense. At the axis's end it may move one vertex at one of a frame's moments.
    seen = compiled.visible_share * mesh.vertex_count * chosen.oversampling
    assert (np.abs(plain.beyond_share - compiled.beyond_share) * seen).max() < 1.01
    scale = compiled.values.max()
    different = np.abs(plain.values - compiled.values) > 1e-5 * scale
    assert different.sum() <= 4
    assert np.abs(plain.values - compiled.values).max() <= 4 * scale / mesh.vertex_count * 8


@pytest.mark.parametrize("preset", ["paper", "vid2doppler"])
@pytest.mark.parametrize("beyond", ["drop", "wrap", "clip"])
def test_testing_only_what_matters_changes_nothing(
    preset: str, beyond: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    mesh = wobbling(24)
    chosen = replace(PRESETS[preset], beyond=beyond, axis=VelocityAxis(32, 0.8))
    sparing = Synthesizer(mesh, chosen)
    tested: list[float] = []
    original = VisibilityMasks._needed

    def spy(self: VisibilityMasks, *arguments: Any) -> Any:
        needed = original(self, *arguments)
        tested.append(needed.mean())
        return needed

    monkeypatch.setattr(VisibilityMasks, "_needed", spy)
    values = sparing.map(SENSOR).values
    assert 0 < np.mean(tested) < 0.99
    monkeypatch.setattr(
        VisibilityMasks,
        "_needed",
        lambda self, *arguments: np.ones_like(original(self, *arguments)),
    )
    np.testing.assert_array_equal(Synthesizer(mesh, chosen).map(SENSOR).values, values)


def test_a_still_frame_needs_no_test(monkeypatch: pytest.MonkeyPatch) -> None:
    vertices, faces = plate()
    mesh = moving(vertices, faces, np.tile([0.0, 0.0, 2.0], (5, 1)), np.arange(5) / 30)
    needed: list[int] = []
    original = VisibilityMasks._needed

    def spy(self: VisibilityMasks, *arguments: Any) -> Any:
        marks = original(self, *arguments)
        needed.append(int(marks.sum()))
        return marks

    monkeypatch.setattr(VisibilityMasks, "_needed", spy)
    assert not Synthesizer(mesh).map(CAMERA).values.any()
    assert needed
    assert not any(needed)


def test_what_is_beyond_the_axis_is_reported() -> None:
    times = np.arange(10) / 30
    vertices, faces = plate(0.1)
    path = np.stack([0 * times, 0 * times, 6 - 2.45 * times], axis=1)
    mesh = moving(vertices, faces, path, times)
    for beyond, home in (("drop", None), ("clip", 31), ("wrap", RAW.axis.bin_of(2.45 - 4.0))):
        made = Synthesizer(mesh, options(beyond=beyond)).map(CAMERA)
        np.testing.assert_allclose(made.meta["beyond_share"], 1.0)
        np.testing.assert_allclose(made.values.sum(axis=0), 0.0 if home is None else 1.0)
        if home is not None:
            np.testing.assert_allclose(made.values[home], 1.0)


def test_moving_the_sensor_away_follows_the_range_law() -> None:
    mesh = wobbling(6)
    near = Synthesizer(mesh, options(range_exponent=4.0, visibility="none", beyond="clip"))
    power = [near.map(sensor_at(0, 0, -d)).values.sum() for d in (100.0, 200.0)]
    assert power[0] / power[1] == pytest.approx(16, rel=0.1)


def test_meta_tells_where_a_map_comes_from() -> None:
    made = Synthesizer(wobbling(6)).map(SENSOR, visibility="facing")
    assert made.kind == "synthetic"
    assert made.meta["sensor"]["position_m"] == SENSOR.position_m
    assert made.meta["options"]["null_bins"] == (14, 15, 16)
    assert made.meta["visibility"] == "facing"
    assert made.meta["source"] == "wobble"
    assert made.meta["version"]
    assert len(made.meta["visible_share"]) == len(made.meta["beyond_share"]) == 6
    assert 0.2 < np.mean(made.meta["visible_share"]) < 0.6
    assert made.null_bins == (14, 15, 16)
    assert made.unit == "share of vertices × (2.2 m / R)^4"


def test_part_of_the_frames() -> None:
    maker = Synthesizer(wobbling(20))
    whole, part = maker.map(SENSOR), maker.map(SENSOR, frames=(5, 11))
    np.testing.assert_array_equal(part.values, whole.values[:, 5:11])
    np.testing.assert_array_equal(part.times_s, whole.times_s[5:11])
    with pytest.raises(IndexError, match="frames 5 to 21 of 20"):
        maker.map(SENSOR, frames=(5, 21))


def test_nulled_bins_after_smoothing() -> None:
    mesh = wobbling(12)
    paper = Synthesizer(mesh).map(SENSOR).values
    assert not paper[[14, 15, 16]].any()
    assert paper[[13, 17]].any()
    blurred = Synthesizer(mesh, "vid2doppler").map(SENSOR).values
    assert blurred[[14, 15, 16]].any()


@pytest.mark.parametrize("preset", list(PRESETS))
def test_a_point_cloud_takes_visibility_none_only(preset: str) -> None:
    mesh = wobbling(6)
    cloud = MeshSequence(mesh.vertices, None, mesh.timebase, "cloud.npz")
    maker = Synthesizer(cloud, preset)
    np.testing.assert_array_equal(
        maker.map(SENSOR, visibility="none").values,
        Synthesizer(mesh, preset).map(SENSOR, visibility="none").values,
    )
    assert maker.frame(SENSOR, 2, "none").visible.all()
    for visibility in (None, "facing", "exact", "frozen"):
        with pytest.raises(Sd2Error, match=r"cloud\.npz has no faces"):
            maker.map(SENSOR, visibility=visibility)  # type: ignore[arg-type]
    for weight in ("area", "projected"):
        with pytest.raises(Sd2Error, match="Area weighting"):
            Synthesizer(cloud, replace(PRESETS[preset], weight=weight))  # type: ignore[arg-type]


@pytest.mark.parametrize("distance_m", [0.0, 0.3, 2.2, 300.0, 1e6])
def test_the_change_of_range_keeps_its_digits(distance_m: float) -> None:
    random = np.random.default_rng(4)
    before = random.uniform(-1, 1, (3, 5000)).astype(np.float32)
    after = (before + random.normal(scale=0.03, size=before.shape)).astype(np.float32)
    sensor = np.float32(distance_m) * np.array([0.48, 0.6, -0.64])
    sensor = sensor.astype(np.float32).astype(np.float64)
    truth = radial_velocity(before.astype(float), after.astype(float), sensor, 1 / 15)
    closer = relative_range(before, sensor) - relative_range(after, sensor)
    assert closer.dtype == np.float32
    error = np.abs(closer * 15 - truth)
    assert error.max() <= 1e-5
    still = relative_range(before, sensor) - relative_range(before, sensor)
    assert not still.any()
