"""Parameters of a body's motion, under the names that estimators and motion capture give them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.io.body_model import FAMILIES, BodyModel, Floats, fitted_to
from sd2core.progress import Progress, silent

_MATRICES = ("rotmat", "pred_rotmat")  # PromptHMR; TRAM
_VECTORS = ("poses", "smpl_poses", "smpl_thetas", "fullpose", "pose")  # AMASS, AIST++, ROMP, …
_ROOT = ("global_orient", "root_orient")
_BODY = ("body_pose", "pose_body")
_SHAPES = ("betas", "shape", "pred_shape", "smpl_betas")
_PLACES = ("trans", "transl", "smpl_trans", "pred_trans", "cam_trans", "pred_cam_t")
PARAMETER_NAMES = (*_MATRICES, *_VECTORS, *_ROOT, *_BODY, *_SHAPES, *_PLACES)

_CAPTURE_RATES = ("mocap_framerate", "mocap_frame_rate")
_AIST_RATE = 60.0
_AIST_M = 0.01  # its unit is the centimetre
_OF_SMPLX = {25, 55}
_Y_DOWN_OF_Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
_Y_DOWN_OF_Y_UP = np.diag([1.0, -1.0, -1.0])


@dataclass(frozen=True, eq=False)
class BodyParameters:
    """Motion of one body as a model of the SMPL family has it."""

    turns: Floats  # (T, J, 3, 3) of the joints, each in its parent
    betas: Floats  # (1, S) or (T, S)
    places_m: Floats | None  # (T, 3); None: not said
    of_smplx: bool | None = None  # None: its pose is that of any model
    to_camera: Floats | None = None  # turns (3, 3) its world to ours; None: it is the camera's
    scale: float = 1.0  # size of the body, and unit of its places, in metres
    usual_frames_per_s: float | None = None  # where the file states no rate

    def vertices(
        self, model: BodyModel, notes: list[str], progress: Progress = silent
    ) -> NDArray[np.float32]:
        """Vertices (T, V, 3) by a model; what had to be left out is noted."""
        betas = self.betas
        model_of_smplx = model.joint_count in _OF_SMPLX
        if self.of_smplx is not None and self.of_smplx != model_of_smplx and betas.any():
            theirs = "SMPL-X" if self.of_smplx else "SMPL"
            notes.append(
                f"These are parameters of {theirs} and {model.source} is {model.name}, whose shapes"
                " are others: the pose is kept, on a body of average shape."
            )
            betas = np.zeros((1, 1))
        places_m = np.zeros((len(self.turns), 3)) if self.places_m is None else self.places_m
        posed = model.posed(fitted_to(model, self.turns), betas, places_m, progress)
        if self.to_camera is None:
            return posed
        notes.append(
            "Motion without a camera: its upward axis is turned to ours (y down). Give its distance"
            " (--distance-m) or the radar's place (--sensor)."
        )
        # A turn by quarters swaps axes and signs, and rounds nothing.
        return posed @ (self.scale * self.to_camera).T.astype(np.float32)


def holds_parameters(entry: Mapping[Any, Any]) -> bool:
    """True if :func:`parameters_of` finds a pose."""
    root = any(name in entry for name in _ROOT) and any(name in entry for name in _BODY)
    return root or any(name in entry for name in (*_MATRICES, *_VECTORS))


def parameters_of(entry: Mapping[Any, Any], source: str) -> BodyParameters:
    """Find pose, shape and place in a person's arrays; Sd2Error if they do not agree."""
    try:
        turns = _turns(entry)
        frames = len(turns)
        shape = first_of(entry, _SHAPES)
        betas = np.zeros((1, 1)) if shape is None else np.asarray(shape, np.float64)
        betas = np.atleast_2d(betas.reshape(-1, betas.shape[-1]) if betas.ndim > 2 else betas)
        if len(betas) not in (1, frames):
            raise ValueError(f"{len(betas)} shapes for {frames} frames")
        if len(betas) > 1 and (betas == betas[0]).all():
            betas = betas[:1]
        place = first_of(entry, _PLACES)
        places_m = None if place is None else np.asarray(place, np.float64).reshape(frames, 3)
        if not all(np.isfinite(one).all() for one in (turns, betas)):
            raise ValueError("a pose or a shape is not finite")
    except (TypeError, ValueError) as error:
        raise Sd2Error(
            f"{source}: its body parameters do not agree ({error})",
            "rotations of the joints, a shape, and a place for every frame",
        ) from error
    joints = turns.shape[1]
    of_smplx = (joints in _OF_SMPLX) if joints in (*FAMILIES, *_OF_SMPLX) else None
    if str(entry.get("surface_model_type", "")).startswith("smplx"):  # of AMASS
        of_smplx = True
    to_camera, rate, scale = None, None, 1.0
    if any(name in entry for name in _CAPTURE_RATES):  # read by mesh_clock
        to_camera = _Y_DOWN_OF_Z_UP
    elif "smpl_scaling" in entry:
        to_camera, rate, scale = _Y_DOWN_OF_Y_UP, _AIST_RATE, _scaling(entry, source)
        if places_m is not None:
            places_m = places_m / scale
        scale *= _AIST_M
    return BodyParameters(turns, betas, places_m, of_smplx, to_camera, scale, rate)


def _scaling(entry: Mapping[Any, Any], source: str) -> float:
    """Length in centimetres of what is a metre of the model (AIST++)."""
    scaling = float(np.asarray(entry["smpl_scaling"]).reshape(-1)[0])
    if not (np.isfinite(scaling) and scaling > 0):
        raise Sd2Error(f"{source}: smpl_scaling is {scaling}", "a positive number, about 90")
    return scaling


def _turns(entry: Mapping[Any, Any]) -> Floats:
    """Rotations (T, J, 3, 3) of the joints; ValueError or TypeError if they are none."""
    matrices = first_of(entry, _MATRICES)
    if matrices is not None:
        return _as_matrices(matrices, True)
    vectors = first_of(entry, _VECTORS)
    if vectors is not None:
        vectors = np.asarray(vectors, np.float64)
        return _as_matrices(vectors, _are_matrices(vectors))
    parts = [np.asarray(first_of(entry, names), np.float64) for names in (_ROOT, _BODY)]
    matrices = all(_are_matrices(part) for part in parts)
    return np.concatenate([_as_matrices(part, matrices) for part in parts], axis=1)


def _are_matrices(values: Floats) -> bool:
    """True for a matrix a joint and frame; three vectors in a row are none."""
    return values.ndim > 2 and values.shape[-2:] == (3, 3)


def _as_matrices(values: Any, matrices: bool) -> Floats:
    numbers = np.asarray(values, np.float64)
    if matrices:
        # Old estimators keep all joints of all frames in one row.
        return numbers.reshape(len(numbers), -1, 3, 3)
    return rotation_matrices(numbers.reshape(len(numbers), -1, 3))


def rotation_matrices(vectors: Floats) -> Floats:
    """Rotations (..., 3, 3) by rotation vectors (..., 3) in radians (Rodrigues)."""
    from scipy.spatial.transform import Rotation

    flat = Rotation.from_rotvec(vectors.reshape(-1, 3)).as_matrix()
    return np.asarray(flat.reshape(*vectors.shape, 3))


def first_of(entry: Mapping[Any, Any], names: tuple[str, ...]) -> Any:
    """Value of an entry under the first of several names, or None."""
    return next((entry[name] for name in names if entry.get(name) is not None), None)
