"""Points in text: a line for each frame, three numbers for each point."""

from pathlib import Path

import numpy as np

from sd2core.io.mesh_arrays import RawMesh
from sd2core.io.readers import FileReader, MeshHints

SD2_PLUGIN_API = 1


def read(path: Path, hints: MeshHints) -> RawMesh:
    rows = np.loadtxt(path, ndmin=2)
    return RawMesh(rows.reshape(len(rows), -1, 3), frames_per_s=25.0)


READER = FileReader(read, (".points",))
