"""The denoiser that comes with the program."""

from __future__ import annotations

import numpy as np

from sd2core.denoise.files import describe_model, load_model
from sd2core.denoise.metrics import mean_velocity_error, stands_out
from sd2core.doppler import Synthesizer
from sd2core.files.resources import resource_path
from sd2core.fmcw.processing import doppler_map
from sd2core.io.mesh import load_mesh
from sd2core.io.radar import load_capture
from sd2core.sensor import VelocityAxis, VirtualSensor

PATH = resource_path("denoiser.safetensors")


def test_its_card_says_what_it_is() -> None:
    card = describe_model(PATH)
    assert (card.model, card.trained_on) == ("s4", "simulated")
    assert (card.axis, card.frame_rate_hz, card.null_bins) == (VelocityAxis(), 30.0, (14, 15, 16))
    for part in ("data", "command", "metrics", "limits"):
        assert card.about[part]
    assert PATH.stat().st_size < 2e6


def test_it_brings_the_samples_mean_velocity_nearer_to_its_simulated_radars() -> None:
    """The sample's person, motion and radar simulation are none of those it learnt from.

    Its peak velocity is not brought nearer: the sample's mesh is the true one, and its radar
    sees a smooth surface at one look, whose peak jumps.
    """
    sample = resource_path("swipes.sd2")
    synthetic = Synthesizer(load_mesh(sample / "mesh.zarr"), preset="paper").map(VirtualSensor())
    radar = doppler_map(load_capture(sample / "radar"), v_max_mps=2.0, bins=32, clutter="mean")
    seen = radar.values.T.copy()
    seen[:, [14, 15, 16]] = 0.0
    denoised = load_model(PATH).denoise(synthetic)
    assert denoised.kind == "denoised"
    moving = stands_out(seen, (14, 15, 16))
    before, after = (
        mean_velocity_error(one.values.T[moving], seen[moving], one.axis).mae_mps
        for one in (synthetic, denoised)
    )
    assert np.count_nonzero(moving) > 100
    assert after < 0.8 * before
