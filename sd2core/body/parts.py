"""Parts of the body by which a Doppler map is split.

The bundled body's parts are those of its skin. Any other surface takes them over from it by
topology: the five tips of a body (head, hands, feet) lie farthest from each other along its
surface, and a vertex belongs to the part whose vertices on the bundled body are equally far from
all five. Lengths along a surface hardly change with the pose, so one frame tells.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import permutations
from typing import TYPE_CHECKING, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from sd2core.body.limbs import LIMBS, vertex_limbs
from sd2core.body.model import Body, Resolution, own_resolution
from sd2core.body.rotations import Floats
from sd2core.errors import Sd2Error
from sd2core.maps import DopplerMap
from sd2core.mesh.made_vertices import unshifted
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.vertex_parts import PARTS, WHOLE, VertexParts, other_side
from sd2core.progress import Progress, silent
from sd2core.sensor import VirtualSensor

if TYPE_CHECKING:
    from scipy.sparse import csr_array
    from scipy.spatial import cKDTree

    from sd2core.doppler import Synthesizer

_PART_OF = {
    "head": "trunk",
    "torso": "trunk",
    "hand": "forearm",
    "shank": "lower_leg",
    "foot": "lower_leg",
}
_MIRRORED = np.array([PARTS.index(other_side(name)) for name in PARTS], np.uint8)

_TIPS = 5
_MIN_SHARE = 0.6
"""Share of the vertices that the largest connected piece of a body must have."""
_LIKE_A_BODY = 0.2
"""Greatest deviation (RMS) of the distances between the tips from those of the bundled body."""


def body_parts(mesh: MeshSequence) -> VertexParts | None:
    """Part of the body of every vertex; None where the parts are not known.

    Those of the bundled body's surfaces are known, and those of any closed surface that has a
    body's five tips (SMPL's, say), by its first frame with a person. A point cloud has none.
    A mesh is searched once. In a scene of several bodies somebody whose parts are not known is one
    part.

    Examples
    --------
    >>> import sd2core as sd2
    >>> from sd2core.files.resources import resource_path
    >>> parts = body_parts(sd2.load_mesh(resource_path("swipes.sd2") / "mesh.zarr"))
    >>> parts.names[parts.numbers[0]]
    'trunk'
    """
    parts = [_parts_of(body) for body in mesh.bodies]
    if not mesh.others:
        return parts[0]
    first, *others = (
        VertexParts((WHOLE,), np.zeros(body.vertex_count, np.uint8)) if one is None else one
        for body, one in zip(mesh.bodies, parts, strict=True)
    )
    return replace(first, others=tuple(others))


def _parts_of(body: MeshSequence) -> VertexParts | None:
    """Parts of one of the bodies of a scene, searched once wherever it is put."""
    if body not in _FOUND:
        own = unshifted(body)[0].vertices
        alike = [one for other, one in list(_FOUND.items()) if unshifted(other)[0].vertices is own]
        _FOUND[body] = alike[0] if alike else _find_parts(body)
    return _FOUND[body]


_FOUND: WeakKeyDictionary[MeshSequence, VertexParts | None] = WeakKeyDictionary()


def _find_parts(mesh: MeshSequence) -> VertexParts | None:
    resolution = own_resolution(mesh)
    if resolution is not None:
        return VertexParts(PARTS, _own_parts(resolution))
    if mesh.faces is None:
        return None
    first = int(np.argmax(mesh.presence.present))
    numbers = parts_by_shape(mesh.frame(first).astype(np.float64), mesh.faces)
    return None if numbers is None else VertexParts(PARTS, numbers)


def known_parts(mesh: MeshSequence) -> VertexParts:
    """Part of the body of every vertex; Sd2Error where the parts are not known."""
    parts = body_parts(mesh)
    if parts is None:
        raise Sd2Error(
            f"{mesh.source or 'The mesh'}: the parts of the body are not known",
            "a closed surface of one whole body, with faces",
            "Give the faces of the mesh (--faces), or do without limbs",
        )
    return parts


def splits_everybody(mesh: MeshSequence) -> bool:
    """True if the parts of the body are known of each person of the scene."""
    parts = body_parts(mesh)
    return parts is not None and all(WHOLE not in one.names for one in (parts, *parts.others))


def synthetic_map(
    maker: Synthesizer,
    sensor: VirtualSensor,
    *,
    limbs: bool,
    progress: Progress = silent,
) -> DopplerMap:
    """Doppler map of a mesh that states its accuracy, as far as the mesh says that of the body.

    Parameters
    ----------
    maker : Synthesizer
        Of that mesh.
    sensor : VirtualSensor
        Where it stands and looks.
    limbs : bool
        True for its split as well, by the parts that :func:`known_parts` finds (or refuses).
    progress : Progress
        Counts frames; may raise Cancelled.
    """
    from sd2core.doppler.body_error import body_error

    if limbs:
        parts = known_parts(maker.mesh)
        made = maker.limb_maps(sensor, parts, progress=progress)
    else:
        made = maker.map(sensor, progress=progress)
    error = body_error(maker, sensor)
    return made if error is None else replace(made, meta=made.meta | {"body_error_l1": error})


def parts_by_shape(points_m: Floats, faces: NDArray[np.int32]) -> NDArray[np.uint8] | None:
    """Part (number in :data:`PARTS`) of every vertex, (V,), of a body in any pose.

    ``points_m`` (V, 3) is in a right-handed frame, faces (F, 3) run counter-clockwise seen from
    outside. None if the surface has no body's shape.
    """
    # Imported where a surface is searched: the bundled body's are not, and a window starts sooner.
    from scipy.spatial import cKDTree

    surface = _Surface.of(points_m, faces)
    if surface is None:
        return None
    template = _template()
    between = surface.between / surface.between.mean()

    def deviation(order: tuple[int, ...]) -> float:
        off = between[np.ix_(order, order)] - template.between
        return float(np.sqrt(np.square(off).mean()))

    order = min(permutations(range(_TIPS)), key=deviation)
    if not deviation(order) < _LIKE_A_BODY:
        return None
    _, nearest = template.tree.query(surface.away[:, order] / surface.between.mean())
    parts = template.parts[nearest]
    whole_m = points_m[surface.vertices]
    if _is_mirrored(whole_m, parts):
        parts = _MIRRORED[parts]
    # Eyes, teeth and clothes that hang on nothing belong to what is nearest.
    _, beside = cKDTree(whole_m).query(points_m)
    return np.asarray(parts[beside], np.uint8)


def edge_lengths(points_m: Floats, faces: NDArray[np.int32]) -> csr_array:
    """Graph of a surface: lengths of the edges between vertices, (V, V), each once."""
    from scipy.sparse import csr_array

    ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    ends = np.unique(np.sort(ends, axis=1), axis=0)
    lengths_m = np.linalg.norm(points_m[ends[:, 0]] - points_m[ends[:, 1]], axis=1)
    # A sparse array takes a length of zero for no edge at all.
    lengths_m = np.maximum(lengths_m, 1e-9)
    return csr_array((lengths_m, (ends[:, 0], ends[:, 1])), (len(points_m),) * 2)


@dataclass(frozen=True, eq=False)
class _Surface:
    """Largest connected piece of a surface, with distances along it."""

    vertices: NDArray[np.intp]  # (n,)
    tips: NDArray[np.intp]  # (5,), into vertices
    away: Floats  # (n, 5) from the tips

    @property
    def between(self) -> Floats:
        """Distances between the tips, (5, 5)."""
        return self.away[self.tips]

    @classmethod
    def of(cls, points_m: Floats, faces: NDArray[np.int32]) -> _Surface | None:
        """None if the surface is in pieces, or its points are not finite."""
        from scipy.sparse.csgraph import connected_components, dijkstra

        graph = edge_lengths(points_m, faces)
        if not np.isfinite(graph.data).all():
            return None
        _, piece = connected_components(graph, directed=False)
        vertices = np.flatnonzero(piece == np.bincount(piece).argmax())
        if len(vertices) < max(_MIN_SHARE * len(points_m), _TIPS + 1):
            return None
        graph = graph[vertices][:, vertices]
        middle = np.linalg.norm(points_m[vertices] - points_m.mean(axis=0), axis=1).argmin()
        away = [dijkstra(graph, directed=False, indices=middle)]
        tips = []
        for _ in range(_TIPS):
            tips.append(int(np.min(away, axis=0).argmax()))
            away.append(dijkstra(graph, directed=False, indices=tips[-1]))
        return cls(vertices, np.array(tips, np.intp), np.stack(away[1:], axis=1))


def _is_mirrored(points_m: Floats, parts: NDArray[np.uint8]) -> bool:
    """True if what is named left is on the right of a body, by where its feet point."""

    def middle(*names: str) -> Floats:
        rows = np.isin(parts, [PARTS.index(name) for name in names])
        return np.asarray(points_m[rows].mean(axis=0))

    turned = 0.0
    across = middle("thigh.L", "upper_arm.L") - middle("thigh.R", "upper_arm.R")
    up = middle("trunk") - middle("thigh.L", "thigh.R")
    for side in "LR":
        leg = points_m[parts == PARTS.index(f"lower_leg.{side}")]
        shin = middle(f"thigh.{side}") - leg.mean(axis=0)
        along = (leg - leg.mean(axis=0)) @ (shin / np.linalg.norm(shin))
        foot, calf = leg[along < np.quantile(along, 0.25)], leg[along > np.quantile(along, 0.5)]
        forward = foot.mean(axis=0) - calf.mean(axis=0)
        forward = forward - shin * (forward @ shin) / (shin @ shin)
        turned += float(np.cross(up, forward) @ across)
    return turned < 0.0


class _Template(NamedTuple):
    """The bundled body: distances from its tips, over the mean of those between them."""

    between: Floats  # (5, 5)
    tree: cKDTree  # of the distances (V, 5) of all vertices
    parts: NDArray[np.uint8]  # (V,)


@lru_cache(maxsize=1)
def _template() -> _Template:
    from scipy.spatial import cKDTree

    body = Body.load("medium")
    surface = _Surface.of(body.vertices_m, body.faces)
    assert surface is not None
    scale_m = surface.between.mean()
    parts = _own_parts("medium")[surface.vertices]
    return _Template(surface.between / scale_m, cKDTree(surface.away / scale_m), parts)


@lru_cache(maxsize=3)
def _own_parts(resolution: Resolution) -> NDArray[np.uint8]:
    of_limb = []
    for limb in LIMBS:
        name, dot, side = limb.partition(".")
        of_limb.append(PARTS.index(_PART_OF.get(name, name) + dot + side))
    return np.array(of_limb, np.uint8)[vertex_limbs(Body.load(resolution))]
