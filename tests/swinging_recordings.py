"""Recordings whose mesh and radar are known."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from sd2core.io.mesh import save_mesh
from sd2core.io.radar.infineon import write_capture
from sd2core.mesh.sequence import MeshSequence
from sd2core.radar_config import PAPER_RADAR
from sd2core.recording.recording import Recording, Span
from sd2core.timebase import Timebase

RATE_HZ = 30.0
FRAMES = 120


def recording(
    folder: Path, *, offset_s: float = 0.0, radar_frames: int = FRAMES, rate_hz: float = RATE_HZ,
    simulated: bool = True, radar: bool = True, silent_receivers: int = 0,
) -> Recording:  # fmt: skip
    """An octahedron that swings along the line of sight, before a radar that sees noise.

    Its first receiver does; ``silent_receivers`` more receive nothing.
    """
    folder.mkdir()
    times_s = np.arange(FRAMES) / rate_hz
    corners = 0.3 * np.concatenate([np.eye(3), -np.eye(3)])
    vertices = np.repeat(corners[None], FRAMES, axis=0).astype(np.float32)
    vertices[:, :, 2] += (2.0 + 0.2 * np.sin(2 * np.pi * times_s))[:, None].astype(np.float32)
    octants = [(x, y, z) for x in (0, 3) for y in (1, 4) for z in (2, 5)]
    faces = np.array([o if sum(k > 2 for k in o) % 2 == 0 else o[::-1] for o in octants], np.int32)
    save_mesh(MeshSequence(vertices, faces, Timebase(times_s)), folder / "mesh.npz")
    if radar:
        samples = np.random.default_rng(len(folder.name)).integers(
            1800, 2200,
            (radar_frames, 1, PAPER_RADAR.chirps_per_frame, PAPER_RADAR.samples_per_chirp),
        )  # fmt: skip
        nothing = np.full((radar_frames, silent_receivers, *samples.shape[2:]), 2048)
        write_capture(
            folder / "radar", np.concatenate([samples, nothing], axis=1).astype(np.uint16),
            replace(PAPER_RADAR, receivers=1 + silent_receivers),
            np.arange(radar_frames) / RATE_HZ, simulated=simulated,
        )  # fmt: skip
    return Recording.create(
        folder,
        mesh=folder / "mesh.npz",
        radar=folder / "radar" if radar else None,
        radar_offset_s=offset_s,
        spans=(Span(start_s=1.0, end_s=2.0, label="swing"),),
    )
