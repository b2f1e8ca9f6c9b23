"""``sd2 fit`` as a process that is killed, and as other programs see it."""

from __future__ import annotations

import io
import json
import os
import random
import signal
import subprocess
import sys
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zarr
from cli_outcome import Sd2
from filmed_people import empty_room, film, swiping

from sd2core.body.landmark_files import load_track
from sd2core.body.landmark_models import LandmarkModels
from sd2core.cli import build_parser, run
from sd2core.io.mesh import load_mesh

REPOSITORY = Path(__file__).resolve().parents[3]
FRAMES = 8
CHOICES = ("--resolution", "low", "--stature-m", "1.7")


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return film(tmp_path_factory.mktemp("clip") / "swipe.mp4", swiping()[0][:FRAMES])


def arguments(clip: Path, out: Path, *more: str) -> list[str]:
    return ["fit", str(clip), "--out", str(out), *CHOICES, *more]


class Process:
    """A real one, whose lines are read as they come."""

    def __init__(self, clip: Path, out: Path) -> None:
        words = [sys.executable, "-m", "sd2core.cli", *arguments(clip, out, "--progress-json")]
        self._process = subprocess.Popen(
            words,
            stdout=subprocess.PIPE,
            text=True,
            env=os.environ | {"PYTHONPATH": str(REPOSITORY)},
        )

    def run(self, kill_after: int | None = None) -> list[dict[str, Any]]:
        """Its lines; killed when there are so many."""
        assert self._process.stdout is not None
        lines = []
        for text in self._process.stdout:
            lines.append(json.loads(text))
            if len(lines) == kill_after:
                self._process.send_signal(signal.SIGKILL)
                break
        self._process.stdout.close()
        self.code = self._process.wait()
        return lines


def vertices(path: Path) -> np.ndarray:
    mesh = load_mesh(path)
    return np.asarray(mesh.read(0, mesh.frame_count))


def stages(lines: list[dict[str, Any]]) -> list[str]:
    return list(dict.fromkeys(line["stage"] for line in lines if line["event"] == "progress"))


@pytest.fixture(scope="module")
def lines(
    clip: Path, models: LandmarkModels, tmp_path_factory: pytest.TempPathFactory
) -> list[dict[str, Any]]:
    out = tmp_path_factory.mktemp("out") / "mesh.zarr"
    landmarks = out.with_name("landmarks.npz")
    words = arguments(clip, out, "--progress-json", "--landmarks", str(landmarks))
    printed = io.StringIO()
    with redirect_stdout(printed):
        assert run(build_parser(typed=words)[0], words) == 0
    return [json.loads(text) for text in printed.getvalue().splitlines()]


class TestLines:
    @pytest.mark.slow
    def test_the_start(self, lines: list[dict[str, Any]], clip: Path) -> None:
        start = next(line for line in lines if line["event"] == "start")
        assert start["format"] == "sd2-fit-progress"
        assert start["version"] == 1
        assert start["video"] == str(clip)
        assert (start["width"], start["height"], start["frames"]) == (320, 240, FRAMES)
        assert start["frames_per_s"] == pytest.approx(15.0)
        assert start["resumed"] is False
        assert stages(lines) == start["stages"]

    def test_every_stage_comes_to_its_end(self, lines: list[dict[str, Any]]) -> None:
        for stage in ("find", "refine", "fit", "write"):
            last = [
                line for line in lines if line["event"] == "progress" and line["stage"] == stage
            ][-1]
            assert last["done"] == last["total"] > 0
            assert last["unit"] == ("step" if stage == "fit" else "frame")

    def test_landmarks(self, lines: list[dict[str, Any]]) -> None:
        shown = [line for line in lines if line["event"] == "landmarks"]
        assert {line["stage"] for line in shown} == {"find", "refine"}
        for line in shown:
            points = np.array(line["image_px"])
            assert points.shape == (33, 2)
            assert np.median(np.abs(points - swiping()[1][line["frame"]])) < 5
            assert all(0.0 <= value <= 1.0 for value in line["visibility"])

    def test_the_end(self, lines: list[dict[str, Any]]) -> None:
        done = lines[-1]
        assert done["event"] == "done"
        assert done["frames"] == done["present"] == FRAMES
        mesh = load_mesh(done["out"])
        assert mesh.frame_count == FRAMES
        assert len(load_track(Path(done["out"]).with_name("landmarks.npz"))) == FRAMES
        about = zarr.open_group(done["out"], mode="r").attrs["fit"]
        assert about["camera"]["focal_px"] == pytest.approx(300.0)
        assert about["camera"]["source"] == "default"
        assert (about["stature_m"], about["stature_source"]) == (1.7, "user")
        assert about["video"] == "swipe.mp4"

    @pytest.mark.slow
    def test_an_error_is_a_line_too(self, sd2: Sd2, models: LandmarkModels, tmp_path: Path) -> None:
        path = film(tmp_path / "empty.mp4", [empty_room()] * 3)
        outcome = sd2(*arguments(path, tmp_path / "mesh.zarr", "--progress-json"))
        last = json.loads(outcome.out.splitlines()[-1])
        assert outcome.code == 1
        assert last["event"] == "error"
        assert last["text"].startswith("No person was found in")
        assert not list(tmp_path.glob("mesh*"))


class TestKilled:
    def kill_and_resume(self, clip: Path, out: Path, kills: list[int]) -> None:
        for number, kill_after in enumerate([*kills, None]):
            process = Process(clip, out)
            lines = process.run(kill_after)
            if lines[-1]["event"] == "done":
                assert [path.name for path in out.parent.glob(f"{out.name}*")] == [out.name]
                return
            assert process.code == -signal.SIGKILL, lines[-1]
            start = [line for line in lines if line["event"] == "start"]
            if number and start:
                assert start[0]["resumed"] is True
            # Nothing, or all of it: it may have ended before it was killed.
            if out.exists():
                return
        pytest.fail(f"Not done after {kills}")

    @pytest.mark.slow
    @pytest.mark.skipif(os.name == "nt", reason="SIGKILL")
    def test_a_killed_process_goes_on(
        self, clip: Path, models: LandmarkModels, tmp_path: Path
    ) -> None:
        self.kill_and_resume(clip, tmp_path / "mesh.npz", [10])
        assert vertices(tmp_path / "mesh.npz").shape == (FRAMES, 1229, 3)
        assert [path.name for path in tmp_path.iterdir()] == ["mesh.npz"]

    @pytest.mark.skipif(os.name == "nt", reason="flock")
    def test_two_at_once(
        self, sd2: Sd2, clip: Path, models: LandmarkModels, tmp_path: Path
    ) -> None:
        import fcntl

        out = tmp_path / "mesh.npz"
        partial = tmp_path / "mesh.npz.partial"
        partial.mkdir()
        with (partial / "lock").open("ab") as held:
            fcntl.flock(held, fcntl.LOCK_EX)
            outcome = sd2(*arguments(clip, out, "--restart"))
        assert outcome.code == 1
        assert f"{partial} is in use" in outcome.err

    @pytest.mark.slow
    @pytest.mark.skipif(os.name == "nt", reason="SIGKILL")
    @pytest.mark.parametrize("name", ["mesh.zarr", "mesh.npz"])
    def test_killed_at_random_moments_it_makes_the_same_mesh(
        self, clip: Path, models: LandmarkModels, tmp_path: Path, name: str
    ) -> None:
        whole = tmp_path / f"whole-{name}"
        count = len(Process(clip, whole).run())
        rng = random.Random(4)
        for number in range(4):
            out = tmp_path / str(number) / name
            out.parent.mkdir()
            kills = [rng.randint(1, count) for _ in range(rng.randint(1, 3))]
            self.kill_and_resume(clip, out, kills)
            np.testing.assert_array_equal(vertices(out), vertices(whole))


class TestOutput:
    @pytest.mark.slow
    def test_facts_and_landmarks(
        self, sd2: Sd2, clip: Path, models: LandmarkModels, tmp_path: Path
    ) -> None:
        out, landmarks = tmp_path / "mesh.npz", tmp_path / "landmarks.npz"
        more = ("--json", "--landmarks", str(landmarks), "--field-of-view", "60")
        outcome = sd2(*arguments(clip, out, *more))
        assert outcome.code == 0, outcome.err
        about = json.loads(outcome.out)
        assert about["frames"] == about["present"] == len(load_track(landmarks)) == FRAMES
        assert about["camera"]["source"] == "user"
        assert about["camera"]["focal_px"] == pytest.approx(160 / np.tan(np.radians(30)))
        assert vertices(out).shape == (FRAMES, 1229, 3)
        with np.load(out) as arrays:
            assert json.loads(str(arrays["fit"]))["camera"] == about["camera"]

    @pytest.mark.slow
    def test_two_frames_and_one_without_anybody(
        self, sd2: Sd2, models: LandmarkModels, tmp_path: Path
    ) -> None:
        pictures = swiping()[0]
        empty = [empty_room()] * 12
        path = film(tmp_path / "short.mp4", [pictures[0], pictures[1], *empty, pictures[2]])
        outcome = sd2("fit", path, "--out", tmp_path / "mesh.zarr", "--resolution", "low")
        assert outcome.code == 0, outcome.err
        mesh = load_mesh(tmp_path / "mesh.zarr")
        assert mesh.present is not None
        np.testing.assert_array_equal(np.flatnonzero(mesh.present), [0, 1, 14])
        assert "Left empty, without the person: 12 frames (" in outcome.out
        assert np.isfinite(vertices(tmp_path / "mesh.zarr")).all()

    @pytest.mark.parametrize(
        ("name", "said"),
        [
            ("mesh.obj", "a name that ends in .zarr or .npz"),
            ("notes.npz/mesh.zarr", "notes.npz is a file"),
            ("notes.npz", "notes.npz exists and is no mesh"),
            ("group.zarr", "group.zarr exists and is no mesh"),
            ("taken.npz", "taken.npz.partial exists and is not what a stopped fit has left"),
        ],
    )
    def test_what_cannot_be_written_is_said_first(
        self,
        sd2: Sd2,
        tmp_path: Path,
        monkeypatch: pytest.MonkeyPatch,
        name: str,
        said: str,
    ) -> None:
        def must_not_work(*_: object, **__: object) -> None:
            raise AssertionError("worked in vain")

        monkeypatch.setattr("sd2core.body.fit_video.landmark_models", must_not_work)
        np.savez(tmp_path / "notes.npz", a=1)
        (tmp_path / "group.zarr").mkdir()
        (tmp_path / "taken.npz.partial").mkdir()
        (tmp_path / "taken.npz.partial" / "thesis.tex").touch()
        outcome = sd2(
            "fit", tmp_path / "clip.mp4", "--out", tmp_path / name, "--restart", "--overwrite"
        )
        assert outcome.code == 1
        assert said in outcome.err
        assert (tmp_path / "taken.npz.partial" / "thesis.tex").exists()

    @pytest.mark.parametrize(
        ("content", "said"),
        [(None, "does not exist"), (b"", "clip.mp4"), (b"no video" * 99, "clip.mp4")],
    )
    def test_what_is_no_video(
        self, sd2: Sd2, models: LandmarkModels, tmp_path: Path, content: bytes | None, said: str
    ) -> None:
        if content is not None:
            (tmp_path / "clip.mp4").write_bytes(content)
        outcome = sd2("fit", tmp_path / "clip.mp4", "--out", tmp_path / "mesh.zarr")
        assert outcome.code == 1
        assert said in outcome.err
        assert not list(tmp_path.glob("mesh*"))

    @pytest.mark.parametrize(
        "words",
        [
            ("--person-box", "1,2,3"),
            ("--person-box", "1,2,0,4"),
            ("--person-box", "1,2,nan,4"),
            ("--person-frame", "-1"),
            ("--resolution", "huge"),
            ("--stature-m", "0"),
            ("--stature-m", "178"),
            ("--field-of-view", "500"),
            ("--json", "--progress-json"),
        ],
    )
    def test_usage(self, sd2: Sd2, words: tuple[str, ...]) -> None:
        assert sd2("fit", "clip.mp4", "--out", "mesh.zarr", *words).code == 2

    def test_a_frame_without_a_rectangle(self, sd2: Sd2, tmp_path: Path) -> None:
        outcome = sd2("fit", "clip.mp4", "--out", tmp_path / "m.zarr", "--person-frame", "3")
        assert (outcome.code, "--person-frame is given without" in outcome.err) == (1, True)

    def test_only_a_folder_of_models(self, sd2: Sd2, clip: Path, tmp_path: Path) -> None:
        outcome = sd2("fit", clip, "--out", tmp_path / "m.zarr", "--models", tmp_path)
        assert outcome.code == 1
        assert f"is not in {tmp_path}" in outcome.err
