"""Seeded damage to files, to see that every reader refuses it in words.

``python -m tests.mutants --count 10000`` (``make fuzz``) tries that many and prints what happened.
A mutant must be read or refused with ``Sd2Error``, by a process that lives on.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import random
import shutil
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from sd2core.datasets.options import DatasetOptions
from sd2core.datasets.reading import open_dataset
from sd2core.datasets.sources import pair_sources
from sd2core.datasets.writing import write_dataset
from sd2core.errors import Sd2Error
from sd2core.io.mesh import load_mesh, save_mesh
from sd2core.mesh.sequence import MeshSequence
from sd2core.pairs.store import read_pairs
from sd2core.timebase import Timebase
from tests.small_pairs import write_pairs

SLOW_S = 10.0
"""Time that no reader may take for a mutant, on a machine with nothing else to do."""

_HOSTILE: tuple[Any, ...] = (
    None, True, -1, 0, 1, 7, 65537, 1e300, 1e-300, 0.5, "", "x", "NaN", "Infinity", [], {}, [[]],
    [0], [-1], [3, 3], {"name": "x"}, "blosc", "float64", "S4", "🦆",
)  # fmt: skip


def _read_mesh(path: Path) -> None:
    mesh = load_mesh(path)
    mesh.read(0, mesh.frame_count)


def _read_pairs(path: Path) -> None:
    read_pairs(path)


def _read_dataset(path: Path) -> None:
    with open_dataset(path) as dataset:
        list(dataset.sources())
        for name in dataset.arrays:
            dataset[name][:]


READERS: dict[str, Callable[[Path], None]] = {
    "mesh.zarr": _read_mesh,
    "mesh.zarr.zip": _read_mesh,
    "pairs.zarr": _read_pairs,
    "set.zarr": _read_dataset,
}


@dataclass
class Tally:
    """What became of the mutants of one kind of file."""

    outcomes: Counter[str] = field(default_factory=Counter)
    failures: list[str] = field(default_factory=list)
    slowest_s: float = 0.0


def make_originals(folder: Path) -> None:
    """Write one small file of every kind."""
    rng = np.random.default_rng(1)
    vertices = rng.normal(size=(400, 500, 3)).astype(np.float32) * 0.3 + np.float32([0, 0, 3])
    faces = np.stack([np.arange(398), np.arange(398) + 1, np.arange(398) + 2], axis=1)
    present = np.arange(400) > 4
    mesh = MeshSequence(vertices, faces, Timebase.regular(400, 30.0), present=present)
    save_mesh(mesh, folder / "mesh.zarr")
    save_mesh(mesh, folder / "mesh.zarr.zip")
    pairs = write_pairs(folder / "pairs.zarr", ("s1", "s2"))
    sources = pair_sources([pairs], ("synthetic", "simulated"))
    write_dataset(folder / "set.zarr", sources, DatasetOptions(length=30, overlap=10))


def mutate(path: Path, seed: int) -> str:
    """Damage a file, or one file of a folder; returns how."""
    rng = random.Random(seed)
    files = [path] if path.is_file() else sorted(one for one in path.rglob("*") if one.is_file())
    texts = [one for one in files if one.suffix in (".json", ".jsonl")]
    file = rng.choice(texts if texts and rng.random() < 0.5 else files)
    content = bytearray(file.read_bytes())
    ways = [_cut, _flip, _overwrite, _repeat, _lose]
    if file.suffix == ".json" and rng.random() < 0.7:
        ways = [_replace_value]
    way = rng.choice(ways)
    way(file, content, rng)
    return f"{way.__name__[1:]} {file.relative_to(path.parent)}"


def _cut(file: Path, content: bytearray, rng: random.Random) -> None:
    file.write_bytes(content[: rng.randrange(len(content) + 1)])


def _flip(file: Path, content: bytearray, rng: random.Random) -> None:
    for _ in range(rng.randint(1, 4)):
        if content:
            content[rng.randrange(len(content))] ^= 1 << rng.randrange(8)
    file.write_bytes(content)


def _overwrite(file: Path, content: bytearray, rng: random.Random) -> None:
    start, length = rng.randrange(len(content) + 1), rng.randint(1, 64)
    content[start : start + length] = rng.randbytes(length)
    file.write_bytes(content)


def _repeat(file: Path, content: bytearray, rng: random.Random) -> None:
    start, length = rng.randrange(len(content) + 1), rng.randint(1, 64)
    content[start:start] = content[start : start + length]
    file.write_bytes(content)


def _lose(file: Path, content: bytearray, rng: random.Random) -> None:
    file.unlink()


def _replace_value(file: Path, content: bytearray, rng: random.Random) -> None:
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
    else:
        node[key] = rng.choice(_HOSTILE)
    file.write_text(json.dumps(document))


def _try_all(originals: Path, name: str, seeds: range, tell: Any) -> None:
    """Read mutants of one kind in a process of their own; tells seed by seed."""
    warnings.simplefilter("ignore")  # Zarr's, about what it does not recognise.
    with tempfile.TemporaryDirectory() as place:
        for seed in seeds:
            path = Path(place) / name
            if (originals / name).is_dir():
                shutil.copytree(originals / name, path)
            else:
                shutil.copy(originals / name, path)
            how = mutate(path, seed)
            tell.send((seed, how, "", 0.0))
            start_s = time.process_time()
            try:
                READERS[name](path)
                outcome = "read"
            except Sd2Error as error:
                outcome = "refused" if name.partition(".")[0] in str(error) else f"no file: {error}"
            except BaseException:
                outcome = traceback.format_exc(limit=-4, chain=False)
            tell.send((seed, how, outcome, time.process_time() - start_s))
            shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)
    tell.send(None)


def tried(name: str, seeds: range, originals: Path) -> Tally:
    """Read that many mutants; a process that dies is one failure, and the others go on."""
    tally = Tally()
    while seeds:
        listen, tell = multiprocessing.Pipe(duplex=False)
        child = multiprocessing.get_context("spawn").Process(
            target=_try_all, args=(originals, name, seeds, tell)
        )
        child.start()
        tell.close()
        last = seeds.start - 1
        how = "nothing"
        for last, how, outcome, spent_s in _reports(listen):
            if not outcome:
                continue
            tally.slowest_s = max(tally.slowest_s, spent_s)
            tally.outcomes[outcome if outcome in ("read", "refused") else "failed"] += 1
            if outcome not in ("read", "refused"):
                tally.failures.append(f"{name} {last} ({how}): {outcome}")
            how = ""
        child.join()
        if child.exitcode:
            tally.outcomes["crashed"] += 1
            tally.failures.append(f"{name} {last} ({how}): exit code {child.exitcode}")
        seeds = range(last + 1, seeds.stop)
    return tally


def _reports(listen: Any) -> Iterator[tuple[int, str, str, float]]:
    while True:
        try:
            report = listen.recv()
        except EOFError:
            return
        if report is None:
            return
        yield report


@contextmanager
def originals() -> Iterator[Path]:
    """Folder with one file of every kind, gone afterwards."""
    with tempfile.TemporaryDirectory() as place:
        make_originals(Path(place))
        yield Path(place)


def main() -> int:
    """Try mutants of every kind and print a table; 1 if any was not handled."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=10_000, help="mutants, of all kinds together")
    parser.add_argument("--seed", type=int, default=0, help="the first one's")
    options = parser.parse_args()
    each = -(-options.count // len(READERS))
    failures: list[str] = []
    print(f"{'file':16}{'mutants':>8}{'read':>8}{'refused':>8}{'failed':>8}{'crashed':>8}  slowest")
    with originals() as folder:
        for name in READERS:
            tally = tried(name, range(options.seed, options.seed + each), folder)
            counts = (tally.outcomes[one] for one in ("read", "refused", "failed", "crashed"))
            row = "".join(f"{count:8}" for count in (each, *counts))
            print(f"{name:16}{row}  {tally.slowest_s:.1f} s", flush=True)
            failures += tally.failures
            if tally.slowest_s > SLOW_S:
                failures.append(f"{name}: {tally.slowest_s:.1f} s for one mutant")
    print(*failures, sep="\n")
    return 1 if failures else 0


if __name__ == "__main__":
    raise SystemExit(main())
