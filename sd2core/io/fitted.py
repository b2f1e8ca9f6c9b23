"""Provenance of meshes made by ``sd2 fit``."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from sd2core.files.recording_json import CameraEntry


def fitted_camera(mesh: Path) -> CameraEntry | None:
    """Camera that a body was fitted with; None for a mesh that is not from ``sd2 fit``."""
    try:
        return CameraEntry.model_validate(_said(mesh)["camera"])
    except (OSError, ValueError, KeyError, TypeError, zipfile.BadZipFile, ValidationError):
        return None


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
