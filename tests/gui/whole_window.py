"""The whole window in tests: made, on a recording, and given up."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import fake_class_command
from PySide6.QtCore import QCoreApplication, QEvent
from window_models import models_of

from sd2app.settings import Settings
from sd2app.shell.parts import Parts
from sd2app.shell.window import MainWindow
from sd2core.files.paths import user_data


def new_window(qtbot: Any, fake: Any, fake_models: Any, fake_classes: Any) -> MainWindow:
    """Window without a recording, all views in place."""
    settings = Settings.forgetful()
    for name in ("folded", "over"):  # the panel at the side is open and beside the maps
        settings.set_value(f"layouts/Look/{name}", False)
    window = MainWindow(
        settings,
        Parts(
            accuracy=fake.library,
            denoisers=fake_models.library,
            classifiers=fake_classes.library,
            learn_command=(sys.executable, "-u", fake_class_command.__file__),
            pictures=user_data("pictures"),
        ),
    )
    window.resize(1280, 800)
    window.show()
    window.populate()
    qtbot.waitUntil(lambda: window.settled, timeout=120_000)
    return window


def close_window(window: MainWindow) -> None:
    """Give up a window, whatever was edited in it."""
    if window.ready:
        models_of(window).document.undo_stack.clear()
        window.features.live.model.close()
    window.close()
    # Styling the next window would style all that are still there.
    window.deleteLater()
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)


def opened(window: MainWindow, qtbot: Any, recording: Path) -> MainWindow:
    """The window on a recording, everything computed."""
    with qtbot.waitSignal(models_of(window).document.opened, timeout=120_000):
        window.open_paths([recording])
    qtbot.waitUntil(lambda: window.settled, timeout=120_000)
    qtbot.waitUntil(lambda: models_of(window).synthesis.complete, timeout=120_000)
    return window
