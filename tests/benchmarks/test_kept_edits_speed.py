"""How long it takes until an edit in the window is on disk, and shown, among 10,000 spans.

``pytest tests/benchmarks/test_kept_edits_speed.py --benchmark-only --capture=no`` prints the
95th percentiles, of time and of processor time; docs/performance.md quotes them.
"""

from __future__ import annotations

import random
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from labelled import even, many_spans
from test_labelling_speed import told
from window_models import models_of
from window_on_sample import window_on_sample

SPANS, EDITS = 10_000, 200


@pytest.mark.benchmark(group="labelling in the window")
def test_an_edit_in_the_window(
    qtbot: Any,
    benchmark: Any,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    rng, begun_s, worked_ms, kept_ms, on_disk_ms = random.Random(1), [0.0], [], [], []
    with window_on_sample(qtbot) as window:
        c, frames = models_of(window), even(30 * SPANS)
        c.playback.set_timebase(frames)
        c.span.set_extent(frames.start_s, frames.end_s)
        c.document.recording.labels = many_spans(SPANS)
        c.labels.open(c.document.labels)
        keep = c.label_session._keep

        def timed(*what: Any) -> None:
            before_s = time.perf_counter()
            keep(*what)
            now_s = time.perf_counter()
            kept_ms.append(1e3 * (now_s - before_s))
            on_disk_ms.append(1e3 * (now_s - begun_s[0]))

        monkeypatch.setattr(c.label_session, "_keep", timed)

        def edit() -> None:
            before_s = time.process_time()
            span = rng.choice(c.labels.labels.spans)
            to_s = span.end_s + rng.uniform(-0.3, 0.3)
            begun_s[0] = time.perf_counter()
            c.label_edits.apply(
                rng.choice(
                    [
                        lambda now: now.nudge([span.id], rng.choice((-1, 1))),
                        lambda now: now.resize(span.id, "end", to_s),
                    ]
                )
            )
            worked_ms.append(1e3 * (time.process_time() - before_s))

        benchmark.pedantic(edit, rounds=EDITS, warmup_rounds=5)
        (place,) = (tmp_path / "sd2-studio" / "recovery").iterdir()
        assert list(place.glob("*.journal"))
    told(benchmark, capsys, f"an edit in the window among {SPANS} spans")
    with capsys.disabled():
        for what, times_ms in (
            ("until it is on disk", on_disk_ms),
            ("of which for the record", kept_ms),
            ("of the processor, until it is shown", worked_ms),
        ):
            median, most = np.percentile(times_ms, [50, 95])
            print(f"{what}: median {median:.1f} ms, 95 % within {most:.1f} ms")
