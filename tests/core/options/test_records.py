"""Options of commands: what is typed and its record say the same."""

from __future__ import annotations

from dataclasses import MISSING
from pathlib import Path
from typing import Annotated, Any, Literal

import pytest
from hypothesis import assume, given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st
from pydantic import BaseModel

from sd2app.command_line import full_parser
from sd2core.cli.command_parser import (
    CommandParser,
    add_options,
    commands_of,
    record_of,
)
from sd2core.cli.running import attach_negative_values
from sd2core.datasets.labelled_source import LabelledSource
from sd2core.errors import Sd2Error
from sd2core.options.kinds import Count, Names, Share
from sd2core.options.records import (
    ARGUMENTS,
    Group,
    Option,
    OptionRecord,
    Place,
    changed,
    typed_options,
    words_of,
)
from sd2core.options.toml_files import parsed

NAMES = st.text("abcdefg", min_size=1, max_size=4).filter(lambda text: text != "none")
PATHS = NAMES.map(lambda name: Path(f"{name}.npz"))
DASHED: dict[Any, st.SearchStrategy[Any]] = {
    str: NAMES.map(lambda name: f"-{name}"),
    Path: PATHS.map(lambda path: Path(f"-{path}")),
}
"""What begins as an option does."""
PLAIN: dict[Any, st.SearchStrategy[Any]] = {str: NAMES, Path: PATHS, bool: st.booleans()}
TYPED: dict[str, st.SearchStrategy[Any]] = {
    "share": st.floats(0.001, 1.0),
    "vector": st.tuples(*3 * [st.floats(-9.0, 9.0)]),
    "image_size": st.tuples(st.integers(1, 9_999), st.integers(1, 9_999)),
    "name_list": st.lists(NAMES).map(tuple),
    "bin_list": st.lists(st.integers(0, 99)).map(tuple),
    "span_m": st.tuples(st.floats(0.0, 4.0), st.floats(4.5, 9.0)),
    "assignment": st.tuples(NAMES, st.integers() | st.booleans() | NAMES),
    "parsed": st.builds(LabelledSource, PATHS, NAMES | st.just("")),
    "_people": st.just(("all",)) | st.lists(st.integers(1, 9).map(str), unique=True).map(tuple),
    "_shares": st.sets(st.floats(0.001, 1.0), min_size=1).map(lambda them: tuple(sorted(them))),
}
"""Values of what is typed in a way of its own, by the reader."""


RECORDS = {one.name: one.record for one in commands_of(full_parser())}


def values_of(option: Option) -> st.SearchStrategy[Any] | None:
    """Values of an option; None where nothing is known of what it takes."""
    if option.choices:
        one: st.SearchStrategy[Any] = st.sampled_from(option.choices)
    elif option.typed is not None:
        found = TYPED.get(option.typed.read.__name__)
        if found is None:
            return None
        one = found
    elif option.kind in (int, float):
        bounds = option.bounds
        low, high = max(bounds.low, -1e6), min(bounds.high, 1e6)
        if option.kind is int:
            one = st.integers(int(low) + bounds.above, int(high))
        else:
            one = st.floats(low, high, exclude_min=bounds.above)
    else:
        one = PLAIN[option.kind]
        if option.kind is Path if option.place.argument else option.place.many != "together":
            one |= DASHED.get(option.kind, st.nothing())
    if option.section and option.kind is bool:
        return st.just(True)  # a switch cannot be typed to be off
    least = 0 if option.default == () else 1  # where none is another thing, it is not typed
    return st.lists(one, min_size=least, max_size=3).map(tuple) if option.place.many else one


@st.composite
def records(draw: st.DrawFn, kind: type[OptionRecord]) -> OptionRecord:
    """A record of a kind, with options that go together."""
    options = typed_options(kind)
    needed = {one.name for one in options if one.default is MISSING and not one.section}
    if kind is RECORDS["fit"]:  # which does without only to list people
        needed.add("out")
    if either := [one.name for one in options if one.place.needed]:
        needed.add(draw(st.sampled_from(either)))
    values: dict[str, Any] = {}
    for option in options:
        strategy = values_of(option)
        assert strategy is not None or option.name not in needed
        if strategy is not None and (option.name in needed or draw(st.integers(0, 9)) == 0):
            target = values.setdefault(option.section, {}) if option.section else values
            target[option.name] = draw(strategy)
    while True:
        try:
            return kind(**values)
        except Sd2Error:  # options that do not go together
            optional = [name for name in values if name not in needed]
            assume(optional)
            values.pop(optional[-1])


@pytest.mark.one_in(4)
@pytest.mark.parametrize("command", RECORDS)
@given(data=st.data())
@hypothesis_settings(max_examples=15)
def test_words_that_are_typed_give_the_record_again(command: str, data: st.DataObject) -> None:
    record = data.draw(records(RECORDS[command]))
    parser = CommandParser(prog=command)
    add_options(parser, RECORDS[command])
    parser.set_defaults(record=RECORDS[command])
    typed = parser.parse_args(attach_negative_values(words_of("", record)))
    assert record_of(typed) == record


@pytest.mark.parametrize("command", RECORDS)
def test_every_option_has_words(command: str) -> None:
    for option in typed_options(RECORDS[command]):
        assert option.words, option.name
        assert option.called or option.choices or option.kind is bool, option.name


class Basis(OptionRecord):
    """Options that others take.

    Parameters
    ----------
    names : LIST
        names, or none
    share : SHARE
        how much of it, e.g. 50%
    """

    GROUP = Group("basis", "what it stands on")

    names: Names | None = None
    share: Share = 0.5


class Example(Basis):
    """Options of an example.

    Parameters
    ----------
    files : FILE
        what is read
    count : N
        how often
    way
        how it goes
    label : TEXT
        may be given several times
    """

    files: Annotated[tuple[Path, ...], ARGUMENTS]
    count: Count = 3
    way: Literal["fast", "slow"] = "fast"
    label: Annotated[tuple[str, ...], Place(many="again")] = ()


def test_an_option_says_what_its_field_and_the_docstring_say() -> None:
    options = {one.name: one for one in typed_options(Example)}
    assert list(options) == ["files", "count", "way", "label", "names", "share"]  # own ones first
    assert (options["count"].words, options["count"].called) == ("how often (default: 3)", "N")
    assert options["way"].words == "how it goes (default: fast)"
    assert options["share"].flags == ("--share",)
    assert options["share"].group == Group("basis", "what it stands on")
    assert options["files"].group is None


def test_words_leave_out_what_is_as_by_default() -> None:
    record = Example(files=(Path("a"), Path("b")), names=(), label=("x", "y"), count=3)
    options = ["--label", "x", "--label", "y", "--names", "none"]
    assert words_of("do it", record) == ["do", "it", "a", "b", *options]
    assert words_of("do it", record, ("count",))[-8:] == ["--count", "3", *options]
    assert changed(record) == ["files", "label", "names"]


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"count": 0}, "count is 0. Expected: a whole number above 0"),
        ({"count": 1.5}, "count is 1.5"),
        ({"count": True}, "count is True"),
        ({"share": float("nan")}, "share is nan. Expected: a number above 0 and up to 1"),
        ({"way": "late"}, "way is 'late'. Expected: one of fast, slow"),
    ],
)
def test_nonsense_is_refused_wherever_a_record_is_made(wrong: dict[str, Any], said: str) -> None:
    with pytest.raises(Sd2Error, match=said):
        Example(files=(Path("a"),), **wrong)


class Plan(BaseModel):
    """A plan with a section."""

    basis: Basis


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "[basis]\nshare = 2\n",
            "line 2: basis.share is 2. Expected: a number above 0 and",
        ),
        ("[basis]\nshares = 0.5\n", "line 2: basis.shares is not known"),
        ("[basis]\nnames = 'a'\n", "line 2: basis.names is 'a'. Expected: a valid array"),
        ("", "basis is missing"),
    ],
)
def test_a_section_of_a_plan_is_checked_with_its_line(text: str, said: str) -> None:
    assert parsed(Plan, "[basis]\nnames = ['a']\n", "it").basis == Basis(names=("a",))
    with pytest.raises(Sd2Error, match=said):
        parsed(Plan, text, "it")
