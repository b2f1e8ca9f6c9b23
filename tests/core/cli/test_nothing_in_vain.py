"""No file is overwritten, no work done, no option given in vain."""

from __future__ import annotations

import json
import pickle
from pathlib import Path

import numpy as np
import pytest
from cli_outcome import Sd2

from sd2core.cli import build_parser
from sd2core.cli.command_parser import record_of
from sd2core.doppler.options import chosen_options
from sd2core.maps import DopplerMap
from sd2core.recording.recording import MeshReading, Recording, open_recording


def must_not_work(*_: object, **__: object) -> None:
    raise AssertionError("worked although the result cannot be written")


class TestOutput:
    @pytest.mark.parametrize("of_recording", [False, True])
    def test_a_mesh_is_not_replaced_by_its_map(
        self, sd2: Sd2, plate: Path, tmp_path: Path, of_recording: bool
    ) -> None:
        before = plate.read_bytes()
        Recording.create(tmp_path / "a.sd2", mesh=plate)
        source = tmp_path / "a.sd2" if of_recording else plate
        assert f"{plate} exists" in sd2("synth", source, "--out", plate).err
        outcome = sd2("synth", source, "--out", plate, "--overwrite")
        assert outcome.code == 1
        assert f"{plate} exists and is a mesh" in outcome.err
        assert plate.read_bytes() == before

    def test_nor_by_a_link_to_it(self, sd2: Sd2, plate: Path, tmp_path: Path) -> None:
        before = plate.read_bytes()
        (tmp_path / "link.npz").symlink_to(plate)
        assert sd2("synth", plate, "--out", tmp_path / "link.npz", "--overwrite").code == 1
        assert plate.read_bytes() == before

    def test_a_map_and_an_empty_file_are_replaced(
        self, sd2: Sd2, plate: Path, tmp_path: Path
    ) -> None:
        out = tmp_path / "map.npz"
        out.touch()
        for bins, words in ((16, ()), (32, ("--overwrite",))):
            assert sd2("synth", plate, "--out", out, "--bins", bins, *words).code == 0
            assert DopplerMap.load(out).axis.bins == bins

    @pytest.mark.parametrize("command", ["synth", "radar"])
    def test_what_cannot_be_written_is_said_before_the_work(
        self,
        sd2: Sd2,
        plate: Path,
        tmp_path: Path,
        command: str,
        monkeypatch: pytest.MonkeyPatch,
    ) -> None:
        def refuse(name: str, *_: object) -> None:
            raise PermissionError(13, "Permission denied", name)

        monkeypatch.setattr("sd2core.io.mesh.load_mesh", must_not_work)
        monkeypatch.setattr("sd2core.io.radar.load_capture", must_not_work)
        (tmp_path / "folder.npz").mkdir()
        outcome = sd2(command, plate, "--out", tmp_path / "folder.npz")
        assert outcome.code == 1
        assert "folder.npz is a folder" in outcome.err
        monkeypatch.setattr("sd2core.files.atomic.os.open", refuse)
        outcome = sd2(command, plate, "--out", tmp_path / "map.npz")
        assert outcome.code == 1
        assert "map.npz cannot be written (Permission denied)" in outcome.err


class TestReading:
    """How to read a mesh may be said of a recording's, too; it is not stored."""

    def test_the_command_line_holds_before_the_recording(
        self, sd2: Sd2, plate: Path, tmp_path: Path
    ) -> None:
        stored = MeshReading(frames_per_s=15.0, distance_m=1.0)
        folder = Recording.create(tmp_path / "a.sd2", mesh=plate, mesh_reading=stored).folder
        data = json.loads(sd2("info", folder, "--fps", "60", "--scale", "0.5", "--json").out)
        assert data["mesh"]["frames_per_s"] == pytest.approx(60)
        assert data["mesh"]["first_frame_max_m"] == pytest.approx([0.05, 0.05, 2.5])
        out = tmp_path / "map.npz"
        assert sd2("synth", folder, "--out", out, "--fps", "60").code == 0
        assert DopplerMap.load(out).timebase.frames_per_s == pytest.approx(60)
        assert open_recording(folder).mesh_reading == stored

    def test_faces_for_a_recording(self, sd2: Sd2, plate: Path, tmp_path: Path) -> None:
        np.save(tmp_path / "faces.npy", np.array([[0, 9, 1]]))
        folder = Recording.create(tmp_path / "a.sd2", mesh=plate).folder
        data = json.loads(sd2("info", folder, "--faces", tmp_path / "faces.npy", "--json").out)
        assert data["mesh"]["faces"] == 1
        outcome = sd2("info", folder, "--faces", tmp_path / "no.npy")
        assert outcome.code == 1
        assert "no.npy does not exist" in outcome.err

    def test_which_person_of_a_recording(self, sd2: Sd2, tmp_path: Path) -> None:
        def person(frames: int) -> dict[str, np.ndarray]:
            vertices = np.random.default_rng(0).normal(0, 0.3, (frames, 20, 3))
            return {"verts": vertices, "frame_ids": np.arange(frames)}

        (tmp_path / "two.pkl").write_bytes(pickle.dumps({1: person(3), 2: person(5)}))
        folder = Recording.create(tmp_path / "a.sd2", mesh=tmp_path / "two.pkl").folder
        for number, frames in ((1, 3), (2, 5)):
            data = json.loads(sd2("info", folder, "--person", number, "--json").out)
            assert data["mesh"]["frames"] == frames

    @pytest.mark.parametrize("option", [("--person", "3"), ("--focal-px", "600")])
    def test_an_option_that_says_nothing_to_a_mesh(
        self, sd2: Sd2, plate: Path, tmp_path: Path, option: tuple[str, str]
    ) -> None:
        folder = Recording.create(tmp_path / "a.sd2", mesh=plate).folder
        for path in (plate, folder):
            outcome = sd2("info", path, *option)
            assert (outcome.code, outcome.out) == (1, "")
            assert f"{option[0]} is given" in outcome.err
        assert sd2("synth", plate, "--out", tmp_path / "map.npz", *option).code == 1

    def test_an_option_where_no_mesh_is(self, sd2: Sd2, plate: Path, tmp_path: Path) -> None:
        out = tmp_path / "map.npz"
        assert sd2("synth", plate, "--out", out).code == 0
        outcome = sd2("info", out, "--fps", "60")
        assert outcome.code == 1
        assert "--fps is given" in outcome.err
        assert "holds no mesh" in outcome.err


@pytest.mark.parametrize(
    ("bins", "v_max_mps", "nulled"),
    [(32, 10.0, (15, 16)), (8, 2.0, (3, 4)), (5, 2.0, (2,)), (4, 20.0, (1, 2))],
)
def test_wide_bins_at_zero_are_nulled(bins: int, v_max_mps: float, nulled: tuple[int, ...]) -> None:
    arguments = ["synth", "a", "--out", "b.npz", "--bins", str(bins), "--v-max", str(v_max_mps)]
    typed = record_of(build_parser()[0].parse_args(arguments))
    assert chosen_options(typed).null_bins == nulled


def test_the_nulled_velocities_are_said(sd2: Sd2, plate: Path, tmp_path: Path) -> None:
    out = tmp_path / "map.npz"
    for arguments, said in (
        ((), "14, 15, 16: -0.25 to 0.125 m/s"),
        (("--v-max", "10"), "15, 16: -0.625 to 0.625 m/s"),
        (("--null-bins", "0,15"), "0, 15: -2 to -1.875, -0.125 to 0 m/s"),
    ):
        assert (
            f"nulled bins  {said}\n"
            in sd2("synth", plate, "--out", out, "--overwrite", *arguments).out
        )
