"""Progress off a terminal: lines in a log, seldom."""

from __future__ import annotations

import pytest

from sd2core.cli import bars
from sd2core.cli.output import progress_bar


class Clock:
    """A clock that tests set."""

    now_s = 100.0

    def monotonic(self) -> float:
        return self.now_s


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(bars, "time", clock)
    return clock


def test_a_line_every_few_seconds(clock: Clock, capsys: pytest.CaptureFixture[str]) -> None:
    with progress_bar("Counting") as progress:
        for done in range(1001):
            clock.now_s += 0.02
            progress(done, 1000)
    told = capsys.readouterr()
    assert told.out == ""
    lines = told.err.splitlines()
    assert 1 <= len(lines) <= 4
    for line in lines:
        assert line.startswith("Counting: ")
        assert " of 1,000 frames, " in line
        assert line.endswith(" %")


def test_a_share_alone_of_parts_that_count_different_things(
    clock: Clock, capsys: pytest.CaptureFixture[str]
) -> None:
    with progress_bar("Exporting", unit="") as progress:
        clock.now_s += 6
        progress(370, 1000)
    assert capsys.readouterr().err == "Exporting: 37 %\n"


def test_nothing_of_what_is_soon_done(clock: Clock, capsys: pytest.CaptureFixture[str]) -> None:
    with progress_bar("Counting") as progress:
        for done in range(10):
            progress(done, 10)
    assert capsys.readouterr().err == ""


def test_words_after_the_figures(clock: Clock, capsys: pytest.CaptureFixture[str]) -> None:
    with bars.bar("Training", "step") as bar:
        clock.now_s += 6
        bar.set_postfix_str("validation 0.1")
    assert capsys.readouterr().err == "Training: 0 steps, validation 0.1\n"
