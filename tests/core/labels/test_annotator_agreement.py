"""Agreement of two annotators: kappa by hand, matches that are best, and what both must keep."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sd2core.errors import Sd2Error
from sd2core.labels.agreement import Kappa, agreement, frame_agreement
from sd2core.labels.matching import match_spans
from sd2core.labels.spans import Labels, LabelTrack, Span
from sd2core.timebase import Timebase

CLOCK = Timebase.regular(100, 10.0)
FREE = (LabelTrack("T", "free"), LabelTrack("U", "free"))


def span(number: int, start_s: float, end_s: float, label: str = "x", track: str = "T") -> Span:
    return Span(number, track, start_s, end_s, label)


def labels(*spans: Span) -> Labels:
    return Labels(FREE, spans)


@st.composite
def any_labels(draw: st.DrawFn) -> Labels:
    """Spans on the edges of frames; they may overlap and reach beyond the recording."""
    found = []
    for number in range(1, draw(st.integers(0, 6)) + 1):
        start = draw(st.integers(-5, 100))
        stop = start + draw(st.integers(1, 40))
        label = draw(st.sampled_from(["x", "y", "z"]))
        track = draw(st.sampled_from(["T", "U"]))
        found.append(span(number, start / 10, stop / 10, label, track))
    return labels(*found)


def test_kappa_by_hand() -> None:
    """The example of two readers of 50 grant proposals: yes/yes 20, no/no 15, 5 and 10 apart.

    p_o = 35/50 = 0.7, p_e = 0.5·0.6 + 0.5·0.4 = 0.5, kappa = 0.4.
    """
    kappa = Kappa.of(np.array([[20, 5], [10, 15]]))
    assert kappa.observed == pytest.approx(0.7)
    assert kappa.expected == pytest.approx(0.5)
    assert kappa.value == pytest.approx(0.4)
    assert kappa.frames == 50


def test_kappa_of_frames_by_hand() -> None:
    # a: x in 40 of 100 frames; b: x in 50; both in 30.
    # p_o = (30 + 40)/100, p_e = 0.4·0.5 + 0.6·0.5 = 0.5, kappa = 0.2/0.5.
    found = frame_agreement([span(1, 0, 4)], [span(1, 1, 6)], CLOCK)
    assert found.answers == ((), ("x",))
    np.testing.assert_array_equal(found.confusion, [[40, 20], [10, 30]])
    assert found.overall.value == pytest.approx(0.4)
    assert found.of_label["x"].value == pytest.approx(0.4)


def test_kappa_of_three_answers_by_hand() -> None:
    # a: x 0-20, y 20-50; b: x 0-30, y 30-40; nothing in the rest of 100 frames.
    # same: x 20, y 10, nothing 50. p_e = (20·30 + 30·10 + 50·60)/10^4 = 0.39.
    found = frame_agreement(
        [span(1, 0, 2), span(2, 2, 5, "y")], [span(1, 0, 3), span(2, 3, 4, "y")], CLOCK
    )
    assert found.overall.value == pytest.approx((0.8 - 0.39) / (1 - 0.39))
    # y alone: a 30, b 10, both 10.
    expected = 0.3 * 0.1 + 0.7 * 0.9
    assert found.of_label["y"].value == pytest.approx((0.8 - expected) / (1 - expected))


def test_perfect_disagreement_is_minus_one_and_independence_is_zero() -> None:
    assert Kappa.of(np.array([[0, 7], [7, 0]])).value == -1.0
    assert Kappa.of(np.outer([2, 3, 5], [1, 4, 5])).value == pytest.approx(0.0)


@pytest.mark.parametrize("spans", [[], [span(1, -1, 20)]])
def test_kappa_is_undefined_where_agreement_was_certain(spans: list[Span]) -> None:
    found = frame_agreement(spans, spans, CLOCK)
    assert found.overall == Kappa(None, 1.0, 1.0, 100)
    for kappa in found.of_label.values():
        assert kappa.value is None


def test_counts_too_large_for_64_bits_are_squared_all_the_same() -> None:
    many = 4_000_000_000
    assert Kappa.of(np.array([[many, 0], [0, many]])).value == 1.0


def test_labels_at_the_same_time_are_one_answer() -> None:
    both = [span(1, 0, 5), span(2, 2, 5, "y", "U")]
    found = frame_agreement(both, [span(1, 0, 5)], CLOCK)
    assert found.answers == ((), ("x",), ("x", "y"))
    np.testing.assert_array_equal(found.confusion, [[50, 0, 0], [0, 20, 0], [0, 30, 0]])
    assert found.of_label["x"].value == 1.0
    assert found.of_label["y"].value == 0.0


@given(any_labels())
def test_who_agrees_with_himself_agrees_wholly(a: Labels) -> None:
    found = agreement(a, a, CLOCK, min_iou=1.0)
    assert found.frames.overall.observed == 1.0
    assert found.frames.overall.value in (1.0, None)
    assert all(kappa.value in (1.0, None) for kappa in found.frames.of_label.values())
    assert len(found.spans.matches) == len(a.spans)
    assert found.spans.only_a == found.spans.only_b == ()
    for match in found.spans.matches:
        assert match.same_label
        assert match.iou == 1.0
        assert match.start_difference_s == match.end_difference_s == 0.0
    assert found.spans.f1 == (1.0 if a.spans else None)


@pytest.mark.slow
@given(any_labels(), any_labels(), st.sampled_from([0.1, 0.3, 0.5, 0.9]))
@settings(max_examples=80)
def test_it_does_not_matter_who_is_first(a: Labels, b: Labels, min_iou: float) -> None:
    forth, back = (agreement(one, other, CLOCK, min_iou=min_iou) for one, other in ((a, b), (b, a)))
    np.testing.assert_array_equal(forth.frames.confusion, back.frames.confusion.T)
    assert forth.frames.overall == back.frames.overall
    assert forth.frames.of_label == back.frames.of_label
    assert forth.spans.f1 == back.spans.f1
    assert len(forth.spans.only_a) == len(back.spans.only_b)
    if forth.spans.matches:
        assert forth.spans.mean_iou == pytest.approx(back.spans.mean_iou)


@given(any_labels(), any_labels(), st.permutations(["x", "y", "z"]))
def test_names_and_their_order_do_not_matter(a: Labels, b: Labels, names: list[str]) -> None:
    new = dict(zip("xyz", names, strict=True))

    def renamed(one: Labels) -> Labels:
        return labels(*(span(s.id, s.start_s, s.end_s, new[s.label], s.track) for s in one.spans))

    before, after = agreement(a, b, CLOCK), agreement(renamed(a), renamed(b), CLOCK)
    assert after.frames.overall == before.frames.overall
    assert after.frames.of_label == {
        new[label]: kappa for label, kappa in before.frames.of_label.items()
    }
    assert len(after.spans.matches) == len(before.spans.matches)


@given(any_labels(), any_labels(), st.sampled_from([0.05, 0.3, 0.6]))
def test_matches_are_the_best_there_are(a: Labels, b: Labels, min_iou: float) -> None:
    """Against every way to match: number of matches, then of labels, then the sum of IoU."""

    def iou(x: Span, y: Span) -> float:
        both = max(0.0, min(x.end_s, y.end_s) - max(x.start_s, y.start_s))
        return both / (x.duration_s + y.duration_s - both)

    def worth(pairs: list[tuple[Span, Span]]) -> tuple[int, int, float]:
        good = [(x, y) for x, y in pairs if iou(x, y) >= min_iou - 1e-9]
        return (
            len(good),
            sum(x.label == y.label for x, y in good),
            sum(iou(x, y) for x, y in good),
        )

    few, many = sorted((a.spans, b.spans), key=len)
    if len(many) > 5:
        many = many[:5]
        few = few[:5]
    best = max(worth(list(zip(few, order, strict=True))) for order in permutations(many, len(few)))
    found = match_spans(few, many, CLOCK, min_iou=min_iou)
    assert len(found.matches) == best[0]
    assert sum(match.same_label for match in found.matches) == best[1]
    assert sum(match.iou for match in found.matches) == pytest.approx(best[2])
    assert all(match.iou >= min_iou - 1e-9 for match in found.matches)
    assert len({match.a.id for match in found.matches}) == len(found.matches)
    assert len(found.matches) + len(found.only_a) == len(few)
    assert len(found.matches) + len(found.only_b) == len(many)


@given(st.integers(0, 500_000), st.sampled_from([29.97, 30.0, 60.0, 90.0]))
def test_half_is_half_wherever_it_lies(frame: int, rate_hz: float) -> None:
    one = span(1, frame / rate_hz, (frame + 1) / rate_hz)
    two = span(1, frame / rate_hz, (frame + 2) / rate_hz)
    assert len(match_spans([one], [two], CLOCK, min_iou=0.5).matches) == 1
    assert not match_spans([one], [two], CLOCK, min_iou=0.5001).matches


def test_more_matches_go_before_better_ones() -> None:
    # The first of b overlaps both of a best with the second, but then the first has none.
    a = [span(1, 0, 4), span(2, 4, 8)]
    b = [span(1, 1.5, 5), span(2, 5, 8)]
    found = match_spans(a, b, CLOCK, min_iou=0.1)
    assert [(match.a.id, match.b.id) for match in found.matches] == [(1, 1), (2, 2)]
    assert found.matches[0].iou == pytest.approx(2.5 / 5)
    assert found.matches[1].iou == pytest.approx(3 / 4)


def test_edges_are_compared_in_seconds_and_frames() -> None:
    uneven = Timebase(np.concatenate([np.arange(50) / 10, 5 + np.arange(50) / 50]))
    (match,) = match_spans([span(1, 4, 5.2, "x")], [span(1, 4.2, 5.4, "y")], uneven).matches
    assert match.start_difference_s == pytest.approx(0.2)
    assert match.end_difference_s == pytest.approx(0.2)
    assert (match.start_difference_frames, match.end_difference_frames) == (2, 10)
    assert not match.same_label


def test_outside_the_recording_there_are_no_frames_to_count() -> None:
    (match,) = match_spans([span(1, 50, 60)], [span(1, 50, 61)], CLOCK).matches
    assert match.start_difference_frames is None
    assert match.end_difference_s == pytest.approx(1.0)


def test_without_spans_there_is_nothing_to_match() -> None:
    one = [span(1, 0, 1)]
    assert match_spans([], [], CLOCK).f1 is None
    assert match_spans([], [], CLOCK).mean_iou is None
    found = match_spans(one, [], CLOCK)
    assert (found.f1, found.only_a, found.only_b) == (0.0, tuple(one), ())
    assert match_spans([], one, CLOCK).only_b == tuple(one)


def test_one_track_alone_may_be_compared() -> None:
    a = labels(span(1, 0, 5), span(2, 0, 5, "y", "U"))
    b = labels(span(1, 0, 5), span(2, 6, 9, "y", "U"))
    assert agreement(a, b, CLOCK, track="T").frames.overall.value == 1.0
    assert agreement(a, b, CLOCK).frames.overall.value != 1.0
    with pytest.raises(Sd2Error, match="The second labels have no track 'T'"):
        agreement(a, Labels((LabelTrack("V"),)), CLOCK, track="T")


@pytest.mark.parametrize("min_iou", [0.0, -0.5, 1.01, float("nan")])
def test_a_threshold_that_is_none_is_refused(min_iou: float) -> None:
    with pytest.raises(Sd2Error, match="The least IoU of a match is"):
        match_spans([], [], CLOCK, min_iou=min_iou)
