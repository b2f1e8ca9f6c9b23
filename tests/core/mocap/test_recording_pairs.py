"""Recordings become pairs: the map of the mesh beside the radar's, on one clock."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from swinging_recordings import RATE_HZ, recording

from sd2core.doppler import PRESETS, Synthesizer
from sd2core.errors import Sd2Error
from sd2core.fmcw.processing import doppler_map
from sd2core.mocap.recording_pairs import make_recording_pairs
from sd2core.pairs.store import read_pairs
from sd2core.radar_config import CLUTTER


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


def test_from_the_command_line(tmp_path: Path, capsys) -> None:
    from sd2core.cli import build_parser, run

    folder = recording(tmp_path / "a.sd2").folder
    out = tmp_path / "pairs.zarr"
    words = ["pairs", "recordings", str(folder), "--out", str(out), "--bins", "16", "--json"]
    assert run(build_parser()[0], words) == 0
    assert json.loads(capsys.readouterr().out)["subjects"] == {"a": {"takes": 1, "frames": 120}}
    pairs = read_pairs(out)
    assert (pairs.axis, pairs.null_bins) == (replace(PRESETS["paper"].axis, bins=16), ())
