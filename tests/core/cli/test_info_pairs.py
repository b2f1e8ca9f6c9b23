"""``sd2 info`` of pairs, and what else may not be done with them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from cli_outcome import Sd2

from sd2core.io.kinds import kind_of
from sd2core.pairs.store import PairWriter, Take
from sd2core.sensor import VelocityAxis


@pytest.fixture
def pairs(tmp_path: Path) -> Path:
    path = tmp_path / "pairs.zarr"
    writer = PairWriter(
        path,
        kind="simulated",
        axis=VelocityAxis(8, 2.0),
        null_bins=(3, 4),
        frame_rate_hz=10.0,
        labels=("background", "swipe"),
        provenance={"seed": 3},
    )
    for subject, placement in (("s1", 0), ("s1", 1), ("s2", 0)):
        values = np.ones((300, 8), np.float32)
        label = np.zeros(300, np.int8)
        label[:75] = 1
        sensor_m = np.array([3.0 * placement, 0.0, 4.0 * placement])
        writer.append(
            Take(subject, "1", values, values, np.arange(300) / 10.0, label, sensor_m, placement)
        )
    return path


def test_pairs_say_who_how_much_and_from_where(sd2: Sd2, pairs: Path) -> None:
    assert kind_of(pairs) == "pairs"
    out = sd2("info", pairs).out
    for text in (
        "a simulated radar",
        "3 of 900 frames, 10 frames/s",
        "s1 1.0 min, s2 0.5 min",
        "background 75%, swipe 25%",
        "2 for each take, up to 5.00 m from the camera",
        "3, 4: -0.5 to 0.5 m/s",
    ):
        assert text in out
    data = json.loads(sd2("info", pairs, "--json").out)
    assert data["frames_of_label"] == {"background": 675, "swipe": 225}
    assert data["provenance"] == {"seed": 3}


def test_pairs_are_no_mesh(sd2: Sd2, pairs: Path) -> None:
    outcome = sd2("synth", pairs, "--out", pairs.parent / "map.npz")
    assert outcome.code == 1
    assert "Traceback" not in outcome.err
