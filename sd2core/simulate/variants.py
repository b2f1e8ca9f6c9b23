"""Movements as they were not recorded: from other places, by other bodies, or left for right."""

from __future__ import annotations

import re
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from sd2core.accuracy.cache import scene_fingerprint
from sd2core.body.parts import known_parts, synthetic_map
from sd2core.body.reshaping import coarser, reshaped
from sd2core.body.shape import ShapeSpace
from sd2core.denoise.resample_to_model import evenly
from sd2core.doppler import SynthesisOptions, Synthesizer
from sd2core.errors import Sd2Error
from sd2core.io.radar.mars import FRAMES_PER_S, MarsStretch, mars_parts, read_mars
from sd2core.labels.per_frame import BACKGROUND
from sd2core.maps import OF, DopplerMap
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.vertex_parts import PARTS
from sd2core.mocap.mars_pairs import driven_clips, takes_of
from sd2core.mocap.recording_pairs import (
    check_rates,
    check_there,
    frame_labels,
    label_names,
    named_recordings,
    on_clock,
    scenes_of,
    take_frames,
)
from sd2core.pairs.rows import UNKNOWN
from sd2core.pairs.store import PairSet, PairWriter, Take, read_pairs
from sd2core.pairs.summary import TakeKey
from sd2core.progress import Progress, silent
from sd2core.radar_config import PAPER_RADAR, RadarConfig
from sd2core.recording.recording import Recording
from sd2core.sensor import VirtualSensor, aimed_at, position_from_spherical, spherical_from_position
from sd2core.simulate.campaign.radar import radar_at, radar_target
from sd2core.version import __version__

Variant = Literal["places", "shapes", "mirrored"]
"""Sensors within 25 degrees to the side and 10 up or down, 0.8 to 1.25 times as far; bodies of
random shape; or the sensor's mirror image in the upright plane through camera and body."""

_ASIDE_DEG, _ABOVE_DEG, _FARTHER = 25.0, 10.0, (0.8, 1.25)
_SIDE = re.compile(r"(?<![A-Za-z])(?:left|right|LEFT|RIGHT)(?![A-Za-z])|(?:Left|Right)(?![a-z])")
_OTHER_SIDE = {
    side(one): side(other)
    for one, other in (("left", "right"), ("right", "left"))
    for side in (str.lower, str.upper, str.capitalize)
}


@dataclass(frozen=True)
class VariantOptions:
    """Variation of movements, and the maps that are made of them."""

    variant: Variant
    synthesis: SynthesisOptions
    """Of the synthetic maps; axis and nulled bins are the simulated radar's, too."""
    radar: RadarConfig = PAPER_RADAR  # At the frame rate of the movements.
    limbs: bool = False  # The synthetic maps are also split by the parts of the body.
    seed: int = 0  # Of all that is drawn; a movement's own numbers also depend on its name.


@dataclass(frozen=True, eq=False)
class _Movement:
    """A movement before a sensor; positions are in the camera frame."""

    key: TakeKey
    mesh: MeshSequence
    position_m: tuple[float, float, float]
    labels: Sequence[str]  # of its frames; empty where it is UNKNOWN


def vary_recordings(
    recordings: Sequence[Path],
    out: Path,
    options: VariantOptions,
    *,
    subjects: Sequence[str] | None = None,
    progress: Progress = silent,
) -> PairSet:
    """Write simulated pairs of the movements of recordings that have a mesh, and return all.

    Movements are cut and called as in pairs of recordings.

    Parameters
    ----------
    recordings : sequence of Path
    out : Path
        Store of the pairs; what it holds is not made again.
    options : VariantOptions
    subjects : sequence of str, optional
        People in the recordings; by default whom each names, or else another in each, named like
        it.
    progress : Progress
        Counts recordings.

    Raises
    ------
    Sd2Error
        If a recording has no mesh, none shows anybody for a second, two are called alike, there is
        not one person for each, frame rates differ, or (shapes) a mesh has another surface than the
        bundled body.
    """
    named = named_recordings(recordings, subjects)
    check_there([recording for recording, _ in named], ("mesh",))
    meshes = [recording.load_mesh() for recording, _ in named]
    rates_hz = [mesh.timebase.frames_per_s for mesh in meshes]
    check_rates({one.folder: rate for (one, _), rate in zip(named, rates_hz, strict=True)})
    if not any(map(_stretches, meshes)):
        raise Sd2Error(
            "No recording shows anybody for a second on end", "a mesh that moves for a second"
        )
    _, *labels = label_names(recording for recording, _ in named)
    sources: dict[str, Any] = {"sources": [one.folder.name for one, _ in named]}
    sources |= scenes_of(recording for recording, _ in named)
    names = (BACKGROUND, *sorted({*labels, *map(mirrored_label, labels)}))
    sources["movements"] = [
        scene_fingerprint(mesh, one.sensor, options.synthesis, "histogram")
        + f"-{zlib.crc32(frame_labels(one.effective_labels(), names, mesh.times_s).tobytes()):08x}"
        for (one, _), mesh in zip(named, meshes, strict=True)
    ]
    parts = _parts_of(meshes[0]) if options.limbs else ()
    writer = _writer(out, options, round(rates_hz[0], 3), names, sources, parts)
    for number, ((recording, subject), mesh) in enumerate(zip(named, meshes, strict=True)):
        progress(number, len(named))
        _append(writer, options, names, _of_recording(recording, names, subject, mesh))
    progress(len(named), len(named))
    return read_pairs(out)


def _of_recording(
    recording: Recording, names: tuple[str, ...], subject: str, mesh: MeshSequence
) -> Iterator[_Movement]:
    labels, own = [*names, ""], recording.effective_labels()  # the last is that of UNKNOWN
    for number, (start, stop) in enumerate(_stretches(mesh)):
        yield _Movement(
            TakeKey(subject, f"{recording.folder.stem}-{number:03d}", 0),
            mesh.between(start, stop),
            recording.sensor.position_m,
            [labels[one] for one in frame_labels(own, names, mesh.times_s[start:stop])],
        )


def _stretches(mesh: MeshSequence) -> list[tuple[int, int]]:
    """Frames of the takes of a mesh."""
    seen, rate_hz = mesh.presence.present, mesh.timebase.frames_per_s
    return [*take_frames(mesh.times_s, seen, rate_hz)]


def vary_mars(
    folders: Sequence[Path], out: Path, options: VariantOptions, progress: Progress = silent
) -> PairSet:
    """Write simulated pairs of MARS' movements, and return all.

    Bodies, places of the radar and names of takes are those of
    :func:`sd2core.mocap.mars_pairs.make_mars_pairs`; there are no labels.

    Parameters
    ----------
    folders : sequence of Path
        Each with one person's parts.
    out : Path
        Store of the pairs; what it holds is not made again.
    options : VariantOptions
    progress : Progress
        Counts people.
    """
    parts = [read_mars(folder, name) for folder in folders for name in mars_parts(folder)]
    names = (BACKGROUND,)
    sources = {"sources": [Path(one.source).name for one in parts]}
    writer = _writer(out, options, FRAMES_PER_S, names, sources, PARTS if options.limbs else ())
    people = dict.fromkeys(part.subject for part in parts)
    for number, person in enumerate(people):
        progress(number, len(people))
        own = dict(take for part in parts if part.subject == person for take in takes_of(part))
        if not own.keys() <= writer.done:
            _append(writer, options, names, _of_person(own))
    progress(len(people), len(people))
    return read_pairs(out)


def _of_person(stretches: Mapping[TakeKey, MarsStretch]) -> Iterator[_Movement]:
    driven, place = driven_clips([*stretches.values()])
    for key, one in zip(stretches, driven, strict=True):
        times_s = one.clip.times_s
        # In memory: it is read several times, and would be posed each time.
        mesh = one.mesh(times_s + place.offset_s, "low").between(0, len(times_s))
        yield _Movement(key, mesh, place.position_m, [BACKGROUND] * len(times_s))


def _writer(
    out: Path,
    options: VariantOptions,
    frame_rate_hz: float,
    labels: Sequence[str],
    sources: Mapping[str, Any],
    parts: Sequence[str],
) -> PairWriter:
    synthesis = options.synthesis
    return PairWriter(
        out,
        kind="simulated",
        axis=synthesis.axis,
        null_bins=synthesis.null_bins,
        frame_rate_hz=frame_rate_hz,
        labels=labels,
        provenance={
            "made_by": f"SD² Studio {__version__}",
            **asdict(options),
            **sources,
        },
        parts=parts,
    )


def _parts_of(mesh: MeshSequence) -> tuple[str, ...]:
    """Names of what limb maps of a mesh are split into, in a scene each person's."""
    first = known_parts(mesh)
    if not mesh.others:
        return first.names
    each = zip(mesh.persons, (first, *first.others), strict=True)
    return tuple(f"{person}{OF}{name}" for person, parts in each for name in parts.names)


def _append(
    writer: PairWriter,
    options: VariantOptions,
    labels: Sequence[str],
    movements: Iterable[_Movement],
) -> None:
    for movement in movements:
        if movement.key in writer.done:
            continue
        title = f"{movement.key.subject}/{movement.key.name}"
        rng = np.random.default_rng([options.seed, zlib.crc32(title.encode())])
        writer.append(_take(varied(movement, options.variant, rng), options, labels, rng))


def _take(
    movement: _Movement, options: VariantOptions, labels: Sequence[str], rng: np.random.Generator
) -> Take:
    """See a movement by the synthetic map and by the simulated radar."""
    mesh, synthesis = movement.mesh, options.synthesis
    sensor = aimed_at(VirtualSensor(movement.position_m), _middle_m(mesh))
    doppler = synthetic_map(Synthesizer(mesh, synthesis), sensor, limbs=options.limbs)
    # Echoes of a rough surface depend little on how finely it is cut (decision 26).
    target = radar_target(
        coarser(mesh),
        radar_at(mesh.timebase.frames_per_s, synthesis.axis.bins, options.radar),
        sensor,
        synthesis.axis,
        synthesis.null_bins,
        seed=rng.integers(2**31, size=2).tolist(),
    )
    part = evenly(doppler, mesh.timebase.frames_per_s)
    radar = DopplerMap(target.T, synthesis.axis, mesh.timebase, "simulated")
    named = [movement.labels[mesh.timebase.nearest_frame(time)] for time in part.times_s]
    return Take(
        movement.key.subject,
        movement.key.name,
        np.ascontiguousarray(part.values.T),
        np.ascontiguousarray(on_clock(radar, part.timebase).values.T),
        part.times_s - part.times_s[0],
        np.array([labels.index(one) if one else UNKNOWN for one in named], np.int8),
        np.array(movement.position_m),
        0,
        part.limbs,
    )


def varied(movement: _Movement, variant: Variant, rng: np.random.Generator) -> _Movement:
    """Another movement of the same kind; see :data:`Variant`."""
    if variant == "shapes":
        first, *others = (reshaped(one, ShapeSpace().random(rng)) for one in movement.mesh.bodies)
        return replace(movement, mesh=replace(first, others=tuple(others)))
    x, y, z = movement.position_m
    middle_m = _middle_m(movement.mesh)
    if variant == "mirrored":
        return replace(
            movement,
            position_m=(2.0 * middle_m[0] - x, y, z),
            labels=[mirrored_label(label) for label in movement.labels],
        )
    range_m, azimuth_deg, elevation_deg = spherical_from_position(middle_m, movement.position_m)
    place_m = position_from_spherical(
        middle_m,
        range_m * float(rng.uniform(*_FARTHER)),
        azimuth_deg + float(rng.uniform(-_ASIDE_DEG, _ASIDE_DEG)),
        elevation_deg + float(rng.uniform(-_ABOVE_DEG, _ABOVE_DEG)),
    )
    return replace(movement, position_m=place_m)


def mirrored_label(label: str) -> str:
    """Name of a movement seen in a mirror: left and right change places.

    Examples
    --------
    >>> mirrored_label("left-to-right"), mirrored_label("SwipeLeft"), mirrored_label("upright")
    ('right-to-left', 'SwipeRight', 'upright')
    """
    return _SIDE.sub(lambda match: _OTHER_SIDE[match[0]], label)


def _middle_m(mesh: MeshSequence) -> tuple[float, float, float]:
    """Middle of the body over all frames."""
    x, y, z = mesh.read(0, mesh.frame_count).mean(axis=(0, 1), dtype=np.float64).tolist()
    return x, y, z
