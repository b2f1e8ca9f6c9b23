"""Mutants read in processes of their own, in limits of time and memory."""

from __future__ import annotations

import multiprocessing
import resource
import shutil
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sd2core.errors import Sd2Error
from tests.mutants import TARGETS
from tests.mutants.damage import mutate

SLOW_S = 10.0
"""Processor time that no reader may take for a mutant."""
HANGING_S = 60.0
"""Time after which a process is ended that says nothing, on a machine with other things to do."""
STARTING_S = 600.0
"""The same before the first mutant: imports, and an undamaged file of each kind, take a while."""
LARGE_BYTES = 10**9
"""Memory that no reader may take for a mutant, beyond what its process had."""
_ADDRESS_BYTES = 4 * 10**9
"""Address space beyond that, so that a mutant does not take all memory of the machine."""


Mutant = tuple[str, int]
"""Name of a target, and the seed by which it is damaged."""


@dataclass
class Tally:
    """What became of the mutants of one kind of file."""

    outcomes: Counter[str] = field(default_factory=Counter)
    failures: list[str] = field(default_factory=list)
    slowest_s: float = 0.0
    largest_bytes: int = 0


@dataclass(frozen=True)
class _Report:
    """A mutant before it is read (without an outcome), and after it."""

    how: str
    outcome: str = ""
    spent_s: float = 0.0
    peak_bytes: int = 0

    @property
    def failure(self) -> str | None:
        if self.outcome not in ("read", "refused"):
            return self.outcome
        if self.spent_s > SLOW_S:
            return f"{self.outcome} in {self.spent_s:.1f} s"
        if self.peak_bytes > LARGE_BYTES:
            return f"{self.outcome} with {self.peak_bytes / 1e9:.1f} GB"
        return None


def _try_all(originals: Path, mutants: Sequence[Mutant], tell: Any) -> None:
    """Read mutants in a process of their own; tells one by one."""
    warnings.simplefilter("ignore")  # Zarr's, about what it does not recognise.
    for name in dict(mutants):  # What is imported and kept for later is no mutant's fault.
        TARGETS[name].read(originals / name)
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (_memory_bytes("VmSize") + _ADDRESS_BYTES, hard))
    place = originals / "mutants"
    shutil.rmtree(place, ignore_errors=True)  # Left by a process that was ended.
    place.mkdir()
    for name, seed in mutants:
        path = place / name
        if (originals / name).is_dir():
            shutil.copytree(originals / name, path)
        else:
            shutil.copy(originals / name, path)
        how = mutate(path, seed)
        tell.send(_Report(how))
        Path("/proc/self/clear_refs").write_text("5")  # The peak starts at what is used now.
        before_bytes = _memory_bytes("VmRSS")
        start_s = time.process_time()
        outcome = outcome_of(name, path)
        spent_s = time.process_time() - start_s
        tell.send(_Report(how, outcome, spent_s, _memory_bytes("VmHWM") - before_bytes))
        shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)
    tell.send(None)


def outcome_of(name: str, path: Path) -> str:
    """Read a file: ``read``, ``refused``, or what went wrong."""
    try:
        TARGETS[name].read(path)
        return "read"
    except Sd2Error as error:
        return "refused" if name.partition(".")[0] in str(error) else f"no file: {error}"
    except BaseException:
        return traceback.format_exc(limit=-4, chain=False)


def _memory_bytes(of: str) -> int:
    """Memory of this process, as the kernel of Linux counts it."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(1024 * int(line.split()[1]) for line in lines if line.startswith(of))


def tried(mutants: Sequence[Mutant], originals: Path) -> dict[str, Tally]:
    """Read mutants; a process that dies or hangs is one failure, the others go on."""
    tallies = {name: Tally() for name in dict(mutants)}
    while mutants:
        listen, tell = multiprocessing.Pipe(duplex=False)
        child = multiprocessing.get_context("spawn").Process(
            target=_try_all, args=(originals, mutants, tell)
        )
        child.start()
        tell.close()
        done, last = 0, _Report("the original")
        for last in _reports(listen):
            if not last.outcome:
                continue
            name, seed = mutants[done]
            done += 1
            tally = tallies[name]
            tally.slowest_s = max(tally.slowest_s, last.spent_s)
            tally.largest_bytes = max(tally.largest_bytes, last.peak_bytes)
            tally.outcomes["failed" if last.failure else last.outcome] += 1
            if last.failure:
                tally.failures.append(f"{name} {seed} ({last.how}): {last.failure}")
        child.join(5 if done < len(mutants) else None)
        if child.is_alive():
            child.kill()
            child.join()
        if done < len(mutants):
            name, seed = mutants[done]
            done += 1
            tallies[name].outcomes["crashed"] += 1
            tallies[name].failures.append(f"{name} {seed} ({last.how}): exit code {child.exitcode}")
        mutants = mutants[done:]
    return tallies


def _reports(listen: Any) -> Iterator[_Report]:
    """Reports of a process, until it ends or hangs."""
    patience_s = STARTING_S
    while listen.poll(patience_s):
        patience_s = HANGING_S
        try:
            report = listen.recv()
        except EOFError:
            return
        if report is None:
            return
        yield report


@contextmanager
def originals(names: Iterable[str] = TARGETS) -> Iterator[Path]:
    """Folder with one file of every kind, gone afterwards."""
    with tempfile.TemporaryDirectory() as place:
        for name in names:
            TARGETS[name].write(Path(place) / name)
        yield Path(place)
