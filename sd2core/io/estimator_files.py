"""Files of estimators of bodies: the people in them, each with arrays over their frames.

Some write a person after the other, some a frame after the other, some a file for each. Names are
as the projects publish them; nothing in a file is executed.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from sd2core.files.limits import open_regular
from sd2core.files.numpy_files import read_array_header
from sd2core.files.paths import PICKLE_SUFFIXES
from sd2core.files.texts import read_json
from sd2core.io.body_parameters import PARAMETER_NAMES, first_of, holds_parameters
from sd2core.io.frame_names import frames_among, numbered_frames
from sd2core.io.mesh_arrays import FACE_NAMES, VERTEX_NAMES
from sd2core.io.mesh_clock import is_of_clock
from sd2core.io.mesh_files import SURFACE_SUFFIXES
from sd2core.io.momentum_rig import RIG_NAMES, holds_rig
from sd2core.io.pickles import read_object_arrays, read_pickle, read_torch

Person = dict[Any, Any]

TORCH_SUFFIXES = (".pt", ".pth")
ESTIMATED = (*VERTEX_NAMES, "pred_vertices", "pred_verts")
"""Names of vertices in files of estimators."""
_FRAMES = ("frame", "frames")
"""What TRAM and PromptHMR call the numbers of a person's frames."""
CAMERA_NAMES = ("pred_cam_t", "cam_trans", "camera", "pred_cam", "orig_cam", "bboxes")
FOCAL_NAMES = ("focal_length", "img_focal")
_KEPT = (*ESTIMATED, *PARAMETER_NAMES, *RIG_NAMES, *CAMERA_NAMES, *FOCAL_NAMES)
_SHARED = (*FACE_NAMES, *FOCAL_NAMES, "size")
_FRAME_NUMBERS = ("frame_number", "frame_idx", "frame_id", "frame")
_MIN_VERTICES = 100
"""Fewer are points of a radar, or joints."""
_PEOPLE = ("persons", "people", "outputs")


def people_in(
    path: Path, person: int | str | None, notes: list[str]
) -> tuple[dict[Any, Person], Person]:
    """People of a file or folder by their names there, and what is said of all of them.

    Without people, the second is what the file holds instead.
    """
    if path.is_dir():
        listing = numbered_frames(files_of_people(path, notes), person, str(path))
        notes += listing.notes
        frames = range(len(listing.files)) if listing.numbers is None else listing.numbers.tolist()
        rows = [_content(file) for file in listing.files]
        whom = 0 if person is None else person
        numbered = ((frame, whom, row) for frame, row in zip(frames, rows, strict=True))
        return _gathered(numbered), _shared(rows[0])
    content = _content(path)
    shared = _shared(content)
    if isinstance(info := content.get("video_info"), Mapping):  # of SAM 3D Body in JSON
        shared |= _shared(info)
    people = _people(content)
    return people, shared if people else content


def _shared(content: Mapping[Any, Any]) -> Person:
    """Values that hold for all people and frames."""
    return {
        name: value
        for name, value in content.items()
        if isinstance(name, str) and (name in _SHARED or is_of_clock(name))
    }


def files_of_people(folder: Path, notes: list[str] | None = None) -> list[Path]:
    """Files in a folder of one person in one frame each (SAM 3D Body), in natural order.

    There are none beside surfaces (OBJ, PLY, GLB), which are then the frames.
    """
    held = list(folder.iterdir())
    if any(one.suffix.lower() in SURFACE_SUFFIXES for one in held):
        return []
    files = [one for one in held if one.suffix.lower() == ".npz"]
    return frames_among(files, [] if notes is None else notes)


def holds_bodies(path: Path) -> bool:
    """True for an ``.npy`` of objects (TRAM) or of vertices (T, V, 3), which no radar writes."""
    try:
        with open_regular(path) as file:
            shape, _, kind = read_array_header(file)
    except (OSError, ValueError, EOFError):
        return False
    is_surface = len(shape) == 3 and shape[1] >= _MIN_VERTICES and shape[2] == 3
    return bool(kind.hasobject or (kind.kind == "f" and is_surface))


def _content(path: Path) -> Person:
    """Content of a file by names; an array or a list by itself is one of vertices or frames."""
    suffix = path.suffix.lower()
    content: Any
    if suffix in PICKLE_SUFFIXES:
        content = read_pickle(path)
    elif suffix in TORCH_SUFFIXES:
        content = read_torch(path)
    elif suffix == ".json":
        content = read_json(path, "a JSON of SAM 3D Body: frames, with persons in them")
    else:
        content = read_object_arrays(path)
        content = content.get("", content)
        if isinstance(content, Mapping) and isinstance(content.get("results"), Mapping):  # ROMP
            content = content["results"]
    if isinstance(content, Mapping):
        return _plainly_keyed(content)
    of_frames = isinstance(content, list) and any(isinstance(one, list | dict) for one in content)
    return {"frames": content} if of_frames else {"verts": content}


def _plainly_keyed(content: Mapping[Any, Any]) -> Person:
    """Dictionary with Python's numbers as keys, where a tracker left NumPy's."""
    return {k.item() if isinstance(k, np.generic) else k: v for k, v in content.items()}


def _people(content: Person) -> dict[Any, Person]:
    if _is_person(content):
        return {0: _numbered_alike(content)}
    if isinstance(one := content.get("smpl_params_incam"), Mapping):  # GVHMR
        camera = content.get("K_fullimg")
        focal = {} if camera is None else {"focal_length": np.asarray(camera)[..., 0, 0]}
        return {0: {**one, **focal, "surface_model_type": "smplx"}}
    if isinstance(content.get("frames"), list):
        return _gathered(_rows(enumerate(content["frames"])))
    if isinstance(content.get("people"), Mapping):  # PromptHMR
        content = _plainly_keyed(content["people"])
    people = {
        key: person
        for key, value in content.items()
        if isinstance(key, str | int)
        and isinstance(value, Mapping)
        and _is_person(person := _numbered_alike(_of_camera(value)))
    }
    if people and all(isinstance(key, str) and _of_a_frame(people[key]) for key in people):
        return _gathered(_rows(_numbered(people)))
    if not people:  # PHALP: frames by the names of their pictures
        frames = {k: v for k, v in content.items() if isinstance(v, Mapping) and "smpl" in v}
        return _gathered(_rows(_numbered(frames)))
    return people


def _is_person(entry: Mapping[Any, Any]) -> bool:
    return first_of(entry, ESTIMATED) is not None or holds_parameters(entry) or holds_rig(entry)


def _numbered_alike(entry: Mapping[Any, Any]) -> Person:
    """The person with the numbers of the frames under one name."""
    numbers = first_of(entry, ("frame_ids", *_FRAMES))
    return dict(entry) if numbers is None else {**entry, "frame_ids": numbers}


def _of_camera(entry: Mapping[Any, Any]) -> Person:
    """A person of PromptHMR has the motion as the camera sees it one level down."""
    inner = entry.get("smplx_cam")
    if not isinstance(inner, Mapping):
        return dict(entry)
    return {**entry, **inner, "surface_model_type": "smplx"}


def _of_a_frame(entry: Person) -> bool:
    """True for the people of one picture (ROMP), who have no time of their own."""
    return "track_ids" in entry or "center_preds" in entry or "cam_trans" in entry


def _numbered(frames: Mapping[Any, Any]) -> Iterator[tuple[int, Any]]:
    """Frames by the number in their name; by their order where it has none."""
    for order, (name, frame) in enumerate(frames.items()):
        numbers = re.findall(r"[0-9]+", Path(str(name)).stem)
        yield (int(numbers[-1]) if numbers else order), frame


def _rows(frames: Iterator[tuple[int, Any]]) -> Iterator[tuple[int, Any, Person]]:
    """Frame, person and what is said of them there."""
    for order, frame in frames:
        if isinstance(frame, list):  # as the estimator of SAM 3D Body returns it
            yield from ((order, number, one) for number, one in enumerate(frame))
            continue
        if not isinstance(frame, Mapping):
            continue
        number = first_of(frame, _FRAME_NUMBERS)
        number = order if not isinstance(number, int) else number
        listed = first_of(frame, _PEOPLE)
        if isinstance(listed, list):
            for place, one in enumerate(listed):
                yield number, one.get("person_id", place), _flat(one)
        elif isinstance(smpl := frame.get("smpl"), list):  # PHALP
            yield from _tracked(number, frame, smpl)
        else:
            yield from _split(number, frame)


def _tracked(
    number: int, frame: Mapping[Any, Any], smpl: list[Any]
) -> Iterator[tuple[int, Any, Person]]:
    """People of one picture of PHALP, but for those it does not see and keeps as they were last."""
    absent = [None] * len(smpl)
    names = ("camera", "size", "tracked_time")
    columns = [frame.get("tid", range(len(smpl))), *(frame.get(name, absent) for name in names)]
    for one, track, camera, size, frames_ago in zip(smpl, *columns, strict=False):
        if not frames_ago:
            yield number, int(track), {**one, "camera": camera, "size": size}


def _flat(one: Mapping[Any, Any]) -> Person:
    """A person in JSON, with mesh and camera as arrays."""
    mesh, camera = one.get("mesh"), one.get("camera")
    if not (isinstance(mesh, Mapping) and isinstance(camera, Mapping)):
        return dict(one)
    return {
        "pred_vertices": mesh.get("vertices"),
        "pred_cam_t": first_of(camera, ("translation", "pred_cam_t")),
        "focal_length": camera.get("focal_length"),
    }


def _split(number: int, frame: Mapping[Any, Any]) -> Iterator[tuple[int, Any, Person]]:
    """People of one picture whose arrays have a row for each of them (ROMP), or the one there."""
    vertices = first_of(frame, ESTIMATED)
    if vertices is not None and np.ndim(vertices) == 2:
        yield number, 0, dict(frame)
        return
    held = first_of(frame, (*ESTIMATED, *PARAMETER_NAMES))
    count = 0 if held is None else len(held)
    tracks = frame.get("track_ids")
    for place in range(count):
        row = {k: v[place] for k, v in frame.items() if np.ndim(v) and len(v) == count}
        yield number, place if tracks is None else int(tracks[place]), row


def _gathered(rows: Any) -> dict[Any, Person]:
    """People with arrays over the frames they are in, from rows of frame, person, content."""
    lists: dict[Any, dict[int, Person]] = {}
    for frame, person, row in rows:
        lists.setdefault(person, {})[frame] = row
    people: dict[Any, Person] = {}
    for person, frames in lists.items():
        held = {k: v for k, v in sorted(frames.items()) if _is_person(v)}
        if not held:
            continue
        entry: Person = {"frame_ids": np.array(list(held))}
        for name in (*_KEPT, "size"):
            values = [row.get(name) for row in held.values()]
            if all(value is not None for value in values):
                arrays = [np.asarray(value) for value in values]
                if all(array.shape == arrays[0].shape for array in arrays):
                    entry[name] = np.stack(arrays)
                elif name in ESTIMATED:
                    entry[name] = arrays
        people[person] = entry
    return people
