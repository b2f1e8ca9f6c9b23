"""Texts are judged before they are read, and what no reader copes with is refused in words."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from sd2core.errors import Sd2Error
from sd2core.files.limits import VARIABLE
from sd2core.files.texts import (
    check_version,
    parse_json,
    parse_toml,
    read_content,
    read_json,
    read_text,
)


def test_a_huge_file_is_refused_without_reading_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "recording.json"
    path.touch()
    os.truncate(path, 2 * 10**9)
    monkeypatch.delenv(VARIABLE, raising=False)
    monkeypatch.setattr(Path, "read_bytes", lambda _: pytest.fail("read"))
    for read in (read_json, read_text, read_content):
        words = rf"recording\.json has 2,000 MB.* a list of at most 4 MB.*{VARIABLE} to 128\.1"
        with pytest.raises(Sd2Error, match=words):
            read(path, "a list")


def test_the_limit_that_is_named_is_enough(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "x").write_text("x" * 5_000_000)
    monkeypatch.setenv(VARIABLE, "0.1")
    with pytest.raises(Sd2Error, match=rf"{VARIABLE} to 0\.4") as caught:
        read_text(tmp_path / "x", "a text")
    monkeypatch.setenv(VARIABLE, caught.value.remedy.split()[-1])
    assert len(read_text(tmp_path / "x", "a text")) == 5_000_000


def test_a_pipe_is_not_opened(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "plan.toml")
    with pytest.raises(Sd2Error, match=r"plan\.toml is a named pipe"):
        read_content(tmp_path / "plan.toml", "a plan")


@pytest.mark.parametrize("opened", ["[", '{"a": ', '[{"a": '])
def test_what_is_nested_too_deeply_is_refused(opened: str) -> None:
    closed = {"[": "]", '{"a": ': "}", '[{"a": ': "}]"}[opened]
    levels = {'[{"a": ': 2}.get(opened, 1)

    def nested(depth: int) -> str:
        return opened * (depth // levels) + "1" + closed * (depth // levels)

    assert parse_json(nested(100), "x.json", "a list") == json.loads(nested(100))
    for depth in (102, 500, 200_000):
        with pytest.raises(Sd2Error, match=r"x\.json cannot be read as JSON .*nested too deeply"):
            parse_json(nested(depth), "x.json", "a list")


@pytest.mark.parametrize(
    "text", ["a = " + "[" * 5000, ".".join("a" * 500) + " = 1", "[" + ".".join("a" * 500) + "]"]
)
def test_deep_toml_is_refused(text: str) -> None:
    with pytest.raises(Sd2Error, match=r"x\.toml cannot be read as TOML .*nested too deeply"):
        parse_toml(text, "x.toml", "a plan")


@pytest.mark.parametrize("digits", ["9" * 5000, "1" + "0" * 400, "1_000" * 100, "0x" + "f" * 500])
def test_a_number_that_no_float_holds_is_refused_with_its_line(digits: str) -> None:
    words = rf"line 3: a number of {len(digits):,} digits"
    with pytest.raises(Sd2Error, match=rf"x\.toml cannot .*{words}"):
        parse_toml(f"b = 1\n\na = {digits}\n", "x.toml", "a plan")
    with pytest.raises(Sd2Error, match=rf"x\.json cannot .*{words}"):
        parse_json(f'{{"b": 1,\n\n"a": {digits}}}', "x.json", "a list")
    assert parse_json("1" * 300, "x.json", "a number") == int("1" * 300)


@pytest.mark.parametrize(
    ("meta", "oldest", "found"),
    [
        ({"format": "cups", "version": 2}, 0, None),
        ({"format": "cups"}, 0, None),  # written before there were versions
        ({"format": "cups"}, 1, "is of version 0"),
        ({"format": "cups", "version": 3}, 0, "is of version 3"),
        ({"format": "cups", "version": "2"}, 0, "is of version '2'"),
        ({"format": "cups", "version": True}, 0, "is of version True"),
        ({"format": "jugs", "version": 1}, 0, "has the format 'jugs'"),
        ([], 0, "has the format None"),
    ],
)
def test_metadata_of_a_known_version_pass_and_others_are_named(
    meta: object, oldest: int, found: str | None
) -> None:
    if found is None:
        check_version(meta, "shelf.npz", "cups", 2, oldest=oldest)
        return
    with pytest.raises(Sd2Error) as refused:
        check_version(meta, "shelf.npz", "cups", 2, oldest=oldest, remedy="Wash up")
    assert refused.value.found == f"shelf.npz {found}"
    expected = {
        "is": (f"a version from {oldest} to 2", "Wash up"),
        "has": ("the format 'cups'", ""),
    }
    assert (refused.value.expected, refused.value.remedy) == expected[found.split()[0]]
