"""Labels in the real window, by real keys and a real mouse, in a process that is killed.

``labelled_until_killed.py RECORDING KILLS`` forks a process with a window that restores what
the one before it left behind, edits at random and tells every state of the labels that a user
has seen; and is killed. What is on disk must then be the last state that was told, or that
after the edit in progress.
"""

from __future__ import annotations

import hashlib
import json
import os
import random
import signal
import sys
import time
from pathlib import Path

from fake_accuracy import FakeAccuracy
from fake_denoisers import FakeDenoisers
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QToolButton
from window_models import models_of

# Before the fork, so that a window stands in a second.
import sd2app.scene.view
import sd2app.shell.wiring  # noqa: F401
from sd2app.labels.recovery import LabelNotice
from sd2app.labels.timeline import ROW_PX, LabelTimeline
from sd2app.settings import Settings
from sd2app.shell.parts import Parts
from sd2app.shell.window import MainWindow
from sd2core.labels.entries import labels_entry
from sd2core.labels.recovery import offers_in, recovery_folder
from sd2core.labels.spans import Labels
from sd2core.numerics.compiled import warm_up
from sd2core.recording.recording import open_recording

NONE, CONTROL = Qt.KeyboardModifier.NoModifier, Qt.KeyboardModifier.ControlModifier
ALT, SHIFT = Qt.KeyboardModifier.AltModifier, Qt.KeyboardModifier.ShiftModifier
LONGEST_S = 0.05
KEYS = (
    *[(getattr(Qt.Key, f"Key_{name}"), NONE) for name in "12341234NP"],
    (Qt.Key.Key_E, NONE),
    (Qt.Key.Key_Slash, NONE),
    (Qt.Key.Key_BracketLeft, NONE),
    (Qt.Key.Key_BracketRight, NONE),
    (Qt.Key.Key_Backspace, NONE),
    (Qt.Key.Key_Left, ALT),
    (Qt.Key.Key_Right, ALT),
    (Qt.Key.Key_Z, CONTROL),
    (Qt.Key.Key_Z, CONTROL | SHIFT),
    (Qt.Key.Key_S, CONTROL),
)


def digest(labels: Labels) -> str:
    """The same for equal labels."""
    text = json.dumps(labels_entry(labels), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


class Editor:
    """Somebody at the window."""

    def __init__(self, window: MainWindow, seed: int, told: int) -> None:
        self.window, self.rng, self.told = window, random.Random(seed), told
        self.models = models_of(window)
        offer = self.models.label_session.offer
        self.edits = 0 if offer is None else offer.edits
        if offer is not None:
            buttons = window.findChild(LabelNotice).findChildren(QToolButton)
            restore = next(one for one in buttons if one.text() == "Restore")
            QTest.mouseClick(restore, Qt.MouseButton.LeftButton)
        self.labels = self.models.document.labels
        self.tell()

    def tell(self) -> None:
        """Say what is on screen now, and how many edits the file does not hold."""
        os.write(self.told, f"{self.edits} {digest(self.labels)}\n".encode())

    def go_on(self) -> None:
        """Do something, and tell it when it was an edit."""
        if self.rng.random() < 0.2:
            self._drag()
            key = None
        else:
            key, modifier = self.rng.choice(KEYS)
            self.models.playback.seek_frame(self.rng.randrange(60))
            QTest.keyClick(self.window, key, modifier)
        labels = self.models.labels.labels
        if key == Qt.Key.Key_S:
            self.edits = 0
        elif labels != self.labels:
            self.edits += 1
        else:
            return
        self.labels = labels
        self.tell()

    def _drag(self) -> None:
        timeline, button = self.window.findChild(LabelTimeline), Qt.MouseButton.LeftButton
        left, right = (int(timeline.scale.x_of(time_s)) for time_s in (0.0, 2.0))
        from_px, to_px = (self.rng.randrange(left, right) for _ in "ab")
        QTest.mousePress(timeline, button, ALT, QPoint(from_px, ROW_PX // 2))
        for x in ((from_px + to_px) // 2, to_px):
            QTest.mouseMove(timeline, QPoint(x, ROW_PX // 2))
        QTest.mouseRelease(timeline, button, ALT, QPoint(to_px, ROW_PX // 2))


def edit_on(recording: Path, seed: int, told: int) -> None:
    """Open, restore, edit for ever."""
    application = QApplication(sys.argv[:1])
    parts = Parts(accuracy=FakeAccuracy().library, denoisers=FakeDenoisers().library)
    window = MainWindow(Settings.forgetful(), parts)
    window.show()
    window.populate()
    window.open_paths([recording])
    while models_of(window).document.content is None:
        application.processEvents()
    editor = Editor(window, seed, told)
    while True:
        editor.go_on()


def on_disk(recording: Path) -> tuple[int, str]:
    """What can be had back: edits beyond the file, and the labels with them."""
    offers = offers_in(recovery_folder()).offers
    assert len(offers) <= 1, "several sessions are offered"
    if offers:
        return offers[0].edits, digest(offers[0].labels)
    return 0, digest(open_recording(recording).labelled)


def main(recording: Path, kills: int) -> None:
    """Kill, and compare."""
    warm_up()
    rng, edits, known, in_progress = random.Random(1), 0, on_disk(recording)[1], 0
    for seed in range(kills):
        hear, tell = os.pipe()
        process = os.fork()
        if process == 0:
            os.close(hear)
            edit_on(recording, seed, tell)
        os.close(tell)
        with os.fdopen(hear, "rb") as stream:
            # Some die on their way to the first edit, the others in the middle of work.
            heard = [stream.readline() for _ in range(rng.randrange(12))]
            time.sleep(rng.uniform(0, LONGEST_S))
            os.kill(process, signal.SIGKILL)
            os.waitpid(process, 0)
            told = [line.split() for line in (*heard, *stream) if line.endswith(b"\n")]
        if told:
            assert told[0][1].decode() == known, "restored was something else"
            known, count = told[-1][1].decode(), int(told[-1][0])
            edits += len(told) - 1
        else:
            count = on_disk(recording)[0]
        found_count, found = on_disk(recording)
        if found != known:
            assert found_count == count + 1, f"{found_count} edits, {count} were told"
            in_progress, known = in_progress + 1, found
    print(f"{kills} kills {edits} edits {in_progress} in progress")


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
