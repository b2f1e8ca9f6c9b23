"""What tells left from right learns from takes whose truth is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sd2core.body.lifter_features import typical_size
from sd2core.body.sides import SIDED_PARTS
from sd2core.body.track import MIRRORED
from tools.train_lifter.swaps import Known, known_of, score_sides, spoilt, varied
from tools.train_lifter.takes import Take


@pytest.fixture(scope="module")
def right(takes: list[Take]) -> list[Take]:
    """Takes in which the landmark model is right."""
    return [
        replace(take, image_px=take.camera.project(take.keypoints_m).astype(np.float32))
        for take in takes
    ]


@pytest.mark.slow
def test_what_is_mirrored_is_known_by_the_truth(right: list[Take]) -> None:
    for number, members in enumerate(SIDED_PARTS.values()):
        rows = list(members)
        wrong = right[0].image_px.copy()
        wrong[5:9, rows] = wrong[5:9][:, [MIRRORED[row] for row in rows]]
        known = known_of(replace(right[0], image_px=wrong))
        clear = known.weight == 1.0
        expected = np.zeros_like(known.mirrored)
        expected[5:9, number] = 1.0
        np.testing.assert_array_equal(known.mirrored[clear], expected[clear])
        assert not known_of(right[0]).mirrored[known_of(right[0]).weight > 0.0].any()


def test_what_is_spoilt_is_told(right: list[Take]) -> None:
    """Swapping back what is marked gives what was there, unless frames were left out."""
    rng = np.random.default_rng(3)
    clean, marked = known_of(right[1]), 0
    clean = clean._replace(mirrored=np.zeros_like(clean.mirrored))
    size = float(typical_size(clean.seen.slopes))
    for _ in range(30):
        one = spoilt(rng, clean)
        back = np.array(one.seen.slopes)
        for number, members in enumerate(SIDED_PARTS.values()):
            rows, frames = list(members), one.mirrored[:, number] == 1.0
            marked += int(frames.sum())
            back[np.ix_(frames, rows)] = back[np.ix_(frames, [MIRRORED[row] for row in rows])]
        same = np.isclose(back, clean.seen.slopes, atol=0.1 * size).all(axis=(1, 2))
        assert same.all() or same.mean() >= 1.0 / 3.0
    assert marked > 0


def test_varied_stretches_keep_their_marks(right: list[Take]) -> None:
    """A mark goes with its frame."""
    clean = known_of(right[2])
    frames = np.arange(len(clean.mirrored), dtype=np.float32)
    told = Known(
        clean.seen._replace(sure=frames), np.repeat(frames[:, None], 3, axis=1), clean.weight
    )
    rng = np.random.default_rng(0)
    for _ in range(8):
        other = varied(rng, told, 12)
        np.testing.assert_array_equal(other.mirrored[:, 0], np.asarray(other.seen.sure))


def test_sides_of_a_landmark_model_that_is_right_are_scored(right: list[Take]) -> None:
    for found in score_sides(right).values():
        assert found.before == 0.0
        assert found.before_put_in > 0.0


def test_training_repeats(right: list[Take]) -> None:
    pytest.importorskip("torch")
    from tools.train_lifter.sides import SidesRecipe, train_sides
    from tools.train_lifter.training import TrainingArrays

    recipe = SidesRecipe(width=8, dilations=(1, 2), steps=3, batch=3, frames=(12, 20))
    one, meta = train_sides(TrainingArrays(right, ()), recipe)
    two, _ = train_sides(TrainingArrays(right, ()), recipe)
    for name, array in one.arrays.items():
        np.testing.assert_array_equal(array, two.arrays[name])
    assert one.arrays["leave"].shape == (8, len(SIDED_PARTS))
    assert meta["provenance"]["takes"] == len(right)
