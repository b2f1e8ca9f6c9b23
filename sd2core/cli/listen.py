"""``sd2 listen``: a radar while it runs, into a recording that grows."""

from __future__ import annotations

import contextlib
import math
import re
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from sd2core.cli.command_parser import command
from sd2core.cli.output import counted, print_event, print_facts, tell
from sd2core.options.kinds import Positive
from sd2core.options.records import OptionError, Place
from sd2core.options.shared import Json

if TYPE_CHECKING:
    from sd2core.live.listening import Column, Listening
    from sd2core.live.sources import Source

_SILENT_S = 5.0
_LINE_S, _UPDATE_S = 2.0, 0.1
"""Between lines, and between updates of one on a terminal."""
_WAIT_S = 0.05
_BARS = "▁▂▃▄▅▆▇█"
_BAR_DB = 5.0
"""Power of one step of a bar."""


class Listen(Json):
    """Options of ``sd2 listen``.

    Parameters
    ----------
    dca1000 : ADDRESS[:PORT]
        listen to a DCA1000 on this address of this computer (default: 127.0.0.1, which only
        programs on this computer reach; port 4098)
    replay : CAPTURE
        a capture, or the one of a recording, at its own rate
    radar : SOURCE
        `test`, a simulated radar (`test:20`: with 20 frames/s); `a121`, Acconeer's sensor
        (`a121:PLACE`: at a serial port or IP address); `ti`, a board of TI's that is set up and
        started (`ti:PLACE`: at a serial port); or a plug-in's, NAME[:PLACE]
    setup : FILE
        what the radar runs with: a .cfg or .json of TI's with --dca1000, a .cfg with `ti`, a
        session of Acconeer's tool with `a121`
    out : NAME.sd2
        the recording to write
    classifier : FILE
        a classifier of `sd2 classify train`
    seconds : S
        stop after so long (default: never)
    columns
        with --json, every column of the Doppler map as it comes, receding to approaching
    """

    dca1000: Annotated[str | None, Place(one_of="source", needed=True, bare="")] = None
    replay: Annotated[Path | None, Place(one_of="source", needed=True)] = None
    radar: Annotated[str | None, Place(one_of="source", needed=True)] = None
    setup: Path | None = None
    out: Path
    classifier: Path | None = None
    seconds: Positive | None = None
    columns: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.columns and not self.json:
            raise OptionError(
                "--columns is given without --json", "both, for a program that reads them"
            )
        if self.replay is not None and self.setup is not None:
            raise OptionError("--setup is given with --replay", "--setup with --dca1000 or --radar")
        if self.dca1000 is not None and self.setup is None:
            raise OptionError(
                "--dca1000 is given without --setup",
                "the .cfg or .json that the radar runs with: samples alone do not say their shape",
            )


@command("listen", Listen)
def _listen(options: Listen) -> None:
    """Record a radar while it runs, and follow its Doppler map.

    Frames go into a recording that can be opened at any moment. The status line shows
    the newest column of the Doppler map (receding to approaching), its level, the
    classifier's answer, and how many frames were dropped or damaged. Ctrl-C or q stops;
    the same command with the same --out goes on. docs/radar-files.md says how to set up
    a DCA1000.

      sd2 listen --dca1000 192.168.33.30 --setup profile.cfg --out walk.sd2
      sd2 listen --dca1000 --setup profile.cfg --out walk.sd2    (sent by this computer)
      sd2 listen --replay capture/ --out again.sd2 --seconds 10
      sd2 listen --replay walk.sd2 --out again.sd2 --classifier gestures.safetensors
    """
    from sd2core.live.listening import Listening
    from sd2core.live.reception import Reception
    from sd2core.live.recording import GrowingRecording

    classifier = None
    if options.classifier is not None:
        from sd2core.classify.files import load_classifier

        classifier = load_classifier(options.classifier)
    with (
        contextlib.closing(Reception(_source(options))) as reception,
        contextlib.closing(GrowingRecording(options.out)) as recording,
    ):
        listening = Listening(reception, recording, classifier=classifier)
        source, columns = reception.source, options.columns
        status = Status(listening, source, as_json=options.json, columns=columns)
        status.begin(recording.folder, recording.is_continued)
        follow(listening, status, options.seconds, listening.stop)
        status.end(recording.folder)


def _source(options: Listen) -> Source:
    """Source that the options name; Sd2Error where it is not to be had."""
    from sd2core.live.radars import dca1000, open_radar, replayed

    if options.radar is not None:
        return open_radar(options.radar, options.setup)
    if options.replay is not None:
        return replayed(options.replay)
    assert options.dca1000 is not None
    assert options.setup is not None
    return dca1000(options.dca1000, options.setup)


def follow(
    listening: Listening, status: Status, seconds: float | None, stop: Callable[[], object]
) -> None:
    """Listen until the source ends, the time is over, q is pressed, or it is told to end.

    That stops it as well: what waits to be stored is stored.
    """
    from sd2core.cli.keys import pressed_keys
    from sd2core.runs.control import stop_signals

    with stop_signals() as stopped, pressed_keys() as key:
        listening.start()
        end_s = math.inf if seconds is None else time.monotonic() + seconds
        try:
            while not (listening.is_over or stopped.is_set() or key() in ("q", "Q")):
                if time.monotonic() >= end_s:
                    break
                status.show(listening.next_column(_WAIT_S))
        finally:
            stop()


class Status:
    """Line of status while listening."""

    def __init__(
        self, listening: Listening, source: Source, *, as_json: bool, columns: bool
    ) -> None:
        self._listening, self._source, self._as_json = listening, source, as_json
        self._tells_columns = as_json and columns
        self._is_line = not as_json and sys.stdout.isatty()
        self._column: Column | None = None
        self._first_s: float | None = None
        self._loudest = 0.0
        self._shown_s = time.monotonic()
        self._printed: set[str] = set()
        self.more: Callable[[], Mapping[str, Any]] = dict  # what else is told with every line
        self.nothing = "No frame came, and nothing was written."
        self.each_time: Callable[[], object] = dict  # called with every column, and between them

    def begin(self, folder: Path, continued: bool, about: str = "") -> None:
        """Say what is listened to, or ``about`` what is recorded."""
        about = about or self._source.about
        if self._as_json:
            print_event(
                "listening",
                source=about,
                out=str(folder),
                continued=continued,
                bins=self._listening.axis.bins,
                v_max_mps=self._listening.axis.v_max_mps,
            )
        else:
            words = " (continued)" if continued else ""
            stop = "Ctrl-C or q stops." if self._is_line else "Ctrl-C stops."
            tell(f"{about}\n  into {folder}{words}. {stop}")
        self._warn_of_doubts()

    def show(self, column: Column | None) -> None:
        """Show the newest column, no oftener than is of use, and what looks wrong."""
        self.each_time()
        if column is not None:
            self._column = column
            if self._first_s is None:
                self._first_s = column.time_s
            if self._tells_columns:
                values = [float(f"{value:.9g}") for value in column.values]
                print_event(
                    "column",
                    received_unix_s=column.received_unix_s,
                    **self._newest(),
                    values=values,
                )
        if self._listening.silent_s > _SILENT_S and (silence := self._source.silence()):
            self.warn_once(silence)
        if time.monotonic() - self._shown_s < (_UPDATE_S if self._is_line else _LINE_S):
            return
        self._shown_s = time.monotonic()
        self._warn_of_doubts()
        if self._as_json:
            print_event("frames", **self._newest(), **self.more())
        elif self._is_line:
            import shutil

            width = shutil.get_terminal_size().columns - 1
            tell(f"\r{self._line()[:width]:<{width}}", end="")
        else:
            tell(self._line())

    def end(self, folder: Path) -> None:
        """Say what there is."""
        counts, latencies_s = self._listening.counts, sorted(self._listening.latencies_s)
        median_s = most_s = None
        if latencies_s:
            median_s = latencies_s[len(latencies_s) // 2]
            most_s = latencies_s[math.ceil(0.95 * len(latencies_s)) - 1]
        if self._is_line:
            print()
        for doubt in self._listening.doubts(at_end=True):
            self._warn(doubt)
        if self._as_json:
            print_event(
                "end",
                out=str(folder) if counts.recorded else None,
                latency_median_s=median_s,
                latency_95_s=most_s,
                **vars(counts),
            )
            return
        if not counts.recorded:
            print(self.nothing)
            return
        facts = {
            "recorded": counts.frames,
            "missing": counts.missing or "nothing",
            "not shown": counted(counts.not_shown, "frame") if counts.not_shown else "",
        }
        if median_s is not None and most_s is not None:
            facts["latency"] = f"{1e3 * median_s:.1f} ms, 95 % within {1e3 * most_s:.1f} ms"
        print_facts(str(folder), facts)

    def _line(self) -> str:
        counts, column = self._listening.counts, self._column
        parts = [counts.frames, counts.missing or "0 dropped"]
        if counts.not_shown:
            parts.append(f"{counts.not_shown:,} not shown")
        if column is not None and self._first_s is not None:
            parts.insert(0, f"{column.time_s - self._first_s:7.1f} s")
            parts += [f"level {column.level_db:6.1f} dB", self._bars(column)]
            if column.label is not None:
                parts.append(f"{column.label.name} {100 * column.label.probability:.0f} %")
        return "  ".join(parts)

    def _bars(self, column: Column) -> str:
        """Powers as bars, receding to approaching, in steps of 5 dB below the loudest so far."""
        self._loudest = max(self._loudest, float(column.values.max()))
        if not self._loudest > 0:
            return _BARS[0] * len(column.values)
        top = len(_BARS) - 1
        lowest = 10.0 ** (-0.1 * _BAR_DB * top)
        shares = (max(float(value) / self._loudest, lowest) for value in column.values)
        return "".join(_BARS[round(top + 10.0 * math.log10(one) / _BAR_DB)] for one in shares)

    def _newest(self) -> dict[str, Any]:
        """Numbers of frames, and the newest column in words."""
        data: dict[str, Any] = dict(vars(self._listening.counts))
        if (column := self._column) is not None:
            data["time_s"], data["level_db"] = column.time_s, column.level_db
            if column.label is not None:
                data["label"] = column.label.name
                data["probability"] = column.label.probability
        return data

    def _warn_of_doubts(self) -> None:
        for doubt in self._listening.doubts(at_end=False):
            self.warn_once(doubt)

    def warn_once(self, sentence: str) -> None:
        """Print a sentence to standard error, unless it was, with other numbers."""
        words = re.sub(r"[\d.,]+", "", sentence)
        if words not in self._printed:
            self._printed.add(words)
            if self._is_line:
                print()
            self._warn(sentence)

    def _warn(self, sentence: str) -> None:
        if self._as_json:
            print_event("doubt", text=sentence)
        else:
            print(f"sd2: {sentence}", file=sys.stderr, flush=True)
