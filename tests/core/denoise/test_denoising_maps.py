"""Whole maps and frames as they come."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
import torch
from denoisers import CAUSAL, SMALL, WINDOWED, energies, synthetic_map, trained

from sd2core.denoise import live
from sd2core.denoise import resample_to_model as matching
from sd2core.denoise.causal_models import SerialS4Denoiser
from sd2core.denoise.files import load_model, save_model
from sd2core.denoise.live import TrainedDenoiser
from sd2core.denoise.model import Denoiser
from sd2core.denoise.registry import build
from sd2core.doppler import PRESETS
from sd2core.errors import Sd2Error
from sd2core.maps import CellUncertainty, DopplerMap
from sd2core.progress import Cancelled
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase


@pytest.fixture
def short_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live, "CHUNK", 32)
    monkeypatch.setattr(live, "_ROUND", 16)
    for model in (Denoiser, SerialS4Denoiser):
        monkeypatch.setattr(model, "longest", 64)


@pytest.mark.parametrize("name", ["s4", "unet"])
def test_what_is_weaker_than_the_floor_is_empty(name: str) -> None:
    doppler = synthetic_map(energies(90))
    without = trained(name)
    answers = without.denoise(doppler).values
    floor = float(np.median(answers[answers > 0]))
    with_floor = trained(name, scaling=replace(without.card.scaling, floor=floor))
    found = with_floor.denoise(doppler).values
    np.testing.assert_array_equal(found, np.where(answers < floor, 0.0, answers))
    live_frames = with_floor.live().advance(matching.input_of(doppler))
    assert not ((live_frames > 0) & (live_frames < floor)).any()


@pytest.mark.one_in(5)
@pytest.mark.parametrize("name", SMALL)
def test_where_nothing_moves_there_is_nothing(name: str) -> None:
    values = energies(90)
    values[40:60, [0, *range(17, 32)]] = 0.0
    values[45:60] = 0.0
    values[50, 15] = 0.5  # in an emptied bin
    doppler = synthetic_map(values)
    model = trained(name)
    for found in (model.denoise(doppler).values.T, model.live().advance(values)):
        assert not found[45:60].any()
        assert found[40:45].any(axis=1).all()


@pytest.mark.parametrize("name", SMALL)
def test_the_map_says_what_it_is(name: str) -> None:
    doppler = synthetic_map(energies(90), meta={"sensor": {"position_m": [0, 0, 1]}, "a": 1})
    denoised = trained(name, about={"data": "here"}, title="T").denoise(doppler)
    assert denoised.kind == "denoised"
    assert denoised.unit == "power"
    assert denoised.axis == doppler.axis
    assert denoised.null_bins == (14, 15, 16)
    np.testing.assert_array_equal(denoised.times_s, doppler.times_s)
    assert denoised.meta["input"] == doppler.meta
    assert denoised.meta["sensor"] == {"position_m": [0, 0, 1]}
    assert denoised.meta["denoiser"]["trained_on"] == "simulated"
    assert denoised.meta["denoiser"]["data"] == "here"
    assert (denoised.values >= 0).all()
    assert np.isfinite(denoised.values).all()
    assert not denoised.values[[14, 15, 16]].any()
    assert denoised.values.any()


def test_without_denoising_levels_are_brought_together() -> None:
    values = energies(50)
    denoiser = trained("none")
    expected = denoiser.card.scaling.target.expand(denoiser.card.scaling.input.compress(values))
    expected[:, [14, 15, 16]] = 0.0
    np.testing.assert_array_equal(denoiser.denoise_values(values), expected)


@pytest.mark.one_in(7)
@pytest.mark.parametrize("name", CAUSAL)
@pytest.mark.parametrize("frames", [1, 15, 32, 33, 64, 65, 100])
def test_chunks_of_long_maps_change_nothing(name: str, frames: int, short_chunks: None) -> None:
    denoiser, values = trained(name), energies(frames)
    with torch.no_grad():
        nulled = values.copy()
        nulled[:, [14, 15, 16]] = 0.0
        compressed = denoiser.card.scaling.input.compress(torch.from_numpy(nulled))
        whole = denoiser.card.scaling.target.expand(denoiser.network(compressed[None])[0]).numpy()
    whole[:, [14, 15, 16]] = 0.0
    np.testing.assert_allclose(
        denoiser.denoise_values(values), whole, rtol=2e-4, atol=1e-5 * whole.max()
    )


@pytest.mark.one_in(3)
@pytest.mark.parametrize("name", CAUSAL)
def test_live_equals_batch(name: str, short_chunks: None) -> None:
    denoiser, values = trained(name), energies(70)
    stream = denoiser.live()
    assert stream.equals_batch
    batch = denoiser.denoise_values(values)
    frames = np.stack([stream.step(frame) for frame in values])
    np.testing.assert_allclose(frames, batch, rtol=2e-4, atol=1e-5 * batch.max())


@pytest.mark.slow
@pytest.mark.parametrize("name", [*CAUSAL, *WINDOWED])
def test_several_frames_at_once_are_those_one_by_one(name: str, short_chunks: None) -> None:
    denoiser, values = trained(name), energies(100)
    one_by_one, at_once = denoiser.live(), denoiser.live()
    present = np.ones(100, bool)
    present[[0, 20, 21, 59, 60, 99]] = False  # at the ends of blocks too
    stepped = np.stack(
        [one_by_one.step(*frame) for frame in zip(values, present.tolist(), strict=True)]
    )
    blocks = [
        at_once.advance(values[start:stop], present[start:stop])
        for start, stop in ((0, 20), (20, 60), (60, 61), (61, 100))
    ]
    np.testing.assert_allclose(
        np.concatenate(blocks), stepped, rtol=1e-3, atol=1e-5 * stepped.max()
    )


@pytest.mark.one_in(2)
@pytest.mark.parametrize("name", WINDOWED)
def test_live_windows_answer_for_the_newest_frame(name: str) -> None:
    denoiser, values = trained(name), energies(80)
    stream = denoiser.live()
    assert not stream.equals_batch
    frames = np.stack([stream.step(frame) for frame in values])
    # From the 72nd frame on it is the last frame of a batch of the last 72.
    for last in (71, 79):
        batch = denoiser.denoise_values(values[last - 71 : last + 1])
        np.testing.assert_allclose(frames[last], batch[-1], rtol=1e-3, atol=1e-5 * batch.max())


@pytest.mark.one_in(5)
@pytest.mark.parametrize("name", [*CAUSAL, *WINDOWED])
def test_live_forgets_where_nobody_is(name: str) -> None:
    denoiser, values = trained(name), energies(30)
    fresh, stream = denoiser.live(), denoiser.live()
    for frame in energies(10, seed=5):
        stream.step(frame)
    assert not stream.step(values[0], present=False).any()
    for frame in values[:5]:
        np.testing.assert_array_equal(stream.step(frame), fresh.step(frame))


BOTH_WAYS = {"channels": 4, "depth": 1, "state_size": 4, "bidirectional": True}


def looking_both_ways(path: Path) -> TrainedDenoiser:
    card = replace(trained("s4").card, options=BOTH_WAYS)
    save_model(path, TrainedDenoiser(build("s4", **BOTH_WAYS), card))
    return load_model(path)


def test_a_state_space_that_looks_both_ways_sees_the_whole_clip(tmp_path: Path) -> None:
    denoiser, values = looking_both_ways(tmp_path / "both.safetensors"), energies(200)
    assert not denoiser.network.causal
    assert not denoiser.live().equals_batch
    other = values.copy()
    other[190] *= 4.0
    moved = np.abs(denoiser.denoise_values(values) - denoiser.denoise_values(other))
    assert moved[:60].any()
    for frames in (1, 7):
        assert denoiser.denoise_values(values[:frames]).shape == (frames, 32)


def test_pieces_of_a_long_clip_are_nearly_those_of_the_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    denoiser, values = looking_both_ways(tmp_path / "both.safetensors"), energies(700)
    at_once = denoiser.denoise_values(values)
    monkeypatch.setattr(live, "PIECE", 200)
    # A border 36 frames away does not matter much.
    assert np.abs(denoiser.denoise_values(values) - at_once).max() < 0.02 * at_once.max()


@pytest.mark.parametrize("name", WINDOWED)
@pytest.mark.parametrize("frames", [1, 30, 72, 100])
def test_windows_cover_maps_of_any_length(name: str, frames: int) -> None:
    denoiser, values = trained(name), energies(frames)
    answer = denoiser.denoise_values(values)
    assert answer.shape == values.shape
    if frames >= 72:
        # Where windows do not overlap it is the answer of one of them.
        first = denoiser.denoise_values(values[:72])
        np.testing.assert_allclose(answer[0], first[0], rtol=1e-3, atol=1e-6)


@pytest.mark.parametrize("name", SMALL)
def test_stretches_are_clips_of_their_own(name: str) -> None:
    values = energies(120)
    present = np.ones(120, bool)
    present[40:47] = False
    values[~present] = 0.0
    denoiser = trained(name)
    denoised = denoiser.denoise(synthetic_map(values, present=present))
    np.testing.assert_array_equal(denoised.present, present)
    assert not denoised.values[:, 40:47].any()
    for part in (slice(0, 40), slice(47, 120)):
        alone = denoiser.denoise_values(values[part])
        np.testing.assert_allclose(denoised.values.T[part], alone, rtol=1e-5)


def test_a_long_break_in_time_begins_a_new_clip() -> None:
    values = energies(60)
    times_s = np.arange(60) / 30.0
    times_s[25:] += 2.0
    denoiser = trained("gru")
    denoised = denoiser.denoise(synthetic_map(values, timebase=Timebase(times_s)))
    np.testing.assert_allclose(
        denoised.values.T[25:], denoiser.denoise_values(values[25:]), rtol=1e-5
    )
    assert "notes" not in denoised.meta


@pytest.mark.parametrize(("peak", "said"), [(0.0, False), (5e-4, True), (2e-3, False)])
def test_what_is_far_fainter_than_what_was_learnt_is_said(peak: float, said: bool) -> None:
    values = energies(60)
    values *= np.float32(peak / values.max())
    denoised = trained("gru").denoise(synthetic_map(values))
    notes = denoised.meta.get("notes", [])
    assert len(notes) == said
    assert all("0.05 times the mean energy" in note for note in notes)


def test_a_map_that_is_counted_otherwise_than_what_was_learnt_is_said() -> None:
    usual = asdict(PRESETS["paper"])
    model = trained("gru", about={"provenance": {"mixed": [{"synthesis": usual}, {}]}})
    notes = {}
    for name, options in {"usual": usual, "other": usual | {"weight": "area"}}.items():
        doppler = synthetic_map(energies(60), meta={"options": options})
        notes[name] = model.denoise(doppler).meta.get("notes", [])
    assert notes["usual"] == []
    assert "weight area in place of count" in notes["other"][0]


class TestFrameRates:
    @pytest.mark.parametrize("rate_hz", [29.5, 30.5])
    def test_small_differences_are_none(self, rate_hz: float) -> None:
        denoiser, values = trained("gru"), energies(60)
        denoised = denoiser.denoise(synthetic_map(values, rate_hz))
        np.testing.assert_array_equal(denoised.values.T, denoiser.denoise_values(values))
        assert "notes" not in denoised.meta

    @pytest.mark.parametrize("rate_hz", [60.0, 15.0])
    def test_an_even_multiple_there_and_back(self, rate_hz: float) -> None:
        # A straight line in time is interpolated without error, there and back.
        frames = 41
        level = np.linspace(1.0, 2.0, frames)[:, None]
        values = (0.01 * level * np.linspace(0.5, 1.5, 32)).astype(np.float32)
        doppler = synthetic_map(values, rate_hz)
        denoised = trained("none", scaling=trained("none").card.scaling).denoise(doppler)
        scaling = trained("none").card.scaling
        expected = scaling.target.expand(scaling.input.compress(doppler.values))
        # Energies of the answer are not straight in time; between frames they bend a little.
        np.testing.assert_allclose(denoised.values, expected, rtol=2e-3)
        assert any("interpolated" in note for note in denoised.meta["notes"])

    def test_the_model_gets_its_own_rate(self) -> None:
        # What was at 60 frames/s is seen by the model as it would be at 30.
        values = energies(61)
        fast = matching.interpolated(values, np.arange(61) / 30.0, np.arange(121) / 60.0)
        denoiser = trained("gru")
        at_30 = denoiser.denoise(synthetic_map(values, 30.0))
        at_60 = denoiser.denoise(synthetic_map(fast, 60.0))
        np.testing.assert_allclose(at_60.values[:, ::2], at_30.values, rtol=1e-3, atol=1e-9)

    def test_uneven_frames_are_made_even(self) -> None:
        random = np.random.default_rng(0)
        steps = random.choice([1.0, 2.0], size=80) / 30.0
        times_s = np.cumsum(steps)
        denoised = trained("gru").denoise(synthetic_map(energies(80), timebase=Timebase(times_s)))
        assert any("interpolated" in note for note in denoised.meta["notes"])

    @pytest.mark.parametrize("rate_hz", [120.0, 7.5])
    def test_four_times_more_or_less_is_not_far(self, rate_hz: float) -> None:
        timebase = Timebase(np.arange(90) / rate_hz)  # whose rate is rounded to either side
        assert trained("gru").denoise(synthetic_map(energies(90), timebase=timebase)).values.any()

    def test_far_from_it_is_refused(self) -> None:
        with pytest.raises(Sd2Error, match="5 frames/s"):
            trained("gru").denoise(synthetic_map(energies(20), 5.0))

    def test_a_single_frame_has_no_rate(self) -> None:
        denoised = trained("gru").denoise(synthetic_map(energies(1)))
        assert denoised.values.any()


class TestMapsThatDoNotFit:
    def test_another_kind(self) -> None:
        doppler = synthetic_map(energies(5))
        real = DopplerMap(doppler.values, doppler.axis, doppler.timebase, "real")
        with pytest.raises(Sd2Error, match=r"kind 'real'.*sd2 synth"):
            trained("gru").denoise(real)

    @pytest.mark.parametrize("axis", [VelocityAxis(32, 3.0), VelocityAxis(16, 2.0)])
    def test_another_axis(self, axis: VelocityAxis) -> None:
        doppler = DopplerMap(
            np.ones((axis.bins, 4), np.float32), axis, Timebase.regular(4, 30.0), "synthetic"
        )
        with pytest.raises(Sd2Error, match=r"--bins 32 --v-max 2"):
            trained("gru").denoise(doppler)

    def test_bins_that_are_missing(self) -> None:
        with pytest.raises(Sd2Error, match=r"Bins 3 .*--null-bins 14,15,16"):
            trained("gru").denoise(synthetic_map(energies(5), null_bins=(3, 14, 15, 16)))
        with pytest.raises(Sd2Error, match=r"--null-bins none"):
            trained("gru", null_bins=()).denoise(synthetic_map(energies(5)))

    def test_bins_that_the_model_does_not_know_are_emptied(self) -> None:
        values = energies(20)
        denoiser = trained("gru")
        full = denoiser.denoise(synthetic_map(values, null_bins=()))
        np.testing.assert_array_equal(full.values, denoiser.denoise(synthetic_map(values)).values)
        assert full.null_bins == (14, 15, 16)
        assert any("emptied" in note for note in full.meta["notes"])

    def test_frames_of_other_shapes(self) -> None:
        with pytest.raises(Sd2Error):
            trained("gru").live().step(np.zeros(31, np.float32))
        with pytest.raises(Sd2Error):
            trained("gru").denoise_values(np.zeros((4, 31), np.float32))


def test_what_is_uncertain_before_is_not_said_of_the_answer() -> None:
    doppler = synthetic_map(energies(5))
    known = CellUncertainty(doppler.values, doppler.values)
    uncertain = synthetic_map(energies(5), uncertainty=known)
    assert trained("gru").denoise(uncertain).uncertainty is None


def test_the_input_is_left_alone() -> None:
    values = energies(20)
    before = values.copy()
    trained("gru").denoise_values(values)
    stream = trained("gru").live()
    stream.step(values[0])
    np.testing.assert_array_equal(values, before)


@pytest.mark.parametrize("rate_hz", [15.0, 30.0, 60.0])
@pytest.mark.parametrize("name", ["gru", "unet"])
def test_it_reports_and_stops(name: str, rate_hz: float, short_chunks: None) -> None:
    seen: list[tuple[int, int]] = []
    trained(name).denoise(
        synthetic_map(energies(200), rate_hz), lambda done, total: seen.append((done, total))
    )
    assert seen == sorted(seen)
    assert seen[-1] == (200, 200)
    assert {total for _, total in seen} == {200}

    def stop(done: int, total: int) -> None:
        raise Cancelled

    with pytest.raises(Cancelled):
        trained(name).denoise(synthetic_map(energies(200)), stop)


def test_a_denoised_map_is_saved_and_read(tmp_path: Path) -> None:
    denoised = trained("gru").denoise(synthetic_map(energies(20)))
    denoised.save(tmp_path / "map.npz")
    read = DopplerMap.load(tmp_path / "map.npz")
    assert read.kind == "denoised"
    np.testing.assert_array_equal(read.values, denoised.values)
    assert read.meta == denoised.meta


@pytest.mark.parametrize("frames", [3, 8, 50])
def test_windows_may_be_shorter_than_the_usual_overlap(frames: int) -> None:
    """As of a network of another package, which learns with segments of 8 frames."""
    model = trained("none")
    model.network.causal, model.network.window = False, 8
    values = energies(frames)
    with torch.no_grad():
        plain = model.network(torch.from_numpy(values)[None])[0].numpy()
    np.testing.assert_allclose(model._in_windows(values, lambda *_: None), plain, atol=1e-6)
