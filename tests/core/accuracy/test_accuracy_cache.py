"""Measurements are kept per clip, and stale when scene or machine are others."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from accuracy_scenes import ball, swinging

from sd2core.accuracy import cache
from sd2core.accuracy.cache import (
    cached_measurement,
    scene_fingerprint,
    store_measurement,
    this_machine,
)
from sd2core.accuracy.plans import AccuracyPlan, reference_plan
from sd2core.accuracy.results import Cost, Errors, Machine, Measurement, PlanResult, Spread
from sd2core.doppler import PRESETS
from sd2core.mesh.sequence import MeshSequence
from sd2core.sensor import VirtualSensor

CAMERA, PAPER = VirtualSensor(), PRESETS["paper"]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr("platformdirs.user_cache_dir", lambda *_, **__: str(tmp_path))
    return tmp_path


@pytest.fixture
def mesh() -> MeshSequence:
    return ball(swinging((0, 0, 3), 1.0, 0.5), fineness=1)


def result(plan: AccuracyPlan, cost_ms: float, error: float) -> PlanResult:
    some = Spread(0.1, 0.2)
    errors = Errors(error, 2 * error, some, some, some, some, some, 60)
    return PlanResult(plan, errors, Cost(some, Spread(cost_ms, cost_ms), 1000, 0.5))


def measured(mesh: MeshSequence) -> Measurement:
    return Measurement(
        "histogram",
        reference_plan("histogram"),
        (
            result(AccuracyPlan(visibility="none"), 0.01, 0.9),
            result(AccuracyPlan(visibility="facing"), 0.02, 0.1),
            result(AccuracyPlan(visibility="depth"), 0.5, 0.2),
            result(AccuracyPlan(), 1.0, 0.0),
        ),
        scene_fingerprint(mesh, CAMERA, PAPER, "histogram"),
        this_machine(),
        (1, 2, 3),
        "ball",
        ((4, 0.1), (16, 0.01)),
    )


def test_what_was_remembered_comes_back(mesh: MeshSequence) -> None:
    assert cached_measurement(mesh, CAMERA, PAPER) is None
    store_measurement(mesh, measured(mesh))
    found = cached_measurement(mesh, CAMERA, PAPER)
    assert found == measured(mesh)
    assert found is not None
    assert not found.stale
    assert cached_measurement(mesh, CAMERA, PAPER, "fmcw") is None


def test_another_place_or_option_makes_it_stale(mesh: MeshSequence) -> None:
    store_measurement(mesh, measured(mesh))
    for sensor, options in (
        (VirtualSensor((1.0, 0.0, 0.0)), PAPER),
        (CAMERA, replace(PAPER, null_bins=())),
    ):
        found = cached_measurement(mesh, sensor, options)
        assert found is not None
        assert found.stale


def test_other_code_makes_it_stale(mesh: MeshSequence, monkeypatch: pytest.MonkeyPatch) -> None:
    store_measurement(mesh, measured(mesh))
    monkeypatch.setattr(cache, "code_digest", lambda step: "mended")
    found = cached_measurement(mesh, CAMERA, PAPER)
    assert found is not None
    assert found.stale


def test_another_machine_makes_it_stale(
    mesh: MeshSequence, monkeypatch: pytest.MonkeyPatch
) -> None:
    store_measurement(mesh, measured(mesh))
    monkeypatch.setattr(cache, "this_machine", lambda: Machine("abacus", 10, "0"))
    found = cached_measurement(mesh, CAMERA, PAPER)
    assert found is not None
    assert found.stale


def test_another_mesh_has_a_memory_of_its_own(mesh: MeshSequence) -> None:
    store_measurement(mesh, measured(mesh))
    vertices = mesh.read(0, mesh.frame_count) + np.float32(0.1)
    assert cached_measurement(replace(mesh, vertices=vertices), CAMERA, PAPER) is None


def test_a_mesh_mended_in_a_measured_frame_makes_it_stale(mesh: MeshSequence) -> None:
    """The frames by which a clip is known stay as they are."""
    store_measurement(mesh, measured(mesh))
    vertices = mesh.read(0, mesh.frame_count).copy()
    vertices[2] += np.float32(0.1)
    found = cached_measurement(replace(mesh, vertices=vertices), CAMERA, PAPER)
    assert found is not None
    assert found.stale


@pytest.mark.parametrize("damage", ["", "{", "[]", '{"format": 99}'])
def test_what_cannot_be_read_is_measured_again(
    mesh: MeshSequence, folder: Path, damage: str
) -> None:
    store_measurement(mesh, measured(mesh))
    (path,) = folder.rglob("*.json")
    path.write_text(damage)
    assert cached_measurement(mesh, CAMERA, PAPER) is None


def test_a_file_lacks_nothing(mesh: MeshSequence, folder: Path) -> None:
    store_measurement(mesh, measured(mesh))
    (path,) = folder.rglob("*.json")
    content = json.loads(path.read_text())
    del content["results"][0]["errors"]["l1"]
    path.write_text(json.dumps(content))
    assert cached_measurement(mesh, CAMERA, PAPER) is None


@pytest.mark.parametrize("wrong", ["x", None, [], {"median": "x", "p95": 0.1}, {"median": 0.1}])
def test_figures_are_numbers(mesh: MeshSequence, folder: Path, wrong: object) -> None:
    store_measurement(mesh, measured(mesh))
    (path,) = folder.rglob("*.json")
    content = json.loads(path.read_text())
    for damaged in (
        content | {"results": [content["results"][0] | {"cost": wrong}]},
        content
        | {
            "results": [
                content["results"][0]
                | {"errors": content["results"][0]["errors"] | {"peak_mps": wrong}}
            ]
        },
    ):
        path.write_text(json.dumps(damaged))
        assert cached_measurement(mesh, CAMERA, PAPER) is None


def test_a_thinned_mesh_counted_otherwise_is_another_clip(mesh: MeshSequence) -> None:
    counts = np.ones(mesh.vertex_count, np.int64)
    store_measurement(replace(mesh, vertex_counts=counts), measured(mesh))
    assert cached_measurement(replace(mesh, vertex_counts=2 * counts), CAMERA, PAPER) is None


def test_where_nothing_can_be_written_nothing_is_kept(
    mesh: MeshSequence, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (folder / "file").write_text("")
    monkeypatch.setattr("platformdirs.user_cache_dir", lambda *_, **__: str(folder / "file"))
    store_measurement(mesh, measured(mesh))
    assert cached_measurement(mesh, CAMERA, PAPER) is None


def test_the_front_has_only_what_nothing_beats(mesh: MeshSequence) -> None:
    front = measured(mesh).front
    assert [entry.plan.visibility for entry in front] == ["none", "facing", "exact"]
