from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sd2core.body.rig import JOINTS
from sd2core.body.shape import BodyShape, ShapeSpace
from sd2core.errors import Sd2Error
from sd2core.mocap.body_motion import BodyMotion
from tools.motion_capture.__main__ import measure_refining


def test_a_calm_motion_of_another_person_is_measured(tmp_path: Path) -> None:
    times_s = np.arange(60) / 30.0
    vectors = np.zeros((60, len(JOINTS), 3))
    shoulder = next(k for k, joint in enumerate(JOINTS) if joint.name.startswith("shoulder"))
    vectors[:, shoulder, 0] = 0.3 * np.sin(3.0 * times_s)
    shape = BodyShape(np.zeros(len(ShapeSpace())), 1.7)
    still = np.zeros((60, 3))
    calm = BodyMotion("99_01", "cmu99", "learn", shape, vectors, still, 0.01)
    calm.save(tmp_path / "99_01.npz")
    replace(calm, trial="05_01", person="cmu05").save(tmp_path / "05_01.npz")
    short = replace(calm, trial="99_02", vectors=vectors[:20], translation_m=still[:20])
    short.save(tmp_path / "99_02.npz")
    ((trial, (before_mps, after_mps)),) = measure_refining(tmp_path).items()
    assert trial == "99_01"
    assert 0.2 < before_mps < 0.4  # 12 mm of white jitter in depth, and what lasts
    assert after_mps < 0.35 * before_mps
    (tmp_path / "99_01.npz").unlink()
    with pytest.raises(Sd2Error, match="no motion to measure on"):
        measure_refining(tmp_path)
