"""The messages of a window, without the window."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from sd2app.shell.messages import MessagesModel

STEPS = st.lists(
    st.tuples(st.sampled_from(("warn", "note", "dismiss")), st.text("abc\n", min_size=1)),
    max_size=20,
)


@given(STEPS)
def test_failures_stand_together_each_once_the_newest_last_and_all_is_kept(steps) -> None:
    messages = MessagesModel()
    failures: list[str] = []
    for kind, text in steps:
        if kind == "dismiss":
            messages.dismiss()
            failures = []
            assert messages.text == ""
            continue
        getattr(messages, kind)(text)
        if kind == "warn":
            said = list(dict.fromkeys(reversed(text.splitlines())))[::-1]
            failures = [line for line in failures if line not in said] + said
        if failures:
            assert messages.lines == tuple(failures)
            assert messages.failed
        else:
            assert messages.text == "\n".join(text.splitlines())
    said = [(kind == "warn", text) for kind, text in steps if kind != "dismiss"]
    assert [(one.failed, one.text) for one in messages.history] == said
    times = [one.time_unix_s for one in messages.history]
    assert times == sorted(times)
    messages.forget()
    assert messages.history == ()


def test_of_failures_that_differ_in_numbers_the_newest_stands_for_all() -> None:
    messages = MessagesModel()
    for text in ("Frame 7 is late by 0.25 s", "The disk is full", "Frame 12 is late by 1,031.5 s"):
        messages.warn(text)
    assert messages.lines == ("The disk is full", "Frame 12 is late by 1,031.5 s")
    assert len(messages.history) == 3
