"""Finding moved files of a recording by their names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from sd2core.errors import Sd2Error
from sd2core.files.paths import common_suffix_length, is_pattern, is_there, paths_named
from sd2core.progress import Progress

Role = str
"""Role of a file in a recording: one of :data:`ROLES`, or of a mesh of the scene.

Such as ``body 2``, beside the first, ``faces of body 2``, or ``thing 1``.
"""

ROLES: tuple[Role, ...] = ("video", "mesh", "faces", "radar", "denoiser", "imu")

_BODY, _THING = "body ", "thing "


def is_thing(role: Role) -> bool:
    """True for the role of the mesh file of a thing."""
    return role.startswith(_THING)


def role_words(role: Role) -> str:
    """Role of a file in a sentence, such as ``video`` or ``mesh of thing 2``."""
    if role.startswith((_BODY, _THING)):
        return f"mesh of {role}"
    return "inertial sensor's file" if role == "imu" else role


def _is_mesh(role: Role) -> bool:
    return role == "mesh" or role.startswith(_BODY)


@dataclass(frozen=True)
class Relinked:
    """Result of a search for files, by role."""

    paths: dict[Role, Path]  # new paths
    ambiguous: dict[Role, tuple[Path, ...]]  # candidates that fit equally well; nothing was changed
    missing: tuple[Role, ...]  # no name under the folder fits


def find_again(missing: Mapping[Role, Path], folder: Path, progress: Progress) -> Relinked:
    """Find files by their names under a folder and everything below it.

    Of several files with the right name, the one whose path agrees with the stored one over the
    most trailing parts is taken, if it is the only one. ``progress`` is called with (folders
    searched, 0), as the total is not known. Raises Sd2Error if ``folder`` is none.
    """
    if not folder.is_dir():
        raise Sd2Error(f"{folder} is not a folder", "the folder to search for missing files")
    folders = {path.parent.name for role, path in missing.items() if is_many(role, path)}
    names = {path.name for path in missing.values()}
    candidates = paths_named(names | folders, folder, progress)
    paths: dict[Role, Path] = {}
    ambiguous: dict[Role, tuple[Path, ...]] = {}
    for role, path in missing.items():
        # Files of a pattern are found by their folder, unless it is one file's own name.
        by_folder = is_many(role, path) and path.name not in candidates
        old = path.parent if by_folder else path
        rest = path.relative_to(old)
        same_name = [p for p in candidates.get(old.name, []) if exists(role, p / rest)]
        agreement = [common_suffix_length(path, old) for path in same_name]
        best = [
            path
            for path, parts in zip(same_name, agreement, strict=True)
            if parts == max(agreement)
        ]
        if len(best) == 1:
            paths[role] = best[0] / rest
        elif best:
            ambiguous[role] = tuple(sorted(best))
    left = tuple(role for role in missing if role not in paths and role not in ambiguous)
    return Relinked(paths, ambiguous, left)


def is_many(role: Role, path: Path) -> bool:
    """True if a path stands for many files; only a mesh is made of them."""
    return _is_mesh(role) and is_pattern(path)


def exists(role: Role, path: Path) -> bool:
    """True if the file or files of a path are there."""
    return is_there(path) if _is_mesh(role) else path.exists()
