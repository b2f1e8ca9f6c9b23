"""Forms of commands, without a window: what is typed, what it means, and what it starts."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from sd2app.commands.model import CommandForms
from sd2app.settings import Settings
from sd2core.cli import build_parser
from sd2core.cli.command_parser import record_of
from sd2core.cli.running import attach_negative_values
from sd2core.errors import Sd2Error


@pytest.fixture
def forms(qapp, tmp_path: Path):
    made = CommandForms(Settings.forgetful(), qapp, tmp_path / "runs")
    yield made
    made.close()


def typed(forms: CommandForms, **texts: str) -> None:
    options = {one.dest.replace(".", "_"): one for one in forms.options}
    for name, text in texts.items():
        forms.set_text(options[name], text)


def test_every_command_that_has_a_record_has_a_form(forms: CommandForms) -> None:
    for name in forms.commands:
        forms.choose(name)
        assert not {"json", "progress_json"} & {one.name for one in forms.options}


def test_what_is_typed_is_the_command_that_is_copied(forms: CommandForms) -> None:
    forms.choose("synth")
    typed(forms, mesh="a walk.npz", out="map.npz", sensor="-1,0,2", bins="64", limbs="yes")
    line = shlex.split(forms.line)
    assert line[:2] == ["sd2", "synth"]
    parsed = record_of(build_parser()[0].parse_args(attach_negative_values(line[1:])))
    assert parsed == forms.record
    assert (parsed.mesh, parsed.bins, parsed.limbs) == (Path("a walk.npz"), 64, True)


def test_what_begins_as_an_option_does_is_none_and_a_tilde_is_a_folder(forms: CommandForms) -> None:
    forms.choose("set")
    typed(forms, recording="~/a.sd2", title="-hello")
    record = forms.record
    line = shlex.split(forms.line)
    assert record_of(build_parser()[0].parse_args(line[1:])) == record
    assert (record.recording, record.title) == (Path.home() / "a.sd2", "-hello")
    forms.fill(record)
    assert forms.record == record


def test_sections_of_settings_are_given_only_where_something_is_typed(forms: CommandForms) -> None:
    forms.choose("train")
    typed(
        forms,
        inputs="one.zarr 'the other.zarr'",
        out="run",
        training_epochs="500",
        set="channels=64",
    )
    assert forms.record.training == {"epochs": 500}
    assert forms.record.inputs == (Path("one.zarr"), Path("the other.zarr"))
    assert "--epochs 500" in forms.line
    assert forms.record.set == (("channels", 64),)


@pytest.mark.parametrize(
    ("texts", "said"),
    [
        ({}, "Mesh is missing"),
        ({"mesh": "a.npz"}, "Out is missing"),
        ({"mesh": "a.npz", "out": "b.npz", "bins": "0"}, "Bins: '0' is not a whole number above 0"),
        ({"mesh": "a.npz", "out": "b.npz", "sensor": "1"}, "Sensor: '1' is not X,Y,Z"),
        (
            {"mesh": "a.npz", "out": "b.npz", "tolerance": "2%", "beyond": "wrap"},
            "--beyond is given with --tolerance",
        ),
    ],
)
def test_what_is_wrong_or_missing_is_said(
    forms: CommandForms, texts: dict[str, str], said: str
) -> None:
    forms.choose("synth")
    typed(forms, **texts)
    assert said in forms.problem
    with pytest.raises(Sd2Error, match=said.partition("(")[0]):
        forms.start()


def test_each_command_keeps_what_was_typed_and_begins_with_what_is_open(
    forms: CommandForms,
) -> None:
    forms.opened = Path("my walk.sd2")
    forms.choose("synth")
    typed(forms, bins="64", out="map.npz")
    forms.choose("denoise")
    forms.choose("synth")
    assert (forms.record.mesh, forms.record.bins) == (Path("my walk.sd2"), 64)


@pytest.mark.slow
def test_a_command_is_started_and_what_it_prints_is_kept(
    qtbot, forms: CommandForms, tmp_path: Path
) -> None:
    forms.choose("denoise")
    typed(forms, map=str(tmp_path / "none.npz"), out=str(tmp_path / "map.npz"))
    forms.start()
    assert forms.run is not None
    qtbot.waitUntil(lambda: forms.run.phase == "failed", timeout=60_000)
    assert "does not exist" in forms.run.text
