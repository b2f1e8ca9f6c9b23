"""Sources from recordings: maps of the mesh from every placement, and the radar's map."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any, Literal

from sd2core.accuracy.places import choose_for_places, spread
from sd2core.accuracy.trial import synthesizer_for
from sd2core.body.parts import known_parts, splits_everybody
from sd2core.datasets.kept_maps import computed_maps, denoised
from sd2core.datasets.people import People, map_of, present_frames, subject_of
from sd2core.datasets.simulating import Simulation, simulated_map
from sd2core.datasets.source import (
    KINDS,
    LazySource,
    Outline,
    Source,
    SourceKey,
    labelled_spans,
)
from sd2core.denoise.files import LIMBS_MODEL, MAP_MODEL, default_name, find_model
from sd2core.doppler import PRESETS, SynthesisOptions, Synthesizer
from sd2core.errors import Sd2Error
from sd2core.files.digests import cached_digest
from sd2core.files.paths import files_at
from sd2core.imu.mounting import mounted
from sd2core.imu.signals import InertialSignals
from sd2core.imu.virtual import imu_at_frames
from sd2core.io.stored_vertices import damaged_frames
from sd2core.labels.label_set import GESTURES
from sd2core.labels.per_frame import BACKGROUND, label_per_frame, plain_name
from sd2core.labels.spans import Labels
from sd2core.maps import DopplerMap, MapKind
from sd2core.mesh.sequence import MeshSequence
from sd2core.mocap.recording_pairs import on_clock, radar_map
from sd2core.placements.body_extent import BodyExtent
from sd2core.placements.placements import Place, Placements
from sd2core.progress import Progress, part_of
from sd2core.recording.recording import Recording, open_recording
from sd2core.runs.pace import Kind
from sd2core.sensor import Vector, VirtualSensor
from sd2core.timebase import Timebase

_COUNTED_SHARE = 0.05
"""Share of the time that a source takes whose radar is simulated."""


@dataclass(frozen=True)
class Making:
    """Options for the maps of recordings.

    Parameters
    ----------
    kinds : tuple of str
        Wanted, where a recording has what they are made of.
    synthesis : SynthesisOptions
        Its axis is that of the radar's map, too.
    tolerance : float, optional
        Error of a synthetic map that is allowed, as a share; the cheapest plan within it is
        chosen once per recording, see :mod:`sd2core.accuracy.places`. None: as ``synthesis``
        says.
    placements : Placements or "planned", optional
        Where else sensors stand around the body, besides the recording's own; each gives
        synthetic and denoised maps. ``"planned"``: where each recording itself plans them.
    simulation : Simulation, optional
        Gives every place a simulated map, also where the recording's own radar is simulated,
        so that all are of one radar. It takes far longer than everything else. None: there
        are simulated maps only where a recording's radar file holds one.
    model : str, optional
        Denoiser, by file or name; None: that of the recording, or the bundled one where
        none is chosen. A recording that is set to have no denoiser has no denoised map.
    texture : int, optional
        Seed with which denoised maps are drawn as the radar would show them; None: the mean.
    limbs : bool
        Split the synthetic map by the parts of the body; a recording where they are not known
        fails.
    imu : tuple of str
        Places of inertial sensors on the body; a recording without the bundled body's mesh fails.
    """

    kinds: tuple[MapKind, ...] = KINDS
    synthesis: SynthesisOptions = PRESETS["paper"]
    tolerance: float | None = None
    placements: Placements | Literal["planned"] | None = None
    simulation: Simulation | None = None
    model: str | None = None
    texture: int | None = None
    limbs: bool = False
    imu: tuple[str, ...] = ()

    @property
    def pace_kind(self) -> Kind:
        """Kind of work whose items are segments of recordings, see :mod:`sd2core.runs.pace`."""
        facts = (self.synthesis.visibility, self.tolerance, self.model, self.simulation is not None)
        more = (["limbs"] if self.limbs else []) + (["imu"] if self.imu else [])
        return ("export", *self.kinds, *map(str, facts), *more)


def recording_sources(
    paths: Sequence[Path], subjects: Sequence[str], making: Making
) -> list[LazySource]:
    """Return one source per recording and placement; nothing is computed yet.

    Where labels name persons, each of these is a source of their own: with their labels, the
    synthetic and denoised map of them alone, and everybody's of a radar. ``subjects`` names the
    subject of each recording, the first person of a scene.
    """
    kept: list[_Opened] = []  # the recording used last

    def opened(recording: Recording) -> _Opened:
        if not kept or kept[0].recording is not recording:
            kept.clear()  # before the next one takes memory
            kept.append(_Opened(recording, making))
        return kept[0]

    def lazy(recording: Recording, key: SourceKey, person: str) -> LazySource:
        return LazySource(
            key,
            lambda progress: opened(recording).source(key, person, progress),
            lambda: _fingerprint(recording, key, person, making),
            lambda: opened(recording).outline(key.placement, person),
        )

    sources = []
    for path, subject in zip(paths, subjects, strict=True):
        recording = open_recording(path)
        if recording.mesh is None and recording.radar is None:
            raise Sd2Error(
                f"{recording.folder} holds no mesh and no radar file",
                "one of them",
                "Fit a mesh with `sd2 fit`",
            )
        named = recording.effective_labels().persons
        for placement in range(1 + len(places_of(recording, making))):
            for person in named or ("",):
                who = subject_of(recording, person, subject)
                key = SourceKey(who, recording.folder.stem, placement)
                sources.append(lazy(recording, key, person))
    return sources


def labels_and_classes(labels: Labels) -> tuple[tuple[str, ...], dict[str, str]]:
    """Return names of all labels, background first, and their classes: as classifiers have them."""
    known = [one.name for one in labels.label_set.labels]
    used = sorted({span.label for span in labels.decided} - {*known})
    names = tuple(dict.fromkeys([BACKGROUND, *map(plain_name, [*known, *used])]))
    classes = {
        plain_name(one.name): plain_name(one.gesture_class)
        for one in labels.label_set.labels
        if one.gesture_class
    }
    return names, classes | {plain_name(one): plain_name(one) for one in (BACKGROUND, *used)}


class _Opened:
    """Open recording whose placements share mesh, synthesizer and radar map.

    ``person`` is whom a source is of; empty where labels name nobody: of everybody.
    """

    def __init__(self, recording: Recording, making: Making) -> None:
        self.recording = recording
        self._making = making
        self._mesh = None if recording.mesh is None else recording.load_mesh()
        self._people = People(recording, self._mesh, recording.effective_labels())
        self._names, self._classes = labels_and_classes(self._people.labels)
        self._simulated: dict[int, DopplerMap] = {}  # of everybody, from one place
        self._target_m, self._imu = cache(self._target_of), cache(self._imu_of)

    def outline(self, placement: int, person: str) -> Outline:
        timebase, radar_kind = self._clock
        bodies, labels = self._people.bodies(person), self._people.labels_of(person)
        for place in self._making.imu:
            mounted(self._people.body(person), place)  # or fail, as the source would
        kinds: list[MapKind] = []
        if bodies:
            kinds += ["synthetic"]
            if self._making.limbs:
                known_parts(self._people.everybody[0])  # or fail, as the source would
            if "denoised" in self._making.kinds and _models_of(self.recording, self._making.model):
                kinds.append("denoised")
            kinds += ["simulated"] if self._simulates else []
        if radar_kind is not None and placement == 0 and radar_kind not in kinds:
            kinds.append(radar_kind)
        present = (
            present_frames(bodies)
            if bodies
            else ~self._people.unclear(person, self._names, timebase.times_s)
        )
        return Outline(
            tuple(kind for kind in kinds if kind in self._making.kinds),
            timebase.times_s,
            present,
            label_per_frame(labels, self._names, timebase.times_s),
            self._names,
            labelled_spans(labels, self._names),
            self._damaged,
        )

    def source(self, key: SourceKey, person: str, progress: Progress) -> Source:
        wanted = self._making.kinds
        maps: dict[MapKind, DopplerMap] = {}
        plan: dict[str, Any] = {}
        sensor = self._sensor(key.placement)
        counted_share = _COUNTED_SHARE if self._simulates else 1.0
        bodies, labels = self._people.bodies(person), self._people.labels_of(person)
        if bodies and {"synthetic", "denoised"} & {*wanted}:
            alone = len(bodies) < len(self._people.everybody)
            model = self._model if "denoised" in wanted else None
            maker, plan = self._synthesizer
            synthetic, made = computed_maps(
                self.recording,
                maker,
                sensor,
                None if alone else model,
                limbs=self._making.limbs or alone,
                texture=self._making.texture,
                progress=part_of(progress, 0.0, counted_share),
            )
            if alone:
                synthetic = map_of(person, bodies[0], synthetic)
                if model is not None:
                    made = denoised(synthetic, model, self._making.texture)
            maps["synthetic"] = synthetic
            maps |= {} if made is None else {"denoised": made}
        if key.placement == 0 and self.recording.radar is not None and {
            "simulated", "real"
        } & {*wanted}:  # fmt: skip
            radar = radar_map(self.recording, self._making.synthesis.axis)
            clock = self._mesh.timebase if self._mesh is not None else radar.timebase
            maps[radar.kind] = on_clock(radar, clock)
        if bodies and self._simulates:
            rest = part_of(progress, counted_share, 1.0)
            maps["simulated"] = self._simulated_map(key.placement, rest)
        there = tuple(maps)
        maps = {kind: one for kind, one in maps.items() if kind in wanted}
        if there and not maps:
            raise Sd2Error(
                f"{self.recording.folder} has no {' or '.join(wanted)} map, but a"
                f" {' and a '.join(there)} one",
                "a recording with such a map",
                f"Choose --kinds {','.join(there)}",
            )
        maps = self._people.known(person, self._names, maps)
        times_s = next(iter(maps.values())).times_s
        channel = self.recording.channel_in_words
        return Source(
            *key,
            sensor,
            maps,
            label_per_frame(labels, self._names, times_s),
            self._names,
            self._classes,
            self._target_m(person),
            {
                "recording": self.recording.title,
                "simulated": self.recording.simulated,
                "radar_offset_s": self.recording.radar_offset_s,
                **({"radar_channel": channel} if channel else {}),
                **({"damaged_frames": self._damaged} if self._damaged else {}),
                **self._people.shown(person, maps),
                **plan,
            },
            self._imu(person),
            labelled_spans(labels, self._names),
        )

    def _imu_of(self, person: str) -> dict[str, InertialSignals]:
        """Inertial sensors at the frames of the mesh, the same from every placement."""
        body = self._people.body
        return {place: imu_at_frames(body(person), place) for place in self._making.imu}

    def _target_of(self, person: str) -> Vector | None:
        bodies = self._people.bodies(person)
        return BodyExtent.of(bodies[0]).target_m if bodies else None

    def _simulated_map(self, placement: int, progress: Progress) -> DopplerMap:
        """Map of everybody from a place, made for the first of its persons."""
        mesh, simulation = self._mesh, self._making.simulation
        assert mesh is not None
        assert simulation is not None
        if placement not in self._simulated:
            sensor, axis = self._sensor(placement), self._making.synthesis.axis
            made = simulated_map(mesh, sensor, simulation, axis, progress=progress)
            self._simulated = {placement: made}
        return self._simulated[placement]

    @cached_property
    def _model(self) -> Path | None:
        assert self._mesh is not None
        return denoiser_of(self.recording, self._mesh, self._making.model)

    @cached_property
    def _clock(self) -> tuple[Timebase, MapKind | None]:
        """Times, and the kind of the radar's map, read cheaply."""
        recording = self.recording
        kind: MapKind | None = None
        own: Timebase | None = None
        if recording.radar is not None:
            if recording.holds_radar_map:
                kind, own = "real", recording.load_radar_map().timebase
            else:
                capture = recording.load_capture()
                kind, own = ("simulated" if capture.simulated else "real"), capture.timebase
        if self._mesh is not None:
            return self._mesh.timebase, kind
        assert own is not None
        return own.shifted(recording.radar_offset_s), kind

    @property
    def _simulates(self) -> bool:
        """True if a radar is simulated at every place."""
        wanted = self._making.simulation is not None and "simulated" in self._making.kinds
        return wanted and self._mesh is not None

    def _sensor(self, placement: int) -> VirtualSensor:
        if placement == 0:
            return self.recording.sensor
        target_m = self._target_m("")  # of the first person, whoever a source is of
        assert target_m is not None
        place = places_of(self.recording, self._making)[placement - 1]
        return place.sensor(target_m, self.recording.sensor.beam)

    @property
    def _damaged(self) -> int:
        """Frames of the mesh in damaged chunks, which are in no segment."""
        return 0 if self._mesh is None else damaged_frames(self._mesh.vertices)

    @cached_property
    def _synthesizer(self) -> tuple[Synthesizer, dict[str, Any]]:
        """Synthesizer of the mesh, and the accuracy plan chosen, for provenance."""
        assert self._mesh is not None
        mesh, making = self._mesh, self._making
        if making.tolerance is None:
            return Synthesizer(mesh, making.synthesis), {}
        sensors = list(map(self._sensor, range(1 + len(places_of(self.recording, making)))))
        frames = mesh.frame_count * len(sensors)
        placed = choose_for_places(
            mesh, spread(sensors), frames, making.tolerance, making.synthesis
        )
        return synthesizer_for(placed.plan, mesh, making.synthesis), placed.provenance()


def places_of(recording: Recording, making: Making) -> tuple[Place, ...]:
    """Return the other places from which a recording is seen."""
    plan = recording.placements if making.placements == "planned" else making.placements
    return () if plan is None or recording.mesh is None else plan.places()


def _fingerprint(recording: Recording, key: SourceKey, person: str, making: Making) -> str:
    """Hash of all that a source is made of: labels, settings and contents of files."""
    models = _models_of(recording, making.model) if "denoised" in making.kinds else []
    place = None
    if key.placement:
        place = asdict(places_of(recording, making)[key.placement - 1])
    channel = [recording.radar_receiver, recording.radar_transmitter]
    scene = [
        [
            asdict(one) | {"path": [cached_digest(file) for file in one.files], "faces": None}
            for one in recording.bodies
        ],
        [
            asdict(one) | ({"shape": cached_digest(Path(one.shape))} if one.is_file else {})
            for one in recording.things
        ],
        [asdict(one) for one in recording.walls],
    ]
    labels = recording.labelled
    content = {
        "sensor": recording.sensor.as_dict(),
        "place": place,
        "radar_offset_s": recording.radar_offset_s,
        **({"radar_channel": channel} if any(channel) else {}),
        "mesh_reading": recording.mesh_reading.model_dump(mode="json"),
        "spans": [
            (span.track, span.start_s, span.end_s, span.label, *filter(None, [span.person]))
            for span in labels.decided
        ],
        **({} if labels.label_set == GESTURES else {"classes": labels_and_classes(labels)[1]}),
        "synthesis": asdict(making.synthesis),
        "tolerance": making.tolerance,
        "simulation": None if making.simulation is None else making.simulation.as_json(),
        "kinds": making.kinds,
        **({"scene": scene} if any(scene) else {}),
        **({"person": person} if person else {}),
        **({"imu": making.imu} if making.imu else {}),
        **({} if making.texture is None else {"texture": making.texture}),
        "files": [
            [cached_digest(file) for file in files_at(path)]
            for path in (recording.mesh, recording.faces, recording.radar, *models)
            if path is not None
        ],
    }
    text = json.dumps(content, sort_keys=True, default=str)
    return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()


def denoiser_of(recording: Recording, mesh: MeshSequence, named: str | None = None) -> Path | None:
    """Return the denoiser's file, of the bundled ones that for what is known of the mesh."""
    models = _models_of(recording, named)
    if len(models) < 2:
        return models[0] if models else None
    return find_model(default_name(limbs=splits_everybody(mesh)))


def _models_of(recording: Recording, named: str | None) -> list[Path]:
    """Return files of which one is the denoiser; none where the recording is set to have none."""
    chosen = named or recording.denoiser or recording.bundled_denoiser
    if chosen == "":
        return []
    return [find_model(name) for name in ([chosen] if chosen else [MAP_MODEL, LIMBS_MODEL])]
