"""What denoising costs the window: loading torch, following a hand, frames one by one.

Run with a display, real or virtual, like the other benchmarks of the window.
"""

from __future__ import annotations

import json
import math
import subprocess
import sys
import time
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import Qt, QTimer
from window_models import models_of
from window_on_sample import settle, window_on_sample

from sd2app.background.model_worker.client import ModelProcess, RemoteDenoiser
from sd2core.denoise.card import ModelCard
from sd2core.denoise.scaling import Compression, Scaling
from sd2core.maps import DopplerMap
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase

FRAMES = 450

TICK = """
import json, sys, threading, time
import numpy as np
from PySide6.QtCore import QCoreApplication, Qt, QTimer
from sd2app.background.model_worker.client import ModelProcess, RemoteDenoiser

how, model = sys.argv[1:]
application = QCoreApplication([])
ticks, timer = [], QTimer()
timer.setTimerType(Qt.TimerType.PreciseTimer)
timer.setInterval(5)
timer.timeout.connect(lambda: ticks.append(time.perf_counter()))
timer.start()
process = ModelProcess()

def work():
    if how == "thread":
        import torch
        from sd2core.denoise.files import load_model
        load_model(model)
    elif how == "process":
        RemoteDenoiser(process, model)
    else:
        time.sleep(2.0)

thread = threading.Thread(target=work)
began = time.perf_counter()
thread.start()
while thread.is_alive():
    application.processEvents()
    time.sleep(0.0005)
took_s = time.perf_counter() - began
application.processEvents()
steps = 1e3 * np.diff([began, *ticks, time.perf_counter()])
process.close()
print(json.dumps({"took_s": took_s, "p95_ms": np.percentile(steps, 95), "max_ms": steps.max()}))
"""


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    """The default S4 with random weights: what it costs does not depend on what it learned."""
    import torch

    from sd2core.denoise.files import save_model
    from sd2core.denoise.live import TrainedDenoiser
    from sd2core.denoise.registry import build

    torch.set_num_threads(1)
    card = ModelCard(
        model="s4",
        options={},
        scaling=Scaling(Compression(0.01), Compression(1e-4)),
        axis=VelocityAxis(32, 2.0),
        null_bins=(14, 15, 16),
        frame_rate_hz=30.0,
        trained_on="simulated",
    )
    path = tmp_path_factory.mktemp("model") / "s4.safetensors"
    save_model(path, TrainedDenoiser(build("s4", 32), card))
    return path


def a_map():
    values = 0.02 * np.random.default_rng(0).exponential(size=(32, FRAMES)).astype(np.float32)
    values[14:17] = 0.0
    timebase = Timebase.regular(FRAMES, 30.0)
    return DopplerMap(values, VelocityAxis(32, 2.0), timebase, "synthetic", null_bins=(14, 15, 16))


def test_the_tick_while_torch_is_loaded(benchmark, model):
    """A 5 ms tick while a model is loaded in a thread and in a process of its own."""

    def load():
        return {
            how: json.loads(
                subprocess.run(
                    [sys.executable, "-c", TICK, how, str(model)],
                    capture_output=True,
                    text=True,
                    check=True,
                ).stdout
            )
            for how in ("nothing", "thread", "process")
        }

    found = benchmark.pedantic(load, rounds=1)
    benchmark.extra_info.update(found)
    for how, figures in found.items():
        print(f"\n{how}:", {name: round(value, 1) for name, value in figures.items()}, end="")


def test_what_the_way_to_the_process_costs(benchmark, model):
    """450 frames and one frame, asked from here and in the window's way."""
    from sd2core.denoise.files import load_model

    process, given = ModelProcess(), a_map()
    both: dict[str, Any] = {"here": load_model(model), "process": RemoteDenoiser(process, model)}
    frame = np.ascontiguousarray(given.values[:, 0])

    def best_ms(work, times):
        took = []
        for _ in range(times):
            began = time.perf_counter()
            work()
            took.append(1e3 * (time.perf_counter() - began))
        return {"median": float(np.median(took)), "best": min(took)}

    def measure():
        found = {}
        for name, denoiser in both.items():
            live = denoiser.live()
            found[f"map_{name}_ms"] = best_ms(lambda one=denoiser: one.denoise(given), 30)
            found[f"frame_{name}_ms"] = best_ms(lambda one=live: one.step(frame), 200)
        return found

    found = benchmark.pedantic(measure, rounds=1)
    process.close()
    benchmark.extra_info.update(found)
    for name, figures in found.items():
        print(f"\n{name}:", {part: round(value, 2) for part, value in figures.items()}, end="")


@pytest.fixture
def window(qtbot):
    with window_on_sample(qtbot) as window:
        yield window


def test_dragging_with_and_without_a_denoiser(benchmark, model, window, qtbot):
    """Maps a second while a hand moves the sensor at 125 Hz, and the window's tick."""
    c = models_of(window)

    def drag(seconds=5.0):
        counts, ticks = {"synthetic": 0, "denoised": 0}, []
        track = c.denoised if c.denoised.map is not None else c.synthetic

        def count():
            counts["denoised" if track is c.denoised else "synthetic"] += 1

        track.changed.connect(count)
        hand, tick = QTimer(), QTimer()
        tick.setTimerType(Qt.TimerType.PreciseTimer)
        tick.timeout.connect(lambda: ticks.append(time.perf_counter()))
        began = time.perf_counter()

        def move():
            phase = time.perf_counter() - began
            c.edits.drag_sensor((0.5 * math.sin(2 * phase), 0.2 * math.cos(3 * phase), 0.0))

        hand.timeout.connect(move)
        c.edits.begin_sensor_drag()
        hand.start(8)
        tick.start(5)
        qtbot.wait(int(1000 * seconds))
        hand.stop()
        tick.stop()
        track.changed.disconnect(count)
        c.edits.end_drag()
        settle(window, qtbot)
        steps = 1e3 * np.diff(ticks)
        return {
            "maps_per_s": sum(counts.values()) / seconds,
            "tick_p95_ms": float(np.percentile(steps, 95)),
        }

    def measure():
        c.denoise.use(None)
        qtbot.waitUntil(lambda: c.denoised.map is None, timeout=60_000)
        without = drag()
        c.denoise.use(model)
        qtbot.waitUntil(lambda: c.denoised.map is not None and window.settled, timeout=60_000)
        return {"without": without, "with": drag()}

    found = benchmark.pedantic(measure, rounds=1)
    benchmark.extra_info.update(found)
    for name, figures in found.items():
        print(f"\n{name}:", {part: round(value, 1) for part, value in figures.items()}, end="")
