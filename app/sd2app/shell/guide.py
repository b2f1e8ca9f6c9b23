"""The guide: a site that comes with the program, read in a browser without a network."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QUrl
from PySide6.QtGui import QDesktopServices

from sd2core.errors import Sd2Error

MANUAL, FIRST_FIVE_MINUTES = "index.html", "first-five-minutes.html"
_PACKAGE = Path(__file__).resolve().parents[1]
_FOLDERS = (_PACKAGE / "docs", _PACKAGE.parents[1] / "build" / "docs")
"""Place of the site in a wheel, and in a checkout."""


def page_path(name: str) -> Path:
    """Path of a page of the guide; raises Sd2Error if the guide was not built."""
    for folder in _FOLDERS:
        if (folder / name).is_file():
            return folder / name
    raise Sd2Error(
        f"The guide has not been built: {name} is in neither {_FOLDERS[0]} nor {_FOLDERS[1]}",
        "the guide as a site",
        "Type `make docs` in the checkout; wheels from `make wheel` bring the guide along",
    )


def open_page(name: str) -> None:
    """Show a page of the guide in the user's browser; raises Sd2Error if that cannot be."""
    path = page_path(name)
    if not QDesktopServices.openUrl(QUrl.fromLocalFile(str(path))):
        raise Sd2Error(
            "No browser could be started to show the guide",
            "a browser that the desktop knows",
            f"Open {path} in one",
        )
