"""What a release says of itself agrees, and desktops can read their part of it."""

from __future__ import annotations

import configparser
import re
import shlex
import shutil
import subprocess
from pathlib import Path
from xml.etree import ElementTree

import pytest
import yaml

from sd2app.command_line import full_parser
from sd2app.shell.app import ICON
from sd2core.version import __version__

REPOSITORY = Path(__file__).resolve().parent.parent
PACKAGING = REPOSITORY / "app" / "packaging"
DESKTOP, METAINFO = PACKAGING / "sd2-studio.desktop", PACKAGING / "sd2-studio.metainfo.xml"


def test_the_newest_version_of_the_changelog_is_this_one() -> None:
    headings = re.findall(
        r"^## \[(.+?)\](.*)$", (REPOSITORY / "CHANGELOG.md").read_text("utf-8"), re.MULTILINE
    )
    assert [name for name, _ in headings][:2] == ["Unreleased", __version__]
    for _, date in headings[1:]:
        assert re.fullmatch(r" - (\d{4}-\d{2}-\d{2}|not released)", date)


def test_the_citation_names_this_version_and_the_paper() -> None:
    citation = yaml.safe_load((REPOSITORY / "CITATION.cff").read_text("utf-8"))
    assert citation["version"] == __version__
    assert citation["license"] == "Apache-2.0"
    # What version 1.2.0 of the Citation File Format requires.
    assert citation["cff-version"] == "1.2.0"
    assert {"message", "title", "authors"} <= set(citation)
    (paper,) = citation["references"]
    assert {"type", "title", "authors"} <= set(paper)
    title = paper["title"]
    assert f'"{title}"' in (REPOSITORY / "docs" / "paper.md").read_text("utf-8")


def test_the_description_for_software_centres_names_this_version() -> None:
    component = ElementTree.parse(METAINFO).getroot()
    releases = component.findall("releases/release")
    assert releases[0].get("version") == __version__
    assert component.findtext("launchable") == DESKTOP.name
    assert component.findtext("icon") == ICON.stem


def test_the_menu_entry_starts_a_command_that_there_is() -> None:
    entry = configparser.ConfigParser(interpolation=None)
    entry.optionxform = str  # type: ignore[assignment,method-assign]
    entry.read(DESKTOP, "utf-8")
    words = entry["Desktop Entry"]
    program, *arguments = shlex.split(words["Exec"].replace("%F", "walk.sd2"))
    assert program == "sd2"
    assert callable(full_parser().parse_args(arguments).handler)
    assert words["Icon"] == ICON.stem
    # X11 knows the window by the name of the application.
    assert words["StartupWMClass"] == words["Name"]


@pytest.mark.skipif(not shutil.which("desktop-file-validate"), reason="desktop-file-utils")
def test_the_menu_entry_is_valid() -> None:
    done = subprocess.run(
        ["desktop-file-validate", DESKTOP], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout) == (0, "")


@pytest.mark.skipif(not shutil.which("appstreamcli"), reason="appstream")
def test_the_description_for_software_centres_is_valid() -> None:
    # The project has no domain of its own to be named after.
    accepted = "--override=cid-desktopapp-is-not-rdns=info"
    done = subprocess.run(
        ["appstreamcli", "validate", "--no-net", accepted, METAINFO],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout


@pytest.mark.usefixtures("qapp")
def test_the_icon_can_be_drawn() -> None:
    from PySide6.QtGui import QIcon

    picture = QIcon(str(ICON)).pixmap(64, 64).toImage()
    colours = {picture.pixelColor(x, y).name() for x in range(64) for y in range(64)}
    assert len(colours) > 20
