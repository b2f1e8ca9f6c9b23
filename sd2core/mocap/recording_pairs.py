"""Pairs of synthetic and radar Doppler from recordings that have a mesh and a radar capture."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from sd2core.body.parts import synthetic_map
from sd2core.denoise.resample_to_model import clips, evenly
from sd2core.doppler import PRESETS, SynthesisOptions, Synthesizer
from sd2core.errors import Sd2Error
from sd2core.files.paths import check_distinct
from sd2core.fmcw.processing import doppler_map
from sd2core.io.stored_vertices import damaged_frames
from sd2core.labels.per_frame import BACKGROUND, label_per_frame, plain_name
from sd2core.labels.spans import Labels
from sd2core.maps import DopplerMap, MapKind
from sd2core.pairs.rows import agreed
from sd2core.pairs.store import PairWriter, Take
from sd2core.progress import Progress, part_of, silent
from sd2core.radar_config import CLUTTER
from sd2core.recording.recording import Recording, open_recording
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase
from sd2core.version import __version__

TAKE_S = 15.0
"""Longer stretches are cut: takes can be kept apart even where there is one person."""

_SAME_RATE = 0.01


@dataclass(frozen=True)
class PairsMade:
    """Result of :func:`make_recording_pairs`."""

    subjects: dict[str, tuple[int, int]]  # takes and frames
    left_out_s: float
    """Time without a radar frame, without a person, or in rests shorter than a second."""
    damaged: dict[str, int]  # Frames lost to damaged chunks, of the recordings that have some.


def make_recording_pairs(
    recordings: Sequence[Path],
    out: Path,
    synthesis: SynthesisOptions = PRESETS["paper"],
    *,
    subjects: Sequence[str] | None = None,
    limbs: bool = False,
    progress: Progress = silent,
) -> PairsMade:
    """Put recordings into a store of pairs; resume a store that was begun.

    Every recording is seen by its own sensor. The radar's frame that is nearest to a frame
    of the mesh, by the recording's offset, is its target. A radar shows everybody in a scene, and
    so does the input; labels are those of :func:`frame_labels`.

    Parameters
    ----------
    recordings : sequence of Path
    out : Path
        Store of the pairs.
    synthesis : SynthesisOptions
        Of the input; axis and nulled bins are the target's, too. By default the paper's.
    subjects : sequence of str, optional
        People in the recordings; by default whom each names, or else another in each, named like
        it.
    limbs : bool
        The input is also split by the parts of the body.
    progress : Progress

    Raises
    ------
    Sd2Error
        If a recording lacks mesh or radar, two are called alike, there is not one person for each,
        frame rates or kinds of radar differ, or the store holds takes that were made of something
        else.
    """
    named = named_recordings(recordings, subjects)
    opened = [recording for recording, _ in named]
    check_there(opened, ("mesh", "radar"))
    labels = label_names(opened)
    channels = [one.channel_in_words for one in opened]
    writer: PairWriter | None = None
    rates_hz: dict[Path, float] = {}
    kinds: list[MapKind] = []
    by_subject: dict[str, tuple[int, int]] = {}
    left_out_s = 0.0
    damaged: dict[str, int] = {}
    for number, (recording, subject) in enumerate(named):
        synthetic, radar, lost = _maps(
            recording, synthesis, limbs, part_of(progress, number, number + 1, len(opened))
        )
        rates_hz[recording.folder] = rate_hz = synthetic.timebase.frames_per_s
        check_rates(rates_hz)
        kinds.append(radar.kind)
        if radar.kind != kinds[0]:
            raise Sd2Error(
                f"Of {opened[0].folder} and {recording.folder} the radar of one is simulated, of"
                " the other real",
                "all real or all simulated",
                "Make two stores; `sd2 train` mixes them",
            )
        if writer is None:
            writer = PairWriter(
                out,
                kind="simulated" if radar.kind == "simulated" else "real",
                axis=synthesis.axis,
                null_bins=synthesis.null_bins,
                frame_rate_hz=round(rate_hz, 3),
                labels=labels,
                provenance={
                    "made_by": f"SD² Studio {__version__}",
                    "simulated": all(one.simulated for one in opened),
                    "recordings": [one.folder.name for one in opened],
                    **({"radar_channels": channels} if any(channels) else {}),
                    **scenes_of(opened),
                    "synthesis": asdict(synthesis),
                    "clutter": CLUTTER,
                },
                parts=() if synthetic.limbs is None else synthetic.limbs.parts,
            )
        if lost:
            damaged[recording.folder.name] = lost
        takes, without_s = _takes(recording, subject, synthetic, radar, labels)
        left_out_s += without_s
        for take in takes:
            if not writer.holds(take):
                writer.append(take)
        count, frames = by_subject.get(subject, (0, 0))
        by_subject[subject] = (
            count + len(takes), frames + sum(len(take.times_s) for take in takes),
        )  # fmt: skip
    return PairsMade(by_subject, left_out_s, damaged)


def named_recordings(
    recordings: Sequence[Path], subjects: Sequence[str] | None = None
) -> list[tuple[Recording, str]]:
    """Open recordings, each with its person: by default whom it names, or another, named like it.

    Raises Sd2Error if two are called alike or are one, or there is not one person for each.
    """
    check_distinct(recordings)
    opened = [open_recording(path) for path in recordings]
    folders = [recording.folder.stem for recording in opened]
    for name in folders:
        if folders.count(name) > 1:
            raise Sd2Error(
                f"Two recordings are called {name}", "names that differ", "Rename one of them"
            )
    if subjects is not None and len(subjects) != len(folders):
        raise Sd2Error(
            f"{len(subjects)} people are named for {len(folders)} recordings",
            "one for each, in their order",
        )
    said = [one.subject or name for one, name in zip(opened, folders, strict=True)]
    return list(zip(opened, said if subjects is None else subjects, strict=True))


def check_there(recordings: Sequence[Recording], roles: Sequence[Literal["mesh", "radar"]]) -> None:
    """Refuse recordings without a mesh, or without a radar capture."""
    for recording in recordings:
        for role in roles:
            if getattr(recording, role) is None:
                what = "mesh" if role == "mesh" else "radar capture"
                raise Sd2Error(
                    f"{recording.folder} has no {what}",
                    "a recording with a mesh" + " and a radar capture" * ("radar" in roles),
                    "Fit one with `sd2 fit`" if role == "mesh" else "",
                )


def _maps(
    recording: Recording, synthesis: SynthesisOptions, limbs: bool, progress: Progress
) -> tuple[DopplerMap, DopplerMap, int]:
    """Synthetic map, radar map, and the mesh's frames in damaged chunks."""
    mesh = recording.load_mesh()
    maker, counting = Synthesizer(mesh, synthesis), part_of(progress, 0.0, 0.9)
    made = synthetic_map(maker, recording.sensor, limbs=limbs, progress=counting)
    radar = radar_map(recording, synthesis.axis)
    if radar.axis != synthesis.axis:
        raise Sd2Error(
            f"The radar's map of {recording.folder} has {radar.axis.words}",
            f"{synthesis.axis.words}, as they are asked for",
            f"Ask for --bins {radar.axis.bins} --v-max {radar.axis.v_max_mps:g}",
        )
    progress(1, 1)
    return made, radar, damaged_frames(mesh.vertices)


def radar_map(
    recording: Recording, axis: VelocityAxis | None, progress: Progress = silent
) -> DopplerMap:
    """Return the map of a recording's radar file, on the recording's clock.

    ``axis`` is that of the map of a capture or of points, None their own; a file that holds a map
    keeps its own.
    """
    if recording.holds_radar_map:
        radar = recording.load_radar_map(axis).doppler
    else:
        capture = recording.load_capture()
        radar = doppler_map(capture, axis=axis, clutter=CLUTTER, progress=progress)
    return radar.shifted(recording.radar_offset_s)


def check_rates(rates_hz: Mapping[Path, float]) -> None:
    """Refuse recordings whose frame rates differ, by their folders."""
    first, first_hz = next(iter(rates_hz.items()))
    for path, rate_hz in rates_hz.items():
        if abs(rate_hz / first_hz - 1.0) > _SAME_RATE:
            raise Sd2Error(
                f"{path} has {rate_hz:.4g} frames/s, {first} has {first_hz:.4g}",
                "the same in all recordings",
            )


def _takes(
    recording: Recording,
    subject: str,
    synthetic: DopplerMap,
    radar: DopplerMap,
    labels: tuple[str, ...],
) -> tuple[list[Take], float]:
    """Stretches with a person and a radar frame, cut into takes; and the time left out."""
    times_s = synthetic.timebase.times_s
    seen = on_clock(radar, synthetic.timebase).present_mask & synthetic.present_mask
    rate_hz, own = synthetic.timebase.frames_per_s, recording.effective_labels()
    takes: list[Take] = []
    kept = 0
    for start, stop in take_frames(times_s, seen, rate_hz):
        kept += stop - start
        part = evenly(synthetic.between(start, stop), rate_hz)
        target = on_clock(radar, part.timebase).values.T.copy()  # (frames, bins)
        target[:, list(synthetic.null_bins)] = 0.0
        takes.append(
            Take(
                subject=subject,
                name=f"{recording.folder.stem}-{len(takes):03d}",
                synthetic=np.ascontiguousarray(part.values.T),
                radar=target,
                times_s=part.times_s - part.times_s[0],
                label=frame_labels(own, labels, part.times_s),
                sensor_position_m=np.asarray(recording.sensor.position_m, np.float64),
                limbs=part.limbs,
            )
        )
    return takes, float((len(times_s) - kept) / rate_hz)


def take_frames(
    times_s: NDArray[np.float64], seen: NDArray[np.bool_], rate_hz: float
) -> Iterator[tuple[int, int]]:
    """Frames ``(start, stop)`` of takes: stretches that are seen, long ones cut equally.

    Those shorter than a second are left out. None reaches over a gap in time.
    """
    for begun, ended in clips(times_s, seen, rate_hz):
        # Of equal length, so that none is a rest.
        parts = max(1, math.ceil((ended - begun) / (rate_hz * TAKE_S)))
        edges = np.linspace(begun, ended, parts + 1).round().astype(int)
        for start, stop in pairwise(edges.tolist()):
            if stop - start >= rate_hz:
                yield start, stop


def scenes_of(recordings: Iterable[Recording]) -> dict[str, Any]:
    """Return who is in scenes of several, whom both maps of a pair show, for provenance."""
    scenes = {one.folder.stem: list(one.persons) for one in recordings if one.bodies}
    return {"scenes": scenes} if scenes else {}


def label_names(recordings: Iterable[Recording]) -> tuple[str, ...]:
    """Return all names of labels in recordings, the background first."""
    used = {plain_name(span.label) for one in recordings for span in one.effective_labels().decided}
    most = np.iinfo(np.int8).max
    if len(used) >= most:
        raise Sd2Error(f"The recordings have {len(used)} labels", f"fewer than {most}")
    return (BACKGROUND, *sorted(used - {BACKGROUND}))


def frame_labels(
    labels: Labels, names: tuple[str, ...], times_s: NDArray[np.float64]
) -> NDArray[np.int8]:
    """Return the number of the label at some times; see :func:`~sd2core.pairs.rows.agreed`."""
    of_person = [labels.of_person(person) for person in labels.persons] or [labels]
    return agreed([label_per_frame(one, names, times_s) for one in of_person])


def on_clock(radar: DopplerMap, timebase: Timebase) -> DopplerMap:
    """A radar's map at the frames of another clock: those nearest to them.

    ``radar`` has its times on that clock. ``present`` is False where it recorded no frame
    near enough, or says itself that its frame shows no person.
    """
    times_s, other_s = timebase.times_s, radar.times_s
    right = np.clip(np.searchsorted(other_s, times_s), 0, len(other_s) - 1)
    left = np.maximum(right - 1, 0)
    nearest = np.where(times_s - other_s[left] <= np.abs(other_s[right] - times_s), left, right)
    seen = np.abs(other_s[nearest] - times_s) <= 0.75 * radar.timebase.frame_duration_s
    if radar.present is not None:
        seen &= radar.present[nearest]
    values = radar.values[:, nearest]
    return replace(radar, values=values, timebase=timebase, present=seen, uncertainty=None)
