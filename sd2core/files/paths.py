"""Paths stored relative to a folder, and files found again after they moved."""

from __future__ import annotations

import glob
import os
from collections.abc import Iterable
from itertools import chain, count, takewhile
from pathlib import Path, PurePath, PurePosixPath, PureWindowsPath

from sd2core.errors import Sd2Error, wanted
from sd2core.progress import Progress

PICKLE_SUFFIXES = frozenset({".pkl", ".pickle", ".joblib"})
"""Of outputs of body models, which know their place only in the picture's pixels."""


def user_data(name: str) -> Path:
    """Folder of the user's data of one kind; it may not exist yet."""
    import platformdirs

    return Path(platformdirs.user_data_dir("sd2-studio", appauthor=False)) / name


def user_cache(name: str) -> Path:
    """Folder of one kind of what can be made again; it may not exist yet."""
    import platformdirs

    return Path(platformdirs.user_cache_dir("sd2-studio", appauthor=False)) / name


def as_path(path: object) -> Path:
    """Path of what a user gave; Sd2Error if it is none."""
    if isinstance(path, os.PathLike):
        return Path(path)
    return Path(wanted(path, str, "Give the name of a file or folder"))


def plain_path(path: Path) -> Path:
    """Absolute, with links in the folders (not the name itself) resolved, so that .. is true."""
    path = Path(os.path.abspath(path))
    return path.parent.resolve() / path.name


def check_distinct(paths: Iterable[Path]) -> None:
    """Refuse two names of one file or folder: what is learnt from it would judge it as well."""
    known: dict[str, Path] = {}
    for path in paths:
        other = known.setdefault(os.path.realpath(path), path)
        if plain_path(other) != plain_path(path):
            raise Sd2Error(f"{path} is a link to {other}, or both to another", "each once")


def stored_path(path: Path, folder: Path) -> str:
    """Write a path relative to ``folder``, with ``/``; in full where it is on another drive."""
    try:
        return PurePath(os.path.relpath(path, folder)).as_posix()
    except ValueError:  # Windows: on another drive
        return path.as_posix()


def located_path(stored: str | None, folder: Path) -> Path | None:
    """Undo :func:`stored_path`."""
    if stored is None:
        return None
    return Path(stored) if is_absolute(stored) else Path(os.path.normpath(folder / stored))


def is_pattern(path: Path) -> bool:
    """True if a name such as ``*.obj`` stands for several files, and is not one file's own."""
    return glob.has_magic(path.name) and not path.exists()


def files_of_pattern(path: Path) -> list[Path]:
    """Files that match a pattern in the name; ``[`` in a folder is a ``[``."""
    return [path.parent / name for name in glob.glob(path.name, root_dir=path.parent)]


def files_at(path: Path) -> list[Path]:
    """The files of a pattern in order, or the path itself."""
    return sorted(files_of_pattern(path)) if is_pattern(path) else [path]


def is_there(path: Path) -> bool:
    """True if a file, a folder, or any file of a pattern exists."""
    return bool(files_of_pattern(path)) if is_pattern(path) else path.exists()


def is_absolute(stored: str) -> bool:
    """True if a stored path is absolute, on whatever system it was written."""
    return PurePosixPath(stored).is_absolute() or PureWindowsPath(stored).is_absolute()


def paths_named(names: set[str], folder: Path, progress: Progress) -> dict[str, list[Path]]:
    """Files and folders of these names below ``folder``."""
    paths: dict[str, list[Path]] = {}
    root = plain_path(folder)
    if root.name in names:
        paths.setdefault(root.name, []).append(root)
    for searched, (where, folders, files) in enumerate(os.walk(root)):
        progress(searched, 0)
        for name in names.intersection(folders) | names.intersection(files):
            paths.setdefault(name, []).append(Path(where, name))
        # A Zarr array is one thing made of countless files.
        folders[:] = [name for name in folders if not name.endswith(".zarr")]
    return paths


def common_suffix_length(a: Path, b: Path) -> int:
    """Number of trailing parts that two paths share."""
    pairs = zip(reversed(a.parts), reversed(b.parts), strict=False)
    return sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], pairs))


def free_path(folder: Path, name: str, prefix: str, *, reserved: str) -> Path:
    """Free path for ``name`` in a folder, with a prefix and a number if it is taken.

    Parameters
    ----------
    folder : Path
    name : str
        Wanted name of a file or folder.
    prefix : str
        Put before the name where that is taken: ``prefix-name``, then ``prefix-2-name`` and so on.
    reserved : str
        Name that is never given.
    """
    names = chain((name, f"{prefix}-{name}"), (f"{prefix}-{n}-{name}" for n in count(2)))
    return next(
        folder / free
        for free in names
        # A link that leads nowhere does not "exist" but would be replaced.
        if free != reserved and not os.path.lexists(folder / free)
    )


def make_folder(path: Path) -> list[Path]:
    """Make a folder, with those above it that are missing; return those that were made.

    Raises Sd2Error if something above it is no folder, or it cannot be made.
    """
    path = path.absolute()
    missing = list(takewhile(lambda one: not one.exists(), (path, *path.parents)))
    above = missing[-1].parent if missing else path
    if not above.is_dir():
        raise Sd2Error(f"{above} is a file", "a folder", "Choose another place")
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise Sd2Error(
            f"The folder {path} cannot be made ({error.strerror})",
            f"a place in {above} for it",
            "Choose another place",
        ) from error
    return missing


def remove(path: Path) -> None:
    """Delete a file or folder, or nothing where there is none."""
    if path.is_dir():
        import shutil  # here because it loads every compression, and starting should be short

        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)
