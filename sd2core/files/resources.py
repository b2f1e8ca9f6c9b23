"""Where the files that come with the program are, in a checkout and in a wheel."""

from __future__ import annotations

from pathlib import Path

from sd2core.errors import Sd2Error

_PACKAGE = Path(__file__).resolve().parent.parent
_FOLDERS = (_PACKAGE / "resources", _PACKAGE.parent / "resources")


def is_bundled(path: Path) -> bool:
    """Whether a path belongs to the program and must not be written to."""
    return any(Path(path).resolve().is_relative_to(folder) for folder in _FOLDERS)


def resource_path(name: str) -> Path:
    """Path of a bundled file or folder, e.g. ``resource_path("swipes.sd2")``.

    A wheel carries the resources inside the package; a checkout keeps them
    beside it.
    """
    for folder in _FOLDERS:
        if (folder / name).exists():
            return folder / name
    raise Sd2Error(
        f"The bundled file {name} is in neither {_FOLDERS[0]} nor {_FOLDERS[1]}",
        "an installation with its resources",
        "Install SD² Studio again",
    )


def bundled_files(pattern: str) -> list[Path]:
    """Files that come with the program, e.g. ``bundled_files("*.safetensors")``, by name."""
    for folder in _FOLDERS:
        if folder.is_dir():
            return sorted(folder.glob(pattern))
    return []
