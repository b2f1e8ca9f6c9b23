"""``sd2 synth`` and ``sd2 radar``: what is asked for is what is computed and written."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from cli_outcome import Sd2

from sd2core.cli import build_parser
from sd2core.cli.command_parser import record_of
from sd2core.doppler import PRESETS
from sd2core.doppler.options import chosen_options, same_velocities
from sd2core.files.resources import resource_path
from sd2core.maps import DopplerMap
from sd2core.sensor import VelocityAxis


def options_of(*arguments: str) -> object:
    parser, _ = build_parser()
    return chosen_options(
        record_of(parser.parse_args(["synth", "a", "--out", "b.npz", *arguments]))
    )


def test_without_options_it_is_the_preset() -> None:
    assert options_of() == PRESETS["paper"]
    assert options_of("--preset", "vid2doppler") == PRESETS["vid2doppler"]


def test_every_option_arrives() -> None:
    chosen = options_of(
        *("--depth-resolution", "128", "--mask-stride", "3"),
        *("--visibility", "facing", "--weight", "projected", "--beyond", "wrap"),
        *("--count", "plain"),
        *("--bins", "64", "--v-max", "3", "--null-bins", "1,2"),
        *("--range-exponent", "2", "--reference-range-m", "1.5", "--range-law", "frame"),
        *("--trajectory-smoothing-s", "0.1", "--oversampling", "4"),
        *("--velocity-sigma-bins", "0", "--time-sigma-s", "0"),
    )
    assert vars(chosen) == {
        **vars(PRESETS["paper"]),
        "visibility": "facing",
        "depth_resolution": 128,
        "mask_stride": 3,
        "weight": "projected",
        "count": "plain",
        "beyond": "wrap",
        "axis": VelocityAxis(64, 3.0),
        "null_bins": (1, 2),
        "range_exponent": 2.0,
        "reference_range_m": 1.5,
        "range_law": "frame",
        "trajectory_smoothing_s": 0.1,
        "oversampling": 4,
        "velocity_sigma_bins": 0.0,
        "time_sigma_s": 0.0,
    }


def test_help_states_the_defaults_that_hold() -> None:
    text = " ".join(build_parser()[1].choices["synth"].format_help().split())
    paper = PRESETS["paper"]
    assert f"velocity bins (default: {paper.axis.bins})" in text
    assert f"in m/s (default: {paper.axis.v_max_mps:g})" in text
    assert f"(paper: {paper.reference_range_m:g})" in text
    low, high = paper.axis.edges_mps[[paper.null_bins[0], paper.null_bins[-1] + 1]]
    assert f"from {low:g} to {high:g} m/s" in text


@pytest.mark.parametrize(
    ("bins", "v_max_mps", "nulled"),
    [(64, 2.0, range(28, 34)), (16, 1.0, (6, 7, 8)), (32, 4.0, (15, 16)), (4, 20.0, (1, 2))],
)
def test_nulled_velocities_stay_the_same_on_another_axis(
    bins: int, v_max_mps: float, nulled: Sequence[int]
) -> None:
    other = VelocityAxis(bins, v_max_mps)
    assert same_velocities((14, 15, 16), VelocityAxis(), other) == tuple(nulled)
    assert same_velocities((), VelocityAxis(), other) == ()
    centres = other.centres_mps
    assert {k for k in range(bins) if -0.25 <= centres[k] < 0.125} <= set(nulled)


def test_an_approaching_plate(sd2: Sd2, plate: Path, tmp_path: Path) -> None:
    out = tmp_path / "map.npz"
    outcome = sd2("synth", plate, "--out", out, "--time-sigma-s", 0, "--velocity-sigma-bins", 0)
    assert outcome.code == 0, outcome.err
    doppler = DopplerMap.load(out)
    assert doppler.kind == "synthetic"
    assert doppler.peak_velocity_mps() == pytest.approx(1.3, abs=doppler.axis.bin_width_mps / 2)
    assert "32 bins of 0.125 m/s over ±2 m/s, approaching is positive" in outcome.out
    assert "nulled bins  14, 15, 16" in outcome.out
    assert "exact: 100.0% visible on average" in outcome.out


@pytest.mark.parametrize("method", ["histogram", "fmcw"])
def test_fewer_vertices_are_said(sd2: Sd2, plate: Path, tmp_path: Path, method: str) -> None:
    out = tmp_path / "map.npz"
    outcome = sd2("synth", plate, "--out", out, "--vertices-kept", 0.3, "--method", method)
    assert outcome.code == 0, outcome.err
    assert re.search(r"decimated to \d\d of 81 vertices", outcome.out)
    doppler = DopplerMap.load(out)
    assert re.search(r"plate.npz, decimated to \d\d of 81 vertices", str(doppler.meta))
    assert doppler.peak_velocity_mps() == pytest.approx(1.3, abs=doppler.axis.bin_width_mps)
    outcome = sd2("synth", plate, "--out", out, "--vertices-kept", 3)
    assert outcome.code == 2
    assert "a share above 0 and up to 1" in outcome.err


def test_the_share_beyond_the_axis_is_said(sd2: Sd2, plate: Path, tmp_path: Path) -> None:
    outcome = sd2("synth", plate, "--out", tmp_path / "map.npz", "--v-max", "1")
    assert "100.0% of what is visible on average" in outcome.out
    assert outcome.out == sd2("info", tmp_path / "map.npz").out


def test_from_behind_it_recedes(sd2: Sd2, plate: Path, tmp_path: Path) -> None:
    out = tmp_path / "map.npz"
    arguments = ("synth", plate, "--out", out, "--overwrite", "--visibility", "none", "--sensor")
    assert sd2(*arguments, "0,0,9").code == 0
    assert (DopplerMap.load(out).mean_velocity_mps() < -1.0).all()
    assert sd2(*arguments, "-0.5,0,0").code == 0
    assert (DopplerMap.load(out).mean_velocity_mps() > 1.0).all()


def test_a_recording_brings_its_sensor(sd2: Sd2, plate: Path, tmp_path: Path) -> None:
    from sd2core.recording.recording import Recording
    from sd2core.sensor import VirtualSensor

    Recording.create(tmp_path / "a.sd2", mesh=plate, sensor=VirtualSensor((0.0, 0.0, 9.0)))
    outcome = sd2(
        *("synth", tmp_path / "a.sd2", "--out", tmp_path / "map.npz", "--visibility", "none"),
        "--json",
    )
    assert outcome.code == 0, outcome.err
    assert json.loads(outcome.out)["map_kind"] == "synthetic"
    assert (DopplerMap.load(tmp_path / "map.npz").mean_velocity_mps() < -1.0).all()


def test_a_point_cloud_needs_visibility_none(sd2: Sd2, plate: Path, tmp_path: Path) -> None:
    points = tmp_path / "points.npz"
    with np.load(plate) as data:
        np.savez(points, vertices=data["vertices"], times_s=data["times_s"])
    out = tmp_path / "map.npz"
    outcome = sd2("synth", points, "--out", out)
    assert outcome.code == 1
    assert "none" in outcome.err
    assert not out.exists()
    assert sd2("synth", points, "--out", out, "--visibility", "none").code == 0


def test_limbs_come_with_the_map(sd2: Sd2, plate: Path, tmp_path: Path) -> None:
    body, out = resource_path("swipes.sd2") / "mesh.zarr", tmp_path / "map.npz"
    said = sd2("synth", body, "--out", out, "--limbs", "--visibility", "facing")
    assert said.code == 0
    assert "forearm.L, forearm.R" in said.out
    found = DopplerMap.load(out)
    assert found.limbs is not None
    np.testing.assert_allclose(found.limbs.values.sum(axis=0), found.values, rtol=1e-5, atol=1e-7)
    assert json.loads(sd2("info", out, "--json").out)["limbs"] == list(found.limbs.parts)
    for more, words in (
        ((plate,), "the parts of the body are not known"),
        ((body, "--method", "fmcw"), "--limbs is given with --method fmcw"),
    ):
        said = sd2("synth", *more, "--out", tmp_path / "other.npz", "--limbs")
        assert said.code == 1
        assert words in said.err
        assert not (tmp_path / "other.npz").exists()


@pytest.mark.parametrize("command", ["synth", "radar"])
@pytest.mark.parametrize(
    ("name", "says"), [("map.txt", "ends in .npz"), ("plate.npz/map.npz", "plate.npz is a file")]
)
def test_an_output_that_cannot_be_written(
    sd2: Sd2, plate: Path, tmp_path: Path, command: str, name: str, says: str
) -> None:
    outcome = sd2(command, plate, "--out", tmp_path / name)
    assert outcome.code == 1
    assert says in " ".join(outcome.err.split())


def test_a_real_capture(sd2: Sd2, shared_data: Path, tmp_path: Path) -> None:
    capture, out = shared_data / "radar" / "infineon_people", tmp_path / "real.npz"
    outcome = sd2("radar", capture, "--out", out, "--clutter", "mean", "--range", "0.5,8")
    assert outcome.code == 0, outcome.err
    for limit in ("4.915 mm", "v_max ±3.138 m/s", "Δv of 0.098 m/s", "ΔR of 0.150", "R_max 9.59"):
        assert limit in outcome.out
    doppler = DopplerMap.load(out)
    assert doppler.axis == VelocityAxis()
    assert doppler.kind == "real"
    assert not doppler.unseen_bins


def test_an_axis_beyond_the_radar_is_said(sd2: Sd2, shared_data: Path, tmp_path: Path) -> None:
    capture, out = shared_data / "radar" / "infineon_people", tmp_path / "real.npz"
    outcome = sd2("radar", capture, "--out", out, "--v-max", "4")
    assert "this radar only ±3.14 m/s" in " ".join(outcome.out.split())
    assert "unseen bins" in outcome.out
    data = json.loads(
        sd2("radar", capture, "--v-max", "4", "--json", "--out", out, "--overwrite").out
    )
    assert data["unseen_bins"] == [0, 1, 2, 29, 30, 31]
    assert data["limits"]["v_max_mps"] == pytest.approx(3.138, abs=1e-3)


def test_the_capture_of_a_recording_is_on_its_clock(
    sd2: Sd2, shared_data: Path, tmp_path: Path
) -> None:
    from sd2core.recording.recording import Recording

    capture = shared_data / "radar" / "infineon_people"
    Recording.create(tmp_path / "a.sd2", radar=capture, radar_offset_s=-0.25)
    assert sd2("radar", tmp_path / "a.sd2", "--out", tmp_path / "real.npz").code == 0
    assert DopplerMap.load(tmp_path / "real.npz").timebase.start_s == -0.25
