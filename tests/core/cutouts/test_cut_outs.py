"""Spans cut out: the very frames, each folder whole or not there, nothing replaced unasked."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sd2core.cutouts.cutting import cut_out, plan_cuts, without_frame
from sd2core.cutouts.source import CutSource, folder_name
from sd2core.errors import Sd2Error
from sd2core.io.mesh import load_mesh
from sd2core.io.video import open_video
from sd2core.io.video_writing import write_video
from sd2core.labels.spans import Span
from sd2core.maps import DopplerMap
from sd2core.mesh.sequence import MeshSequence
from sd2core.progress import Cancelled
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase

# Frames of a phone: now 30, now 40 ms apart.
TIMES_S = np.cumsum([0.0] + [0.03, 0.04] * 20)[:40]
CLOCK = Timebase(TIMES_S)
WAVE = Span(1, "Gestures", float(TIMES_S[5]), float(TIMES_S[15]), "wave", note='a, "b"')
PUSH = Span(7, "Gestures", float(TIMES_S[20]), float(TIMES_S[30]), "push / pull")


@pytest.fixture(scope="module")
def video(tmp_path_factory) -> Path:
    """Odd-sized pictures whose brightness is the frame number."""
    path = tmp_path_factory.mktemp("video") / "video.mp4"
    pictures = (np.full((48, 64, 3), 20 + 5 * k, np.uint8) for k in range(40))
    write_video(path, pictures, 30, (64, 48), times_s=TIMES_S, crf=5)
    return path


@pytest.fixture
def source(video) -> CutSource:
    vertices = np.arange(40 * 4 * 3, dtype=np.float32).reshape(40, 4, 3)
    mesh = MeshSequence(vertices, np.array([[0, 1, 2]], np.int32), CLOCK)
    values = np.arange(8 * 40, dtype=np.float32).reshape(8, 40)
    shares = {"visible_share": [k / 100 for k in range(40)], "beyond_share": [0.0] * 40}
    meta = {"source": "walk.npz", **shares, "input": shares}
    doppler = DopplerMap(values, VelocityAxis(8, 2.0), CLOCK, "synthetic", unit="share", meta=meta)
    return CutSource("walk", True, CLOCK, video, mesh, {"synthetic": doppler}, (0.0, 0.0, 0.0))


def cut(source, folder, *spans, **how) -> list[Path]:
    return cut_out(source, plan_cuts(source, spans, folder), folder, **how)


def test_the_very_frames_with_0_s_at_the_first(source, tmp_path) -> None:
    (path,) = cut(source, tmp_path, WAVE)
    assert path.name == folder_name(WAVE) == "00000.170s_wave_1"
    with open_video(path / "video.mp4") as clip:
        assert (clip.width, clip.height) == (64, 48)
        np.testing.assert_allclose(clip.timebase.times_s, TIMES_S[5:15] - TIMES_S[5], atol=2e-5)
        shown = [float(picture.mean()) for picture in clip.frames()]
    np.testing.assert_allclose(shown, [20 + 5 * k for k in range(5, 15)], atol=2.0)
    mesh = load_mesh(path / "mesh.zarr")
    np.testing.assert_array_equal(mesh.read(0, 10), source.mesh.read(5, 15))
    doppler = DopplerMap.load(path / "synthetic.npz")
    np.testing.assert_array_equal(doppler.values, source.maps["synthetic"].values[:, 5:15])
    assert doppler.unit == "share"
    assert doppler.meta["cut_out"]["label"] == "wave"
    for about in (doppler.meta, doppler.meta["input"]):
        assert about["visible_share"] == [k / 100 for k in range(5, 15)]
    for part in (mesh, doppler):
        np.testing.assert_allclose(part.timebase.times_s, TIMES_S[5:15] - TIMES_S[5], atol=1e-9)
    said = json.loads((path / "span.json").read_text("utf-8"))
    assert said["frames"] == {"first": 5, "last": 14, "count": 10}
    assert said["zero_s"] == WAVE.start_s
    assert said["files"] == ["video.mp4", "mesh.zarr", "synthetic.npz"]
    assert said["simulated"] is True
    # A number per frame of the whole recording would make the file too long to be read again.
    assert said["sources"]["maps"]["synthetic"]["provenance"] == {"source": "walk.npz", "input": {}}


def test_the_mesh_is_of_whom_the_span_names(source, tmp_path) -> None:
    moved = replace(source.mesh, vertices=source.mesh.read(0, 40) + 1, source="bert.npz")
    scene = replace(source.mesh, person="anna", others=(replace(moved, person="bert"),))
    duo = replace(source, mesh=scene, video=None, maps={})
    for number, name in enumerate(("anna", "bert", "carl", "")):
        (path,) = cut(duo, tmp_path, replace(WAVE, id=number + 1, person=name))
        found = load_mesh(path / "mesh.zarr").read(0, 10) - source.mesh.read(5, 15)
        np.testing.assert_array_equal(found, float(name == "bert"))
        said = json.loads((path / "span.json").read_text("utf-8"))
        assert (said["sources"]["mesh"] == "bert.npz") is (name == "bert")
        assert said["span"].get("person", "") == name
    assert "person" not in said["span"]


def test_the_index_lists_all_that_was_ever_cut_into_the_folder(source, tmp_path) -> None:
    cut(source, tmp_path, PUSH)
    cut(source.only(["maps"]), tmp_path, WAVE)
    with (tmp_path / "index.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    columns = ("label", "first_frame", "last_frame", "frames", "note")
    assert [tuple(row[name] for name in columns) for row in rows] == [
        ("wave", "5", "14", "10", 'a, "b"'),
        ("push / pull", "20", "29", "10", ""),
    ]
    listed = json.loads((tmp_path / "index.json").read_text("utf-8"))["spans"]
    assert [one["files"] for one in listed] == [
        ["synthetic.npz"],
        ["video.mp4", "mesh.zarr", "synthetic.npz"],
    ]
    assert "/" not in rows[1]["folder"]


def test_a_spreadsheet_computes_no_text_of_the_index(source, tmp_path) -> None:
    cut(source.only(["maps"]), tmp_path, replace(WAVE, label="=1+1", note="-x", author="@a"))
    with (tmp_path / "index.csv").open(encoding="utf-8", newline="") as file:
        (row,) = csv.DictReader(file)
    assert [row[name] for name in ("label", "note", "author")] == ["'=1+1", "'-x", "'@a"]
    assert (
        json.loads((tmp_path / "index.json").read_text("utf-8"))["spans"][0]["span"]["note"] == "-x"
    )


def test_what_is_there_and_the_same_is_left_alone(source, tmp_path) -> None:
    first = cut(source, tmp_path, WAVE, PUSH)
    before = [path.stat().st_mtime_ns for path in first]
    assert cut(source, tmp_path, WAVE, PUSH) == []
    assert [path.stat().st_mtime_ns for path in first] == before
    # A file of it went missing: then it is not the same.
    (first[0] / "video.mp4").unlink()
    assert [one.state for one in plan_cuts(source, [WAVE, PUSH], tmp_path)] == ["other", "same"]


def test_something_else_is_replaced_only_when_asked_for(source, tmp_path) -> None:
    (path,) = cut(source, tmp_path, WAVE)
    moved = replace(source.maps["synthetic"], meta={"source": "elsewhere"})
    changed = replace(source, maps={"synthetic": moved})
    assert cut(changed, tmp_path, WAVE) == []
    assert "sensor" not in DopplerMap.load(path / "synthetic.npz").meta
    assert cut(changed, tmp_path, WAVE, replace_others=True) == [path]
    assert DopplerMap.load(path / "synthetic.npz").meta["source"] == "elsewhere"
    assert sorted(one.name for one in tmp_path.iterdir()) == [
        ".sd2-lock",
        path.name,
        "index.csv",
        "index.json",
    ]


def test_stopped_midway_there_are_whole_folders_only_and_it_goes_on(source, tmp_path) -> None:
    def stop(done: int, total: int) -> None:
        assert total == 20
        if done >= 13:
            raise Cancelled

    with pytest.raises(Cancelled):
        cut(source, tmp_path, WAVE, PUSH, progress=stop)
    assert [path.name for path in tmp_path.glob("*s_*")] == [folder_name(WAVE)]
    assert not list(tmp_path.glob(".sd2-cut-*"))
    assert len(json.loads((tmp_path / "index.json").read_text("utf-8"))["spans"]) == 1
    assert [path.name for path in cut(source, tmp_path, WAVE, PUSH)] == [folder_name(PUSH)]


def test_what_a_killed_process_left_behind_is_cleared_away(source, tmp_path) -> None:
    left = tmp_path / ".sd2-cut-1"
    left.mkdir()
    (left / "video.mp4").write_bytes(b"half")
    cut(source, tmp_path, WAVE)
    assert not left.exists()


def test_two_do_not_write_to_one_folder(source, tmp_path) -> None:
    from sd2core.files.lock import FileLock

    lock = FileLock(tmp_path / ".sd2-lock")
    assert lock.take()
    with pytest.raises(Sd2Error, match="Another process is writing"):
        cut(source, tmp_path, WAVE)
    lock.release()


def test_refusals(source, tmp_path) -> None:
    outside = replace(WAVE, start_s=90.0, end_s=91.0)
    with pytest.raises(Sd2Error, match="has no frame of walk"):
        plan_cuts(source, [outside], tmp_path)
    cuts = plan_cuts(source, [outside, WAVE], tmp_path)
    assert [one.state for one in cuts] == ["new", "empty"]
    assert without_frame(cuts).startswith(f" {outside.words()}")
    assert len(cut_out(source, cuts, tmp_path)) == 1
    with pytest.raises(Sd2Error, match="no spans to cut out"):
        plan_cuts(source, [], tmp_path)
    with pytest.raises(Sd2Error, match="nothing to cut out"):
        source.only([])


def test_pictures_of_odd_size_are_cut_out_too(source, tmp_path) -> None:
    import av

    path = tmp_path / "odd.mkv"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("ffv1", rate=30)
        stream.width, stream.height, stream.pix_fmt = 63, 47, "bgr0"
        for k in range(40):
            picture = np.full((47, 63, 3), 5 * k, np.uint8)
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        container.mux(stream.encode(None))
    with open_video(path) as clip:
        clock = clip.timebase
    odd = replace(source, video=path, timebase=clock, mesh=None, maps={})
    (made,) = cut(odd, tmp_path / "out", Span(1, "Gestures", 0.5, 0.7, "wave"))
    with open_video(made / "video.mp4") as clip:
        assert (clip.width, clip.height, len(clip)) == (64, 48, 6)


@pytest.mark.slow
def test_killed_midway_there_are_whole_folders_only_and_it_goes_on(source, tmp_path) -> None:
    import subprocess
    import sys

    # Ends at a frame as a kill does: nothing is tidied up.
    script = f"""
import os, sys
from pathlib import Path
from test_cut_outs import CLOCK, CutSource, PUSH, WAVE, cut
source = CutSource("walk", True, CLOCK, Path({str(source.video)!r}))
end = lambda done, total: done >= 14 and os._exit(9)
cut(source, Path({str(tmp_path)!r}), WAVE, PUSH, progress=end)
"""
    here = str(Path(__file__).parent)
    code = f"import sys; sys.path.insert(0, {here!r})\n{script}"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 9
    assert [path.name for path in tmp_path.glob("[0-9]*")] == [folder_name(WAVE)]
    assert list(tmp_path.glob(".*.tmp"))
    only = source.only(["video"])
    assert [path.name for path in cut(only, tmp_path, WAVE, PUSH)] == [folder_name(PUSH)]
    assert not list(tmp_path.glob(".*.tmp"))


def test_cut_outs_of_before_have_a_half_open_pair_of_frames(source, tmp_path) -> None:
    (folder,) = cut(source.only(["maps"]), tmp_path, WAVE)
    said = json.loads((folder / "span.json").read_text("utf-8"))
    (folder / "span.json").write_text(json.dumps(said | {"frames": [5, 15]}), "utf-8")
    (planned,) = plan_cuts(source.only(["maps"]), [WAVE], tmp_path)
    assert planned.state == "same"
    cut(source.only(["maps"]), tmp_path, PUSH)
    with (tmp_path / "index.csv").open(encoding="utf-8", newline="") as file:
        assert next(csv.DictReader(file))["last_frame"] == "14"
