"""Protocols of a campaign: the paper's is as the paper says, and varied is as it always was."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from sd2core.body.rotations import applied
from sd2core.body.shape import ShapeSpace
from sd2core.errors import Sd2Error
from sd2core.fmcw import ProcessingOptions
from sd2core.radar_config import PAPER_RADAR
from sd2core.simulate.campaign import radar
from sd2core.simulate.campaign.making import make_campaign
from sd2core.simulate.campaign.motion import LABELS, Performance, perform, plan_arms
from sd2core.simulate.campaign.protocol import PAPER, VARIED, Protocol
from sd2core.simulate.campaign.radar import TargetOptions
from sd2core.simulate.campaign.scene import random_setting, random_subject
from sd2core.simulate.campaign.takes import Campaign, TakeMaker

TIMES_S = np.arange(450) / 30.0
RANDOM = replace(PAPER, order="random")
PEOPLE, TAKES = range(4), range(6)


@pytest.fixture(scope="module")
def space() -> ShapeSpace:
    return ShapeSpace()


def swipes(space: ShapeSpace, protocol: Protocol) -> Iterator[tuple[int, list[int]]]:
    """Numbers of takes, with the labels of their swipes."""
    for person in PEOPLE:
        subject = random_subject(space, 7, person)
        for number in TAKES:
            rng = np.random.default_rng([7, person, number])
            arms = plan_arms(rng, subject, 15.0, protocol, number)
            moves = sorted((*arms["L"], *arms["R"]), key=lambda move: move.start_s)
            yield number, [move.label for move in moves if move.label]


def performed(space: ShapeSpace, protocol: Protocol, number: int) -> Performance:
    subject = random_subject(space, 7, 0)
    skeleton = space.skeleton(subject.shape)
    rng = np.random.default_rng([7, number])
    return perform(
        rng, subject, skeleton, space.base_skeleton, TIMES_S, protocol=protocol, number=number
    )


@pytest.mark.parametrize("protocol", [PAPER, RANDOM], ids=["to-and-fro", "random"])
def test_in_the_paper_the_sensor_is_2_2_m_ahead_of_everybody(protocol: Protocol) -> None:
    for seed in range(20):
        rng = np.random.default_rng(seed)
        setting = random_setting(rng, 1.5 + 0.025 * seed, 2, PAPER_RADAR, protocol)
        x, _, z = setting.place_m - setting.sensors[0].position_m
        assert (x, z) == (0.0, 2.2)
        assert setting.sensors[0].position_m == (0.0, 0.0, 0.0)  # where the camera is
        assert setting.heading_deg == 0.0
        np.testing.assert_array_equal(
            setting.place(np.eye(3, 4)[None, None])[0, 0, :, :3], np.eye(3)
        )


def test_place_and_heading_vary_one_by_one() -> None:
    def settings(protocol: Protocol) -> tuple[np.ndarray, np.ndarray]:
        drawn = [
            random_setting(np.random.default_rng(seed), 1.7, 1, PAPER_RADAR, protocol)
            for seed in range(20)
        ]
        return (
            np.array([[*one.place_m, *one.sensors[0].position_m] for one in drawn]),
            np.array([one.heading_deg for one in drawn]),
        )

    places, headings = settings(VARIED)
    assert np.ptp(places, axis=0)[[0, 1, 2, 3, 4]].min() > 0.1
    assert np.ptp(headings) > 10.0
    np.testing.assert_array_equal(settings(replace(RANDOM, place=True))[0], places)
    assert not settings(replace(RANDOM, place=True))[1].any()
    np.testing.assert_array_equal(settings(replace(RANDOM, heading=True))[1], headings)


def test_to_and_fro_one_kind_of_swipe_alternates(space: ShapeSpace) -> None:
    kinds = {number: set() for number in TAKES}
    for number, labels in swipes(space, PAPER):
        assert len(labels) >= 4
        assert all(one != other for one, other in pairwise(labels))
        kinds[number] |= set(labels)
    assert all(kinds[number] == {1, 2} for number in (0, 3))
    assert all(kinds[number] == {3, 4} for number in (1, 4))


def test_in_random_order_all_four_occur_in_takes(space: ShapeSpace) -> None:
    each = [labels for _, labels in swipes(space, RANDOM)]
    assert set().union(*each) == set(range(1, len(LABELS)))
    assert sum(len(set(labels)) > 2 for labels in each) > len(each) / 2


def test_hands_do_nothing_else_in_the_paper(space: ShapeSpace) -> None:
    """So of the same time more is swiped."""
    count = {
        name: sum(len(labels) for _, labels in swipes(space, protocol))
        for name, protocol in (("paper", RANDOM), ("others", replace(RANDOM, others=True)))
    }
    assert count["paper"] > count["others"]


@pytest.mark.parametrize("protocol", [PAPER, RANDOM], ids=["to-and-fro", "random"])
def test_every_third_take_of_the_paper_is_background(space: ShapeSpace, protocol: Protocol) -> None:
    found = [performed(space, protocol, number) for number in TAKES]
    assert [one.kind for one in found] == ["gestures", "gestures", "resting"] * 2
    for one in found:
        assert one.label.any() == (one.kind == "gestures")
    skeleton = space.skeleton(random_subject(space, 7, 0).shape)
    for bone in ("foot.R", "wrist.L", "wrist.R"):
        index = skeleton.index[bone]
        held = skeleton.transforms(*found[2].motion)[:, index]
        place_m = applied(held[..., :3], skeleton.heads_m[index]) + held[..., 3]
        assert np.ptp(place_m, axis=0).max() < 0.08


def test_varied_takes_are_as_before_there_were_protocols(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures of the program that knew no other, and took off the mean over chirps."""
    monkeypatch.setattr(radar, "PROCESSING", ProcessingOptions(clutter="mean"))
    campaign = Campaign(seed=3, take_seconds=2.0, target=TargetOptions(looks=1))
    (take,) = TakeMaker(campaign).make(0, 0)
    assert hashlib.sha256(take.label.tobytes()).hexdigest()[:12] == "0bd3183ac156"
    np.testing.assert_allclose(take.sensor_position_m, [0.14405738, 0.00489047, 0.0], atol=1e-8)
    # Matrix products differ in their last bits from machine to machine.
    assert take.synthetic.sum() == pytest.approx(4.453373908996582, rel=1e-3)
    assert take.radar.sum() == pytest.approx(2.1527886390686035, rel=1e-3)


def test_a_protocol_has_its_name_and_leaves_no_mark_where_it_is_varied() -> None:
    names = [one.name for one in (PAPER, RANDOM, replace(RANDOM, place=True), VARIED)]
    assert names == ["paper", "paper", "between", "varied"]
    assert "protocol" not in Campaign().provenance()
    said = Campaign(protocol=RANDOM).provenance()["protocol"]
    assert (said["name"], said["order"], said["place"]) == ("paper", "random", False)


def test_a_campaign_does_not_go_on_with_another_protocol(tmp_path: Path) -> None:
    short = Campaign(take_seconds=2.0, target=TargetOptions(looks=1), protocol=PAPER)
    out = tmp_path / "paper.zarr"
    assert make_campaign(out, short, subjects=1, minutes=0.03, processes=1) == 1
    assert make_campaign(out, short, subjects=1, minutes=0.03, processes=1) == 0
    for other in (RANDOM, VARIED):
        with pytest.raises(Sd2Error, match="provenance"):
            make_campaign(
                out, replace(short, protocol=other), subjects=1, minutes=0.03, processes=1
            )
