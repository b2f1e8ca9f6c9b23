"""Facets of a whole clip that a sensor sees."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.mesh.sequence import MeshSequence
from sd2core.numerics.compiled import workers
from sd2core.progress import Progress, silent
from sd2core.scattering.facets import visible_facets
from sd2core.sensor import VirtualSensor


def facet_visibility(
    mesh: MeshSequence, sensor: VirtualSensor, progress: Progress = silent
) -> NDArray[np.bool_]:
    """Visible facets of every frame, (T, F); none where there is no person.

    Raises Sd2Error for a point cloud.
    """
    if mesh.faces is None:
        raise Sd2Error("The mesh has no faces", "a surface, which alone can hide anything")
    faces = mesh.faces
    visible = np.zeros((mesh.frame_count, len(faces)), dtype=np.bool_)

    def fill(frame: int) -> None:
        if mesh.presence.present[frame]:
            visible[frame] = visible_facets(mesh.frame(frame), faces, sensor.position_m)

    for done, _ in enumerate(workers().map(fill, range(mesh.frame_count))):
        progress(done, mesh.frame_count)
    return visible
