"""Lines of progress put together; truths of what they say."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2app.background.run_monitor import Phase, _Status
from sd2app.training.run import TrainingHistory, TrainingMonitor, metric_rows
from sd2app.widgets.chart import log_ticks
from sd2app.widgets.text import duration_text

START = {"event": "start", "model": "s4", "parameters": 7, "device": "cpu", "epochs": 4,
         "steps_per_epoch": 5, "train_segments": 300}  # fmt: skip


def step(number: int, **more: object) -> dict[str, object]:
    return {"event": "step", "epoch": (number - 1) // 5 + 1, "step": number, "steps": 20,
            "train_rmse": 1.0 / number, "elapsed_s": 0.5 * number,
            "left_s": 0.5 * (20 - number), **more}  # fmt: skip


def epoch(number: int, best: bool = True, **more: object) -> dict[str, object]:
    return {"event": "epoch", "epoch": number, "step": 5 * number, "train_rmse": 0.5,
            "validation_rmse": 1.0 / number, "validation_mae_mps": 0.2, "best": best,
            "elapsed_s": 2.5 * number, "left_s": 1.0, **more}  # fmt: skip


def told(*events: dict[str, object]) -> TrainingHistory:
    history = TrainingHistory()
    history.take(events)
    return history


def test_what_is_told_stands_in_it() -> None:
    history = told(START, step(1), step(5), epoch(1), step(6), epoch(2, best=False))
    assert (history.model, history.parameters, history.segments) == ("s4", 7, 300)
    assert (history.epoch, history.done, history.share) == (2, 10, 0.5)
    assert history.best.epoch == 1
    assert [at for at, _ in history.step_points] == [0.2, 1.0, 1.2]
    assert metric_rows(history)[0] == ("Best epoch", "1")
    assert (history.simulated, told(START | {"kind": "simulated"}).simulated) == (False, True)


def test_a_run_limited_by_time_knows_its_share_by_the_clock() -> None:
    history = told({**START, "epochs": None, "minutes": 1.0}, step(3, steps=None, elapsed_s=15.0))
    assert history.share == pytest.approx(0.25)


def test_what_is_done_again_after_a_kill_counts_once() -> None:
    again = {**START, "resumed": True, "steps_done": 5}
    history = told(START, step(1), epoch(1), step(6), epoch(2), step(11), again)
    assert history.done == 5
    assert [point.epoch for point in history.epoch_points] == [1]
    history.take([step(6), epoch(2), epoch(2)])
    assert [point.epoch for point in history.epoch_points] == [1, 2]


@pytest.fixture
def run(qtbot, tmp_path):
    """A run whose folder is not looked at."""
    made = TrainingMonitor(tmp_path / "run")
    made.close()
    return made


def phase_of(run: TrainingMonitor, live: bool, state: str, word: str = "run") -> Phase:
    run._has_begun = True
    return run._phase_of(_Status(False, live, True, state, None, word, [], None))


def test_an_end_is_an_end_until_it_goes_on(run) -> None:
    error = {"found": "No space", "expected": "some", "remedy": "Make room"}
    run.history.take([START, {"event": "end", "outcome": "failed", "error": error}])
    history = run.history
    assert history.error == "No space. Expected: some. Make room."
    assert phase_of(run, False, "failed") == "failed"
    run.history.take([{**START, "resumed": True, "steps_done": 0}])
    assert phase_of(run, True, "running") == "running"
    assert phase_of(run, False, "died") == "died"


def test_a_process_that_takes_its_folder_meanwhile_is_not_taken_for_dead(run) -> None:
    """Its lock was looked for before it was there, its number was read after."""
    run._has_begun = True
    begins = _Status(True, False, False, None, None, "run", [], None)
    assert run._phase_of(begins) == "starting"
    run.phase = "running"
    assert run._phase_of(begins._replace(exists=True, state="died")) == "running"
    assert run._phase_of(begins._replace(exists=True, state="finished")) == "finished"
    assert run._phase_of(begins._replace(launching=False, exists=True, state="died")) == "died"


@pytest.mark.parametrize(
    ("word", "paused", "phase"),
    [
        ("run", False, "running"),
        ("pause", False, "pausing"),
        ("pause", True, "paused"),
        ("run", True, "resuming"),
        ("stop", True, "stopping"),
        ("cancel", False, "cancelling"),
    ],
)
def test_what_a_process_was_told_and_does_makes_its_phase(run, word, paused, phase) -> None:
    run.history.take([START, *([{"event": "paused"}] if paused else [])])
    assert phase_of(run, True, "running", word) == phase


json_values = st.sampled_from(
    [None, True, False, -1, 0, 3, 2.5, -0.1, 1e300, 10**40, float("nan"), float("inf"), "many", "",
     [1], {"found": 1}, {"found": None, "remedy": [2]}, "finished", "cancelled"]
)  # fmt: skip
keys = st.sampled_from(
    ["epoch", "step", "steps", "train_rmse", "elapsed_s", "left_s", "model", "steps_per_epoch",
     "epochs", "minutes", "outcome", "error", "resumed", "steps_done", "best"]
)  # fmt: skip
kinds = st.sampled_from(["start", "step", "epoch", "paused", "resumed", "end", "unheard of"])


@given(st.lists(st.tuples(kinds, st.dictionaries(keys, json_values)), max_size=8))
def test_nothing_that_is_told_breaks_it(events) -> None:
    history = TrainingHistory()
    history.take([START])
    history.take([{**content, "event": kind} for kind, content in events])
    for point in history.epoch_points:
        assert isinstance(point.epoch, int)
    assert history.share is None or 0 <= history.share <= 1
    assert isinstance(metric_rows(history), list)


@given(st.floats(1e-4, 1e3), st.floats(1.6, 1e4), st.integers(3, 9))
def test_an_axis_of_errors_has_values_on_it(low, ratio, most) -> None:
    values = log_ticks(low, low * ratio, most)
    assert 1 <= len(values) <= most
    assert values == sorted(set(values))
    assert all(0.999 * low <= value <= 1.001 * low * ratio for value in values)


def test_half_a_decade_has_three_values() -> None:
    assert log_ticks(0.2, 0.8, 5) == pytest.approx([0.2, 0.3, 0.5, 0.7])


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (3, "a few seconds"),
        (33, "35 s"),
        (59, "1 min"),
        (3590, "1 h"),
        (7800, "2 h 10 min"),
        (100_000, "28 h"),
        (400_000, "4.6 days"),
    ],
)
def test_durations_are_rounded_as_estimates_deserve(seconds, text) -> None:
    assert duration_text(seconds) == text
