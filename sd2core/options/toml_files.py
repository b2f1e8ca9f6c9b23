"""Records read from TOML, with errors that name file, line and key."""

from __future__ import annotations

import json
import re
from typing import TypeVar

from pydantic import TypeAdapter, ValidationError

from sd2core.errors import Sd2Error
from sd2core.files.texts import UNKNOWN_KEY, parse_toml

Content = TypeVar("Content")
_HEADER = re.compile(r"\s*\[+\s*([^\[\]]+?)\s*\]+")
_KEY = re.compile(r"""\s*([A-Za-z0-9_."'* /\\-]+?)\s*=""")
_HINT = "docs/formats.md says what it may hold"


def parsed(kind: type[Content], text: str, source: str) -> Content:
    """Return the record that a TOML text describes; Sd2Error names source, line and key."""
    try:
        # Strict as JSON is: lists are lists and numbers are numbers. TOML's dates are neither.
        content = json.dumps(parse_toml(text, source, "TOML", _HINT))
    except TypeError as error:
        raise Sd2Error(
            f"{source} holds a date or a time ({error})", "texts, numbers, lists and tables", _HINT
        ) from error
    try:
        return TypeAdapter(kind).validate_json(content)
    except ValidationError as error:
        raise _in_words(error, text, source) from error


def _in_words(error: ValidationError, text: str, source: str) -> Sd2Error:
    first = error.errors()[0]
    keys = tuple(str(part) for part in first["loc"])
    line = line_of(text, keys)
    where = source if line is None else f"{source}, line {line}"
    name, kind = ".".join(keys), first["type"]
    if kind == "missing":
        return Sd2Error(f"{where}: {name} is missing", "a value of it", _HINT)
    if kind in UNKNOWN_KEY:
        return Sd2Error(f"{where}: {name} is not known", "a key that has a meaning here", _HINT)
    if kind in ("dataclass_type", "model_type", "dict_type"):
        return Sd2Error(f"{where}: {name} is {first['input']!r:.80}", f"a section [{name}]", _HINT)
    message = first["msg"].removeprefix("Value error, ").removeprefix("Input should be ")
    if kind == "value_error":
        return Sd2Error(f"{where}: {name}: {message}" if name else f"{where}: {message}", "", _HINT)
    return Sd2Error(f"{where}: {name} is {first['input']!r:.80}", message, _HINT)


def line_of(text: str, keys: tuple[str, ...]) -> int | None:
    """Return the number, from 1, of the line of a TOML text that holds a key.

    Where the key itself is not there, the line of the innermost table around it that is.
    """
    lines: dict[tuple[str, ...], int] = {}
    table: tuple[str, ...] = ()
    for number, line in enumerate(text.splitlines(), start=1):
        if header := _HEADER.match(line):
            table = _parts(header[1])
            lines.setdefault(table, number)
        elif key := _KEY.match(line):
            lines.setdefault(table + _parts(key[1]), number)
    for length in range(len(keys), 0, -1):
        if keys[:length] in lines:
            return lines[keys[:length]]
    return None


def _parts(name: str) -> tuple[str, ...]:
    if name[:1] in "\"'":
        return (name.strip("\"'"),)
    return tuple(part.strip().strip("\"'") for part in name.split("."))
