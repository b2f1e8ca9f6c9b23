"""Networks that learn from segments of several lengths, at equal training time."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np

from sd2core.denoise.files import load_model
from sd2core.pairs.store import read_pairs
from tools.documentation.measured import filled, table
from tools.documentation.runs import MEMORY, Job, evaluated, sd2, settings, train

LENGTHS = (72, 288, 1152, 4608)
SETTINGS = {"30 frames/s, 32 bins": (30, 32, 160, 48), "120 frames/s, 128 bins": (120, 128, 40, 12)}
"""Frame rate, bins, seconds of a take, minutes of all: as many frames in both."""

MODELS = ("s4", "s4d", "gru", "unet", "swin")
_WINDOWED = ("unet", "swin")
_FRAMES = 4608


def long_sequences(folder: Path, minutes: float) -> str:
    """Train what is missing; the text of the section."""
    folder.mkdir(parents=True, exist_ok=True)
    nearest = []
    rows = [["network", "segment", "peak MAE m/s", "mean MAE m/s", "map RMSE", "memory", "time"]]
    for title, (rate, bins, take_s, total_min) in SETTINGS.items():
        data = folder / f"{rate}.zarr"
        sd2(
            *("simulate", "campaign", "--out", data, "--people", 6, "--minutes", total_min),
            *("--take-seconds", take_s, "--rate", rate, "--bins", bins, "--seed", 4),
        )
        kinds = [
            (model, length)
            for model in MODELS
            for length in (LENGTHS[:1] if model in _WINDOWED else LENGTHS)
        ]
        jobs = [
            Job(f"{rate}-{model}-{length}", data, _options(model, length, minutes))
            for model, length in kinds
        ]
        runs = train(folder, jobs)
        groups = evaluated([run / "best.safetensors" for run in runs], data)["groups"]
        none, *_ = groups
        reports = {one["name"]: one["all"] for group in groups for one in group["models"]}
        rows.append([f"**{title}**: none", "", *_errors(none["models"][0]["all"]), "", ""])
        for (model, length), run in zip(kinds, runs, strict=True):
            score = reports[run.name]
            memory = f"{int((run / MEMORY).read_text()) / 1e6:.0f} MB"
            took = f"{1e6 * _frame_s(run, data):.0f} µs"
            rows.append([model, f"{length:,}", *_errors(score), memory, took])
        errors_mps = [reports[run.name]["mean"]["mae_mps"] for run in runs]
        model, length = kinds[errors_mps.index(min(errors_mps))]
        nearest.append(f"{model} of {length:,} frames at {title}")
    return filled(
        "long-sequences.md", nearest="; ".join(nearest), minutes=minutes, table=table(rows)
    )


def _errors(score: dict[str, Any]) -> list[str]:
    return [
        f"{score['peak']['mae_mps']:.3f}",
        f"{score['mean']['mae_mps']:.3f}",
        f"{score['map']['rmse_compressed']:.3f}",
    ]


def _options(model: str, length: int, minutes: float) -> tuple[str, ...]:
    """How a network learns from segments of some length, from as many frames at once."""
    options: dict[str, object] = {"dropout": 0.3}
    if model in ("s4", "s4d"):
        options |= {"live": "false", "dt_min": round(0.02 * 72 / length, 6)}
    return (
        *("--model", model, *settings(options), "--minutes", f"{minutes:g}"),
        *("--segment-frames", str(length), "--batch-size", str(_FRAMES // length)),
        *("--velocity-weight", "1"),
    )


def _frame_s(run: Path, data: Path) -> float:
    model = load_model(run / "best.safetensors")
    values = np.concatenate([take.synthetic for take in read_pairs(data).takes])[:_FRAMES]
    model.denoise_values(values)
    began = time.perf_counter()
    model.denoise_values(values)
    return (time.perf_counter() - began) / len(values)
