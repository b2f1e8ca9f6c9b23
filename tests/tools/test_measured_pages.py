"""Measured pages say whether what they measure has changed since, and why if they stay old."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tools.documentation.measured import DOCS, OLD, PAGES, changed, digest, marked, stamped

NAME = "real-gestures.md"


@pytest.mark.parametrize("name", PAGES)
def test_a_page_says_at_its_head_whether_it_is_old(name: str) -> None:
    text = (DOCS / name).read_text("utf-8")
    assert "<!-- measured " in text, f"{name} does not say what it was made from"
    mend = "run `python -m tools.documentation.measured --mark`, or measure the page anew"
    assert marked(text, name) == text, f"{name} is not marked as it is: {mend}"


def test_only_what_is_listed_is_old() -> None:
    old = {name for name in PAGES if changed((DOCS / name).read_text("utf-8"), name)}
    assert old == set(OLD), "measure the page anew, or say in OLD why it stays"
    assert all(OLD.values())


@pytest.fixture
def made_from(tmp_path: Path) -> Path:
    """A checkout in which everything is there that a page is made from."""
    for part in PAGES[NAME].of:
        path = tmp_path / part
        if path.suffix:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text("A = 1\n")
        else:
            path.mkdir(parents=True, exist_ok=True)
            (path / "one.py").write_text('"""What it does."""\n\nB = 2\n')
    return tmp_path


def test_what_changes_is_named_and_goes_again(made_from: Path, monkeypatch) -> None:
    monkeypatch.setattr("tools.documentation.measured.REPOSITORY", made_from)
    page = stamped("# Gestures\n\nText.\n", NAME, "2026-01-02", "abcd1234", made_from)
    assert changed(page, NAME) == []
    assert marked(page, NAME) == page
    folder, file = PAGES[NAME].of
    (made_from / folder / "one.py").write_text("B = 3\n")
    old = marked(page, NAME)
    assert old.startswith("# Gestures\n\n> **Older than the program.** Changed since 2026-01-02")
    assert folder in old.partition("\n\nText.")[0]
    assert file not in old.partition("\n\nText.")[0]
    assert marked(old, NAME) == old
    assert stamped(old, NAME, "2026-01-03", "ef", made_from).count("<!-- measured") == 1
    assert "Older" not in stamped(old, NAME, "2026-01-03", "ef", made_from)


def test_the_same_code_has_the_same_hash_in_every_python(tmp_path: Path) -> None:
    (tmp_path / "one.py").write_text('def f(a):\n    return [f"{a:<{1}}", f"{a}", ""]\n')
    assert digest(tmp_path) == "5d97058c"


def test_comments_and_docstrings_are_no_change(made_from: Path) -> None:
    folder = made_from / PAGES[NAME].of[0]
    before = digest(folder)
    (folder / "one.py").write_text('"""What else it does."""\n\n# Why.\nB = 2\n')
    assert digest(folder) == before
    (folder / "one.py").write_text("B = 2.0\n")
    assert digest(folder) != before


def test_figures_of_the_overview_stand_on_the_pages_that_it_names() -> None:
    page = ""
    rows = 0
    for line in (DOCS / "how-good-is-it.md").read_text("utf-8").splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if not line.startswith("| ") or cells[0] == "question":
            continue
        rows += 1
        if linked := re.search(r"\]\((\S+\.md)\)", cells[3]):
            page = (DOCS / linked[1]).read_text("utf-8")
            stamp = re.search(r"<!-- measured (\S+) at (\S+) of", page)
            assert stamp is not None
            assert cells[3].startswith(f"{stamp[1]}, `{stamp[2]}`"), line
        for figure in re.findall(r"\d+\.\d+", cells[1]):
            assert figure in page, (figure, cells[0])
    assert rows > 15
