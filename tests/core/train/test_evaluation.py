"""What an evaluation says of denoisers whose errors are known."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from small_pairs import AXIS, LABELS, write_pairs

from sd2core.denoise.card import ModelCard
from sd2core.denoise.live import TrainedDenoiser
from sd2core.denoise.registry import build
from sd2core.denoise.scaling import Compression, Scaling
from sd2core.errors import Sd2Error
from sd2core.pairs.store import PairSet, Take, read_pairs
from sd2core.train.evaluation import evaluate
from sd2core.train.evaluation_text import as_markdown, as_text, draw

FRAMES = 60


def lines(shift: int, noise: float = 0.0) -> PairSet:
    """The radar sees one bin at a time; the input has it ``shift`` bins higher."""
    takes = []
    for number, subject in enumerate(("s1", "s2", "s3")):
        rng = np.random.default_rng(number)
        peak = rng.integers(2, 6, FRAMES)
        radar = np.full((FRAMES, 8), noise, np.float32)
        radar[np.arange(FRAMES), peak] = 4.0
        synthetic = np.zeros((FRAMES, 8), np.float32)
        synthetic[np.arange(FRAMES), peak + shift] = 1.0
        # The last ten frames are still: the radar shows only noise.
        radar[-10:] = noise
        takes.append(
            Take(
                subject=subject,
                name="t",
                synthetic=synthetic,
                radar=radar,
                times_s=np.arange(FRAMES) / 30.0,
                label=(np.arange(FRAMES) < 20).astype(np.int8),
                sensor_position_m=np.zeros(3),
            )
        )
    return PairSet("simulated", AXIS, (), 30.0, LABELS, tuple(takes))


def model(pairs: PairSet, seed: int = 0, **about: Any) -> TrainedDenoiser:
    """Called a trained network, it answers with what it gets."""
    scaling = Scaling(Compression(1.0), Compression(4.0))
    card = ModelCard(
        model="gru",
        options={"channels": 4, "depth": 1},
        scaling=scaling,
        axis=pairs.axis,
        null_bins=pairs.null_bins,
        frame_rate_hz=pairs.frame_rate_hz,
        trained_on="simulated",
        about={"seed": seed, **about},
    )
    return TrainedDenoiser(build("none", 8), card)


def test_a_perfect_answer() -> None:
    pairs = lines(0)
    found = evaluate([model(pairs)], pairs)
    group = found.groups[-1]
    assert (group.name, group.trained) == ("gru (channels=4, depth=1)", True)
    assert group.values("peak", "mae_mps") == 0.0
    assert group.values("mean", "mae_mps") == pytest.approx(0.0, abs=1e-6)
    assert found.moving == 3 * (FRAMES - 10)
    # Where the radar shows nothing there is nothing to judge.
    assert group.reports[0].all.peak_all.empty_target == 30
    # A tenth of the frames of the input is there in vain: 1/5 of what is left in energy.
    assert group.values("map", "relative_l1") == pytest.approx(10 / (FRAMES - 10))


@pytest.mark.parametrize("shift", [-2, -1, 1, 2])
def test_an_answer_that_is_off_by_bins(shift: int) -> None:
    pairs = lines(shift)
    found = evaluate([model(pairs)], pairs)
    for group in (found.groups[0], found.groups[-1]):
        assert group.values("peak", "mae_mps") == pytest.approx(abs(shift) * 0.5)
        assert group.values("peak", "bias_mps") == pytest.approx(shift * 0.5)
        assert group.values("peak", "sd_mps") == pytest.approx(0.0, abs=1e-12)
    # A linear filter over the neighbouring bins can put that right.
    wiener = next(group for group in found.groups if group.name == "wiener")
    assert wiener.values("peak", "mae_mps") == 0.0


def test_takes_are_counted_for_every_model_and_filter() -> None:
    pairs, told = lines(0), []
    found = evaluate(
        [model(pairs, 0), model(pairs, 1)], pairs, progress=lambda *one: told.append(one)
    )
    total = 3 * sum(len(group.reports) for group in found.groups)
    assert told == [(done, total) for done in range(total + 1)]


def test_noise_is_no_movement() -> None:
    pairs = lines(1, noise=1e-3)
    report = evaluate([model(pairs)], pairs).groups[-1].reports[0]
    assert report.all.peak.frames == 3 * (FRAMES - 10)
    assert report.all.peak_all.frames == 3 * FRAMES
    assert report.all.peak.mae_mps == pytest.approx(0.5)


def test_gestures_and_people_add_up() -> None:
    pairs = lines(1)
    report = evaluate([model(pairs)], pairs).groups[-1].reports[0]
    assert list(report.by_label) == ["background", "swipe"]
    assert report.by_label["swipe"].frames == 3 * 20
    assert report.by_label["background"].peak.frames == 3 * (FRAMES - 30)
    assert {name: score.frames for name, score in report.by_subject.items()} == {
        "s1": FRAMES,
        "s2": FRAMES,
        "s3": FRAMES,
    }


def test_seeds_make_one_row() -> None:
    pairs = lines(1)
    three = [model(pairs, seed) for seed in range(3)]
    # Networks that shift the whole map by as many bins as their seed says.
    for seed, one in enumerate(three):
        one.network.correction = (  # type: ignore[method-assign]
            lambda values, seed=seed: torch.roll(values, seed, -1)
        )
    content = evaluate(three, pairs).to_json()["groups"][-1]
    # Off by 1, 2 and 3 bins of 0.5 m/s; those that fall over the edge are not looked at.
    assert [one["seed"] for one in content["models"]] == [0, 1, 2]
    assert content["peak_mae_mps"]["models"] == 3
    values = [one["all"]["peak"]["mae_mps"] for one in content["models"]]
    assert content["peak_mae_mps"]["mean"] == pytest.approx(np.mean(values))
    assert content["peak_mae_mps"]["sd"] == pytest.approx(np.std(values, ddof=1))
    assert values[0] == pytest.approx(0.5)
    assert values == sorted(values)


def test_who_is_judged() -> None:
    pairs = lines(0)
    told = {"subjects": {"training": ["s1"], "validation": ["s2"], "test": ["s3"]}}
    found = evaluate([model(pairs, **told)], pairs)
    assert (found.subjects, found.notes) == (("s3",), ())
    found = evaluate([model(pairs, **told)], pairs, ["s2", "s3"])
    assert found.subjects == ("s2", "s3")
    assert any("subjects called s2" in note for note in found.notes)
    real = evaluate([model(pairs, **told)], replace(pairs, kind="real"))
    assert any("learnt from simulated radar" in note for note in real.notes)


def test_who_was_learnt_from_among_others_is_known_again() -> None:
    """Trainings on several stores call a person ``STORE:NAME``, a store alone does not."""
    pairs = lines(1)
    learnt = {"training": ["a:s1", "b:s1"], "validation": ["b:s2"], "test": ["b:s3"]}
    several = model(pairs, subjects=learnt)
    apart = evaluate([several], pairs)
    assert (apart.subjects, apart.notes) == (("s3",), ())
    (note,) = evaluate([several], pairs, ("s1", "s3")).notes
    assert "has learnt from, or was chosen by, subjects called s1" in note


def test_only_what_the_own_sensor_saw(tmp_path: Path) -> None:
    pairs = read_pairs(write_pairs(tmp_path / "p.zarr", placements=3))
    one = model(pairs)
    assert evaluate([one], pairs).frames * 3 == evaluate([one], pairs, first_only=False).frames


def test_a_model_that_does_not_fit() -> None:
    pairs = lines(0)
    with pytest.raises(Sd2Error, match=r"frame rate of the model gru is 30\.0"):
        evaluate([model(pairs)], replace(pairs, frame_rate_hz=10.0))
    assert evaluate([model(pairs)], replace(pairs, frame_rate_hz=29.97)).frames == pairs.frames


def test_tables_and_picture() -> None:
    pairs = lines(1)
    found = evaluate([model(pairs, seed) for seed in range(2)], pairs)
    text = as_text(found)
    assert "gru (channels=4, depth=1)" in text
    assert "0.500 ± 0.000" in text
    assert "| wiener | 1 | 0.000 |" in as_markdown(found)
    figure = draw(found)
    heights = [patch.get_height() for patch in figure.axes[0].patches]
    assert heights == pytest.approx(
        [group.values("peak", "mae_mps").mean() for group in found.groups]
    )
