"""The whole window with the bundled sample in it, as the benchmarks measure it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from window_models import models_of

from sd2core.files.resources import resource_path


@contextmanager
def window_on_sample(qtbot: Any, *more: Any) -> Iterator[Any]:
    """A window that has come to rest; closed at the end. ``more`` goes to ``MainWindow``."""
    from sd2app.settings import Settings
    from sd2app.shell.window import MainWindow
    from sd2core.numerics.compiled import warm_up

    warm_up()
    window = MainWindow(Settings.forgetful(), *more)
    window.show()
    window.populate()
    window.open_paths([resource_path("swipes.sd2")])
    settle(window, qtbot)
    yield window
    models_of(window).document.undo_stack.clear()
    window.close()


def settle(window: Any, qtbot: Any) -> None:
    """Wait until nothing is under way and the map is exact."""
    qtbot.waitUntil(lambda: window.settled and models_of(window).synthesis.complete, timeout=60_000)
