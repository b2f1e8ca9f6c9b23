"""Point clouds as tables: a body whose movement is known, in every order and kind of file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from sd2core.errors import Sd2Error
from sd2core.io.kinds import kind_of
from sd2core.io.radar import companions, holds_map, load_capture, load_recorded_map
from sd2core.io.radar.described import write_description
from sd2core.io.radar.point_maps import load_points_map, velocity_histogram
from sd2core.io.radar.points import (
    PointsDescription,
    doppler_step,
    looks_like_points,
    read_points,
)
from sd2core.sensor import VelocityAxis
from tests.core.io.radar.point_files import (
    FRAME_S,
    FRAMES,
    NAMES,
    POINTS,
    STEP_MPS,
    velocity_mps,
    walk,
    write_csv,
)


def is_the_walk(path: Path, weighed: bool = True) -> bool:
    """True if the map of a file has in each column what the points of the walk have, there."""
    recorded = load_recorded_map(path)
    doppler, table = recorded.doppler, walk()
    columns = table[:, 0].astype(int)
    weight = table[:, 5] if weighed else np.ones(len(table))
    expected = velocity_histogram(
        columns, velocity_mps(columns), weight, FRAMES, VelocityAxis(), STEP_MPS
    )
    assert doppler.kind == "real"
    assert doppler.values.shape == (32, FRAMES)
    off_mps = np.abs(doppler.mean_velocity_mps() - velocity_mps(np.arange(FRAMES)))
    return bool(np.allclose(doppler.values, expected)) and bool(off_mps.max() < 1e-3)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("order", [(0, 1, 2, 3, 4, 5), (5, 4, 3, 0, 2, 1)])
def test_columns_may_be_in_any_order_and_distances_tell_the_sign(
    tmp_path: Path, order: tuple[int, ...], sign: int
) -> None:
    titles = tuple(NAMES[place] for place in order)
    path = write_csv(tmp_path / "a.csv", walk(sign)[:, order], titles)
    assert kind_of(path) == "radar"
    assert holds_map(path)
    assert is_the_walk(path)
    way = "recede" if sign > 0 else "approach"
    assert any(f"positive velocity is taken to {way}" in n for n in load_recorded_map(path).notes)


@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    "titles",
    [
        ("Frame #", "X", "Y", "Z", "Doppler", "Intensity"),
        ("frame_id", "x (m)", "y (m)", "z (m)", "Velocity [m/s]", "SNR"),
        ("FrameNumber", "px", "py", "pz", "v", "peakVal"),
    ],
)
@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_columns_go_by_many_names(tmp_path: Path, titles: tuple[str, ...], separator: str) -> None:
    assert is_the_walk(write_csv(tmp_path / "a.csv", walk(), titles, separator))


@pytest.mark.parametrize("separator", [",", "\t"])
def test_an_index_without_a_title_shifts_no_column(tmp_path: Path, separator: str) -> None:
    table = np.column_stack([np.arange(len(walk())) % 7, walk()])
    assert is_the_walk(write_csv(tmp_path / "a.tsv", table, ("", *NAMES), separator))


@pytest.mark.parametrize("title", ["SNR [dB]", "power_dBm"])
def test_levels_in_decibels_are_powers(tmp_path: Path, title: str) -> None:
    table = walk()
    table[:, 5] = 10.0 * np.log10(table[:, 5]) - 40.0
    written = write_csv(tmp_path / "level.csv", table, (*NAMES[:5], title))
    plain = load_recorded_map(write_csv(tmp_path / "a.csv", walk())).doppler
    found = load_recorded_map(written).doppler
    np.testing.assert_allclose(1e4 * found.values, plain.values, rtol=1e-3)


def test_arrays_with_names_are_read_alike(tmp_path: Path) -> None:
    table = walk()
    fields = np.zeros(len(table), [(name, "<f4") for name in NAMES])
    for name, column in zip(NAMES, table.T, strict=True):
        fields[name] = column
    np.save(tmp_path / "a.npy", fields)
    savemat(tmp_path / "a.mat", dict(zip(NAMES, table.T, strict=True)))
    for path in (tmp_path / "a.npy", tmp_path / "a.mat"):
        assert is_the_walk(path)


@pytest.mark.parametrize("suffix", [".npy", ".mat", ".csv", ".tsv"])
def test_without_names_numbers_tell_where_they_can(tmp_path: Path, suffix: str) -> None:
    path, table = tmp_path / f"a{suffix}", walk()
    if suffix == ".csv":
        write_csv(path, table, ())
    elif suffix == ".tsv":  # with a tab at the end of each row
        text = write_csv(path, table, (), "\t").read_text()
        path.write_text(text.replace("\n", "\t\n"))
    elif suffix == ".mat":
        savemat(path, {"cloud": table})
    else:
        np.save(path, table)
    assert is_the_walk(path)
    assert any("by their numbers" in n for n in load_recorded_map(path).notes)


def test_frames_of_points_filled_up_with_zeros(tmp_path: Path) -> None:
    table = walk()
    cloud = np.zeros((FRAMES, POINTS + 5, 5))
    cloud[:, :POINTS] = table[:, 1:].reshape(FRAMES, POINTS, 5)
    np.save(tmp_path / "a.npy", cloud)
    assert is_the_walk(tmp_path / "a.npy")
    cloud[20:60] = 0.0
    np.save(tmp_path / "a.npy", cloud)
    times_s = load_recorded_map(tmp_path / "a.npy").timebase.times_s
    assert np.diff(times_s).max() == pytest.approx(41 * FRAME_S)


def test_times_that_tell_no_frame_rate_make_no_hours(tmp_path: Path) -> None:
    """Each point has its own, in no unit that is named, and between bursts lies a day."""
    table = walk()
    table[:, 0] = 1e-6 * np.arange(len(table)) + 86_400.0 * (table[:, 0] > 20)
    path = tmp_path / "a.npy"
    np.save(path, np.rec.fromarrays(table.T, names=["time", *NAMES[1:]]))
    recorded = load_recorded_map(path)
    assert any("no frame rate" in note for note in recorded.notes)
    assert recorded.timebase.duration_s < 0.2 * len(table)


def test_times_of_a_coarse_clock_leave_no_frame_out(tmp_path: Path) -> None:
    """A step of three ticks beside many of two is none in which a frame is missing."""
    table = walk()
    table[:, 0] = np.floor(table[:, 0] / 30.0 / 0.015625) * 0.015625
    path = write_csv(tmp_path / "a.csv", table, ("time", *NAMES[1:]))
    assert load_recorded_map(path).doppler.values.any(axis=0).all()


@pytest.mark.parametrize("lost", [np.nan, np.inf])
def test_a_time_that_is_lost_keeps_no_points_from_being_read(tmp_path: Path, lost: float) -> None:
    table = walk()
    table[:, 0] *= FRAME_S
    table[-1, 0] = lost
    np.save(tmp_path / "a.npy", np.rec.fromarrays(table.T, names=["time", *NAMES[1:]]))
    recorded = load_recorded_map(tmp_path / "a.npy")
    assert recorded.doppler.values.shape == (32, FRAMES + 1)
    assert any("no frame rate" in note for note in recorded.notes)


def test_a_description_says_what_numbers_do_not(tmp_path: Path) -> None:
    path, table = tmp_path / "a.npy", walk()
    table = np.column_stack([table[:, 4], table[:, 0] // 2, table[:, 0]])
    np.save(path, table)  # two columns that might be frames
    assert not looks_like_points(path)
    with pytest.raises(Sd2Error, match=r"a\.npy does not say what radar"):
        load_capture(path)
    told = PointsDescription(columns=("doppler", "-", "frame"), frame_repetition_s=0.05, sign=1)
    beside = write_description(told, path)
    assert companions(path) == [beside]
    assert is_the_walk(path, weighed=False)
    assert load_recorded_map(path).doppler.timebase.frames_per_s == pytest.approx(20.0)


@pytest.mark.parametrize("first", ["frame", "time"])
def test_frames_left_out_are_empty_and_long_gaps_are_gaps(tmp_path: Path, first: str) -> None:
    numbers = np.concatenate([np.arange(60), np.arange(63, 130), np.arange(900, 960)])
    table = walk(frames=numbers)
    if first == "time":
        table[:, 0] *= FRAME_S
    path = write_csv(tmp_path / "a.csv", table, (first, *NAMES[1:]))
    doppler = load_recorded_map(path).doppler
    filled = doppler.values.any(axis=0)
    assert len(filled) == 60 + 3 + 67 + 60
    assert np.flatnonzero(~filled).tolist() == [60, 61, 62]
    assert np.diff(doppler.times_s).max() == pytest.approx(FRAME_S * (900 - 129))


@pytest.mark.parametrize(("unit", "per_s"), [("s", 1.0), ("ms", 1e3), ("ns", 1e9)])
def test_times_are_those_of_the_table_in_their_unit(
    tmp_path: Path, unit: str, per_s: float
) -> None:
    table = walk()
    time = (1000.0 + 0.05 * table[:, 0]) * per_s
    lines = ["timestamp,x,y,z,doppler,snr"]
    lines += [f"{at:.0f}" if per_s > 1 else f"{at:.3f}" for at in time]
    rows = zip(lines[1:], table, strict=True)
    body = [f"{at},{','.join(f'{value:.6g}' for value in row[1:])}" for at, row in rows]
    (tmp_path / "a.csv").write_text("\n".join([lines[0], *body]))
    assert is_the_walk(tmp_path / "a.csv")
    times_s = load_recorded_map(tmp_path / "a.csv").doppler.times_s
    np.testing.assert_allclose(times_s, 0.05 * np.arange(FRAMES), atol=2e-3)


def test_points_beyond_the_axis_are_told_and_taken_in_by_a_wider_one(tmp_path: Path) -> None:
    table = walk()
    table[::4, 4] = 3.0
    path = write_csv(tmp_path / "a.csv", table)
    assert any("25 % of the points are faster" in n for n in load_recorded_map(path).notes)
    wide = load_recorded_map(path, VelocityAxis(32, 4.0))
    assert wide.doppler.values.sum() == pytest.approx(table[:, 5].sum(), rel=1e-5)
    assert not any("faster" in note for note in wide.notes)


def test_what_is_no_table_of_points_is_left_alone(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    np.save(tmp_path / "mesh.npy", rng.normal(size=(50, 30, 3)).astype(np.float32))
    np.save(tmp_path / "cube.npy", rng.integers(-500, 500, (30, 64, 8)).astype(np.float32))
    (tmp_path / "labels.csv").write_text("start,end,label\n0,1,wave\n")
    for name in ("mesh.npy", "cube.npy", "labels.csv"):
        assert not looks_like_points(tmp_path / name)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("frame,doppler,x\n0,nan,1\n", "velocity of row 1"),
        ("frame,doppler,x\n0.5,1,1\n", "whole numbers"),
        ("frame,doppler,x\n", "holds no rows"),
        ("frame,doppler,x\n0,a,1\n", "cannot be read"),
    ],
)
def test_damaged_tables_are_refused(tmp_path: Path, text: str, told: str) -> None:
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(Sd2Error, match=rf"a\.csv.*{told}"):
        load_recorded_map(tmp_path / "a.csv")


@pytest.mark.parametrize("step_mps", [0.13, 0.356])
def test_the_step_of_a_radar_is_found_in_rounded_velocities(step_mps: float) -> None:
    rng = np.random.default_rng(1)
    velocities = np.round(step_mps * rng.integers(-6, 7, 5000), 3)
    assert doppler_step(velocities) == pytest.approx(step_mps, rel=0.01)
    assert doppler_step(rng.normal(size=5000)) == 0.0


@pytest.mark.parametrize(
    ("title", "mps"),
    [("doppler (cm/s)", 0.01), ("velocity_kmh", 1 / 3.6), ("Doppler[m/s]", 1.0), ("v_mps", 1.0)],
)
def test_velocities_are_in_the_unit_of_their_title(tmp_path: Path, title: str, mps: float) -> None:
    table = walk()
    table[:, 4] /= mps
    path = write_csv(tmp_path / "p.csv", table, (*NAMES[:4], title, NAMES[5]))
    np.testing.assert_allclose(read_points(path).doppler, walk()[:, 4], atol=1e-4)


@pytest.mark.parametrize("unit", ["Hz", "bins"])
def test_what_is_no_velocity_is_refused(tmp_path: Path, unit: str) -> None:
    path = write_csv(tmp_path / "p.csv", walk(), (*NAMES[:4], f"doppler ({unit})", NAMES[5]))
    with pytest.raises(Sd2Error, match=f"has the unit {unit.lower()}"):
        load_points_map(path)


def test_two_velocities_are_refused(tmp_path: Path) -> None:
    path = write_csv(tmp_path / "p.csv", walk(), ("frame", "x", "y", "doppler", "doppler", "snr"))
    with pytest.raises(Sd2Error, match="holds frame, x, y, doppler, doppler, snr"):
        read_points(path)


def test_rows_in_no_order_are_sorted_by_their_frames(tmp_path: Path) -> None:
    table = walk()
    shuffled = write_csv(tmp_path / "p.csv", np.random.default_rng(0).permutation(table))
    in_order = load_points_map(write_csv(tmp_path / "q.csv", table)).doppler
    np.testing.assert_allclose(load_points_map(shuffled).doppler.values, in_order.values)


def test_semicolons_go_with_decimal_commas(tmp_path: Path) -> None:
    path = write_csv(tmp_path / "p.csv", walk(), by=";")
    path.write_text(path.read_text().replace(".", ","))
    np.testing.assert_allclose(read_points(path).doppler, walk()[:, 4])


def test_text_in_another_encoding_is_named(tmp_path: Path) -> None:
    path = write_csv(tmp_path / "p.csv", walk())
    path.write_bytes(path.read_text().encode("utf-16"))
    with pytest.raises(Sd2Error, match=r"p\.csv is not in UTF-8"):
        read_points(path)


@pytest.mark.parametrize("frames", [True, False])
def test_dates_of_points_are_times(tmp_path: Path, frames: bool) -> None:
    table = walk()[:600]
    path = tmp_path / "p.csv"
    titles = ("stamp" if not frames else "frame", *NAMES[1:], "timestamp")
    rows = [
        ",".join(f"{value:g}" for value in row) + f",2024-05-01T10:00:{0.05 * row[0]:06.3f}Z"
        for row in table
    ]
    path.write_text("\n".join([",".join(titles), *rows]))
    made = load_points_map(path).doppler
    np.testing.assert_allclose(made.times_s, 0.05 * np.arange(50), atol=1e-6)


@pytest.mark.parametrize(
    ("title", "per_s"), [("Time (ms)", 1e3), ("timestamp_us", 1e6), ("time_min", 1 / 60)]
)
def test_times_are_in_the_unit_of_their_title(tmp_path: Path, title: str, per_s: float) -> None:
    table = walk()
    timed = np.column_stack([table, 2.0 * per_s * table[:, 0]])  # no rate that would tell the unit
    made = load_points_map(write_csv(tmp_path / "p.csv", timed, (*NAMES, title))).doppler
    np.testing.assert_allclose(made.times_s, 2.0 * np.arange(200), rtol=1e-5)


def test_dates_in_words_are_left_out_where_frames_are_numbered(tmp_path: Path) -> None:
    path = write_csv(tmp_path / "a.csv", walk())
    first, *rows = path.read_text().splitlines()
    dated = [f"2024-05-01 10:00:00.5,{row}" for row in rows]
    path.write_text("\n".join([f"timestamp,{first}", *dated]))
    assert is_the_walk(path)


def test_a_map_of_nothing_is_told(tmp_path: Path) -> None:
    table = walk()
    table[:, 5] = 0.0
    table[:, 4] = 9.0
    notes = load_recorded_map(write_csv(tmp_path / "a.csv", table)).notes
    assert any("The map holds nothing but zeros" in note for note in notes)
