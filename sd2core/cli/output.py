"""Output of commands: facts for people, JSON for programs, progress for both."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from sd2core.files.tables import counted as counted
from sd2core.files.tables import text_table
from sd2core.progress import Progress


@contextmanager
def progress_bar(what: str, unit: str = "frame") -> Iterator[Progress]:
    """Show a bar on standard error; where that is no terminal, a line every few seconds.

    Without a unit it shows the share alone: for work of parts that count different things.
    """
    from sd2core.cli.bars import bar as bar_of

    with bar_of(what, unit) as bar:

        def report(done: int, total: int) -> None:
            bar.total = total or None
            bar.update(done - bar.n)

        yield report


def print_json(content: Mapping[str, Any]) -> None:
    """Print one JSON object; NaN and infinities become null."""
    import json

    print(json.dumps(finite(content), indent=2, ensure_ascii=False))


def print_event(event: str, **content: Any) -> None:
    """Print one line of JSON at once, for a program that follows (docs/formats.md)."""
    import json

    line = finite({"event": event, **content})
    tell(json.dumps(line, ensure_ascii=False))


def tell(text: str, end: str = "\n") -> None:
    """Print at once; whoever closes the output has read enough, and the work goes on."""
    try:
        print(text, end=end, flush=True)
    except BrokenPipeError:
        discard_output()


def discard_output() -> None:
    """Keep Python from trying, and complaining, once more when it flushes at exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def progress_events(every_s: float, *, time_left: bool = False, **content: Any) -> Progress:
    """Progress that prints events of this content, no oftener than every so many seconds.

    With ``time_left`` they say how many seconds are left (``left_s``) by the pace so far.
    """
    from sd2core.runs.pace import Throughput  # loads statistics

    last_s, pace, pace_of = -1.0, Throughput(), 0

    def report(done: int, total: int) -> None:
        nonlocal last_s, pace, pace_of
        now_s = time.monotonic()
        if total != pace_of:  # another kind of steps
            pace, pace_of = Throughput(), total
        pace.take(done, now_s)
        if now_s - last_s >= every_s or done == total:
            last_s = now_s
            left = {"left_s": pace.left_s(total - done)} if time_left else {}
            print_event("progress", done=done, total=total, **content, **left)

    return report


@dataclass
class Report:
    """What a command found: data for programs, and a title, facts and notes for people.

    ``say`` prints other words instead of these; ``code`` is the exit code.
    """

    title: str
    data: dict[str, Any]
    facts: dict[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    parts: Sequence[Report] = ()
    say: Callable[[], object] | None = None
    code: int = 0

    def print(self, *, as_json: bool) -> None:
        """Print it for programs or for people, its parts below it."""
        if as_json:
            print_json(self.data)
        elif self.say is not None:
            self.say()
        else:
            print_facts(self.title, self.facts)
            for note in self.notes:
                print(f"  note: {note}")
            for part in self.parts:
                print()
                part.print(as_json=False)


def print_facts(title: str, facts: Mapping[str, str]) -> None:
    """Print a title and aligned ``name  value`` lines; empty values are left out."""
    print(title)
    shown = {name: value for name, value in facts.items() if value}
    width = max(map(len, shown), default=0)
    for name, value in shown.items():
        print(f"  {name:<{width}}  {value}")


def tell_lost(frames: int) -> None:
    """Say on standard error how many frames are lost to damaged chunks, where some are."""
    from sd2core.files.stores import lost_in_words

    if frames:
        print(f"sd2: {lost_in_words(frames)}", file=sys.stderr)


def listed(counts: Mapping[Any, int]) -> str:
    """``real 12, synthetic 2,000``."""
    return ", ".join(f"{name} {count:,}" for name, count in counts.items())


def duration(seconds: float) -> str:
    """Duration as text: seconds, minutes, or hours and minutes."""
    if seconds < 60:
        return f"{seconds:.2g} s" if seconds < 10 else f"{seconds:.0f} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 60 else f"{minutes // 60} h {minutes % 60:02d} min"


def print_rows(rows: Sequence[Sequence[str]], *, right: Collection[int] = ()) -> None:
    """Print a table whose first row is its heading; ``right`` are columns of numbers."""
    print(*text_table(rows, right), sep="\n")


def picked(thing: object, *names: str) -> dict[str, Any]:
    """Attributes of a thing by their names, for JSON."""
    return {name: getattr(thing, name) for name in names}


def finite(value: Any) -> Any:
    """Replace NaN and infinities by None, for JSON."""
    if isinstance(value, Mapping):
        return {str(key): finite(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [finite(inner) for inner in value]
    if isinstance(value, float) and (value != value or abs(value) == float("inf")):
        return None
    return value
