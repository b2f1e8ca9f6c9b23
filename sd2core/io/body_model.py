"""Body models of the SMPL family: vertices from shapes and poses, by a model file of the user's.

SMPL, SMPL-H and SMPL-X share one layout: a surface at rest, what shapes and poses add to it, where
the joints lie in it, and how much each joint moves each vertex (linear blend skinning).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.files.numpy_files import open_npz_file
from sd2core.files.paths import PICKLE_SUFFIXES
from sd2core.io.pickles import read_pickle
from sd2core.progress import Progress, silent

Floats = NDArray[np.float64]

BODY_JOINTS = 22
"""Joints from the pelvis to the wrists, which all models have in the same order."""
FAMILIES = {24: "SMPL", 52: "SMPL-H", 55: "SMPL-X"}
"""Models by the number of their joints."""

_NAMES = ("v_template", "shapedirs", "posedirs", "J_regressor", "kintree_table", "weights", "f")
_EXPECTED = f"a model of SMPL, SMPL-H or SMPL-X (.npz or .pkl) with {', '.join(_NAMES)}"
_REMEDY = "Get the model where its licence is given (smpl.is.tue.mpg.de, smpl-x.is.tue.mpg.de)"
_CHUNK_BYTES = 32 * 2**20
_MAX_BYTES = 8 * 10**9
_HANDS_OF_SMPLX = slice(25, 55)


@dataclass(frozen=True, eq=False)
class BodyModel:
    """A surface of V vertices that J joints move, with S shapes."""

    rest_m: Floats  # (V, 3)
    shapes_m: Floats  # (V, 3, S), added for a coefficient of 1
    corrections_m: NDArray[np.float32]  # (9 (J - 1), 3 V), added for R - 1 of all but the root
    joint_weights: Floats  # (J, V), of the vertices in the places of the joints
    parents: tuple[int, ...]  # of each joint; the root's is -1
    weights: NDArray[np.float32]  # (V, J), of the joints in the movement of the vertices
    faces: NDArray[np.int64]  # (F, 3)
    source: str

    @property
    def joint_count(self) -> int:
        """Number of joints J."""
        return len(self.parents)

    @property
    def name(self) -> str:
        """Name of the model, as far as its joints tell it."""
        return FAMILIES.get(self.joint_count, f"a model of {self.joint_count} joints")

    def shaped(self, betas: Floats) -> tuple[Floats, Floats]:
        """Vertices (n, V, 3) and joints (n, J, 3) at rest of bodies of shapes (n, S')."""
        known = min(betas.shape[-1], self.shapes_m.shape[-1])
        surfaces = self.rest_m + np.tensordot(
            betas[..., :known], self.shapes_m[..., :known], (-1, -1)
        )
        return surfaces, np.einsum("jv,nvk->njk", self.joint_weights, surfaces)

    def posed(
        self, turns: Floats, betas: Floats, places_m: Floats, progress: Progress = silent
    ) -> NDArray[np.float32]:
        """Vertices (T, V, 3) of T frames, in float32.

        Parameters
        ----------
        turns : float64 ndarray, (T, J, 3, 3)
            Rotation of each joint in its parent; the root's in the world.
        betas : float64 ndarray, (1, S') or (T, S')
            Shape of all frames, or of each.
        places_m : float64 ndarray, (T, 3)
            Added to all vertices, as SMPL's translation is.
        progress : callable
            Called with frames; may raise ``Cancelled``.
        """
        frames, vertices = len(turns), len(self.rest_m)
        check_frames(frames, vertices)
        one_shape = self.shaped(betas[:1]) if len(betas) == 1 else None
        posed = np.empty((frames, vertices, 3), np.float32)
        step = max(_CHUNK_BYTES // (8 * 12 * vertices), 1)
        for start in range(0, frames, step):
            progress(start, frames)
            part = slice(start, min(start + step, frames))
            surfaces, joints = one_shape or self.shaped(betas[part])
            at_rest = surfaces + self._corrections(turns[part])
            moves = self._moves(turns[part], joints).astype(np.float32)  # (n, J, 3, 4)
            blended = np.tensordot(moves, self.weights, (1, 1))  # (n, 3, 4, V)
            moved = np.einsum("nijv,nvj->nvi", blended[:, :, :3], at_rest)
            moved += np.swapaxes(blended[:, :, 3], 1, 2)
            posed[part] = moved + places_m[part, None]
        progress(frames, frames)
        return posed

    def _corrections(self, turns: Floats) -> Floats:
        """Corrections by pose to the surface at rest, (n, V, 3)."""
        features = (turns[:, 1:] - np.eye(3)).reshape(len(turns), -1).astype(np.float32)
        return np.asarray((features @ self.corrections_m).reshape(len(turns), -1, 3), np.float64)

    def _moves(self, turns: Floats, joints_m: Floats) -> Floats:
        """Rotation and translation (n, J, 3, 4) of what each joint carries, from rest."""
        joints_m = np.broadcast_to(joints_m, (len(turns), *joints_m.shape[1:]))
        whole = np.empty((*turns.shape[:2], 3, 3))
        places = np.empty_like(joints_m)
        for joint, parent in enumerate(self.parents):
            if parent < 0:
                whole[:, joint], places[:, joint] = turns[:, joint], joints_m[:, joint]
                continue
            whole[:, joint] = whole[:, parent] @ turns[:, joint]
            bone = joints_m[:, joint] - joints_m[:, parent]
            places[:, joint] = places[:, parent] + (whole[:, parent] @ bone[..., None])[..., 0]
        shift = places - (whole @ joints_m[..., None])[..., 0]
        return np.concatenate([whole, shift[..., None]], axis=-1)


def check_frames(frames: int, vertices: int) -> None:
    """Raise Sd2Error if so many frames of a body take more memory than one may."""
    if 12 * frames * vertices > _MAX_BYTES:
        raise Sd2Error(
            f"{frames:,} frames of {vertices:,} vertices take {12e-9 * frames * vertices:,.0f} GB",
            f"at most {_MAX_BYTES / 1e9:.0f} GB",
            "Cut the motion into parts",
        )


def fitted_to(model: BodyModel, turns: Floats) -> Floats:
    """Rotations (T, J, 3, 3) for a model's joints out of those of another model of the family.

    The body's joints are alike in all; fingers go over where both have them, and all others rest.
    """
    count = turns.shape[1]
    if count == model.joint_count:
        return turns
    rotations = np.tile(np.eye(3), (len(turns), model.joint_count, 1, 1))
    body = min(BODY_JOINTS, count, model.joint_count)
    rotations[:, :body] = turns[:, :body]
    fingers = {52: slice(BODY_JOINTS, 52), 55: _HANDS_OF_SMPLX}
    if count in fingers and model.joint_count in fingers:
        rotations[:, fingers[model.joint_count]] = turns[:, fingers[count]]
    return rotations


def read_body_model(path: Path) -> BodyModel:
    """Read a model file, ``.npz`` or ``.pkl``, of which nothing is executed.

    Raises
    ------
    Sd2Error
        If it is no model of the family, or its arrays do not agree.
    """
    if not path.is_file():
        raise Sd2Error(f"The body model {path} does not exist", _EXPECTED, _REMEDY)
    arrays: Mapping[str, Any]
    if path.suffix.lower() in PICKLE_SUFFIXES:
        arrays = read_pickle(path)
    elif path.suffix.lower() == ".npz":
        with open_npz_file(path, "a body model", _EXPECTED, _REMEDY) as archive:
            arrays = {name: archive[name] for name in _NAMES if name in archive}
    else:
        raise Sd2Error(f"{path} is no body model that is known", _EXPECTED, _REMEDY)
    missing = [n for n in _NAMES if not isinstance(arrays, Mapping) or n not in arrays]
    if missing:
        raise Sd2Error(f"{path} lacks {', '.join(missing)}", _EXPECTED, _REMEDY)
    try:
        return _model(arrays, str(path))
    except (TypeError, ValueError) as error:
        raise Sd2Error(f"{path}: its arrays do not agree ({error})", _EXPECTED, _REMEDY) from error


def _model(arrays: Mapping[str, Any], source: str) -> BodyModel:
    """The model of these arrays; ValueError if they do not agree."""
    rest = np.asarray(arrays["v_template"], np.float64).reshape(-1, 3)
    vertices = len(rest)
    tree = np.asarray(arrays["kintree_table"]).astype(np.int64)
    parents = (-1, *map(int, tree.reshape(2, -1)[0, 1:]))  # the root's is stored as 2³² - 1
    joints = len(parents)
    if not all(0 <= parent < joint for joint, parent in enumerate(parents) if joint):
        raise ValueError("a joint does not come after its parent")
    corrections = np.asarray(arrays["posedirs"], np.float32).reshape(3 * vertices, -1).T
    shapes = np.asarray(arrays["shapedirs"], np.float64).reshape(vertices, 3, -1)
    weights = np.asarray(arrays["weights"], np.float32).reshape(vertices, joints)
    regressor = np.asarray(arrays["J_regressor"], np.float64).reshape(joints, vertices)
    faces = np.asarray(arrays["f"]).astype(np.int64).reshape(-1, 3)
    if len(corrections) != 9 * (joints - 1):
        raise ValueError(f"posedirs for {len(corrections)} numbers, {joints} joints")
    if not faces.size or faces.min() < 0 or faces.max() >= vertices:
        raise ValueError(f"faces of vertices that are not among the {vertices:,}")
    for name, array in (("v_template", rest), ("weights", weights), ("J_regressor", regressor)):
        if not np.isfinite(array).all():
            raise ValueError(f"{name} is not finite")
    corrections = np.ascontiguousarray(corrections)
    return BodyModel(rest, shapes, corrections, regressor, parents, weights, faces, source)
