"""The library without the window: its wheel, and its commands where Qt, VTK and torch are not."""

from __future__ import annotations

import re
import subprocess
import sys
import sysconfig
import tomllib
import venv
import zipfile
from email.parser import Parser
from pathlib import Path
from typing import Any

import pytest

from sd2core.version import __version__
from tests.environments import (
    REPOSITORY,
    build_wheel,
    call,
    install,
    refused,
    scripts,
    site_packages,
)

WINDOW = {"PySide6-Essentials", "vtk"}
LEARNING = {"torch"}
ABSENT = (
    "PySide6",
    "anny",
    "shiboken6",
    "torch",
    "vtk",
)
"""How packages begin that the library alone does not bring."""
SAMPLE = REPOSITORY / "resources" / "swipes.sd2"

WITHOUT = f"""
import sys

class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.startswith({(*ABSENT, "sd2app")}):
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)

sys.meta_path.insert(0, Absent())
"""


def project(path: Path) -> dict[str, Any]:
    table: dict[str, Any] = tomllib.loads((path / "pyproject.toml").read_text("utf-8"))["project"]
    return table


def name_of(requirement: str) -> str:
    return requirement.split(">")[0]


def without_window_and_torch(script: str, *arguments: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", WITHOUT + script, *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
        cwd=REPOSITORY,
    )


def sd2_alone(*arguments: object) -> subprocess.CompletedProcess[str]:
    script = "from sd2core.cli.__main__ import main\nsys.exit(main())"
    return without_window_and_torch(script, *arguments)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel of the library."""
    return build_wheel(REPOSITORY / "library", tmp_path_factory.mktemp("library"))


def test_the_library_needs_what_the_program_needs_but_for_the_window() -> None:
    program, library = project(REPOSITORY), project(REPOSITORY / "library")
    learning = library["optional-dependencies"]["learn"]
    assert {name_of(one) for one in learning} == LEARNING
    window = {one for one in program["dependencies"] if name_of(one) in WINDOW}
    assert {name_of(one) for one in window} == WINDOW
    assert sorted([*library["dependencies"], *learning, *window]) == sorted(program["dependencies"])


def test_the_wheel_holds_the_library_and_nothing_else(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = {name for name in archive.namelist() if ".dist-info/" not in name}
        (metadata,) = (name for name in archive.namelist() if name.endswith("/METADATA"))
        said = Parser().parsestr(archive.read(metadata).decode())
        assert any(name.endswith("/LICENSE") for name in archive.namelist())
    assert "sd2core/py.typed" in names
    assert names == {
        (prefix / path.relative_to(REPOSITORY)).as_posix()
        for folder, prefix in (("sd2core", Path()), ("resources", Path("sd2core")))
        for path in (REPOSITORY / folder).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    needed = {name_of(one) for one in said.get_all("Requires-Dist", []) if "extra ==" not in one}
    assert not {one.split("<")[0] for one in needed} & (WINDOW | LEARNING)
    assert said["Version"] == __version__


def test_everything_but_learning_can_be_imported_without_window_and_torch() -> None:
    done = without_window_and_torch(
        """
import pkgutil, sd2core
for name in sd2core.__all__:
    try:
        getattr(sd2core, name)
    except ModuleNotFoundError as error:
        assert error.name == "torch", error
rooms = ("classify", "datasets", "denoise", "study", "train")
for module in pkgutil.walk_packages(sd2core.__path__, "sd2core."):
    if module.name.split(".")[1] not in rooms and not module.name.endswith("__main__"):
        __import__(module.name)
print(sorted({"torch", "PySide6", "vtkmodules"} & set(sys.modules)))
"""
    )
    assert (done.returncode, done.stdout) == (0, "[]\n"), done.stderr


@pytest.mark.parametrize(
    "command", [["open", SAMPLE], ["demo", "--screenshot", "w.png"], ["doctor"]]
)
def test_what_needs_the_window_is_said_in_one_sentence(command: list[object]) -> None:
    done = sd2_alone(*command)
    assert done.returncode == 1
    assert done.stderr == (
        f"sd2: `sd2 {command[0]}` needs the window, which is not in the library alone (sd2-core)."
        " Type `pip uninstall sd2-core`, then `pip install sd2_studio-….whl`.\n"
    )


def test_commands_that_are_not_there_are_not_listed() -> None:
    done = sd2_alone("--help")
    listed = set(re.findall(r"^    ([a-z][\w-]*)", done.stdout, re.M))
    shown = set(re.findall(r"^  sd2 (\S+)", done.stdout, re.M))
    assert {"info", "synth", "compare-meshes", "demo"} <= listed
    assert "doctor" in listed
    assert "open" not in listed | shown
    assert shown <= listed
    assert "--screenshot" not in sd2_alone("demo", "--help").stdout


@pytest.mark.slow
def test_a_copy_of_the_sample_is_made_and_described_without_the_window(tmp_path: Path) -> None:
    done = sd2_alone("demo", "--out", tmp_path / "mine.sd2")
    assert (done.returncode, done.stdout) == (0, f"Wrote {tmp_path / 'mine.sd2'}\n"), done.stderr
    done = sd2_alone("info", tmp_path / "mine.sd2")
    assert (done.returncode, "(simulated)" in done.stdout) == (0, True), done.stderr


def test_kernels_are_compiled_without_the_window() -> None:
    done = without_window_and_torch(
        """
import sys
import sd2core.numerics.compiled as compiled
compiled.warm_up = lambda progress: print("compiled")
from sd2core.cli.__main__ import main
sys.exit(main())
""",
        *("doctor", "--warm-up"),
    )
    assert (done.returncode, done.stdout) == (0, "compiled\n"), done.stderr
    assert "--fetch-models" in sd2_alone("doctor", "--help").stdout


@pytest.mark.slow
def test_what_needs_torch_says_how_to_get_it(tmp_path: Path) -> None:
    map_file = tmp_path / "map.npz"
    done = sd2_alone("synth", SAMPLE, "--out", map_file, "--visibility", "facing")
    assert done.returncode == 0, done.stderr
    done = sd2_alone("denoise", map_file, "--out", tmp_path / "denoised.npz")
    assert done.returncode == 1
    assert done.stderr == (
        "sd2: torch is needed for this, which denoises, classifies or trains, or runs a body model"
        ' in TorchScript. Install it: pip install "sd2-core[learn]".\n'
    )


@pytest.mark.slow
def test_the_wheel_works_where_there_is_no_window_and_no_torch(wheel: Path, tmp_path: Path) -> None:
    environment, dependencies, away = (tmp_path / name for name in ("env", "packages", "away"))
    for folder in (dependencies, away):
        folder.mkdir()
    # This environment's packages, without those that the library does not bring, and the checkout.
    for entry in Path(sysconfig.get_path("purelib")).iterdir():
        if not entry.name.startswith((*ABSENT, "sd2", "__editable__")):
            (dependencies / entry.name).symlink_to(entry)
    venv.create(environment, with_pip=False)
    install(environment, "--no-deps", "--no-index", wheel)
    (site_packages(environment) / "dependencies.pth").write_text(str(dependencies))

    sd2, python = scripts(environment) / "sd2", scripts(environment) / "python"
    where = Path(call(python, "-c", "import sd2core; print(sd2core.__file__)", cwd=away).strip())
    assert where.is_relative_to(environment)
    assert "sd2core/resources" in (where.parent / "resources").as_posix()
    sample = where.parent / "resources" / "swipes.sd2"
    assert "(simulated)" in call(sd2, "info", sample, cwd=away)
    call(sd2, "demo", "--out", "mine.sd2", cwd=away)
    call(sd2, "synth", "mine.sd2", "--out", "map.npz", cwd=away)
    assert (away / "map.npz").is_file()
    assert "needs the window" in refused(sd2, "open", sample, cwd=away)
    assert "sd2-core[learn]" in refused(sd2, "denoise", "map.npz", "--out", "d.npz", cwd=away)
