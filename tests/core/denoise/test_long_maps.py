"""A long map denoised block by block is the map denoised as a whole."""

from __future__ import annotations

import numpy as np
import pytest
from denoisers import trained
from numpy.typing import NDArray

from sd2core.denoise import live
from sd2core.denoise.resample_to_model import clips
from sd2core.maps import DopplerMap
from sd2core.mesh.presence import Presence
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase

FRAMES = 3000


def _map(times_s: NDArray[np.float64]) -> DopplerMap:
    rng = np.random.default_rng(3)
    present = np.ones(len(times_s), bool)
    present[1400:1450] = False
    values = 0.05 * rng.random((32, len(times_s))).astype(np.float32)
    values[[14, 15, 16]] = 0
    return DopplerMap(
        values,
        VelocityAxis(),
        Timebase(times_s),
        "synthetic",
        null_bins=(14, 15, 16),
        present=present,
    )


_TIMES = {
    "at the model's rate": np.arange(FRAMES) / 30.0,
    "25 a second": np.arange(FRAMES) / 25.0,
    "60 a second": np.arange(FRAMES) / 60.0,
    "uneven": np.arange(FRAMES) / 30.0 + 0.012 * np.sin(np.arange(FRAMES)),
    "with a break": np.arange(FRAMES) / 30.0 + 9.0 * (np.arange(FRAMES) > 700),
}


@pytest.mark.one_in(5)
@pytest.mark.parametrize("times_s", _TIMES.values(), ids=_TIMES.keys())
@pytest.mark.parametrize("model", ["s4", "unet"])
def test_blocks_give_what_the_whole_map_gives(
    model: str, times_s: NDArray[np.float64], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(live, "_BLOCK", 512)
    denoiser = trained(model)
    doppler = _map(times_s)
    expected = denoiser.denoise(doppler).values.T
    found = np.full_like(expected, np.nan)
    widest = 0

    def read(start: int, stop: int) -> NDArray[np.float32]:
        nonlocal widest
        widest = max(widest, stop - start)
        return np.ascontiguousarray(doppler.values[:, start:stop].T)

    following = 0

    def write(first: int, energies: NDArray[np.float32]) -> None:
        nonlocal following
        assert first >= following
        following = first + len(energies)
        found[first:following] = energies

    there = Presence.of(doppler.present, FRAMES).present
    runs = clips(doppler.times_s, there, denoiser.card.frame_rate_hz)
    live.denoise_long(denoiser, runs, doppler.times_s, read, write)
    np.testing.assert_array_equal(np.isnan(found).all(axis=1), ~there)
    np.testing.assert_allclose(
        found[there], expected[there], rtol=1e-4, atol=1e-6 * float(expected.max())
    )
    assert widest <= 2 * 512 + 4 * 72
