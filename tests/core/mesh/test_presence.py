from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2core.denoise.resample_to_model import clips
from sd2core.errors import Sd2Error
from sd2core.labels.suggest import stretches
from sd2core.mesh.presence import Presence, gaps_in_words, runs
from sd2core.mesh.sequence import MeshSequence
from sd2core.plausibility.clock import gaps_between
from sd2core.timebase import Timebase


@given(st.lists(st.booleans(), min_size=1, max_size=30))
def test_stretches_are_the_runs_of_frames_with_a_person(there: list[bool]) -> None:
    presence = Presence.of(there, len(there))
    for frame in range(len(there)):
        first, last = int(presence.first[frame]), int(presence.last[frame])
        assert first <= frame <= last
        if not there[frame]:
            assert first == last == frame
            continue
        assert all(there[first : last + 1])
        assert first == 0 or not there[first - 1]
        assert last == len(there) - 1 or not there[last + 1]
    assert runs(presence.present) == tuple(
        (int(k), int(presence.last[k]) + 1)
        for k in range(len(there))
        if there[k] and presence.first[k] == k
    )
    assert sum(b - a for a, b in runs(~presence.present)) == there.count(False)


def test_a_frame_alone_has_no_motion_but_a_clip_of_one_frame_is_no_gap() -> None:
    presence = Presence.of([True, False, True, True, False, True], 6)
    assert presence.measured.tolist() == [False, False, True, True, False, False]
    assert Presence.of(None, 1).measured.tolist() == [True]
    assert Presence.of(None, 3).whole
    assert presence.between(1, 4).measured.tolist() == [False, True, True]


def test_where_frames_were_lost_another_stretch_begins() -> None:
    times_s = np.array([0.0, 0.1, 0.2, 0.7, 0.8, 5.0, 5.1])  # 0.5 s is more than four steps
    assert gaps_between(times_s).tolist() == [False, False, True, False, True, False]
    assert not gaps_between(times_s[:1]).any()
    assert not gaps_between(np.array([0.0, 0.01, 0.2])).any()  # less than 0.25 s
    presence = Presence.of(None, 7, gaps_between(times_s))
    assert presence.first.tolist() == [0, 0, 0, 3, 3, 5, 5]
    assert presence.last.tolist() == [2, 2, 2, 4, 4, 6, 6]
    assert (presence.whole, presence.measured.all()) == (False, True)
    part = presence.between(2, 6)
    assert part.first.tolist() == [0, 1, 1, 3]
    assert part.measured.tolist() == [False, True, True, False]


def test_what_is_missing_is_counted_in_frames_and_on_real_times() -> None:
    times = np.array([0.0, 0.1, 0.5, 0.6, 0.7])
    assert gaps_in_words([(1, 2), (4, 5)], times, 0.1) == "2 of 5 frames (0.50 s)"


def mesh(**given: object) -> MeshSequence:
    return MeshSequence(np.zeros((4, 3, 3)), None, Timebase(np.arange(4.0)), "walk", **given)  # type: ignore[arg-type]


def test_a_mesh_says_in_one_way_only_that_someone_is_there_throughout() -> None:
    assert mesh().present is None
    assert mesh(present=np.ones(4, bool)).present is None
    assert runs(~mesh(present=[1, 0, 0, 1]).presence.present) == ((1, 3),)


def test_the_mask_is_the_mesh_s_own() -> None:
    given = np.array([True, False, True, True])
    held = mesh(present=given)
    given[:] = True
    assert held.present is not None
    assert not held.present[1]


@pytest.mark.parametrize("bad", [[True] * 3, [0.0, 1.0, 1.0, 1.0], [2, 1, 1, 1], [[True] * 4]])
def test_a_mask_that_does_not_fit_is_refused(bad: list[object]) -> None:
    with pytest.raises(Sd2Error, match="present is of type"):
        mesh(present=bad)


@pytest.mark.parametrize("rate_hz", [8, 10, 15, 20, 24, 25, 30000 / 1001, 30, 60])
@pytest.mark.parametrize("digits", [6, 17])
def test_as_many_lost_frames_are_a_gap_wherever_they_lie(rate_hz: float, digits: int) -> None:
    frames = 200
    times_s = np.round(3.0 + np.arange(frames) / rate_hz, digits)
    everywhere = np.ones(frames, bool)
    for lost in range(1, 17):
        found = set()
        for at in range(5, frames - 25, 7):
            kept_s = np.delete(times_s, np.arange(at, at + lost))
            present = everywhere[: len(kept_s)]
            found.add(
                (
                    int(gaps_between(kept_s).sum()),
                    len(clips(kept_s, present, rate_hz)),
                    len(np.unique(stretches(Timebase(kept_s), present)[0])),
                )
            )
        assert len(found) == 1, lost
