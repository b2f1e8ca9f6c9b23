"""Landmarks of takes as they are repaired, and what fits of them teach about errors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sd2core.body.lifter import Lifter, fit_law_terms
from tools.train_lifter.fits import fit_law, fitted_takes, repaired
from tools.train_lifter.takes import Take


@pytest.mark.slow
def test_what_is_right_stays_and_what_jumps_away_comes_back(takes: list[Take]) -> None:
    take = takes[0]
    np.testing.assert_allclose(repaired(take).image_px, take.image_px, atol=1e-3)
    wrong = take.image_px.copy()
    wrong[12, 15] += 150.0
    found = repaired(replace(take, image_px=wrong))
    assert np.abs(found.image_px - take.image_px).max() < 15.0


def test_frames_without_the_person_are_bridged_and_not_trusted(takes: list[Take]) -> None:
    confidence = takes[1].confidence.copy()
    confidence[10:13] = 0.0
    found = repaired(replace(takes[1], confidence=confidence))
    assert not found.confidence[10:13].any()
    assert np.isfinite(found.image_px).all()


@pytest.mark.slow
def test_the_law_of_fits_covers_the_errors_it_was_learnt_from(takes: list[Take]) -> None:
    lifter = Lifter.load()
    law = fit_law(takes, lifter)
    assert law.shape == lifter.fit_law.shape
    fits = fitted_takes(takes, replace(lifter, fit_law=law))
    errors = np.concatenate([np.abs(fit.fitted_mps - fit.true_mps) for fit in fits])
    stated = np.concatenate(
        [
            replace(lifter, fit_law=law).fit_sigma_mps(fit.lifted_sd_mps, fit.speed_mps)
            for fit in fits
        ]
    )
    np.testing.assert_allclose((errors <= stated).mean(axis=0), 0.68, atol=0.02)
    assert (fit_law_terms(np.zeros((1, 33)), np.zeros((1, 33))) > 0.0).all()
