"""Beam, things, walls and other people are measured, and left out where they change too little."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from accuracy_scenes import ball, swinging

from sd2core.accuracy.choosing import choose
from sd2core.accuracy.measuring import measure
from sd2core.accuracy.plans import AccuracyPlan
from sd2core.accuracy.results import Choice, Reason
from sd2core.accuracy.trial import synthesizer_for
from sd2core.doppler import PRESETS, Synthesizer
from sd2core.errors import Sd2Error
from sd2core.io.things import with_things, with_walls
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.things import Thing
from sd2core.mesh.walls import Wall
from sd2core.sensor import Beam, VirtualSensor

PAPER = PRESETS["paper"]
BEAMED = VirtualSensor(beam=Beam(120.0, 90.0))
BOX = Thing("box", (0.15, 0.2, 1.0), size_m=(0.2, 0.4, 0.1))


def body() -> MeshSequence:
    return ball(swinging((0, 0, 2), 1.0, 0.7), fineness=3)


def reason(choice: Choice, setting: str) -> Reason:
    return next(one for one in choice.reasons if one.setting == setting)


@pytest.mark.one_in(2)
@pytest.mark.parametrize(("loss_db", "modelled"), [(25.0, False), (0.0, True)])
def test_walls_are_modelled_where_they_matter(loss_db: float, modelled: bool) -> None:
    scene = with_walls(body(), [Wall.named("right", 1.0, loss_db)])
    choice = choose(scene, VirtualSensor(), tolerance=0.05)
    assert choice.holds, choice.summary
    found = reason(choice, "walls")
    assert found.modelled == modelled
    assert ("walls" not in choice.plan.left_out) == modelled
    assert (found.value > 0.05) == modelled
    without = Synthesizer(body(), "paper").map().values
    with_them = Synthesizer(scene, "paper").map().values
    change = float(np.abs(with_them - without).sum() / with_them.sum())
    assert found.value == pytest.approx(change, rel=0.5)
    ending = "modelled" if modelled else "not modelled at a tolerance of 5.0 %"
    assert found.text.startswith("walls change this map by ")
    assert found.text.replace("5 %", "5.0 %").endswith(ending)
    made = synthesizer_for(choice.plan, scene, PAPER).map()
    assert ("walls" in made.meta) == modelled


@pytest.mark.slow
def test_each_part_and_other_people_have_their_sentence() -> None:
    other = ball(swinging((0.6, 0, 2.4), 1.5, 0.9), fineness=3)
    scene = with_walls(with_things(replace(body(), others=(other,)), [BOX]), [Wall(3.0, 20.0)])
    choice = choose(scene, BEAMED, tolerance=0.02)
    said = {one.setting: one for one in choice.reasons}
    assert {"beam", "things", "walls", "people"} <= set(said)
    assert said["beam"].text.startswith("the beam changes this map by ")
    assert said["people"].modelled
    options = replace(PAPER, visibility="exact")
    together, alone = (
        Synthesizer(one, options).map(BEAMED).values for one in (scene, replace(scene, others=()))
    )
    change = float(np.abs(together - alone).sum() / together.sum())
    assert said["people"].value == pytest.approx(change, rel=0.5)
    for part in ("beam", "things", "walls"):
        assert said[part].modelled == (part not in choice.plan.left_out)
    plain = choose(body(), VirtualSensor(), tolerance=0.02)
    assert not {one.setting for one in plain.reasons} & {"beam", "things", "walls", "people"}


def test_a_plan_leaves_out_what_it_says() -> None:
    scene = with_walls(with_things(body(), [BOX]), [Wall.named("floor", 0.8)])
    top = AccuracyPlan()
    for parts, alike, sensor in (
        (("walls",), with_things(body(), [BOX]), BEAMED),
        (("things",), with_walls(body(), [Wall.named("floor", 0.8)]), BEAMED),
        (("beam",), scene, replace(BEAMED, beam=None)),
        (("beam", "things", "walls"), body(), replace(BEAMED, beam=None)),
    ):
        plan = replace(top, left_out=parts)
        like = synthesizer_for(replace(top, left_out=("things", "walls")), scene, PAPER)
        expected = synthesizer_for(top, alike, PAPER).map(sensor).values
        for made in (None, like):
            found = synthesizer_for(plan, scene, PAPER, like=made).map(BEAMED).values
            np.testing.assert_array_equal(found, expected)


@pytest.mark.slow
def test_the_table_of_plans_has_each_part_left_out() -> None:
    plain = ball(swinging((0, 0, 2), 1.0, 0.7), fineness=2, frames=20)
    scene = with_walls(with_things(plain, [BOX]), [Wall.named("right", 1.0)])
    measured = measure(scene, BEAMED, repeats=1, memory=False)
    without = {one.plan.left_out: one.errors.l1 for one in measured.results}
    assert {("beam",), ("things",), ("walls",)} < set(without)
    assert without["walls",] > 0.02


def test_a_plan_says_what_it_leaves_out_and_comes_back_from_json() -> None:
    plan = AccuracyPlan(left_out=("walls", "beam"))
    assert str(plan).endswith("without beam, walls")
    assert AccuracyPlan.from_json(json.loads(json.dumps(plan.to_json()))) == plan
    with pytest.raises(Sd2Error, match="beam, things, walls"):
        AccuracyPlan(left_out=("people",))  # type: ignore[arg-type]
