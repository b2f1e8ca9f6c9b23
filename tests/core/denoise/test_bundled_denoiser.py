"""The denoisers that come with the program."""

from __future__ import annotations

import numpy as np
import pytest

from sd2core.body.parts import synthetic_map
from sd2core.denoise.files import LIMBS_MODEL, MAP_MODEL, default_name, describe_model, load_model
from sd2core.denoise.metrics import mean_velocity_error, peak_error, stands_out
from sd2core.doppler import Synthesizer
from sd2core.files.resources import resource_path
from sd2core.fmcw.processing import doppler_map
from sd2core.io.mesh import load_mesh
from sd2core.io.radar import load_capture
from sd2core.maps import DopplerMap
from sd2core.radar_config import CLUTTER
from sd2core.sensor import VelocityAxis, VirtualSensor

NULLED = (14, 15, 16)


@pytest.fixture(scope="module")
def synthetic() -> DopplerMap:
    maker = Synthesizer(load_mesh(resource_path("swipes.sd2") / "mesh.zarr"), preset="paper")
    return synthetic_map(maker, VirtualSensor(), limbs=True)


@pytest.mark.parametrize(("limbs", "name"), [(False, MAP_MODEL), (True, LIMBS_MODEL)])
def test_its_card_says_what_it_is(limbs: bool, name: str) -> None:
    assert default_name(limbs=limbs) == name
    path = resource_path(f"{name}.safetensors")
    card = describe_model(path)
    assert (card.model, card.trained_on) == ("s4", "simulated")
    assert card.inputs == ("kinematics" if limbs else "map")
    assert (card.axis, card.frame_rate_hz, card.null_bins) == (VelocityAxis(), 30.0, NULLED)
    for part in ("data", "command", "metrics", "limits"):
        assert card.about[part]
    assert card.known is not None
    assert card.texture is not None
    # Two networks: both ways, and forward for live frames.
    assert {"validation_mae_mps", "live_validation_mae_mps"} <= card.about["metrics"].keys()
    assert path.stat().st_size < 3e6


@pytest.mark.parametrize("name", [MAP_MODEL, LIMBS_MODEL])
def test_it_brings_the_samples_mean_velocity_nearer_to_its_simulated_radars(
    synthetic: DopplerMap, name: str
) -> None:
    """The sample's person and motion are none of those it learnt from; of the true body."""
    sample = resource_path("swipes.sd2")
    radar = doppler_map(load_capture(sample / "radar"), v_max_mps=2.0, bins=32, clutter=CLUTTER)
    seen = radar.values.T.copy()
    seen[:, NULLED] = 0.0
    denoised = load_model(name).denoise(synthetic)
    assert denoised.kind == "denoised"
    moving = stands_out(seen, NULLED)
    assert np.count_nonzero(moving) > 100
    for error_of in (mean_velocity_error, peak_error):
        before, after = (
            error_of(one.values.T[moving], seen[moving], one.axis).mae_mps
            for one in (synthetic, denoised)
        )
        assert after < 0.95 * before


@pytest.mark.parametrize("name", [MAP_MODEL, LIMBS_MODEL])
def test_it_invents_nothing_where_the_synthetic_map_is_empty(
    synthetic: DopplerMap, name: str
) -> None:
    quiet = ~synthetic.values.any(axis=0)
    assert np.count_nonzero(quiet) > 50
    denoised = load_model(name).denoise(synthetic)
    assert not denoised.values[:, quiet].any()
    assert denoised.values[:, ~quiet].any()
