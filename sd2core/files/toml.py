"""Writing values as TOML, which Python only reads."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sd2core.files.paths import stored_path

_BARE = re.compile("[A-Za-z0-9_-]+")
"""Keys without quotation marks."""


def toml_value(value: Any, folder: Path) -> str:
    """Write a flag, number, text, path or list; paths relative to a folder."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(toml_value(one, folder) for one in value) + "]"
    if isinstance(value, Path):
        value = stored_path(value.absolute(), folder.absolute())
    return _text(value) if isinstance(value, str) else json.dumps(value)


def toml_lines(table: Mapping[str, Any], folder: Path) -> list[str]:
    """One ``key = value`` per entry; entries that are None are left out."""
    return [
        f"{key if _BARE.fullmatch(key) else _line(key)} = {toml_value(value, folder)}"
        for key, value in table.items()
        if value is not None
    ]


def section_lines(name: str, table: Mapping[str, Any], folder: Path) -> list[str]:
    """Lines of a section, tables in it as sections of their own."""
    tables = {key: value for key, value in table.items() if isinstance(value, Mapping)}
    plain = {key: value for key, value in table.items() if key not in tables}
    lines = ["", f"[{name}]", *toml_lines(plain, folder)]
    for key, content in tables.items():
        lines += ["", f"[{name}.{key}]", *toml_lines(content, folder)]
    return lines


def _text(value: str) -> str:
    """Write a string of TOML, of several lines as it is."""
    lines = [_line(line) for line in value.split("\n")]
    return lines[0] if len(lines) == 1 else '"""\n' + "\n".join(one[1:-1] for one in lines) + '"""'


def _line(value: str) -> str:
    """Write a basic string of TOML: JSON's, but for one character."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
