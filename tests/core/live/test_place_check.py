"""The check of a place: what somebody does in front of radar and camera, known beforehand."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sd2core import PAPER_RADAR, RadarCapture, RadarConfig, Timebase
from sd2core.body.camera import DEFAULT_FIELD_OF_VIEW_DEG
from sd2core.live.checking import (
    Answer,
    Moved,
    Seen,
    chance_db,
    check_place,
    found_place,
    moved_between,
    seen_in,
)
from sd2core.radar_config import SPEED_OF_LIGHT_MPS

WIDE = replace(PAPER_RADAR, end_frequency_hz=PAPER_RADAR.start_frequency_hz + 1e9)
LENGTH_S, RATE_HZ, PICTURES_HZ = 10.0, 20.0, 10.0


def walk_m(times_s: np.ndarray) -> np.ndarray:
    """Distance of somebody who walks to and fro."""
    return 1.5 + 0.35 * np.sin(1.9 * times_s) + 0.2 * np.sin(0.8 * times_s)


def frame_of(
    times_s: np.ndarray, distance_m: np.ndarray, radar: RadarConfig = WIDE, echo: float = 0.05,
    seed: int = 0, sign: int = 1,
) -> RadarCapture:  # fmt: skip
    """One frame of noise and of a point at a distance at every chirp."""
    rng = np.random.default_rng(seed)
    hertz = np.linspace(radar.start_frequency_hz, radar.end_frequency_hz, radar.samples_per_chirp)
    phase = 4 * np.pi * np.asarray(distance_m)[:, None] * hertz / SPEED_OF_LIGHT_MPS
    shape = (radar.channels, *phase.shape)
    signal = echo * np.cos(phase)[::sign] + rng.normal(0.0, 0.01, shape)
    return RadarCapture(signal[None].astype(np.float32), radar, Timebase([times_s[0]]))


@cache
def radar_sees(sign: int = 1, echo: float = 0.05, radar: RadarConfig = WIDE) -> list[Seen]:
    seen = []
    for number, time_s in enumerate(np.arange(0.0, LENGTH_S, 1 / RATE_HZ)):
        chirps_s = time_s + radar.chirp_repetition_s * np.arange(radar.chirps_per_frame)
        frame = frame_of(chirps_s, walk_m(chirps_s), radar, echo, number, sign)
        seen.append(seen_in(frame, float(chirps_s.mean())))
    return seen


def disc(distance_m: float, centre: float, rng: np.random.Generator) -> np.ndarray:
    """Picture of a disc whose size is as one by its distance."""
    y, x = np.mgrid[:90, :160]
    edge = 24.0 / distance_m - np.hypot(x - 159 * centre, y - 44.5)
    picture = 60 + 90 * np.clip(edge + 0.5, 0.0, 1.0) + rng.normal(0.0, 1.0, edge.shape)
    return np.rint(picture).astype(np.uint8)


@cache
def camera_sees(
    late_s: float = 0.0, centre: float = 0.5, still: bool = False, frames: int = 100
) -> list[Moved]:
    rng = np.random.default_rng(1)
    times_s = np.arange(frames) / PICTURES_HZ
    far_m = walk_m(times_s - late_s) if not still else np.full(frames, 1.5)
    pictures = [disc(one, centre, rng) for one in far_m]
    return [
        moved_between(pictures[k], pictures[k + 1], times_s[k] + 0.05, 0.1)
        for k in range(frames - 1)
    ]


def found(seen: list[Seen], moved: list[Moved], radar: RadarConfig = WIDE) -> dict[str, Answer]:
    return {one.name: one for one in check_place(radar, seen, moved)}


@pytest.fixture(scope="module")
def walked() -> tuple[list[Seen], list[Moved]]:
    return radar_sees(), camera_sees()


def test_a_reflector_is_at_its_place_and_speed() -> None:
    chirps_s = WIDE.chirp_repetition_s * np.arange(WIDE.chirps_per_frame)
    weak, strong = (
        seen_in(frame_of(chirps_s, 1.2 - 0.8 * chirps_s, echo=echo), 7.0) for echo in (0.02, 0.2)
    )
    assert strong.time_s == 7.0
    assert strong.distance_m == pytest.approx(1.19, abs=0.08)
    assert strong.velocity_mps == pytest.approx(0.8, abs=0.05)
    assert strong.level_db - weak.level_db == pytest.approx(20.0, abs=1.5)


@pytest.mark.parametrize(("receivers", "chirps"), [(1, 64), (3, 64), (1, 8), (1, 4)])
def test_noise_alone_looks_like_motion_in_one_frame_of_a_hundred(
    receivers: int, chirps: int
) -> None:
    radar = replace(WIDE, receivers=receivers, chirps_per_frame=chirps)
    still = np.full(radar.chirps_per_frame, 1.0)
    levels = [
        seen_in(frame_of(still, still, radar, echo=0.0, seed=seed), 0.0).level_db
        for seed in range(300)
    ]
    share = np.mean(np.array(levels) > chance_db(radar))
    assert share <= 0.03
    assert np.median(levels) > chance_db(radar) - 6.0  # a level that nothing reaches tells nothing


def test_what_grows_and_what_does_not() -> None:
    rng = np.random.default_rng(2)
    near, far = disc(1.0, 0.5, rng), disc(1.05, 0.5, rng)
    assert moved_between(far, near, 0.0, 0.1).growth_hz == pytest.approx(0.5, rel=0.35)
    assert moved_between(near, far, 0.0, 0.1).growth_hz == pytest.approx(-0.5, rel=0.35)
    aside = moved_between(disc(1.0, 0.5, rng), disc(1.0, 0.52, rng), 0.0, 0.1)
    assert aside.pixels > 100
    assert abs(aside.growth_hz) < 0.1
    assert 0.3 < aside.left < 0.5 < aside.right < 0.7
    lamp = moved_between(near, (near.astype(int) + 40).astype(np.uint8), 0.0, 0.1)
    noise = moved_between(disc(1.0, 0.5, rng), disc(1.0, 0.5, rng), 0.0, 0.1)
    assert max(lamp.pixels, noise.pixels) < 10


def test_somebody_whom_both_see(walked: tuple[list[Seen], list[Moved]]) -> None:
    findings = found(*walked)
    assert all(one.passed for one in findings.values()), findings
    far_m = walk_m(np.arange(0.0, LENGTH_S, 0.01))
    told = findings["range"].numbers
    assert told["near_m"] == pytest.approx(np.quantile(far_m, 0.1), abs=0.1)
    assert told["far_m"] == pytest.approx(np.quantile(far_m, 0.9), abs=0.1)
    assert abs(findings["agreement"].numbers["video_late_s"]) < 0.1
    assert abs(findings["view"].numbers["azimuth_deg"]) < 3.0
    middle = [one._replace(left=0.4, right=0.6) for one in walked[1]]
    assert (
        "60 % of the picture's width, straight ahead" in found(walked[0], middle)["view"].sentence
    )


def failures(seen: list[Seen], moved: list[Moved]) -> dict[str, str]:
    return {one.name: one.sentence for one in found(seen, moved).values() if not one.passed}


def test_a_swapped_sign(walked: tuple[list[Seen], list[Moved]]) -> None:
    said = failures(radar_sees(sign=-1), walked[1])
    assert list(said) == ["agreement"]
    assert said["agreement"].startswith("The radar's sign is wrong")


def test_of_who_stands_and_swings_the_arms_no_sign_is_said(
    walked: tuple[list[Seen], list[Moved]],
) -> None:
    stands = [one._replace(distance_m=1.5 + 0.1 * one.velocity_mps) for one in radar_sees(sign=-1)]
    said = failures(stands, walked[1])
    assert "cannot be compared" in said["agreement"]
    assert "nobody comes nearer" in said["agreement"]


def test_a_late_video(walked: tuple[list[Seen], list[Moved]]) -> None:
    findings = found(walked[0], camera_sees(late_s=0.36))
    (wrong,) = (one for one in findings.values() if not one.passed)
    assert "s after the radar. The camera's delay is probably larger" in wrong.sentence
    assert wrong.numbers["video_late_s"] == pytest.approx(0.36, abs=0.1)


def test_a_radar_that_sees_nothing(walked: tuple[list[Seen], list[Moved]]) -> None:
    said = failures(radar_sees(echo=0.0), walked[1])
    assert list(said) == ["motion", "range", "agreement"]
    assert "The radar sees no motion" in said["motion"]
    assert failures([], walked[1])["motion"] == "No frame of the radar came."


def test_a_still_picture(walked: tuple[list[Seen], list[Moved]]) -> None:
    said = failures(walked[0], camera_sees(still=True))
    assert list(said) == ["view", "agreement"]
    assert said["view"].startswith("Nothing moves in 100 % of the pictures")


def test_somebody_half_out_of_the_picture(walked: tuple[list[Seen], list[Moved]]) -> None:
    assert "up to its edge" in failures(walked[0], camera_sees(centre=0.05))["view"]


def test_somebody_at_the_end_of_the_range(walked: tuple[list[Seen], list[Moved]]) -> None:
    beyond = [one._replace(distance_m=WIDE.range_max_m - 0.1) for one in walked[0]]
    assert "Step closer" in failures(beyond, walked[1])["range"]


@pytest.mark.one_in(3)
@pytest.mark.parametrize("centre", [0.25, 0.5, 0.7])
def test_a_radar_beside_the_camera_is_found_there(
    walked: tuple[list[Seen], list[Moved]], centre: float
) -> None:
    findings = check_place(WIDE, walked[0], camera_sees(centre=centre))
    place = found_place(findings)
    assert place is not None
    half = np.tan(np.radians(0.5 * DEFAULT_FIELD_OF_VIEW_DEG))
    aside = np.arctan(half * (2 * centre - 1))
    far_m = np.median(walk_m(np.arange(0.0, LENGTH_S, 0.01)))
    body_m = (far_m * np.sin(aside), 0.0, far_m * np.cos(aside))
    np.testing.assert_allclose(place.sensor(body_m).position_m, np.zeros(3), atol=0.12)


def test_no_place_is_found_where_range_or_view_is_in_doubt(
    walked: tuple[list[Seen], list[Moved]],
) -> None:
    assert found_place(check_place(WIDE, walked[0], camera_sees(still=True))) is None
    assert found_place(check_place(WIDE, radar_sees(echo=0.0), walked[1])) is None
    assert found_place([]) is None
    wave = replace(
        WIDE, end_frequency_hz=WIDE.start_frequency_hz, samples_per_chirp=1, sampling="complex"
    )
    assert wave.is_continuous
    assert found_place(check_place(wave, walked[0], walked[1])) is None


@pytest.mark.slow
def test_movements_that_have_nothing_to_do_with_each_other_rarely_agree() -> None:
    rng = np.random.default_rng(3)
    times_s = np.arange(0.0, LENGTH_S, 0.05)

    def wander() -> np.ndarray:
        parts = rng.normal(size=(2, 11))
        turns = 2 * np.pi * np.outer(times_s, np.arange(11) / LENGTH_S)
        return np.cos(turns) @ parts[0] + np.sin(turns) @ parts[1]

    passed = 0
    for _ in range(100):
        seen = [Seen(*one) for one in zip(times_s, times_s, times_s, wander(), strict=True)]
        moved = [Moved(t, 100, 0.4, 0.6, g) for t, g in zip(times_s, wander(), strict=True)]
        passed += found(seen, moved)["agreement"].passed
    assert passed <= 10


def _check(*words: str, where: Path | None = None) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "sd2core.cli", "record", "--check", *words]
    return subprocess.run(command, capture_output=True, text=True, check=False, cwd=where)


@pytest.mark.slow
def test_the_command_with_test_sources_records_nothing(tmp_path: Path) -> None:
    done = _check("--camera", "test", "--radar", "test", "--seconds", "8", "--json", where=tmp_path)
    findings = json.loads(done.stdout)["findings"]
    assert [one["name"] for one in findings] == ["motion", "range", "view", "agreement"]
    assert done.returncode == (0 if all(one["passed"] for one in findings) else 1)
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_what_was_found_is_told_as_it_comes_and_q_ends_it() -> None:
    words = ["--camera", "test", "--radar", "test", "--seconds", "300", "--json", "--previews"]
    command = [sys.executable, "-m", "sd2core.cli", "record", "--check", *words]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        told = []
        for line in process.stdout:
            told.append(json.loads(line))
            # A busy machine takes longer until both have seen enough.
            if told[-1]["event"] == "findings" and told[-1]["left_s"] and _all_passed(told[-1]):
                process.stdin.write("q")
                process.stdin.flush()
    kinds = [one["event"] for one in told]
    assert kinds.count("findings") >= 2
    assert "preview" in kinds
    assert told[-1]["left_s"] == 0
    assert _all_passed(told[-1])
    # The figure sways by a quarter of a metre, and where in its sway the key comes is chance.
    assert told[-1]["place"]["range_m"] == pytest.approx(1.5, abs=0.25)
    assert abs(told[-1]["place"]["azimuth_deg"]) < 3.0


def _all_passed(told: dict[str, Any]) -> bool:
    return all(one["passed"] for one in told["findings"])


@pytest.mark.slow
def test_the_command_in_front_of_a_still_picture(tmp_path: Path) -> None:
    from sd2core.io.video_writing import VideoEncoder

    path = tmp_path / "still.mp4"
    with path.open("wb") as stream:
        encoder = VideoEncoder(stream, 30.0, (160, 90))
        for number in range(60):
            encoder.add(np.full((90, 160, 3), 90, np.uint8), number / 30)
        encoder.close()
    done = _check("--camera", str(path), "--radar", "test", "--seconds", "2")
    assert done.returncode == 1
    assert "WRONG  Nothing moves" in done.stdout
    assert "ok     The radar sees motion" in done.stdout
