"""``sd2 export``: from recordings to a data set with its card and its preview sheet."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from cli_outcome import Sd2
from matplotlib.image import imread
from swinging_recordings import recording

from sd2core.datasets.reading import open_dataset
from sd2core.files.resources import resource_path
from sd2core.imu.virtual import imu_at_frames
from sd2core.io.mesh import load_mesh, save_mesh
from sd2core.placements.placements import PlacementGrid, write_placements
from sd2core.recording.recording import Recording

SMALL = ("--kinds", "synthetic,simulated", "--segment-frames", 30, "--overlap-frames", 5)


@pytest.fixture
def people(tmp_path: Path) -> Path:
    (tmp_path / "people").mkdir()
    for name in ("anna", "ben", "carla"):
        recording(tmp_path / "people" / f"{name}.sd2")
    return tmp_path / "people"


def test_a_link_is_no_other_recording(sd2: Sd2, people: Path, tmp_path: Path) -> None:
    (people / "dora.sd2").symlink_to(people / "anna.sd2")
    for command in (("export", people), ("pairs", "recordings", *sorted(people.iterdir()))):
        told = sd2(*command, "--out", tmp_path / "set.zarr")
        assert told.code == 1
        assert "dora.sd2 is a link to" in told.err


@pytest.mark.slow
def test_a_folder_of_recordings_becomes_a_data_set_with_card_and_sheet(
    sd2: Sd2, people: Path, tmp_path: Path
) -> None:
    out = tmp_path / "swings.h5"
    told = sd2("export", people, "--out", out, *SMALL, "--title", "Swings", "--json")
    assert told.code == 0, told.err
    said = json.loads(told.out)
    assert (said["sources"], said["segments"], said["failed"]) == (3, 15, [])
    card = json.loads(Path(said["card_json"]).read_text(encoding="utf-8"))
    with open_dataset(out) as dataset:
        for name, array in (("label", "segment_label"), ("subject", "subject"), ("split", "split")):
            counts = np.bincount(dataset[array][:], minlength=len(card[f"segments_of_{name}"]))
            assert list(card[f"segments_of_{name}"].values()) == counts.tolist()
        frames = np.bincount(dataset["label"][:].ravel(), minlength=len(dataset.header.labels))
        assert list(card["frames_of_label"].values()) == frames.tolist()
        assert card["range_m"] == pytest.approx([dataset["range_m"][:].min()] * 2, abs=1e-3)
    assert card["segments_of_kind"] == {"synthetic": 15, "simulated": 15}
    assert card["splits"] == {"train": ["ben"], "validation": ["anna"], "test": ["carla"]}
    words = Path(said["card"]).read_text(encoding="utf-8")
    assert words.startswith("# Swings\n\n15 segments of 30 frames")
    assert "of a radar whose signal was computed; no radar was there" in words
    assert "It has no maps of a real radar" in words
    assert "the SHA-256 of their name" in words
    assert "Here anna and carla go for that reason" in words
    sheet = imread(said["sheet"])
    assert sheet.shape[0] > 200
    assert len(np.unique(sheet.reshape(-1, sheet.shape[2]), axis=0)) > 100

    info = sd2("info", out)
    assert info.code == 0
    assert info.out.startswith(f"Data set {out}")
    assert "note: It has no maps of a real radar" in info.out
    assert json.loads(sd2("info", out, "--json").out)["segments"] == 15


@pytest.mark.slow
@pytest.mark.usefixtures("without_sheet")
def test_limb_maps_are_exported_on_request(sd2: Sd2, tmp_path: Path) -> None:
    octahedron = recording(tmp_path / "anna.sd2", radar=False).folder
    mesh = load_mesh(resource_path("swipes.sd2") / "mesh.zarr").between(30, 50)
    save_mesh(mesh, tmp_path / "mesh.npz")
    body = Recording.create(tmp_path / "ben.sd2", mesh=tmp_path / "mesh.npz").folder
    out = tmp_path / "set.h5"
    asked = (
        "export",
        octahedron,
        body,
        "--out",
        out,
        "--kinds",
        "synthetic",
        "--segment-frames",
        20,
    )
    sizes = []
    for more in ((), ("--limbs",)):
        told = sd2(*asked[:1], *asked[2:], *more, "--dry-run", "--json")
        sizes.append(json.loads(told.out)["total_bytes"])
    assert sizes[1] - sizes[0] == (9 * 32 + 14 * 6) * 20 * 4
    told = sd2(*asked, "--limbs")
    assert told.code == 1
    assert "left out anna" in told.err
    assert "the parts of the body are not known" in told.err
    with open_dataset(out) as dataset:
        assert dataset["limbs"].shape == (1, 20, 9, 32)
        assert dataset["kinematics"].shape == (1, 20, 14, 6)
    assert "trunk, upper_arm.L" in sd2("info", out).out
    refused = sd2(*asked)
    assert refused.code == 1
    assert "begun with limb maps" in refused.err


@pytest.mark.slow
def test_a_dry_run_says_what_would_be_written_and_writes_nothing(
    sd2: Sd2, people: Path, tmp_path: Path
) -> None:
    out = tmp_path / "swings.zarr"
    before = sorted(tmp_path.iterdir())
    told = sd2("export", people, "--out", out, *SMALL, "--dry-run", "--json")
    assert told.code == 0, told.err
    assert sorted(tmp_path.iterdir()) == before
    said = json.loads(told.out)
    assert said["segments"] == 15
    assert said["segments_of_split"] == {"train": 5, "validation": 5, "test": 5}
    assert "would hold" in sd2("export", people, "--out", out, *SMALL, "--dry-run").out
    line = sd2("export", people, "--out", out, *SMALL, "--dry-run", "--progress-json").out
    assert json.loads(line) == {"event": "forecast"} | said
    assert sd2("export", people, "--out", out, *SMALL).code == 0
    again = sd2("export", people, "--out", out, *SMALL)
    assert "of which 3 were there already" in again.out


@pytest.mark.slow
def test_a_radar_is_simulated_at_every_place_and_its_cost_said_before(
    sd2: Sd2, people: Path, tmp_path: Path
) -> None:
    grid = tmp_path / "grid.json"
    write_placements(grid, PlacementGrid((1.5, 2.5)))
    more = (*SMALL, "--placements", grid, "--simulate", "paper")
    told = sd2("export", people, "--out", tmp_path / "s.zarr", *more, "--dry-run", "--json")
    said = json.loads(told.out)
    assert said["seconds"] is None
    assert said["segments_of_kind"] == {"synthetic": 45, "simulated": 45}
    words = sd2("export", people, "--out", tmp_path / "s.zarr", *more, "--dry-run").out
    assert "not known before the first source is written" in words
    assert sd2("export", people, "--out", tmp_path / "s.zarr", *more).code == 0
    # It was measured, for all that is simulated; without, it is another matter.
    told = sd2("export", people, "--out", tmp_path / "s.zarr", *more, "--dry-run", "--json")
    assert json.loads(told.out)["seconds"] > 0
    words = sd2("export", people, "--out", tmp_path / "s.zarr", *more, "--dry-run").out
    assert "as such maps took here before" in words
    without = sd2("export", people, "--out", tmp_path / "s.zarr", *SMALL, "--dry-run", "--json")
    assert json.loads(without.out)["seconds"] is None
    with open_dataset(tmp_path / "s.zarr") as dataset:
        assert dataset["available"][:, 2].all()


@pytest.mark.slow
def test_programs_are_told_line_by_line(sd2: Sd2, people: Path, tmp_path: Path) -> None:
    told = sd2("export", people, "--out", tmp_path / "s.npz", *SMALL, "--progress-json")
    lines = [json.loads(line) for line in told.out.splitlines()]
    assert [line["event"] for line in lines[:1] + lines[-1:]] == ["start", "done"]
    steps = [line for line in lines if line["event"] == "progress" and line["stage"] == "segments"]
    assert steps[-1]["done"] == steps[-1]["total"] > 0
    refused = sd2("export", people, "--out", tmp_path / "s.csv", *SMALL, "--progress-json")
    assert refused.code == 1
    assert "ending in .zarr" in json.loads(refused.out)["text"]


@pytest.mark.usefixtures("without_sheet")
def test_one_damaged_recording_is_reported_and_the_rest_is_written(
    sd2: Sd2, people: Path, tmp_path: Path
) -> None:
    (people / "ben.sd2" / "mesh.npz").write_bytes(b"damaged")
    told = sd2("export", people, "--out", tmp_path / "s.zarr", *SMALL)
    assert told.code == 1
    assert "left out ben of ben: " in told.err
    assert "mesh.npz" in told.err
    with open_dataset(tmp_path / "s.zarr") as dataset:
        assert dataset.header.subjects == ("anna", "carla")


@pytest.mark.usefixtures("without_sheet")
@pytest.mark.parametrize("more", [(), ("--dry-run",)])
def test_what_of_a_label_file_is_taken_is_told(
    sd2: Sd2, tmp_path: Path, more: tuple[str, ...]
) -> None:
    octahedron = recording(tmp_path / "anna.sd2", radar=False).folder
    assert sd2("synth", octahedron, "--out", tmp_path / "map.npz").code == 0
    labels = tmp_path / "labels.csv"
    labels.write_text("label,start,end\nswing,1,2\nswing,3,x\nswing,70,71\n")
    asked = ("export", tmp_path / "map.npz", "--labels", labels, "--kinds", "synthetic")
    told = sd2(*asked, "--segment-frames", 30, "--out", tmp_path / "set.zarr", *more)
    assert told.code == 0, told.err
    assert f"sd2: {labels}: 2 spans on 1 track taken, 1 of 2 labels reaches beyond" in told.err
    assert told.err.count("1 left out (line 3: ") == 1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--kinds", "radar"), "some of synthetic, denoised, simulated, real"),
        (("--overlap-frames", "72"), "less than segment_frames, which is 72"),
        (("--subjects", "a,b"), "2 people are named for 3 recordings"),
        (("--test-subjects", "dora"), "'dora' is to be a test subject"),
        (("--test", "dora"), "'dora' is to be a test subject"),
        (("--model", "nobody"), "There is no model called 'nobody'"),
    ],
)
def test_what_cannot_be_is_explained(
    sd2: Sd2, people: Path, tmp_path: Path, arguments: tuple[str, ...], message: str
) -> None:
    told = sd2("export", people, "--out", tmp_path / "s.zarr", "--dry-run", *arguments)
    assert told.code == 1
    assert message in told.err


@pytest.mark.slow
@pytest.mark.usefixtures("without_sheet")
def test_inertial_sensors_are_exported_on_request(sd2: Sd2, tmp_path: Path) -> None:
    octahedron = recording(tmp_path / "anna.sd2", radar=False).folder
    mesh = load_mesh(resource_path("swipes.sd2") / "mesh.zarr").between(30, 70)
    save_mesh(mesh, tmp_path / "mesh.npz")
    body = Recording.create(tmp_path / "ben.sd2", mesh=tmp_path / "mesh.npz").folder
    out = tmp_path / "set.zarr"
    asked = (
        "export",
        body,
        octahedron,
        "--out",
        out,
        "--kinds",
        "synthetic",
        "--segment-frames",
        20,
    )
    with_sensors = (*asked, "--imu", "right-wrist,chest")
    told = sd2(*with_sensors, "--dry-run", "--json")
    assert len(json.loads(told.out)["failed"]) == 1
    told = sd2(*with_sensors)
    assert told.code == 1
    assert "left out anna" in told.err
    assert "not the bundled body's surface" in told.err
    with open_dataset(out) as dataset:
        assert dataset["imu"].shape == (len(dataset), 20, 2, 6)
        starts = dataset["start_frame"][:]
        for number, place in enumerate(("right-wrist", "chest")):
            expected = imu_at_frames(mesh, place).channels
            for row, start in enumerate(starts.tolist()):
                found = dataset["imu"][row, :, number]
                np.testing.assert_array_equal(found, expected[start : start + 20])
    assert "right-wrist, chest, *simulated*" in (tmp_path / "set.card.md").read_text("utf-8")
    refused = sd2(*asked)
    assert refused.code == 1
    assert "begun with inertial sensors at" in refused.err


def test_inertial_sensors_need_a_body(sd2: Sd2, tmp_path: Path) -> None:
    radar = recording(tmp_path / "anna.sd2").folder
    document = radar / "recording.json"
    content = json.loads(document.read_text("utf-8"))
    content["mesh"] = None
    document.write_text(json.dumps(content), "utf-8")
    told = sd2(
        "export", radar, "--out", tmp_path / "a.zarr", "--imu", "head", "--segment-frames", 20
    )
    assert told.code == 1
    assert "has no mesh" in told.err
    told = sd2("export", radar, "--out", tmp_path / "b.zarr", "--imu", "knee")
    assert "some of head" in told.err


def test_spans_of_ten_frames_need_no_overlap(sd2: Sd2, people: Path, tmp_path: Path) -> None:
    few = ("export", people / "anna.sd2", "--kinds", "synthetic", "--segment-frames", 10)
    refused = sd2(*few, "--out", tmp_path / "windows.zarr")
    assert "overlap_frames is 10" in refused.err
    how = ("--segments", "spans", "--span-length", "resampled")
    told = sd2(*few, *how, "--out", tmp_path / "spans.zarr")
    assert told.code == 0, told.err
    with open_dataset(tmp_path / "spans.zarr") as dataset:
        assert dataset["synthetic"].shape[1] == 10
