"""Files of arrays that come with the program, or were made anew by a command of it."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error


@contextmanager
def open_arrays(
    path: Path, kind: str, version: int, what: str, command: str
) -> Iterator[tuple[dict[str, Any], Mapping[str, NDArray[Any]]]]:
    """Open an ``.npz`` whose ``meta`` tells its format; arrays are read where asked for.

    Parameters
    ----------
    path : Path
    kind, version
        The format that is wanted, up to this version.
    what, command : str
        What it holds and what writes it, for the error.

    Raises
    ------
    Sd2Error
        When the file is missing, damaged, of a later version, or lacks an array that
        is asked for while it is open.
    """
    try:
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as data:
            meta = json.loads(str(data["meta"]))
            if meta.get("format") != kind or meta.get("version", 0) > version:
                raise Sd2Error(
                    f"{path} is of format {meta.get('format')!r} version {meta.get('version')}",
                    f"{kind!r} up to version {version}",
                    "Open it with the version of SD² Studio that wrote it",
                )
            yield meta, data
    except (OSError, KeyError, ValueError, zipfile.BadZipFile) as error:
        raise Sd2Error(
            f"{path} cannot be read as {what} ({error})", f"a file written by `{command}`"
        ) from error
