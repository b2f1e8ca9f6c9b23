"""Plug-ins: each is used as what is built in, imported when needed, and refused in words."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from added_plug_ins import Install

import sd2core as sd2
from sd2app import doctor
from sd2app.command_line import main
from sd2core.batch.plan_file import plan_from_text
from sd2core.cli import build_parser
from sd2core.cli.command_parser import commands_of
from sd2core.errors import Sd2Error
from sd2core.files.resources import resource_path
from sd2core.io.kinds import kind_of
from sd2core.io.radar import load_capture, named_radar
from sd2core.io.readers import FileReader
from sd2core.labels.formats import all_formats, read_labels, write_labels
from sd2core.labels.spans import Labels, LabelTrack, Span
from sd2core.timebase import Timebase

GROUPS = ("radars", "radar_files", "mesh_files", "label_files", "denoisers", "classifiers",
          "commands", "live_radars")  # fmt: skip
RADAR = """
from sd2core import PAPER_RADAR
SD2_PLUGIN_API = 1
RADAR = PAPER_RADAR
"""
READER = """
from sd2core.io.mesh_arrays import RawMesh
from sd2core.io.readers import FileReader
SD2_PLUGIN_API = 1
def read(path, hints):
    return {result}
READER = FileReader(read, (".points",))
"""


def imported() -> set[str]:
    return {name for name in sys.modules if name.startswith("sd2_sample.")}


def refusal(call: object, *arguments: object) -> str:
    with pytest.raises(Sd2Error) as caught:
        call(*arguments)  # type: ignore[operator]
    return str(caught.value)


@pytest.fixture
def points(tmp_path: Path) -> Path:
    path = tmp_path / "walk.points"
    np.savetxt(path, np.tile([0.0, 0.0, 2.0, 0.1, 0.0, 2.0], (4, 1)))
    return path


@pytest.mark.usefixtures("sample")
class TestEach:
    def test_radar(self) -> None:
        assert named_radar("tea-radar").name == "Tea radar"
        assert imported() == {"sd2_sample.radar"}
        assert "tea-radar" in refusal(named_radar, "coffee-radar")

    def test_radar_of_a_plan_is_no_file(self, tmp_path: Path) -> None:
        text = (
            'format = "sd2-batch-plan"\nversion = 1\nout = "o"\n[recordings]\nfiles = ["a.sd2"]\n'
            '[synthesise]\n[simulate]\nradar = "{}"\n'
        )
        radars = []
        for name in ("tea-radar", "radar.json"):
            plan = plan_from_text(text.format(name), tmp_path)
            assert plan.simulate is not None
            radars.append(plan.simulate.radar)
        assert radars == ["tea-radar", str(tmp_path / "radar.json")]

    def test_capture(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        path = tmp_path / "walk.tea"
        radar = sd2.PAPER_RADAR
        shape = (3, radar.channels, radar.chirps_per_frame, radar.samples_per_chirp)
        np.full(shape, 2048, np.uint16).tofile(path)
        assert "hold one value" in refusal(load_capture, path)  # looked at as any other
        np.random.default_rng(1).integers(2000, 2100, shape).astype(np.uint16).tofile(path)
        capture = load_capture(path)
        assert capture.samples.shape == shape
        assert kind_of(path) == "radar"
        late = replace(capture, timebase=capture.timebase.shifted(1.7e9))
        reader = FileReader(lambda path: late, (".tea",))
        monkeypatch.setattr(sys.modules["sd2_sample.captures"], "READER", reader)
        assert "from 1.7e+09 s on. Expected: its first frame at 0 s" in refusal(load_capture, path)

    def test_radar_that_is_listened_to(self, tmp_path: Path) -> None:
        out = tmp_path / "cup.sd2"
        words = ["listen", "--radar", "tea-cup:0.7", "--out", str(out), "--seconds", "1", "--json"]
        assert main(words) == 0
        assert imported() == {"sd2_sample.live"}
        found = sd2.doppler_map(sd2.load_capture(out / "radar"), bins=33, v_max_mps=2.0)
        assert found.values.shape[1] > 10
        assert found.axis.centres_mps[found.values.sum(axis=1).argmax()] == pytest.approx(
            0.7, abs=0.1
        )
        from sd2core.live.radars import open_radar

        assert "test, a121, ti, tea-cup; or a capture" in refusal(open_radar, "coffee-cup")
        assert "(live_radars) of the package sd2-sample failed (ValueError" in refusal(
            open_radar, "tea-cup:hot"
        )

    def test_mesh(self, points: Path) -> None:
        mesh = sd2.load_mesh(points, scale=2.0)
        assert (mesh.frame_count, mesh.vertex_count) == (4, 2)
        assert mesh.timebase.times_s[1] == pytest.approx(0.04)
        assert mesh.vertices[0, 0, 2] == 4.0
        assert kind_of(points) == "mesh"

    def test_labels(self, tmp_path: Path) -> None:
        clock = Timebase.regular(90, 30.0)
        span = Span(1, "Gestures", 1.0, 2.0, "swipe")
        labels = Labels((LabelTrack("Gestures"),), (span,))
        for name, kind in (("a.tealabels", None), ("a.txt", "tea-labels")):
            write_labels(tmp_path / name, labels, clock, kind)
            found = read_labels(tmp_path / name, clock, kind).spans
            assert [(one.start_s, one.end_s, one.label) for one in found] == [(1.0, 2.0, "swipe")]
        assert all_formats()[-1].title == "Tea"

    def test_denoiser(self, tmp_path: Path) -> None:
        from small_pairs import write_pairs

        from sd2core.options.training import DataConfig, ModelConfig, TrainConfig, TrainingConfig
        from sd2core.train.start import begin

        pairs = write_pairs(tmp_path / "pairs.zarr", frames=60)
        config = TrainConfig(
            DataConfig(pairs=(pairs,), segment_frames=20, overlap_frames=4),
            ModelConfig(name="blur", options={"width": 2}),
            TrainingConfig(epochs=1, batch_size=8),
        )
        model = sd2.load_model(begin(config, tmp_path / "run").model or "")
        assert (model.card.model, model.card.package) == ("blur", "sd2-sample")
        assert model.card.options == {"width": 2, "skip": True}

    def test_classifier(self, tmp_path: Path) -> None:
        from sd2core.classify.files import load_classifier, save_classifier
        from sd2core.classify.training import train

        known, chosen = small_training()
        made = train(known.clips[:4], known.clips[4:], known, chosen)
        card = save_classifier(tmp_path / "a.safetensors", made.classifier)
        assert (card.model, card.package) == ("dense", "sd2-sample")
        assert load_classifier(tmp_path / "a.safetensors").card == card

    def test_command(self, capsys: pytest.CaptureFixture[str]) -> None:
        assert main(["greet", "--name", "Anna"]) == 0
        assert capsys.readouterr().out == "Hello, Anna.\n"
        assert imported() == {"sd2_sample.command"}
        assert main(["greet", "--nme", "Anna"]) == 2
        assert "Did you mean --name?" in capsys.readouterr().err
        assert "greet" in {one.name for one in commands_of(build_parser()[0])}

    def test_the_help_looks_for_none_and_names_who_lists_them(
        self, capsys: pytest.CaptureFixture[str]
    ) -> None:
        with pytest.raises(SystemExit):
            main(["--help"])
        listed = capsys.readouterr().out
        assert "greet" not in listed
        assert "`sd2 doctor` lists those of plug-ins" in listed
        assert not imported()

    def test_all_are_listed_by_the_doctor(self) -> None:
        found = doctor.plug_in_findings()
        assert [one.state for one in found] == ["ok"] * len(GROUPS)
        assert {one.found.partition("(")[2].partition(")")[0] for one in found} == {*GROUPS}
        assert all(one.found.endswith("of sd2-sample") for one in found)


def small_training() -> tuple:  # type: ignore[type-arg]
    """Clips of two people, and a training of a few steps."""
    from sd2core.classify.data import Clip, ClipSet
    from sd2core.classify.training import TrainOptions

    axis = sd2.VelocityAxis(8, 2.0)
    rng = np.random.default_rng(0)
    label = np.repeat([0, 1], 30).astype(np.int8)
    clips = tuple(
        Clip("ab"[n // 4], f"t{n}", "simulated", rng.random((60, 8), np.float32), label, 0)
        for n in range(8)
    )
    known = ClipSet(axis, (), 30.0, ("background", "swipe"), clips)
    return known, TrainOptions(model="dense", delay_s=0.0, steps=2, batch=4, check_steps=1)


@pytest.mark.usefixtures("sample")
def test_none_is_looked_for_where_it_is_not_needed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def looked_for(**_: str) -> None:
        raise AssertionError("looked for plug-ins")

    monkeypatch.setattr("importlib.metadata.entry_points", looked_for)
    sample = resource_path("swipes.sd2")
    named_radar("paper")
    load_capture(sample / "radar")
    sd2.load_mesh(sample / "mesh.zarr")
    sd2.load_model("denoiser")
    with pytest.raises(Sd2Error, match="does not exist"):
        read_labels(tmp_path / "labels.json")
    assert main(["info", str(sample)]) == 0
    assert main(["synth"]) == 2
    assert not imported()


class TestRefusals:
    @pytest.mark.parametrize(
        ("text", "words"),
        [
            ("import nothing_of_this_name", "cannot be loaded (ModuleNotFoundError"),
            ("SD2_PLUGIN_API = 1", "cannot be loaded (AttributeError"),
            ("RADAR = 1", "does not say its version. Expected: SD2_PLUGIN_API = 1"),
            ("SD2_PLUGIN_API = 2\nRADAR = 1", "is of version 2. Expected: SD2_PLUGIN_API = 1"),
            ("SD2_PLUGIN_API = 1\nRADAR = 1", "gives a int. Expected: a RadarConfig"),
        ],
    )
    def test_what_cannot_be_used(self, install: Install, text: str, words: str) -> None:
        install("bad-package", "radars", "bad = added:RADAR", text)
        said = refusal(named_radar, "bad")
        assert said.startswith("The plug-in bad (radars) of the package bad-package ")
        assert words in said
        assert said.endswith("Update bad-package, or uninstall it.")
        assert named_radar("paper") is sd2.PAPER_RADAR
        (finding,) = doctor.plug_in_findings()
        assert finding.state == "problem"
        assert words in finding.found

    def test_the_name_of_what_is_built_in(self, install: Install) -> None:
        install("bad-package", "radars", "paper = added:RADAR", RADAR + "RADAR = None")
        assert named_radar("paper") is sd2.PAPER_RADAR
        (finding,) = doctor.plug_in_findings()
        assert "called like what is built in" in finding.found
        assert finding.remedy == "Uninstall bad-package"

    def test_two_of_one_name(self, install: Install) -> None:
        install("one-package", "radars", "tea = added:RADAR", RADAR)
        install("other-package", "radars", "tea = other:RADAR", RADAR)
        said = refusal(named_radar, "tea")
        assert "one-package" in said
        assert "Uninstall one-package or other-package" in said
        assert [one.state for one in doctor.plug_in_findings()] == ["problem"] * 2

    def test_a_file_that_two_read(self, install: Install, points: Path) -> None:
        text = READER.format(result="None")
        install("one-package", "mesh_files", "one = added:READER", text)
        install("other-package", "mesh_files", "two = other:READER", text)
        assert "is read by plug-ins of one-package and other-package" in refusal(
            sd2.load_mesh, points
        )

    @pytest.mark.parametrize(
        ("result", "words"),
        [
            ("None", "gives a NoneType. Expected: a RawMesh"),
            ("1 / 0", "failed (ZeroDivisionError"),
            ("RawMesh([[[0.0, 0.0, 2.0]]], notes='Read.')", "failed (TypeError: the notes are"),
        ],
    )
    def test_a_reader_that_fails(
        self, install: Install, points: Path, result: str, words: str
    ) -> None:
        install("bad-package", "mesh_files", "bad = added:READER", READER.format(result=result))
        said = refusal(sd2.load_mesh, points)
        assert "The plug-in bad (mesh_files) of the package bad-package" in said
        assert words in said

    def test_a_broken_reader_leaves_the_others_alone(self, install: Install, points: Path) -> None:
        install("bad-package", "mesh_files", "bad = added:READER", "1 / 0")
        said = refusal(sd2.load_mesh, points)
        assert "is not a mesh of a kind that is known" in said
        assert "cannot be loaded (ZeroDivisionError: division by zero)" in said
        text = READER.format(result="RawMesh([[[0.0, 0.0, 2.0]]])")
        install("good-package", "mesh_files", "good = other:READER", text)
        from sd2core.plug_ins import forget

        forget()
        assert sd2.load_mesh(points, frames_per_s=30.0).vertex_count == 1

    @pytest.mark.one_in(3)
    @pytest.mark.parametrize(
        ("group", "text", "words"),
        [
            ("mesh_files", "from sd2core.io.readers import FileReader as F\nX = F(len)",
             "A reader is for no files"),
            ("mesh_files", "from sd2core.io.readers import FileReader as F\nX = F(len, '.a')",
             "The suffixes are '.a'"),
            ("label_files", "from sd2core.labels.formats import LabelProgram as P\nX = P(1, 2, 3)",
             "A label format is 1"),
            ("denoisers", "from sd2core.denoise.registry import Architecture as A\nX = A('B', '')",
             "The place of a network is 'B'"),
            ("classifiers",
             "from sd2core.denoise.registry import Architecture as A\nX = A('a.B', '', 3)",
             "The options of a network are 3"),
            ("live_radars", "from sd2core.live.radars import LiveRadar as R\nX = R(3)",
             "The way to open a radar is 3"),
            ("commands", "from sd2core.cli.command_parser import AddedCommand as C\nX = C(1, 2)",
             "The options of a command are 1"),
        ],
    )  # fmt: skip
    def test_records_that_cannot_be(
        self, install: Install, group: str, text: str, words: str
    ) -> None:
        install("bad-package", group, "bad = added:X", text)
        (finding,) = doctor.plug_in_findings()
        assert f"({group}) of the package bad-package cannot be used: {words}" in finding.found

    def test_a_command_that_cannot_be_used(
        self, install: Install, capsys: pytest.CaptureFixture[str]
    ) -> None:
        install("bad-package", "commands", "brew = added:BREW", "1 / 0")
        assert main(["brew", "--strong", "-1", "tea"]) == 1
        assert "The plug-in brew (commands) of the package bad-package" in capsys.readouterr().err
        assert "brew" not in {one.name for one in commands_of(build_parser()[0])}

    def test_unknown_names_are_listed_with_those_of_plug_ins(
        self, sample: None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        from sd2core.classify.models import build as build_classifier
        from sd2core.denoise.registry import build

        assert "blur" in refusal(build, "blurr")
        assert "dense" in refusal(build_classifier, "densee", 8, 2)
        assert "tea-labels" in refusal(read_labels, tmp_path / "a.txt", None, "tea")
        assert "did you mean `sd2 greet`" in (main(["greeet"]), capsys.readouterr().err)[1].lower()

    @pytest.mark.parametrize("kind", ["denoiser", "classifier"])
    def test_a_model_whose_plug_in_is_not_installed(
        self, sample: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str,
        capsys: pytest.CaptureFixture[str],
    ) -> None:  # fmt: skip
        from sd2core.classify.files import load_classifier, save_classifier
        from sd2core.classify.training import train
        from sd2core.denoise.files import save_model
        from sd2core.denoise.live import TrainedDenoiser
        from sd2core.denoise.registry import build, options
        from sd2core.plug_ins import forget

        path = tmp_path / "model.safetensors"
        if kind == "denoiser":
            usual = sd2.load_model("denoiser")
            card = replace(usual.card, model="blur", options=options("blur"))
            save_model(path, TrainedDenoiser(build("blur", card.axis.bins), card))
        else:
            known, chosen = small_training()
            save_classifier(path, train(known.clips, (), known, chosen).classifier)
        monkeypatch.undo()  # the path
        forget()
        said = refusal(sd2.load_model if kind == "denoiser" else load_classifier, path)
        assert str(path) in said
        assert said.endswith("Install it: pip install sd2-sample.")
        assert main(["info", str(path), "--json"]) == 0
        assert json.loads(capsys.readouterr().out)["package"] == "sd2-sample"
