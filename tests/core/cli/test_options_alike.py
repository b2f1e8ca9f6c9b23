"""One word for one thing in the options of all commands, and help of one form."""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

from parsers import arguments_of, groups_of, options_of

from sd2app.command_line import full_parser
from sd2app.manual.pages import commands_of
from sd2core.cli.output_folders import OUTPUTS

WITHOUT_FACTS = {"labels figure", "strip", "warm-up", "fetch-models", "open", "demo"}
"""Commands that print nothing but what they wrote, or open a window."""

GO_ON = {
    *("classify table", "export", "labels cut", "pairs mars", "pairs recordings"),
    *("pairs vary", "simulate campaign", "train", "listen"),
    *("import", "record"),  # and `demo`: recordings are never overwritten
}
"""Commands that go on with what is there. All others refuse it, unless told to overwrite."""

FURTHER_OUTPUTS = {
    "--figure": "FILE",
    "--markdown": "FILE.md",
    "--probabilities": "FILE.npz",
    "--landmarks": "FILE",
    "--export": "FILE.json",
    "--screenshot": "FILE.png",
}
"""What some commands write beside their result, or without one, and not by default."""

SEVERAL_MEANINGS = {
    "--columns": {"N", "LIST"},  # of pictures; names of a table's
    "--count": {"N", None},  # of pictures; how vertices are counted
    "--from": {"PATH", "FILE|NAME"},  # where a folder was; a model to go on from
    "--imu": {"FILE", "LIST"},  # a real sensor's samples; places of virtual ones
    "--model": {"FILE", "FILE|NAME", "NAME"},  # one that was trained; kind of one to train
    "--people": {"N", "WHO"},  # how many to simulate; whom of a video to fit
    "--placements": {"FILE", "FILE|planned", None},  # a plan; which of those in pairs are used
    "--protocol": {"FILE|paper", None},  # of a session; how simulated people swipe
    "--radar": {"CAPTURE", "NAME|CONFIG.json", "SOURCE"},  # recorded; to simulate; live
    "--rate": {"FPS", "HZ"},  # of maps; of an inertial sensor
    "--wall": {"DIRECTION@M[,DB]", "Z[,C]"},  # of a recording's scene; of one simulated signal
}
"""Options whose value differs between commands. Of all others a metavar says it for all."""

ENDINGS = {
    "FILE", "FILE.json", "FILE.npz", "FILE.safetensors", "FILE.zarr", "FOLDER", "NAME.sd2", "RUN",
    "NAME.sd2|FOLDER",
}  # fmt: skip
"""Metavars of ``--out``."""

UNITS = {"_s": "S", "_m": "M", "_hz": "HZ", "_deg": "DEG", "_db": "DB", "_px": "PX", "_ms": "MS"}

GROUPS = {
    "positional arguments", "options", "data", "description", "frame times", "machine", "maps",
    "label file", "mesh file", "network", "network and training", "people", "segments", "sensor",
    "sensor errors",
}  # fmt: skip


def walk(
    parser: argparse.ArgumentParser, path: tuple[str, ...] = ()
) -> Iterator[tuple[str, argparse.ArgumentParser]]:
    """Every command that does something, by its words."""
    inner = commands_of(parser)
    for name, command in inner.items():
        yield from walk(command, (*path, name))
    if not inner:
        yield " ".join(path), parser


COMMANDS = dict(walk(full_parser()))
ARGUMENTS = [
    (f"{name}: {argument.option_strings or argument.dest}", argument)
    for name, parser in COMMANDS.items()
    for argument in arguments_of(parser)
    if argument.dest != "help"
]
OPTIONS_WITH_VALUE = [
    (name, argument)
    for name, argument in ARGUMENTS
    if argument.option_strings and argument.nargs != 0
]


def test_there_are_commands_to_look_at() -> None:
    assert {"info", "labels cut", "classify table", "open"} <= COMMANDS.keys()
    assert len(OPTIONS_WITH_VALUE) > 100


def test_help_begins_in_lower_case_and_ends_without_a_full_stop() -> None:
    for name, argument in ARGUMENTS:
        text = argument.help or ""
        assert text, name
        assert text[0] == text[0].lower(), name
        assert not text.endswith((".", ";", ",")), name
        assert not text.startswith("default"), name


def test_groups_have_names_from_a_small_set() -> None:
    for name, parser in COMMANDS.items():
        titles = groups_of(parser)
        assert set(titles) <= GROUPS, name
        assert len(titles) == len(set(titles)), name


def test_facts_are_printed_as_json_on_request() -> None:
    for name in COMMANDS.keys() - WITHOUT_FACTS:
        json = options_of(COMMANDS[name])["--json"]
        assert json.nargs == 0, name


def test_what_is_written_is_called_out() -> None:
    for name, argument in OPTIONS_WITH_VALUE:
        option, words = argument.option_strings[0], (argument.help or "").split()
        if option == "--out":
            assert argument.type is Path, name
            assert argument.metavar in ENDINGS, name
        elif option in FURTHER_OUTPUTS:
            assert argument.metavar == FURTHER_OUTPUTS[option], name
        else:
            assert not {"write", "draw", "keep"} & {words[0]} or argument.type is not Path, name
    for name, argument in ARGUMENTS:
        if not argument.option_strings:
            assert argument.dest != "out", name
            assert "write" not in (argument.help or "").split(), name


def test_folders_are_made_for_whatever_is_written() -> None:
    options = {"--out", *FURTHER_OUTPUTS}
    found = {one.dest for _, one in OPTIONS_WITH_VALUE if options & {*one.option_strings}}
    assert found == {*OUTPUTS}


def test_an_option_means_the_same_everywhere() -> None:
    found: defaultdict[str, set[object]] = defaultdict(set)
    for _, argument in OPTIONS_WITH_VALUE:
        for option in argument.option_strings:
            found[option].add(argument.metavar)
    del found["--out"]
    assert {option: names for option, names in found.items() if len(names) > 1} == SEVERAL_MEANINGS


def test_a_metavar_stands_for_one_kind_of_value() -> None:
    kinds: defaultdict[object, set[bool]] = defaultdict(set)
    for _, argument in OPTIONS_WITH_VALUE:
        kinds[argument.metavar].add(argument.type is Path)
    kinds.pop(None)  # choices, which are listed
    # `labels set --use` takes a file, or the word usual.
    assert [one for one, paths in kinds.items() if len(paths) > 1] == ["FILE.json"]


def test_a_unit_in_the_name_is_that_of_the_value() -> None:
    for name, argument in OPTIONS_WITH_VALUE:
        for ending, metavar in UNITS.items():
            flag = argument.option_strings[0].replace("-", "_")
            if flag.endswith(ending) and not flag.endswith("_per_s"):
                assert argument.metavar == metavar, name


def test_values_have_a_name_or_are_listed() -> None:
    for name, argument in OPTIONS_WITH_VALUE:
        assert argument.choices or isinstance(argument.metavar, str), name


def test_outputs_that_exist_are_refused_by_all_commands_alike() -> None:
    for name, parser in COMMANDS.items():
        actions = {action.dest for action in arguments_of(parser)}
        if actions & {*OUTPUTS}:
            assert ("overwrite" in actions) == (name not in GO_ON), name
