"""Suggestions: motion that is there is found, quiet and noise are left alone."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import ArrayLike, NDArray

from sd2core.doppler import Synthesizer
from sd2core.errors import Sd2Error
from sd2core.files.resources import resource_path
from sd2core.io.mesh import load_mesh
from sd2core.io.radar.kkt import load_kkt
from sd2core.labels.spans import Labels, LabelTrack, Span
from sd2core.labels.suggest import TRACK, motion_energy_db, suggest_spans
from sd2core.maps import DopplerMap
from sd2core.options.suggesting import SuggestOptions
from sd2core.recording.recording import open_recording
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase

BINS, RATE = 16, 20.0
STILL = slice(7, 9)
"""Bins beside zero velocity."""
PLAIN = SuggestOptions(margin_s=0.0, hold_s=0.0)


def doppler_map(
    values: ArrayLike, times_s: ArrayLike | None = None, **fields: object
) -> DopplerMap:
    values = np.asarray(values, np.float32)
    bins, frames = values.shape
    timebase = Timebase.regular(frames, RATE) if times_s is None else Timebase(times_s)
    return DopplerMap(values, VelocityAxis(bins, 2.0), timebase, "real", **fields)


def pulses(frames: int, *moving: tuple[int, int], gain: float = 100.0) -> NDArray[np.float32]:
    """A quiet level of 1 in every bin, `gain` in frames that move, but at zero velocity."""
    values = np.ones((BINS, frames), np.float32)
    for start, stop in moving:
        values[:, start:stop] = gain
    values[STILL] = 1.0
    return values


def mean_db(gain: float) -> float:
    """Energy of `pulses` where all that moves has this gain."""
    return 10 * np.log10(((BINS - 2) * gain + 2) / BINS)


def kkt_files(shared_data: Path) -> list[Path]:
    folders = [shared_data / "radar" / name for name in ("kkt_gestures", "kkt_gestures_more")]
    return [path for folder in folders for path in sorted(folder.glob("*.h5"))]


def frames_of(spans: tuple[Span, ...], timebase: Timebase) -> list[tuple[int, int]]:
    return [timebase.frames_between(span.start_s, span.end_s) for span in spans]


def found(doppler: DopplerMap, options: SuggestOptions = PLAIN) -> list[tuple[int, int]]:
    return frames_of(suggest_spans(doppler, options), doppler.timebase)


def overlap(a: Span, b: tuple[float, float]) -> float:
    """Intersection over union."""
    both = max(0.0, min(a.end_s, b[1]) - max(a.start_s, b[0]))
    return both / (a.duration_s + b[1] - b[0] - both)


def test_energy_is_the_ratio_to_the_quiet_level_in_db() -> None:
    energy_db = motion_energy_db(doppler_map(pulses(100, (40, 50), gain=100.0)))
    # Averaged over three frames: the edges are lower, the middle is exact.
    np.testing.assert_allclose(energy_db[41:49], mean_db(100.0), atol=1e-6)
    np.testing.assert_allclose(np.delete(energy_db, np.arange(39, 51)), 0.0, atol=1e-6)
    np.testing.assert_allclose(energy_db[39], mean_db((1 + 1 + 100) / 3), atol=1e-6)


def test_bins_are_measured_against_their_own_quiet_level() -> None:
    """What stands still hides nothing, however strong it is."""
    values = pulses(100, (40, 50))
    # All bins are above the floor, which is 30 dB below the strongest frame.
    values *= np.logspace(-0.5, 0.5, BINS, dtype=np.float32)[:, None]
    values[STILL] *= 1e3
    assert found(doppler_map(values)) == found(doppler_map(pulses(100, (40, 50)))) == [(39, 51)]


echoes = hnp.arrays(np.float64, 100, elements=st.floats(0.01, 1.0))
sidelobes = hnp.arrays(np.float64, 32, elements=st.floats(1e-4, 0.047))


@given(echo=echoes, shares=sidelobes)
def test_what_stands_still_is_quiet_however_its_echo_changes(echo, shares) -> None:
    """It leaks into every bin in proportion; of the 32, two at zero velocity change."""
    values = shares[:, None] * echo
    values[15:17] = echo
    assert suggest_spans(doppler_map(values), replace(PLAIN, high_db=PLAIN.low_db)) == ()
    values[20:26, 40:60] += 10.0
    assert found(doppler_map(values)) == [(39, 61)]


@pytest.mark.parametrize(("gain", "over"), [(20.0, 20.0), (1e4, 1 / 0.0472)])
def test_no_more_than_the_highest_sidelobe_is_taken_for_one(gain: float, over: float) -> None:
    """What is as strong in all bins is in the main lobe of none: 13.3 dB above a sidelobe."""
    values = np.ones((BINS, 100))
    values[:, 40:50] = gain
    energy_db = motion_energy_db(doppler_map(values))
    np.testing.assert_allclose(energy_db[41:49], 10 * np.log10(over), atol=1e-6)


def test_spans_are_suggestions_with_a_reason() -> None:
    doppler = doppler_map(pulses(200, (40, 60), (120, 140), gain=20.0))
    spans = suggest_spans(doppler, label="swipe")
    assert [span.id for span in spans] == [1, 2]
    for span in spans:
        assert (span.origin, span.label, span.track) == ("suggestion", "swipe", TRACK)
        assert span.note == "up to 12 dB over the quiet level"
    Labels((LabelTrack(TRACK),), spans)


@given(st.floats(6.4, 1e4))
def test_confidence_is_how_far_the_threshold_could_be_raised(gain: float) -> None:
    doppler = doppler_map(pulses(100, (40, 60), gain=gain))
    (span,) = suggest_spans(doppler, PLAIN)
    assert span.confidence is not None
    assert 0 <= span.confidence < 1
    reached_db = PLAIN.high_db / (1 - span.confidence)
    below = replace(PLAIN, high_db=max(reached_db - 1e-3, PLAIN.low_db))
    assert len(suggest_spans(doppler, below)) == 1
    above = replace(PLAIN, high_db=reached_db + 1e-3)
    assert suggest_spans(doppler, above) == ()


def test_two_thresholds_keep_a_span_whole() -> None:
    values = pulses(100, (30, 60), gain=5.0)  # 6.5 dB: over the low one only
    assert found(doppler_map(values)) == []
    values[9:, 40:44] = 50.0
    assert found(doppler_map(values)) == [(30, 60)]


def test_what_is_too_short_is_left_out() -> None:
    # A pulse of n frames is heard for n + 2 through the average of three.
    values = pulses(100, (40, 42))
    assert found(doppler_map(values)) == [(39, 43)]
    assert found(doppler_map(values), replace(PLAIN, min_duration_s=0.21)) == []


def test_short_gaps_are_merged_and_long_ones_are_not() -> None:
    values = pulses(200, (40, 60), (64, 80))  # quiet for two frames after averaging: 0.1 s
    assert found(doppler_map(values)) == [(39, 81)]
    assert found(doppler_map(values), replace(PLAIN, merge_gap_s=0.09)) == [(39, 61), (63, 81)]


def test_margins_end_at_the_ends_and_leave_a_third_of_the_quiet_between_neighbours() -> None:
    doppler = doppler_map(pulses(100, (2, 20), (30, 60)))
    assert found(doppler) == [(1, 21), (29, 61)]
    assert found(doppler, replace(PLAIN, margin_s=0.1)) == [(0, 23), (27, 63)]
    assert found(doppler, replace(PLAIN, margin_s=9.0)) == [(0, 23), (27, 100)]
    assert found(doppler, replace(PLAIN, margin_s=0.05, hold_s=0.2)) == [(0, 23), (28, 66)]


@given(
    values=hnp.arrays(
        np.float32,
        st.tuples(st.integers(2, 6), st.integers(1, 40)),
        elements=st.floats(0, 1e6, width=32),
    ),
    data=st.data(),
)
def test_any_map_gives_spans_that_a_track_can_hold(values, data) -> None:
    frames = values.shape[1]
    steps = data.draw(st.lists(st.floats(0.005, 2.0), min_size=frames, max_size=frames))
    present = data.draw(hnp.arrays(np.bool_, frames))
    doppler = doppler_map(values, 5.0 + np.cumsum(steps), present=present)
    spans = suggest_spans(doppler)
    Labels((LabelTrack(TRACK),), spans)  # apart from each other
    for span in spans:
        assert span.confidence is not None
        assert doppler.times_s[0] <= span.start_s < span.end_s <= doppler.timebase.end_s + 1e-9
        first, stop = doppler.timebase.frames_between(span.start_s, span.end_s)
        assert present[first:stop].all()


@given(
    gain=st.floats(1e-6, 1e6),
    seed=st.integers(0, 1000),
    offset_s=st.floats(-100, 100),
)
@settings(max_examples=25)
def test_neither_scale_nor_order_of_bins_nor_clock_matters(gain, seed, offset_s) -> None:
    rng = np.random.default_rng(seed)
    values = rng.exponential(size=(BINS, 120)) * pulses(120, (30, 60), (80, 100))
    energy_db = motion_energy_db(doppler_map(values))
    away = np.delete(np.arange(BINS), STILL)
    shuffled = values.copy()
    shuffled[away] = values[rng.permutation(away)]
    for other in (gain * values, shuffled):
        np.testing.assert_allclose(motion_energy_db(doppler_map(other)), energy_db, atol=1e-3)
    doppler = doppler_map(values)
    moved = suggest_spans(doppler.shifted(offset_s))
    assert frames_of(moved, doppler.shifted(offset_s).timebase) == found(doppler, SuggestOptions())


@given(
    seed=st.integers(0, 2**32 - 1),
    bins=st.integers(8, 40),
    frames=st.integers(1, 600),
    kind=st.sampled_from(["power", "magnitude", "uniform"]),
)
def test_white_noise_gives_no_span(seed, bins, frames, kind) -> None:
    """From 8 bins on; the 3,000 clips of docs/decisions/0032 gave none and 4.5 dB at most."""
    rng = np.random.default_rng(seed)
    draw = {"power": rng.exponential, "magnitude": rng.rayleigh, "uniform": rng.uniform}[kind]
    assert suggest_spans(doppler_map(draw(size=(bins, frames)))) == ()


def test_an_empty_map_has_no_energy() -> None:
    doppler = doppler_map(np.zeros((BINS, 50)))
    np.testing.assert_array_equal(motion_energy_db(doppler), 0.0)
    assert suggest_spans(doppler) == ()


def test_what_is_lost_in_rounding_has_no_energy() -> None:
    values = np.full((2, 10), 3e-41, np.float32)
    values[:, 0] = 1.0
    present = np.arange(10) == 1
    energy_db = motion_energy_db(doppler_map(values, present=present))
    np.testing.assert_array_equal(energy_db[present], 0.0)


@pytest.mark.parametrize("value", [0.0, 1.0])
def test_one_frame_is_its_own_quiet_level(value: float) -> None:
    doppler = doppler_map(np.full((BINS, 1), value))
    np.testing.assert_array_equal(motion_energy_db(doppler), 0.0)
    assert suggest_spans(doppler) == ()


def test_what_never_rests_is_quiet() -> None:
    assert suggest_spans(doppler_map(np.full((BINS, 200), 50.0))) == ()


def test_emptied_and_unseen_bins_change_nothing() -> None:
    rng = np.random.default_rng(3)
    values = rng.exponential(size=(BINS, 120)) * pulses(120, (30, 60))
    kept = motion_energy_db(doppler_map(values[2:-2]))
    emptied = values.copy()
    emptied[[0, 1, -2, -1]] = 0.0
    loud = values.copy()
    loud[[0, 1, -2, -1], 90:] = 1e6
    for doppler in (
        doppler_map(emptied),
        doppler_map(loud, null_bins=(0, 1), unseen_bins=(BINS - 2, BINS - 1)),
    ):
        np.testing.assert_allclose(motion_energy_db(doppler), kept, atol=1e-6)
    all_left_out = doppler_map(values, null_bins=tuple(range(BINS)))
    np.testing.assert_array_equal(motion_energy_db(all_left_out), 0.0)


def test_frames_without_a_person_say_nothing_and_part_spans() -> None:
    values = pulses(100, (30, 60))
    values[:, 45] = 0.0
    present = np.ones(100, bool)
    present[45] = False
    doppler = doppler_map(values, present=present)
    assert np.isnan(motion_energy_db(doppler)[45])
    # Nothing is averaged or merged across the gap, and no margin reaches over it.
    assert found(doppler) == [(29, 45), (46, 61)]
    assert found(doppler, replace(PLAIN, margin_s=0.1)) == [(27, 45), (46, 63)]
    nobody = doppler_map(values, present=np.zeros(100, bool))
    assert np.isnan(motion_energy_db(nobody)).all()
    assert suggest_spans(nobody) == ()


def test_times_may_be_uneven() -> None:
    """What lasts long is found however few frames it has; a pause is no motion."""
    steps = np.where(np.arange(100) % 2, 0.02, 0.08)
    doppler = doppler_map(pulses(100, (40, 60)), np.cumsum(steps))
    (span,) = suggest_spans(doppler, PLAIN)
    assert span.start_s == pytest.approx(doppler.times_s[40], abs=0.05 + 1e-9)
    assert span.end_s == pytest.approx(doppler.times_s[60], abs=0.05 + 1e-9)
    times_s = np.arange(100) / RATE
    times_s[50:] += 10.0
    paused = doppler_map(pulses(100, (40, 60)), times_s)
    first, second = suggest_spans(paused, SuggestOptions())
    assert first.end_s == pytest.approx(times_s[49] + 1 / RATE)
    assert second.start_s == times_s[50]


@pytest.mark.parametrize("value", [np.nan, np.inf, -1.0])
def test_values_that_are_no_energy_are_refused(value: float) -> None:
    values = pulses(10)
    values[3, 7] = value
    with pytest.raises(Sd2Error, match=r"in bin 3 of frame 7"):
        suggest_spans(doppler_map(values))


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"low_db": 9.0}, "low_db is 9 and high_db 7"),
        ({"low_db": 0.0}, "low_db is 0"),
        ({"high_db": float("nan")}, "high_db is nan"),
        ({"margin_s": -0.1}, "margin_s is -0.1"),
        ({"hold_s": -0.1}, "hold_s is -0.1"),
        ({"min_duration_s": float("inf")}, "min_duration_s is inf"),
    ],
)
def test_options_that_make_no_sense_are_refused(fields: dict[str, float], words: str) -> None:
    with pytest.raises(Sd2Error, match=words):
        SuggestOptions(**fields)


def test_the_eight_swipes_of_the_sample_are_found() -> None:
    """Of the true body; what else moves (arms raised and lowered between) is suggested too."""
    recording = open_recording(resource_path("swipes.sd2"))
    swipes = [
        (span["start_s"], span["end_s"])
        for span in json.loads(resource_path("swipes.sd2/recording.json").read_text())["spans"]
    ]
    true = load_mesh(recording.folder / "mesh.zarr")
    spans = suggest_spans(Synthesizer(true, preset="paper").map(recording.sensor))
    assert len(swipes) == 8
    assert len(spans) == 12
    best = [max(spans, key=lambda span, swipe=swipe: overlap(span, swipe)) for swipe in swipes]
    assert len({span.id for span in best}) == 8
    assert min(overlap(span, swipe) for span, swipe in zip(best, swipes, strict=True)) > 0.8
    surest = sorted(spans, key=lambda span: -(span.confidence or 0.0))[:8]
    assert sum(span in best for span in surest) >= 7, "swipes come before what else moves"


def test_real_gestures_are_met_and_backgrounds_mostly_left_alone(shared_data: Path) -> None:
    """A suggestion holds the middle of every label; docs/real-gestures.md says how well it fits."""
    backgrounds = []
    for path in kkt_files(shared_data):
        recorded = load_kkt(path)
        spans = suggest_spans(recorded.doppler)
        if recorded.gesture == "Background":
            backgrounds.append(bool(spans))
        for label in recorded.labels.spans:
            middle_s = (label.start_s + label.end_s) / 2
            assert any(span.start_s <= middle_s < span.end_s for span in spans), path.name
    assert 2 * sum(backgrounds) < len(backgrounds)


def test_a_real_still_echo_leaks_as_through_a_rectangular_window(shared_data: Path) -> None:
    """Four bins are one of the sensor's: bin 6 is in the middle of the highest sidelobe."""
    shares = []
    for path in kkt_files(shared_data):
        values = load_kkt(path).doppler.values.astype(np.float64)
        shares.append(np.median(values / values[15], axis=1))
    for offset in (1, 2, 6):
        leaked = np.median([(one[15 - offset] + one[15 + offset]) / 2 for one in shares])
        assert 10 * np.log10(leaked / np.sinc(offset / 4) ** 2) == pytest.approx(0.0, abs=0.6)


def test_a_real_echo_that_grows_and_fades_is_hardly_motion(shared_data: Path) -> None:
    """A hundredfold echo lifts the seven bins of its main lobe, not the other 24."""
    for path in kkt_files(shared_data):
        doppler = load_kkt(path).doppler
        if "Background" in path.name:
            values = doppler.values.copy()
            values[:, 20:45] *= 100.0
            louder_db = motion_energy_db(replace(doppler, values=values))
            assert (louder_db - motion_energy_db(doppler)).max() < 8.0, path.name
