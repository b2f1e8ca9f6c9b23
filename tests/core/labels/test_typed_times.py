"""Times as people type them."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from labelled import even, uneven

from sd2core.errors import Sd2Error
from sd2core.labels.typed_times import typed_duration_end, typed_end, typed_start

FRAMES = even(120)


@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        ("1.5", 1.5),
        ("1,5", 1.5),
        (" 1.5 s ", 1.5),
        (".5", 0.5),
        ("2.", 2.0),
        ("0:02.25", 2.25),
        ("01:02.5", 62.5),
        ("1:00:01", 3601.0),
        ("-0.25", -0.25),
        ("−0.25", -0.25),
    ],
)
def test_seconds(text: str, seconds: float) -> None:
    assert typed_start(text, FRAMES) == seconds
    assert typed_end(text, FRAMES) == seconds
    assert typed_duration_end(text, 10.0, FRAMES) == 10.0 + seconds


@given(seed=st.integers(0, 1000), frame=st.integers(0, 119), form=st.sampled_from(["f{}", "{} F"]))
def test_a_frame_is_the_first_of_a_span_or_its_last(seed: int, frame: int, form: str) -> None:
    timebase = uneven(seed)
    text = form.format(frame)
    assert typed_start(text, timebase) == timebase.time_of(frame)
    end_s = typed_end(text, timebase)
    assert timebase.frames_between(timebase.time_of(frame), end_s) == (frame, frame + 1)


@given(seed=st.integers(0, 1000), first=st.integers(0, 119), count=st.integers(1, 300))
def test_a_duration_in_frames_holds_so_many(seed: int, first: int, count: int) -> None:
    timebase = uneven(seed)
    start_s = timebase.time_of(first)
    end_s = typed_duration_end(f"{count} frames", start_s, timebase)
    assert timebase.frames_between(start_s, end_s) == (first, min(first + count, 120))


@given(st.text(max_size=60))
def test_anything_typed_is_a_time_or_refused_with_a_short_sentence(text: str) -> None:
    said = ""
    try:
        assert abs(typed_end(text, FRAMES)) < 1e12
    except Sd2Error as error:
        said = str(error)
    assert len(said) < 400


@pytest.mark.parametrize("text", ["", "nan", "inf", "1e5", "1.5.2", "one", "f", "f1.5", "1:2:3:4"])
def test_what_is_no_time_is_refused(text: str) -> None:
    with pytest.raises(Sd2Error, match=r"was typed as a time.*1:02\.5.*f48"):
        typed_start(text, FRAMES)


def test_a_frame_beyond_the_recording_is_refused() -> None:
    with pytest.raises(Sd2Error, match=r"Frame 120 was typed.*a frame from 0 to 119"):
        typed_end("f120", FRAMES)
