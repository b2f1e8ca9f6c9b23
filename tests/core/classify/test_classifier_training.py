"""Training: it learns what can be learnt, and the same from the same seed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from labelled_clips import clip_set

from sd2core.classify import training
from sd2core.classify.data import UNKNOWN, ClipSet
from sd2core.classify.defaults import MODELS
from sd2core.classify.files import load_classifier, save_classifier
from sd2core.classify.live import judge
from sd2core.classify.training import TrainOptions, train
from sd2core.errors import Sd2Error

SHORT = TrainOptions(
    delay_s=0.0, steps=24, batch=8, check_steps=6, piece_frames=30, learning_rate=0.02
)


@pytest.fixture(scope="module")
def known() -> ClipSet:
    return clip_set(4, 4)


@pytest.mark.parametrize(
    ("model", "kind"),
    [
        *((model, "columns") for model in MODELS),
        *(pytest.param(model, "peak", marks=pytest.mark.slow) for model in MODELS[1:]),
        (MODELS[0], "peak"),
    ],
)
def test_classes_that_can_be_told_are_learnt(known: ClipSet, model: str, kind: str) -> None:
    made = train(
        known.clips[:8], known.clips[8:12], known, replace(SHORT, model=model, features=kind)
    )
    told = judge(made.classifier, known.clips[12:], known)
    assert told.mean_recall > 0.95
    assert made.events[-1]["event"] == "end"
    assert made.classifier.card.trained_on == ("simulated",)


@pytest.mark.slow
@pytest.mark.parametrize("model", MODELS)
def test_what_only_the_future_tells_is_learnt_with_a_delay(known: ClipSet, model: str) -> None:
    """Every frame has the class that is shown a third of a second later."""
    early = [
        replace(clip, label=np.append(clip.label[10:], np.full(10, UNKNOWN, np.int8)))
        for clip in known.clips
    ]
    told = {}
    for delay_s in (0.0, 0.4):
        made = train(early[:8], early[8:12], known, replace(SHORT, model=model, delay_s=delay_s))
        told[delay_s] = judge(made.classifier, early[12:], known)
        assert made.classifier.card.delay_s == pytest.approx(delay_s)
    assert told[0.4].mean_recall > 0.95
    assert told[0.0].mean_recall < 0.8
    assert min(told[0.4].latencies_s) > 0.4


def test_the_same_seed_gives_the_same_classifier(known: ClipSet) -> None:
    short = replace(SHORT, steps=6)
    state = torch.random.get_rng_state()
    one, again = (train(known.clips[:8], known.clips[8:], known, short) for _ in range(2))
    other = train(known.clips[:8], known.clips[8:], known, replace(short, seed=1))
    values = known.clips[0].energies
    np.testing.assert_array_equal(
        one.classifier.probabilities_of(values), again.classifier.probabilities_of(values)
    )
    assert (
        other.classifier.probabilities_of(values) != one.classifier.probabilities_of(values)
    ).any()
    assert torch.equal(torch.random.get_rng_state(), state)


def test_the_best_is_kept_where_it_is_stopped(known: ClipSet) -> None:
    def stop(event: dict) -> None:
        if event["event"] == "step" and event["step"] == 15:
            raise KeyboardInterrupt

    stopped = train(known.clips[:8], known.clips[8:], known, SHORT, watch=stop)
    assert stopped.interrupted
    checks = [one for one in stopped.events if one["event"] == "check"]
    best = max(checks, key=lambda one: one["validation_mean_recall"])
    assert stopped.events[-1] == {"event": "end", "best_step": best["step"], "interrupted": True}
    told = judge(stopped.classifier, known.clips[8:], known)
    assert told.mean_recall == pytest.approx(best["validation_mean_recall"], abs=0.02)


def test_without_a_better_one_it_ends_early(known: ClipSet) -> None:
    still = replace(SHORT, steps=400, check_steps=2, patience=3, learning_rate=1e-8)
    made = train(known.clips[:8], known.clips[8:], known, still)
    assert max(one.get("step", 0) for one in made.events) == 8


def test_unknown_frames_are_not_learnt_from(known: ClipSet) -> None:
    """Labels that are wrong where they are unknown make no difference."""
    clips = []
    for clip in known.clips[:8]:
        label = clip.label.copy()
        label[::3] = UNKNOWN
        clips.append(replace(clip, label=label))
    made = train(clips, known.clips[8:12], known, SHORT)
    assert judge(made.classifier, known.clips[12:], known).mean_recall > 0.95


def test_clips_of_any_length_are_learnt_from(known: ClipSet) -> None:
    clips = [clip.until(frames) for clip, frames in zip(known.clips, (1, 7, 90, 31), strict=False)]
    short = replace(SHORT, steps=3, window_frames=40)
    made = train(clips, (), known, short)
    assert made.classifier.probabilities_of(known.clips[0].energies).shape == (90, 3)


@pytest.mark.parametrize("weighted", [False, True])
def test_classes_count_the_same_by_what_is_shown_of_them(
    known: ClipSet, weighted: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a long recording beside short ones windows are shown, not all of its background."""
    long = clip_set(1, 1, frames=3000).clips[0]
    clips = [replace(long, label=np.zeros_like(long.label)), *known.clips[:3]]
    shown = np.zeros(3)
    learn = training._ClassifierLoop._learn

    def counted(loop, energies, label):
        shown[:] += np.bincount(label[label >= 0].numpy(), minlength=3)
        weights.append(loop._weights.numpy())
        return learn(loop, energies, label)

    weights: list[np.ndarray] = []
    monkeypatch.setattr(training._ClassifierLoop, "_learn", counted)
    chosen = replace(SHORT, steps=400, check_steps=400, options={"width": 4})
    train(clips, (), known, chosen, weights=[1.0] * len(clips) if weighted else None)
    np.testing.assert_allclose(weights[0] * shown, (weights[0] * shown).mean(), rtol=0.15)


def test_a_trained_classifier_comes_back_from_its_file(known: ClipSet, tmp_path: Path) -> None:
    made = train(
        known.clips[:8], (), known, replace(SHORT, steps=3), about={"split": {"test": ["s04"]}}
    )
    path = tmp_path / "one.safetensors"
    card = save_classifier(path, made.classifier)
    assert card.about["split"] == {"test": ["s04"]}
    assert card.about["training"]["steps"] == 3
    values = known.clips[0].energies
    np.testing.assert_array_equal(
        load_classifier(path).probabilities_of(values), made.classifier.probabilities_of(values)
    )


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"steps": 0}, "steps is 0"),
        ({"learning_rate": 0.0}, "learning_rate is 0"),
        ({"learning_rate": 2.0}, "learning_rate is 2"),
        ({"options": {"width": 2048}}, "width is 2048"),
        ({"delay_s": -1.0}, "delay is -1"),
        ({"noisy_share": 2.0}, "noisy clips is 2"),
    ],
)
def test_options_that_make_no_sense_are_refused(change: dict, words: str) -> None:
    with pytest.raises(Sd2Error, match=words):
        replace(SHORT, **change)


def test_nothing_to_learn_from_is_said(known: ClipSet) -> None:
    unknown = [replace(known.clips[0], label=np.full(90, UNKNOWN, np.int8))]
    for clips in ([], unknown):
        with pytest.raises(Sd2Error, match="no labelled frame"):
            train(clips, (), known, SHORT)


def test_other_classes_or_axes_are_not_judged(known: ClipSet) -> None:
    made = train(known.clips[:4], (), known, replace(SHORT, steps=1))
    with pytest.raises(Sd2Error, match="class wave"):
        judge(made.classifier, known.clips, replace(known, classes=("background", "wave")))
    with pytest.raises(Sd2Error, match="frames/s"):
        judge(made.classifier, known.clips, replace(known, frame_rate_hz=10.0))
    with pytest.raises(Sd2Error, match="no clip"):
        judge(made.classifier, (), known)


@pytest.mark.slow
def test_a_classifier_in_closed_form_is_sure_of_what_it_was_fitted_to(known: ClipSet) -> None:
    """With fewer references than frames, more, and again: the same, and better than chance."""
    found = []
    for references in (40, 1024):
        options = TrainOptions("kernel", delay_s=0.3, options={"references": references})
        made, again = (train(known.clips, (), known, options) for _ in range(2))
        assert [event["event"] for event in made.events] == ["start", "end"]
        assert made.classifier.card.options["frames"] == 2 * made.classifier.card.delay_frames + 1
        for name, values in made.classifier.network.state_dict().items():
            assert torch.equal(values, again.classifier.network.state_dict()[name])
        found.append(judge(made.classifier, known.clips, known).mean_recall)
    assert 0.5 < found[0] <= found[1]
    assert found[1] > 0.85
