"""Doppler maps of the sample are, to the last bit, those of the kept file.

``python tests/core/doppler/test_kept_maps.py`` writes the file again, which is only right where
maps are meant to change.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import sd2core as sd2
from sd2core.doppler import PRESETS, SynthesisOptions
from sd2core.numerics.compiled import warm_up

KEPT = Path(__file__).with_name("kept_maps.npz")
AT_THE_CAMERA = (0.0, 0.0, 0.0)
TO_THE_SIDE = (-1.2, -0.4, 0.7)
PAPER = PRESETS["paper"]

CASES: dict[str, tuple[SynthesisOptions, tuple[float, float, float], int]] = {
    "paper": (PAPER, AT_THE_CAMERA, 90),
    "paper from the side": (PAPER, TO_THE_SIDE, 40),
    "facing": (replace(PAPER, visibility="facing"), TO_THE_SIDE, 450),
    "depth": (replace(PAPER, visibility="depth", mask_stride=2), TO_THE_SIDE, 90),
    "everything counts": (replace(PAPER, visibility="none", null_bins=()), AT_THE_CAMERA, 450),
    "area": (replace(PAPER, visibility="facing", weight="area"), TO_THE_SIDE, 90),
    "projected, oversampled": (
        replace(PAPER, visibility="facing", weight="projected", oversampling=3), TO_THE_SIDE, 90,
    ),
    "folded back, smoothed paths": (
        replace(
            PAPER,
            visibility="facing",
            beyond="wrap",
            axis=sd2.VelocityAxis(bins=24, v_max_mps=0.6),
            null_bins=(11, 12),
            trajectory_smoothing_s=0.02,
            range_law="frame",
        ),
        AT_THE_CAMERA, 90,
    ),
    "vid2doppler": (PRESETS["vid2doppler"], AT_THE_CAMERA, 40),
}  # fmt: skip


def computed(name: str, sample: Path) -> NDArray[np.float32]:
    """Map of one case, shape (bins, frames)."""
    # Kernels that are compiled in another order may be inlined, and so rounded, otherwise.
    warm_up()
    options, position_m, frames = CASES[name]
    mesh = sd2.load_mesh(sample)
    synthesizer = sd2.Synthesizer(mesh, options, threads=1)
    return synthesizer.stretch(sd2.VirtualSensor(position_m=position_m), 0, frames).values


def sample_mesh() -> Path:
    return Path(__file__).resolve().parents[3] / "resources" / "swipes.sd2" / "mesh.zarr"


@pytest.fixture(scope="module")
def kept() -> Iterator[np.lib.npyio.NpzFile]:
    with np.load(KEPT) as maps:
        yield maps


@pytest.mark.one_in(3)
@pytest.mark.parametrize("name", CASES)
def test_map_is_bit_identical(name: str, kept: np.lib.npyio.NpzFile) -> None:
    made = computed(name, sample_mesh())
    assert made.dtype == kept[name].dtype
    assert made.tobytes() == kept[name].tobytes()


def test_cases_are_of_different_maps_with_something_in_them(kept: np.lib.npyio.NpzFile) -> None:
    assert sorted(kept.files) == sorted(CASES)
    assert len({kept[name].tobytes() for name in CASES}) == len(CASES)
    assert all(np.count_nonzero(kept[name]) > kept[name].size / 10 for name in CASES)


if __name__ == "__main__":
    np.savez_compressed(KEPT, **{name: computed(name, sample_mesh()) for name in CASES})
