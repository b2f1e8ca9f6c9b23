"""Raw samples → Doppler map, against tones and noise whose answer is known."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import get_args
from unittest.mock import Mock

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from velocity_response import velocity_response

from sd2core.errors import Sd2Error
from sd2core.fmcw import chain
from sd2core.fmcw.chain import FrameChain, ProcessingOptions, taper
from sd2core.fmcw.processing import doppler_map, range_doppler, rebinning
from sd2core.io.radar import load_capture
from sd2core.io.radar.capture import RadarCapture
from sd2core.progress import Cancelled
from sd2core.radar_config import PAPER_RADAR, SPEED_OF_LIGHT_MPS, Clutter, RadarConfig
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase

# 16 bits, so that rounding to counts stays out of the comparison.
FINE = replace(PAPER_RADAR, adc_bits=16)
LONG = replace(FINE, samples_per_chirp=128, end_frequency_hz=FINE.start_frequency_hz + 1e9)


def tone(config: RadarConfig, range_m: float, velocity_mps: float, frames: int = 1) -> np.ndarray:
    """Beat signal of one target of amplitude 1, straight from the phase of its echo."""
    frame = np.arange(frames)[:, None, None] * config.frame_repetition_s
    chirp = np.arange(config.chirps_per_frame)[:, None] * config.chirp_repetition_s
    sample = np.arange(config.samples_per_chirp) / config.sample_rate_hz
    delay_s = 2.0 * (range_m - velocity_mps * (frame + chirp)) / SPEED_OF_LIGHT_MPS
    beat_hz = config.slope_hz_per_s * 2.0 * range_m / SPEED_OF_LIGHT_MPS
    phase = 2.0 * np.pi * (config.centre_frequency_hz * delay_s + beat_hz * sample)
    return np.cos(phase)[:, None]  # (frames, 1, chirps, samples)


def capture_of(config: RadarConfig, signal: np.ndarray) -> RadarCapture:
    """Counts around mid-scale from a signal relative to full scale."""
    half = 2 ** (config.adc_bits - 1)
    counts = np.rint(half + half * signal)
    assert counts.min() >= 0
    assert counts.max() < 2 * half
    times = Timebase(np.arange(len(signal)) * config.frame_repetition_s)
    return RadarCapture(counts.astype(np.uint16), config, times, simulated=True)


def noise_capture(config: RadarConfig, frames: int, rms: float = 0.1) -> RadarCapture:
    shape = (frames, config.receivers, config.chirps_per_frame, config.samples_per_chirp)
    return capture_of(config, rms * np.random.default_rng(3).standard_normal(shape))


configs = st.builds(
    RadarConfig,
    start_frequency_hz=st.sampled_from([24e9, 60e9, 76.5e9]),
    end_frequency_hz=st.just(77.5e9),
    samples_per_chirp=st.integers(24, 70),
    chirps_per_frame=st.integers(9, 67),
    chirp_repetition_s=st.floats(1e-4, 5e-4),
    frame_repetition_s=st.just(0.05),
    sample_rate_hz=st.floats(1e6, 4e6),
    adc_bits=st.just(16),
)


@given(config=configs, gate=st.floats(0.2, 0.8), speed=st.floats(-0.9, 0.9))
def test_a_target_is_at_its_range_and_velocity(
    config: RadarConfig, gate: float, speed: float
) -> None:
    range_m, velocity_mps = gate * config.range_max_m, speed * config.v_max_mps
    capture = capture_of(config, 0.9 * tone(config, range_m, velocity_mps))
    cells = range_doppler(capture, 0)
    found_m = cells.range_m[cells.range_profile.argmax()]
    assert abs(found_m - range_m) <= config.range_resolution_m
    found_mps = doppler_map(capture).peak_velocity_mps()[0]
    assert abs(found_mps - velocity_mps) <= config.velocity_resolution_mps


@pytest.mark.parametrize("velocity_mps", [1.3, -1.3])
def test_approaching_is_positive(velocity_mps: float) -> None:
    capture = capture_of(FINE, 0.5 * tone(FINE, 2.2, velocity_mps))
    columns = doppler_map(capture, bins=32, v_max_mps=2.0)
    assert columns.axis.bin_of(velocity_mps) == int(columns.values[:, 0].argmax())
    assert columns.mean_velocity_mps()[0] == pytest.approx(velocity_mps, abs=0.02)


@given(
    chirps=st.integers(2, 40),
    samples=st.integers(2, 20).map(lambda half: 2 * half + 1),
    receivers=st.integers(1, 3),
    bins=st.integers(2, 70),
    reach=st.floats(1.0, 5.0),
)
def test_power_is_conserved_on_every_axis_that_covers_the_radar(
    chirps: int, samples: int, receivers: int, bins: int, reach: float
) -> None:
    # With no window and an odd number of samples every gate but zero counts, so
    # the sum must be the mean square (times 2: a full-scale sine is 1).
    config = replace(FINE, chirps_per_frame=chirps, samples_per_chirp=samples, receivers=receivers)
    capture = noise_capture(config, 2)
    values = capture.read(0, 2).astype(np.float64)
    values -= values.mean(axis=3, keepdims=True)
    expected = 2.0 * np.mean(values**2, axis=(1, 2, 3))
    axis = VelocityAxis(bins, reach * config.v_max_mps)
    found = doppler_map(capture, axis=axis, window="none").values.sum(axis=0)
    np.testing.assert_allclose(found, expected, rtol=1e-5)


@given(
    chirps=st.integers(2, 70),
    padding=st.integers(1, 5),
    bins=st.integers(2, 80),
    reach=st.floats(0.1, 4.0),
)
def test_rebinning_shares_out_every_native_bin_once(
    chirps: int, padding: int, bins: int, reach: float
) -> None:
    config = replace(FINE, chirps_per_frame=chirps)
    axis = VelocityAxis(bins, reach * config.v_max_mps)
    weights = rebinning(config, axis, padding * chirps)
    assert weights.min() >= 0.0
    assert weights.sum(axis=0).max() <= 1.0 + 1e-12
    # Rows: a flat spectrum stays flat, in proportion to what of a bin the radar sees.
    seen_mps = np.minimum(axis.edges_mps[1:], config.v_max_mps) - np.maximum(
        axis.edges_mps[:-1], -config.v_max_mps
    )
    width_mps = 2.0 * config.v_max_mps / (padding * chirps)
    np.testing.assert_allclose(
        weights.sum(axis=1) * width_mps, np.maximum(seen_mps, 0.0), atol=1e-9
    )


@pytest.mark.parametrize("window", ["hann", "blackman", "none"])
@pytest.mark.parametrize(("chirps", "samples"), [(64, 128), (63, 127), (32, 256)])
def test_a_full_scale_sine_has_power_one_whatever_the_window(
    window: str, chirps: int, samples: int
) -> None:
    # On a bin of both FFTs, so that even without a window nothing leaks.
    config = replace(LONG, chirps_per_frame=chirps, samples_per_chirp=samples)
    range_m = 17 * config.range_resolution_m
    velocity_mps = 7 * config.velocity_resolution_mps
    capture = capture_of(config, 0.999 * tone(config, range_m, velocity_mps))
    power = doppler_map(capture, window=window).values.sum()  # type: ignore[arg-type]
    assert power == pytest.approx(0.999**2, rel=2e-4)


@pytest.mark.parametrize("window", ["hann", "blackman", "none"])
def test_windows_are_symmetric_and_usable_when_short(window: str) -> None:
    for length in (2, 3, 8, 9):
        values = taper(window, length)  # type: ignore[arg-type]
        np.testing.assert_allclose(values, values[::-1], atol=1e-7)
        assert values.max() > 0.3


def test_the_power_of_receivers_is_averaged() -> None:
    signal = 0.4 * tone(FINE, 2.2, 1.0)
    one = doppler_map(capture_of(FINE, signal))
    both = replace(FINE, receivers=2)
    two = doppler_map(capture_of(both, np.concatenate([signal, 0.5 * signal], axis=1)))
    np.testing.assert_allclose(two.values, 0.625 * one.values, rtol=1e-2, atol=1e-8)


@pytest.mark.parametrize("clutter", ["mean", "regression"])
def test_a_static_target_goes_and_a_moving_one_stays(clutter: Clutter) -> None:
    static, moving = 0.5 * tone(FINE, 3.6, 0.0), 0.2 * tone(FINE, 2.2, 1.3)
    both = capture_of(FINE, static + moving)
    kept = doppler_map(capture_of(FINE, moving), bins=32, v_max_mps=2.0)
    np.testing.assert_allclose(
        doppler_map(both, bins=32, v_max_mps=2.0, clutter=clutter).values,
        kept.values,
        atol=1e-3 * float(kept.values.max()),
    )
    alone = capture_of(FINE, static)
    before = doppler_map(alone).values.sum()
    after = doppler_map(alone, clutter=clutter).values.sum()
    assert after < 1e-9 * before


@given(amplitudes=arrays(np.float64, (3, 8), elements=st.floats(-0.2, 0.2)))
def test_a_course_over_the_chirps_that_is_a_parabola_goes(amplitudes: np.ndarray) -> None:
    chirps, samples = np.linspace(-1.0, 1.0, 24), np.arange(8)
    tones = np.sin(2.0 * np.pi * (samples + 0.3) * np.arange(1, 9)[:, None] / 8.0)  # (8, samples)
    signal = np.vander(chirps, 3) @ amplitudes @ tones
    chain = FrameChain(FINE, ProcessingOptions(clutter="regression"))
    left = chain.without_own_clutter(signal[None, None].astype(np.float32))
    assert np.abs(left).max() < 1e-5


@given(speed_mps=st.floats(-0.02, 0.02))
def test_swaying_leaves_nothing_beside_zero(speed_mps: float) -> None:
    """A body's trunk sways by some 1 cm/s, and echoes a hundred times as strongly as a hand."""
    power = {
        clutter: velocity_response(
            PAPER_RADAR, [speed_mps], processing=ProcessingOptions(clutter=clutter)
        ).sum()
        for clutter in ("none", "mean", "regression")
    }
    assert power["none"] == pytest.approx(1.0, abs=1e-3)
    assert power["regression"] < 1e-4
    assert power["regression"] <= 0.01 * power["mean"] + 1e-12


@pytest.mark.parametrize(("speed_mps", "db"), [(0.05, -20.0), (0.125, -2.5), (-0.25, 3.0)])
def test_what_moves_within_the_nulled_bins_is_weakened_and_what_moves_faster_is_not(
    speed_mps: float, db: float
) -> None:
    processing = ProcessingOptions(clutter="regression")
    shown = velocity_response(PAPER_RADAR, [speed_mps], processing=processing).sum()
    assert 10.0 * np.log10(shown) < db
    faster = velocity_response(PAPER_RADAR, np.linspace(0.19, 1.5, 50), processing=processing)
    np.testing.assert_allclose(10.0 * np.log10(faster.sum(axis=0)), 0.0, atol=1.0)


def test_the_moving_average_keeps_what_is_slower_than_a_doppler_bin() -> None:
    # 30 mm/s is a third of a bin: the mean over the chirps takes most of it,
    # the mean over 2 s nothing.
    slow = 0.4 * tone(FINE, 2.2, 0.03, frames=150)
    capture = capture_of(FINE, slow + 0.4 * tone(FINE, 3.6, 0.0, frames=150))
    truth = doppler_map(capture_of(FINE, slow)).values.sum(axis=0)[40:110]
    kept = doppler_map(capture, clutter="moving").values.sum(axis=0)[40:110]
    lost = doppler_map(capture, clutter="mean").values.sum(axis=0)[40:110]
    np.testing.assert_allclose(kept, truth, rtol=0.1)
    assert lost.max() < 0.5 * truth.min()
    static = capture_of(FINE, 0.4 * tone(FINE, 3.6, 0.0, frames=150))
    assert doppler_map(static, clutter="moving").values.sum(axis=0).max() < 1e-9


def test_the_moving_average_ends_where_frames_are_missing() -> None:
    """What stands still may stand elsewhere after a pause."""
    parts = [0.4 * tone(FINE, range_m, 0.0, frames=40) for range_m in (3.6, 3.601)]
    capture = capture_of(FINE, np.concatenate(parts))
    times_s = capture.timebase.times_s + np.repeat([0.0, 10.0], 40)
    paused = replace(capture, timebase=Timebase(times_s))
    assert doppler_map(capture, clutter="moving").values.max() > 1e-3
    assert doppler_map(paused, clutter="moving").values.max() < 1e-9


def test_a_long_capture_is_not_gone_through_for_every_frame(monkeypatch) -> None:
    looking = Mock(wraps=chain.gaps_between)
    monkeypatch.setattr(chain, "gaps_between", looking)
    capture = capture_of(FINE, 0.4 * tone(FINE, 3.6, 0.0, frames=5))
    processing = chain.Chain(capture, ProcessingOptions("moving"))
    for frame in range(5):
        processing.cell_power(frame)
    looking.assert_called_once()


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_what_is_too_fast_folds_as_in_a_radar(sign: float) -> None:
    v_max = FINE.v_max_mps
    capture = capture_of(FINE, 0.5 * tone(FINE, 2.2, sign * (v_max + 0.4)))
    found = doppler_map(capture).peak_velocity_mps()[0]
    assert found == pytest.approx(sign * (0.4 - v_max), abs=FINE.velocity_resolution_mps)


@pytest.mark.parametrize("bins", [32, 33, 50, 64])
def test_the_noise_floor_is_flat(bins: int) -> None:
    capture = noise_capture(FINE, 400)
    floor = doppler_map(capture, bins=bins, v_max_mps=FINE.v_max_mps).values.mean(axis=1)
    # 400 frames x 14 gates x at least one native bin: 1.3 % at one sigma.
    np.testing.assert_allclose(floor, floor.mean(), rtol=0.07)


def test_an_axis_beyond_the_radar_marks_what_it_cannot_see() -> None:
    capture = capture_of(FINE, 0.5 * tone(FINE, 2.2, 1.0))
    axis = VelocityAxis(40, 5.0)  # bins of 0.25 m/s; this radar ends at 3.2 m/s
    wide = doppler_map(capture, axis=axis)
    assert wide.unseen_bins == (*range(7), *range(33, 40))
    assert not wide.values[list(wide.unseen_bins)].any()
    assert wide.values.sum() == pytest.approx(doppler_map(capture).values.sum(), rel=1e-5)
    assert "14 of 40 bins are unseen" in wide.meta["notes"][0]
    assert wide.meta["beyond_share"] == pytest.approx(0.0, abs=1e-6)


def test_a_narrow_axis_says_what_it_leaves_out() -> None:
    inside, outside = tone(FINE, 2.2, 1.0), tone(FINE, 4.0, 2.7)
    narrow = doppler_map(capture_of(FINE, 0.2 * inside + 0.1 * outside), bins=32, v_max_mps=2.0)
    assert narrow.unseen_bins == ()
    assert narrow.meta["beyond_share"] == pytest.approx(0.2, abs=0.005)
    assert any("of the power lies beyond ±2 m/s" in note for note in narrow.meta["notes"])


def test_a_chosen_stretch_of_range_holds_only_its_targets() -> None:
    capture = capture_of(LONG, 0.3 * tone(LONG, 2.2, 1.0) + 0.3 * tone(LONG, 6.0, -1.0))
    near = doppler_map(capture, range_m=(1.5, 3.0))
    far = doppler_map(capture, range_m=(5.0, 7.0))
    assert near.mean_velocity_mps()[0] == pytest.approx(1.0, abs=0.01)
    assert far.mean_velocity_mps()[0] == pytest.approx(-1.0, abs=0.01)
    step_m = LONG.range_resolution_m
    gates_m = near.meta["range_gates_m"]
    assert 1.5 - step_m / 2 <= gates_m[0] <= 1.5 + step_m / 2
    assert 3.0 - step_m / 2 <= gates_m[-1] <= 3.0 + step_m / 2


@given(st.floats(0.0, 3.0), st.floats(0.01, 3.0))
def test_limits_of_range_choose_among_the_points_of_a_radar_without_a_beat(
    low_m: float, depth_m: float
) -> None:
    points_m = (0.5, 1.0, 1.5, 2.0)
    config = replace(PAPER_RADAR, sampling="complex", samples_per_chirp=4, ranges_m=points_m)
    high_m = low_m + depth_m
    within_m = [one for one in points_m if low_m <= one <= high_m]
    options = ProcessingOptions(range_m=(low_m, high_m))
    if within_m:
        assert FrameChain(config, options).range_m.tolist() == within_m
    else:
        with pytest.raises(Sd2Error, match=r"0\.5 m to 2 m"):
            FrameChain(config, options)


def test_the_transmitters_leakage_does_not_count() -> None:
    # A slow drift over every chirp, strong and at zero range.
    drift = np.broadcast_to(0.9 * np.linspace(-1, 1, 128), (1, 1, 64, 128))
    capture = capture_of(LONG, drift)
    cells = range_doppler(capture, 0)
    assert cells.range_m[0] == pytest.approx(2 * LONG.range_resolution_m)
    assert cells.values.sum() < 0.05 * 2 * np.mean(drift**2)


@pytest.mark.parametrize("clutter", get_args(Clutter))
def test_blocks_and_single_frames_give_the_same(
    monkeypatch: pytest.MonkeyPatch, clutter: Clutter
) -> None:
    capture = noise_capture(replace(FINE, receivers=2), 90)
    options = {"clutter": clutter, "clutter_window_s": 0.5}
    whole = doppler_map(capture, **options)  # type: ignore[arg-type]
    monkeypatch.setattr(chain, "_BLOCK_BYTES", 1)
    steps: list[tuple[int, int]] = []
    blocks = doppler_map(
        capture,
        progress=lambda done, total: steps.append((done, total)),
        **options,  # type: ignore[arg-type]
    )
    np.testing.assert_allclose(blocks.values, whole.values, rtol=1e-4, atol=1e-9)
    assert len(steps) > 5
    assert steps[0] == (0, 90)
    assert steps[-1] == (90, 90)
    cells = range_doppler(capture, 41, **options)  # type: ignore[arg-type]
    np.testing.assert_allclose(cells.values.sum(axis=0), whole.values[:, 41], rtol=1e-4, atol=1e-9)
    assert cells.time_s == pytest.approx(41 / 30)


def test_it_stops_when_told() -> None:
    def stop(done: int, total: int) -> None:
        raise Cancelled

    with pytest.raises(Cancelled):
        doppler_map(noise_capture(FINE, 3), progress=stop)


@pytest.mark.parametrize("chirps", [1, 2, 3])
def test_a_filter_needs_no_more_chirps_than_there_are(chirps: int) -> None:
    signal = np.random.default_rng(0).standard_normal((2, 1, chirps, 8)).astype(np.float32)
    left = FrameChain(FINE, ProcessingOptions(clutter="regression")).without_own_clutter(signal)
    assert np.abs(left).max() < 1e-5


@pytest.mark.parametrize(("chirps", "samples", "window"), [(2, 3, "none"), (3, 7, "hann")])
def test_the_smallest_radars_work(chirps: int, samples: int, window: str) -> None:
    config = replace(FINE, chirps_per_frame=chirps, samples_per_chirp=samples)
    columns = doppler_map(noise_capture(config, 1), window=window)  # type: ignore[arg-type]
    assert np.isfinite(columns.values).all()
    assert columns.values.sum() > 0


def test_a_silent_capture_gives_an_empty_map() -> None:
    capture = capture_of(FINE, np.zeros((2, 1, 64, 32)))
    for clutter in get_args(Clutter):
        columns = doppler_map(capture, clutter=clutter)
        assert not columns.values.any()
        assert columns.meta["beyond_share"] == 0.0


def test_provenance_is_in_the_map(tmp_path: Path) -> None:
    clipped = np.clip(3.0 * tone(FINE, 2.2, 1.0), -1.0, 1.0 - 2.0**-15)
    columns = doppler_map(capture_of(FINE, clipped), bins=32, v_max_mps=2.0, clutter="mean")
    columns.save(tmp_path / "map.npz")
    meta = type(columns).load(tmp_path / "map.npz").meta
    assert meta["simulated"] is True
    assert meta["options"]["clutter"] == "mean"
    assert meta["radar"]["v_max_mps"] == FINE.v_max_mps
    assert meta["radar"]["chirps_per_frame"] == 64
    assert any("clipped by the converter" in note for note in meta["notes"])


def test_the_axis_is_the_radars_own_unless_asked_for() -> None:
    capture = noise_capture(FINE, 1)
    assert doppler_map(capture).axis == VelocityAxis(64, FINE.v_max_mps)
    assert doppler_map(capture, bins=10).axis == VelocityAxis(10, FINE.v_max_mps)
    assert doppler_map(capture, v_max_mps=2.0).axis == VelocityAxis(64, 2.0)
    with pytest.raises(Sd2Error, match="Both an axis and bins"):
        doppler_map(capture, axis=VelocityAxis(), bins=10)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"clutter": "median"}, "clutter is 'median'"),
        ({"window": "kaiser"}, "window is 'kaiser'"),
        ({"range_m": (3.0, 1.0)}, "range_m is"),
        ({"range_m": (0.5, np.inf)}, "range_m is"),
        ({"range_m": (1e300, 1e308)}, "No range gate is left from 1e.300 m"),
        ({"clutter": "moving", "clutter_window_s": np.inf}, "clutter_window_s is inf"),
        ({"range_m": (20.0, 30.0)}, "No range gate is left from 20 m to 30 m"),
        ({"range_m": (0.0, 0.2)}, "No range gate is left"),
        ({"clutter_window_s": 0.0}, "clutter_window_s is 0.0"),
    ],
)
def test_options_that_do_not_fit_are_explained(options: dict, sentence: str) -> None:
    with pytest.raises(Sd2Error, match=sentence):
        doppler_map(noise_capture(FINE, 1), **options)


def test_a_stretch_or_a_window_longer_than_everything_is_everything() -> None:
    capture = noise_capture(FINE, 3)
    far = doppler_map(capture, range_m=(0.0, 1e308), clutter="moving", clutter_window_s=1e308)
    near = doppler_map(capture, range_m=(0.0, 100.0), clutter="moving", clutter_window_s=100.0)
    np.testing.assert_array_equal(far.values, near.values)


def test_real_person_recedes_from_one_and_a_half_seconds(shared_data: Path) -> None:
    """Measured on `radar/infineon_people`, receding = faster than 0.125 m/s away.

    Before 1.25 s at most 1.6 % of the power that follows; the first frame
    above a tenth of it is at 1.51 s. From 1.75 s on receding power is 10 to 1,000
    times the approaching one, the mean velocity -0.25 to -0.51 m/s, and the
    strongest gate moves from 0.45 m to 1.2 m, which shows the sign without any
    Doppler.
    """
    capture = load_capture(shared_data / "radar" / "infineon_people")
    columns = doppler_map(capture, bins=32, v_max_mps=2.0, clutter="mean")
    assert columns.kind == "real"
    assert columns.unseen_bins == ()
    time_s, velocity_mps = columns.times_s, columns.axis.centres_mps
    receding = columns.values[velocity_mps < -0.125].sum(axis=0)
    approaching = columns.values[velocity_mps > 0.125].sum(axis=0)
    later = time_s > 1.75
    level = np.median(receding[later])
    assert receding[time_s < 1.25].max() < 0.05 * level
    onset_s = time_s[np.flatnonzero(receding > 0.1 * level)[0]]
    assert 1.3 < onset_s < 1.7
    assert (receding[later] > 5 * approaching[later]).all()
    assert np.median(receding[later] / approaching[later]) > 100
    mean_mps = columns.mean_velocity_mps()[later]
    assert (mean_mps < -0.2).all()
    strongest_m = [
        cells.range_m[cells.range_profile.argmax()]
        for cells in (range_doppler(capture, int(k), clutter="mean") for k in np.flatnonzero(later))
    ]
    walked_m = strongest_m[-1] - strongest_m[0]
    assert walked_m == pytest.approx(0.75, abs=0.16)
