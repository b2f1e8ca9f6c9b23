from __future__ import annotations

import threading
import time

import pytest

from sd2app.background.latest import LatestRunner


@pytest.fixture
def runner(qtbot):
    runner = LatestRunner("test")
    yield runner
    runner.close()


def test_a_task_delivers_parts_and_a_result_in_order(runner, qtbot):
    seen = []
    runner.partial.connect(seen.append)

    def task(emit):
        for value in range(5):
            emit(value)
        return "done"

    with qtbot.waitSignal(runner.finished) as result:
        runner.submit(task)
    assert seen == [0, 1, 2, 3, 4]
    assert result.args == ["done"]
    assert not runner.busy


def test_the_newest_request_wins(runner, qtbot):
    started, release = threading.Event(), threading.Event()
    results = []
    runner.finished.connect(results.append)

    def slow(emit):
        started.set()
        release.wait(5)
        return "stale"

    runner.submit(slow)
    assert started.wait(5)
    for value in range(20):
        runner.submit(lambda emit, value=value: value)
    release.set()
    qtbot.waitUntil(lambda: not runner.busy)
    assert results == [19]


def test_a_running_task_learns_that_it_is_stale(runner, qtbot):
    laps = []
    started, left = threading.Event(), threading.Event()

    def endless(emit):
        try:
            while True:
                started.set()
                emit(None)
                laps.append(1)
                time.sleep(0.001)
        finally:
            left.set()

    runner.submit(endless)
    assert started.wait(5)
    runner.cancel()
    assert left.wait(5)
    assert not runner.busy


def test_a_failure_is_delivered_and_the_runner_lives_on(runner, qtbot):
    def fails(emit):
        raise ValueError("no")

    with qtbot.waitSignal(runner.failed) as failure:
        runner.submit(fails)
    assert str(failure.args[0]) == "no"
    with qtbot.waitSignal(runner.finished) as result:
        runner.submit(lambda emit: 7)
    assert result.args == [7]


def test_closing_waits_for_the_task_and_refuses_more(qtbot):
    runner = LatestRunner("test")
    left = threading.Event()

    def endless(emit):
        try:
            while True:
                emit(None)
                time.sleep(0.001)
        finally:
            left.set()

    runner.submit(endless)
    runner.close()
    assert left.is_set()
    runner.submit(lambda emit: pytest.fail("ran after closing"))
    assert not runner.busy
