"""Tables of trainings: what is compared, that nothing leaks, that runs are made once."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from labelled_clips import clip_set

from sd2core.classify.comparison import TableOptions, conditions_of, gains, make_table
from sd2core.classify.comparison_report import (
    as_json,
    as_markdown,
    as_text,
    draw_confusions,
    draw_curve,
    frame_recall,
)
from sd2core.classify.experiment import AMOUNT, PAPER, Condition, Network, choose, digest
from sd2core.classify.splitting import movements, split_clips
from sd2core.classify.training import TrainOptions
from sd2core.errors import Sd2Error
from sd2core.progress import Cancelled

BOTH = ("simulated", "synthetic")
KNOWN = clip_set(4, 5, frames=30, kinds=BOTH, placements=2)
ADDED = st.sampled_from(["nothing", "synthetic", "radar", "denoised"])
SMALL = Network(width=4)
OPTIONS = TableOptions(
    seeds=2,
    shares=(0.5, 1.0),
    network=SMALL,
    others=(PAPER,),
    training=TrainOptions(steps=2, batch=4, check_steps=2),
)
ONCE = replace(OPTIONS, seeds=1, shares=(1.0,))
ONE = Condition(network=SMALL)


def halved(clip):
    return replace(clip, kind="denoised", energies=clip.energies / 2)


@settings(max_examples=40, deadline=None)
@given(
    share=st.sampled_from([0.02, 0.1, 0.5, 1.0]),
    added=ADDED,
    moved=st.booleans(),
    seed=st.integers(0, 9),
)
def test_what_is_judged_was_never_learnt_from(
    share: float, added: str, moved: bool, seed: int
) -> None:
    chosen = choose(KNOWN, Condition(share, added, moved), seed, halved)
    learnt = {clip.subject for clip in (*chosen.real, *chosen.added)}
    judged = {clip.subject for clip in (*chosen.test, *chosen.moved)}
    chose = {clip.subject for clip in chosen.validation}
    assert len(learnt | judged | chose) == len(learnt) + len(judged) + len(chose)
    # What is added are other movements than the real ones.
    assert not set(movements(chosen.real)) & set(movements(chosen.added))
    for group in (chosen.real, chosen.validation, chosen.test):
        assert all(clip.kind == "simulated" and clip.placement == 0 for clip in group)
    assert all(clip.placement > 0 for clip in chosen.moved)
    wanted = {"radar": "simulated", "nothing": None}.get(added, added)
    assert {clip.kind for clip in chosen.added} == ({wanted} if wanted else set())
    assert {clip.placement for clip in chosen.added} <= ({0, 1} if moved else {0})


@pytest.mark.parametrize("seed", range(6))
def test_other_movements_of_the_same_people_are_judged(seed: int) -> None:
    known = clip_set(4, 9, kinds=BOTH, one_class=True)
    chosen = choose(known, Condition(added="synthetic"), seed, halved, same_people=True)
    parts = [chosen.real, chosen.added, chosen.validation, chosen.test]
    keys = [set(movements(clips)) for clips in parts]
    assert len(set().union(*keys)) == sum(map(len, keys)) == 4 * 9
    assert chosen.by_movement
    # Of every class two of twelve movements are judged, of anybody who is learnt from.
    assert sorted(clip.label[0] for clip in chosen.test) == [0, 0, 1, 1, 2, 2]
    learnt = {clip.subject for clip in (*chosen.real, *chosen.added)}
    assert {clip.subject for clip in chosen.test} <= learnt
    other = choose(known, Condition(), seed + 1, halved, same_people=True)
    assert {clip.key for clip in other.test} != keys[3]


def test_how_much_is_learnt_from() -> None:
    known = clip_set(3, 14, kinds=BOTH, frames=30)
    frames = [
        sum(map(len, choose(known, Condition(share), 0, halved).real))
        for share in (0.01, 0.1, 0.5, 1.0)
    ]
    # One subject of 14 movements: 4 may be added, of 10 the radar's maps are there.
    assert frames == [3, 30, 150, 300]
    added = choose(known, Condition(added="synthetic"), 0, halved).added
    assert sum(map(len, added)) == AMOUNT * 300


def test_the_first_place_counts_where_a_movements_own_sensor_saw_nothing() -> None:
    """A batch may look from planned places only, which are numbered from 1."""
    away = replace(
        KNOWN, clips=tuple(replace(clip, placement=clip.placement + 1) for clip in KNOWN.clips)
    )
    here, there = (choose(one, Condition(added="radar"), 1, halved) for one in (KNOWN, away))
    for name in ("real", "added", "validation", "test", "moved"):
        own, moved = getattr(here, name), getattr(there, name)
        assert own
        assert [clip.title for clip in own] == [clip.title for clip in moved]
    parts = split_clips(away, first_only=True)
    for clips in (parts.training, parts.validation, parts.test):
        assert clips
        assert {clip.placement for clip in clips} == {1}


def test_little_is_part_of_more() -> None:
    """So that a curve is not made by luck."""
    less, more = (choose(KNOWN, Condition(share), 3, halved).real for share in (0.2, 0.7))
    for one, other in zip(less, more, strict=False):
        assert one.key == other.key
        np.testing.assert_array_equal(one.energies, other.energies[: len(one)])


def test_without_synthetic_maps_all_movements_are_real() -> None:
    known = clip_set(3, 4)
    assert len(choose(known, Condition(), 0, halved).real) == 4
    with pytest.raises(Sd2Error, match="no synthetic maps"):
        choose(known, Condition(added="synthetic"), 0, halved)
    conditions = conditions_of(known, OPTIONS, denoised=False)
    assert {one.added for one in conditions} == {"nothing"}
    with pytest.raises(Sd2Error, match="no map of a radar"):
        choose(clip_set(3, 4, kinds=("synthetic",)), Condition(), 0, halved)


def test_every_condition_is_there_once() -> None:
    found = conditions_of(KNOWN, OPTIONS, denoised=True)
    assert len(found) == len(set(found))
    for added in ("synthetic", "denoised"):
        for moved in (False, True):
            assert Condition(network=SMALL, added=added, moved=moved) in found
    assert Condition(network=SMALL, added="radar") in found
    assert Condition(network=SMALL, share=0.5, added="denoised") in found
    assert Condition(network=PAPER) in found


@pytest.mark.slow
def test_a_table_that_was_stopped_goes_on(tmp_path: Path) -> None:
    whole = make_table(tmp_path / "whole", KNOWN, ONCE)
    calls: list[int] = []

    def stop(done: int, total: int) -> None:
        calls.append(done)
        if done == 3:
            raise Cancelled

    with pytest.raises(Cancelled):
        make_table(tmp_path / "parts", KNOWN, ONCE, progress=stop)
    written = sorted((tmp_path / "parts").iterdir())
    assert len(written) == 3
    written[0].write_text("{half of a", encoding="utf-8")
    stamps = {path: path.stat().st_mtime_ns for path in written[1:]}
    again = make_table(tmp_path / "parts", KNOWN, ONCE)
    assert {path: path.stat().st_mtime_ns for path in written[1:]} == stamps
    for one, other in zip(whole.runs, again.runs, strict=True):
        assert (one.condition, one.seed, one.subjects) == (
            other.condition,
            other.seed,
            other.subjects,
        )
        np.testing.assert_array_equal(one.score.frames, other.score.frames)


@pytest.mark.slow
def test_runs_of_other_data_or_settings_are_not_taken(tmp_path: Path) -> None:
    known = clip_set(3, 2, frames=30)
    make_table(tmp_path, known, ONCE)
    before = len(list(tmp_path.iterdir()))
    make_table(tmp_path, known, replace(ONCE, training=replace(ONCE.training, steps=4)))
    assert len(list(tmp_path.iterdir())) == 2 * before
    other = replace(known, clips=(known.clips[0].until(29), *known.clips[1:]))
    assert digest(other) != digest(known)


@pytest.mark.slow
def test_words_and_pictures_of_a_table(tmp_path: Path) -> None:
    table = make_table(tmp_path, KNOWN, OPTIONS)
    text, markdown = as_text(table), as_markdown(table)
    assert "simulated radar" in text
    assert "+ synthetic, moved sensors" in markdown
    assert "50%" in markdown
    told = json.loads(json.dumps(as_json(table)))
    plain = next(
        one for one in told["conditions"] if one["share"] == 0.5 and one["added"] == "nothing"
    )
    runs = table.of(Condition(network=SMALL, share=0.5))
    assert plain["mean_recall_frames"]["mean"] == pytest.approx(
        np.mean([run.score.mean_recall for run in runs])
    )
    extra = Condition(network=SMALL, share=0.5, added="synthetic")
    expected = [
        run.score.mean_recall - base.score.mean_recall
        for run, base in zip(table.of(extra), runs, strict=True)
    ]
    np.testing.assert_allclose(gains(table, extra, frame_recall), expected)
    assert len(draw_confusions(table).axes) >= 3
    axes = draw_curve(table).axes[0]
    assert [one.get_text() for one in axes.get_legend().get_texts()] == [
        "radar only",
        "+ synthetic",
    ]


def test_of_one_person_it_is_said(tmp_path: Path) -> None:
    known = clip_set(1, 6, frames=30, one_class=True)
    table = make_table(tmp_path, known, ONCE)
    assert table.by_movement
    assert "says nothing about other people" in as_text(table)
    same = make_table(tmp_path, KNOWN, replace(ONCE, same_people=True), conditions=[ONE])
    other = make_table(tmp_path, KNOWN, ONCE, conditions=[ONE])
    assert "of the same people; movements are kept apart" in as_text(same)
    # Neither is taken for the other.
    assert len(same.runs[0].subjects) > len(other.runs[0].subjects) == 1


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Condition(share=0.0), "0 of the real data"),
        (lambda: Condition(share=1.5), "1.5 of the real data"),
        (lambda: Condition(added="more"), "'more' is to be added"),
        (lambda: TableOptions(seeds=0), "0 seeds"),
        (lambda: TableOptions(shares=()), "shares"),
    ],
)
def test_what_makes_no_sense_is_refused(make, words: str) -> None:
    with pytest.raises(Sd2Error, match=words):
        make()
