"""What a frame of a simulated campaign costs, and what its coarse surface and looks do.

``pytest tests/benchmarks/test_campaign_speed.py --benchmark-only --capture=no`` prints all of
it; decision 26 quotes it.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from sd2core.body.model import Resolution
from sd2core.numerics.compiled import warm_up
from sd2core.pairs.store import Take
from sd2core.simulate.campaign.fit_errors import FitErrors
from sd2core.simulate.campaign.motion import perform
from sd2core.simulate.campaign.radar import TargetOptions, radar_target
from sd2core.simulate.campaign.scene import random_setting, random_subject
from sd2core.simulate.campaign.takes import OPTIONS, Campaign, TakeMaker

PEOPLE = 3
LOOKS = 36
FRAMES = slice(30, 90)
CAMPAIGN = Campaign(seed=11, take_seconds=4.0)


@pytest.mark.benchmark(group="simulated campaign")
def test_a_take(benchmark: Any, capsys: pytest.CaptureFixture[str]) -> None:
    warm_up()
    maker = TakeMaker(CAMPAIGN, FitErrors.load())
    worked_s = []

    def make() -> list[Take]:
        before = time.process_time()
        takes = maker.make(0, 0)
        worked_s.append(time.process_time() - before)
        return takes

    takes = benchmark.pedantic(make, rounds=3, warmup_rounds=1)
    with capsys.disabled():
        frames = len(takes[0].times_s)
        print(f"\none take: {1e3 * min(worked_s) / frames:.1f} ms of processor time per frame")
    assert takes[0].radar.any()


@pytest.mark.benchmark(group="simulated campaign")
def test_surface_and_looks(benchmark: Any, capsys: pytest.CaptureFixture[str]) -> None:
    warm_up()
    maker = TakeMaker(CAMPAIGN, FitErrors.load())
    many = benchmark.pedantic(
        lambda: [
            (
                target(maker, person, "low", LOOKS, 1),
                target(maker, person, "low", LOOKS, 2),
                target(maker, person, "medium", LOOKS, 3),
                {looks: target(maker, person, "low", looks, 4) for looks in (1, 4, 8, 12)},
            )
            for person in range(PEOPLE)
        ],
        rounds=1,
    )
    lines = []
    for name, pick in (("other phases", 1), ("medium surface", 2)):
        apart = [(apart_of(one[pick], one[0]), peaks_apart(one[pick], one[0])) for one in many]
        level = [float(one[pick].sum() / one[0].sum()) for one in many]
        lines.append(
            f"{name}, {LOOKS} looks: L1 {np.mean([a for a, _ in apart]):.3f}, peaks"
            f" {np.mean([p for _, p in apart]):.3f} m/s apart, power {np.mean(level):.3f}"
        )
    for looks in (1, 4, 8, 12):
        found = [peaks_apart(one[3][looks], one[0]) for one in many]
        lines.append(f"looks {looks}: peaks {np.mean(found):.3f} m/s from those of {LOOKS}")
    with capsys.disabled():
        print("\n" + "\n".join(lines))
    ratio = [one[2].sum() / one[0].sum() for one in many]
    assert 0.8 < np.mean(ratio) < 1.25


def target(
    maker: TakeMaker, person: int, surface: Resolution, looks: int, seed: int
) -> NDArray[np.float32]:
    """Target without noise of one person's gestures."""
    rngs = [np.random.default_rng([CAMPAIGN.seed, person, part]) for part in range(2)]
    space = maker._space
    subject = random_subject(space, CAMPAIGN.seed, person)
    skeleton = space.skeleton(subject.shape)
    times_s = np.arange(CAMPAIGN.frames, dtype=np.float64) / 30.0
    done = perform(rngs[0], subject, skeleton, space.base_skeleton, times_s, "gestures")
    setting = random_setting(rngs[1], subject.shape.stature_m, 1, CAMPAIGN.radar)
    transforms = setting.place(skeleton.transforms(*done.motion))
    mesh = maker._mesh(surface, subject.shape, transforms[FRAMES], times_s[FRAMES])
    return radar_target(
        mesh,
        CAMPAIGN.radar,
        setting.sensors[0],
        OPTIONS.axis,
        OPTIONS.null_bins,
        seed=[seed],
        options=TargetOptions(looks, None),
    )


def apart_of(one: NDArray[np.float32], other: NDArray[np.float32]) -> float:
    """Relative L1."""
    return float(np.abs(one - other).sum() / other.sum())


def peaks_apart(one: NDArray[np.float32], other: NDArray[np.float32]) -> float:
    """Mean distance of the peaks in m/s, where anything moves."""
    moving = other.max(axis=1) > 0.02 * other.max()
    centres = OPTIONS.axis.centres_mps
    difference = centres[one.argmax(axis=1)] - centres[other.argmax(axis=1)]
    return float(np.abs(difference[moving]).mean())
