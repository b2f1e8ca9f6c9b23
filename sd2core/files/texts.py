"""Text files, JSON and TOML: judged by kind and size before they are read, refused in words."""

from __future__ import annotations

import codecs
import json
import os
import re
from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import is_dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

from sd2core.errors import Sd2Error
from sd2core.files.limits import VARIABLE, check_regular, read_limit_bytes

if TYPE_CHECKING:
    from pydantic import ValidationError

UNKNOWN_KEY = ("extra_forbidden", "unexpected_keyword_argument")
"""Pydantic's words for a key that a model, or a dataclass, does not know."""
EXPECTED_JSON = "JSON written by SD² Studio"
_PART = 64
"""Part of the limit on memory that a text may have: parsed, it takes up to 130 times as much."""
_DEEPEST = 100
"""Lists and tables that may stand in each other; Python itself gives up before a thousand."""
_LONG_NUMBER = re.compile(r"[0-9](?:[0-9_]{300,}|x[0-9a-fA-F_]{250,})")
"""A whole number that no float holds."""
_LONGEST_VALUE = 60
_LONGEST_LINE_BYTES = 1 << 20
OPEN_WITH_WRITER = "Open it with the version of SD² Studio that wrote it, or a later one"
_REMEDY = "Correct it with a text editor, or copy it again"

_MARKS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)


def read_content(path: Path, expected: str) -> bytes:
    """Read a whole file; ``expected`` describes it for the message: ``"an ELAN file"``.

    Raises Sd2Error when it is missing, no regular file, or larger than a text can be.
    """
    try:
        check_regular(path)
        if path.is_dir():
            raise Sd2Error(f"{path} is a folder", expected, "Name the file itself")
        size, most = path.stat().st_size, read_limit_bytes() // _PART
        if size > most:
            raise Sd2Error(
                f"{path} has {size / 1e6:,.0f} MB",
                f"{expected} of at most {most / 1e6:,.0f} MB",
                "Check that this is the file you mean; if so, set the environment variable"
                f" {VARIABLE} to {_PART * size / 1e9 + 0.1:.1f}",
            )
        return path.read_bytes()
    except FileNotFoundError:
        raise Sd2Error(f"{path} does not exist", expected, "Check the path") from None
    except (OSError, ValueError) as error:  # ValueError: no path at all, with a zero byte in it
        reason = getattr(error, "strerror", None) or error
        raise Sd2Error(f"{path} cannot be read: {reason}", expected) from error


def read_text(path: Path, expected: str, *, errors: str = "strict") -> str:
    """Read a text in UTF-8, or in UTF-16 with a byte order mark; line ends stay as they are.

    With ``errors="replace"`` what is in another encoding becomes signs of replacement: for files
    whose comments alone hold more than ASCII.

    Raises Sd2Error as :func:`read_content`, and when the file is no such text or empty.
    """
    content = read_content(path, expected)
    encoding = "utf-8"
    for mark, name in _MARKS:
        if content.startswith(mark):
            content, encoding = content[len(mark) :], name
    remedy = "Save it as UTF-8"
    try:
        text = content.decode(encoding, errors)
    except UnicodeDecodeError as error:
        raise Sd2Error(
            f"{path} is not {encoding.upper()}: byte {error.start} is {content[error.start]:#04x}",
            f"{expected} in UTF-8 or UTF-16",
            remedy,
        ) from None
    if "\0" in text:
        raise Sd2Error(
            f"{path} holds zero bytes", f"{expected}, which is text in UTF-8 or UTF-16", remedy
        )
    if not text.strip():
        raise Sd2Error(f"{path} is empty", expected, "Copy it again, or write it again")
    return text


def lines_of(stream: BinaryIO) -> Iterator[bytes]:
    """Lines of a file that may be long, with their ends; one of over 1 MiB comes in pieces."""
    return iter(partial(stream.readline, _LONGEST_LINE_BYTES), b"")


def whole_lines(stream: BinaryIO) -> Iterator[bytes]:
    """Lines of a file that is appended to, but for one that is being written, or was torn."""
    for line in lines_of(stream):
        if not line.endswith(b"\n") and len(line) < _LONGEST_LINE_BYTES:
            stream.seek(-len(line), 1)
            return
        yield line


def append_lines(path: Path, lines: Iterable[str]) -> None:
    """Append lines, which have ends, to a file on disk."""
    with path.open("a", encoding="utf-8") as stream:
        stream.writelines(lines)
        stream.flush()
        os.fsync(stream.fileno())


def drop_torn_line(path: Path) -> None:
    """Cut off an incomplete last line, where there is a file."""
    if path.exists():
        with path.open("r+b") as stream:
            deque(whole_lines(stream), maxlen=0)
            stream.truncate()


def read_json(path: Path, expected: str = EXPECTED_JSON, remedy: str = "") -> Any:
    """Read a JSON file; raises Sd2Error as :func:`read_text` and :func:`parse_json`."""
    return parse_json(read_text(path, expected), path, expected, remedy)


def parse_json(text: str, place: str | Path, expected: str, remedy: str = "") -> Any:
    """Parse JSON that stands at a place.

    Parameters
    ----------
    text : str
    place : str or Path
        Where it stands, such as a file, for the error.
    expected : str
        What was expected, for the error.
    remedy : str
        What to do, for the error; by default to correct the file or copy it again.

    Raises
    ------
    Sd2Error
        Where it is none, or holds what no reader copes with: lists or tables in each other more
        than a hundred deep, a number of more than 300 digits, or half a character.
    """
    return _parsed("JSON", text, place, expected, remedy)


def read_toml(path: Path, expected: str, remedy: str = "") -> dict[str, Any]:
    """Read a TOML file; raises Sd2Error as :func:`read_text` and :func:`parse_toml`."""
    return parse_toml(read_text(path, expected), path, expected, remedy)


def parse_toml(text: str, place: str | Path, expected: str, remedy: str = "") -> dict[str, Any]:
    """Parse TOML that stands at a place; raises Sd2Error as :func:`parse_json`.

    Parameters
    ----------
    text, place, expected, remedy
        As for :func:`parse_json`.
    """
    return _parsed("TOML", text, place, expected, remedy)


@contextmanager
def errors_in(place: str | Path, remedy: str = _REMEDY) -> Iterator[None]:
    """Name the file in errors about what stands in it, and say what to do where they do not."""
    try:
        yield
    except Sd2Error as error:
        named = error.within(place)
        raise Sd2Error(named.found, named.expected, named.remedy or remedy) from error


@contextmanager
def faults_in(place: str | Path, expected: str, remedy: str = "") -> Iterator[None]:
    """Say in words what a model of pydantic refuses of the content of a place."""
    from pydantic import ValidationError

    try:
        yield
    except ValidationError as error:
        raise Sd2Error(f"{place}: {first_fault(error)}", expected, remedy) from error


@contextmanager
def damage_in(place: str | Path, expected: str = "") -> Iterator[None]:
    """Name the file in errors about its description, and refuse one of other keys or types."""
    try:
        yield
    except Sd2Error as error:
        raise error.within(place) from error
    except (LookupError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise Sd2Error(f"{place}: its description is damaged ({error!r})", expected) from error


@contextmanager
def reading_as(form: str, place: str | Path, expected: str, remedy: str = "") -> Iterator[None]:
    """Raise Sd2Error for whatever fails while a file is read: libraries fail in many ways.

    Parameters
    ----------
    form : str
        What it is read as, for the error.
    place, expected, remedy
        As for :func:`parse_json`.
    """
    try:
        yield
    except Sd2Error:
        raise
    except Exception as error:
        found = f"{place} cannot be read as {form} ({cause_of(error)})"
        raise Sd2Error(found, expected, remedy) from error


def cause_of(error: BaseException) -> str:
    """Kind of an error of a library, and its words, for a message of ours."""
    return f"{type(error).__name__}: {error}"[:200]


def check_version(
    content: Any,
    place: Path | str,
    form: str,
    newest: int,
    *,
    oldest: int = 1,
    remedy: str = OPEN_WITH_WRITER,
) -> None:
    """Refuse the content of a file of another format, or of a version that is not read.

    Parameters
    ----------
    content : object
        As parsed; anything but a mapping has no format.
    place
        For the error.
    form : str
        Wanted value of ``format``.
    newest, oldest : int
        Values of ``version`` that are read; it is 0 where there is none.
    remedy : str
        What to do about another version.

    Raises
    ------
    Sd2Error
    """
    stored = content if isinstance(content, Mapping) else {}
    if stored.get("format") != form:
        raise Sd2Error(f"{place} has the format {stored.get('format')!r}", f"the format {form!r}")
    version = stored.get("version", 0)
    if isinstance(version, bool) or not isinstance(version, int) or not oldest <= version <= newest:
        known = f"version {newest}" if oldest == newest else f"a version from {oldest} to {newest}"
        raise Sd2Error(f"{place} is of version {version!r}", known, remedy)


def first_fault(error: ValidationError) -> str:
    """Describe the first fault: its place, the value found and the reason."""
    first = error.errors(include_url=False)[0]
    where = ".".join(str(part) for part in first["loc"]) or "the file"
    if first["type"] == "missing":
        return f"{where} is missing"
    if first["type"] in UNKNOWN_KEY:
        return f"{where} is nothing that this version knows"
    value = repr(first["input"])
    value = value if len(value) <= _LONGEST_VALUE else f"{value[:_LONGEST_VALUE]}…"
    return f"{where} is {value} ({first['msg']})"


def _parsed(form: str, text: str, place: str | Path, expected: str, remedy: str) -> Any:
    import tomllib  # for few files, and slow to load

    try:
        if long := _LONG_NUMBER.search(text):
            line = text.count("\n", 0, long.start()) + 1
            raise ValueError(f"line {line}: a number of {len(long[0]):,} digits")
        content = json.loads(text) if form == "JSON" else tomllib.loads(text)
        if _is_deep(content):
            raise RecursionError
        if "\\u" in text:  # Half of a character is no text that could be shown or written.
            json.dumps(content, ensure_ascii=False, default=str).encode()
        return content
    except (ValueError, RecursionError) as error:
        reason = "nested too deeply" if isinstance(error, RecursionError) else str(error)
        if isinstance(error, UnicodeEncodeError):
            reason = f"half a character, {error.object[error.start]!r}"
        found = f"{place} cannot be read as {form} ({reason})"
        raise Sd2Error(found, expected, remedy or _REMEDY) from error


def _is_deep(content: Any) -> bool:
    level: list[Any] = [[content]]
    for _ in range(_DEEPEST + 1):
        tables = (one.values() if isinstance(one, dict) else one for one in level)
        level = [one for table in tables for one in table if isinstance(one, dict | list)]
        if not level:
            return False
    return True


def first_difference(before: Any, now: Any, name: str = "") -> tuple[str, str, str]:
    """Name the first part in which two values differ, and say both there in words.

    Parameters
    ----------
    before, now : object
        Mappings, records or lists are gone into; both are of one kind, and differ.
    name : str
        Of the whole, before that of the part.

    Examples
    --------
    >>> first_difference({"radar": {"chirps": 64}, "seed": 0}, {"radar": {"chirps": 32}, "seed": 0})
    ('radar chirps', '64', '32')
    """
    first, second = (vars(one) if is_dataclass(one) else one for one in (before, now))
    if isinstance(first, Mapping) and isinstance(second, Mapping):
        keys = {**first, **second}
        key = next(key for key in keys if first.get(key) != second.get(key))
        return first_difference(first.get(key), second.get(key), f"{name} {key}".strip())
    return name, _in_words(before), _in_words(now)


def refuse_change(path: Path, before: Any, now: Any, name: str, other: str) -> None:
    """Raise Sd2Error for what was begun with another value of a setting; ``other``: a way out."""
    if before != now:
        what, begun, asked = first_difference(before, now, name)
        raise Sd2Error(
            f"{path} was begun with {what} {begun}",
            f"{asked}, as it is asked for now",
            f"Go on with the same settings, or {other}",
        )


def _in_words(value: Any) -> str:
    if isinstance(value, list | tuple):
        value = ", ".join(map(str, value))
    elif isinstance(value, bool):
        value = "yes" if value else "no"
    text = "none" if value is None or value == "" else str(value)
    return text if len(text) <= _LONGEST_VALUE else f"{text[:_LONGEST_VALUE]}…"
