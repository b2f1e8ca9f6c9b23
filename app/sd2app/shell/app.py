"""Starts the window: skeleton first, everything else from the event loop."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

_SCREENSHOT_LIMIT_S = 120


def run(paths: Sequence[Path] = (), *, screenshot: Path | None = None) -> int:
    """Open the window on some files and run until it is closed.

    Parameters
    ----------
    paths : sequence of Path
        A recording, or files that make up one.
    screenshot : Path, optional
        Draw the window off-screen when everything is computed, write it there
        and return.

    Returns
    -------
    int
        Exit code.
    """
    if screenshot is not None:
        os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    from PySide6.QtCore import QTimer
    from PySide6.QtWidgets import QApplication

    from sd2app.settings import Settings
    from sd2app.shell.parts import Parts
    from sd2app.shell.window import MainWindow, is_dark
    from sd2app.widgets.theme import apply_theme

    application = QApplication.instance() or QApplication(sys.argv[:1])
    assert isinstance(application, QApplication)
    application.setApplicationName("SD² Studio")
    application.setDesktopFileName("sd2-studio")
    settings = Settings() if screenshot is None else Settings.forgetful()
    apply_theme(application, is_dark(settings))
    # A picture takes no lock on labels.
    aside = None if screenshot is None else TemporaryDirectory()
    window = MainWindow(settings, Parts(recovery=None if aside is None else Path(aside.name)))

    def fill() -> None:
        window.populate()
        if paths:
            window.open_paths(list(paths))
        else:
            window.features.labels.autosave.look_around()

    # Queued, so that the skeleton reaches the screen before the imports begin.
    window.first_painted.connect(lambda: QTimer.singleShot(0, fill))
    window.show()
    if screenshot is None or aside is None:
        return application.exec()
    from sd2app.shell.screenshot import take_screenshot

    with aside:
        return take_screenshot(application, window, screenshot, limit_s=_SCREENSHOT_LIMIT_S)
