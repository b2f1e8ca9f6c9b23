from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2core.errors import Sd2Error
from tools.motion_capture.skeletons import read_amc, read_bvh

BVH = """\
HIERARCHY
ROOT hips
{{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT knee
  {{
    OFFSET 0 -40 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {{
      OFFSET 0 -30 0
    }}
  }}
}}
MOTION
Frames: 2
Frame Time: 0.025
{first}
{second}
"""

ASF = """\
:version 1.10
:units
  mass 1.0
  length 0.45
  angle deg
:root
  order TX TY TZ RX RY RZ
  axis XYZ
  position 0 0 0
  orientation 0 0 0
:bonedata
  begin
    id 1
    name thigh
    direction 0 -1 0
    length 9
    axis 0 0 {tilt}  XYZ
    dof rx ry rz
  end
  begin
    id 2
    name shin
    direction 0 -1 0
    length 4.5
    axis 0 0 {tilt}  XYZ
    dof rx
  end
:hierarchy
  begin
    root thigh
    thigh shin
  end
"""

angles = st.floats(-170.0, 170.0)


def bvh(folder: Path, *frames: str) -> Path:
    path = folder / "walk.bvh.gz"
    path.write_bytes(gzip.compress(BVH.format(first=frames[0], second=frames[1]).encode()))
    return path


def test_bvh_turns_what_hangs_on_a_joint(tmp_path: Path) -> None:
    motion, rate_hz = read_bvh(bvh(tmp_path, "1 2 3 0 0 0 0 0 0", "1 2 3 0 90 0 0 -90 0"), 0.01)
    assert rate_hz == pytest.approx(40.0)
    assert motion.names == ("hips", "knee", "knee_end")
    np.testing.assert_allclose(motion.at("hips"), 0.01 * np.array([[1, 2, 3], [1, 2, 3]]))
    np.testing.assert_allclose(motion.at("knee"), [[0.01, -0.38, 0.03], [0.01, 0.02, -0.37]])
    # The knee bends back by as much as the hips turned: the shin hangs straight down again.
    np.testing.assert_allclose(
        motion.at("knee_end"), [[0.01, -0.68, 0.03], [0.01, -0.28, -0.37]], atol=1e-12
    )
    np.testing.assert_allclose(motion.rest_m[:, 1], [0.0, -0.4, -0.7])


def test_bvh_turns_the_last_axis_first(tmp_path: Path) -> None:
    motion, _ = read_bvh(bvh(tmp_path, "0 0 0 90 0 90 0 0 0", "0 0 0 90 90 0 0 0 0"), 1.0)
    # Down stays down about y, then goes to x about z; down goes to -z about x, which z keeps.
    np.testing.assert_allclose(motion.at("knee"), [[40, 0, 0], [0, 0, -40]], atol=1e-12)


@given(rx=angles, ry=angles, rz=angles, knee=st.one_of(st.just(0.0), angles), tilt=angles)
def test_bones_keep_their_lengths_however_they_turn(
    tmp_path_factory: pytest.TempPathFactory,
    rx: float,
    ry: float,
    rz: float,
    knee: float,
    tilt: float,
) -> None:
    folder = tmp_path_factory.mktemp("asf")
    (folder / "a.asf").write_text(ASF.format(tilt=tilt))
    (folder / "a.amc").write_text(
        f":FULLY-SPECIFIED\n1\nroot 1 2 3 {ry} {rz} {rx}\nthigh {rx} {ry} {rz}\nshin {knee}\n"
    )
    motion = read_amc(folder / "a.amc", folder / "a.asf")
    metre = 0.0254 / 0.45
    thigh, shin = (motion.at(name)[0] for name in ("thigh", "shin"))
    root = motion.at("root")[0]
    np.testing.assert_allclose(root, metre * np.array([1, 2, 3]))
    assert np.linalg.norm(thigh - root) == pytest.approx(9 * metre)
    assert np.linalg.norm(shin - thigh) == pytest.approx(4.5 * metre)
    if knee == 0.0:
        np.testing.assert_allclose(shin - thigh, 0.5 * (thigh - root), atol=1e-9)


def test_asf_turns_about_the_bones_own_axes(tmp_path: Path) -> None:
    (tmp_path / "a.asf").write_text(ASF.format(tilt=90))
    (tmp_path / "a.amc").write_text("1\nroot 0 0 0 0 0 0\nthigh 0 90 0\nshin 0\n")
    motion = read_amc(tmp_path / "a.amc", tmp_path / "a.asf")
    # Its y axis, tilted by 90° about z, is -x of the world: about that, down goes to z.
    metre = 0.0254 / 0.45
    np.testing.assert_allclose(motion.at("thigh")[0], [0.0, 0.0, 9 * metre], atol=1e-12)


def test_files_that_hold_no_motion_are_named(tmp_path: Path) -> None:
    (tmp_path / "a.asf").write_text(ASF.format(tilt=0))
    (tmp_path / "a.amc").write_text(":FULLY-SPECIFIED\n")
    with pytest.raises(Sd2Error, match=r"a\.amc holds no frame"):
        read_amc(tmp_path / "a.amc", tmp_path / "a.asf")
    (tmp_path / "b.bvh").write_text("HIERARCHY\n")
    with pytest.raises(Sd2Error, match=r"b\.bvh has no motion"):
        read_bvh(tmp_path / "b.bvh", 1.0)
    with pytest.raises(Sd2Error, match=r"none\.bvh cannot be read"):
        read_bvh(tmp_path / "none.bvh", 1.0)
