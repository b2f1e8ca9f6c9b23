"""Provenance of meshes made by ``sd2 fit``."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from sd2core.files.recording_json import CameraEntry

_NOT_OURS = (OSError, ValueError, KeyError, TypeError, zipfile.BadZipFile)


def fitted_camera(mesh: Path) -> CameraEntry | None:
    """Camera that a body was fitted with; None for a mesh that is not from ``sd2 fit``."""
    try:
        return CameraEntry.model_validate(_said(mesh)["camera"])
    except (*_NOT_OURS, ValidationError):
        return None


def fitted_doubts(mesh: Path) -> tuple[str, ...]:
    """Sentences on what of a fitted body is not to be believed; none for other meshes."""
    try:
        return tuple(str(doubt) for doubt in _said(mesh)["doubts"])
    except _NOT_OURS:
        return ()


def _said(mesh: Path) -> dict[str, Any]:
    if mesh.is_dir():
        return _attributes((mesh / "zarr.json").read_bytes())
    with zipfile.ZipFile(mesh) as archive:
        if "zarr.json" in archive.namelist():
            return _attributes(archive.read("zarr.json"))
        with archive.open("fit.npy") as member:
            said: dict[str, Any] = json.loads(
                str(np.lib.format.read_array(member, allow_pickle=False))
            )
            return said


def _attributes(text: bytes) -> dict[str, Any]:
    said: dict[str, Any] = json.loads(text)["attributes"]["fit"]
    return said
