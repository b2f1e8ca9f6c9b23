"""The people of a mesh file or folder, to choose one from."""

from __future__ import annotations

from pathlib import Path

from sd2core.errors import Sd2Error
from sd2core.files.paths import is_pattern
from sd2core.io.estimator_files import files_of_people, people_in
from sd2core.io.frame_names import persons_among
from sd2core.io.mesh_files import surface_files
from sd2core.io.mesh_models import frames_of, is_estimate


def persons_in(path: Path) -> dict[str, int]:
    """Number of frames of each person, by what ``load_mesh`` takes as ``person``.

    Empty for a file that tells no persons, or cannot be read: reading it says why.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import numpy as np
    >>> body = np.zeros((3, 500, 3))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     np.savez(Path(folder) / "two.npz", results={
    ...         "0": {"verts": body}, "1": {"verts": body[:2]}})
    ...     persons_in(Path(folder) / "two.npz")
    {'0': 3, '1': 2}
    """
    try:
        if is_pattern(path) or path.is_dir():
            of_people = not is_pattern(path) and is_estimate(path)
            files = files_of_people(path) if of_people else surface_files(path, [])
            counts = persons_among(files, str(path))
            return {str(number): count for number, count in counts.items()}
        if not is_estimate(path):
            return {}
        people, _ = people_in(path, None, [])
        return {str(name): frames_of(person, path) for name, person in people.items()}
    except (Sd2Error, OSError, ArithmeticError, LookupError, TypeError, ValueError):
        return {}
