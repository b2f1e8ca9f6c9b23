"""Small recordings as Acconeer's exploration tool writes them, of a made-up target."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import h5py
import numpy as np

FRAMES, SWEEPS, POINTS = 6, 16, 5
SWEEP_HZ, STEP_M = 2000.0, 0.0025
PARTS = np.dtype([("real", "<i2"), ("imag", "<i2")])


def sweeps(velocity_mps: float) -> np.ndarray:
    """A target at point 3 that approaches, (frames, sweeps, points); the phase is the distance."""
    at_s = np.arange(FRAMES)[:, None] * 0.1 + np.arange(SWEEPS) / SWEEP_HZ
    turns = -2.0 * velocity_mps * at_s * 60.5e9 / 299_792_458.0
    values = np.zeros((FRAMES, SWEEPS, POINTS), np.complex128)
    values[:, :, 3] = 3000.0 * np.exp(2j * np.pi * turns)
    return values


def write_a121(path: Path, velocity_mps: float = 0.8, **changes: Any) -> Path:
    """A recording; ``changes`` replace datasets by their place, None leaves one out."""
    values = sweeps(velocity_mps)
    frame = np.zeros(values.shape, PARTS)
    frame["real"], frame["imag"] = np.rint(values.real), np.rint(values.imag)
    sensor = {
        "sweep_rate": SWEEP_HZ,
        "frame_rate": 10.0,
        "sweeps_per_frame": SWEEPS,
        "subsweeps": [
            {"start_point": 200, "num_points": 2, "step_length": 24, "profile": "PROFILE_3"},
            {"start_point": 300, "num_points": 3, "step_length": 24, "profile": "PROFILE_5"},
        ],
    }
    entry = "sessions/session_0/group_0/entry_0"
    content: dict[str, Any] = {
        "generation": "a121",
        "server_info": json.dumps({"ticks_per_second": 1000}),
        "sessions/session_0/session_config": json.dumps({"groups": [{"1": sensor}]}),
        f"{entry}/metadata": json.dumps({"base_step_length_m": STEP_M, "max_sweep_rate": 3000.0}),
        f"{entry}/sensor_id": 1,
        f"{entry}/result/frame": frame,
        f"{entry}/result/tick": 500 + 100 * np.arange(FRAMES),
        f"{entry}/result/data_saturated": np.zeros(FRAMES, bool),
    }
    with h5py.File(path, "w") as file:
        for place, value in (content | changes).items():
            if value is not None:
                file[place] = value
    return path
