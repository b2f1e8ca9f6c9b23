"""Pages of measurements: their texts and tables, what each was made from, and if that has changed.

``python -m tools.documentation.measured`` says it of every page; ``--mark`` also writes it at the
head of the pages. The test suite fails where a page does not say what is true of it, or is older
than the program without standing in ``OLD``.
"""

from __future__ import annotations

import argparse
import ast
import datetime
import hashlib
import os
import re
import subprocess
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from sd2core.accuracy.cache import this_machine
from sd2core.files.atomic import atomic_write_text
from sd2core.files.resources import resource_path
from sd2core.files.tables import markdown_table

REPOSITORY = Path(__file__).resolve().parents[2]
DOCS = REPOSITORY / "docs"
IMAGES = DOCS / "images"
BUILD = REPOSITORY / "build"
"""Campaigns, fits and runs that a page is measured on; what is there is not made again."""

SAMPLE = resource_path("swipes.sd2")
BENCHMARKS = REPOSITORY / "tests" / "benchmarks"
SHARED = Path(os.environ.get("SD2_SHARED_DATA", REPOSITORY.parent / "shared" / "data"))
"""Real recordings; pages leave out what needs them where they are missing."""


_HOURS = "hours of training, due with the next denoisers"
OLD = {
    "performance.md": "needs an idle machine for an hour",
    "fitting.md": "ten idle minutes; since then only the frame after a cut is left empty",
    "range-synthesis.md": _HOURS,
    "paper.md": _HOURS,
    "denoiser.md": _HOURS,
    "classifier.md": "since then longer waves, several people and what lost frames changed",
    "real-gestures.md": "since then only what lost frames has changed",
    "studies.md": "since then only what lost frames, and when pairs are made anew, has changed",
    "real-pairs.md": "since then only how trainings are cancelled and frames come live has changed",
}
"""Pages that may be older than the program, and why they were not measured anew."""

_DOPPLER = ("sd2core/doppler", "sd2core/scattering", "sd2core/maps.py")
_BODY = ("sd2core/body", "resources/lifter.npz", "resources/sides.npz")
_DENOISERS = ("resources/denoiser.safetensors", "resources/denoiser-limbs.safetensors")
_CAMPAIGN = ("sd2core/simulate", "resources/fit_errors.json")


@dataclass(frozen=True)
class Measured:
    """How a page is made, and the files and folders whose change makes it old."""

    command: str
    of: tuple[str, ...]


_LEARNING = ("sd2core/denoise", "sd2core/train")
_CLASSIFIERS = ("sd2core/classify", *_DENOISERS, *_CAMPAIGN)
_SUGGESTIONS = ("sd2core/classify", "sd2core/labels/suggest.py")
_PLANS = (*_DOPPLER, "sd2core/accuracy", "sd2core/fmcw")

PAGES = {
    "accuracy-and-speed.md": Measured("make accuracy", _PLANS),
    "nulling.md": Measured("python tests/core/mocap/mars_nulling.py", ("sd2core/doppler",)),
    "performance.md": Measured("make bench", (*_DOPPLER, "sd2core/fmcw")),
    "scale.md": Measured("make scale", ("sd2core/batch", "sd2core/datasets")),
    "fitting.md": Measured("make fitting", (*_BODY, "tools/fitting")),
    "denoiser.md": Measured(
        "make denoiser", ("sd2core/pairs", "sd2core/mocap", *_LEARNING, *_DENOISERS, *_CAMPAIGN)
    ),
    "range-synthesis.md": Measured("make range-synthesis", (*_LEARNING, *_CAMPAIGN)),
    "real-pairs.md": Measured(
        "python -m tools.documentation.real_pairs",
        ("sd2core/pairs", "sd2core/mocap", *_LEARNING),
    ),
    "studies.md": Measured(
        "python -m tools.documentation.studies",
        ("sd2core/study", "sd2core/classify", "sd2core/pairs", "tools/studies", *_LEARNING),
    ),
    "classifier.md": Measured("make classifier", ("sd2core/study", *_CLASSIFIERS)),
    "real-gestures.md": Measured("make real-gestures", _SUGGESTIONS),
    "paper.md": Measured("make paper", _CLASSIFIERS),
}

TEXTS = Path(__file__).with_name("texts")
_STAMP = re.compile(r"\n*<!-- measured (\S+) at (\S+) of: (.*?) -->\s*\Z", re.DOTALL)
_NOTE = re.compile(r"\n> \*\*Older than the program\.\*\*.*?\n(?=\n)", re.DOTALL)


def write_page(name: str, text: str) -> None:
    """Write a page of ``docs/`` that has just been measured, with what it was made from."""
    commit = _git("rev-parse", "--short=8", "HEAD")
    atomic_write_text(DOCS / name, stamped(text, name, datetime.date.today().isoformat(), commit))


def stamped(text: str, name: str, date: str, commit: str, root: Path = REPOSITORY) -> str:
    """A page with the hashes of what it was made from at its end."""
    parts = ", ".join(f"{part} {digest(root / part)}" for part in PAGES[name].of)
    bare = _NOTE.sub("", _STAMP.sub("", text)).rstrip("\n")
    return f"{bare}\n\n<!-- measured {date} at {commit} of: {parts} -->\n"


def changed(text: str, name: str) -> list[str]:
    """What has changed of what a page was made from; everything if it does not say."""
    stamp = _STAMP.search(text)
    if stamp is None:
        return list(PAGES[name].of)
    then = dict(part.split(" ") for part in stamp[3].split(", "))
    return [part for part in PAGES[name].of if then.get(part) != digest(REPOSITORY / part)]


def marked(text: str, name: str) -> str:
    """A page that says at its head whether it is older than the program."""
    bare = _NOTE.sub("", text)
    parts = changed(bare, name)
    if not parts:
        return bare
    stamp = _STAMP.search(bare)
    since = f"since {stamp[1]} (commit {stamp[2]})" if stamp else "since it was written"
    command = PAGES[name].command
    anew = f" `{command}` measures it anew." if command else ""
    note = f"> **Older than the program.** Changed {since}: {', '.join(parts)}.{anew}"
    title, _, rest = bare.partition("\n")
    return f"{title}\n\n{note}\n{rest}"


def digest(path: Path) -> str:
    """Hash of a file, or of all Python in a folder; comments and docstrings do not count."""
    if not path.exists():
        return "-"
    total = hashlib.sha256()
    for file in sorted(path.rglob("*.py")) if path.is_dir() else [path]:
        total.update(_content(file, file.stat().st_mtime_ns))
    return total.hexdigest()[:8]


@cache
def _content(file: Path, changed_ns: int) -> bytes:
    """What of a file counts; several pages are made from the same files."""
    if file.suffix != ".py":
        return file.read_bytes()
    return repr(_plain(ast.parse(file.read_text("utf-8")))).encode()


def _plain(code: Any) -> Any:
    """Code without docstrings, in the same words whatever version of Python reads it."""
    if isinstance(code, list):
        return [_plain(one) for one in code if not _is_text(one)]
    if not isinstance(code, ast.AST):
        return code
    if isinstance(code, ast.JoinedStr):  # Python 3.12 has empty pieces in f-strings
        code.values = [one for one in code.values if getattr(one, "value", None) != ""]
    named = ((name, _plain(value)) for name, value in ast.iter_fields(code))
    return type(code).__name__, [one for one in named if one[1] not in (None, [])]


def _is_text(code: object) -> bool:
    value = code.value if isinstance(code, ast.Expr) else None
    return isinstance(value, ast.Constant) and isinstance(value.value, str)


def _git(*arguments: str) -> str:
    done = subprocess.run(
        ["git", *arguments], cwd=REPOSITORY, check=True, capture_output=True, text=True
    )
    return done.stdout.strip()


def filled(name: str, **values: object) -> str:
    """A text of ``texts/`` with the values in place of their names."""
    return (TEXTS / name).read_text("utf-8").format(**values)


def write_filled(name: str, **values: object) -> None:
    """Write a page of ``docs/`` whose text has the same name; the machine is this one."""
    write_page(name, filled(name, machine=this_machine(), **values))


def table(rows: Iterable[Sequence[str]], names: int = 1) -> str:
    """Rows in Markdown; the first is the heading, the first ``names`` columns are of words."""
    return "\n".join(markdown_table(list(rows), names))


def spread(values: Mapping[str, Any], digits: int = 3) -> str:
    """Mean over trainings, and their standard deviation where there are several."""
    sd = values["sd"]
    return f"{values['mean']:.{digits}f}" + (f" ± {sd:.{digits}f}" if sd is not None else "")


def spread_of(values: Sequence[float] | np.ndarray, digits: int) -> str:
    """The same of the values themselves."""
    sd = np.std(values, ddof=1) if len(values) > 1 else None
    return spread({"mean": np.mean(values), "sd": sd}, digits)


def main() -> None:
    """Say of each page whether it is as new as the program; with ``--mark`` in the page too."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--mark", action="store_true", help="write it at the head of the pages")
    options = parser.parse_args()
    for name in PAGES:
        text = (DOCS / name).read_text("utf-8")
        parts = changed(text, name)
        print(
            f"{name}: {'changed since: ' + ', '.join(parts) if parts else 'as new as the program'}"
        )
        if options.mark and (new := marked(text, name)) != text:
            atomic_write_text(DOCS / name, new)


if __name__ == "__main__":
    main()
