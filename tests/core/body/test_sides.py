"""Left and right of people whose sides were swapped, against the truth."""

from __future__ import annotations

import json
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from seen_people import somebody

from sd2core.body.landmark_models import LandmarkModels
from sd2core.body.landmarks import find_landmarks
from sd2core.body.raw_track import RawTrack
from sd2core.body.sides import (
    SIDED_PARTS,
    _cheapest,
    load_sides,
    swap_odds,
    swap_sides,
    undo_side_swaps,
)
from sd2core.body.track import MIRRORED
from sd2core.errors import Sd2Error
from sd2core.io.video import open_video

ALL = tuple(SIDED_PARTS)


def put_in(found: RawTrack, parts: tuple[str, ...], wrong: NDArray[np.bool_]) -> RawTrack:
    for part in parts:
        found = swap_sides(found, part, wrong)
    return found


def frames_of(count: int, *runs: tuple[int, int]) -> NDArray[np.bool_]:
    wrong = np.zeros(count, bool)
    for start, length in runs:
        wrong[start : start + length] = True
    return wrong


@pytest.fixture(scope="module")
def real(shared_data: Path, models: LandmarkModels) -> RawTrack:
    """Somebody who lifts the arms, as the landmark model finds them in a real video."""
    with open_video(shared_data / "video" / "help.mkv") as video:
        kept = find_landmarks(video, models)
        track = kept.part(0, len(kept))
    names = ("present", "bridged", "image_px", "depth_px", "world_m", "visibility")
    return RawTrack(track.timebase.times_s, **{name: getattr(track, name) for name in names})


@pytest.mark.slow
@settings(max_examples=40)
@given(
    st.sampled_from([ALL, ("head and trunk",), ("the arms",), ("the legs",), ALL[:2]]),
    st.lists(st.tuples(st.integers(0, 57), st.integers(1, 40)), max_size=3),
    st.sampled_from([1, 2, 3]),
)
def test_mirrored_stretches_of_a_real_person_are_undone(
    real: RawTrack, parts: tuple[str, ...], runs: list[tuple[int, int]], every: int
) -> None:
    """Short and long ones, of the whole body or of parts, at 30, 15 and 10 frames/s."""
    arrays = {name: values[::every] for name, values in vars(real).items()}
    true = RawTrack(**arrays)
    wrong = frames_of(len(real.times_s), *runs)[::every]
    swaps = undo_side_swaps(put_in(true, parts, wrong))[1]
    expected = {part: wrong & (part in parts) for part in SIDED_PARTS}
    left = sum(int((swaps[part] != expected[part]).sum()) for part in SIDED_PARTS)
    assert left <= 0.02 * 3 * len(wrong)


@pytest.mark.slow
@settings(max_examples=8)
@given(st.integers(0, 40), st.floats(0.3, 3.0), st.floats(-200.0, 200.0))
def test_odds_do_not_depend_on_place_and_size(seed: int, zoom: float, shift_px: float) -> None:
    true = somebody(seed)
    arrays = vars(true) | {
        "image_px": (zoom * true.image_px + shift_px).astype(np.float32),
        "depth_px": (zoom * true.depth_px).astype(np.float32),
    }
    np.testing.assert_allclose(swap_odds(RawTrack(**arrays)), swap_odds(true), atol=0.05)


@settings(max_examples=8)
@given(st.integers(0, 40))
def test_odds_of_a_mirror_image_are_the_same(seed: int) -> None:
    true = somebody(seed)
    sides = list(MIRRORED)
    arrays = vars(true) | {
        "image_px": true.image_px[:, sides] * np.array([-1.0, 1.0], np.float32),
        "depth_px": true.depth_px[:, sides],
        "world_m": true.world_m[:, sides] * np.array([-1.0, 1.0, 1.0], np.float32),
        "visibility": true.visibility[:, sides],
    }
    np.testing.assert_allclose(swap_odds(RawTrack(**arrays)), swap_odds(true), atol=0.01)


def test_frames_without_a_person_have_no_side() -> None:
    true = somebody(1)
    lost = frames_of(90, (20, 30))
    arrays = {name: value.copy() for name, value in vars(true).items()}
    arrays["present"][lost] = False
    for name in ("image_px", "depth_px", "world_m"):
        arrays[name][lost] = np.nan
    found, swaps = undo_side_swaps(RawTrack(**arrays))
    assert (swap_odds(RawTrack(**arrays))[lost] == 0.0).all()
    assert not any(frames[lost].any() for frames in swaps.values())
    assert np.isnan(found.image_px[lost]).all()


@pytest.mark.parametrize("frames", [1, 2, 3])
def test_few_frames(frames: int) -> None:
    true = somebody(1).part(0, frames)
    np.testing.assert_array_equal(undo_side_swaps(true)[0].image_px, true.image_px)


@pytest.mark.slow
@settings(max_examples=60)
@given(st.integers(3, 8), st.integers(0, 2**31))
def test_the_cheapest_choice_is_that_of_all_choices(frames: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    cost, alone = rng.uniform(0.0, 1.0, (2, 2, 2, frames - 2)), rng.uniform(-1.0, 1.0, frames)

    def total(states: tuple[int, ...]) -> float:
        three = zip(states, states[1:], states[2:], strict=False)
        return sum(cost[*abc, t] for t, abc in enumerate(three)) + float(alone @ states)

    best = min(product((0, 1), repeat=frames), key=total)
    np.testing.assert_array_equal(_cheapest(cost, alone), np.array(best, bool))


def test_a_file_of_something_else_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "sides.npz"
    np.savez(path, meta=json.dumps({"format": "sd2-lifter", "version": 1}))
    monkeypatch.setattr("sd2core.body.sides.resource_path", lambda name: tmp_path / name)
    with pytest.raises(Sd2Error, match="sd2-lifter"):
        load_sides.__wrapped__()
