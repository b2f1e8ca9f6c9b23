"""Exit codes, error paragraphs, negative numbers."""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from cli_outcome import Sd2
from parsers import arguments_of

from sd2app.manual.pages import commands_of
from sd2core.cli import build_parser, run
from sd2core.cli.running import attach_negative_values
from sd2core.errors import Sd2Error


def failing(error: BaseException) -> argparse.ArgumentParser:
    def handler(options: argparse.Namespace) -> None:
        raise error

    parser = argparse.ArgumentParser(prog="sd2")
    parser.set_defaults(handler=handler)
    return parser


@pytest.mark.parametrize(
    ("error", "code", "says"),
    [
        (Sd2Error("a.npz is empty", "a mesh", "Fit it"), 1, "a.npz is empty. Expected: a mesh."),
        (KeyboardInterrupt(), 130, "interrupted"),
        (PermissionError(13, "Permission denied", "/data/a.npz"), 1, "/data/a.npz: Permission"),
        (MemoryError("Unable to allocate 9 TiB"), 1, "not enough memory"),
        (ZeroDivisionError("division by zero"), 1, "Please report it"),
        (
            UnicodeEncodeError("utf-8", "/a/f\udcfcr.mp4", 4, 5, "surrogates"),
            1,
            "no UTF-8, in '/a/f",
        ),
    ],
)
def test_errors_are_one_paragraph(
    error: BaseException, code: int, says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(failing(error), []) == code
    captured = capsys.readouterr()
    assert not captured.out
    assert says in " ".join(captured.err.split())
    assert "Traceback" not in captured.err
    assert "\n\n" not in captured.err.strip()


def test_a_traceback_on_request(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SD2_TRACEBACK", "1")
    with pytest.raises(ZeroDivisionError):
        run(failing(ZeroDivisionError()), [])


@pytest.mark.parametrize(
    "arguments",
    [[], ["nonsense"], ["info"], ["synth", "a.npz"], ["info", "a", "--nonsense"], ["simulate"]],
)
def test_wrong_usage_is_2(sd2: Sd2, arguments: list[str]) -> None:
    outcome = sd2(*arguments)
    assert (outcome.code, outcome.out) == (2, "")
    (line,) = outcome.err.splitlines()
    assert line.startswith("sd2: ")
    asked = [word for word in arguments[:1] if word != "nonsense"]
    assert f"`{' '.join(['sd2', *asked, '--help'])}`" in line


@pytest.mark.parametrize(
    ("typed", "says"),
    [
        ("sinth x", "There is no command 'sinth'. Did you mean `sd2 synth`? `sd2 --help`"),
        ("labels sugest", "no command 'sugest'. Did you mean `sd2 labels suggest`? `sd2 labels -"),
        ("synth a.npz --out b.npz --visibilty depth", "no option --visibilty. Did you mean --visi"),
        ("synth a.npz --out b.npz --binz=4", "option --binz. Did you mean --bins? `sd2 synth --"),
        ("opne a.sd2", "Did you mean `sd2 open`?"),
        ("zzz", "There is no command 'zzz'. `sd2 --help` lists all."),
        ("synth a.npz b.npz --out c.npz", "'b.npz' is one argument too many. `sd2 synth --help`"),
        (
            "--verbose synth a.npz --out c.npz",
            "There is no option --verbose. Did you mean --version? `sd2 --help`",
        ),
        ("labels --json show a.eaf", "There is no option --json. `sd2 labels --help`"),
    ],
)
def test_what_was_meant_is_said(sd2: Sd2, typed: str, says: str) -> None:
    outcome = sd2(*typed.split())
    assert outcome.code == 2
    assert says in outcome.err


@pytest.mark.parametrize(
    ("error", "expected"),
    [
        (Sd2Error("a.npz is empty", "a mesh", "Fit it"), ("a.npz is empty", "a mesh", "Fit it")),
        (PermissionError(13, "Permission denied", "/a.npz"), ("/a.npz: Permission denied", "", "")),
    ],
)
def test_an_error_as_json(
    error: BaseException, expected: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    parser = failing(error)
    parser.add_argument("--json", action="store_true")
    assert run(parser, ["--json"]) == 1
    captured = capsys.readouterr()
    parts = dict(zip(("found", "expected", "remedy"), expected, strict=True))
    assert json.loads(captured.out) == {"error": parts}
    assert captured.err.startswith(f"sd2: {expected[0]}")


@pytest.mark.parametrize("command", ["fit", "export", "batch"])
def test_an_error_is_the_last_line_of_progress(sd2: Sd2, tmp_path: Path, command: str) -> None:
    words = () if command == "batch" else ("--out", tmp_path / "made.zarr")
    outcome = sd2(command, tmp_path / "nothing", *words, "--progress-json")
    assert outcome.code == 1
    line = json.loads(outcome.out.splitlines()[-1])
    assert line["event"] == "error"
    assert f"sd2: {line['text']}\n" == outcome.err


def test_what_was_typed_wrong_as_json(sd2: Sd2) -> None:
    outcome = sd2("synth", "a.npz", "--json")
    assert outcome.code == 2
    error = json.loads(outcome.out)["error"]
    assert error["found"].endswith("required: --out")
    assert "`sd2 synth --help`" in error["remedy"]
    assert len(outcome.err.splitlines()) == 1


def test_an_error_as_json_for_a_reader_that_has_gone() -> None:
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run(
        [sys.executable, "-m", "sd2app.command_line", "info", "nothing.npz", "--json"],
        stdout=writer,
        stderr=subprocess.PIPE,
        text=True,
        check=False,
        cwd=repository(),
    )
    os.close(writer)
    assert done.returncode == 1
    assert len(done.stderr.splitlines()) == 1


def test_version(sd2: Sd2) -> None:
    from sd2core import __version__

    outcome = sd2("--version")
    assert (outcome.code, outcome.out) == (0, f"SD² Studio {__version__}\n")


def commands(parser: argparse.ArgumentParser) -> list[argparse.ArgumentParser]:
    children = commands_of(parser).values()
    return [*children, *(inner for child in children for inner in commands(child))]


def test_every_command_explains_itself() -> None:
    for command in commands(build_parser()[0]):
        text = command.format_help()
        assert command.description, command.prog
        assert max(map(len, text.splitlines())) <= 100, command.prog
        for action in arguments_of(command):
            assert action.help or action.metavar in {"PATH", "RECORDING", "FOLDER", "COMMAND"}, (
                f"{command.prog}: {action.dest} has no help"
            )


@pytest.mark.parametrize(
    ("given", "attached"),
    [
        (["synth", "--sensor", "-1,0,2"], ["synth", "--sensor=-1,0,2"]),
        (["--radar-offset-s", "-.5", "x"], ["--radar-offset-s=-.5", "x"]),
        (["--sensor=1,2,3", "-1"], ["--sensor=1,2,3", "-1"]),
        (["--sensor", "1,0,2"], ["--sensor", "1,0,2"]),
        (["--json", "--copy"], ["--json", "--copy"]),
        (["--", "-1"], ["--", "-1"]),
    ],
)
def test_negative_values_are_attached(given: list[str], attached: list[str]) -> None:
    assert attach_negative_values(given) == attached


def test_negative_sensor_position_is_parsed() -> None:
    arguments = attach_negative_values(["synth", "a.npz", "--out", "b.npz", "--sensor", "-1,-.5,2"])
    assert build_parser()[0].parse_args(arguments).sensor == (-1.0, -0.5, 2.0)


@pytest.mark.parametrize(
    "arguments",
    [
        ["--sensor", "1,2"],
        ["--sensor", "1,2,nan"],
        ["--bins", "0"],
        ["--bins", "3.5"],
        ["--v-max", "-1"],
        ["--null-bins", "14;15"],
        ["--visibility", "some"],
        ["--depth-resolution", "64"],
        ["--mask-stride", "0"],
        ["--range-exponent", "-2"],
        ["--image-size", "640"],
        ["--image-size", "640x0"],
    ],
)
def test_wrong_values_are_usage_errors(sd2: Sd2, arguments: list[str]) -> None:
    outcome = sd2("synth", "a.npz", "--out", "b.npz", *arguments)
    assert outcome.code == 2
    assert arguments[0] in outcome.err.splitlines()[-1]


HEAVY = (
    "numpy",
    "scipy",
    "numba",
    "zarr",
    "av",
    "trimesh",
    "pydantic",
    "torch",
    "anny",
)
WINDOW = ("PySide6", "shiboken6", "vtk", "vtkmodules", "pyqtgraph")


@pytest.mark.parametrize(
    "arguments", [["--help"], ["--version"], ["synth", "--help"], ["train", "-h"], ["open", "-h"]]
)
def test_help_loads_nothing_heavy(arguments: list[str]) -> None:
    script = f"""
import sys
from sd2app.command_line import main
try:
    main({arguments})
except SystemExit:
    pass
loaded = {{name.partition(".")[0] for name in sys.modules}}
print("loaded:", sorted(loaded & set({HEAVY + WINDOW})))
"""
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True, cwd=repository()
    )
    assert done.stdout.splitlines()[-1] == "loaded: []"


def test_importing_the_library_is_free() -> None:
    script = "import sys, sd2core; print('numpy' in sys.modules, sd2core.VirtualSensor.__name__)"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True, cwd=repository()
    )
    assert done.stdout.split() == ["False", "VirtualSensor"]


def test_every_public_name_exists() -> None:
    import sd2core

    for name in sd2core.__all__:
        assert getattr(sd2core, name) is not None
    assert set(sd2core.__all__) <= set(dir(sd2core))
    with pytest.raises(AttributeError, match="nonsense"):
        _ = sd2core.nonsense


def test_a_reader_that_stops_reading_is_no_error(plate: Path) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run(
        [sys.executable, "-m", "sd2app.command_line", "info", plate],
        stdout=writer,
        stderr=subprocess.PIPE,
        text=True,
        check=False,
        cwd=repository(),
    )
    os.close(writer)
    assert (done.returncode, done.stderr) == (0, "")


def repository() -> Path:
    return Path(__file__).resolve().parents[3]
