"""Small denoisers and maps for tests."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from sd2core.denoise.card import KINEMATICS_COLUMNS, ModelCard, maps_in
from sd2core.denoise.live import TrainedDenoiser
from sd2core.denoise.registry import build
from sd2core.denoise.scaling import Compression, Scaling
from sd2core.maps import DopplerMap
from sd2core.mesh.vertex_parts import KINEMATICS
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase

SMALL: dict[str, dict[str, Any]] = {
    "s4": {"channels": 8, "depth": 2, "state_size": 8, "bidirectional": False},
    "s4d": {"channels": 8, "depth": 2, "state_size": 8, "bidirectional": False},
    "s4-serial": {"channels": 4, "depth": 2, "state_size": 4},
    "gru": {"channels": 8},
    "unet": {"channels": 2},
    "swin": {"channels": 16},
    "none": {},
    "median": {},
    "wiener": {},
    "ridge": {},
}
"""Every model, as small as serves a test."""

CAUSAL = ("s4", "s4d", "s4-serial", "gru", "none", "median", "wiener", "ridge")
WINDOWED = ("unet", "swin")


def trained(name: str, seed: int = 0, bins: int = 32, **card: Any) -> TrainedDenoiser:
    """A model with random weights, none of them zero, and answers that are mostly positive."""
    torch.manual_seed(seed)
    parts = card.get("parts", ())
    more = KINEMATICS_COLUMNS if KINEMATICS in parts else 0
    network = build(name, bins, maps_in(parts), more, **SMALL[name])
    with torch.no_grad():
        for parameter in network.parameters():
            parameter += 0.3 * torch.randn_like(parameter)
        inner = getattr(network, "network", network)
        if hasattr(inner, "head"):
            inner.head.bias += 5.0  # negative answers are no energy
    about = {
        "model": name,
        "options": SMALL[name],
        "scaling": Scaling(Compression(0.01), Compression(1e-4, 0.25), more=more),
        "axis": VelocityAxis(bins, 2.0),
        "null_bins": (14, 15, 16) if bins == 32 else (),
        "frame_rate_hz": 30.0,
        "trained_on": "simulated",
    }
    return TrainedDenoiser(network, ModelCard(**(about | card)))


def energies(frames: int, seed: int = 0, bins: int = 32) -> NDArray[np.float32]:
    """Something like a synthetic map, (frames, bins)."""
    random = np.random.default_rng(seed)
    return (0.02 * random.exponential(size=(frames, bins))).astype(np.float32)


def synthetic_map(values: NDArray[np.float32], rate_hz: float = 30.0, **more: Any) -> DopplerMap:
    """Of energies (frames, bins)."""
    about = {"null_bins": (14, 15, 16), "unit": "share of vertices"} | more
    values = values.copy()
    values[:, list(about["null_bins"])] = 0.0
    about.setdefault("timebase", Timebase.regular(len(values), rate_hz, start_s=1.5))
    return DopplerMap(values.T, VelocityAxis(values.shape[1], 2.0), kind="synthetic", **about)
