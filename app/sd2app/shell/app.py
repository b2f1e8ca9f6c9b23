"""Starts the window: skeleton first, everything else from the event loop."""

from __future__ import annotations

import gc
import os
import sys
import time
from argparse import ArgumentParser
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from PySide6.QtCore import QTimer
from PySide6.QtGui import QIcon
from PySide6.QtWidgets import QApplication

from sd2app.settings import Settings
from sd2app.shell.parts import Parts
from sd2app.shell.window import MainWindow
from sd2app.widgets.picture import write_picture
from sd2app.widgets.theme import apply_theme, is_dark
from sd2core.processes import keep_little_free_memory

ICON = Path(__file__).with_name("sd2-studio.svg")
"""Icon of the window, which the wheel also puts where desktops look for it."""

_SCREENSHOT_LIMIT_S = 120
_SETTLE_S = 0.5
_SAY_EVERY_S = 10


def run(
    paths: Sequence[Path] = (),
    *,
    screenshot: Path | None = None,
    parser: Callable[[], ArgumentParser] | None = None,
) -> int:
    """Open the window on a recording or its files, and run until it is closed.

    With ``screenshot``, draw it off-screen when everything is computed, and write it there.
    ``parser`` has the commands that the manual describes. Returns an exit code.
    """
    if screenshot is not None:
        os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    keep_little_free_memory()
    application = QApplication.instance() or QApplication(sys.argv[:1])
    assert isinstance(application, QApplication)
    application.setApplicationName("SD² Studio")
    application.setDesktopFileName("sd2-studio")
    settings = Settings() if screenshot is None else Settings.forgetful()
    apply_theme(application, is_dark(settings.dark))
    # A picture takes no lock on labels.
    aside = None if screenshot is None else TemporaryDirectory()
    place = None if aside is None else Path(aside.name)
    window = MainWindow(settings, Parts(recovery=place, pictures=place, parser=parser))

    def fill() -> None:
        # Loading Qt's reader of SVG does not delay the skeleton.
        application.setWindowIcon(QIcon(str(ICON)))
        window.populate()
        gc.freeze()  # what is there by now stays
        if paths:
            window.open_paths(paths)
        else:
            window.features.labels.autosave.look_around()

    # Queued, so that the skeleton reaches the screen before the imports begin.
    window.first_painted.connect(lambda: QTimer.singleShot(0, fill))
    window.show()
    if screenshot is None or aside is None:
        return application.exec()
    with aside:
        return _take_screenshot(application, window, screenshot, limit_s=_SCREENSHOT_LIMIT_S)


def wait_until_settled(application: QApplication, window: MainWindow, limit_s: float) -> bool:
    """Run the event loop until nothing is under way; False when nothing gets on for so long.

    What takes longer is said on standard error.
    """
    deadline, calm_since, before = time.monotonic() + limit_s, None, None
    say_s = time.monotonic() + _SAY_EVERY_S
    while time.monotonic() < deadline:
        application.processEvents()
        time.sleep(0.005)
        jobs = window.session.jobs.jobs if window.ready else ()
        reached = [(job.title, job.done) for job in jobs]
        if reached != before:
            deadline, before = time.monotonic() + limit_s, reached
        if jobs and time.monotonic() > say_s:
            say_s = time.monotonic() + _SAY_EVERY_S
            how_far = f" ({jobs[0].done} of {jobs[0].total})" if jobs[0].total else ""
            print(f"Waiting: {jobs[0].title}{how_far}", file=sys.stderr)
        if not (window.ready and window.settled):
            calm_since = None
        elif calm_since is None:
            calm_since = time.monotonic()
        elif time.monotonic() - calm_since > _SETTLE_S:
            return True
    return False


def _take_screenshot(
    application: QApplication, window: MainWindow, path: Path, limit_s: float
) -> int:
    """Write the window as PNG and close it; returns an exit code, or raises OSError.

    Of a window in which nothing could be opened there is no picture.
    """
    settled = wait_until_settled(application, window, limit_s)
    failure = window.messages.text if window.ready else ""
    refused = bool(failure) and not window.session.has_content()
    try:
        if not refused:
            write_picture(window, path)
            print(f"Wrote {path}")
    finally:
        window.close()
        application.processEvents()
    if failure:
        print(f"sd2: {failure}", file=sys.stderr)
    if not settled:
        print(f"The window got no further for {limit_s:.0f} s; {path} shows it.", file=sys.stderr)
    return 1 if refused or not settled else 0
