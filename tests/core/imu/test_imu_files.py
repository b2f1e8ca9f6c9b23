"""Samples of inertial sensors come back from files; tables of real ones open, or say why not."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sd2core.errors import Sd2Error
from sd2core.imu.files import SUFFIXES, read_signals, write_signals
from sd2core.imu.signals import InertialSignals
from sd2core.io.imu_columns import STANDARD_GRAVITY_MPS2

HEADING = "time_s,acc_x_mps2,acc_y_mps2,acc_z_mps2,gyr_x_radps,gyr_y_radps,gyr_z_radps"
ROWS = "0.00,1,2,3,4,5,6\n0.01,1,2,3,4,5,6\n0.02,1,2,3,4,5,6\n"


@settings(max_examples=10)
@given(st.integers(1, 40), st.integers(0, 2**32 - 1))
@pytest.mark.parametrize("ending", SUFFIXES)
def test_what_is_written_is_read(
    tmp_path_factory: pytest.TempPathFactory, ending: str, samples: int, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    acceleration, turn_rate = 10.0 ** rng.integers(-6, 4) * rng.normal(size=(2, samples, 3))
    acceleration[rng.random(samples) < 0.2] = np.nan
    meta = {
        "at": "left-wrist", "axes": "x along the bone", "cutoff_hz": 6.0, "simulated": True,
        "person": "12", "errors": {"range": [1, 2.5]}, "source": "a = b # c: d",
    }  # fmt: skip
    signals = InertialSignals(12.5 + np.arange(samples) / 128, acceleration, turn_rate, meta)
    path = tmp_path_factory.mktemp("imu") / f"wrist{ending}"
    write_signals(path, signals)
    again = read_signals(path)
    for name in ("times_s", "acceleration_mps2", "turn_rate_radps"):
        np.testing.assert_allclose(getattr(again, name), getattr(signals, name), rtol=1e-8)
    assert again.simulated
    assert {name: again.meta[name] for name in meta} == meta


def test_files_state_the_axes(tmp_path: Path) -> None:
    meta = {"at": "left-wrist", "axes": "x along the bone\nz out", "simulated": True}
    signals = InertialSignals(np.arange(3) / 100, np.ones((3, 3)), np.full((3, 3), np.nan), meta)
    for ending in (".csv", ".sto"):
        write_signals(tmp_path / f"w{ending}", signals)
    lines = (tmp_path / "w.csv").read_text(encoding="utf-8").splitlines()
    assert lines[:4] == [
        "# at: left-wrist", "# axes: x along the bone z out", "# simulated: true", HEADING
    ]  # fmt: skip
    assert lines[4] == "0.000000000,1,1,1,,,"
    table = np.genfromtxt(tmp_path / "w.csv", delimiter=",", names=True, skip_header=3)
    assert table["acc_z_mps2"].tolist() == [1, 1, 1]
    lines = (tmp_path / "w.sto").read_text(encoding="utf-8").splitlines()
    assert lines[:3] == ["at=left-wrist", "axes=x along the bone z out", "simulated=true"]
    assert {"DataRate=100.000000", "DataType=Vec3"} <= {*lines}
    start = lines.index("endheader") + 1
    assert lines[start].split("\t") == ["time", "left-wrist_accelerometer", "left-wrist_gyroscope"]
    assert lines[start + 2] == "0.010000000\t1,1,1\tnan,nan,nan"


def read(tmp_path: Path, text: str) -> InertialSignals:
    path = tmp_path / "real.csv"
    path.write_text(text, encoding="utf-8")
    return read_signals(path)


@pytest.mark.parametrize(
    ("heading", "acceleration", "turn_rate"),
    [
        (HEADING, 1.0, 1.0),
        ("time,acc_x (g),acc_y (g),acc_z (g),gyr_x [deg/s],gyr_y [deg/s],gyr_z [deg/s]",
         STANDARD_GRAVITY_MPS2, math.pi / 180),
        ("t,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps", STANDARD_GRAVITY_MPS2, math.pi / 180),
        ("Timestamp (s),Accelerometer X (m/s²),Accelerometer Y (m/s²),Accelerometer Z (m/s²),"
         "Gyroscope X (°/s),Gyroscope Y (°/s),Gyroscope Z (°/s)", 1.0, math.pi / 180),
        ('"time_s","acc_x[mg]","acc_y[mg]","acc_z[mg]","omega.x (rad/s)","omega.y (rad/s)",'
         '"omega.z (rad/s)"', STANDARD_GRAVITY_MPS2 / 1000, 1.0),
        ("time_s,accel x m/s^2,accel y m/s^2,accel z m/s^2,gyro-x rad/s,gyro-y rad/s,"
         "gyro-z rad/s", 1.0, 1.0),
        ("time_s,acc_x_g,acc_y_g,acc_z_g,gyr_x (mdps),gyr_y (mdps),gyr_z (mdps)",
         STANDARD_GRAVITY_MPS2, math.pi / 180_000),
        ("time_s,acc_x_g,acc_y_g,acc_z_g,gyr_x (rad/sec),gyr_y (rad/sec),gyr_z (rad/sec)",
         STANDARD_GRAVITY_MPS2, 1.0),
    ],
)  # fmt: skip
@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_columns_are_found_by_their_names_with_their_units(
    tmp_path: Path, heading: str, acceleration: float, turn_rate: float, separator: str
) -> None:
    text = f"\ufeff# made by a sensor\n\n{heading}\n# a remark\n{ROWS}".replace(",", separator)
    signals = read(tmp_path, text)
    np.testing.assert_allclose(signals.times_s, [0.0, 0.01, 0.02])
    np.testing.assert_allclose(signals.acceleration_mps2[1], acceleration * np.array([1, 2, 3]))
    np.testing.assert_allclose(signals.turn_rate_radps[2], turn_rate * np.array([4, 5, 6]))


def test_semicolons_go_with_decimal_commas_and_minutes_are_minutes(tmp_path: Path) -> None:
    heading = HEADING.replace("time_s", "time (min)").replace(",", ";")
    rows = "\n".join(f"{row / 60:.9f};1;2;3;0.5;0.5;0.5".replace(".", ",") for row in range(3))
    signals = read(tmp_path, f"{heading}\n{rows}\n")
    np.testing.assert_allclose(signals.times_s, [0.0, 1.0, 2.0], atol=1e-6)
    np.testing.assert_allclose(signals.turn_rate_radps, 0.5)


def test_order_and_other_columns_do_not_matter(tmp_path: Path) -> None:
    heading = "mag_x,gyr_z_radps,gyr_y_radps,gyr_x_radps,note,acc_z_g,acc_y_g,acc_x_g,time (ms)"
    rows = "7,3,2,1,hello,30,20,10,0\n7,3,,1,,30,20,10,5\n"
    signals = read(tmp_path, f"{heading}\n{rows}")
    np.testing.assert_allclose(signals.times_s, [0.0, 0.005])
    np.testing.assert_allclose(signals.turn_rate_radps, [[1, 2, 3], [1, np.nan, 3]])
    np.testing.assert_allclose(signals.acceleration_mps2[0] / STANDARD_GRAVITY_MPS2, [10, 20, 30])
    assert signals.known.tolist() == [True, False]


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_the_first_and_the_last_cell_may_be_empty(tmp_path: Path, separator: str) -> None:
    """As an index without a title is, and a value that is not known."""
    rows = ["", *HEADING.split(",")], ["0", "0.00", *"123456"], ["1", "0.01", *"12345", ""]
    signals = read(tmp_path, "\n".join(separator.join(row) for row in rows))
    np.testing.assert_allclose(signals.times_s, [0.0, 0.01])
    np.testing.assert_allclose(signals.turn_rate_radps, [[4, 5, 6], [4, 5, np.nan]])


def test_tabs_that_fill_a_line_up_belong_to_no_remark(tmp_path: Path) -> None:
    """As spreadsheets write them."""
    rows = HEADING.split(",")[1:], list("123456")
    table = "\n".join("\t".join([*row, ""]) for row in rows)
    signals = read(tmp_path, f"\t# rate_hz: 50\n# place: left-wrist\t\t\t\n{table}\n")
    assert (signals.meta["rate_hz"], signals.meta["place"]) == (50, "left-wrist")
    assert signals.turn_rate_radps.tolist() == [[4, 5, 6]]


def test_a_rate_stands_for_times(tmp_path: Path) -> None:
    text = "acc_x_g,acc_y_g,acc_z_g,gyr_x_dps,gyr_y_dps,gyr_z_dps\n" + "1,2,3,4,5,6\n" * 4
    signals = read(tmp_path, f"# rate_hz: 50\n{text}")
    np.testing.assert_allclose(signals.times_s, np.arange(4) / 50)
    np.testing.assert_allclose(signals.acceleration_mps2[0, 0], STANDARD_GRAVITY_MPS2)
    with pytest.raises(Sd2Error, match="neither times nor a rate"):
        read(tmp_path, text)


PLAIN = "time_s,acc_x,acc_y,acc_z,gyr_x_radps,gyr_y_radps,gyr_z_radps"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "has no heading"),
        ("# only a remark\n", "has no heading"),
        (f"{HEADING}\n", "no rows"),
        (f"time,acc_x,acc_y\n{ROWS}", r"no column acc_z, gyr_x, gyr_y, gyr_z; its heading is"),
        (f"{PLAIN}\n{ROWS}", r"'acc_x' has no unit.*accelerations in m/s².*acc x \(m/s²\)"),
        (f"{HEADING.replace('acc_x_mps2', 'acc_x (ft/s2)')}\n{ROWS}", "the unit 'ft/s2'"),
        (f"{HEADING},acc_x_g\n{ROWS}", "two columns acc x: 'acc_x_mps2' and 'acc_x_g'"),
        (f"{HEADING}\n0,1,2\n", "line 2 has 3 cells"),
        (f"{HEADING}\n0,1,2,3,4,five,6\n", "gyr_y_radps of line 2 is 'five'"),
        (f"{HEADING}\n0,1,2,3,4,inf,6\n", "infinite"),
        (f"{HEADING.replace('acc_x_mps2', 'acc_x_g')}\n0,1e308,2,3,4,5,6\n", "infinite"),
        (f"{HEADING}\n{ROWS}{ROWS}", "increase"),
        (f"{HEADING}\n0,1,2,3,4,5,6\n10,1,2,3,4,5,6\n", "0.1 samples per second"),
        (f"# rate_hz: often\n{HEADING[7:]}\n{ROWS}", "the rate 'often'"),
        (f"# rate_hz: nan\n{HEADING[7:]}\n{ROWS}", "nan samples per second"),
        ("a\0b", "no text in UTF-8"),
    ],
)
def test_what_does_not_fit_is_refused_in_words(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(Sd2Error, match=words) as caught:
        read(tmp_path, text)
    assert str(tmp_path / "real.csv") in str(caught.value)


def test_other_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(Sd2Error, match="does not exist"):
        read_signals(tmp_path / "none.csv")
    (tmp_path / "folder.csv").mkdir()
    with pytest.raises(Sd2Error, match=r"folder.csv"):
        read_signals(tmp_path / "folder.csv")
    (tmp_path / "samples.txt").write_text(HEADING)
    with pytest.raises(Sd2Error, match=r"\.csv, \.sto, \.npz"):
        read_signals(tmp_path / "samples.txt")
    np.savez(tmp_path / "mesh.npz", vertices=np.zeros((2, 3, 3)))
    with pytest.raises(Sd2Error, match="has no acceleration_mps2"):
        read_signals(tmp_path / "mesh.npz")
    arrays = dict.fromkeys(("times_s", "acceleration_mps2", "turn_rate_radps"), np.zeros(3))
    for meta, words in (('{"format": "sd2-map"}', "the format 'sd2-map'"), ("[]", "format None")):
        np.savez(tmp_path / "other.npz", **arrays, meta=meta)
        with pytest.raises(Sd2Error, match=words):
            read_signals(tmp_path / "other.npz")
    (tmp_path / "motion.sto").write_text("version=1\nendheader\ntime\tknee\n0\t1\n")
    with pytest.raises(Sd2Error, match="no type that is stated"):
        read_signals(tmp_path / "motion.sto")
    (tmp_path / "three.sto").write_text("DataType=Vec3\nendheader\ntime\tankle\n0\t1,2,3\n")
    with pytest.raises(Sd2Error, match="has the columns"):
        read_signals(tmp_path / "three.sto")
