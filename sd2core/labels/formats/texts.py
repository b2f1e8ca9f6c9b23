"""Reading of text files, with clear errors for anything that is no text."""

from __future__ import annotations

import codecs
from pathlib import Path

import numpy as np

from sd2core.errors import Sd2Error

LARGEST_BYTES = 64 * 1024**2
"""A hundred times the labels of a day; what is larger is something else."""

_MARKS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)


def read_content(path: Path, expected: str) -> bytes:
    """Read a whole file; ``expected`` describes it for the message: ``"an ELAN file"``.

    Raises Sd2Error when it is missing, a folder, empty or larger than :data:`LARGEST_BYTES`.
    """
    try:
        if path.is_dir():
            raise Sd2Error(f"{path} is a folder", expected, "Name the file itself")
        size = path.stat().st_size
        if size > LARGEST_BYTES:
            raise Sd2Error(
                f"{path} has {size / 1024**2:,.0f} MiB",
                f"{expected} of at most {LARGEST_BYTES // 1024**2} MiB",
                "Check that this is the file you mean",
            )
        content = path.read_bytes()
    except FileNotFoundError:
        raise Sd2Error(f"{path} is not there", expected, "Check the path") from None
    except OSError as error:
        raise Sd2Error(f"{path} cannot be read: {error.strerror}", expected) from error
    if not content.strip():
        raise Sd2Error(f"{path} is empty", expected, "Export it again")
    return content


def read_text(path: Path, expected: str) -> str:
    """Read a text in UTF-8, or in UTF-16 with a byte order mark; line ends stay as they are.

    Raises Sd2Error as :func:`read_content`, and when the file is no such text.
    """
    content = read_content(path, expected)
    encoding = "utf-8"
    for mark, name in _MARKS:
        if content.startswith(mark):
            content, encoding = content[len(mark) :], name
    remedy = "Save it as UTF-8"
    try:
        text = content.decode(encoding)
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
        raise Sd2Error(f"{path} is empty", expected, "Export it again")
    return text


def positional(value: float, *, min_digits: int | None = None) -> str:
    """Format the shortest decimal number, without an exponent, that reads back as the same."""
    return np.format_float_positional(value, unique=True, trim="0", min_digits=min_digits)


def whole_number(text: str) -> int | None:
    """Parse a text of at most 18 digits; None for any other."""
    return int(text) if text.isascii() and text.isdigit() and len(text) <= 18 else None
