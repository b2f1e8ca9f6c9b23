"""Output of body-estimation tools: VIBE, WHAM, 4D-Humans, and pickles with ``verts``.

The first two store, per person, SMPL vertices and the numbers of the video
frames they belong to. WHAM's stand in the camera's frame. VIBE's are centred
on the body's root, beside a weak-perspective camera per frame.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.files.limits import check_size
from sd2core.io.frame_names import chosen_person
from sd2core.io.mesh_arrays import FACE_NAMES, VERTEX_NAMES, RawMesh, no_vertices
from sd2core.io.mesh_clock import clock_of
from sd2core.io.pickles import read_pickle

_AT_ROOT_M = 0.6


def read_model_output(
    path: Path,
    person: int | str | None = None,
    image_size: tuple[int, int] | None = None,
    focal_px: float | None = None,
    distance_m: float | None = None,
) -> RawMesh:
    """Read vertices from a pickle or joblib file without executing anything in it.

    Parameters
    ----------
    path : Path
    person, image_size, focal_px, distance_m
        As for :func:`sd2core.io.mesh.load_mesh`, which moves the mesh by the distance: where it is
        given, the mesh is not placed here.

    Raises
    ------
    Sd2Error
        If the file holds no vertices, something that is not plain data, no such person, or a camera
        that does not fit its frames.
    """
    content = read_pickle(path)
    content = _plain_keys(content) if isinstance(content, dict) else {"verts": content}
    notes: list[str] = []
    entry = content
    if _vertices_of(content) is None:
        people = {
            key: value
            for key, value in content.items()
            if isinstance(key, str | int)
            and isinstance(value, dict)
            and _vertices_of(value) is not None
        }
        if not people:
            first = next((one for one in content.values() if isinstance(one, dict)), content)
            raise no_vertices(str(path), [str(one) for one in first if isinstance(one, str | int)])
        entry = _choose(path, people, person, notes)
    raw = RawMesh(vertices=_stacked(_vertices_of(entry), path), notes=notes)
    raw.faces = _numbers(path, entry, content, FACE_NAMES)
    shape = np.shape(raw.vertices)
    clock = clock_of([entry, content], shape[0] if shape else 0, str(path))
    raw.times_s, raw.frames_per_s = clock.times_s, clock.frames_per_s
    raw.frame_numbers = clock.frame_numbers
    notes += clock.notes
    _place_in_front(raw, entry, path, image_size, focal_px, distance_m)
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
        c_x, c_y, width and height in pixels; VIBE's are square.
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


def _plain_keys(content: dict[Any, Any]) -> dict[Any, Any]:
    """The same with Python's numbers as keys, where a tracker left NumPy's."""
    return {
        key.item() if isinstance(key, np.generic) else key: value for key, value in content.items()
    }


def _vertices_of(entry: dict[Any, Any]) -> Any:
    return next((entry[name] for name in VERTEX_NAMES if entry.get(name) is not None), None)


def _choose(
    path: Path, people: dict[Any, Any], person: int | str | None, notes: list[str]
) -> dict[Any, Any]:
    held = {key: _vertices_of(value) for key, value in people.items()}
    lengths = {
        key: len(one if isinstance(one, list | tuple) else _stacked(one, path))
        for key, one in held.items()
    }
    key = chosen_person(lengths, person, str(path), notes)
    chosen: dict[Any, Any] = people[key]
    return chosen


def _stacked(vertices: Any, path: Path) -> NDArray[Any]:
    """One array (T, V, 3) out of an array or a list with one array per frame."""
    if isinstance(vertices, np.ndarray):
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
            found = place.get(name)
            if isinstance(found, np.ndarray | int | float | str | bytes):
                return _as_numbers(np.asarray(found), name, path)
    return None


def _as_numbers(values: NDArray[Any], name: str, path: Path) -> NDArray[Any]:
    if values.dtype.kind not in "biuf":
        shown = " ".join(str(values).split())[:60]
        raise Sd2Error(f"{path}: {name} is {shown!r}, of type {values.dtype}", "numbers")
    return values


def _place_in_front(
    raw: RawMesh,
    entry: dict[Any, Any],
    path: Path,
    image_size: tuple[int, int] | None,
    focal_px: float | None,
    distance_m: float | None,
) -> None:
    vertices = np.asarray(raw.vertices)
    if vertices.ndim != 3 or not np.isfinite(vertices).any():
        return
    centres = np.nanmean(vertices[:: max(len(vertices) // 16, 1)], axis=1)  # (n, 3)
    if np.nanmax(np.linalg.norm(centres, axis=1)) > _AT_ROOT_M:
        return
    camera, boxes = entry.get("pred_cam"), entry.get("bboxes")
    if distance_m is not None:
        raw.notes.append(
            f"The mesh is centred on the body's root and moved {distance_m:g} m forward; walking "
            "gives no Doppler."
        )
        return
    have_camera = isinstance(camera, np.ndarray) and isinstance(boxes, np.ndarray)
    if not have_camera or image_size is None:
        how = "Give its distance (--distance-m)"
        if have_camera:
            how += ", or the video's size (image_size) to place it by the camera in the file"
        raw.notes.append(
            "The mesh is centred on the body's root, so it stands around the camera and walking "
            f"gives no Doppler. {how}."
        )
        return
    camera, boxes = np.asarray(camera, np.float64), np.asarray(boxes, np.float64)
    if camera.shape != (len(vertices), 3) or boxes.shape != (len(vertices), 4):
        raise Sd2Error(
            f"{path}: pred_cam has shape {camera.shape} and bboxes {boxes.shape}",
            f"({len(vertices)}, 3) and ({len(vertices)}, 4)",
        )
    if not (np.minimum(camera[:, 0], boxes[:, 2]) > 0).all():
        bad = int(np.argmin(np.minimum(camera[:, 0], boxes[:, 2])))
        raise Sd2Error(
            f"{path}: frame {bad} has camera scale {camera[bad, 0]:g} and box width "
            f"{boxes[bad, 2]:g}",
            "positive ones",
            "Read it without the video's size and give --distance-m",
        )
    focal = float(np.hypot(*image_size)) if focal_px is None else focal_px
    shift_m = weak_perspective_shift(camera, boxes, image_size, focal)
    raw.vertices = (vertices + shift_m[:, None, :]).astype(np.float32)
    assumed = " (assumed: the image's diagonal)" if focal_px is None else ""
    raw.notes.append(
        f"The body is placed by the file's weak-perspective camera, focal length {focal:.0f} "
        f"px{assumed}, at {np.median(shift_m[:, 2]):.2f} m. Its depth follows the size of the box "
        "and jitters: smooth the trajectory before reading velocities along the line of sight."
    )
