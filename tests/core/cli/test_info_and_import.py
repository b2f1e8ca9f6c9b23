"""``sd2 info``, ``sd2 import`` and ``sd2 relink``."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from cli_outcome import Sd2

from sd2core.maps import DopplerMap
from sd2core.recording.recording import open_recording
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase


def test_a_mesh(sd2: Sd2, plate: Path) -> None:
    outcome = sd2("info", plate)
    assert outcome.code == 0
    assert "81 vertices, 128 triangles" in outcome.out
    assert "12 frames, 0.400 s, 30.00 frames/s" in outcome.out
    data = json.loads(sd2("info", plate, "--json").out)
    assert (data["kind"], data["vertices"], data["faces"]) == ("mesh", 81, 128)
    assert data["first_frame_max_m"] == pytest.approx([0.1, 0.1, 3.0])


@pytest.mark.parametrize("notes", [["Left empty: 3 frames."], None])
def test_a_fitted_body_says_what_was_found_and_assumed(
    sd2: Sd2, plate: Path, notes: list[str] | None
) -> None:
    """A word of the fit that is damaged is passed over."""
    camera = {"focal_px": 612.5, "width": 640, "height": 480, "source": "default"}
    fit = {"camera": camera, "stature_m": 1.72, "stature_source": "default", "notes": notes}
    with np.load(plate) as arrays:
        np.savez(plate, **arrays, fit=np.array(json.dumps(fit)))
    out = sd2("info", plate).out
    assert "focal length 612 pixels at 640 x 480 (default)" in out
    assert "stature      1.72 m (default)" in out
    assert ("note: Left empty" in out) == bool(notes)
    assert json.loads(sd2("info", plate, "--json").out)["fit"] == fit


def test_a_mesh_is_read_as_told(sd2: Sd2, plate: Path) -> None:
    data = json.loads(sd2("info", plate, "--scale", "0.5", "--fps", "10", "--json").out)
    assert data["frames_per_s"] == pytest.approx(10)
    assert data["first_frame_max_m"] == pytest.approx([0.05, 0.05, 1.5])


def test_a_map(sd2: Sd2, tmp_path: Path) -> None:
    path = tmp_path / "map.npz"
    DopplerMap(
        np.zeros((16, 4)),
        VelocityAxis(16, 4.0),
        Timebase.regular(4, 10.0),
        "real",
        unseen_bins=(0, 15),
        meta={"notes": ["a note"], "share": float("nan")},
    ).save(path)
    outcome = sd2("info", path)
    assert "16 bins of 0.5 m/s over ±4 m/s" in outcome.out
    assert "unseen bins  0, 15" in outcome.out
    assert "note: a note" in outcome.out
    data = json.loads(sd2("info", path, "--json").out)
    assert data["provenance"] == {"notes": ["a note"], "share": None}


@pytest.mark.parametrize("name", ["no.npz", "text.txt", "broken.npz", "broken.sd2"])
def test_what_cannot_be_read_is_explained(sd2: Sd2, tmp_path: Path, name: str) -> None:
    for existing in ("text.txt", "broken.npz"):
        (tmp_path / existing).write_text("no")
    (tmp_path / "broken.sd2").mkdir()
    (tmp_path / "broken.sd2" / "recording.json").write_text("{")
    outcome = sd2("info", tmp_path / name)
    assert (outcome.code, outcome.out) == (1, "")
    assert outcome.err.startswith("sd2: ")
    assert name in outcome.err


def test_import_refers_to_the_files(sd2: Sd2, plate: Path, tmp_path: Path) -> None:
    outcome = sd2(
        "import",
        "--out",
        tmp_path / "a",
        "--mesh",
        plate,
        "--fps",
        "15",
        "--radar-offset-s",
        "-0.25",
    )
    assert outcome.code == 0, outcome.err
    recording = open_recording(tmp_path / "a.sd2")
    assert recording.mesh == plate
    assert recording.radar_offset_s == -0.25
    assert recording.load_mesh().timebase.frames_per_s == pytest.approx(15)
    assert [path.name for path in recording.folder.iterdir()] == ["recording.json"]
    data = json.loads(sd2("info", tmp_path / "a.sd2", "--json").out)
    assert data["mesh"]["frames_per_s"] == pytest.approx(15)
    assert data["missing"] == {}


def test_samples_of_an_inertial_sensor(sd2: Sd2, plate: Path, tmp_path: Path) -> None:
    rows = "".join(f"{10 * row};0;0;1;90;0;0\n" for row in range(50)) + "500;;;;0;0;0\n"
    wrist = tmp_path / "wrist.csv"
    wrist.write_text(f"time (ms);ax_g;ay_g;az_g;gx_dps;gy_dps;gz_dps\n{rows}")
    outcome = sd2("info", wrist)
    assert outcome.code == 0, outcome.err
    assert "51 at 100 Hz, from 0.000 to 0.500 s; 1 are empty" in outcome.out
    data = json.loads(sd2("info", wrist, "--json").out)
    assert (data["kind"], data["samples"], data["known_samples"]) == ("imu", 51, 50)
    assert data["largest_acceleration_mps2"] == pytest.approx(9.80665)
    assert data["largest_turn_rate_radps"] == pytest.approx(np.pi / 2)

    files = ("--mesh", plate, "--imu", wrist, "--imu-offset-s", "0.25")
    outcome = sd2("import", "--out", tmp_path / "a", *files)
    assert outcome.code == 0, outcome.err
    recording = open_recording(tmp_path / "a.sd2")
    assert (recording.imu, recording.imu_offset_s) == (wrist, 0.25)
    assert json.loads(sd2("info", tmp_path / "a.sd2", "--json").out)["imu"]["samples"] == 51
    assert sd2("import", "--out", tmp_path / "b", "--imu", wrist).code == 1  # nothing to look at

    wrist.write_text("t,ax,ay,az,gx,gy,gz\n0,1,1,1,1,1,1\n")
    outcome = sd2("info", wrist)
    assert outcome.code == 1
    assert "no unit" in outcome.err


def test_simulated_samples_stay_on_the_clock_of_their_mesh(
    sd2: Sd2, plate: Path, tmp_path: Path
) -> None:
    wrist = tmp_path / "wrist.csv"
    with np.load(plate) as arrays:
        np.savez(plate, **{**arrays, "times_s": arrays["times_s"] + 2.0})
    assert sd2("imu", plate, "--at", "40", "--out", wrist).code == 0
    outcome = sd2("import", "--out", tmp_path / "a", "--mesh", plate, "--imu", wrist)
    assert outcome.code == 0, outcome.err
    assert open_recording(tmp_path / "a.sd2").imu_offset_s == pytest.approx(2.0)


def test_what_lies_in_a_simulated_recording_is_simulated(sd2: Sd2, tmp_path: Path) -> None:
    sample = tmp_path / "sample.sd2"
    assert sd2("demo", "--out", sample).code == 0
    parts = "--video", sample / "video.mp4", "--mesh", sample / "mesh.zarr"
    for number, arguments in enumerate((parts, parts[2:], ("--radar", sample / "radar"))):
        out = tmp_path / f"again-{number}.sd2"
        assert sd2("import", *arguments, "--out", out).code == 0
        assert open_recording(out).simulated == (number < 2)


def test_import_copies_on_request(sd2: Sd2, plate: Path, tmp_path: Path) -> None:
    data = json.loads(
        sd2(
            "import",
            "--out",
            tmp_path / "a.sd2",
            "--mesh",
            plate,
            "--copy",
            "--title",
            "T",
            "--json",
        ).out
    )
    assert data["title"] == "T"
    assert data["mesh"]["path"] == str(tmp_path / "a.sd2" / "plate.npz")
    plate.unlink()
    assert not open_recording(tmp_path / "a.sd2").missing()


@pytest.mark.parametrize(
    ("option", "says"), [("--mesh", "broken.npz"), ("--video", "broken.npz"), ("--radar", "radar")]
)
def test_import_makes_nothing_of_what_cannot_be_read(
    sd2: Sd2, tmp_path: Path, option: str, says: str
) -> None:
    broken = tmp_path / "broken.npz"
    broken.write_text("no")
    outcome = sd2("import", "--out", tmp_path / "a.sd2", option, broken)
    assert outcome.code == 1
    assert says in outcome.err
    assert not (tmp_path / "a.sd2").exists()


@pytest.mark.parametrize("arguments", [[], ["--mesh", "no.npz"]])
def test_import_of_nothing(sd2: Sd2, tmp_path: Path, arguments: list[str]) -> None:
    outcome = sd2("import", "--out", tmp_path / "a.sd2", *arguments)
    assert outcome.code == 1
    assert not (tmp_path / "a.sd2").exists()


def test_missing_files_are_named_and_found_again(sd2: Sd2, plate: Path, tmp_path: Path) -> None:
    recording = tmp_path / "a.sd2"
    sd2("import", "--out", recording, "--mesh", plate)
    (tmp_path / "disk").mkdir()
    plate.rename(tmp_path / "disk" / "plate.npz")
    outcome = sd2("info", recording)
    assert outcome.code == 0
    assert f"the mesh is not at {plate}" in outcome.out
    outcome = sd2("relink", recording, tmp_path / "disk")
    assert outcome.code == 0
    assert f"mesh: found at {tmp_path / 'disk' / 'plate.npz'}" in outcome.out
    assert "No file of this recording is missing" in sd2("relink", recording, tmp_path).out


def test_relink_says_what_it_could_not_decide(sd2: Sd2, plate: Path, tmp_path: Path) -> None:
    recording = tmp_path / "a.sd2"
    sd2("import", "--out", recording, "--mesh", plate)
    for name in ("one", "two"):
        (tmp_path / "disk" / name).mkdir(parents=True)
        (tmp_path / "disk" / name / "plate.npz").write_bytes(plate.read_bytes())
    plate.unlink()
    outcome = sd2("relink", recording, tmp_path / "disk")
    assert outcome.code == 1
    assert "several files fit equally well" in outcome.out
    (tmp_path / "empty").mkdir()
    data = json.loads(sd2("relink", recording, tmp_path / "empty", "--json").out)
    assert data == {"found": {}, "ambiguous": {}, "missing": ["mesh"]}


def test_a_real_recording(sd2: Sd2, shared_data: Path, tmp_path: Path) -> None:
    outcome = sd2(
        "import",
        "--out",
        tmp_path / "walk.sd2",
        "--video",
        shared_data / "video" / "walk.mkv",
        "--mesh",
        shared_data / "mesh" / "walk.npz",
        "--radar",
        shared_data / "radar" / "infineon_people",
        "--json",
    )
    assert outcome.code == 0, outcome.err
    data = json.loads(outcome.out)
    assert (data["video"]["frames"], data["video"]["width"]) == (89, 640)
    assert data["mesh"]["vertices"] == 13718
    assert data["radar"]["v_max_mps"] == pytest.approx(3.138, abs=1e-3)
    assert not data["simulated"]
