"""What one edit costs among 10,000 spans: the edit, its record on disk, and where it goes.

``pytest tests/benchmarks/test_labelling_speed.py --benchmark-only --capture=no`` prints the
95th percentiles as well, of time and of processor time, which others on the machine do not
lengthen; decision 30 quotes them.
"""

from __future__ import annotations

import random
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from labelled import even, many_spans

from sd2core.labels.edits import Edits
from sd2core.labels.field_edits import delete
from sd2core.labels.files import read_labels, write_labels
from sd2core.labels.free_time import LabelledFrames
from sd2core.labels.journal import Journal, Kept
from sd2core.labels.recovery import RecoveryPlace
from sd2core.labels.spans import Labels

SPANS = 10_000
EDITS = 200
FRAMES = even(30 * SPANS)


def told(benchmark: Any, capsys: pytest.CaptureFixture[str], what: str) -> None:
    """Print what a benchmark has measured."""
    times_ms = 1e3 * np.array(benchmark.stats.stats.data)
    median, most, worst = np.percentile(times_ms, [50, 95, 100])
    with capsys.disabled():
        print(f"\n{what}: median {median:.1f} ms, 95 % within {most:.1f} ms, worst {worst:.1f} ms")


@pytest.mark.benchmark(group="labelling")
@pytest.mark.parametrize("journal", [True, False], ids=["with journal", "edit alone"])
def test_one_edit(
    benchmark: Any, capsys: pytest.CaptureFixture[str], tmp_path: Path, journal: bool
) -> None:
    rng = random.Random(1)
    state = [many_spans(SPANS)]
    worked_ms: list[float] = []
    written = Journal(tmp_path, 1, Kept(tmp_path / "walk.sd2", state[0]))

    def edit() -> None:
        before_s = time.process_time()
        labels = state[0]
        span = labels.spans[rng.randrange(len(labels.spans))]
        middle_s = (span.start_s + span.end_s) / 2
        choices = [
            lambda: Edits(labels, FRAMES).move(
                [span.id], span.id, span.start_s + rng.uniform(-0.3, 0.3)
            ),
            lambda: Edits(labels, FRAMES).resize(
                span.id, "end", span.end_s + rng.uniform(-0.3, 0.3)
            ),
            lambda: Edits(labels, FRAMES).nudge([span.id], 1),
            lambda: delete(labels, [span.id]),
        ]
        if FRAMES.frames_between(span.start_s, span.end_s)[1] > 2 and span.duration_s > 0.2:
            choices.append(lambda: Edits(labels, FRAMES).split(span.id, middle_s))
        done = rng.choice(choices)()
        if journal:
            written.write(done.name, done.labels)
        state[0] = done.labels
        worked_ms.append(1e3 * (time.process_time() - before_s))

    benchmark.pedantic(edit, rounds=EDITS, warmup_rounds=5)
    told(benchmark, capsys, f"an edit among {SPANS} spans, journal {journal}")
    with capsys.disabled():
        print(f"of the processor: 95 % within {np.percentile(worked_ms, 95):.1f} ms")
    assert len(state[0].spans) > SPANS - EDITS


@pytest.mark.benchmark(group="labelling")
def test_a_new_span(benchmark: Any, capsys: pytest.CaptureFixture[str]) -> None:
    labels = delete(many_spans(SPANS), [SPANS // 2]).labels
    start_s = SPANS // 2 - 1.0
    made = benchmark(
        lambda: Edits(labels, FRAMES).create("Gestures", start_s, start_s + 0.5, "wave")
    )
    told(benchmark, capsys, "a new span")
    assert len(made.labels.spans) == SPANS


@pytest.mark.benchmark(group="labelling")
def test_snapping(benchmark: Any, capsys: pytest.CaptureFixture[str]) -> None:
    labels = many_spans(SPANS)
    found = benchmark(lambda: LabelledFrames(labels, FRAMES).snap(SPANS / 2 + 0.05, 0.1))
    told(benchmark, capsys, "snapping")
    assert found in {edge for one in labels.spans for edge in (one.start_s, one.end_s)}


@pytest.mark.benchmark(group="labelling")
def test_saving_and_opening(
    benchmark: Any, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    labels = many_spans(SPANS)

    def there_and_back() -> Labels:
        write_labels(tmp_path / "labels.json", labels, timebase=FRAMES)
        return read_labels(tmp_path / "labels.json").labels

    assert benchmark.pedantic(there_and_back, rounds=10) == labels
    told(benchmark, capsys, "saving and opening")


@pytest.mark.benchmark(group="labelling")
def test_recovering(benchmark: Any, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    place = RecoveryPlace(tmp_path, tmp_path / "walk.sd2")
    assert place.take()
    labels = many_spans(SPANS)
    journal = place.begin(labels)
    for number in range(1, 101):
        labels = delete(labels, [number]).labels
        journal.write("Delete span", labels)
    # A place leaves out what it has begun itself.
    found = benchmark.pedantic(RecoveryPlace(tmp_path, tmp_path / "walk.sd2").offers, rounds=10)
    told(benchmark, capsys, "reading back 100 edits")
    assert found.offers[0].labels == labels
    journal.close()
    place.release()
