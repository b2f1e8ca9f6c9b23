"""Parts of a study by closed forms: folds, shares, the classifier, certainty, the plan."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_pairs import AXIS, write_pairs
from study_results import some_results
from swinging_recordings import recording

from sd2core.classify.data import Clip
from sd2core.cli import build_parser, run
from sd2core.errors import Sd2Error
from sd2core.labels.label_set import Label, LabelSet
from sd2core.labels.spans import Labels, LabelTrack, Span
from sd2core.maps import mean_velocity_mps
from sd2core.pairs.labelling import TakeLabel, label_pairs
from sd2core.recording.recording import open_recording
from sd2core.sensor import VelocityAxis
from sd2core.study.certainty import adjusted, gain_of
from sd2core.study.data import StudyData, kept_study_data, study_data_of
from sd2core.study.folds import folds_of, groups_of, share_of
from sd2core.study.plan import Learner, StudyPlan, read_study, study_text
from sd2core.study.report import _points, conclusion, findings_of, untried, write_report
from sd2core.study.trial import _judged, _played, describing, learnt
from sd2core.study.windows import Ridge, at_speed, window_features
from tests.damaged_files import lose


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = write_pairs(tmp_path_factory.mktemp("p") / "pairs.zarr", takes=4)
    rows = [TakeLabel("*", f"t{number}", "ab"[number % 2]) for number in range(4)]
    label_pairs(path, [*rows, TakeLabel("s1", "t0", "c", 2.0, 3.0)])
    return path


def plan_of(store: Path, **more: object) -> StudyPlan:
    return StudyPlan(title="t", out=str(store.parent / "out"), data=(str(store),), **more)


@pytest.fixture(scope="module")
def data(store: Path) -> StudyData:
    return study_data_of(plan_of(store))


def test_recordings_are_read_as_they_are_now(tmp_path: Path) -> None:
    folders = [recording(tmp_path / f"{name}.sd2").folder for name in ("anna", "ben")]
    plan = plan_of(tmp_path / "unused").model_copy(update={"data": tuple(map(str, folders))})
    (first, _) = study_data_of(plan).real
    one = open_recording(folders[0])
    one.spans = [one.spans[0].model_copy(update={"end_s": 2.5})]
    one.save()
    more = tuple(map(str, [*folders, recording(tmp_path / "carla.sd2").folder]))
    longer, *others = study_data_of(plan.model_copy(update={"data": more})).real
    assert np.count_nonzero(longer.clip.label) == np.count_nonzero(first.clip.label) + 15
    assert [one.clip.subject for one in others] == ["ben", "carla"]


def test_pairs_of_recordings_are_made_anew_by_other_code(tmp_path: Path, monkeypatch) -> None:
    folders = tuple(str(recording(tmp_path / f"{name}.sd2").folder) for name in ("anna", "ben"))
    for number, code in enumerate(("of before", "mended", "mended"), start=1):
        monkeypatch.setattr("sd2core.study.data.all_code_digest", lambda code=code: code)
        plan = plan_of(tmp_path / "unused").model_copy(update={"data": folders})
        study_data_of(plan.model_copy(update={"title": f"study {number}"}))
    assert len(list((tmp_path / "out").glob("pairs-*.zarr"))) == 2


def test_recordings_have_the_classes_of_their_label_sets(tmp_path: Path) -> None:
    """As for `sd2 classify`: pairs, which are made of them, hold labels alone."""
    for name in ("anna", "ben"):
        one = recording(tmp_path / f"{name}.sd2")
        spans = (Span(1, "Gestures", 1.0, 2.0, "swing"), Span(2, "Gestures", 3.0, 3.5, "talk"))
        known = LabelSet("Own", (Label("swing", "#0072b2", "", "up"), Label("talk", "#d55e00")))
        one.labels = Labels((LabelTrack("Gestures"),), spans, known)
        one.save()
    folders = tuple(str(tmp_path / f"{name}.sd2") for name in ("anna", "ben"))
    data = study_data_of(plan_of(tmp_path / "unused").model_copy(update={"data": folders}))
    assert data.known.classes == ("background", "up")
    assert np.bincount(data.real[0].clip.label + 1).tolist() == [15, 75, 30]


def test_everybody_is_judged_beside_everybody_else() -> None:
    folds = folds_of(["p", "q", "r", "s"], filmed=True)
    assert len(folds) == 12
    for one in folds:
        assert {one.judged, one.video, *one.real} == {"p", "q", "r", "s"}
        assert one.judged != one.video
        assert len(one.real) == 2
    once = folds_of(["p", "q", "r", "s"], filmed=True, turns="once")
    assert [one.judged for one in once] == ["p", "q", "r", "s"]
    assert set(once) <= set(folds)
    alone = folds_of(["p", "q"], filmed=False)
    assert [(one.judged, one.video, one.real) for one in alone] == [
        ("p", "", ("q",)), ("q", "", ("p",)),
    ]  # fmt: skip
    with pytest.raises(Sd2Error, match="keeps 2 apart"):
        folds_of(["p", "q"], filmed=True)


@given(st.integers(2, 6), st.integers(0, 9))
@settings(max_examples=20, deadline=None)
def test_movements_are_dealt_into_parts_of_every_class(
    data: StudyData, parts: int, seed: int
) -> None:
    group = groups_of(data.known, data.real, parts, seed)
    assert set(group) == {one.clip.key for one in data.real}
    assert len(set(group.values())) == parts
    sizes = [list(group.values()).count(one) for one in set(group.values())]
    assert max(sizes) - min(sizes) <= 1


def test_labels_become_classes_or_are_left_out(store: Path, data: StudyData) -> None:
    assert data.known.classes == ("a", "b", "c")
    assert len(data.real) == len(data.filmed) == 12
    # How often it is judged changes nothing of what is read.
    kept = kept_study_data(plan_of(store, seeds=7), "one")
    assert kept_study_data(plan_of(store), "one") is kept
    assert kept_study_data(plan_of(store), "other") is not kept
    classes = {"a": "x", "c": "x", "b": "y"}
    fewer = study_data_of(plan_of(store, classes=classes))
    assert fewer.known.classes == ("x", "y")
    assert (fewer.real[0].clip.label == 0).all()
    for classes, words in (({"nothing such": "x"}, "nothing such"), ({"a": "x"}, "two or more")):
        with pytest.raises(Sd2Error, match=words):
            study_data_of(plan_of(store, classes=classes))


def test_more_video_is_of_its_people_or_of_others(store: Path, tmp_path: Path) -> None:
    more = write_pairs(tmp_path / "more.zarr", ("s1", "stranger"), takes=1)
    label_pairs(more, [TakeLabel("*", "*", "b")])
    found = study_data_of(plan_of(store, video=(str(more),)))
    assert [one.title for one in found.others] == ["stranger/t0"]
    assert len(found.filmed) == 13
    assert all(one.clip.label.max() == 1 for one in found.others)
    assert len(found.real) == 12  # What is filmed only is never judged.


@pytest.mark.slow
def test_frames_in_damaged_chunks_are_left_out_and_told(tmp_path: Path) -> None:
    damaged = write_pairs(tmp_path / "pairs.zarr", takes=6)
    lose(damaged / "radar" / "c" / "1" / "0")  # frames 2250 to 2699, the last ones of s3
    found = study_data_of(plan_of(damaged))
    assert sum(len(one.clip) for one in found.real) == 2250
    assert found.lost_frames == 450
    results = replace(some_results(tmp_path), lost_frames=found.lost_frames)
    write_report(results, tmp_path)
    assert "450 frames are lost to damaged chunks" in (tmp_path / "study.md").read_text()


def test_radar_files_are_one_persons_movements(shared_data: Path, tmp_path: Path) -> None:
    folder = shared_data / "radar" / "kkt_gestures"
    plan = StudyPlan(title="t", out=str(tmp_path), data=(str(folder),), folds="files")
    found = study_data_of(plan)
    assert found.known.classes[0] == "background"
    assert len(found.real) == 8
    assert (found.kind, found.pairs, found.filmed) == ("real", None, ())
    half = share_of(found.known, found.real, 0.5, 0)
    # Whole movements, of every class one of two.
    assert sorted(int(one.clip.label.max()) for one in half) == [0, 1, 2, 3]
    assert all(len(one.clip) == 70 for one in half)


@given(st.floats(0.01, 1.0), st.floats(0.01, 1.0), st.integers(0, 5))
@settings(max_examples=25, deadline=None)
def test_a_share_is_of_every_class_and_within_a_larger_one(
    data: StudyData, one: float, other: float, seed: int
) -> None:
    takes = data.real
    low, high = sorted((one, other))
    held = []
    for share in (low, high):
        found = share_of(data.known, takes, share, seed)
        frames = {
            (each.title, float(time_s)): int(number)
            for each in found
            for time_s, number in zip(each.take.times_s, each.clip.label, strict=True)
        }
        assert sum(len(each.clip) for each in found) == len(frames)  # none twice
        for number in range(3):
            total = sum(int((each.clip.label == number).sum()) for each in takes)
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
    clips = [
        Clip("s", str(number), "real", one, label.astype(np.int8))
        for number, (one, label) in enumerate(zip(maps, labels, strict=True))
    ]

    def shown(clip: Clip) -> np.ndarray:
        return window_features(clip.energies, AXIS, 30.0, 1.0)

    louder = window_features(7.0 * maps[0], AXIS, 30.0, 1.0)
    np.testing.assert_allclose(louder, shown(clips[0]), atol=1e-5)
    ridge = Ridge.fitted(clips[:4], [1.0] * 4, 2, shown)
    for clip in clips[4:]:
        assert (ridge.scores(shown(clip)).argmax(axis=1) == clip.label).mean() > 0.9
    empty = window_features(np.zeros((20, AXIS.bins), np.float32), AXIS, 30.0, 1.0)
    assert np.isfinite(empty).all()


def test_what_weighs_nothing_changes_nothing(data: StudyData) -> None:
    """Clips are drawn by their frames, whether others are added or not."""
    clips = [one.clip.until(20 + 15 * n) for n, one in enumerate(data.real[:4])]
    learner = Learner(model="lstm", width=8, delay_s=0.0, steps=4)
    alone, beside = (
        learnt(learner, data.known, clips, added, 1e-12, 0, lambda clip: clip.energies)
        for added in ((), [one.clip for one in data.real[4:6]])
    )
    np.testing.assert_array_equal(alone(clips[0]), beside(clips[0]))


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


def test_ridge_regression_is_as_late_as_it_looks_ahead(store: Path, data: StudyData) -> None:
    learner, clip, frame = Learner(window_s=1.0), data.real[0].clip, 60
    describe = describing(learner, data.known)
    ahead = 14  # Frames at 30 frames/s.
    for changed in (frame + ahead, frame + ahead + 1):
        energies = clip.energies.copy()
        energies[changed] = energies[changed, ::-1]
        same = np.array_equal(describe(replace(clip, energies=energies))[frame],
                              describe(clip)[frame])  # fmt: skip
        assert same == (changed > frame + ahead)
    told = _judged(learner, plan_of(store), data, data.real, [], data.real, 0, describe)
    soonest_s = min(min(one.latencies_s, default=np.inf) for one in told.values())
    assert soonest_s == pytest.approx((ahead + 1) / 30.0)


@pytest.mark.parametrize("speed", [0.5, 0.8, 2.0])
def test_emptied_bins_stay_empty_at_any_speed(data: StudyData, speed: float) -> None:
    known = replace(data.known, null_bins=(3, 4))
    played = _played(data.real[0].clip, known, speed)
    assert played.energies[:, [2, 5]].all()
    assert not played.energies[:, [3, 4]].any()


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


def test_of_one_take_each_no_interval_over_takes_is_told() -> None:
    gain = gain_of({who: np.array([0.2]) for who in "abcdef"})
    assert _points(gain) == "+20.0 points (unknown over takes)"


def test_people_who_differ_make_it_uncertain_for_others() -> None:
    rng = np.random.default_rng(1)
    apart = {"a": rng.normal(0.6, 0.02, 30), "b": rng.normal(-0.1, 0.02, 30),
             "c": rng.normal(-0.1, 0.02, 30)}  # fmt: skip
    found = gain_of(apart)
    assert found.over_takes[0] > 0
    assert found.over_people[0] < 0 < found.over_people[1]


def test_of_few_people_it_is_said_that_they_tell_little(tmp_path: Path) -> None:
    two = some_results(tmp_path)
    again = "also counting that people differ"
    assert f"{again}, as far as 2 tell." in conclusion(two, findings_of(two))
    assert any("more people" in one for one in untried(two))
    runs = [
        replace(run, takes={name: {take.replace("ben/t", f"{who}/t"): score
                                   for take, score in own.items()}
                            for name, own in run.takes.items()})
        for run in two.runs for who in ("ben", "cleo", "dan", "eva")
    ]  # fmt: skip
    takes = [take for run in runs for take in run.takes["real"]]
    five = replace(two, runs=tuple(runs), subject_of={one: one[:-3] for one in takes})
    assert f"{again}." in conclusion(five, findings_of(five))
    assert not any("more people" in one for one in untried(five))


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


def test_holm_as_in_a_table() -> None:
    # The smallest of four counts four times, the next three times, and none less than before.
    assert adjusted([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])


PLAN = 'title = "t"\nout = "made"\ndata = ["a.zarr", "eve=b.sd2"]\n'


def test_paths_of_a_plan_are_beside_it(tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text(PLAN + 'labels = "l.csv"\n')
    plan = read_study(tmp_path / "s.toml")
    assert Path(plan.out) == tmp_path / "made"
    assert plan.data == (str(tmp_path / "a.zarr"), f"eve={tmp_path / 'b.sd2'}")
    assert plan.labels == str(tmp_path / "l.csv")
    assert len(plan.wanted) == 5
    (tmp_path / "again.toml").write_text(study_text(plan, tmp_path))
    assert read_study(tmp_path / "again.toml") == plan


def test_a_plan_is_written_with_the_options_of_its_denoiser(tmp_path: Path) -> None:
    options = "[denoiser.options]\nchannels = 8\nlive = false\n"
    (tmp_path / "s.toml").write_text(f"{PLAN}[denoiser]\nsteps = 20\n{options}")
    plan = read_study(tmp_path / "s.toml")
    (tmp_path / "again.toml").write_text(study_text(plan, tmp_path))
    assert read_study(tmp_path / "again.toml") == plan


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (PLAN + "shares = [0.0]\n", "line 4: shares"),
        (PLAN + 'added = ["luck"]\n', "line 4: added"),
        (PLAN + "people = 3\n", "people is not known"),
        ('title = "t"\nout = "made"\n', "data"),
        (PLAN + "[[classifiers]]\nmodel = 'oracle'\n", "classifiers"),
        (PLAN + "[denoiser]\nminutes = 0\n", "line 5: denoiser.minutes"),
    ],
)
def test_a_plan_that_cannot_be_names_the_line(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "s.toml").write_text(text)
    with pytest.raises(Sd2Error, match=said):
        read_study(tmp_path / "s.toml")


@pytest.mark.slow
def test_a_data_set_gives_what_the_radar_saw_with_its_synthetic_maps(
    store: Path, tmp_path: Path
) -> None:
    out = tmp_path / "set.zarr"
    words = ["export", str(store), "--out", str(out), "--segment-frames", "30", "--kinds"]
    assert run(build_parser()[0], [*words, "synthetic,simulated", "--overlap-frames", "0"]) == 0
    data = study_data_of(plan_of(store, folds="files"))
    found = study_data_of(StudyPlan(title="t", out=str(tmp_path), data=(str(out),), folds="files"))
    assert found.known.classes == data.known.classes
    assert {one.clip.subject for one in found.real} == {"s1", "s2", "s3"}
    for one in found.real:
        assert one.take is not None
        np.testing.assert_array_equal(one.take.radar, one.clip.energies)
        (own,) = [each.take for each in data.real if each.title == one.title]
        frames = len(one.clip)
        np.testing.assert_array_equal(one.take.synthetic, own.synthetic[:frames])
