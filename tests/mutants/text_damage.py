"""Seeded ways to damage a text: what stands in it becomes what no program writes there."""

from __future__ import annotations

import random
import re
import zlib

_PIECES = (
    b"[" * 100_000, b'{"a":' * 100_000, b'[{"a":' * 3000, b"<a>" * 50_000, b"a." * 3000,
    b"9" * 5000, b"0x" + b"f" * 5000, b"\0", b"\0" * 70_000, b"\xff", b"\xc3(", b"\xed\xa0\x80",
    b"\\ud800", b"\\u0000", b"\xef\xbb\xbf", b"\r", b"\n", b"\n" * 3000, b" ", b"\t", b",", b";",
    b'"', b"'", b"[", b"]", b"{", b"}", b"<", b">", b"&", b"&a;", b"#", b"=", b"..", b"\xf0\x9f",
)  # fmt: skip
_VALUES = (
    b"NaN", b"nan", b"inf", b"-inf", b"Infinity", b"1e999", b"-1e999", b"1e308", b"-1e308",
    b"1e-320", b"-1", b"-0", b"0", b"1", b"1e9", b"4294967296", b"18446744073709551616", b"9" * 40,
    b"9" * 299, b"9" * 5000, b"null", b"true", b"[]", b"{}", b'""', b'"x"', b"x", b"", b"1.5",
    b"''", b"1,5", b"1979-05-27", b"{a = 1}", b"[[1]]",
)  # fmt: skip
_VALUE = re.compile(rb'-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?|"[^"\n]*"|true|false|null|\w+')


def replace_token(content: bytes, rng: random.Random) -> bytes:
    """Put something else in place of a number, a text in quotes or a word."""
    found = rng.choice(list(_VALUE.finditer(content)) or [re.match(b"", content)])
    assert found is not None
    return content[: found.start()] + rng.choice(_VALUES) + content[found.end() :]


def insert_piece(content: bytes, rng: random.Random) -> bytes:
    """Put in a bracket, a half character, or a hundred thousand brackets."""
    at = rng.randrange(len(content) + 1)
    if rng.random() < 0.5 and (starts := list(_VALUE.finditer(content))):
        at = rng.choice(starts).start()
    return content[:at] + rng.choice(_PIECES) + content[at:]


def double_part(content: bytes, rng: random.Random) -> bytes:
    """Put a part of any length in twice, or some lines."""
    if rng.random() < 0.5:
        lines = content.splitlines(keepends=True) or [b""]
        at, stop = sorted((rng.randrange(len(lines)), rng.randrange(len(lines) + 1)))
        return b"".join([*lines[:stop], *lines[at:]])
    at, stop = sorted(rng.randrange(len(content) + 1) for _ in range(2))
    return content[:stop] + content[at:]


def drop_part(content: bytes, rng: random.Random) -> bytes:
    """Leave out a part, or all of it."""
    at, stop = sorted(rng.randrange(len(content) + 1) for _ in range(2))
    return b"" if rng.random() < 0.05 else content[:at] + content[stop:]


WAYS = (replace_token, replace_token, insert_piece, double_part, drop_part)


def damage_record(content: bytes, rng: random.Random) -> bytes:
    """Damage the JSON of a record of a journal, its length and checksum right."""
    records = content.splitlines()
    at = rng.randrange(len(records))
    payload = rng.choice(WAYS)(records[at][18:], rng)
    records[at] = b"%08x %08x %b" % (len(payload), zlib.crc32(payload), payload)
    return b"\n".join(records) + b"\n"
