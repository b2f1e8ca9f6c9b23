"""The messages of a window, without the window."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from sd2app.shell.messages.model import MessagesModel

STEPS = st.lists(
    st.tuples(st.sampled_from(("warn", "note", "dismiss")), st.text("abc\n", min_size=1)),
    max_size=20,
)


@given(STEPS)
def test_failures_stay_each_once_until_dismissed_and_all_is_kept(steps) -> None:
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
            failures += [line for line in text.splitlines() if line not in failures]
        if failures:
            assert messages.lines == tuple(dict.fromkeys(failures))
            assert messages.failed
        else:
            assert messages.text == "\n".join(text.splitlines())
    said = [(kind == "warn", text) for kind, text in steps if kind != "dismiss"]
    assert [(one.failed, one.text) for one in messages.history] == said
    times = [one.time_unix_s for one in messages.history]
    assert times == sorted(times)
    messages.forget()
    assert messages.history == ()
