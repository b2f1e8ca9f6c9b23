"""``sd2 labels``: show, convert, suggest, agree."""

from __future__ import annotations

import importlib
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cli_outcome import Sd2

from sd2core.io.radar.infineon import write_capture
from sd2core.io.video_writing import write_video
from sd2core.labels import files
from sd2core.labels.formats import FORMATS, read_labels
from sd2core.labels.label_set import Label, LabelSet
from sd2core.labels.spans import Labels, LabelTrack, Span
from sd2core.maps import DopplerMap
from sd2core.radar_config import PAPER_RADAR
from sd2core.recording.recording import Recording, open_recording
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase


def written(path: Path, *spans: tuple[float, float, str]) -> Path:
    made = [
        Span(number, "Gestures", start_s, end_s, label, note=f"n{number}")
        for number, (start_s, end_s, label) in enumerate(spans, start=1)
    ]
    files.write_labels(path, Labels((LabelTrack("Gestures"),), tuple(made)))
    return path


@pytest.fixture
def anna(tmp_path: Path) -> Path:
    return written(
        tmp_path / "anna.json", (1.0, 2.0, "wave"), (3.0, 3.5, "wave"), (4.0, 7.0, "swipe")
    )


@pytest.fixture
def ben(tmp_path: Path) -> Path:
    return written(tmp_path / "ben.json", (1.1, 2.0, "wave"), (4.0, 7.2, "push"))


@pytest.fixture
def moving(tmp_path: Path) -> Path:
    """Ten seconds at 20 frames/s; something approaches from 4 to 5 s."""
    values = np.ones((16, 200), np.float32)
    values[12:, 80:100] = 397.0
    doppler = DopplerMap(values, VelocityAxis(16, 2.0), Timebase.regular(200, 20.0), "real")
    doppler.save(tmp_path / "map.npz")
    return tmp_path / "map.npz"


def cells(line: str) -> list[str]:
    return line.split()


def test_show_prints_spans_and_how_long_they_are(sd2: Sd2, anna: Path) -> None:
    lines = sd2("labels", "show", anna, "--fps", 10).out.splitlines()
    assert cells(lines[1]) == ["1", "1.000", "2.000", "10–19", "(10)", "wave", "Gestures", "n1"]
    assert cells(lines[-2])[:4] == ["swipe", "1", "3.000", "3.000"]
    assert cells(lines[-1])[:4] == ["wave", "2", "1.500", "0.750"]
    without = sd2("labels", "show", anna).out.splitlines()
    assert cells(without[1]) == ["1", "1.000", "2.000", "wave", "Gestures", "n1"]


def test_show_prints_json(sd2: Sd2, anna: Path) -> None:
    data = json.loads(sd2("labels", "show", anna, "--fps", 10, "--json").out)
    assert data["spans"][2]["frames"] == {"first": 40, "last": 69, "count": 30}
    assert data["spans"][2]["label"] == "swipe"
    assert [*data["labels"]] == ["swipe", "wave"]
    assert data["labels"]["wave"]["median_s"] == 0.75
    assert json.loads(sd2("labels", "show", anna, "--json").out)["spans"][0]["frames"] is None


def test_statistics_are_printed_three_ways(sd2: Sd2, anna: Path) -> None:
    lines = sd2("labels", "statistics", anna, "--fps", 10).out.splitlines()
    expected = ["2", "1.500", "0.750", "0.354", "0.750", "0.500", "1.000", "21.4"]
    assert cells(lines[-1]) == ["wave", *expected]
    table = sd2("labels", "statistics", anna, "--fps", 10, "--csv").out.splitlines()
    assert table[0].startswith("label,spans,total s,mean s,sd s")
    assert table[-1] == ",".join(["wave", *expected])
    data = json.loads(sd2("labels", "statistics", anna, "--json").out)["labels"]
    assert data["wave"]["longest_s"] == 1.0
    assert data["swipe"]["sd_s"] is None
    assert data["swipe"]["share"] is None  # nobody said how long the recording is
    assert sd2("labels", "statistics", anna, "--json", "--csv").code == 2


def test_a_label_set_is_shown_shared_and_exchanged(sd2: Sd2, anna: Path, tmp_path: Path) -> None:
    lines = sd2("labels", "set", anna).out.splitlines()
    assert lines[0] == "Gestures of the paper"
    assert cells(lines[2]) == ["left-to-right", "1", "#0072b2", "horizontal", "0"]
    mine, shared = tmp_path / "mine.json", tmp_path / "shared.json"
    two = (Label("wave", "#0072b2", "w"), Label("push", "#0080c0"))
    files.write_label_set(mine, LabelSet("Mine", two))
    out = tmp_path / "out.json"
    done = sd2("labels", "set", anna, "--use", mine, "--out", out, "--export", shared)
    assert done.out.splitlines()[0] == f"Wrote {out} with 2 labels"
    assert files.read_label_set(shared) == files.read_label_set(mine)
    assert files.read_labels(out).labels.spans == files.read_labels(anna).labels.spans
    data = json.loads(sd2("labels", "set", out, "--json").out)
    assert [one["spans"] for one in data["labels"]] == [2, 0]
    assert data["alike"] == ["wave and push look alike"]
    assert "wave and push look alike." in sd2("labels", "set", out).out
    back = sd2("labels", "set", out, "--use", "usual", "--out", out, "--replace", "--json")
    assert json.loads(back.out)["written"] == [str(out)]
    assert files.read_labels(out).labels == files.read_labels(anna).labels


def test_a_label_set_is_not_exchanged_by_halves(sd2: Sd2, anna: Path, tmp_path: Path) -> None:
    half = sd2("labels", "set", anna, "--use", "usual")
    assert (half.code, "both of them, or none" in half.err) == (1, True)
    there = sd2("labels", "set", anna, "--export", anna)
    assert (there.code, "exists" in there.err) == (1, True)
    assert (
        "has the format 'sd2-labels'"
        in sd2("labels", "set", anna, "--use", anna, "--out", tmp_path / "out.json").err
    )


def test_show_says_when_there_is_nothing(sd2: Sd2, tmp_path: Path) -> None:
    assert "holds no spans" in sd2("labels", "show", written(tmp_path / "none.json")).out


def test_a_mesh_gives_the_times_of_frames(sd2: Sd2, anna: Path, plate: Path) -> None:
    data = json.loads(sd2("labels", "show", anna, "--mesh", plate, "--json").out)
    # The plate's clip ends at 0.4 s.
    assert data["spans"][0]["frames"] is None


def test_a_recording_shows_its_own_labels_and_frames(sd2: Sd2, plate: Path, tmp_path: Path) -> None:
    folder = tmp_path / "plate.sd2"
    assert sd2("import", "--out", folder, "--mesh", plate).code == 0
    assert "holds no spans" in sd2("labels", "show", folder).out
    written(folder / files.FILE_NAME, (0.1, 0.3, "wave"))
    data = json.loads(sd2("labels", "show", folder, "--json").out)
    assert data["spans"][0]["frames"] == {"first": 3, "last": 8, "count": 6}
    # A file that names its recording has that one's frames.
    alone = tmp_path / "alone.json"
    files.write_labels(alone, files.read_labels(folder / files.FILE_NAME).labels, recording=folder)
    again = json.loads(sd2("labels", "show", alone, "--json").out)
    assert again["spans"][0]["frames"] == data["spans"][0]["frames"]


def test_spans_of_an_older_recording_are_shown(sd2: Sd2, plate: Path, tmp_path: Path) -> None:
    folder = tmp_path / "plate.sd2"
    recording = Recording(folder, mesh=plate).save_as(folder)
    content = json.loads((recording.folder / "recording.json").read_text())
    content["spans"] = [{"start_s": 0.1, "end_s": 0.3, "label": "wave"}]
    (recording.folder / "recording.json").write_text(json.dumps(content))
    assert json.loads(sd2("labels", "show", folder, "--json").out)["spans"][0]["label"] == "wave"


def test_convert_there_and_back_and_what_is_not_kept(sd2: Sd2, anna: Path, tmp_path: Path) -> None:
    out = tmp_path / "anna.txt"
    done = sd2("labels", "convert", anna, "--out", out, "--to", "audacity", "--fps", 30)
    assert done.code == 0, done.err
    assert "with 3 spans" in done.out
    assert "not kept: Audacity keeps no notes: 3 notes left out" in done.out
    back = tmp_path / "back.json"
    for words in ((), ("--to", "sd2", "--overwrite")):  # without frame times, named or not
        assert sd2("labels", "convert", out, "--out", back, *words).code == 0
    before, after = files.read_labels(anna).labels, files.read_labels(back).labels
    assert [(s.start_s, s.end_s, s.label) for s in after.spans] == [
        (s.start_s, s.end_s, s.label) for s in before.spans
    ]
    table = tmp_path / "anna.csv"
    data = json.loads(sd2("labels", "convert", anna, "--out", table, "--fps", 30, "--json").out)
    assert data["spans"] == len(read_labels(table).spans) == 3


def test_convert_needs_frame_times_and_a_new_file(sd2: Sd2, anna: Path, tmp_path: Path) -> None:
    out = tmp_path / "anna.csv"
    refused = sd2("labels", "convert", anna, "--out", out)
    assert refused.code == 1
    assert "needs the times of frames" in refused.err
    assert not out.exists()
    out.write_text("precious")
    refused = sd2("labels", "convert", anna, "--out", out, "--fps", 30)
    assert refused.code == 1
    assert "anna.csv exists" in refused.err
    assert out.read_text() == "precious"
    assert sd2("labels", "convert", anna, "--out", out, "--fps", 30, "--replace").code == 0
    assert len(read_labels(out).spans) == 3


def test_only_one_clock_may_be_named(sd2: Sd2, anna: Path, plate: Path) -> None:
    assert sd2("labels", "show", anna, "--fps", 30, "--mesh", plate).code == 2


def test_a_rate_that_cannot_be_is_a_sentence(sd2: Sd2, anna: Path) -> None:
    refused = sd2("labels", "show", anna, "--fps", 1e12)
    assert refused.code == 1
    assert "frames/s these are" in refused.err


def test_suggest_writes_what_it_finds_and_says_why(sd2: Sd2, moving: Path, tmp_path: Path) -> None:
    out, exact = tmp_path / "found.json", ("--margin-s", 0, "--hold-s", 0)
    done = sd2("labels", "suggest", moving, "--out", out, *exact, "--label", "wave")
    assert done.code == 0, done.err
    assert "1 span in which something moves, in the real map: 7 dB" in done.out
    assert "up to 20 dB over the quiet level" in done.out
    (span,) = files.read_labels(out).labels.spans
    assert (span.origin, span.label) == ("suggestion", "wave")
    assert span.confidence == pytest.approx(1 - 7 / 20)
    assert (span.start_s, span.end_s) == pytest.approx((3.95, 5.05))
    data = json.loads(sd2("labels", "suggest", moving, "--json").out)
    assert data["loudest_db"] == pytest.approx(20.0)
    assert data["options"]["margin_s"] == 0.2
    assert data["path"] is None


def test_suggest_says_how_far_from_a_span_it_was(sd2: Sd2, moving: Path) -> None:
    done = sd2("labels", "suggest", moving, "--high-db", 25)
    assert done.out.startswith("0 spans")
    assert "The loudest frame is 20.0 dB over the quiet level." in done.out


def test_suggest_in_a_recording_uses_its_mesh(sd2: Sd2, plate: Path, tmp_path: Path) -> None:
    folder = tmp_path / "plate.sd2"
    assert sd2("import", "--out", folder, "--mesh", plate).code == 0
    # The plate moves in every frame: nothing is quiet, so nothing stands out.
    assert sd2("labels", "suggest", folder).out.startswith("0 spans")
    refused = sd2("labels", "suggest", folder, "--of", "radar")
    assert refused.code == 1
    assert "holds no radar" in refused.err


def test_what_cannot_be_suggested_from_is_refused(sd2: Sd2, plate: Path, moving: Path) -> None:
    for arguments, words in (
        ((plate,), "plate.npz is a mesh"),
        ((moving, "--of", "radar"), "--of is given"),
        ((moving, "--low-db", 9), "low_db is 9 and high_db 7"),
        ((moving, "--out", moving), "map.npz exists"),
    ):
        refused = sd2("labels", "suggest", *arguments)
        assert refused.code == 1
        assert words in refused.err


def test_agree_prints_kappas_matches_and_what_is_left(sd2: Sd2, anna: Path, ben: Path) -> None:
    done = sd2("labels", "agree", anna, ben, "--fps", 10)
    assert done.code == 0, done.err
    for text in (
        "2 spans matched from an IoU of 0.5 on, 1 of them with the same label",
        "1 only in A, 0 only in B; F1 0.800",
        "swipe / push",
        "+0.100",
        "only in A: 2 wave 3.000–3.500 s",
    ):
        assert text in done.out


def test_agree_prints_json(sd2: Sd2, anna: Path, ben: Path) -> None:
    data = json.loads(sd2("labels", "agree", anna, ben, "--fps", 10, "--json").out)
    assert data["frames"] == 72
    assert data["answers"] == [[], ["push"], ["swipe"], ["wave"]]
    # Of 72 frames A has wave in 15 (B in 9 of them) and swipe in 30, which B calls push;
    # push goes on for 2 more.
    assert data["confusion"] == [[25, 2, 0, 0], [0, 0, 0, 0], [0, 30, 0, 0], [6, 0, 0, 9]]
    assert [(one["a"], one["b"], one["end_difference_frames"]) for one in data["matches"]] == [
        (1, 1, 0),
        (3, 2, 2),
    ]
    same = json.loads(sd2("labels", "agree", anna, anna, "--fps", 10, "--json").out)
    assert same["overall"]["kappa"] == same["f1"] == same["mean_iou"] == 1.0


def test_agree_without_a_number_says_so(sd2: Sd2, tmp_path: Path) -> None:
    nothing = written(tmp_path / "none.json")
    done = sd2("labels", "agree", nothing, nothing, "--fps", 10)
    assert "Kappa is undefined: both give the same single answer in all frames." in done.out


def test_agree_refuses_what_it_cannot_do(sd2: Sd2, anna: Path, ben: Path) -> None:
    for arguments, words in (
        ((anna, ben), "Comparing labels needs the times of frames"),
        ((anna, ben, "--fps", 10, "--track", "Other"), "no track 'Other'"),
        ((anna, ben.with_name("missing.json"), "--fps", 10), "missing.json does not exist"),
    ):
        refused = sd2("labels", "agree", *arguments)
        assert refused.code == 1
        assert words in refused.err
    refused = sd2("labels", "agree", anna, ben, "--fps", 10, "--min-iou", 2)
    assert refused.code == 2
    assert "--min-iou: '2' is not a share above 0 and up to 100%" in refused.err


def test_every_format_is_named_in_the_help(sd2: Sd2) -> None:
    words = " ".join(sd2("labels", "show", "--help").out.split())
    for one in FORMATS:
        assert one.name in words


@pytest.fixture
def moving_recording(tmp_path: Path, moving: Path) -> Path:
    """A recording whose mesh, a tetrahedron, swings for two seconds; two labels."""
    from sd2core.io.mesh import save_mesh
    from sd2core.mesh.sequence import MeshSequence

    corners = np.array([[0, 0, 2], [1, 0, 2], [0, 1, 2], [0, 0, 3]], np.float32)
    times_s = np.arange(40) / 20.0
    vertices = np.repeat(corners[None], 40, axis=0)
    vertices[:, :, 2] += np.sin(2 * np.pi * times_s)[:, None].astype(np.float32) / 5
    faces = np.array([[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]], np.int32)
    folder = tmp_path / "swing.sd2"
    folder.mkdir()
    save_mesh(MeshSequence(vertices, faces, Timebase(times_s)), folder / "mesh.npz")
    Recording.create(folder, mesh=folder / "mesh.npz", title="swing", simulated=True)
    written(folder / "labels.json", (0.5, 1.0, "wave"), (1.25, 1.75, "up-to-down"))
    return folder


@pytest.mark.slow
def test_a_figure_of_maps_with_labels(sd2: Sd2, moving_recording: Path, tmp_path: Path) -> None:
    out = tmp_path / "swing.svg"
    assert "synthetic" in sd2("labels", "figure", moving_recording, "--out", out).out
    text = out.read_text("utf-8")
    assert "swing (simulated)" in text
    assert "wave" in text
    sd2("labels", "figure", moving_recording, "--out", out, "--from-s", 1.2, "--overwrite")
    assert ">wave<" not in out.read_text("utf-8")
    for maps, said in (("real", "each once"), ("radar", "no radar")):
        refused = sd2(
            "labels", "figure", moving_recording, "--out", tmp_path / "b.svg", "--maps", maps
        )
        assert refused.code == 1
        assert said in refused.err


def test_spans_are_cut_out(sd2: Sd2, moving_recording: Path, tmp_path: Path) -> None:
    out = tmp_path / "cuts"
    said = sd2("labels", "cut", moving_recording, "--out", out, "--label", "wave").out
    assert "1 span cut out" in said
    (made,) = out.glob("*s_wave_1")
    assert sorted(path.name for path in made.iterdir()) == [
        "mesh.zarr",
        "span.json",
        "synthetic.npz",
    ]
    assert DopplerMap.load(made / "synthetic.npz").values.shape == (32, 10)
    said = json.loads(sd2("labels", "cut", moving_recording, "--out", out, "--json").out)
    assert (len(said["written"]), len(said["same"])) == (1, 1)
    other = ("labels", "cut", moving_recording, "--out", out, "--parts", "mesh")
    refused = sd2(*other)
    assert refused.code == 1
    assert "--overwrite" in refused.err
    assert "2 spans cut out" in sd2(*other, "--replace").out
    assert not (made / "synthetic.npz").exists()
    refused = sd2("labels", "cut", moving_recording, "--out", out, "--label", "push")
    assert "up-to-down, wave" in refused.err
    unlabelled = written(tmp_path / "none.json")
    refused = sd2("labels", "cut", moving_recording, "--out", out, "--labels", unlabelled)
    assert "none.json has no labelled spans" in refused.err
    assert "sd2 open" in refused.err


@pytest.mark.parametrize("named", ["--video", "--recording", "as the file"])
def test_converted_labels_link_to_the_video(
    sd2: Sd2, anna: Path, tmp_path: Path, named: str
) -> None:
    """ELAN and BORIS open it with them, as with what the window exports."""
    video, folder = tmp_path / "walk.mp4", tmp_path / "walk.sd2"
    write_video(video, (np.full((48, 64, 3), 5 * k, np.uint8) for k in range(40)), 5, (64, 48))
    folder.mkdir()
    Recording.create(folder, video=video)
    written(folder / "labels.json", (1.0, 2.0, "wave"))
    source = {"--video": video, "--recording": folder}.get(named)
    words = [folder] if source is None else [anna, named, source]
    for out in ("a.eaf", "a.boris", "a.json"):
        sd2("labels", "convert", *words, "--out", tmp_path / out)
        assert "walk.mp4" in (tmp_path / out).read_text("utf-8")


def test_what_only_the_radar_saw_is_cut_out_and_drawn(
    sd2: Sd2, moving_recording: Path, tmp_path: Path
) -> None:
    """It began two seconds before the mesh, whose frames keep their numbers."""
    radar = replace(PAPER_RADAR, frame_repetition_s=0.1)
    samples = np.random.default_rng(1).integers(2000, 2100, (60, 1, 64, 32)).astype(np.uint16)
    folder = tmp_path / "radar"
    write_capture(folder, samples, radar, np.arange(60) / 10.0, simulated=True)
    recording = open_recording(moving_recording)
    recording.radar, recording.radar_offset_s = folder, -2.0
    recording.save()
    written(moving_recording / "labels.json", (-1.5, -0.5, "early"), (0.5, 1.0, "wave"))
    out = tmp_path / "cuts"
    sd2("labels", "cut", moving_recording, "--out", out)
    firsts = [cells(line)[0] for line in (out / "index.csv").read_text().splitlines()[1:]]
    assert [line.split(",")[5:8] for line in firsts] == [["-15", "-6", "10"], ["10", "19", "10"]]
    (early,) = out.glob("*early_1")
    assert len(DopplerMap.load(early / "radar.npz").timebase) == 10
    shown = json.loads(sd2("labels", "show", moving_recording, "--json").out)["spans"]
    assert [one["frames"]["first"] for one in shown] == [-15, 10]
    without = written(tmp_path / "late.json", (0.5, 1.0, "wave"))
    agreed = json.loads(sd2("labels", "agree", moving_recording, without, "--json").out)
    assert agreed["frames"] == 40 + 20 + 20  # of the mesh, and of the radar before and after
    assert agreed["overall"]["observed"] == pytest.approx(1 - 10 / 80)
    figure = "labels", "figure", moving_recording, "--out", tmp_path / "a.svg", "--maps", "radar"
    sd2(*figure, "--from-s", "-1.5", "--to-s", "0")
    assert ">early<" in (tmp_path / "a.svg").read_text("utf-8")


@pytest.mark.parametrize(
    ("command", "module"),
    [("convert", "sd2core.cli.labels"), ("set", "sd2core.cli.labels.label_set")],
)
def test_labels_that_were_saved_while_the_command_ran_are_not_replaced(
    sd2: Sd2, anna: Path, monkeypatch: pytest.MonkeyPatch, command: str, module: str
) -> None:
    place = importlib.import_module(module)
    read = place.read_named

    def slow(options: object) -> object:
        found = read(options)
        written(anna, (0.0, 1.0, "saved meanwhile"))
        return found

    monkeypatch.setattr(place, "read_named", slow)
    told = ["--out", anna] if command == "convert" else ["--use", "usual", "--out", anna]
    outcome = sd2("labels", command, anna, *told, "--replace")
    assert outcome.code == 1
    assert f"{anna} was saved by a window or another program" in outcome.err
    assert [one.label for one in files.read_labels(anna).labels.spans] == ["saved meanwhile"]


def test_persons_are_shown_where_spans_name_some(sd2: Sd2, tmp_path: Path) -> None:
    path = written(tmp_path / "labels.json", (0.0, 1.0, "wave"))
    assert "person" not in sd2("labels", "show", path).out
    told = Span(2, "Gestures", 2.0, 3.0, "wave", person="anna")
    files.write_labels(path, Labels(spans=(told,)))
    heading, first, *_ = sd2("labels", "show", path).out.splitlines()
    assert heading.split()[6:] == ["label", "person", "track", "note"]
    assert "anna" in first
    assert json.loads(sd2("labels", "show", path, "--json").out)["spans"][0]["person"] == "anna"
