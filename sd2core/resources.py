"""Where the files that come with the program are, in a checkout and in a wheel."""

from __future__ import annotations

from pathlib import Path

from sd2core.errors import Sd2Error

_PACKAGE = Path(__file__).resolve().parent


def resource_path(name: str) -> Path:
    """Path of a bundled file or folder, e.g. ``resource_path("swipes.sd2")``.

    A wheel carries the resources inside the package; a checkout keeps them
    beside it.
    """
    folders = (_PACKAGE / "resources", _PACKAGE.parent / "resources")
    for folder in folders:
        if (folder / name).exists():
            return folder / name
    raise Sd2Error(
        f"The bundled file {name} is in neither {folders[0]} nor {folders[1]}",
        "an installation with its resources",
        "Install SD² Studio again",
    )
