"""Provenance of meshes made by ``sd2 fit``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from sd2core.files.numpy_files import open_zip
from sd2core.files.recording_json import CameraEntry
from sd2core.files.stores import read_attributes


def fit_of(mesh: Path) -> dict[str, Any]:
    """Facts that the fit wrote into a mesh; none if it is another one, or damaged."""
    try:
        content = _read(mesh)
    except Exception:  # a damaged archive fails in many ways
        return {}
    return content if isinstance(content, dict) else {}


def fitted_camera(mesh: Path) -> CameraEntry | None:
    """Camera that a body was fitted with; None for a mesh that is not from ``sd2 fit``."""
    try:
        return CameraEntry.model_validate(fit_of(mesh).get("camera"))
    except ValidationError:
        return None


def fitted_doubts(mesh: Path) -> tuple[str, ...]:
    """Sentences on what of a fitted body is not to be believed; none for other meshes."""
    doubts = fit_of(mesh).get("doubts")
    return tuple(map(str, doubts)) if isinstance(doubts, list) else ()


def _read(mesh: Path) -> Any:
    if mesh.is_dir():
        return read_attributes(mesh).get("fit")
    with open_zip(mesh) as archive:
        if "zarr.json" in archive.namelist():
            return json.loads(archive.read("zarr.json"))["attributes"]["fit"]
        with archive.open("fit.npy") as member:
            return json.loads(str(np.lib.format.read_array(member, allow_pickle=False)))
