"""The real window, opened, waited for and drawn: for the pictures of the documentation."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import cast

from PySide6.QtWidgets import QApplication, QWidget

from sd2app.settings import Settings
from sd2app.shell.app import wait_until_settled
from sd2app.shell.window import MainWindow
from sd2app.widgets.theme import apply_theme
from tools.documentation.measured import IMAGES, REPOSITORY

_LIMIT_S = 120.0


def application() -> QApplication:
    """The application, made if need be."""
    return cast(QApplication, QApplication.instance() or QApplication(sys.argv[:1]))


def wait_for(condition: Callable[[], bool], limit_s: float = 300.0) -> None:
    """Run the event loop until something is so, or the time is over."""
    deadline = time.monotonic() + limit_s
    while not condition() and time.monotonic() < deadline:
        application().processEvents()
        time.sleep(0.01)


def settle(window: MainWindow) -> None:
    """Wait until nothing is under way; ends the program where something never is over."""
    if not wait_until_settled(application(), window, _LIMIT_S):
        sys.exit(f"The window was still busy after {_LIMIT_S:.0f} s")


@contextmanager
def opened(
    paths: list[Path], runs: Path | None = None, size: tuple[int, int] = (1280, 800)
) -> Iterator[MainWindow]:
    """The window on some files, everything computed; trainings are kept in ``runs``."""
    apply_theme(application(), False)
    settings = Settings.forgetful()
    settings.dark = False
    if runs is not None:
        settings.set_value("training/folder", str(runs))
    window = MainWindow(settings)
    window.resize(*size)
    window.show()
    window.populate()
    if paths:
        window.open_paths(paths)
    settle(window)
    yield window
    window.session.document.undo_stack.setClean()
    window.close()
    application().processEvents()


def save(widget: QWidget, name: str) -> None:
    """Write a picture of a window."""
    widget.grab().save(str(IMAGES / name))
    print(IMAGES.joinpath(name).relative_to(REPOSITORY))
