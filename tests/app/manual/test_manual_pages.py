"""Pages of the manual: all of them as GitHub's Markdown, with links that lead somewhere."""

from __future__ import annotations

import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest
from parsers import arguments_of

from sd2app.command_line import full_parser
from sd2app.manual.help import HELP
from sd2app.manual.library import described
from sd2app.manual.pages import MEASURED, Manual, commands_of, manual_folder, plain_words

MANUAL = Manual(manual_folder(), full_parser)
LINK = re.compile(r"!?\[(?:(?!\n\n)[^\]])*\]\(([^)\s]+)\)")
CODE = re.compile(r"^( *)```.*?^\1``` *$|`[^`]+`", re.MULTILINE | re.DOTALL)

each_page = pytest.mark.parametrize("name", MANUAL.titles)


@cache
def prose_of(name: str) -> str:
    return CODE.sub("", MANUAL.text(name))


sections_of = cache(MANUAL.sections)


@each_page
def test_nothing_of_myst_is_left(name: str) -> None:
    text = MANUAL.text(name)
    assert "```{" not in text
    assert "eval-rst" not in text
    for raw in ("<!--", "{py:", "{download}", ":hidden:", ":maxdepth:", ".. auto", "\n---\n"):
        assert raw not in prose_of(name), raw


@each_page
def test_links_lead_to_pages_headings_and_pictures_that_are_there(name: str) -> None:
    for target in LINK.findall(prose_of(name)):
        if "://" in target:
            continue
        place, anchor = MANUAL.place(name, target), target.partition("#")[2]
        if place.startswith("images/"):
            assert (MANUAL.folder / place).is_file(), target
        else:
            assert place in MANUAL.titles, target
            anchors = {one.anchor for one in sections_of(place)}
            assert not anchor or anchor in anchors, target


@each_page
def test_anchors_differ_and_the_first_heading_is_the_title(name: str) -> None:
    sections = sections_of(name)
    assert len({one.anchor for one in sections}) == len(sections)
    if name not in {entry.name for entry in MANUAL.contents.below}:  # these may be named shorter
        assert sections[0].heading == MANUAL.titles[name]


def test_contents_are_for_users_and_complete() -> None:
    sections = [entry.name.partition("/")[0] for entry in MANUAL.contents.below]
    assert sections == [
        "first-five-minutes.md", "tutorials", "how-to", "concepts", "sections", "commands",
        "python", MEASURED,
    ]  # fmt: skip
    assert not any("decisions" in name or "architecture" in name for name in MANUAL.titles)
    written = {
        path.relative_to(manual_folder()).as_posix()
        for kind in ("md", "ipynb")
        for path in manual_folder().rglob(f"*.{kind}")
    }
    left_out = {name for name in written - set(MANUAL.titles) if not name.startswith("commands/")}
    assert {name.partition("/")[0] for name in left_out} == {"architecture.md", "decisions"}


@pytest.mark.parametrize("place", sorted(set(HELP.values())))
def test_help_leads_to_headings_that_are_there(place: str) -> None:
    name, _, anchor = place.partition("#")
    assert not anchor or anchor in {one.anchor for one in sections_of(name)}


# --- search -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "first"),
    [
        ("own radar", "tutorials/your-own-radar.md"),
        ("OWN rad", "tutorials/your-own-radar.md"),
        ("emptied", "concepts/emptied-bins.md"),
        ("keys", "how-to/change-keys.md"),
        ("cluster", "how-to/work-on-a-cluster.md"),
        ("sd2 synth", "commands/synth.md"),
        ("--oversampling", "commands/synth.md"),
        ("load_mesh", "python/meshes.md"),
        ("label files of other programs", "formats.md"),
        ("gyroscope rad/s", "imu.md"),
    ],
)
def test_what_one_looks_for_comes_first(words: str, first: str) -> None:
    assert MANUAL.search(words)[0].name == first


def test_measurements_are_not_found_but_the_page_above_them() -> None:
    measured = next(one for one in MANUAL.contents.below if one.name == MEASURED)
    found = {one.name for words in ("measured", "the", "denoiser") for one in MANUAL.search(words)}
    assert found.isdisjoint(one.name for one in measured.below)
    assert MEASURED in {one.name for one in MANUAL.search("how good is it")}


@pytest.fixture
def small(tmp_path: Path) -> Manual:
    """Four pages in which two words stand at different places."""
    pages = {
        "index": "# Start\n\n```{toctree}\n:maxdepth: 1\n\nbody\nheading\ntitle\nmade\n```",
        "body": "# One\n\nA map of a walk, and below it [one](title.md) of a swipe.",
        "heading": "# Two\n\n## Maps\n\nof a walk\n\n## Swipes\n\n```sh\nsd2 synth --sensor 1\n```",
        "title": "# Maps of a *walk*\n\nText.",
        "made": "# Four\n\n[A decision](decisions/0001.md), [`code`](../code.py) and "
        "<!-- a\n\n# note -->{py:class}`~some.module.Thing`; "
        "[**out**](https://example.org) `[not](a-link.md)`.",
    }
    for name, text in pages.items():
        (tmp_path / f"{name}.md").write_text(text, "utf-8")
    return Manual(tmp_path, full_parser)


def test_titles_count_more_than_headings_and_these_more_than_text(small: Manual) -> None:
    # The first page has the titles of the others.
    found = [one.name for one in small.search("map walk") if one.name != "index.md"]
    assert found == ["title.md", "heading.md", "body.md"]


def test_all_words_are_needed_and_may_be_begun_only(small: Manual) -> None:
    assert {one.name for one in small.search("SWI map")} == {"body.md", "heading.md"}
    assert not small.search("map nothing")
    assert not small.search("ap")  # the end of a word
    assert not small.search("  ")


def test_a_result_has_the_section_and_words_around(small: Manual) -> None:
    (found,) = small.search("sensor")
    assert (found.place, found.title) == ("heading.md#swipes", "Two")
    assert found.snippet == "sd2 synth --sensor 1"
    (found,) = [one for one in small.search("swipe") if one.name == "body.md"]
    assert found.snippet == "…a walk, and below it one of a swipe."


def test_results_are_a_page_of_links(small: Manual) -> None:
    small.sought = "map walk"
    assert LINK.findall(small.text("search")) == [one.place for one in small.search("map walk")]
    small.sought = "nothing"
    assert "No page" in small.text("search")


# --- what pages are made of ---------------------------------------------------------------


def test_what_is_not_in_the_manual_is_shown_without_a_link(small: Manual) -> None:
    said = "A decision, `code` and `Thing`; [**out**](https://example.org) `[not](a-link.md)`."
    assert small.text("made.md") == f"# Four\n\n{said}"


def test_a_list_of_pages_is_shown_unless_it_is_hidden(small: Manual, tmp_path: Path) -> None:
    listed = "# Start\n\n- [One](body.md)\n- [Two](heading.md)\n- [Maps of a walk](title.md)\n"
    assert small.text("index.md") == f"{listed}- [Four](made.md)"
    hidden = "# Start\n\n```{toctree}\n:hidden:\n:glob:\n\nIts own name <title>\n*\n```"
    (tmp_path / "index.md").write_text(hidden, "utf-8")
    again = Manual(tmp_path, full_parser)
    assert again.text("index.md").strip() == "# Start"
    names = ["index.md", "title.md", "body.md", "heading.md", "made.md"]
    assert list(again.titles) == names
    assert again.titles["title.md"] == "Its own name"


def test_every_command_has_a_page_of_its_help() -> None:
    commands = commands_of(full_parser())
    index = MANUAL.text("commands/index.md")
    for name, command in commands.items():
        assert f"[`sd2 {name}`]({name}.md)" in index
        text = MANUAL.text(f"commands/{name}.md")
        assert text.startswith(f"# sd2 {name}\n")
        stack = [command]
        while stack:
            parser = stack.pop()
            stack += commands_of(parser).values()
            assert f"{parser.prog}\n" in text
            for action in arguments_of(parser):
                assert all(option in text for option in action.option_strings)
        assert max(map(len, text.splitlines())) < 100


def test_the_notebook_has_its_cells() -> None:
    text = MANUAL.text("tutorials/mesh-to-denoiser.ipynb")
    assert text.startswith("# From mesh to denoiser")
    assert text.count("```python\n") > 5
    assert "cell_type" not in text


def test_the_library_is_described_as_it_is() -> None:
    text = described(
        ".. autoclass:: sd2core.VelocityAxis\n   :members:\n\n.. autofunction:: sd2core.load_mesh\n"
        "\n.. autodata:: sd2core.doppler.options.PRESETS\n   :no-value:\n"
    )
    headings = re.findall(r"^##+ (.+)$", text, re.MULTILINE)
    assert headings[0] == "VelocityAxis"
    assert headings[-2:] == ["load_mesh", "PRESETS"]
    assert "VelocityAxis.centres_mps" in headings
    assert not any("._" in heading for heading in headings)
    assert "VelocityAxis(bins: int = 32, v_max_mps: float = 2.0)" in text
    assert "-> MeshSequence" in " ".join(text.split())
    assert "**Parameters**\n\n- `path : " in text
    with pytest.raises(LookupError):
        described(".. autofunction:: sd2core.maps.nothing")


def test_reading_all_pages_loads_no_torch() -> None:
    program = (
        "import sys\nfrom sd2core.cli import build_parser\n"
        "from sd2app.manual.pages import Manual, manual_folder\n"
        "manual = Manual(manual_folder(), lambda: build_parser()[0])\n"
        "assert manual.search('segment')\nsys.exit('torch' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0


def test_words_are_plain() -> None:
    text = (
        "A **bold** [link\nto](x.md#y) `code`\n\n| a | b |\n|---|:-:|\n| 1 | - |\n```sh\nrun *\n```"
    )
    assert plain_words(text) == "A bold link to code a b 1 - run"
