"""The Momentum Human Rig (MHR) of SAM 3D Body: vertices from parameters, by the user's model file.

The file (``mhr_model.pt``) is a program in TorchScript: it computes by torch's operations and has
no Python. Some of those write files, and a part of a program may run while it is loaded: what could
do either is refused by the program's text, before anything of it runs.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.files.limits import check_size
from sd2core.files.numpy_files import open_zip
from sd2core.files.texts import reading_as
from sd2core.io.body_model import check_frames
from sd2core.progress import Progress, silent

RIG_NAMES = ("mhr_model_params", "shape_params", "expr_params")
"""Pose and proportions, identity, and face, as SAM 3D Body calls them."""
RIG_SUFFIXES = (".pt", ".pth", ".torchscript", ".ts")

_M = 0.01  # the rig's unit is the centimetre
_Y_DOWN_OF_Y_UP = np.array([1.0, -1.0, -1.0], np.float32)
_CHUNK = 32
_REACHES_OUT = re.compile(
    r"\bfrom_file\b|\bsave\b|\brpc_\w+|__setstate__|torch\.classes|\bops\.(?!(?:aten|prim)\b)"
)
_EXPECTED = "the model of MHR in TorchScript (mhr_model.pt)"
_REMEDY = "Get it from the releases of github.com/facebookresearch/MHR"


def holds_rig(entry: Mapping[Any, Any]) -> bool:
    """True for a person in parameters of the rig."""
    return entry.get(RIG_NAMES[0]) is not None


def rigged(
    entry: Mapping[Any, Any], model: Path, source: str, progress: Progress = silent
) -> tuple[NDArray[np.float32], NDArray[np.int64] | None]:
    """Vertices (T, V, 3) about the root in metres, y down, and the model's faces.

    Parameters
    ----------
    entry : mapping
        Parameters of T frames by :data:`RIG_NAMES`.
    model : Path
        TorchScript, called with identity, pose and face; it returns vertices and joints.
    source : str
        File of the parameters, for errors.
    progress : callable
        Called with frames; may raise ``Cancelled``.

    Raises
    ------
    Sd2Error
        Where a parameter is missing, or the file is no such model or would do more than compute.
    """
    missing = [name for name in RIG_NAMES if entry.get(name) is None]
    if missing:
        raise Sd2Error(f"{source} lacks {', '.join(missing)}", ", ".join(RIG_NAMES))
    pose, identity, face = (np.asarray(entry[name], np.float32) for name in RIG_NAMES)
    pose = pose.reshape(-1, pose.shape[-1])
    frames = len(pose)
    identity, face = (one.reshape(frames, -1) for one in (identity, face))
    program = _loaded(model)
    import torch

    posed: NDArray[np.float32] = np.empty((0, 0, 3), np.float32)
    for start in range(0, frames, _CHUNK):
        progress(start, frames)
        part = slice(start, start + _CHUNK)
        inputs = [torch.from_numpy(one[part].copy()) for one in (identity, pose, face)]
        try:
            with torch.no_grad():
                made = program(*inputs)[0].numpy()
        except (RuntimeError, TypeError, AttributeError, IndexError) as error:
            raise Sd2Error(
                f"{model} makes no vertices of the parameters in {source}"
                f" ({str(error).strip().splitlines()[-1]})",
                _EXPECTED,
                _REMEDY,
            ) from error
        if made.ndim != 3 or made.shape[::2] != (len(inputs[0]), 3):
            raise Sd2Error(f"{model} makes an array of shape {made.shape}", _EXPECTED, _REMEDY)
        if not start:
            check_frames(frames, made.shape[1])
            posed = np.empty((frames, *made.shape[1:]), np.float32)
        posed[part] = _M * made * _Y_DOWN_OF_Y_UP
    progress(frames, frames)
    named = dict(program.named_buffers())
    faces = next((named[name] for name in named if name.rpartition(".")[2] == "faces"), None)
    return posed, None if faces is None else faces.numpy().astype(np.int64)


def _loaded(path: Path) -> Any:
    """The program of a file, if it does nothing but compute."""
    if path.suffix.lower() not in RIG_SUFFIXES or not path.is_file():
        raise Sd2Error(f"{path} is no model of MHR", _EXPECTED, _REMEDY)
    with reading_as("a model of MHR", path, _EXPECTED, _REMEDY), open_zip(path) as archive:
        texts = [one for one in archive.infolist() if one.filename.endswith(".py")]
        check_size(path, sum(one.file_size for one in texts), path.stat().st_size)
        if not any("/code/" in one.filename for one in texts):
            raise Sd2Error(f"{path} is no program of torch", _EXPECTED, _REMEDY)
        matches = [_REACHES_OUT.search(archive.read(one).decode()) for one in texts]
    calls = sorted({one[0] for one in matches if one is not None})
    if calls:
        raise Sd2Error(
            f"{path} is a program that does more than compute ({', '.join(calls)})",
            _EXPECTED,
            _REMEDY,
        )
    import torch

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # torch prefers other programs
            return torch.jit.load(path, map_location="cpu").eval()
    except RuntimeError as error:
        raise Sd2Error(
            f"{path} cannot be loaded ({str(error).strip().splitlines()[0]})", _EXPECTED, _REMEDY
        ) from error
