from __future__ import annotations

import subprocess
import sys
from typing import Any

import pytest

from sd2core.doppler import PRESETS, SynthesisOptions, Synthesizer
from sd2core.errors import Sd2Error
from sd2core.sensor import VelocityAxis


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"visibility": "some"}, "visibility is 'some'"),
        ({"depth_resolution": 64}, "depth_resolution is 64"),
        ({"mask_stride": 0}, "mask_stride is 0"),
        ({"weight": "mass"}, "weight is 'mass'"),
        ({"beyond": "keep"}, "beyond is 'keep'"),
        ({"range_law": "clip"}, "range_law is 'clip'"),
        ({"velocity": "forward"}, "velocity is 'forward'"),
        ({"axis": VelocityAxis(255)}, "255 bins"),
        ({"null_bins": (32,)}, r"null_bins is \(32,\)"),
        ({"null_bins": (-1,)}, r"null_bins is \(-1,\)"),
        ({"range_exponent": -1.0}, "range_exponent is -1"),
        ({"range_exponent": 9.0}, "range_exponent is 9"),
        ({"reference_range_m": 0.0}, "reference_range_m is 0"),
        ({"reference_range_m": 2000.0}, "reference_range_m is 2000"),
        ({"time_sigma_s": float("nan")}, "time_sigma_s is nan"),
        ({"oversampling": 0}, "oversampling is 0"),
        ({"oversampling": 2, "velocity": "vid2doppler"}, "oversampling is 2 with vid2doppler"),
    ],
)
def test_nonsense_is_refused(wrong: dict[str, Any], words: str) -> None:
    with pytest.raises(Sd2Error, match=words):
        SynthesisOptions(**wrong)


def test_null_bins_are_sorted_and_unique() -> None:
    assert SynthesisOptions(null_bins=(16, 14, 16)).null_bins == (14, 16)


def test_unknown_preset() -> None:
    with pytest.raises(Sd2Error, match="The preset is 'papr'"):
        Synthesizer(None, "papr")  # type: ignore[arg-type]


def test_presets_load_without_numba() -> None:
    code = (
        "import sys; from sd2core.doppler import PRESETS;"
        "assert not {'numba', 'scipy'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
    assert list(PRESETS) == ["paper", "vid2doppler"]
