"""Recordings become pairs: the map of the mesh beside the radar's, on one clock."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scenes_of_people import scene
from swinging_recordings import RATE_HZ, recording

from sd2core.classify.data import clips_of_pairs
from sd2core.cli.info.description import describe_recording
from sd2core.cli.info.learning_data import describe_pairs
from sd2core.datasets.recording_sources import Making, labels_and_classes
from sd2core.datasets.sources import pair_sources
from sd2core.doppler import PRESETS, Synthesizer
from sd2core.errors import Sd2Error
from sd2core.fmcw.processing import doppler_map
from sd2core.io.mesh import save_mesh
from sd2core.io.radar import load_recorded_map
from sd2core.io.radar.kkt import FRAME_S
from sd2core.maps import mean_velocity_mps
from sd2core.mocap.recording_pairs import make_recording_pairs
from sd2core.pairs.rows import UNKNOWN
from sd2core.pairs.store import read_pairs
from sd2core.progress import silent
from sd2core.radar_config import CLUTTER
from sd2core.recording.recording import Recording
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase
from sd2core.train.data import read_mixed
from tests.core.io.radar.kkt_files import write_kkt


def test_input_and_target_are_the_maps_on_one_clock(tmp_path: Path) -> None:
    one = recording(tmp_path / "anna.sd2", offset_s=1.0, radar_frames=60)
    made = make_recording_pairs([one.folder], tmp_path / "pairs.zarr")
    pairs = read_pairs(tmp_path / "pairs.zarr")
    assert (pairs.kind, pairs.labels, pairs.null_bins) == (
        "simulated", ("background", "swing"), (14, 15, 16),
    )  # fmt: skip
    assert pairs.frame_rate_hz == pytest.approx(RATE_HZ)
    # The radar is there from 1 s to 3 s of the mesh.
    assert made.subjects == {"anna": (1, 60)}
    assert made.left_out_s == pytest.approx(2.0)
    (take,) = pairs.takes
    synthetic = Synthesizer(one.load_mesh(), PRESETS["paper"]).map(one.sensor)
    radar = doppler_map(one.load_capture(), axis=PRESETS["paper"].axis, clutter=CLUTTER)
    seen = radar.values.copy()
    seen[[14, 15, 16]] = 0.0
    assert np.array_equal(take.synthetic, synthetic.values.T[30:90])
    assert np.array_equal(take.radar, seen.T)
    assert take.label.tolist() == [1] * 30 + [0] * 30
    assert take.times_s[0] == 0.0


def test_a_table_of_points_is_a_target_on_the_axis_asked_for(tmp_path: Path) -> None:
    one, table = recording(tmp_path / "anna.sd2"), tmp_path / "points.csv"
    rows = [f"{number},{number / RATE_HZ:.6f},-3,{2 + number % 2}" for number in range(60)]
    table.write_text("\n".join(["frame,time (s),doppler (m/s),intensity", *rows]))
    replace(one, radar=table).save()
    wide = replace(PRESETS["paper"], axis=VelocityAxis(64, 4.0), null_bins=())
    make_recording_pairs([one.folder], tmp_path / "pairs.zarr", wide)
    (take,) = read_pairs(tmp_path / "pairs.zarr").takes
    expected = load_recorded_map(table, wide.axis).doppler.values.T
    assert np.array_equal(take.radar, expected)
    assert expected.sum(axis=1).tolist() == [2, 3] * 30
    assert np.abs(wide.axis.centres_mps[take.radar.argmax(axis=1)] - 3.0).max() < 0.1


def test_a_radars_own_map_brings_its_axis_and_its_labels(tmp_path: Path) -> None:
    mesh = recording(tmp_path / "anna.sd2", radar=False).mesh
    bare = Recording(tmp_path / "own.sd2", mesh=mesh, radar=write_kkt(tmp_path / "wave.h5", 60))
    one = bare.save_as(bare.folder)
    with pytest.raises(Sd2Error, match=r"has 31 bins.*--bins 31 --v-max 1\.9375"):
        make_recording_pairs([one.folder], tmp_path / "pairs.zarr")
    own = replace(PRESETS["paper"], axis=VelocityAxis(31, 1.9375), null_bins=())
    make_recording_pairs([one.folder], tmp_path / "pairs.zarr", own)
    pairs = read_pairs(tmp_path / "pairs.zarr")
    assert (pairs.kind, pairs.labels) == ("real", ("background", "Wave"))
    (take,) = pairs.takes
    labelled_s = take.times_s[take.label == 1]
    assert 4 * FRAME_S <= labelled_s[0] < labelled_s[-1] < 9 * FRAME_S


def test_a_radars_own_file_is_not_read_for_every_take(tmp_path: Path, monkeypatch) -> None:
    mesh = recording(tmp_path / "anna.sd2", radar=False).mesh
    bare = Recording(tmp_path / "own.sd2", mesh=mesh, radar=write_kkt(tmp_path / "wave.h5", 90))
    one = bare.save_as(bare.folder)
    read, reads = Recording.load_radar_map, []
    monkeypatch.setattr(
        Recording, "load_radar_map", lambda *given: (reads.append(given), read(*given))[1]
    )
    monkeypatch.setattr("sd2core.mocap.recording_pairs.TAKE_S", 1.5)
    own = replace(PRESETS["paper"], axis=VelocityAxis(31, 1.9375), null_bins=())
    make_recording_pairs([one.folder], tmp_path / "pairs.zarr", own)
    assert len(read_pairs(tmp_path / "pairs.zarr").takes) > 1
    assert len(reads) <= 3  # for the names of labels, for the map, and for labels of frames


def test_long_recordings_are_cut_and_several_are_several_people(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr("sd2core.mocap.recording_pairs.TAKE_S", 1.5)
    folders = [recording(tmp_path / name).folder for name in ("anna.sd2", "benjamin.sd2")]
    told: list[tuple[int, int]] = []
    made = make_recording_pairs(
        folders, tmp_path / "pairs.zarr", progress=lambda done, total: told.append((done, total))
    )
    # 4 s are three takes of at most 1.5 s, equally long.
    assert made.subjects == {"anna": (3, 120), "benjamin": (3, 120)}
    assert [len(take.times_s) for take in read_pairs(tmp_path / "pairs.zarr").takes] == [40] * 6
    shares = [done / total for done, total in told]
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    # Again, it is all there already.
    make_recording_pairs(folders, tmp_path / "pairs.zarr")
    assert len(read_pairs(tmp_path / "pairs.zarr").takes) == 6
    one = make_recording_pairs(folders, tmp_path / "one.zarr", subjects=("anna", "anna"))
    assert one.subjects == {"anna": (6, 240)}
    assert len({take.key for take in read_pairs(tmp_path / "one.zarr").takes}) == 6


def test_recordings_of_one_person_are_of_one_subject(tmp_path: Path) -> None:
    """Else the person would be in the training and in the test."""
    folders = []
    for name, subject in (("a1", "anna"), ("a2", "anna"), ("other", "")):
        one = recording(tmp_path / f"{name}.sd2")
        one.subject = subject
        one.save()
        folders.append(one.folder)
    made = make_recording_pairs(folders, tmp_path / "pairs.zarr")
    assert made.subjects == {"anna": (2, 240), "other": (1, 120)}


@pytest.mark.parametrize("changed", ["clock", "labels"])
def test_pairs_of_what_has_changed_since_are_refused(tmp_path: Path, changed: str) -> None:
    one = recording(tmp_path / "anna.sd2")
    make_recording_pairs([one.folder], tmp_path / "pairs.zarr")
    if changed == "clock":
        one.radar_offset_s += 0.2
    else:
        one.spans = []
    one.save()
    with pytest.raises(Sd2Error, match="anna-000 already, made of something else"):
        make_recording_pairs([one.folder], tmp_path / "pairs.zarr")


def test_no_take_reaches_over_lost_frames(tmp_path: Path) -> None:
    one = recording(tmp_path / "anna.sd2", radar_frames=180)
    mesh = one.load_mesh()
    later_s = mesh.times_s + np.where(np.arange(120) < 50, 0.0, 2.0)
    save_mesh(replace(mesh, timebase=Timebase(later_s)), one.folder / "mesh.npz")
    make_recording_pairs([one.folder], tmp_path / "pairs.zarr")
    assert [len(take.times_s) for take in read_pairs(tmp_path / "pairs.zarr").takes] == [50, 70]


def test_a_take_whose_frames_were_lost_is_at_an_even_rate(tmp_path: Path) -> None:
    """Every fifth picture is missing, as of a camera that is too slow: nothing moves faster."""
    one = recording(tmp_path / "anna.sd2")
    mesh = one.load_mesh()
    make_recording_pairs([one.folder], tmp_path / "whole.zarr")
    kept = np.flatnonzero(np.arange(mesh.frame_count) % 5 != 3)
    fewer = replace(mesh, vertices=mesh.vertices[kept], timebase=Timebase(mesh.times_s[kept]))
    save_mesh(fewer, one.folder / "mesh.npz")
    make_recording_pairs([one.folder], tmp_path / "pairs.zarr")
    (whole,), (take,) = (read_pairs(tmp_path / f"{name}.zarr").takes for name in ("whole", "pairs"))
    assert len(fewer.times_s) < len(take.times_s) == len(whole.times_s)
    np.testing.assert_allclose(take.times_s, whole.times_s, atol=1e-9)
    assert np.array_equal(take.radar, whole.radar)
    assert np.array_equal(take.label, whole.label)
    means = [mean_velocity_mps(each.synthetic, PRESETS["paper"].axis) for each in (take, whole)]
    assert np.corrcoef(*means)[0, 1] > 0.98


def test_what_does_not_fit_is_refused(tmp_path: Path) -> None:
    whole = recording(tmp_path / "a.sd2").folder
    with pytest.raises(Sd2Error, match="no radar capture"):
        make_recording_pairs(
            [recording(tmp_path / "b.sd2", radar=False).folder], tmp_path / "b.zarr"
        )
    with pytest.raises(Sd2Error, match="frames/s"):
        make_recording_pairs(
            [whole, recording(tmp_path / "c.sd2", rate_hz=25.0).folder], tmp_path / "c.zarr"
        )
    with pytest.raises(Sd2Error, match="the radar of one is simulated"):
        make_recording_pairs(
            [whole, recording(tmp_path / "d.sd2", simulated=False).folder], tmp_path / "d.zarr"
        )
    with pytest.raises(Sd2Error, match="called a"):
        make_recording_pairs([whole, whole], tmp_path / "e.zarr")
    with pytest.raises(Sd2Error, match="1 people are named"):
        make_recording_pairs([whole, tmp_path / "c.sd2"], tmp_path / "f.zarr", subjects=("x",))


def test_both_maps_of_a_pair_show_everybody_and_a_label_is_of_whom_it_names(
    tmp_path: Path,
) -> None:
    one, out = scene(tmp_path / "duo.sd2"), tmp_path / "pairs.zarr"
    make_recording_pairs([one.folder], out)
    pairs = read_pairs(out)
    (take,) = pairs.takes
    whole = Synthesizer(one.load_mesh(), PRESETS["paper"]).map(one.sensor)
    np.testing.assert_array_equal(take.synthetic, whole.values.T)
    assert pairs.labels == ("background", "rest", "swing", "wave")
    expected = np.zeros(120, int)
    expected[30:60], expected[45:75], expected[90:105] = 2, 3, 1
    expected[45:60] = UNKNOWN  # Anna swings and Bert waves: the radar shows both
    np.testing.assert_array_equal(take.label, expected)
    assert pairs.provenance["scenes"] == {"duo": ["anna", "bert"]}
    (clip,) = clips_of_pairs(pairs, "simulated").clips
    np.testing.assert_array_equal(clip.label == UNKNOWN, expected == UNKNOWN)
    mixed = read_mixed([out, out]).takes[0]
    np.testing.assert_array_equal(mixed.label == UNKNOWN, expected == UNKNOWN)
    assert sum(describe_pairs(out, pairs).data["frames_of_label"].values()) == 105


def test_a_data_set_of_such_pairs_leaves_out_what_is_not_known(tmp_path: Path) -> None:
    one, out = scene(tmp_path / "duo.sd2"), tmp_path / "pairs.zarr"
    make_recording_pairs([one.folder], out)
    (lazy,) = pair_sources([out], Making(kinds=("synthetic", "simulated")))
    source = lazy.load(silent)
    unknown = np.arange(120)[45:60].tolist()
    assert lazy.outline is not None
    for present in (source.present, lazy.outline().present):
        assert np.flatnonzero(~present).tolist() == unknown
    assert source.provenance["scene"] == ["anna", "bert"]
    assert source.provenance["everybody"] == ("synthetic", "simulated")


def test_suggestions_are_no_labels(tmp_path: Path) -> None:
    one, out = scene(tmp_path / "duo.sd2"), tmp_path / "pairs.zarr"
    assert one.labels is not None
    one.labels = one.labels.with_spans(
        replace(span, origin="suggestion") for span in one.labels.spans if span.label != "rest"
    )
    one.save()
    make_recording_pairs([one.folder], out)
    pairs = read_pairs(out)
    assert pairs.labels == ("background", "rest")
    assert np.flatnonzero(pairs.takes[0].label).tolist() == list(range(90, 105))
    assert describe_recording(one, []).facts["spans"] == "1 x rest"
    assert labels_and_classes(one.labels)[0][-1] == "rest"


def test_from_the_command_line(tmp_path: Path, capsys) -> None:
    from sd2core.cli import build_parser, run

    folder = recording(tmp_path / "a.sd2").folder
    out = tmp_path / "pairs.zarr"
    words = ["pairs", "recordings", str(folder), "--out", str(out), "--bins", "16", "--json"]
    assert run(build_parser()[0], words) == 0
    assert json.loads(capsys.readouterr().out)["subjects"] == {"a": {"takes": 1, "frames": 120}}
    pairs = read_pairs(out)
    assert (pairs.axis, pairs.null_bins) == (replace(PRESETS["paper"].axis, bins=16), ())
