"""Denoisers of a study: learnt from a draw of real data alone, each in a process of its own."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from sd2core.denoise.files import load_model
from sd2core.files.atomic import atomic_write_text
from sd2core.files.paths import remove
from sd2core.files.texts import read_json
from sd2core.options.records import words_of
from sd2core.options.training import Train
from sd2core.pairs.segments import OVERLAP, segment_starts
from sd2core.pairs.store import PairSet, PairWriter, Take
from sd2core.study.plan import Denoiser

_BATCH = 16


def learn_denoiser(
    place: Path, chosen: Denoiser, pairs: PairSet, takes: Sequence[Take], seed: int
) -> None:
    """Have a denoiser learnt in a folder, if it is not there; a reason is kept if it fails.

    Parameters
    ----------
    place : Path
        Folder, made anew if a denoiser failed in it or was stopped; a reason is in its file
        ``done``.
    chosen : Denoiser
    pairs : PairSet
        Axis, frame rate and the like of the takes.
    takes : sequence of Take
        What is learnt from; those shorter than a segment are left out.
    seed : int

    Raises
    ------
    KeyboardInterrupt
        If the training was interrupted.
    """
    if (place / "done").exists() and (place / "run" / "best.safetensors").exists():
        return
    if place.exists():  # It failed, or was stopped.
        remove(place)
    place.mkdir(parents=True)
    long = [one for one in takes if len(one.times_s) >= chosen.segment_frames]
    first = long[0].limbs if long else None
    writer = PairWriter(
        place / "pairs.zarr",
        kind=pairs.kind,
        axis=pairs.axis,
        null_bins=pairs.null_bins,
        frame_rate_hz=pairs.frame_rate_hz,
        labels=pairs.labels,
        provenance=pairs.provenance,
        parts=() if first is None else first.parts,
    )
    for number, take in enumerate(long):
        # Pieces of one take are kept apart by their names.
        writer.append(replace(take, name=f"{take.name}-{number}"))
    words = words_of("train", _command(place, chosen, long, seed))
    done = subprocess.run(
        [sys.executable, "-m", "sd2core.cli", *words],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        check=False,
    )
    reason = done.stderr.strip().splitlines()[-1] if done.returncode and done.stderr else ""
    if done.returncode < 0 or done.returncode == 130:
        raise KeyboardInterrupt
    atomic_write_text(place / "done", json.dumps({"reason": reason}))


def _command(place: Path, chosen: Denoiser, takes: Sequence[Take], seed: int) -> Train:
    """Options of ``sd2 train``."""
    cut = chosen.segment_frames, min(OVERLAP, chosen.segment_frames // 4)
    training: dict[str, float] = {
        "velocity_weight": chosen.velocity_weight,
        "batch_size": _BATCH,
        "seed": seed,
    }
    if chosen.minutes is not None:
        training["minutes"] = chosen.minutes
    else:
        segments = sum(len(segment_starts(len(one.times_s), *cut)) for one in takes)
        training["epochs"] = max(1, round(chosen.steps * _BATCH / max(1, segments)))
    return Train(
        inputs=(place / "pairs.zarr",),
        out=place / "run",
        model={"name": chosen.model, "inputs": chosen.inputs},
        set=tuple(chosen.options.items()),
        training=training,
        data={"segment_frames": cut[0], "overlap_frames": cut[1], "test_subjects": ()},
        machine={"threads": 1},
    )


def denoiser_in(place: Path) -> tuple[Any, str]:
    """Return the denoiser that was learnt in a folder; or none, and the reason."""
    model = place / "run" / "best.safetensors"
    if model.exists():
        return load_model(model), ""
    return None, str(read_json(place / "done").get("reason", "")) or "it could not be trained"
