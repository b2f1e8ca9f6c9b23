"""``sd2 classify`` from labelled maps to tables."""

from __future__ import annotations

import json
from pathlib import Path
from shutil import copytree

import numpy as np
import pytest
from cli_outcome import Sd2

from sd2core.classify import training
from sd2core.files.resources import resource_path
from sd2core.labels.files import read_labels
from sd2core.maps import DopplerMap
from sd2core.pairs.store import PairWriter, Take
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase

AXIS = VelocityAxis(32, 2.0)
NULLED = (14, 15, 16)
LABELS = ("background", "left-to-right", "up-to-down")
SAMPLE = resource_path("swipes.sd2")


def energies(label: np.ndarray, seed: int) -> np.ndarray:
    """Noise, and a target at a velocity of the class."""
    values = np.random.default_rng(seed).exponential(1.0, (len(label), 32))
    for number, place in ((1, 25), (2, 5)):
        values[label == number, place] += 200.0
    values[:, list(NULLED)] = 0.0
    return values.astype(np.float32)


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four people, three takes each, whose classes can be told at once."""
    path = tmp_path_factory.mktemp("pairs") / "own.zarr"
    writer = PairWriter(
        path,
        kind="simulated",
        axis=AXIS,
        null_bins=NULLED,
        frame_rate_hz=30.0,
        labels=LABELS,
        provenance={},
    )
    for person in range(4):
        for number in range(3):
            label = np.repeat([0, 1, 0, 2, 0], 12).astype(np.int8)
            seed = 10 * person + number
            writer.append(
                Take(
                    f"s{person}",
                    f"take-{number}",
                    0.01 * energies(label, seed),
                    energies(label, seed + 100),
                    np.arange(60) / 30.0,
                    label,
                    np.zeros(3),
                )
            )
    return path


@pytest.fixture(scope="module")
def model(store: Path) -> Path:
    from sd2app.command_line import main

    path = store.parent / "model.safetensors"
    learnt = ("--steps", "60", "--learning-rate", "0.03", "--delay-s", "0.1")
    assert main(["classify", "train", str(store), "--out", str(path), *learnt]) == 0
    return path


@pytest.fixture
def shown(tmp_path: Path) -> Path:
    """A map with one gesture of each class, from 0.4 s and from 1.2 s on for 0.4 s."""
    label = np.repeat([0, 1, 0, 2, 0], 12)
    path = tmp_path / "map.npz"
    DopplerMap(
        energies(label, 7).T, AXIS, Timebase.regular(60, 30.0), "real", null_bins=NULLED
    ).save(path)
    return path


def test_a_classifier_is_trained_described_and_judged(
    sd2: Sd2, store: Path, model: Path, tmp_path: Path
) -> None:
    run = json.loads(model.with_suffix(".json").read_text("utf-8"))
    split = run["card"]["about"]["split"]
    assert split == {
        "by_movement": False,
        "training": ["s0", "s1"],
        "validation": ["s2"],
        "test": ["s3"],
    }
    assert run["events"][0]["event"] == "start"
    described = sd2("info", model)
    assert described.code == 0
    assert "background, horizontal, vertical" in described.out
    assert "simulated maps" in described.out
    plot = tmp_path / "matrix.png"
    judged = sd2("classify", "eval", store, "--model", model, "--json", "--figure", plot)
    told = json.loads(judged.out)
    assert told["subjects"] == ["s3"]
    assert told["learnt_from"] == []
    assert told["mean_recall_frames"] > 0.8
    assert np.sum(told["frames"]) == 180
    assert np.sum(told["gestures"]) == 6
    assert plot.read_bytes().startswith(b"\x89PNG")
    everybody = sd2("classify", "eval", store, "--model", model, "--subjects", "all")
    assert "was trained on, or chosen by, s0, s1, s2:" in everybody.out
    assert "taken for horizontal" in everybody.out


def test_who_was_seen_from_other_places_alone_is_judged_from_the_first(
    sd2: Sd2, store: Path, model: Path, tmp_path: Path
) -> None:
    """As a batch's grid of places has them, without the recording's own."""
    elsewhere = tmp_path / "elsewhere.zarr"
    copytree(store, elsewhere)
    index = elsewhere / "takes.jsonl"
    index.write_text(index.read_text().replace('"placement": 0', '"placement": 2'))
    judged, same = (
        json.loads(sd2("classify", "eval", one, "--model", model, "--json").out)
        for one in (elsewhere, store)
    )
    assert judged == same


def test_progress_is_told_to_other_programs(sd2: Sd2, store: Path, tmp_path: Path) -> None:
    told = sd2(
        *("classify", "train", store, "--out", tmp_path / "m.safetensors", "--steps", 3),
        "--progress-json",
    )
    lines = [json.loads(line) for line in told.out.splitlines()]
    events = [one["event"] for one in lines]
    assert events == ["start", "step", "step", "step", "check", "end", "written"]
    assert lines[0]["steps"] == 3


@pytest.mark.slow
def test_who_stops_keeps_the_best(
    sd2: Sd2, store: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    step = training._ClassifierLoop.step

    def interrupted(loop: training._ClassifierLoop) -> None:
        if loop.position.steps_done == 40:
            raise KeyboardInterrupt
        step(loop)

    monkeypatch.setattr(training._ClassifierLoop, "step", interrupted)
    out = tmp_path / "m.safetensors"
    told = sd2("classify", "train", store, "--out", out, "--json")
    assert told.code == 130
    assert json.loads(told.out)["interrupted"]
    assert sd2("classify", "eval", store, "--model", out).code == 0


def test_gestures_of_a_map_become_labels(
    sd2: Sd2, model: Path, shown: Path, tmp_path: Path
) -> None:
    out, values = tmp_path / "found.json", tmp_path / "p.npz"
    told = sd2(
        *("classify", "apply", shown, "--model", model, "--out", out),
        *("--probabilities", values, "--json"),
    )
    spans = json.loads(told.out)["spans"]
    assert [one["label"] for one in spans] == ["horizontal", "vertical"]
    for span, start_s in zip(spans, (0.4, 1.2), strict=True):
        assert span["start_s"] == pytest.approx(start_s, abs=0.15)
        assert span["end_s"] == pytest.approx(start_s + 0.4, abs=0.15)
        assert span["confidence"] > 0.5
    written = read_labels(out).labels
    assert [one.origin for one in written.spans] == ["suggestion"] * 2
    with np.load(values) as held:
        assert held["probabilities"].shape == (60, 3)
        assert list(held["classes"]) == ["background", "horizontal", "vertical"]
        np.testing.assert_allclose(held["probabilities"].sum(axis=1), 1.0, atol=1e-5)
    words = sd2("classify", "apply", shown, "--model", model)
    assert "2 gestures in the real map" in words.out
    again = sd2("classify", "apply", shown, "--model", model, "--out", out)
    assert again.code == 1
    assert "--overwrite" in again.err


@pytest.mark.slow
def test_a_classifier_is_judged_on_a_labelled_recording(sd2: Sd2, model: Path) -> None:
    judged = sd2(
        *("classify", "eval", f"anna={SAMPLE}", "--maps", "synthetic", "--model", model, "--json")
    )
    found = json.loads(judged.out)
    assert found["subjects"] == ["anna"]
    assert np.sum(found["gestures"]) == 8


@pytest.mark.parametrize("chosen", [("--of", "radar"), ()])
def test_a_capture_of_a_recording_is_seen_as_the_classifier_learnt(
    sd2: Sd2, model: Path, chosen: tuple[str, ...]
) -> None:
    found = sd2("classify", "apply", SAMPLE, *chosen, "--model", model, "--json")
    assert found.code == 0, found.err
    assert json.loads(found.out)["map_kind"] == "simulated"


@pytest.mark.slow
def test_a_table_is_a_study_that_is_made_once(sd2: Sd2, store: Path, tmp_path: Path) -> None:
    arguments = ("classify", "table", store, "--out", tmp_path, "--seeds", 1, "--steps", 2)
    arguments = (*arguments, "--shares", "50%,100%", "--same-people", "--workers", 1)
    first = sd2(*arguments)
    assert first.code == 0, first.err
    runs = {path: path.stat().st_mtime_ns for path in (tmp_path / "runs").iterdir()}
    assert len(runs) == 2 * 5
    told = json.loads(sd2(*arguments, "--json").out)
    assert {path: path.stat().st_mtime_ns for path in (tmp_path / "runs").iterdir()} == runs
    assert told["conclusion"] in first.out
    for name in ("study.md", "study.json", "confusion.png", "curve.png"):
        assert (tmp_path / name).stat().st_size
    # The plan of the study is there to go on from.
    again = sd2("study", tmp_path / "study.toml", "--json", "--workers", 1)
    assert json.loads(again.out) == told
    content = json.loads((tmp_path / "study.json").read_text("utf-8"))
    assert content["radar"] == "simulated"
    assert {"radar alone", "+ synthetic", "kernel, columns, after 0.9 s"} <= {
        one["title"] for one in content["totals"]
    }


@pytest.mark.slow
def test_real_radar_files_have_classes_of_their_own(
    sd2: Sd2, shared_data: Path, tmp_path: Path
) -> None:
    folder = shared_data / "radar" / "kkt_gestures"
    told = sd2(
        *("classify", "table", folder, "--out", tmp_path, "--seeds", 1, "--steps", 2),
        *("--shares", "100%", "--workers", 1, "--progress-json"),
    )
    events = [json.loads(line) for line in told.out.splitlines()]
    assert events[0] == {"event": "run", "done": 0, "total": 5, "elapsed_s": 0.0} | {
        "elapsed_s": events[0]["elapsed_s"]
    }
    assert events[-1]["event"] == "written"
    found = json.loads((tmp_path / "study.json").read_text("utf-8"))
    assert found["classes"] == ["background", "FirstGesture", "SecondGesture", "ThirdGesture"]
    assert found["radar"] == "real"
    assert found["takes"] == {"one person": 8}
    assert found["findings"] == []


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("train", "nowhere.zarr", "--out", "m.safetensors"), "nowhere.zarr does not exist"),
        (("train", "STORE", "--out", "m.pt"), "ends in .safetensors"),
        (("train", "STORE", "--out", "m.safetensors", "--maps", "colour"), "The maps are"),
        (
            ("train", "anna=STORE", "--out", "m.safetensors"),
            "pairs and data sets say whose they are",
        ),
        (("train", "STORE", "--out", "m.safetensors", "--test-subjects", "s9"), "'s9'"),
        (("train", "MAP", "--out", "m.safetensors"), "nothing with labels"),
        (("eval", "STORE", "--model", "MAP"), "no model file"),
        (("eval", "STORE", "--model", "MODEL", "--subjects", "s9"), "nothing of s9"),
        (("apply", "STORE", "--model", "MODEL"), "is a pairs"),
        (("apply", "MAP", "--model", "DENOISER"), "is a denoiser"),
        (("apply", "MAP", "--of", "radar", "--model", "MODEL"), "--of"),
        (("table", "MAP", "--out", "t"), "is a map"),
    ],
)
def test_what_cannot_be_done_is_explained(
    sd2: Sd2,
    store: Path,
    model: Path,
    shown: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    arguments: tuple[str, ...],
    words: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    names = {"STORE": store, "MAP": shown, "MODEL": model}
    names["DENOISER"] = resource_path("denoiser.safetensors")
    given = [str(names.get(one, one)).replace("STORE", str(store)) for one in arguments]
    told = sd2("classify", *given)
    assert told.code == 1
    assert words in told.err
    assert "Traceback" not in told.err
