"""Movements as they were not recorded: seen from elsewhere, by other bodies, in a mirror."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scenes_of_people import scene
from swinging_recordings import recording

from sd2core.body.model import Body
from sd2core.doppler import PRESETS, Synthesizer
from sd2core.errors import Sd2Error
from sd2core.io.mesh import save_mesh
from sd2core.mesh.bodies import Body as Placed
from sd2core.mesh.sequence import MeshSequence
from sd2core.mocap.recording_pairs import make_recording_pairs
from sd2core.pairs.rows import UNKNOWN
from sd2core.pairs.store import PairSet, read_pairs
from sd2core.pairs.summary import TakeKey
from sd2core.recording.recording import Recording, Span
from sd2core.sensor import VirtualSensor
from sd2core.simulate.variants import (
    VariantOptions,
    _Movement,
    mirrored_label,
    varied,
    vary_recordings,
)
from sd2core.timebase import Timebase

PAPER = PRESETS["paper"]


def swaying(folder: Path, frames: int = 45) -> Recording:
    """The bundled body before the camera, swaying towards a sensor at its right."""
    folder.mkdir()
    body, times_s = Body.load("low"), np.arange(frames) / 30.0
    place_m = np.zeros((frames, 3))
    place_m[:, 0] = 0.15 * np.sin(4.0 * times_s)
    place_m[:, 1:] = 1.0, 2.5
    vertices = (body.vertices_m + place_m[:, None]).astype(np.float32)
    save_mesh(MeshSequence(vertices, body.faces, Timebase(times_s)), folder / "mesh.npz")
    made = Recording.create(
        folder, mesh=folder / "mesh.npz", spans=(Span(start_s=0.5, end_s=1.0, label="left-arm"),)
    )
    made.sensor = VirtualSensor(position_m=(1.5, 0.0, 0.0))
    made.save()
    return made


def means(pairs: PairSet, values: np.ndarray) -> np.ndarray:
    """Mean velocity of every frame with energy, else 0."""
    centres = 0.5 * (pairs.axis.edges_mps[1:] + pairs.axis.edges_mps[:-1])
    return np.asarray(values @ centres / np.maximum(values.sum(axis=1), 1e-9))


def vary(one: Recording, out: Path, variant, seed: int = 0) -> PairSet:
    return vary_recordings([one.folder], out, VariantOptions(variant, PAPER, seed=seed))


def test_a_mirrored_movement_goes_the_other_way(tmp_path: Path) -> None:
    one = swaying(tmp_path / "anna.sd2")
    pairs = vary(one, tmp_path / "mirrored.zarr", "mirrored")
    (take,) = pairs.takes
    assert (pairs.kind, take.subject, take.name) == ("simulated", "anna", "anna-000")
    assert pairs.labels == ("background", "left-arm", "right-arm")
    assert np.flatnonzero(take.label == 2).tolist() == list(range(15, 30))
    assert take.sensor_position_m[0] == pytest.approx(-1.5, abs=0.3)
    # Who sways towards a sensor on one side sways away from one on the other.
    seen = Synthesizer(one.load_mesh(), PAPER).map(one.sensor).values.T
    own, other = means(pairs, seen), means(pairs, take.synthetic)
    fast = np.abs(np.cos(4.0 * take.times_s)) > 0.6
    assert (own[fast] * other[fast] < 0.0).all()
    # The simulated radar sees the same.
    assert np.corrcoef(means(pairs, take.radar)[fast], other[fast])[0, 1] > 0.95


def test_simulated_pairs_of_a_scene_have_the_labels_of_recorded_ones(tmp_path: Path) -> None:
    one, out = scene(tmp_path / "duo.sd2"), tmp_path / "recorded.zarr"
    assert one.labels is not None
    suggested = replace(one.labels.spans[0], id=9, label="nod", origin="suggestion")
    one.labels = one.labels.with_spans([suggested])
    one.save()
    make_recording_pairs([one.folder], out)
    recorded, made = read_pairs(out), vary(one, tmp_path / "places.zarr", "places")
    assert made.labels == recorded.labels
    np.testing.assert_array_equal(made.takes[0].label, recorded.takes[0].label)
    assert (made.takes[0].label == UNKNOWN).sum() == 15
    assert made.provenance["scenes"] == recorded.provenance["scenes"]


def test_nobody_who_moves_is_refused_before_there_is_a_store(tmp_path: Path) -> None:
    one = swaying(tmp_path / "anna.sd2", frames=20)
    with pytest.raises(Sd2Error, match="No recording shows anybody for a second on end"):
        vary(one, tmp_path / "made.zarr", "places")
    assert not (tmp_path / "made.zarr").exists()


def test_pairs_of_a_scene_are_split_by_everybodys_limbs(tmp_path: Path) -> None:
    one = swaying(tmp_path / "duo.sd2", frames=35)
    one.subject, one.bodies = "Anna", (Placed(str(one.mesh), (1.0, 0.0, 0.5), person="Bert"),)
    one.save()
    options = VariantOptions("places", PAPER, limbs=True)
    (take,) = vary_recordings([one.folder], tmp_path / "places.zarr", options).takes
    assert take.limbs is not None
    assert take.limbs.persons == ("Anna", "Bert")
    np.testing.assert_allclose(take.limbs.values.sum(axis=0).T, take.synthetic, atol=1e-5)


@pytest.mark.slow
def test_places_and_shapes_are_drawn_and_drawn_alike_again(tmp_path: Path) -> None:
    one = swaying(tmp_path / "anna.sd2", frames=40)
    (own,) = vary(one, tmp_path / "places.zarr", "places").takes
    (again,) = vary(one, tmp_path / "again.zarr", "places").takes
    (other,) = vary(one, tmp_path / "other.zarr", "places", seed=1).takes
    assert np.array_equal(own.synthetic, again.synthetic)
    assert np.array_equal(own.radar, again.radar)
    assert not np.allclose(own.sensor_position_m, other.sensor_position_m)
    middle_m = np.asarray(one.load_mesh().read(0, 40), np.float64).mean(axis=(0, 1))
    far_m = np.linalg.norm(np.array([1.5, 0.0, 0.0]) - middle_m)
    for take in (own, other):
        assert 0.8 <= np.linalg.norm(take.sensor_position_m - middle_m) / far_m <= 1.25
    (shaped,) = vary(one, tmp_path / "shapes.zarr", "shapes").takes
    assert shaped.sensor_position_m.tolist() == [1.5, 0.0, 0.0]
    assert not np.allclose(shaped.synthetic, own.synthetic)


def test_everybody_of_a_scene_is_of_another_shape(tmp_path: Path) -> None:
    mesh = swaying(tmp_path / "anna.sd2", frames=12).load_mesh()
    scene = replace(mesh, others=(replace(mesh, vertices=mesh.read(0, 12) + np.float32(1)),))
    movement = _Movement(
        TakeKey("anna", "anna-000", 0), scene, (0.0, 0.0, 0.0), ["background"] * 12
    )
    made = varied(movement, "shapes", np.random.default_rng(0)).mesh
    for before, after in zip(scene.bodies, made.bodies, strict=True):
        heights_m = [np.ptp(one.frame(0)[:, 1]) for one in (before, after)]
        assert abs(heights_m[1] / heights_m[0] - 1) > 0.01


def test_what_is_there_is_not_made_again(tmp_path: Path, monkeypatch) -> None:
    one = swaying(tmp_path / "anna.sd2", frames=40)
    vary(one, tmp_path / "made.zarr", "places")
    monkeypatch.setattr("sd2core.simulate.variants.radar_target", None)
    assert len(vary(one, tmp_path / "made.zarr", "places").takes) == 1
    with pytest.raises(Sd2Error, match="seed"):
        vary(one, tmp_path / "made.zarr", "places", seed=3)
    assert len(read_pairs(tmp_path / "made.zarr").takes) == 1


def test_a_movement_whose_frames_were_lost_is_at_an_even_rate(tmp_path: Path) -> None:
    one = swaying(tmp_path / "anna.sd2")
    (whole,) = vary(one, tmp_path / "whole.zarr", "mirrored").takes
    mesh = one.load_mesh()
    kept = np.flatnonzero(np.arange(mesh.frame_count) % 5 != 3)
    fewer = replace(mesh, vertices=mesh.vertices[kept], timebase=Timebase(mesh.times_s[kept]))
    save_mesh(fewer, one.folder / "mesh.npz")
    pairs = vary(one, tmp_path / "fewer.zarr", "mirrored")
    (take,) = pairs.takes
    np.testing.assert_allclose(take.times_s, whole.times_s, atol=1e-6)
    assert np.array_equal(take.label, whole.label)
    assert take.radar.shape == take.synthetic.shape == whole.radar.shape
    for name in ("synthetic", "radar"):
        both = means(pairs, getattr(take, name)), means(pairs, getattr(whole, name))
        assert np.corrcoef(*both)[0, 1] > 0.95
    # What was made of the mesh before is not taken for what this one would give.
    with pytest.raises(Sd2Error, match="movements"):
        vary(one, tmp_path / "whole.zarr", "mirrored")


def test_what_cannot_be_varied_is_refused(tmp_path: Path) -> None:
    folder = recording(tmp_path / "ball.sd2").folder
    with pytest.raises(Sd2Error, match="another surface than the bundled body"):
        vary_recordings([folder], tmp_path / "a.zarr", VariantOptions("shapes", PAPER))
    bare = recording(tmp_path / "bare.sd2")
    bare.mesh = None
    bare.save()
    with pytest.raises(Sd2Error, match="has no mesh"):
        vary_recordings([bare.folder], tmp_path / "b.zarr", VariantOptions("places", PAPER))


def test_left_and_right_change_places_in_labels() -> None:
    assert [mirrored_label(one) for one in ("left-to-right", "up", "arm_left")] == [
        "right-to-left",
        "up",
        "arm_right",
    ]
    assert mirrored_label("Left to right, LEFT") == "Right to left, RIGHT"
    assert [mirrored_label(one) for one in ("bright", "upright")] == ["bright", "upright"]
