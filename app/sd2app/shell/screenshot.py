"""The window as a picture, once it shows everything."""

from __future__ import annotations

import sys
import time
from pathlib import Path

from PySide6.QtWidgets import QApplication

from sd2app.shell.window import MainWindow

_SETTLE_S = 0.5


def wait_until_settled(application: QApplication, window: MainWindow, limit_s: float) -> bool:
    """Run the event loop until nothing is under way; False when that takes too long."""
    deadline = time.monotonic() + limit_s
    calm_since = None
    while time.monotonic() < deadline:
        application.processEvents()
        time.sleep(0.005)
        if not (window.ready and window.settled):
            calm_since = None
        elif calm_since is None:
            calm_since = time.monotonic()
        elif time.monotonic() - calm_since > _SETTLE_S:
            return True
    return False


def take_screenshot(
    application: QApplication, window: MainWindow, path: Path, limit_s: float
) -> int:
    """Write the window as PNG and close it; returns an exit code."""
    settled = wait_until_settled(application, window, limit_s)
    saved = window.grab().save(str(path), "PNG")
    failure = window.messages.text if window.ready else ""
    window.close()
    application.processEvents()
    if not saved:
        print(f"{path} cannot be written.", file=sys.stderr)
        return 1
    if not settled:
        print(f"The window was still busy after {limit_s:.0f} s; {path} shows it.", file=sys.stderr)
        return 1
    if failure:
        print(failure, file=sys.stderr)
    return 0
