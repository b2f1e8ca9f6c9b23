"""One mesh file per frame: OBJ, PLY, GLB, through trimesh."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.files.limits import check_regular, check_size, check_there
from sd2core.files.numpy_files import open_npy_file, open_npz_file
from sd2core.files.paths import files_of_pattern
from sd2core.files.texts import reading_as
from sd2core.io.frame_names import frames_among, numbered_frames
from sd2core.io.mesh_arrays import FACE_NAMES, RawMesh
from sd2core.progress import Progress, silent

SURFACE_SUFFIXES = (".obj", ".ply", ".glb")
MOTION_SUFFIXES = (".bvh", ".fbx", ".gltf", ".abc", ".usd", ".usdc", ".usdz")
"""Of files with motion that no library that is installed reads."""
_OUT_OF_BLENDER = (
    "Open it in Blender and export an OBJ for each frame (File → Export → Wavefront, Animation);"
    " then name the folder"
)
_GLB_BYTES = 64
"""Memory of an entry of an array, a matrix of 4 × 4 at most."""


def refuse_motion(path: Path) -> None:
    """Raise Sd2Error for a file with motion that is not read, with the way out."""
    without = " and no surface" if path.suffix.lower() == ".bvh" else ""
    raise Sd2Error(
        f"{path} holds the motion of a skeleton{without} ({path.suffix[1:].upper()}), which is not"
        " read here",
        "vertices for every frame, or the parameters of a body model",
        _OUT_OF_BLENDER
        + (", of a body that the skeleton moves" if without else "")
        + ". Motion as AMASS has it is read with --body-model",
    )


def read_mesh_files(
    path: Path, person: int | str | None = None, progress: Progress = silent
) -> RawMesh:
    """Read one file, all files of a folder, or those that match a pattern, as frames.

    Of several persons, whose numbers are in the names, one is read.
    """
    notes: list[str] = []
    listing = numbered_frames(surface_files(path, notes), person, str(path))
    files = listing.files
    frames: list[NDArray[np.float32]] = []
    faces: NDArray[Any] | None = None
    for number, file in enumerate(files):
        progress(number, len(files))
        vertices, own_faces = read_surface(file)
        if not frames:
            faces = own_faces
        elif len(vertices) != len(frames[0]):
            raise Sd2Error(
                f"{file} has {len(vertices):,} vertices, {files[0].name} has {len(frames[0]):,}",
                "the same vertices in every frame",
                "Export the frames from one fitted mesh; files that do not belong can be left "
                "out with a pattern such as 'body_*.obj'",
            )
        elif not _same_faces(faces, own_faces):
            raise Sd2Error(
                f"{file} has other faces ({_count(own_faces)}) than {files[0].name} "
                f"({_count(faces)})",
                "one topology through all frames",
                "Export the frames from one fitted mesh, with the vertices' order kept",
            )
        frames.append(vertices.astype(np.float32))
    progress(len(files), len(files))
    return RawMesh(
        np.stack(frames), faces, notes=[*notes, *listing.notes], frame_numbers=listing.numbers
    )


def read_surface(path: Path) -> tuple[NDArray[np.float64], NDArray[np.int64] | None]:
    """Vertices (V, 3) and faces (F, 3) of one file, in the order of the file."""
    import trimesh

    kind = path.suffix[1:].lower()
    check_regular(path)
    with reading_as("a mesh", path, "a complete OBJ, PLY or GLB file", "Export it again"):
        content = path.read_bytes()
        if kind == "obj":
            content = _geometry_of_obj(content)
        elif kind == "glb":
            check_size(path, _declared_bytes_of_glb(content), len(content))
            _refuse_animation(path, content)
        # From memory, so that no other file is looked for that this one names.
        loaded = trimesh.load(
            io.BytesIO(content), file_type=kind, process=False, maintain_order=True
        )
        if isinstance(loaded, trimesh.Scene):
            loaded = loaded.to_geometry() if len(loaded.geometry) else trimesh.Trimesh()
        vertices = np.asarray(loaded.vertices, dtype=np.float64)
    if vertices.ndim != 2 or not len(vertices):
        raise Sd2Error(f"{path} holds no vertices", "a mesh or a point cloud", "Export it again")
    faces = np.asarray(getattr(loaded, "faces", np.zeros((0, 3))), dtype=np.int64)
    return vertices, faces if len(faces) else None


def _geometry_of_obj(content: bytes) -> bytes:
    """Vertices and faces of an OBJ file: groups and materials would split one surface."""
    lines = []
    for line in content.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ").splitlines():
        words = line.split()
        if words[:1] == [b"v"]:
            lines.append(line)
        elif words[:1] == [b"f"]:
            lines.append(b" ".join(word.split(b"/")[0] for word in words))
    return b"\n".join(lines) + b"\n"


def _scene_of_glb(content: bytes) -> Any:
    """Description of a GLB file's scene."""
    length = int.from_bytes(content[12:16], "little")
    return json.loads(content[20 : 20 + length])


def _refuse_animation(path: Path, content: bytes) -> None:
    """Raise Sd2Error for a GLB file that moves by itself: it would be read as one still pose."""
    moves = _scene_of_glb(content).get("animations")
    if moves:
        raise Sd2Error(
            f"{path} holds an animation ({len(moves)} in all), which is not read here",
            "a file for every frame, without an animation",
            _OUT_OF_BLENDER,
        )


def _declared_bytes_of_glb(content: bytes) -> int:
    """Memory that the numbers of a GLB file take, and its meshes where they are placed."""
    scene = _scene_of_glb(content)
    counts = [abs(accessor["count"]) for accessor in scene.get("accessors", ())]
    views = sum(abs(view["byteLength"]) for view in scene.get("bufferViews", ()))
    meshes = [
        sum(counts[part["attributes"]["POSITION"]] for part in mesh["primitives"])
        for mesh in scene.get("meshes", ())
    ]
    placed = sum(meshes[node["mesh"]] for node in scene.get("nodes", ()) if "mesh" in node)
    return int(views + _GLB_BYTES * (sum(counts) + placed))


def read_faces(path: Path) -> NDArray[Any]:
    """Read triangles of a ``.npy``, ``.npz`` or mesh file; Sd2Error if it has none."""
    check_there(path, "a file of faces: .npy, .npz or .obj")
    suffix = path.suffix.lower()
    if suffix in SURFACE_SUFFIXES:
        faces = read_surface(path)[1]
        if faces is None:
            raise Sd2Error(f"{path} holds no faces", "a mesh with triangles")
        return faces
    if suffix not in {".npy", ".npz"}:
        raise Sd2Error(f"{path} is no file of faces", "a .npy, .npz or .obj file")
    expected = "a complete .npy or .npz file of plain numbers"
    if suffix == ".npz":
        with open_npz_file(path, "faces", expected) as archive:
            arrays = dict(archive)
    else:
        arrays = {"": np.array(open_npy_file(path, expected))}
    names = [name for name in (*FACE_NAMES, "f") if name in arrays]
    if names or len(arrays) == 1:
        return arrays[names[0]] if names else next(iter(arrays.values()))
    held = ", ".join(arrays) or "nothing"
    raise Sd2Error(f"{path} holds {held}", "an array 'faces' of shape (faces, 3)")


def surface_files(path: Path, notes: list[str]) -> list[Path]:
    """Files of frames in natural order; notes say what is left out."""
    if path.is_file():
        return [path]
    found = path.iterdir() if path.is_dir() else files_of_pattern(path)
    files = [file for file in found if file.suffix.lower() in SURFACE_SUFFIXES]
    files = frames_among(files, notes)
    kinds = sorted({file.suffix.lower() for file in files})
    if path.is_dir() and len(kinds) > 1:
        raise Sd2Error(
            f"{path} holds meshes of several kinds ({', '.join(kinds)})",
            "one kind of file, one file per frame",
            f"Name those that are meant, for example '{path.name}/*{kinds[0]}'",
        )
    if not files:
        raise Sd2Error(
            f"{path} matches no mesh file",
            "one .obj, .ply or .glb file per frame",
            "Check the folder or the pattern",
        )
    return files


def _same_faces(first: NDArray[Any] | None, second: NDArray[Any] | None) -> bool:
    if first is None or second is None:
        return first is second
    return np.array_equal(first, second)


def _count(faces: NDArray[Any] | None) -> str:
    return f"{0 if faces is None else len(faces):,}"
