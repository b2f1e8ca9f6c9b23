"""Pairs of synthetic and real Doppler from MARS recordings.

The body of :mod:`sd2core.mocap.driving` moves as the Kinect saw it and gives the input;
the target is what the radar's points say, on the same axis and the same frames. Where the radar
stands and how its clock lies is estimated from the two.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from sd2core.body.model import Resolution
from sd2core.body.parts import synthetic_map
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
from sd2core.io.radar.point_maps import velocity_histogram
from sd2core.maps import DopplerMap
from sd2core.mesh.vertex_parts import PARTS
from sd2core.mocap.driving import KINECT_MARKERS, DrivenClip, SkeletonClip, puppet_of
from sd2core.mocap.radar_place import RadarPlace, Seen, estimate_place
from sd2core.pairs.store import PairWriter, Take
from sd2core.pairs.summary import TakeKey
from sd2core.progress import Progress, silent
from sd2core.sensor import VelocityAxis, VirtualSensor
from sd2core.timebase import Timebase
from sd2core.version import __version__

Target = Literal["share", "intensity"]

_LABELS = ("background",)
_POINTS_STEP = 16
"""Of the vertices; the others say the same of where the radar stands."""

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
    limbs: bool = False  # The input is also split by the parts of the body.
    place: RadarPlace | None = None
    """Of the radar beside the Kinect, and of its clock; None: estimated for each person."""


@dataclass(frozen=True)
class PersonMade:
    """Pairs of one person; the rest is known where this run drove their body."""

    takes: int
    frames: int
    stature_m: float | None = None  # height of the body
    residual_m: float | None = None  # mean distance of its joints from the skeleton's
    radar: RadarPlace | None = None


def radar_doppler(
    stretch: MarsStretch, axis: VelocityAxis, target: Target = "share"
) -> NDArray[np.float32]:
    """Doppler of the radar's points per frame, (frames, bins).

    As :func:`~sd2core.io.radar.point_maps.velocity_histogram`; frames without points are 0.
    """
    weight = stretch.point_intensity
    if target == "share":
        weight = weight / np.bincount(stretch.point_rows, weight)[stretch.point_rows]
    columns = stretch.frames[stretch.point_rows]
    return velocity_histogram(
        columns, stretch.point_mps, weight, stretch.frame_count, axis, DOPPLER_STEP_MPS
    ).T


def skeleton_clip(stretch: MarsStretch) -> SkeletonClip:
    """The skeleton on all of the stretch's frames."""
    return SkeletonClip.on_grid(stretch.frames, stretch.joints_m, FRAMES_PER_S)


def body_doppler(driven: DrivenClip, choices: MarsChoices, place: RadarPlace) -> DopplerMap:
    """Synthetic Doppler of a driven body from the radar's place, on the radar's frames."""
    times_s = np.arange(len(driven.clip.times_s)) / FRAMES_PER_S
    mesh = driven.mesh(times_s + place.offset_s, choices.resolution)
    maker, sensor = Synthesizer(mesh, choices.synthesis), VirtualSensor(place.position_m)
    doppler = synthetic_map(maker, sensor, limbs=choices.limbs)
    return replace(doppler, timebase=Timebase(times_s))


def make_mars_pairs(
    folders: Sequence[Path],
    out: Path,
    choices: MarsChoices | None = None,
    progress: Progress = silent,
) -> dict[str, PersonMade]:
    """Write the pairs of some folders, each with one person's parts; resume a stopped run.

    The subject of a take is the person; every stretch is a take. Returns what is made of each.

    Parameters
    ----------
    folders : sequence of Path
        As :func:`~sd2core.io.radar.mars.mars_parts` reads them.
    out : Path
        Store of the pairs.
    choices : MarsChoices, optional
    progress : Progress
        Counts frames.

    Raises
    ------
    Sd2Error
        If a folder cannot be used, two hold the same, or the store holds other pairs.
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
        parts=PARTS if choices.limbs else (),
    )
    total = sum(stretch.frame_count for part in parts for stretch in part.stretches)
    done = 0
    made: dict[str, PersonMade] = {}
    for person in dict.fromkeys(part.subject for part in parts):
        own = [part for part in parts if part.subject == person]
        stretches = {key: stretch for part in own for key, stretch in takes_of(part)}
        frames = sum(stretch.frame_count for stretch in stretches.values())
        made[person] = PersonMade(len(stretches), frames)
        if not stretches.keys() <= writer.done:

            def report(inside: int, before: int = done) -> None:
                progress(before + inside, total)

            stature_m, residual_m, place = _write(writer, stretches, choices, report)
            made[person] = PersonMade(len(stretches), frames, stature_m, residual_m, place)
        done += frames
        progress(done, total)
    return made


def _write(
    writer: PairWriter,
    stretches: Mapping[TakeKey, MarsStretch],
    choices: MarsChoices,
    progress: Callable[[int], None],
) -> tuple[float, float, RadarPlace]:
    """Append the takes of a person that are not there; stature, residual and radar of all."""
    progress(0)
    driven, place = driven_clips([*stretches.values()], choices.place, progress)
    done = sum(len(one.clip.times_s) - 1 for one in driven)
    synthesis = choices.synthesis
    for (key, stretch), one in zip(stretches.items(), driven, strict=True):
        if key in writer.done:
            continue
        progress(done)
        doppler = body_doppler(one, choices, place)
        radar = radar_doppler(stretch, synthesis.axis, choices.target)
        radar[:, list(synthesis.null_bins)] = 0.0
        writer.append(
            Take(
                subject=key.subject,
                name=key.name,
                synthetic=np.ascontiguousarray(doppler.values.T),
                radar=radar,
                times_s=one.clip.times_s,
                label=np.zeros(stretch.frame_count, np.int8),
                sensor_position_m=np.array(place.position_m),
                limbs=doppler.limbs,
            )
        )
    residual_m = float(np.nanmean(np.concatenate([one.residual_m.ravel() for one in driven])))
    return driven[0].puppet.shape.stature_m, residual_m, place


def driven_clips(
    stretches: Sequence[MarsStretch],
    place: RadarPlace | None = None,
    progress: Callable[[int], None] = lambda done: None,
) -> tuple[list[DrivenClip], RadarPlace]:
    """Return a person's body in all stretches, and the radar's place, estimated if not given.

    ``progress`` gets the frames that are done, all but the last of every stretch.
    """
    clips = [skeleton_clip(stretch) for stretch in stretches]
    puppet = puppet_of(clips, KINECT_MARKERS)
    driven: list[DrivenClip] = []
    done = 0
    for clip in clips:
        driven.append(puppet.pose(clip, partial(progress, done)))
        done += len(clip.times_s) - 1
    place = place or estimate_place(
        [seen_of(one, stretch) for one, stretch in zip(driven, stretches, strict=True)]
    )
    return driven, place


def seen_of(driven: DrivenClip, stretch: MarsStretch) -> Seen:
    """Velocities of body and radar in one stretch, to find the radar's place by."""
    clip = driven.clip
    velocity_mps = np.full(stretch.frame_count, np.nan)
    velocity_mps[stretch.frames] = stretch.mean_velocity_mps()
    points_m = driven.mesh(clip.times_s, "low").read(0, len(clip.times_s))[:, ::_POINTS_STEP]
    return Seen(clip.times_s, points_m.astype(np.float64), velocity_mps)


def takes_of(part: MarsPart) -> list[tuple[TakeKey, MarsStretch]]:
    """Return the stretches of a part as takes of its person."""
    return [
        (TakeKey(part.subject, f"{part.name}-stretch-{number:02d}", 0), stretch)
        for number, stretch in enumerate(part.stretches, start=1)
    ]


def _refuse_twice(parts: Sequence[MarsPart]) -> None:
    seen: dict[str, str] = {}
    for part in parts:
        subject = f"{part.subject}-{part.name}"
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
        "moments": 1,  # poses per frame
        **{name: value for name, value in asdict(choices).items() if name != "limbs"},
    }
