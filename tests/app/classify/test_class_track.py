"""What frames show, kept in step with a map that grows, changes and moves."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from fake_classifiers import CLASSES, FakeClassifier, FakeClassifiers, class_card, expected

from sd2app.classify.model import reading_text
from sd2app.classify.track import _AT_ONCE, ClassTrack
from sd2app.session.maps import MapModel
from sd2core.errors import Sd2Error
from sd2core.maps import DopplerMap
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase

RATE = 30.0


def a_map(frames=90, seed=0, rate=RATE, **more):
    values = np.random.default_rng(seed).exponential(size=(32, frames)).astype(np.float32)
    return DopplerMap(
        values, VelocityAxis(32, 2.0), Timebase.regular(frames, rate), "denoised", **more
    )


@pytest.fixture
def set_up(qtbot):
    fake, source, state = FakeClassifiers(), MapModel("Denoised"), SimpleNamespace(counts=True)
    track = ClassTrack(lambda _: state.counts)
    track.look_at(source)
    track.use(FakeClassifier(fake, class_card("/a.safetensors")))

    def settle():
        qtbot.waitUntil(lambda: not track.busy, timeout=10_000)

    yield SimpleNamespace(fake=fake, source=source, track=track, state=state, settle=settle)
    fake.gate.set()
    track.close()


def test_every_frame_is_what_streaming_gives(set_up):
    doppler = a_map()
    set_up.source.set_map(doppler)
    set_up.settle()
    assert set_up.track.complete
    np.testing.assert_allclose(set_up.track.shares, expected(doppler.values.T), rtol=1e-6)
    reading = set_up.track.at(1.0)
    assert reading.current
    assert not reading.nobody
    np.testing.assert_allclose(reading.shares, expected(doppler.values.T)[30], rtol=1e-6)
    assert reading.best == int(np.argmax(reading.shares))
    assert set_up.track.at(99.0) is None


def test_levels_and_alignment_classify_nothing_anew(set_up):
    set_up.source.set_map(a_map())
    set_up.settle()
    frames = set_up.fake.frames
    set_up.source.set_reference(3.0)
    set_up.source.set_offset(1.0)
    set_up.settle()
    assert set_up.fake.frames == frames
    # The same frame stands a second later.
    assert set_up.track.at(0.5) is None
    assert set_up.track.at(1.0).shares == pytest.approx(expected(a_map().values.T)[0])


def test_a_map_that_grows_is_gone_on_with(set_up):
    doppler = a_map()
    for known in (10, 11, 40, 90):
        set_up.source.set_map(doppler, np.arange(90) < known)
        set_up.settle()
        assert set_up.track.done.sum() == known
        assert not set_up.track.complete
    assert (set_up.fake.sessions, set_up.fake.frames) == (1, 90)
    set_up.source.set_map(doppler)
    set_up.settle()
    assert set_up.track.complete
    assert set_up.fake.frames == 90
    np.testing.assert_allclose(set_up.track.shares, expected(doppler.values.T), rtol=1e-6)


@pytest.mark.parametrize("delay_frames", [0, 6])
def test_a_map_to_which_frames_are_added_is_gone_on_with(set_up, delay_frames):
    set_up.fake.delay_frames = delay_frames
    card = replace(class_card("/late.safetensors"), delay_frames=delay_frames)
    set_up.track.use(FakeClassifier(set_up.fake, card))
    whole, set_up.source.growing = a_map(), True
    told = expected(whole.values.T)
    for frames in (1, 2, 11, 40, 41, 89, 90):
        set_up.source.set_map(whole.between(0, frames))
        set_up.settle()
        answered = max(frames - delay_frames, 0)
        assert set_up.track.done.tolist() == [True] * answered + [False] * (frames - answered)
        np.testing.assert_allclose(set_up.track.shares[:answered], told[:answered], rtol=1e-6)
        if answered:
            assert set_up.track.at((frames - 1) / RATE).shares == pytest.approx(told[answered - 1])
    assert (set_up.fake.sessions, set_up.fake.frames) == (1, 90)
    set_up.source.growing = False
    set_up.source.set_map(whole)  # it has ended: nothing else is to come
    set_up.settle()
    assert set_up.track.complete
    np.testing.assert_allclose(set_up.track.shares, told, rtol=1e-6)


def test_frames_added_without_pause_are_classified(set_up, qtbot):
    """As a radar does that gives more of them than are asked about at a time."""
    whole, set_up.source.growing = a_map(frames=300), True
    for frames in range(1, 301):
        set_up.source.set_map(whole.between(0, frames))
        if frames % 50 == 0:
            qtbot.wait(1)
    set_up.settle()
    assert set_up.track.done.all()
    np.testing.assert_allclose(set_up.track.shares, expected(whole.values.T), rtol=1e-6)
    assert set_up.fake.frames == 300


def test_a_map_that_grows_is_read_where_it_has_got_to(set_up):
    doppler = a_map()
    set_up.source.set_map(doppler, np.arange(90) < 40)
    set_up.settle()
    told = expected(doppler.values.T)
    # The clock is a little ahead of the map, then far ahead.
    assert set_up.track.at(42 / RATE).shares == pytest.approx(told[39])
    assert set_up.track.at(42 / RATE).current
    assert set_up.track.at(60 / RATE) is None


@pytest.fixture
def late(set_up):
    """One that answers six frames late."""
    set_up.fake.delay_frames = 6
    card = replace(class_card("/late.safetensors"), delay_frames=6)
    set_up.track.use(FakeClassifier(set_up.fake, card))
    return set_up


def test_a_late_answer_is_of_its_own_frame(late):
    doppler, covered = a_map(), np.arange(90) < 40
    truth = expected(doppler.values.T)
    late.source.set_map(doppler, covered)
    late.settle()
    assert np.flatnonzero(late.track.done).tolist() == list(range(34))
    reading = late.track.at(39 / RATE)
    assert reading.current
    assert reading.shares == pytest.approx(truth[33])
    assert reading.ago_s == pytest.approx(6 / RATE)
    best = CLASSES[int(truth[33].argmax())]
    assert reading_text(reading) == f"{best} {100 * truth[33].max():.0f} %, 0.2 s ago"
    # Nothing is asked twice when nothing is new, and what was owed comes at the end.
    for count in (40, 41, 60, 90):
        late.source.set_map(doppler, np.arange(90) < count if count < 90 else None)
        late.settle()
        known = count if count == 90 else count - 6
        assert np.flatnonzero(late.track.done).tolist() == list(range(known))
    assert late.fake.frames == 90
    np.testing.assert_allclose(late.track.shares, truth, rtol=1e-6)
    reading = late.track.at(39 / RATE)
    assert reading.ago_s == 0.0
    assert "ago" not in reading_text(reading)
    assert reading.shares == pytest.approx(truth[39])


def test_who_answers_late_has_seen_what_changed(late):
    late.source.set_map(a_map())
    late.settle()
    changed = a_map()
    changed.values[:, 50] *= 3.0
    late.fake.gate.clear()
    late.source.set_map(changed)
    assert np.flatnonzero(late.track.done).tolist() == list(range(44))
    late.fake.gate.set()
    late.settle()
    np.testing.assert_allclose(late.track.shares, expected(changed.values.T), rtol=1e-6)


def test_growing_while_something_is_under_way_gives_the_same(set_up):
    doppler = a_map()
    set_up.fake.gate.clear()
    for known in (10, 30, 60, 90):
        set_up.source.set_map(doppler, np.arange(90) < known)
    set_up.fake.gate.set()
    set_up.settle()
    np.testing.assert_allclose(set_up.track.shares, expected(doppler.values.T), rtol=1e-6)


def test_what_stands_before_a_change_stays_right(set_up):
    doppler = a_map()
    set_up.source.set_map(doppler)
    set_up.settle()
    set_up.fake.gate.clear()
    doppler.values[:, 60] += 5.0  # in place, as the synthetic map does it
    set_up.source.set_map(doppler)
    assert set_up.track.at(1.0).current
    assert not set_up.track.at(2.5).current
    assert not set_up.track.complete
    set_up.fake.gate.set()
    set_up.settle()
    assert set_up.track.at(2.5).current
    np.testing.assert_allclose(set_up.track.shares, expected(doppler.values.T), rtol=1e-6)


def test_an_answer_to_another_sensor_is_dropped(set_up, qtbot):
    first, second = a_map(seed=1), a_map(seed=2)
    set_up.fake.gate.clear()
    set_up.source.set_map(first)
    set_up.source.set_map(second)
    seen = []
    set_up.track.changed.connect(lambda: seen.append(set_up.track.done.all()))
    set_up.fake.gate.set()
    set_up.settle()
    assert seen[-1]
    np.testing.assert_allclose(set_up.track.shares, expected(second.values.T), rtol=1e-6)


def test_while_the_map_is_of_another_sensor_nothing_counts(set_up):
    set_up.source.set_map(a_map())
    set_up.settle()
    set_up.state.counts = False
    assert not set_up.track.at(1.0).current
    assert not set_up.track.complete
    set_up.state.counts = True
    assert set_up.track.at(1.0).current


def test_without_a_person_it_is_background_and_what_was_before_is_forgotten(set_up):
    present = np.ones(90, bool)
    present[30:40] = False
    doppler = a_map(present=present)
    set_up.source.set_map(doppler)
    set_up.settle()
    shares = set_up.track.shares
    np.testing.assert_array_equal(shares[30:40], np.tile([1.0, 0.0, 0.0], (10, 1)))
    np.testing.assert_allclose(shares[:30], expected(doppler.values.T[:30]), rtol=1e-6)
    np.testing.assert_allclose(shares[40:], expected(doppler.values.T[40:]), rtol=1e-6)
    assert set_up.track.at(35 / RATE).nobody
    assert set_up.track.complete


def test_another_frame_rate_is_asked_about_as_a_whole(set_up):
    set_up.source.set_map(a_map(rate=20.0))
    set_up.settle()
    assert (set_up.fake.whole, set_up.fake.sessions) == (1, 0)
    assert set_up.track.complete


def test_a_long_map_is_asked_about_piece_by_piece(set_up):
    doppler = a_map(frames=2 * _AT_ONCE + 10)
    set_up.source.set_map(doppler)
    set_up.settle()
    assert set_up.fake.sessions == 1
    assert set_up.fake.frames == 2 * _AT_ONCE + 10
    assert set_up.track.complete


def test_stretches_with_frames_to_come_behind_them_owe_their_last_answers(late):
    doppler, covered = a_map(), np.zeros(90, bool)
    covered[10:40] = covered[60:] = True
    late.source.set_map(doppler, covered)
    late.settle()
    assert np.flatnonzero(late.track.done).tolist() == [*range(10, 34), *range(60, 90)]
    told = expected(doppler.values.T[60:])
    np.testing.assert_allclose(late.track.shares[60:], told, rtol=1e-6)


def test_a_map_of_another_axis_is_refused_in_words(set_up):
    other = DopplerMap(
        np.ones((16, 9), np.float32), VelocityAxis(16, 2.0), Timebase.regular(9, RATE), "real"
    )
    set_up.source.set_map(other)
    assert "16 bins" in set_up.track.problem
    assert set_up.track.at(0.1) is None
    set_up.source.set_map(a_map())
    set_up.settle()
    assert set_up.track.problem == ""
    assert set_up.track.complete


def test_a_failure_is_said_and_the_next_map_is_tried(set_up):
    set_up.fake.failure = Sd2Error("The process has ended")
    set_up.source.set_map(a_map())
    set_up.settle()
    assert set_up.track.problem == "The process has ended."
    set_up.fake.failure = None
    set_up.source.set_map(a_map())
    set_up.settle()
    assert set_up.track.complete


def test_no_classifier_and_no_map_say_nothing(set_up):
    set_up.source.set_map(a_map())
    set_up.settle()
    set_up.track.use(None)
    assert set_up.track.at(1.0) is None
    set_up.track.use(FakeClassifier(set_up.fake, class_card("/a.safetensors")))
    set_up.settle()
    set_up.source.set_map(None)
    assert set_up.track.at(1.0) is None
    assert not set_up.track.complete
