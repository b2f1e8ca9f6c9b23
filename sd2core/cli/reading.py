"""Reading what the command line names."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sd2core.errors import Sd2Error

if TYPE_CHECKING:
    from sd2core.mesh import MeshSequence


def load_mesh_as_told(path: Path, options: argparse.Namespace) -> MeshSequence:
    """Load a mesh with ``--faces``, ``--fps`` and ``--scale`` where they are given."""
    from sd2core.io.mesh import load_mesh

    told: dict[str, Any] = {
        "faces": options.faces,
        "frames_per_s": options.fps,
        "scale": options.scale,
    }
    return load_mesh(path, **{name: value for name, value in told.items() if value is not None})


def check_output(path: Path, suffix: str) -> None:
    """Refuse an output file that cannot be written, before the work is done."""
    if path.suffix.lower() != suffix:
        raise Sd2Error(f"The output file is {path}", f"a name that ends in {suffix}")
    if not path.absolute().parent.is_dir():
        raise Sd2Error(
            f"The folder {path.absolute().parent} does not exist",
            "an existing folder for the output file",
        )
