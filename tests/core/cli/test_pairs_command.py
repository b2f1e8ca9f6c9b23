"""``sd2 pairs mars``."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from cli_outcome import Sd2

from sd2core.pairs.store import read_pairs


@pytest.mark.slow
def test_a_real_recording_in_part(sd2: Sd2, shared_data: Path, tmp_path: Path) -> None:
    """Fifty rows of a real recording, so that it takes a second."""
    source = shared_data / "paired" / "mars_subject4"
    folder = tmp_path / "mars_subject4"
    folder.mkdir()
    rows = (source / "kinect_data_validate.csv").read_text().splitlines()
    (folder / "kinect_data_validate.csv").write_text("\n".join(rows[:51]))
    heading, *points = (source / "radar_data_validate.csv").read_text().splitlines()
    numbers = list(dict.fromkeys(point.split(",")[0] for point in points))[:50]
    kept = [point for point in points if point.split(",")[0] in numbers]
    (folder / "radar_data_validate.csv").write_text("\n".join([heading, *kept]))
    out = tmp_path / "pairs.zarr"

    made = sd2("pairs", "mars", folder, "--out", out, "--json", "--bins", "16", "--v-max", "1.5")
    assert made.code == 0, made.err
    told = json.loads(made.out)
    pairs = read_pairs(out)
    assert told["kind"] == pairs.kind == "real"
    assert told["subjects"]["4"]["frames"] == pairs.frames >= 50
    assert 0.0 < told["subjects"]["4"]["residual_m"] < 0.03
    radar = told["subjects"]["4"]["radar"]
    np.testing.assert_array_equal(pairs.takes[0].sensor_position_m, radar["position_m"])
    assert (pairs.axis.bins, pairs.axis.v_max_mps) == (16, 1.5)

    again = sd2("pairs", "mars", folder, "--out", out, "--bins", "16", "--v-max", "1.5")
    assert again.code == 0
    assert "1 take," in again.out
    other = sd2("pairs", "mars", folder, "--out", out, "--target", "intensity")
    assert other.code == 1
    assert "was begun with" in other.err


def test_what_is_no_recording_is_explained(sd2: Sd2, tmp_path: Path) -> None:
    outcome = sd2("pairs", "mars", tmp_path / "nowhere", "--out", tmp_path / "pairs.zarr")
    assert outcome.code == 1
    assert "There is no folder" in outcome.err
    assert not (tmp_path / "pairs.zarr").exists()
