"""Parts of a study by closed forms: folds, shares, the classifier, certainty, the plan."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_pairs import AXIS, write_pairs

from sd2core.errors import Sd2Error
from sd2core.maps import mean_velocity_mps
from sd2core.pairs.labelling import TakeLabel, labelled
from sd2core.pairs.store import PairSet, read_pairs
from sd2core.sensor import VelocityAxis
from sd2core.study.certainty import adjusted, gain_of
from sd2core.study.folds import folds_of, labelled_takes, share_of
from sd2core.study.plan import read_study
from sd2core.study.windows import Ridge, at_speed, window_features


@pytest.fixture(scope="module")
def pairs(tmp_path_factory: pytest.TempPathFactory) -> PairSet:
    whole = read_pairs(write_pairs(tmp_path_factory.mktemp("p") / "pairs.zarr", takes=4))
    rows = [TakeLabel("*", f"t{number}", "ab"[number % 2]) for number in range(4)]
    return labelled(whole, [*rows, TakeLabel("s1", "t0", "c", 2.0, 3.0)])


def test_everybody_is_judged_beside_everybody_else() -> None:
    folds = folds_of(["p", "q", "r", "s"])
    assert len(folds) == 12
    for one in folds:
        assert {one.judged, one.video, *one.real} == {"p", "q", "r", "s"}
        assert one.judged != one.video
        assert len(one.real) == 2
    with pytest.raises(Sd2Error, match="2 people"):
        folds_of(["p", "q"])


def test_labels_become_classes_or_are_left_out(pairs: PairSet) -> None:
    names, takes = labelled_takes(pairs, {})
    assert names == ("a", "b", "c")
    assert len(takes) == 12
    names, takes = labelled_takes(pairs, {"a": "x", "c": "x", "b": "y"})
    assert names == ("x", "y")
    assert (takes[0].classes == 0).all()
    with pytest.raises(Sd2Error, match="nothing such"):
        labelled_takes(pairs, {"nothing such": "x"})
    with pytest.raises(Sd2Error, match="two or more"):
        labelled_takes(pairs, {"a": "x"})


@given(st.floats(0.01, 1.0), st.floats(0.01, 1.0), st.integers(0, 5))
@settings(max_examples=25, deadline=None)
def test_a_share_is_of_every_class_and_within_a_larger_one(
    pairs: PairSet, one: float, other: float, seed: int
) -> None:
    _, takes = labelled_takes(pairs, {})
    low, high = sorted((one, other))
    held = []
    for share in (low, high):
        found = share_of(takes, share, seed)
        frames = {
            (each.title, float(time_s)): int(number)
            for each in found
            for time_s, number in zip(each.take.times_s, each.classes, strict=True)
        }
        assert sum(len(each.classes) for each in found) == len(frames)  # none twice
        for number in range(3):
            total = sum(int((each.classes == number).sum()) for each in takes)
            assert sum(value == number for value in frames.values()) == max(1, round(share * total))
        held.append(frames)
    assert held[0].items() <= held[1].items()


def test_features_do_not_depend_on_the_gain_and_tell_movements_apart() -> None:
    rng = np.random.default_rng(0)
    maps, labels = [], []
    for number in range(8):
        towards = number % 2
        time_s = np.arange(120) / 30.0
        centre = 0.8 * np.sin(2 * np.pi * time_s * (0.5 + towards)) + 0.2 * rng.random()
        away = AXIS.centres_mps[None] - centre[:, None]
        maps.append(np.exp(-((away / 0.4) ** 2)).astype(np.float32))
        labels.append(np.full(120, towards))
    shown = [window_features(one, AXIS, 30.0, 1.0) for one in maps]
    louder = window_features(7.0 * maps[0], AXIS, 30.0, 1.0)
    np.testing.assert_allclose(louder, shown[0], atol=1e-5)
    weights = [np.ones(120) for _ in range(4)]
    ridge = Ridge.fitted(shown[:4], labels[:4], weights, 2)
    for features, label in zip(shown[4:], labels[4:], strict=True):
        assert (ridge.scores(features).argmax(axis=1) == label).mean() > 0.9
    empty = window_features(np.zeros((20, AXIS.bins), np.float32), AXIS, 30.0, 1.0)
    assert np.isfinite(empty).all()


@given(st.floats(0.5, 2.0))
@settings(max_examples=20, deadline=None)
def test_a_map_played_faster_has_its_velocities_and_times_scaled(speed: float) -> None:
    axis = VelocityAxis(64, 2.0)
    centre = 0.4 * np.sin(np.arange(200) / 15.0)
    values = np.exp(-(((axis.centres_mps[None] - centre[:, None]) / 0.2) ** 2)).astype(np.float32)
    played = at_speed(values, axis, speed)
    assert len(played) == pytest.approx(200 / speed, abs=1)
    wanted = speed * 0.4 * np.sin(np.arange(len(played)) * speed / 15.0)
    found = mean_velocity_mps(played, axis)
    inside = np.abs(wanted) < 1.2
    np.testing.assert_allclose(found[inside], wanted[inside], atol=0.08)
    np.testing.assert_array_equal(at_speed(values, axis, 1.0), values)


def test_nothing_gained_is_nothing_certain() -> None:
    rng = np.random.default_rng(3)
    chance = {who: rng.normal(0.0, 0.1, 20) for who in "abc"}
    found = gain_of(chance)
    assert found.certain == 0 or found.p > 0.01
    sure = gain_of({who: values + 0.3 for who, values in chance.items()})
    assert sure.certain == 1
    assert sure.mean == pytest.approx(found.mean + 0.3)
    assert sure.over_takes[0] == pytest.approx(found.over_takes[0] + 0.3)
    assert sure.p < 0.001
    assert gain_of({who: values - 0.3 for who, values in chance.items()}).certain == -1


def test_people_who_differ_make_it_uncertain_for_others() -> None:
    rng = np.random.default_rng(1)
    apart = {"a": rng.normal(0.6, 0.02, 30), "b": rng.normal(-0.1, 0.02, 30),
             "c": rng.normal(-0.1, 0.02, 30)}  # fmt: skip
    found = gain_of(apart)
    assert found.over_takes[0] > 0
    assert found.over_people[0] < 0 < found.over_people[1]


def test_many_takes_of_one_person_count_no_more() -> None:
    found = gain_of({"a": np.full(100, 0.2), "b": np.full(2, 0.0)})
    assert found.mean == pytest.approx(0.1)


@given(st.lists(st.floats(0, 1), min_size=1, max_size=12))
def test_holm_is_monotonic_and_no_smaller(values: list[float]) -> None:
    found = adjusted(values)
    assert all(value <= one <= 1 for value, one in zip(values, found, strict=True))
    assert min(found) == pytest.approx(min(1.0, len(values) * min(values)))
    order = np.argsort(values)
    assert (np.diff(np.array(found)[order]) >= 0).all()


PLAN = 'title = "t"\nout = "made"\npairs = ["a.zarr"]\n'


def test_paths_of_a_plan_are_beside_it(tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text(PLAN + 'labels = "l.csv"\n')
    plan = read_study(tmp_path / "s.toml")
    assert Path(plan.out) == tmp_path / "made"
    assert plan.pairs == (str(tmp_path / "a.zarr"),)
    assert plan.labels == str(tmp_path / "l.csv")
    assert len(plan.added) == 5


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (PLAN + "shares = [0.0]\n", "line 4: shares"),
        (PLAN + 'added = ["luck"]\n', "line 4: added"),
        (PLAN + "people = 3\n", "people is not known"),
        ('title = "t"\nout = "made"\n', "either pairs or recordings"),
        (PLAN.replace("pairs", "recordings") + 'subjects = ["a", "b"]\n', "a subject for each"),
        (PLAN + "[denoiser]\nminutes = 0\n", "line 5: denoiser.minutes"),
    ],
)
def test_a_plan_that_cannot_be_names_the_line(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "s.toml").write_text(text)
    with pytest.raises(Sd2Error, match=said):
        read_study(tmp_path / "s.toml")
