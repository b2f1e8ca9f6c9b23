"""Use the real window for minutes, and print what it takes of the machine: `make soak MINUTES=60`.

Mouse and keys play, label, drag the sensor, undo, save and open another recording, over and over,
on two copies of the sample; with TRAINING=PAIRS a denoiser learns from these pairs beside it. Every
tenth of the time a row is measured, always with the window at rest. The exit code is 1 where Python
raised anything.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import sys
import tempfile
import threading
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import psutil
from PySide6.QtCore import QEventLoop, QObject, QPoint, Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from sd2app.shell.window import MainWindow
from sd2core.files.tables import markdown_table
from sd2core.processes import keep_little_free_memory
from tools.documentation.measured import SAMPLE
from tools.documentation.windows import opened

LIMIT_S = 120.0
TICK_MS = 5
ROWS = 10
REOPENINGS = 50
_LOOK_S = 0.02
_NONE, _CONTROL = Qt.KeyboardModifier.NoModifier, Qt.KeyboardModifier.ControlModifier


Row = dict[str, float]
"""State of the process at a moment of rest, and what happened since the row before."""


class Meter(QObject):
    """Measures rows, and the minutes since it was made.

    Gaps are times between turns of the event loop, by a timer of 5 ms.
    """

    def __init__(self) -> None:
        super().__init__()
        self._process = psutil.Process()
        self._began_s = time.monotonic()
        self._timer = QTimer(self, interval=TICK_MS, timerType=Qt.TimerType.PreciseTimer)
        self._timer.timeout.connect(self._tick)
        self._threads = QTimer(self, interval=200)
        self._threads.timeout.connect(self._count)
        self._restart()

    @property
    def minute(self) -> float:
        """Minutes since the start."""
        return (time.monotonic() - self._began_s) / 60

    def resident_mb(self) -> float:
        """Memory of the process."""
        return float(self._process.memory_info().rss) / 1e6

    def row(self, rounds: int) -> Row:
        """Measure a row."""
        gaps_ms = np.percentile(self._gaps_ms or [0.0], (50, 95, 99, 100))
        row = {
            "minute": round(self.minute, 2),
            "rounds": rounds,
            "RSS, MB": round(self.resident_mb(), 1),
            "threads": self._process.num_threads(),
            "most": self._most_threads,  # also while something was computed
            "descriptors": self._process.num_fds(),
            "windows": len(QApplication.topLevelWidgets()),
        }
        names = ("gap, ms", "95 %", "99 %", "largest")
        row |= {name: round(gap, 1) for name, gap in zip(names, gaps_ms.tolist(), strict=True)}
        self._restart()
        return row

    def _restart(self) -> None:
        """Forget what was measured."""
        self._gaps_ms: list[float] = []
        self._most_threads = self._process.num_threads()
        self._last_s = time.perf_counter()
        self._timer.start()
        self._threads.start()

    def _tick(self) -> None:
        now_s = time.perf_counter()
        self._gaps_ms.append(1000 * (now_s - self._last_s))
        self._last_s = now_s

    def _count(self) -> None:
        self._most_threads = max(self._most_threads, self._process.num_threads())


class Hand:
    """Mouse and keys on a window; a step that comes to nothing raises RuntimeError."""

    def __init__(self, window: MainWindow) -> None:
        self._window, self._session = window, window.session
        self._until(lambda: window.features.scene.view is not None, "show the scene")
        self._scene = window.features.scene.view
        self._scene.set_view("overview")

    def open(self, recording: Path) -> None:
        """Open a recording in place of what is open, and wait for all that is computed."""
        self._window.open_paths([recording])
        self._until(lambda: self._session.document.paths == (recording,), f"open {recording.name}")
        self.rest()

    def rest(self) -> None:
        """Wait until nothing has been under way for half a second."""
        synthesis, calm_looks = self._window.features.maps.synthesis, [0]

        def is_calm() -> bool:
            calm_looks[0] = calm_looks[0] + 1 if self._window.settled and synthesis.complete else 0
            return calm_looks[0] * _LOOK_S > 0.5

        self._until(is_calm, "come to rest")

    def round(self) -> None:
        """Play and label, drag the sensor, undo and save; the recording is then as it was."""
        session = self._session
        spans, place = self._spans(), session.sensor.sensor
        self._press("Home")
        self._press("Space")
        self._until(lambda: session.playback.playing, "play")
        for _ in ("begin", "end"):
            spin(1.0)
            self._press("1")
        self._until(lambda: self._spans() == spans + 1, "label")
        self._drag_sensor()
        self._until(lambda: session.sensor.sensor != place, "drag the sensor")
        self._press("Space")
        self._until(lambda: not session.playback.playing, "stop")
        self.rest()
        self._save()
        self._press("Z", _CONTROL)
        self._press("Z", _CONTROL)
        done = (spans, place)
        self._until(lambda: (self._spans(), session.sensor.sensor) == done, "undo")
        self.rest()
        self._save()

    def train(self, pairs: Path | None) -> None:
        """Have a denoiser learn from pairs, again when it has ended; wait for its first epoch."""
        training = self._window.features.training.model
        if pairs is None or training.under_way:
            return
        training.setup.keep(())
        training.setup.add(pairs)
        self._until(lambda: not training.setup.problem, "take the pairs")
        training.start()
        self._until(lambda: training.run.history.epoch >= 1, "train")

    def end_training(self) -> None:
        """Cancel what runs of a training."""
        training = self._window.features.training.model
        if training.under_way:
            training.tell("cancel")
        self._until(lambda: not training.under_way, "end the training")

    def _press(self, name: str, modifier: Qt.KeyboardModifier = _NONE) -> None:
        QTest.keyClick(self._window, getattr(Qt.Key, f"Key_{name}"), modifier)

    def _drag_sensor(self) -> None:
        x, y, _ = self._scene.scene.pose.project(self._session.sensor.sensor.position_m)[0]
        start = QPoint(round(x), round(y))
        held = self._scene.childAt(start)
        QTest.mousePress(held, Qt.MouseButton.LeftButton, pos=held.mapFrom(self._scene, start))
        for step in range(60):
            place = start + QPoint(round(30 * np.sin(step / 10)), step // 3)
            QTest.mouseMove(held, held.mapFrom(self._scene, place))
            spin(0.03)
        QTest.mouseRelease(held, Qt.MouseButton.LeftButton, pos=held.mapFrom(self._scene, place))

    def _save(self) -> None:
        self._press("S", _CONTROL)
        self._until(lambda: not self._session.document.modified, "save")

    def _spans(self) -> int:
        return len(self._window.features.labels.model.labels.spans)

    def _until(self, condition: Callable[[], bool], step: str) -> None:
        deadline_s = time.monotonic() + LIMIT_S
        while not condition():
            if time.monotonic() > deadline_s:
                message = self._window.messages.text or "the window says nothing"
                raise RuntimeError(f"The window did not {step} within {LIMIT_S:.0f} s ({message})")
            spin(_LOOK_S)


def spin(seconds: float) -> None:
    """Run the event loop, which alone decides when it sleeps."""
    loop = QEventLoop()
    QTimer.singleShot(round(1000 * seconds), loop.quit)
    loop.exec()


def soak(
    minutes: float, folder: Path, say: Callable[[Row], None], training: Path | None = None
) -> float:
    """Use a window for so long, then open 50 times more; returns the MB that these added.

    ``say`` is given every row; two copies of the sample go to ``folder``. A denoiser may learn from
    pairs beside it.
    """
    recordings = [folder / "left.sd2", folder / "right.sd2"]
    for copy in recordings:
        shutil.copytree(SAMPLE, copy)
    with opened([]) as window:
        window.activateWindow()
        hand, meter, rounds, rows = Hand(window), Meter(), 0, 1
        hand.open(recordings[0])
        hand.train(training)
        say(meter.row(rounds))
        while meter.minute < minutes:
            hand.train(training)
            hand.round()
            rounds += 1
            hand.open(recordings[rounds % 2])
            if meter.minute >= minutes * rows / ROWS:
                say(meter.row(rounds))
                rows += 1
        hand.end_training()
        before_mb = meter.resident_mb()
        for number in range(1, REOPENINGS + 1):
            hand.open(recordings[(rounds + number) % 2])
        return meter.resident_mb() - before_mb


def main() -> int:
    """Use the window and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--training", type=Path, help="pairs that a denoiser learns from beside it")
    parser.add_argument("--json", action="store_true", help="one row a line, as JSON")
    options = parser.parse_args()
    raised: list[Any] = []  # in slots and threads, where nobody else would know

    def note(*raising: Any) -> None:
        raised.append(raising[0])
        traceback.print_exception(*raising)

    sys.excepthook = note
    threading.excepthook = lambda args: note(*args[:3])
    sys.unraisablehook = lambda args: note(*args[:3])

    def say(row: Row) -> None:
        *heading, line = markdown_table([list(row), [f"{value:g}" for value in row.values()]])
        if options.json:
            line = json.dumps(row)
        elif row["rounds"] == 0:
            print("\n".join(heading))
        print(line, flush=True)

    keep_little_free_memory()
    with tempfile.TemporaryDirectory(prefix="sd2-soak-") as name:
        os.environ["XDG_DATA_HOME"] = name
        added_mb = soak(options.minutes, Path(name), say, options.training)
    print(f"\n{REOPENINGS} more openings of a recording added {added_mb:.0f} MB.")
    return 1 if raised else 0


if __name__ == "__main__":
    sys.exit(main())
