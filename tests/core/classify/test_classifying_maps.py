"""A classifier at work: live equals batch, however the frames come."""

from __future__ import annotations

import numpy as np
import pytest
from classifiers import CLASSES, classifier, doppler, energies
from hypothesis import given, settings
from hypothesis import strategies as st

from sd2core.classify.defaults import MODELS
from sd2core.classify.live import CHUNK
from sd2core.errors import Sd2Error
from sd2core.maps import DopplerMap
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase

SAME = 2e-5


@pytest.mark.slow
@pytest.mark.parametrize(("model", "delay"), [("lstm", 0), ("lstm", 11), ("s4", 0), ("s4", 11)])
@pytest.mark.parametrize("kind", ["peak", "columns"])
def test_frame_by_frame_equals_the_whole_map(model: str, kind: str, delay: int) -> None:
    trained = classifier(model, kind, delay_frames=delay)
    values = energies(130)
    whole = trained.probabilities(doppler(values))
    session = trained.live()
    found = [session.advance(frame[None]) for frame in values]
    # After `delay` frames every one brings one answer.
    assert [len(one) for one in found] == [0] * delay + [1] * (130 - delay)
    found.append(session.finish())
    assert trained.live().finish().shape == (0, len(CLASSES))
    np.testing.assert_allclose(np.concatenate(found), whole, atol=SAME)
    np.testing.assert_allclose(whole.sum(axis=1), 1.0, atol=1e-5)
    assert whole.dtype == np.float32
    assert whole.shape == (130, len(CLASSES))


@pytest.mark.one_in(3)
@pytest.mark.parametrize("model", MODELS)
@settings(max_examples=8, deadline=None)
@given(
    sizes=st.lists(st.integers(0, 90), min_size=1, max_size=6),
    delay=st.sampled_from([0, 1, 40, 100]),
)
def test_pieces_of_any_length_equal_the_whole(model: str, sizes: list[int], delay: int) -> None:
    trained = classifier(model, delay_frames=delay)
    values = energies(max(sum(sizes), 1))
    session, found = trained.live(), []
    for start, size in zip(np.cumsum([0, *sizes]), [*sizes, len(values)], strict=False):
        found.append(session.advance(values[start : start + size]))
    found.append(session.finish())
    np.testing.assert_allclose(np.concatenate(found), trained.probabilities_of(values), atol=SAME)


@pytest.mark.parametrize("model", MODELS)
def test_a_long_map_is_worked_out_in_pieces_that_do_not_show(model: str) -> None:
    trained = classifier(model, delay_frames=12)
    values = energies(CHUNK + 70)
    session = trained.live()
    whole = np.concatenate([session.advance(values), session.finish()])
    np.testing.assert_allclose(trained.probabilities(doppler(values)), whole, atol=SAME)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("delay", [0, 20])
def test_what_comes_later_than_the_delay_changes_nothing(model: str, delay: int) -> None:
    trained = classifier(model, delay_frames=delay)
    values = energies(200)
    other = values.copy()
    other[120:] = energies(80, seed=9) * 50
    before = trained.probabilities(doppler(values))[: 120 - delay]
    after = trained.probabilities(doppler(other))
    np.testing.assert_allclose(after[: 120 - delay], before, atol=SAME)
    if delay:
        assert (
            np.abs(
                after[120 - delay : 120] - trained.probabilities(doppler(values))[120 - delay : 120]
            ).max()
            > SAME
        )


@pytest.mark.parametrize("delay", [1, 20])
def test_the_answer_is_that_of_the_network_so_many_frames_on(delay: int) -> None:
    at_once, late = classifier(), classifier(delay_frames=delay)
    values = energies(90)
    np.testing.assert_allclose(
        late.probabilities_of(values)[: 90 - delay],
        at_once.probabilities_of(values)[delay:],
        atol=SAME,
    )


@pytest.mark.slow
@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("delay", [0, 15])
def test_without_a_person_it_is_background_and_begins_anew(model: str, delay: int) -> None:
    trained = classifier(model, delay_frames=delay)
    values = energies(150)
    present = np.ones(150, bool)
    present[60:70] = False
    found = trained.probabilities(doppler(values, present=present))
    np.testing.assert_array_equal(found[60:70], np.tile([1.0, 0.0, 0.0], (10, 1)))
    np.testing.assert_allclose(found[:60], trained.probabilities_of(values[:60]), atol=SAME)
    np.testing.assert_allclose(found[70:], trained.probabilities_of(values[70:]), atol=SAME)
    for part in (slice(60), slice(70, None)):
        session = trained.live()
        stepped = [session.advance(frame[None]) for frame in values[part]]
        np.testing.assert_allclose(
            np.concatenate([*stepped, session.finish()]), found[part], atol=SAME
        )


def test_gain_changes_nothing() -> None:
    trained = classifier()
    values = energies(120)
    quiet = trained.probabilities(doppler(values * np.float32(1e-6)))
    np.testing.assert_allclose(trained.probabilities(doppler(values)), quiet, atol=1e-4)


def test_another_frame_rate_is_brought_to_the_models() -> None:
    """A slow target is told alike at 30 and at 45 frames/s."""
    trained = classifier()
    frames = np.arange(240) / 30.0
    times_s = np.arange(360) / 45.0

    def column(at_s: np.ndarray) -> np.ndarray:
        values = np.full((len(at_s), 32), 1.0, np.float32)
        values[:, 20] += 100.0 * np.exp(-((at_s - 4.0) ** 2))
        values[:, 14:17] = 0.0
        return values

    own = trained.probabilities(doppler(column(frames)))
    other = trained.probabilities(doppler(column(times_s), rate_hz=45.0))
    for number in range(len(CLASSES)):
        seen = np.interp(frames, times_s, other[:, number])
        np.testing.assert_allclose(seen, own[:, number], atol=0.02)
    np.testing.assert_allclose(other.sum(axis=1), 1.0, atol=1e-5)


def test_a_map_on_another_axis_is_refused() -> None:
    other = DopplerMap(
        np.zeros((16, 4), np.float32), VelocityAxis(16, 2.0), Timebase.regular(4, 30.0), "real"
    )
    with pytest.raises(Sd2Error, match="16 bins"):
        classifier().probabilities(other)


def test_one_frame_and_an_empty_map_are_answered() -> None:
    trained = classifier()
    assert trained.probabilities(doppler(energies(1))).shape == (1, 3)
    silent = trained.probabilities(doppler(np.zeros((40, 32), np.float32)))
    assert np.isfinite(silent).all()
