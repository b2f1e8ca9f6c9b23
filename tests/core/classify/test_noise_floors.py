"""Noise floors of clips that are learnt from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from classifiers import CLASSES, NULLED
from hypothesis import given, settings
from hypothesis import strategies as st
from labelled_clips import clip_set

from sd2core.classify.data import BELOW_LOUDEST_DB, some_noisy, with_noise_floor
from sd2core.classify.live import judge
from sd2core.classify.training import TrainOptions, train

KNOWN = clip_set(4, 4, kinds=("synthetic",))
COUNTED = [number for number in range(32) if number not in NULLED]


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32), gain=st.sampled_from([1e-9, 1.0, 1e6]))
def test_noise_is_as_far_below_the_loudest_as_it_says(seed: int, gain: float) -> None:
    clip = replace(KNOWN.clips[0], energies=(gain * KNOWN.clips[0].energies).astype(np.float32))
    noisy = with_noise_floor(clip, NULLED, np.random.default_rng(seed))
    added = noisy.energies - clip.energies
    below_db = 10 * np.log10(clip.energies.max() / added[:, COUNTED].mean())
    low, high = BELOW_LOUDEST_DB
    assert low - 1 < below_db < high + 1
    assert not added[:, list(NULLED)].any()
    assert noisy.energies.dtype == np.float32
    np.testing.assert_array_equal(noisy.label, clip.label)


def test_a_share_of_the_clips_gets_it_and_a_silent_one_stays_silent() -> None:
    clips = KNOWN.clips * 20
    changed = [a is not b for a, b in zip(clips, some_noisy(clips, NULLED, 0.3, 1), strict=True)]
    assert 0.2 < np.mean(changed) < 0.4
    assert some_noisy(clips, NULLED, 0.0, 1) == list(clips)
    silent = replace(clips[0], energies=np.zeros_like(clips[0].energies))
    assert not some_noisy([silent], NULLED, 1.0, 1)[0].energies.any()


@pytest.mark.slow
def test_who_learnt_from_maps_without_noise_knows_those_with_it() -> None:
    short = TrainOptions(steps=40, batch=8, check_steps=10, learning_rate=0.02, delay_s=0.0)
    noisy = some_noisy(KNOWN.clips[12:], NULLED, 1.0, 5)
    told = {}
    for share in (0.0, 0.5):
        made = train(KNOWN.clips[:8], KNOWN.clips[8:12], KNOWN, replace(short, noisy_share=share))
        assert judge(made.classifier, KNOWN.clips[12:], KNOWN).mean_recall > 0.95
        told[share] = judge(made.classifier, noisy, KNOWN).mean_recall
    assert told[0.5] > 0.95
    assert told[0.0] < told[0.5]
    assert KNOWN.classes == CLASSES
