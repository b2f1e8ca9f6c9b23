"""Pairs of synthetic and real Doppler from MARS recordings.

The body of :mod:`sd2core.mocap.driving` moves as the Kinect saw it and gives the input;
the target is what the radar's points say, on the same axis and the same frames.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from sd2core.body.model import Resolution
from sd2core.doppler import PRESETS, SynthesisOptions, Synthesizer
from sd2core.errors import Sd2Error
from sd2core.io.radar.mars import (
    DOPPLER_STEP_MPS,
    FRAMES_PER_S,
    MarsPart,
    MarsStretch,
    mars_parts,
    read_mars,
)
from sd2core.mocap.driving import KINECT_MARKERS, DrivenClip, SkeletonClip, puppet_of
from sd2core.pairs.store import PairWriter, Take, TakeKey
from sd2core.progress import Progress, silent
from sd2core.sensor import VelocityAxis, VirtualSensor
from sd2core.version import __version__

Target = Literal["share", "intensity"]

_LABELS = ("background",)

_SYNTHESIS = replace(PRESETS["paper"], visibility="facing", null_bins=())


@dataclass(frozen=True)
class MarsChoices:
    """Options of making pairs from MARS recordings."""

    synthesis: SynthesisOptions = _SYNTHESIS
    """Of the input; axis and nulled bins are the target's, too. By default no bin is nulled: half
    of the radar's points are within one step of zero velocity."""
    target: Target = "share"
    """``share`` divides each frame of the target by the sum of its intensities, ``intensity``
    keeps them as they are."""
    resolution: Resolution = "low"  # 1,229 vertices; medium 5,000, high 13,348
    moments: int = 1
    """Poses of the body per radar frame; velocities are differences over two of these steps."""


@dataclass(frozen=True)
class MadePairs:
    """Result of :func:`make_mars_pairs`."""

    subjects: dict[str, tuple[int, int]]  # takes and frames
    stature_m: dict[str, float]  # height of the body of every subject of this run
    residual_m: dict[str, float]  # mean distance of its joints from the skeleton's


def radar_doppler(
    stretch: MarsStretch, axis: VelocityAxis, target: Target = "share"
) -> NDArray[np.float32]:
    """Doppler of the radar's points per frame, (frames, bins).

    A point says no more than that something moves within half a step of its velocity:
    its intensity is spread evenly over that cell, and what is beyond the axis left out.
    Frames without points are 0.
    """
    edges = axis.edges_mps
    low = stretch.point_mps[:, None] - 0.5 * DOPPLER_STEP_MPS
    inside = np.minimum(edges[1:], low + DOPPLER_STEP_MPS) - np.maximum(edges[:-1], low)
    spread = np.maximum(inside, 0.0) / DOPPLER_STEP_MPS  # (P, bins)
    weight = stretch.point_intensity
    if target == "share":
        weight = weight / np.bincount(stretch.point_rows, weight)[stretch.point_rows]
    values = np.zeros((stretch.frame_count, axis.bins))
    np.add.at(values, stretch.frames[stretch.point_rows], weight[:, None] * spread)
    return values.astype(np.float32)


def skeleton_clip(stretch: MarsStretch) -> SkeletonClip:
    """The skeleton on all of the stretch's frames."""
    return SkeletonClip.on_grid(stretch.frames, stretch.joints_m, FRAMES_PER_S)


def body_doppler(
    driven: DrivenClip, choices: MarsChoices, progress: Progress = silent
) -> NDArray[np.float32]:
    """Synthetic Doppler of a driven body from the radar's place, (frames, bins)."""
    frames = len(driven.clip.times_s)
    times_s = np.arange((frames - 1) * choices.moments + 1) / (FRAMES_PER_S * choices.moments)
    mesh = driven.mesh(times_s, choices.resolution)
    found = Synthesizer(mesh, choices.synthesis).map(VirtualSensor(), progress=progress)
    return np.ascontiguousarray(found.values[:, :: choices.moments].T)


def make_mars_pairs(
    folders: Sequence[Path],
    out: Path,
    choices: MarsChoices | None = None,
    progress: Progress = silent,
) -> MadePairs:
    """Write the pairs of some folders, each with one person's parts; resume a stopped run.

    The subject of a take is person and part (``1-test``), so that both can be kept apart;
    every stretch is a take. ``out`` is the store; progress counts frames.

    Raises Sd2Error if a folder cannot be used, two hold the same, or the store holds other
    pairs.
    """
    choices = choices or MarsChoices()
    parts = [read_mars(folder, name) for folder in folders for name in mars_parts(folder)]
    _refuse_twice(parts)
    synthesis = choices.synthesis
    writer = PairWriter(
        out,
        kind="real",
        axis=synthesis.axis,
        null_bins=synthesis.null_bins,
        frame_rate_hz=FRAMES_PER_S,
        labels=_LABELS,
        provenance=_provenance(parts, choices),
    )
    total = sum(_frames(part) for part in parts)
    done = 0
    made = MadePairs({}, {}, {})
    for part in parts:
        subject = _subject(part)
        if any(key not in writer.done for key in _keys(part)):

            def report(inside: int, before: int = done) -> None:
                progress(before + inside, total)

            _write(writer, part, choices, made, report)
        made.subjects[subject] = (len(part.stretches), _frames(part))
        done += _frames(part)
    progress(total, total)
    return made


def _write(
    writer: PairWriter,
    part: MarsPart,
    choices: MarsChoices,
    made: MadePairs,
    progress: Callable[[int], None],
) -> None:
    """Append those takes of one part that are not there; ``progress`` gets frames done."""
    subject = _subject(part)
    progress(0)
    clips = [skeleton_clip(stretch) for stretch in part.stretches]
    puppet = puppet_of(clips, KINECT_MARKERS)
    done, residuals_m = 0, []
    for key, stretch, clip in zip(_keys(part), part.stretches, clips, strict=True):
        if key not in writer.done:
            driven = puppet.pose(clip, partial(progress, done))
            radar = radar_doppler(stretch, choices.synthesis.axis, choices.target)
            radar[:, list(choices.synthesis.null_bins)] = 0.0
            writer.append(
                Take(
                    subject=subject,
                    name=key.name,
                    synthetic=body_doppler(driven, choices),
                    radar=radar,
                    times_s=clip.times_s,
                    label=np.zeros(stretch.frame_count, np.int8),
                    sensor_position_m=np.zeros(3),
                )
            )
            residuals_m.append(driven.residual_m.ravel())
        done += stretch.frame_count
        progress(done)
    made.stature_m[subject] = puppet.shape.stature_m
    made.residual_m[subject] = float(np.nanmean(np.concatenate(residuals_m)))


def _subject(part: MarsPart) -> str:
    return f"{part.subject}-{part.name}"


def _keys(part: MarsPart) -> list[TakeKey]:
    return [
        TakeKey(_subject(part), f"stretch-{number:02d}", 0)
        for number in range(1, len(part.stretches) + 1)
    ]


def _frames(part: MarsPart) -> int:
    return sum(stretch.frame_count for stretch in part.stretches)


def _refuse_twice(parts: Sequence[MarsPart]) -> None:
    seen: dict[str, str] = {}
    for part in parts:
        subject = _subject(part)
        if subject in seen:
            raise Sd2Error(
                f"{seen[subject]} and {part.source} both hold part {part.name} of person"
                f" {part.subject}",
                "each part once",
                "Name every folder once, and folders after their persons (mars_subject4)",
            )
        seen[subject] = part.source


def _provenance(parts: Sequence[MarsPart], choices: MarsChoices) -> dict[str, Any]:
    return {
        "made_by": "sd2 pairs mars",
        "version": __version__,
        "parts": [[Path(part.source).name, part.name] for part in parts],
        "radar": "points of a 77 GHz radar (MARS, MIT licence)",
        "input": "a body driven by a Kinect skeleton",
        **asdict(choices),
    }
