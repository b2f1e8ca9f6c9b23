"""``sd2 simulate radar`` and ``sd2 synth --method fmcw``: a mesh's echo, read like a capture."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cli_outcome import Sd2

from sd2core.files.resources import resource_path
from sd2core.io.mesh import load_mesh, save_mesh
from sd2core.io.radar import load_capture
from sd2core.maps import DopplerMap
from sd2core.mesh.sequence import MeshSequence
from sd2core.recording.recording import open_recording
from sd2core.timebase import Timebase


def test_the_samples_are_read_like_a_capture(sd2: Sd2, plate: Path, tmp_path: Path) -> None:
    folder, out = tmp_path / "radar", tmp_path / "map.npz"
    assert sd2("simulate", "radar", plate, "--out", folder, "--snr-db", 20).code == 0
    assert sd2("radar", folder, "--out", out).code == 0
    columns = DopplerMap.load(out)
    assert columns.kind == "simulated"
    assert np.abs(columns.peak_velocity_mps() - 1.3).max() <= columns.axis.bin_width_mps
    assert load_capture(folder).meta["simulation"]["source"] == "plate.npz"


def test_a_simulated_radar_stands_where_its_mesh_stood_in_time(
    sd2: Sd2, plate: Path, tmp_path: Path
) -> None:
    mesh = load_mesh(plate)
    late, folder, out = tmp_path / "late.npz", tmp_path / "radar", tmp_path / "late.sd2"
    save_mesh(replace(mesh, timebase=mesh.timebase.shifted(2.0)), late)
    assert sd2("simulate", "radar", late, "--out", folder).code == 0
    parts = ("--mesh", late, "--radar", folder)
    assert sd2("import", *parts, "--out", out).code == 0
    assert open_recording(out).radar_offset_s == pytest.approx(2.0, abs=1e-6)
    assert sd2("set", out, "--radar-offset-s", 0.5).code == 0
    assert sd2("set", out, "--title", "still").code == 0
    assert open_recording(out).radar_offset_s == 0.5
    assert sd2("set", out, "--radar", folder).code == 0
    assert open_recording(out).radar_offset_s == pytest.approx(2.0, abs=1e-6)


def test_every_option_arrives(sd2: Sd2, plate: Path, tmp_path: Path) -> None:
    folder = tmp_path / "radar"
    outcome = sd2(
        *(
            "simulate",
            "radar",
            plate,
            "--out",
            folder,
            "--sensor",
            "-0.1,0,0.5",
            "--method",
            "direct",
        ),
        *("--blocks", 4, "--motion", "interpolated", "--incoherent", "--visibility", "facing"),
        *("--receivers", "0,0,0;0.0025,0,0", "--beam-width-deg", 70, "--wall", "5,-0.2"),
        *("--snr-db", 15, "--seed", 9, "--json"),
    )
    assert outcome.code == 0, outcome.err
    assert json.loads(outcome.out)["simulated"] is True
    capture = load_capture(folder)
    assert capture.config.receivers == 2
    simulation = capture.meta["simulation"]
    assert simulation["sensor"]["position_m"] == [-0.1, 0.0, 0.5]
    assert simulation["visibility"] == "facing"
    assert simulation["wave"] == {
        "model": "direct",
        "blocks": 4,
        "coherent": False,
        "motion": "interpolated",
        "receiver_offsets_m": [[0.0, 0.0, 0.0], [0.0025, 0.0, 0.0]],
        "beam_width_deg": 70.0,
        "mirror": {"point_m": [0.0, 0.0, 5.0], "normal": [0.0, 0.0, 1.0], "reflection": -0.2},
    }
    assert simulation["options"]["snr_db"] == 15.0
    assert simulation["options"]["seed"] == 9


def test_a_link_budget_is_one_gain_and_noise_wherever_the_radar_stands(
    sd2: Sd2, plate: Path, tmp_path: Path
) -> None:
    gains: dict[str, list[float]] = {"--link-budget": [], "--incoherent": []}
    for number, (wish, levels) in enumerate(2 * list(gains.items())):
        folder, sensor = tmp_path / str(number), "0,0,0" if number < 2 else "0,0,-4"
        outcome = sd2("simulate", "radar", plate, "--out", folder, wish, "--sensor", sensor)
        assert outcome.code == 0, outcome.err
        levels.append(load_capture(folder).meta["simulation"]["counts_per_unit"])
    near, far = gains["--link-budget"]
    assert near == far == pytest.approx(2**11 / 0.02)
    near, far = gains["--incoherent"]
    assert near < 0.5 * far
    simulation = load_capture(tmp_path / "0").meta["simulation"]
    assert simulation["noise_rms_counts"] > 1
    assert simulation["options"]["link"]["noise_figure_db"] == 12.0
    assert "snr_db" not in simulation["options"]
    both = sd2("simulate", "radar", plate, "--out", tmp_path / "x", "--link-budget", "--snr-db", 10)
    assert both.code == 2


def test_another_radar_and_a_row_of_receivers(sd2: Sd2, plate: Path, tmp_path: Path) -> None:
    first, second = tmp_path / "first", tmp_path / "second"
    assert sd2("simulate", "radar", plate, "--out", first, "--receivers", 3).code == 0
    config = first / "config.json"
    text = config.read_text("utf-8").replace("59875000000.0", "59000000000.0")
    config.write_text(text, "utf-8")
    outcome = sd2("simulate", "radar", plate, "--out", second, "--radar", config, "--ground", 1)
    assert outcome.code == 0, outcome.err
    capture = load_capture(second)
    assert capture.config.receivers == 3
    assert capture.config.start_frequency_hz == 59e9
    assert capture.meta["simulation"]["wave"]["mirror"]["reflection"] == -0.39


def test_nothing_else_is_overwritten(sd2: Sd2, plate: Path, tmp_path: Path) -> None:
    mine = tmp_path / "mine"
    mine.mkdir()
    (mine / "notes.txt").write_text("keep")
    outcome = sd2("simulate", "radar", plate, "--out", mine, "--overwrite")
    assert outcome.code == 1
    assert "is not a radar recording" in outcome.err
    assert [path.name for path in mine.iterdir()] == ["notes.txt"]
    outcome = sd2("simulate", "radar", plate, "--out", tmp_path / "a" / "b")
    assert outcome.code == 0, outcome.err
    outcome = sd2("simulate", "radar", plate, "--out", tmp_path / "c", "--radar", "nowhere.json")
    assert (outcome.code, "no file nowhere.json" in outcome.err) == (1, True)


def test_synth_goes_straight_to_the_map(sd2: Sd2, plate: Path, tmp_path: Path) -> None:
    out, folder, other = tmp_path / "map.npz", tmp_path / "radar", tmp_path / "other.npz"
    axis = ("--bins", 40, "--v-max", 2.5)
    assert sd2("synth", plate, "--out", out, "--method", "fmcw", *axis).code == 0
    sd2("simulate", "radar", plate, "--out", folder)
    sd2("radar", folder, "--out", other, *axis)
    found, expected = DopplerMap.load(out), DopplerMap.load(other)
    assert found.kind == "simulated"
    assert (found.axis.bins, found.axis.v_max_mps) == (40, 2.5)
    np.testing.assert_array_equal(found.values, expected.values)
    assert found.meta["simulation"]["wave"]["model"] == "nufft"


def test_the_maps_clock_is_the_meshs(sd2: Sd2, plate: Path, tmp_path: Path) -> None:
    with np.load(plate) as data:
        later = dict(data) | {"times_s": data["times_s"] + 7.0}
    np.savez(tmp_path / "later.npz", **later)
    out = tmp_path / "map.npz"
    assert sd2("synth", tmp_path / "later.npz", "--out", out, "--method", "fmcw").code == 0
    np.testing.assert_allclose(DopplerMap.load(out).times_s, later["times_s"], atol=1e-6)


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        (("--method", "fmcw", "--weight", "area"), "--weight is given with --method fmcw"),
        (("--method", "fmcw", "--null-bins", "none"), "--null-bins is given with --method fmcw"),
        (("--method", "fmcw", "--preset", "vid2doppler"), "--preset is given"),
        (("--method", "fmcw", "--visibility", "none"), "facing or exact"),
        (("--radar", "config.json"), "--radar is given"),
    ],
)
def test_what_does_not_fit_together_is_said(
    sd2: Sd2, plate: Path, tmp_path: Path, given: tuple[str, ...], sentence: str
) -> None:
    outcome = sd2("synth", plate, "--out", tmp_path / "map.npz", *given)
    assert outcome.code == 1
    assert sentence in outcome.err


@pytest.mark.slow
def test_the_samples_gestures_have_the_velocity_that_counting_gives(
    sd2: Sd2, tmp_path: Path
) -> None:
    """Through the files, on the rough-surface power, averaged over looks.

    Compared are frames with motion beyond 0.5 m/s, where neither the nulled bins of the
    count nor the clutter filter and window of the radar reach. A single look at a
    coherent sum fluctuates like its mean (speckle); the count knows no phase.
    """
    apart: list[float] = []
    for first, last in ((48, 84), (163, 194)):
        mesh = load_mesh(resource_path("swipes.sd2") / "mesh.zarr")
        cut = MeshSequence(mesh.read(first, last), mesh.faces, Timebase.regular(last - first, 30.0))
        save_mesh(cut, tmp_path / "cut.npz")
        counted = tmp_path / f"counted{first}.npz"
        same_law = ("--weight", "area", "--null-bins", "none", "--time-sigma-s", 0)
        # The Hann window's own width, 0.06 m/s.
        smooth = ("--velocity-sigma-bins", 0.5)
        assert sd2("synth", tmp_path / "cut.npz", "--out", counted, *same_law, *smooth).code == 0
        looks = []
        for seed in range(12):
            radar = tmp_path / f"radar{first}-{seed}"
            out = radar.with_suffix(".npz")
            made = sd2(
                *("simulate", "radar", tmp_path / "cut.npz", "--out", radar),
                *("--incoherent", "--seed", seed, "--visibility", "facing"),
            )
            assert made.code == 0, made.err
            assert sd2("radar", radar, "--out", out, "--clutter", "mean").code == 0
            looks.append(DopplerMap.load(out).values)
        expected, found = DopplerMap.load(counted), np.mean(looks, axis=0)
        fast = np.abs(expected.axis.centres_mps) > 0.5
        moving = expected.values[fast].sum(axis=0) > 0.02 * expected.values.sum(axis=0)
        velocity = expected.axis.centres_mps[fast]
        difference = (
            velocity[expected.values[fast].argmax(axis=0)] - velocity[found[fast].argmax(axis=0)]
        )
        apart.extend(np.abs(difference[moving]))
    assert len(apart) >= 15
    assert np.mean(np.array(apart) <= 0.125 + 1e-9) >= 0.95, apart
