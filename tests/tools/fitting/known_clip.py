"""A clip of known motion made in an instant: the coarse body swings its right forearm."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from sd2core.body.model import Body
from sd2core.body.rotations import about
from sd2core.io.mesh import save_mesh
from sd2core.mesh.sequence import MeshSequence
from sd2core.timebase import Timebase
from tools.build_sample.swipes import posed
from tools.fitting.truth import FORMAT, VERSION

TIMES = np.arange(36) / 30.0
STROKES = (
    {"start_s": 0.3, "end_s": 0.6, "label": "down-to-up"},
    {"start_s": 0.6, "end_s": 0.9, "label": "up-to-down"},
)


def waving() -> MeshSequence:
    body = Body.load("low")
    turns = np.tile(np.eye(3), (len(TIMES), len(body.skeleton), 1, 1))
    swing = np.clip((TIMES - 0.3) / 0.6, 0.0, 1.0)
    angle_deg = -70.0 * np.sin(np.pi * swing) ** 2
    turns[:, body.skeleton.index["lowerarm01.R"]] = about(np.array([1.0, 0.0, 0.0]), angle_deg)
    vertices = posed(body, turns) + np.array([0.0, 1.0, 2.5])
    return MeshSequence(vertices, body.faces, Timebase(TIMES))


def standing() -> MeshSequence:
    mesh = waving()
    return replace(mesh, vertices=np.repeat(mesh.read(0, 1), len(TIMES), axis=0))


def write_clip(folder: Path, mesh: MeshSequence, kind: str = "swipes", speed: str = "fast") -> Path:
    folder.mkdir(parents=True)
    save_mesh(mesh, folder / "mesh.zarr")
    meta = {
        "format": FORMAT,
        "version": VERSION,
        "clip": {"name": folder.name, "action": {"kind": kind, "speed": speed, "hand": "R"}},
        "camera": {"width": 640, "height": 480, "focal_px": 600.0},
        "stature_m": 1.76,
        "spans": list(STROKES) if kind == "swipes" else [],
    }
    (folder / "truth.json").write_text(json.dumps(meta))
    return folder
