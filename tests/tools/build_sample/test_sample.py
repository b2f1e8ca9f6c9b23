from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from facet_visibility import facet_visibility

from sd2core.doppler import Synthesizer
from sd2core.errors import Sd2Error
from sd2core.files.resources import resource_path
from sd2core.fmcw.processing import doppler_map
from sd2core.io.mesh import load_mesh
from sd2core.io.radar import load_capture
from sd2core.io.video import open_video
from sd2core.progress import Cancelled, Progress
from sd2core.radar_config import PAPER_RADAR
from sd2core.recording.recording import Recording, open_recording
from sd2core.sensor import VirtualSensor
from tools.build_sample.render import Camera
from tools.build_sample.sample import (
    FRAMES_PER_S,
    RECORDED,
    body_sequence,
    make_sample,
)
from tools.build_sample.swipes import DURATION_S, SPANS
from tools.bundled import main

SHORT_S = 0.2


def files(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


@pytest.fixture(scope="module")
def steps() -> list[tuple[int, int]]:
    """What ``short`` reported while it was made."""
    return []


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory, steps: list[tuple[int, int]]) -> Path:
    folder = tmp_path_factory.mktemp("sample") / "short"
    return make_sample(folder, lambda done, total: steps.append((done, total)), duration_s=SHORT_S)


@pytest.fixture(scope="module")
def bundled() -> Recording:
    return open_recording(resource_path("swipes.sd2"))


@pytest.mark.slow
def test_everything_but_the_video_is_the_same_every_time(short: Path, tmp_path: Path) -> None:
    again = files(make_sample(tmp_path / "short.sd2", duration_s=SHORT_S))
    first = files(short)
    assert first.keys() == again.keys()
    for name in first.keys() - {"video.mp4"}:
        assert first[name] == again[name], name


@pytest.mark.slow
def test_progress_rises_to_its_total(short: Path, steps: list[tuple[int, int]]) -> None:
    assert {total for _, total in steps} == {12}  # 6 frames, twice
    assert [done for done, _ in steps] == sorted(done for done, _ in steps)
    assert steps[-1] == (12, 12)


@pytest.mark.slow
def test_the_suffix_is_appended(short: Path) -> None:
    assert short.name == "short.sd2"


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.3, 0.9])
def test_a_cancelled_sample_leaves_nothing(tmp_path: Path, share: float) -> None:
    def stop(done: int, total: int) -> None:
        if done > share * total:
            raise Cancelled

    with pytest.raises(Cancelled):
        make_sample(tmp_path / "one.sd2", stop, duration_s=0.1)
    assert list(tmp_path.iterdir()) == []


def test_an_existing_folder_is_not_touched(tmp_path: Path) -> None:
    (tmp_path / "mine.sd2").mkdir()
    (tmp_path / "mine.sd2" / "notes.txt").write_text("keep")
    with pytest.raises(Sd2Error, match=r"mine\.sd2 exists"):
        make_sample(tmp_path / "mine.sd2")
    assert files(tmp_path) == {"mine.sd2/notes.txt": b"keep"}


def test_a_missing_parent_is_named(tmp_path: Path) -> None:
    with pytest.raises(Sd2Error, match="does not exist"):
        make_sample(tmp_path / "nowhere" / "x.sd2")


def test_the_command_hands_the_folder_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    asked: list[Path] = []

    def make(out: Path, progress: Progress) -> Path:
        progress(0, 2)
        asked.append(out)
        return out

    monkeypatch.setattr("tools.bundled.make_sample", make)
    assert main(["sample", str(tmp_path / "mine.sd2")]) == 0
    assert asked == [tmp_path / "mine.sd2"]
    assert str(tmp_path / "mine.sd2") in capsys.readouterr().out


def test_the_command_does_not_replace_a_sample(tmp_path: Path) -> None:
    (tmp_path / "a.sd2").mkdir()
    (tmp_path / "a.sd2" / "precious").touch()
    assert main(["sample", str(tmp_path / "a.sd2")]) == 1
    assert [path.name for path in (tmp_path / "a.sd2").iterdir()] == ["precious"]


@pytest.mark.slow
def test_gestures_that_do_not_fit_are_left_out(short: Path) -> None:
    assert open_recording(short).spans == ()


def test_hidden_facets_do_not_echo() -> None:
    """The raised hand hides part of the torso that faces the radar."""
    mesh = body_sequence("low", np.array([2.2, 2.25]), Camera())
    visible = facet_visibility(mesh, VirtualSensor())
    vertices = mesh.frame(0)
    corners = vertices[mesh.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facing = (corners.mean(axis=1) * normal).sum(axis=1) < 0
    assert not (visible[0] & ~facing).any()
    hidden = facing & ~visible[0]
    assert 0.01 < hidden.sum() / facing.sum() < 0.3


# What follows is about the files that come with the program.


def test_the_bundled_sample_is_small() -> None:
    folder = resource_path("swipes.sd2")
    # The true mesh, its video's fit, and a radar of three receivers.
    assert sum(len(content) for content in files(folder).values()) <= 13_000_000


def test_it_says_that_it_is_simulated_everywhere(bundled: Recording) -> None:
    assert bundled.simulated
    assert bundled.radar is not None
    assert load_capture(bundled.radar).simulated
    meta = json.loads((bundled.radar / "meta.json").read_text("utf-8"))
    assert meta["simulated"] is True
    assert bundled.missing() == {}


def test_video_mesh_and_radar_share_one_clock(bundled: Recording) -> None:
    assert bundled.video is not None
    assert bundled.mesh is not None
    assert bundled.radar is not None
    expected = np.arange(round(DURATION_S * FRAMES_PER_S)) / FRAMES_PER_S
    with open_video(bundled.video) as video:
        assert (video.width, video.height) == (640, 480)
        assert video.notes == ()
        np.testing.assert_allclose(video.timebase.times_s, expected, atol=1e-6)
    mesh, capture = load_mesh(bundled.mesh), load_capture(bundled.radar)
    assert mesh.notes == ()
    np.testing.assert_allclose(mesh.times_s, expected, atol=1e-9)
    np.testing.assert_allclose(capture.timebase.times_s, expected, atol=1e-6)
    assert bundled.radar_offset_s == 0.0
    assert capture.config == replace(PAPER_RADAR, receivers=3)
    assert bundled.spans == SPANS


def test_the_true_mesh_is_the_motion_and_that_of_the_recording_its_fit(bundled: Recording) -> None:
    assert bundled.mesh == bundled.folder / "fit.zarr"
    frames = [0, 66, 300]
    exact = body_sequence(RECORDED, np.array(frames) / FRAMES_PER_S, Camera())
    stored = load_mesh(bundled.folder / "mesh.zarr")
    np.testing.assert_array_equal(stored.faces, exact.faces)
    for row, frame in enumerate(frames):
        assert np.abs(stored.frame(frame) - exact.frame(row)).max() < 3.2e-5
    fit = load_mesh(bundled.mesh)
    assert fit.uncertainty is not None
    assert stored.uncertainty is None
    np.testing.assert_array_equal(fit.faces, stored.faces)
    apart = np.linalg.norm(fit.frame(66) - stored.frame(66), axis=1)
    assert 0.005 < np.median(apart) < 0.06


def test_the_mesh_lies_on_the_person_in_the_video(bundled: Recording) -> None:
    """Projected hand vertices fall on pixels that differ from the empty wall."""
    assert bundled.video is not None
    assert bundled.mesh is not None
    mesh = load_mesh(bundled.mesh)
    frame = round(2.2 * FRAMES_PER_S)
    with open_video(bundled.video) as video:
        picture, before = video.read(frame).astype(int), video.read(0).astype(int)
    pixels = Camera().project(mesh.frame(frame).astype(float))
    raised = (pixels[:, 1] < 160) & (pixels[:, 0] < 260)
    assert raised.sum() > 100
    columns, rows = pixels[raised].astype(int).T
    changed = np.abs(picture - before).sum(axis=2)[rows, columns] > 40
    assert changed.mean() > 0.9


@pytest.mark.parametrize(("index", "approaching"), [(2, True), (3, False), (4, True), (5, False)])
def test_the_radar_sees_which_way_the_hand_goes(
    bundled: Recording, index: int, approaching: bool
) -> None:
    """Power beyond the torso's own velocities is on the hand's side."""
    assert bundled.radar is not None
    capture = load_capture(bundled.radar)
    spectrum = doppler_map(capture, bins=32, v_max_mps=2.0, clutter="mean")
    span = bundled.spans[index]
    assert span.label == ("up-to-down" if approaching else "down-to-up")
    frames = slice(*capture.timebase.frames_between(span.start_s, span.end_s))
    velocity = spectrum.axis.centres_mps
    fast = spectrum.values[np.abs(velocity) > 0.4, frames].sum(axis=1)
    ahead = fast[velocity[np.abs(velocity) > 0.4] > 0].sum() / fast.sum()
    assert (ahead > 0.75) if approaching else (ahead < 0.25)


def test_mesh_and_radar_tell_the_same_motion(bundled: Recording) -> None:
    """Mean velocities of the counted mesh and of the radar agree best without any lag."""
    assert bundled.mesh is not None
    assert bundled.radar is not None
    synthesizer = Synthesizer(load_mesh(bundled.mesh), "paper")
    counted = synthesizer.map(VirtualSensor(), visibility="facing")
    seen = doppler_map(load_capture(bundled.radar), axis=counted.axis, clutter="mean")
    noise = 4.0 * np.median(seen.values[:8])
    means = []
    for values in (counted.values, np.maximum(seen.values - noise, 0.0)):
        moving = values.astype(np.float64)
        moving[list(counted.null_bins)] = 0.0
        means.append(counted.axis.centres_mps @ moving / np.maximum(moving.sum(axis=0), 1e-12))
    inner = slice(10, -10)
    correlation = {
        lag: np.corrcoef(means[0][inner], np.roll(means[1], -lag)[inner])[0, 1]
        for lag in range(-4, 5)
    }
    assert max(correlation, key=lambda lag: correlation[lag]) == 0
    assert correlation[0] > 0.8
