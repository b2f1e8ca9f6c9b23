"""The real window, opened, waited for and drawn: for the pictures of the documentation."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

from PySide6.QtWidgets import QApplication, QWidget

from sd2app.settings import Settings
from sd2app.shell.app import wait_until_settled
from sd2app.shell.window import MainWindow
from sd2app.widgets.theme import apply_theme
from tools.documentation.places import IMAGES, REPOSITORY

LIMIT_S = 120.0


def wait_for(
    application: QApplication, condition: Callable[[], bool], limit_s: float = 300.0
) -> None:
    """Run the event loop until something is so, or the time is over."""
    deadline = time.monotonic() + limit_s
    while not condition() and time.monotonic() < deadline:
        application.processEvents()
        time.sleep(0.01)


def opened(application: QApplication, paths: list[Path], runs: Path | None = None) -> MainWindow:
    """The window on some files, everything computed; trainings are kept in ``runs``."""
    apply_theme(application, False)
    settings = Settings.forgetful()
    settings.dark = False
    if runs is not None:
        settings.set_value("training/folder", str(runs))
    window = MainWindow(settings)
    window.resize(1280, 800)
    window.show()
    window.populate()
    if paths:
        window.open_paths(paths)
    if not wait_until_settled(application, window, LIMIT_S):
        sys.exit(f"The window was still busy with {paths} after {LIMIT_S:.0f} s")
    return window


def save(widget: QWidget, name: str) -> None:
    """Write a picture of a window."""
    widget.grab().save(str(IMAGES / name))
    print(IMAGES.joinpath(name).relative_to(REPOSITORY))
