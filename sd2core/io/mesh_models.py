"""Output of body-estimation tools, and motion that was captured: one person's mesh in metres.

Vertices are taken where a file has them; parameters become vertices by a body model that the user
has. A body that is centred on its root is placed by the camera in the file.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.files.limits import check_size
from sd2core.files.numpy_files import npz_names
from sd2core.files.paths import PICKLE_SUFFIXES, is_pattern
from sd2core.io.body_model import read_body_model
from sd2core.io.body_parameters import PARAMETER_NAMES, first_of, parameters_of
from sd2core.io.estimator_files import (
    ESTIMATED,
    FOCAL_NAMES,
    TORCH_SUFFIXES,
    files_of_people,
    holds_bodies,
    people_in,
)
from sd2core.io.frame_names import chosen_person, persons_among
from sd2core.io.mesh_arrays import FACE_NAMES, VERTEX_NAMES, RawMesh, no_vertices
from sd2core.io.mesh_clock import clock_of
from sd2core.io.mesh_files import surface_files
from sd2core.io.momentum_rig import RIG_NAMES, holds_rig, rigged
from sd2core.io.readers import MeshHints
from sd2core.plausibility.mesh import AT_ROOT_M

_NO_HINTS = MeshHints()
_SHIFTS = {"pred_cam_t": None, "cam_trans": 443.4 / 512, "camera": 5000.0 / 256}
"""Names of a body's place before the camera, and the focal length that was taken for it: in the
file (SAM 3D Body); of the picture's longer side (ROMP; 4D-Humans, whose PHALP makes all pictures
256 pixels large)."""
_NOWHERE = -1.0
"""All three coordinates of a body for which ROMP found no place."""
_VIBE_CROP = 1.1
"""Side of the picture that VIBE's network sees, of the box in its file."""


def is_estimate(path: Path) -> bool:
    """True if a file is to be read as an estimator's, or motion capture, rather than as a mesh."""
    suffix = path.suffix.lower()
    if path.is_dir():
        return bool(files_of_people(path))
    if suffix == ".npz":
        names = npz_names(path)
        return not names & {*VERTEX_NAMES} and bool(
            names & {*ESTIMATED, *PARAMETER_NAMES, *RIG_NAMES, "results"}
        )
    if suffix == ".npy":
        return holds_bodies(path)
    return suffix in (*PICKLE_SUFFIXES, *TORCH_SUFFIXES, ".json")


def read_model_output(path: Path, hints: MeshHints = _NO_HINTS) -> RawMesh:
    """Read one person's mesh without executing anything in the file.

    Raises
    ------
    Sd2Error
        If the file holds no vertices, and no parameters with a body model for them, something that
        is not plain data, no such person, or a camera that does not fit its frames.
    """
    try:
        return _person_of(path, hints)
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        # Names are as an estimator's, and what stands under them is anything.
        raise Sd2Error(
            f"{path} is not laid out as an estimator of bodies writes it"
            f" ({type(error).__name__}: {error})",
            "people, each with arrays of numbers over their frames (docs/formats.md)",
            "Save its vertices as numpy.savez('mesh.npz', vertices=verts, faces=faces,"
            " times_s=times)",
        ) from error


def _person_of(path: Path, hints: MeshHints) -> RawMesh:
    """The person's mesh, from a file that is laid out as it should be."""
    notes: list[str] = []
    people, shared = people_in(path, hints.person, notes)
    if not people:
        raise _no_vertices(path, shared)
    held = [first_of(person, ESTIMATED) for person in people.values()]
    if hints.body_model is None and all(vertices is None for vertices in held):
        raise _no_vertices(path, people)
    lengths = {key: frames_of(value, path) for key, value in people.items()}
    entry: dict[Any, Any] = people[chosen_person(lengths, hints.person, str(path), notes)]
    vertices = first_of(entry, ESTIMATED)
    if vertices is None and hints.body_model is None:
        raise _no_vertices(path, entry)
    if vertices is not None and hints.body_model is not None:
        raise Sd2Error(
            f"{path} holds vertices, and a body model is given",
            "a model for a file of parameters only",
            "Leave out --body-model",
        )
    raw = RawMesh(vertices=np.empty(0), notes=notes)
    rate = None
    if vertices is None:
        assert hints.body_model is not None
        if holds_rig(entry):
            raw.vertices, raw.faces = rigged(entry, hints.body_model, str(path), hints.progress)
        else:
            model, parameters = read_body_model(hints.body_model), parameters_of(entry, str(path))
            raw.vertices, raw.faces = parameters.vertices(model, notes, hints.progress), model.faces
            rate = parameters.usual_frames_per_s
    else:
        raw.vertices = _stacked(vertices, path)
        raw.faces = _numbers(path, entry, shared, FACE_NAMES)
    shape = np.shape(raw.vertices)
    clock = clock_of([entry, shared], shape[0] if shape else 0, str(path))
    raw.times_s, raw.frames_per_s = clock.times_s, clock.frames_per_s or rate
    raw.frame_numbers = clock.frame_numbers
    notes += clock.notes
    _place_in_front(raw, {**shared, **entry}, path, hints)
    return raw


def weak_perspective_shift(
    camera: NDArray[np.float64],
    boxes: NDArray[np.float64],
    image_size: tuple[int, int],
    focal_px: float,
) -> NDArray[np.float64]:
    """Shift (T, 3) in metres of a root-centred body by which a real camera sees it in its box.

    VIBE's camera (s, t_x, t_y) maps a point X of the body to s·(X + t_x) in its box, which
    spans -1 to 1; the box is h pixels wide and centred on c_x. In pixels: u = c_x +
    (s·h/2)·(X + t_x). A pinhole camera with focal length f, centred on the image of width
    W, sees a body at depth Z and offset T_x at u = W/2 + f·(X + T_x)/Z. Equal scale gives Z
    = 2·f/(s·h); equal position gives T_x = t_x + (c_x - W/2)·2/(s·h). The same holds for y
    with the image's height.

    Parameters
    ----------
    camera : float64 array, shape (T, 3)
        s, t_x, t_y.
    boxes : float64 array, shape (T, 4)
        c_x, c_y, width and height in pixels of what the network saw; VIBE's are square.
    image_size : (int, int)
        Width and height in pixels.
    focal_px : float
        f.
    """
    metres_per_pixel = 2.0 / (camera[:, 0] * boxes[:, 2])
    width, height = image_size
    return np.stack(
        [
            camera[:, 1] + (boxes[:, 0] - width / 2) * metres_per_pixel,
            camera[:, 2] + (boxes[:, 1] - height / 2) * metres_per_pixel,
            focal_px * metres_per_pixel,
        ],
        axis=1,
    )


def frames_of(entry: dict[Any, Any], path: Path) -> int:
    """Number of frames of a person."""
    vertices = first_of(entry, ESTIMATED)
    if vertices is None and holds_rig(entry):
        return len(np.atleast_2d(entry[RIG_NAMES[0]]))
    if vertices is None:
        return len(parameters_of(entry, str(path)).turns)
    return len(vertices if isinstance(vertices, list | tuple) else _stacked(vertices, path))


def _stacked(vertices: Any, path: Path) -> NDArray[Any]:
    """One array (T, V, 3) out of an array or a list with one array per frame."""
    if isinstance(vertices, np.ndarray):
        if vertices.ndim == 2:
            return vertices[None]
        # Some keep the axis of a batch of one clip.
        one = vertices[0] if vertices.ndim == 4 and len(vertices) == 1 else vertices
        return _as_numbers(one, "the vertices", path)
    if isinstance(vertices, list | tuple) and all(isinstance(v, np.ndarray) for v in vertices):
        shapes = [v.shape[1:] if v.ndim == 3 and len(v) == 1 else v.shape for v in vertices]
        for frame, shape in enumerate(shapes):
            if shape != shapes[0]:
                raise Sd2Error(
                    f"{path}: frame {frame} has vertices of shape {shape}, frame 0 {shapes[0]}",
                    "the same vertices in every frame",
                    "Save one person's fitted mesh per file",
                )
        if shapes:
            # All frames may be one and the same array in the file.
            check_size(path, sum(v.nbytes for v in vertices), path.stat().st_size)
            stacked = np.stack([v.reshape(shapes[0]) for v in vertices])
            return _as_numbers(stacked, "the vertices", path)
    raise Sd2Error(
        f"{path}: the vertices are a {type(vertices).__name__}",
        "a NumPy array (frames, vertices, 3), or a list with one array per frame",
        "Convert them with numpy.asarray(...) where the file is written",
    )


def _numbers(
    path: Path, entry: dict[Any, Any], content: dict[Any, Any], names: tuple[str, ...]
) -> Any:
    """Numbers under the first of these names, of the person or of all; None where there are none.

    Raises Sd2Error where a text, or an array of anything else, stands there.
    """
    for place in (entry, content):
        for name in names:
            value = place.get(name)
            if isinstance(value, np.ndarray | int | float | str | bytes):
                return _as_numbers(np.asarray(value), name, path)
    return None


def _as_numbers(values: NDArray[Any], name: str, path: Path) -> NDArray[Any]:
    if values.dtype.kind not in "biuf":
        shown = " ".join(str(values).split())[:60]
        raise Sd2Error(f"{path}: {name} is {shown!r}, of type {values.dtype}", "numbers")
    return values


def _place_in_front(raw: RawMesh, entry: dict[Any, Any], path: Path, hints: MeshHints) -> None:
    """Move a body that is centred on its root to where the file's camera has it, and say how."""
    vertices = np.asarray(raw.vertices)
    if vertices.ndim != 3 or not np.isfinite(vertices).any():
        return
    centres = np.nanmean(vertices[:: max(len(vertices) // 16, 1)], axis=1)  # (n, 3)
    shift_m = _shift(entry, len(vertices), path)
    # A hand before a sensor is near it, and wholly in front.
    if shift_m is None and (
        np.nanmax(np.linalg.norm(centres, axis=1)) > AT_ROOT_M or np.nanmin(vertices[..., 2]) > 0
    ):
        return
    if shift_m is not None:
        sampled = shift_m[:: max(len(vertices) // 16, 1)]
        near, far = (np.linalg.norm(centres - one, axis=1) for one in (sampled, 0.0))
        seen = np.isfinite(near)
        if not seen.any() or np.median(near[seen]) < np.median(far[seen]):
            return  # already there, or nowhere
    if hints.distance_m is not None:
        raw.notes.append(
            f"The mesh is centred on the body's root and moved {hints.distance_m:g} m forward;"
            " walking gives no Doppler."
        )
        return
    if shift_m is None:
        shift_m = _weak_perspective(raw, entry, path, hints)
    else:
        shift_m = _with_focal(shift_m, raw, entry, hints)
    if shift_m is not None:
        raw.vertices = (vertices + shift_m[:, None, :]).astype(np.float32)


def _shift(entry: dict[Any, Any], frames: int, path: Path) -> NDArray[np.float64] | None:
    """Place (T, 3) of the root that the file names, or None."""
    name = next((name for name in _SHIFTS if entry.get(name) is not None), None)
    if name is None:
        return None
    shift = np.asarray(entry[name], np.float64)
    if shift.size != 3 * frames:
        raise Sd2Error(f"{path}: {name} has shape {shift.shape}", f"({frames}, 3)")
    shift = shift.reshape(frames, 3)
    return np.where((shift == _NOWHERE).all(axis=1, keepdims=True), np.nan, shift)


def _with_focal(
    shift_m: NDArray[np.float64], raw: RawMesh, entry: dict[Any, Any], hints: MeshHints
) -> NDArray[np.float64]:
    """The place by the focal length that is known best.

    A body twice as far off is seen as large by one of twice the length.
    """
    name = next(name for name in _SHIFTS if entry.get(name) is not None)
    size, taken = _image_size(entry, hints), _SHIFTS[name]
    focal = first_of(entry, FOCAL_NAMES)
    if focal is not None:
        taken = float(np.median(np.asarray(focal, np.float64)))
    elif taken is not None:
        taken = taken * max(size) if size is not None else None
    wanted, how = hints.focal_px, "as given"
    if wanted is None and focal is None and name == "camera" and size is not None:
        wanted, how = float(np.hypot(*size)), "assumed: the image's diagonal"
    if wanted is None or taken is None:
        wanted, how = taken, "the file's"
    placed = shift_m.copy()
    if wanted is not None and taken is not None:
        placed[:, 2] *= wanted / taken
    finite = np.isfinite(shift_m[:, 2])
    length = "" if wanted is None else f", focal length {wanted:.0f} px ({how})"
    raw.notes.append(
        f"The body is placed by the file's camera{length}, at {np.median(placed[finite, 2]):.2f} m."
        " Its depth follows the size in the picture and jitters: `sd2 refine` makes it smooth."
    )
    return placed


def _image_size(entry: dict[Any, Any], hints: MeshHints) -> tuple[int, int] | None:
    """Width and height of the picture, as given or in the file."""
    if hints.image_size is not None:
        return hints.image_size
    size = entry.get("size")  # PHALP: height, width
    if size is None or np.size(size) < 2:
        return None
    height, width = np.asarray(size).reshape(-1, 2)[0]
    return int(width), int(height)


def _weak_perspective(
    raw: RawMesh, entry: dict[Any, Any], path: Path, hints: MeshHints
) -> NDArray[np.float64] | None:
    """Place (T, 3) by a weak-perspective camera, VIBE's in the box or of the whole picture."""
    frames, size = len(np.asarray(raw.vertices)), _image_size(entry, hints)
    camera, boxes = entry.get("pred_cam"), entry.get("bboxes")
    if isinstance(camera, np.ndarray) and isinstance(boxes, np.ndarray):
        boxes = boxes * [1.0, 1.0, _VIBE_CROP, _VIBE_CROP] if boxes.shape == (frames, 4) else boxes
    else:
        camera, boxes = entry.get("orig_cam"), None
    if not isinstance(camera, np.ndarray) or size is None:
        how = "Give its distance (--distance-m)"
        if isinstance(camera, np.ndarray):
            how += ", or the video's size (image_size) to place it by the camera in the file"
        raw.notes.append(
            "The mesh is centred on the body's root, so it stands around the camera and walking "
            f"gives no Doppler. {how}."
        )
        return None
    camera = np.asarray(camera, np.float64)
    if boxes is None and camera.shape == (frames, 4):  # s_x, s_y, t_x, t_y in the whole picture
        camera = camera[:, [0, 2, 3]]
        boxes = np.tile([size[0] / 2, size[1] / 2, size[0], size[0]], (frames, 1))
    boxes = np.asarray(boxes, np.float64)
    if camera.shape != (frames, 3) or boxes.shape != (frames, 4):
        raise Sd2Error(
            f"{path}: pred_cam has shape {camera.shape} and bboxes {boxes.shape}",
            f"({frames}, 3) and ({frames}, 4)",
        )
    if not (np.minimum(camera[:, 0], boxes[:, 2]) > 0).all():
        bad = int(np.argmin(np.minimum(camera[:, 0], boxes[:, 2])))
        raise Sd2Error(
            f"{path}: frame {bad} has camera scale {camera[bad, 0]:g} and box width "
            f"{boxes[bad, 2]:g}",
            "positive ones",
            "Read it without the video's size and give --distance-m",
        )
    focal = float(np.hypot(*size)) if hints.focal_px is None else hints.focal_px
    shift_m = weak_perspective_shift(camera, boxes, size, focal)
    assumed = " (assumed: the image's diagonal)" if hints.focal_px is None else ""
    raw.notes.append(
        f"The body is placed by the file's weak-perspective camera, focal length {focal:.0f} "
        f"px{assumed}, at {np.median(shift_m[:, 2]):.2f} m. Its depth follows the size of the box "
        "and jitters: `sd2 refine` makes it smooth."
    )
    return shift_m


def _no_vertices(path: Path, entry: dict[Any, Any]) -> Sd2Error:
    """Error for what is there instead, of the first person if there is one."""
    first = next((one for one in entry.values() if isinstance(one, dict)), entry)
    return no_vertices(str(path), [str(one) for one in first if isinstance(one, str | int)])


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
