"""Break the program in known places, and say which tests notice: ``python -m tools.code_mutants``.

Every mutant of ``code_mutants.toml`` is one wrong line in a copy of the checkout, where the tests
that stand beside it are run. One that survives is an error. Some minutes of two cores.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import tomllib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from tools.documentation.measured import REPOSITORY

LIST = Path(__file__).with_suffix(".toml")


@dataclass(frozen=True)
class Mutant:
    """A line that becomes another, and the tests that should notice."""

    file: str
    line: str
    becomes: str
    tests: tuple[str, ...]

    def applied(self, text: str) -> str:
        """Return the text of the file with the other line; ValueError unless it is there once."""
        if text.count(self.line) != 1:
            raise ValueError(f"{self.file} holds {text.count(self.line)} times: {self.line}")
        return text.replace(self.line, self.becomes)


def mutants() -> list[Mutant]:
    """Read the list."""
    entries = tomllib.loads(LIST.read_text("utf-8"))["mutant"]
    return [Mutant(**entry | {"tests": tuple(entry["tests"])}) for entry in entries]


def is_killed(mutant: Mutant) -> bool:
    """Run the tests of a mutant in a copy of what is checked in or new."""
    listed = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    names = subprocess.run(listed, cwd=REPOSITORY, capture_output=True, check=True).stdout
    with tempfile.TemporaryDirectory() as place:
        for name in filter(None, names.decode().split("\0")):
            copy = Path(place) / name
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(REPOSITORY / name, copy)
        file = Path(place) / mutant.file
        file.write_text(mutant.applied(file.read_text("utf-8")), "utf-8")
        command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider"]
        paths = os.pathsep.join((place, f"{place}/app"))
        environment = os.environ | {"PYTHONPATH": paths, "QT_QPA_PLATFORM": "offscreen"}
        ran = subprocess.run(
            [*command, *mutant.tests], cwd=place, env=environment, capture_output=True, check=False
        )
    if ran.returncode not in (0, 1):  # neither passed nor failed
        raise RuntimeError(ran.stdout.decode() + ran.stderr.decode())
    return ran.returncode == 1


def main() -> int:
    """Try those whose file holds the given words, or all."""
    parser = argparse.ArgumentParser(prog="python -m tools.code_mutants", description=__doc__)
    parser.add_argument("words", nargs="*", help="parts of the names of files")
    words = parser.parse_args().words
    chosen = [one for one in mutants() if all(word in one.file for word in words)]
    survived = 0
    with ThreadPoolExecutor(os.cpu_count()) as threads:
        for mutant, killed in zip(chosen, threads.map(is_killed, chosen), strict=True):
            survived += not killed
            state = "killed  " if killed else "SURVIVED"
            print(f"{state} {mutant.file}: {mutant.becomes.strip()}", flush=True)
    print(f"{len(chosen) - survived} of {len(chosen)} mutants were killed")
    return int(survived > 0)


if __name__ == "__main__":
    sys.exit(main())
