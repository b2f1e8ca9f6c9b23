"""Seeded ways to damage a file."""

from __future__ import annotations

import io
import json
import os
import random
import re
import zipfile
from pathlib import Path
from typing import Any

from tests.mutants.array_damage import damage_arrays, damages_arrays
from tests.mutants.text_damage import WAYS, damage_record

_HOSTILE: tuple[Any, ...] = (
    None, True, -1, 0, 1, 7, 65537, 10**9, 50_000_000, 700_000_000, 2**62, 1e300, 1e-300, 0.5,
    "", "x", "NaN", "Infinity", [], {}, [[]],
    [0], [-1], [3, 3], [10**9], {"name": "x"}, "blosc", "float64", "S4", "🦆",
)  # fmt: skip
_SIZES = (0, 1, 255, 65537, 10**9, 2**31, 2**40, 2**62, 2**64 - 1)


def mutate(path: Path, seed: int) -> str:
    """Damage a file, or one file of a folder; returns how."""
    rng = random.Random(seed)
    if damages_arrays(path) and rng.random() < 0.5:
        return f"{damage_arrays(path, rng, _replace_value)} in {path.name}"
    files = [path] if path.is_file() else sorted(one for one in path.rglob("*") if one.is_file())
    texts = [one for one in files if one.suffix in (".json", ".jsonl")]
    file = rng.choice(texts if texts and rng.random() < 0.5 else files)
    if rng.random() < 0.02:
        way = rng.choice([_lose, _pipe])
        way(file)
        return f"{way.__name__[1:]} {file.relative_to(path.parent)}"
    content = file.read_bytes()
    inside = _member(content, rng) if rng.random() < 0.5 else None
    if file.suffix == ".safetensors" and rng.random() < 0.5:
        file.write_bytes(_with_other_header(content, rng))
        return f"replace_value in the header of {file.name}"
    ways = [_cut, _flip, _overwrite, _repeat, _enlarge]
    if file.suffix == ".json" and rng.random() < 0.7:
        ways = [_replace_value]
    if inside is None and ways != [_replace_value] and _is_text(content):
        ways = [damage_record] if file.suffix == ".journal" else [*ways, *WAYS]
    change = rng.choice(ways)
    if inside is None:
        file.write_bytes(change(content, rng))
    else:
        file.write_bytes(_repacked(content, inside, rng, change))
    place = file.relative_to(path.parent)
    return f"{change.__name__.lstrip('_')} {inside or ''} {place}".replace("  ", " ")


def _is_text(content: bytes) -> bool:
    try:
        return bool(content.decode())
    except UnicodeDecodeError:
        return False


def _lose(file: Path) -> None:
    file.unlink()


def _pipe(file: Path) -> None:
    file.unlink()
    os.mkfifo(file)


def _cut(content: bytes, rng: random.Random) -> bytes:
    return content[: rng.randrange(len(content) + 1)]


def _flip(content: bytes, rng: random.Random) -> bytes:
    changed = bytearray(content)
    for _ in range(rng.randint(1, 4) if changed else 0):
        changed[rng.randrange(len(changed))] ^= 1 << rng.randrange(8)
    return bytes(changed)


def _overwrite(content: bytes, rng: random.Random) -> bytes:
    start, length = rng.randrange(len(content) + 1), rng.randint(1, 64)
    return content[:start] + rng.randbytes(length) + content[start + length :]


def _repeat(content: bytes, rng: random.Random) -> bytes:
    start, length = rng.randrange(len(content) + 1), rng.randint(1, 64)
    return content[: start + length] + content[start:]


def _enlarge(content: bytes, rng: random.Random) -> bytes:
    """Put another size in place of a number, in digits or in bytes, mostly near the start."""
    reach = len(content) if rng.random() < 0.5 else 4096
    size = rng.choice(_SIZES)
    digits = list(re.finditer(rb"\d+", content[: min(reach, 65536)]))
    if digits and rng.random() < 0.5:
        found = rng.choice(digits)
        return content[: found.start()] + b"%d" % size + content[found.end() :]
    start, width = rng.randrange(len(content) // 4 + 1) * 4 % max(reach, 1), rng.choice([4, 8])
    packed = (size & (1 << 8 * width) - 1).to_bytes(width, "little")
    return content[:start] + packed + content[start + width :]


def _replace_value(content: bytes, rng: random.Random) -> bytes:
    """Put a value that nobody expects into a JSON document, or take one away."""
    document = json.loads(content)
    places: list[tuple[Any, Any]] = []

    def walk(node: Any) -> None:
        for key in node if isinstance(node, dict) else range(len(node)):
            places.append((node, key))
            if isinstance(node[key], dict | list):
                walk(node[key])

    walk(document)
    node, key = rng.choice(places)
    if rng.random() < 0.2:
        del node[key]
    elif isinstance(node[key], list) and node[key] and rng.random() < 0.5:
        node[key] = [node[key][0]] * (len(node[key]) + rng.randrange(2))  # names repeated
    else:
        node[key] = rng.choice(_HOSTILE)
    return json.dumps(document).encode()


def _with_other_header(content: bytes, rng: random.Random) -> bytes:
    """Safetensors with a value of its header, or of the card in it, replaced."""
    end = 8 + int.from_bytes(content[:8], "little")
    header = json.loads(content[8:end])
    card = json.loads(header["__metadata__"]["sd2"])
    if rng.random() < 0.5:
        card = json.loads(_replace_value(json.dumps(card).encode(), rng))
        header["__metadata__"]["sd2"] = json.dumps(card)
        packed = json.dumps(header).encode()
    else:
        packed = _replace_value(content[8:end], rng)
    return len(packed).to_bytes(8, "little") + packed + content[end:]


def _member(content: bytes, rng: random.Random) -> str | None:
    """Name of a member of a zip; None where it is none."""
    if not content.startswith(b"PK"):
        return None
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        return rng.choice(archive.namelist())


def _repacked(content: bytes, name: str, rng: random.Random, change: Any) -> bytes:
    """Zip with a member changed, its checksum right, so that what is in it is looked at."""
    made = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as archive, zipfile.ZipFile(made, "w") as written:
        for entry in archive.infolist():
            data = archive.read(entry)
            written.writestr(entry, change(data, rng) if entry.filename == name else data)
    return made.getvalue()
