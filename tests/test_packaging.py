"""A built wheel works in an environment of its own, away from the checkout."""

from __future__ import annotations

import sysconfig
import venv
import zipfile
from pathlib import Path

import pytest

from sd2app.command_line import full_parser
from sd2app.manual.pages import Manual
from tests.environments import (
    MANUAL_PAGES,
    REPOSITORY,
    assert_shows_a_window,
    build_wheel,
    call,
    install,
    scripts,
    site_packages,
)

SHARED = {
    "share/applications/sd2-studio.desktop",
    "share/icons/hicolor/scalable/apps/sd2-studio.svg",
    "share/metainfo/sd2-studio.metainfo.xml",
}
"""What desktops look for under the environment's prefix."""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel of this checkout."""
    return build_wheel(REPOSITORY, tmp_path_factory.mktemp("wheel"))


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Environment with the wheel and, of this environment, the dependencies only."""
    environment = tmp_path_factory.mktemp("installed") / "environment"
    venv.create(environment, with_pip=False)
    install(environment, "--no-deps", "--no-index", wheel)
    # Paths in a .pth file are searched, but .pth files found there are not read:
    # the editable installation of the checkout stays out.
    paths = {sysconfig.get_path("purelib"), sysconfig.get_path("platlib")}
    (site_packages(environment) / "dependencies.pth").write_text("\n".join(sorted(paths)))
    return environment


@pytest.fixture
def away(tmp_path: Path) -> Path:
    """An empty folder to work in, outside the checkout."""
    assert not tmp_path.is_relative_to(REPOSITORY)
    return tmp_path


def check(environment: Path, away: Path) -> None:
    """What someone does first after installing."""
    from sd2core import __version__

    sd2, python = scripts(environment) / "sd2", scripts(environment) / "python"
    assert call(sd2, "--version", cwd=away).split()[-1] == __version__

    where = "import sd2core, sd2app; print(sd2core.__file__, sd2app.__file__, sep='\\n')"
    for file in call(python, "-c", where, cwd=away).splitlines():
        assert Path(file).is_relative_to(environment)

    where = "from sd2core.files.resources import resource_path as p; print(p('swipes.sd2'))"
    sample = Path(call(python, "-c", where, cwd=away).strip())
    assert sample.is_relative_to(environment)
    told = call(sd2, "info", sample, cwd=away)
    assert "(simulated)" in told
    for part in ("Video", "Mesh", "Radar capture"):
        assert f"{part} {sample}" in told

    folder, pages = call(python, "-c", MANUAL_PAGES, cwd=away).split()
    assert Path(folder).is_relative_to(environment)
    assert int(pages) > 80

    call(sd2, "demo", "--screenshot", "window.png", cwd=away)
    assert_shows_a_window(away / "window.png")


def test_the_wheel_holds_the_program_and_nothing_else(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    assert {name.split("/")[0].split("-")[0] for name in names} == {
        "sd2core",
        "sd2app",
        "sd2_studio",
    }
    sources = {
        path.relative_to(folder).as_posix()
        for folder, package in ((REPOSITORY, "sd2core"), (REPOSITORY / "app", "sd2app"))
        for path in (folder / package).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert sources <= names
    # Type checkers use the annotations of packages that say so (PEP 561).
    assert {"sd2core/py.typed", "sd2app/py.typed"} <= names
    resources = {
        f"sd2core/{path.relative_to(REPOSITORY).as_posix()}"
        for path in (REPOSITORY / "resources").rglob("*")
        if path.is_file()
    }
    assert "sd2core/resources/swipes.sd2/recording.json" in resources
    assert resources <= names
    guide = {name for name in names if name.startswith("sd2app/docs/")}
    shared = {name for name in names if ".data/" in name}
    assert {name.split(".data/data/")[1] for name in shared} == SHARED
    names -= shared
    others = {name for name in names if ".dist-info/" not in name} - sources - resources - guide
    assert not others
    assert any(name.endswith("/LICENSE") for name in names)


def test_the_wheel_brings_the_manual_and_no_other_page(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    manual = Manual(REPOSITORY / "docs", full_parser).files()
    assert {"index.md", "images/sample.png", "tutorials/mesh-to-denoiser.ipynb"} <= manual
    brought = {name.removeprefix("sd2app/docs/") for name in names if "app/docs/" in name}
    assert manual <= brought
    # A picture that no page shows any more costs room only.
    assert {name for name in brought - manual if not name.startswith("images/")} == set()


@pytest.mark.slow
@pytest.mark.timeout(1800)  # all kernels are compiled
def test_the_wheel_works_away_from_the_checkout(installed: Path, away: Path) -> None:
    check(installed, away)


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_the_wheel_brings_its_dependencies(
    wheel: Path, away: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    environment = tmp_path_factory.mktemp("empty") / "environment"
    venv.create(environment, with_pip=False)
    install(environment, "--constraint", REPOSITORY / "constraints.txt", wheel)
    check(environment, away)
