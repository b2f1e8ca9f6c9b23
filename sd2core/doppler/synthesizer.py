"""Synthetic Doppler maps from a mesh and a sensor."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from sd2core.doppler.cell_uncertainty import cell_uncertainty
from sd2core.doppler.frame_counts import FrameCounts
from sd2core.doppler.histogram import Counts
from sd2core.doppler.kinematics import kinematics
from sd2core.doppler.masks import Quality, Visibility
from sd2core.doppler.options import PRESETS, SynthesisOptions
from sd2core.doppler.prepared import Block, PreparedMesh
from sd2core.doppler.smoothing import frames_within_reach, smooth
from sd2core.errors import Sd2Error, wanted
from sd2core.maps import CellUncertainty, DopplerMap, LimbMaps
from sd2core.mesh.presence import gaps_in_words, runs
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.vertex_parts import VertexParts
from sd2core.numerics.byte_budget import ByteBudget
from sd2core.numerics.compiled import await_kernels, worker_count
from sd2core.numerics.parallel import Ticket, run_jobs, run_light_jobs
from sd2core.numerics.precision import SHARE_OF_A_BIN, stored_velocity_error_mps
from sd2core.options.synthesis import ScenePart
from sd2core.progress import Progress, silent
from sd2core.scattering.amplitude import NEAREST_RANGE_M
from sd2core.scattering.velocity import radial_velocity
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase
from sd2core.version import __version__


@dataclass(frozen=True, eq=False)
class MapFrames:
    """Consecutive frames of a synthetic Doppler map."""

    values: NDArray[np.float32]  # (bins, n)
    raw: NDArray[np.float64]  # values before any smoothing, with nulled bins emptied
    visible_share: NDArray[np.float32] | None
    """Share of all vertices that the sensor sees, (n,), where it is asked for; of a decimated
    mesh, of the vertices that the kept ones stand for. Vertices that cannot change the map (in
    nulled bins) are judged by the facing test."""
    beyond_share: NDArray[np.float32] | None
    """Share of the visible vertices whose velocity lies beyond the axis, (n,), like that."""
    quality: Quality
    """The weakest visibility that was used: ``frozen`` falls back to facing where no depth or
    exact visibility is kept."""
    limbs: LimbMaps | None = None  # the split of the values
    processor_s: float = 0.0
    """Processor time that visibility and counting took, all threads together."""


@dataclass(frozen=True, eq=False)
class FrameScattering:
    """Velocity, range and visibility of the V vertices of one frame."""

    velocity_mps: NDArray[np.float32]  # radial, positive when approaching
    range_m: NDArray[np.float32]  # distance from the sensor
    visible: NDArray[np.bool_]
    quality: Quality  # visibility that was used


@dataclass(frozen=True, eq=False)
class _Counted:
    """Counts of a body in frames ``start`` to ``stop`` (exclusive), and the jobs that fill them."""

    start: int
    stop: int
    counts: Counts
    totals: NDArray[np.float64]  # (n,), what the counts are shares of
    visibility: Visibility
    used: set[Quality]  # what the jobs found
    jobs: list[Callable[[Ticket], None]]
    light: bool  # done about as soon as other threads wake

    @property
    def quality(self) -> Quality:
        """Visibility that was used."""
        if self.visibility == "frozen":
            return "frozen" if self.used == {"frozen"} else "facing"
        return self.visibility


def _body_notes(
    prepared: PreparedMesh, sensor: VirtualSensor, start: int, stop: int, *, several: bool
) -> list[str]:
    """Sentences about frames without a person, and about limits of single precision.

    There are none in ordinary scenes. Without one of several people columns are not empty.
    """
    mesh, options = prepared.mesh, prepared.options
    notes = []
    if not (measured := mesh.presence.measured[start:stop]).all():
        share = gaps_in_words(
            runs(~measured), mesh.times_s[start:stop], mesh.timebase.frame_duration_s
        )
        notes.append(
            f"Not there in {share}."
            if several
            else f"Without a person: {share}. Those columns are empty."
        )
    if np.dtype(mesh.vertices.dtype) == np.float32:
        duration_s = 2.0 * mesh.timebase.frame_duration_s / options.oversampling
        error_mps = stored_velocity_error_mps(prepared.reach_m, duration_s)
        bins = error_mps / options.axis.bin_width_mps
        if bins > SHARE_OF_A_BIN:
            notes.append(
                f"The mesh's coordinates reach {prepared.reach_m:,.4g} m and are stored in single"
                f" precision: velocities are wrong by up to {bins:.2g} bins ({error_mps:.2g} m/s)."
            )
    range_m = max(math.dist(sensor.position_m, prepared.origin_m.tolist()), NEAREST_RANGE_M)
    decades = options.range_exponent * math.log10(options.reference_range_m / range_m)
    if decades - math.log10(mesh.represented_count) < math.log10(np.finfo(np.float32).tiny):
        notes.append(
            f"At {range_m:,.4g} m the range law makes a vertex count 1e{decades:.0f}, less than the"
            " numbers of a map can be: it is empty or nearly so. Choose a farther reference range."
        )
    return notes


def _of_bodies(progress: Progress, number: int, of: int) -> Progress:
    """Progress of one of several bodies, in frames of the clip."""
    if of == 1:
        return progress
    return lambda done, total: progress((number * total + done) // of, total)


_MEMORY_BUDGET_BYTES = 512 << 20
_FAST_FRAMES = 128
_EXACT_VERTICES = 120_000
"""Vertices times frames whose occlusion is found at once, in a few ms: then a cancel is obeyed."""
_LIGHT_PAIRS = 500_000
"""Moving vertices, frames together, that are counted about as soon as other threads wake."""


_A_SENSOR = "Make one with sd2.VirtualSensor(position_m=(0.0, 0.0, 0.0))"


class Synthesizer:
    """Doppler maps of one mesh, or of a scene of several, for any sensor position.

    A scene's map is the sum over its bodies of each one's own share: somebody whom nobody hides
    has the same part in it as alone.

    Data that do not depend on the sensor are prepared once, in blocks of frames that
    are kept under a byte budget; a long recording is streamed. Calls may come
    from several threads.

    Parameters
    ----------
    preset : str or SynthesisOptions
        Name of a preset, or options of one's own.
    memory_budget_bytes : int
        For prepared blocks and visibility.
    threads : int, optional
        Number of worker threads; by default one per core. With 1 all work is done in the
        calling thread.
    block_frames : int, optional
        Number of frames that are prepared together; by default some megabytes of them. Fewer
        are better where only a few frames of a clip are looked at.
    blocks_of : Synthesizer, optional
        Another synthesizer of the same mesh, maybe among other things, whose prepared blocks and
        budget are shared where the options allow it.
    left_out : collection of {"beam", "things", "walls"}
        Parts of the scene that are left out of account.

    Raises
    ------
    Sd2Error
        For an unknown preset, or area weighting of a point cloud.

    Examples
    --------
    >>> import sd2core as sd2
    >>> from sd2core.files.resources import resource_path
    >>> mesh = sd2.load_mesh(resource_path("swipes.sd2") / "mesh.zarr").between(30, 36)
    >>> maps = sd2.Synthesizer(mesh, sd2.SynthesisOptions(visibility="facing"))
    >>> maps.map(sd2.VirtualSensor(position_m=(0.5, 0, 0))).values.shape
    (32, 6)
    """

    def __init__(
        self,
        mesh: MeshSequence,
        preset: str | SynthesisOptions = "paper",
        *,
        memory_budget_bytes: int = _MEMORY_BUDGET_BYTES,
        threads: int | None = None,
        block_frames: int | None = None,
        blocks_of: Synthesizer | None = None,
        left_out: Collection[ScenePart] = (),
    ) -> None:
        if isinstance(preset, str) and preset not in PRESETS:
            raise Sd2Error(f"The preset is {preset!r}", f"one of {', '.join(PRESETS)}")
        wanted(mesh, MeshSequence, 'Read one with sd2.load_mesh("walk.npz")')
        options = PRESETS[preset] if isinstance(preset, str) else preset
        if mesh.faces is None and options.weight != "count":
            raise _no_surface(mesh, "Area weighting")
        if threads is not None and threads < 1:
            raise Sd2Error(f"threads is {threads}", "1 or more, or None for all cores")
        if block_frames is not None and block_frames < 1:
            raise Sd2Error(f"block_frames is {block_frames}", "1 or more, or None")
        if not set(left_out) <= set(get_args(ScenePart)):  # nor is a name a list of parts
            raise Sd2Error(f"left_out is {left_out!r}", f"some of {', '.join(get_args(ScenePart))}")
        if mesh.surroundings is not None and left_out:
            mesh = replace(mesh, surroundings=mesh.surroundings.without(left_out))
        self.mesh = mesh
        self.options = options
        self._threads = threads
        self.left_out = tuple(left_out)
        share_bytes = memory_budget_bytes // len(mesh.bodies)
        like = () if blocks_of is None else blocks_of.bodies
        shared = (one.prepared.shared(mesh, options) for one in like)
        self.prepared: PreparedMesh = next(
            (one for one in shared if one is not None), None
        ) or PreparedMesh(mesh, options, ByteBudget(share_bytes), block_frames)
        self._frames = FrameCounts(self.prepared)
        self._others = tuple(
            Synthesizer(
                replace(body, surroundings=mesh.surroundings),
                options,
                memory_budget_bytes=share_bytes,
                threads=threads,
                block_frames=block_frames,
                blocks_of=blocks_of,
                left_out=left_out,
            )
            for body in mesh.others
        )
        every = [one.prepared for one in self.bodies] if mesh.others else []
        for one in self.bodies if mesh.others else ():
            one._frames.hide_by(tuple(other for other in every if other is not one.prepared))

    @property
    def bodies(self) -> tuple[Synthesizer, ...]:
        """One for each body of the scene, this one first; each counts its own."""
        # Not kept: who holds itself is not let go with all that it has prepared.
        return (self, *self._others)

    @property
    def unit(self) -> str:
        """Meaning of the value 1 in a map."""
        options = self.options
        share = {
            "count": "share of vertices",
            "area": "share of the surface",
            "projected": "share of the surface × cos θ",
        }[options.weight]
        if not options.range_exponent:
            return share
        # Nearer than the reference a value may exceed 1.
        return f"{share} × ({options.reference_range_m:g} m / R)^{options.range_exponent:g}"

    @property
    def _bytes_per_vertex(self) -> int:
        """Size of a prepared frame: knots, normals and areas, in single precision."""
        areas = {"count": 0, "area": 4, "projected": 12}[self.options.weight]
        return 12 * self.options.oversampling + 3 + areas

    def prepare(
        self, progress: Progress = silent, frames: Sequence[tuple[int, int]] | None = None
    ) -> None:
        """Read and prepare what maps need of a clip, ahead of their use.

        Of ``frames``, half-open, or as much of the clip as the budget holds.
        """
        prepared, occluded = self.prepared, self.options.visibility in ("depth", "exact")
        for one in self.bodies[1:]:
            one.prepare(progress, frames)
        if frames is None:
            of_block = prepared.block_frames * self.mesh.vertex_count * self._bytes_per_vertex
            fitting = max(1, prepared.budget.limit_bytes // of_block)
            blocks = set(range(min(fitting, prepared.block_count)))
        else:
            blocks = {index for span in frames for index, *_ in self._frames.blocks_between(*span)}

        def job(index: int) -> Callable[[Ticket], None]:
            def work(ticket: Ticket) -> None:
                ticket.advance(0)
                self._frames.prepare(index, occluded)
                ticket.advance(1)

            return work

        await_kernels(lambda: progress(0, len(blocks)))
        run_jobs([job(index) for index in sorted(blocks)], len(blocks), progress, self._threads)

    def forget_masks(self) -> None:
        """Let none of the masks that are kept serve while the sensor moves."""
        for one in self.bodies:
            one.prepared.places.clear()

    def map(
        self,
        sensor: VirtualSensor | None = None,
        *,
        visibility: Visibility | None = None,
        frames: tuple[int, int] | None = None,
        progress: Progress = silent,
    ) -> DopplerMap:
        """Doppler map of the whole clip, or of ``frames`` (half-open).

        Parameters
        ----------
        sensor : VirtualSensor, optional
            Where the radar is; by default at the camera.
        visibility : {"none", "facing", "depth", "exact", "frozen"}, optional
            Otherwise that of the options. What stands around the mesh hides vertices in ``depth``
            and ``exact`` only.
        progress : Progress
            Called with frames done; may raise Cancelled.

        Returns
        -------
        DopplerMap
            Of kind ``synthetic``. Its meta names sensor, options, source and
            version, how vertices were counted (``count``), the quality of the
            visibility, how many frames share a mask,
            per frame ``visible_share`` and ``beyond_share``, both of the direct
            echoes and of velocities as they are before any is spread, in ``things`` and
            ``walls`` what stood around, and in ``bodies`` who was in a scene of several, if
            anything or anybody was, and in ``notes`` where single precision limits what the
            map says and how much of it is empty.
            ``present`` is False in frames without a person, and in one that stands alone
            between such: what moves how fast is not known there.
        """
        return self._map(sensor or VirtualSensor(), None, visibility, frames, progress)

    def limb_maps(
        self,
        sensor: VirtualSensor,
        parts: VertexParts,
        *,
        visibility: Visibility | None = None,
        frames: tuple[int, int] | None = None,
        progress: Progress = silent,
    ) -> DopplerMap:
        """Doppler map as :meth:`map` makes it, and its split by the parts of the body.

        Vertices are counted once, by the same visibility and weights; the parts add up to the
        map, to single precision. All arguments but ``parts`` are those of :meth:`map`.

        Parameters
        ----------
        parts : VertexParts
            Parts of the body by vertex, as :func:`sd2core.body.parts.body_parts` finds them, for
            each of the bodies.

        Returns
        -------
        DopplerMap
            With ``limbs``; in a scene of several bodies with the persons' names in front.

        Raises
        ------
        Sd2Error
            When ``parts`` is of another number of vertices.

        Examples
        --------
        >>> import sd2core as sd2
        >>> from sd2core.body.parts import body_parts
        >>> from sd2core.files.resources import resource_path
        >>> mesh = sd2.load_mesh(resource_path("swipes.sd2") / "mesh.zarr").between(30, 36)
        >>> maps = sd2.Synthesizer(mesh).limb_maps(sd2.VirtualSensor(), body_parts(mesh))
        >>> maps.limbs.values.shape
        (9, 32, 6)
        """
        given = [len(one.numbers) for one in (parts, *parts.others)]
        has = [body.vertex_count for body in self.mesh.bodies]
        if given != has:
            raise Sd2Error(
                f"The parts of the body are of {' and '.join(map(str, given))} vertices",
                f"{' and '.join(map(str, has))}, as {self.mesh.source or 'the mesh'} has",
            )
        return self._map(sensor, parts, visibility, frames, progress)

    def _map(
        self,
        sensor: VirtualSensor,
        parts: VertexParts | None,
        visibility: Visibility | None,
        frames: tuple[int, int] | None,
        progress: Progress,
    ) -> DopplerMap:
        wanted(sensor, VirtualSensor, _A_SENSOR)
        start, stop = frames or (0, self.mesh.frame_count)
        stretch = self.stretch(sensor, start, stop, visibility, progress, parts)
        return self.as_map(stretch, sensor, start)

    def as_map(self, stretch: MapFrames, sensor: VirtualSensor, start: int = 0) -> DopplerMap:
        """Doppler map of frames that were counted with their shares, as :meth:`map` gives it."""
        assert stretch.visible_share is not None
        assert stretch.beyond_share is not None
        options, stop = self.options, start + stretch.values.shape[1]
        unshared = stretch.quality in ("none", "facing")
        around, several = self.mesh.surroundings, len(self.bodies) > 1
        spreads = any(one.prepared.spreads for one in self.bodies)
        measured = [body.presence.measured[start:stop] for body in self.mesh.bodies]
        return DopplerMap(
            values=stretch.values,
            axis=options.axis,
            timebase=Timebase(self.mesh.times_s[start:stop]),
            kind="synthetic",
            unit=self.unit,
            null_bins=options.null_bins,
            meta={
                "sensor": sensor.as_dict(),
                "options": asdict(options),
                "count": "expected" if spreads else "plain",
                "visibility": stretch.quality,
                "mask_stride": 1 if unshared else options.mask_stride,
                "source": self.mesh.source,
                **({"simulated": True} if self.mesh.simulated else {}),
                "version": __version__,
                "visible_share": _rounded(stretch.visible_share),
                "beyond_share": _rounded(stretch.beyond_share),
                "notes": self._notes(sensor, start, stop, stretch.quality),
                **({} if around is None else around.as_dict()),
                **({"bodies": self._described()} if several else {}),
            },
            present=np.logical_or.reduce(measured),
            limbs=stretch.limbs,
        )

    def _notes(self, sensor: VirtualSensor, start: int, stop: int, quality: Quality) -> list[str]:
        """Notes on what hides nothing, and on each of the bodies."""
        notes = []
        if quality in ("none", "facing"):
            if (around := self.mesh.surroundings) is not None and around.things:
                notes.append(f"Things in the scene hide nothing in visibility {quality}.")
            if self.mesh.others:
                notes.append(f"Nobody hides anybody else in visibility {quality}.")
        for person, one in zip(self.mesh.persons, self.bodies, strict=True):
            several = bool(self.mesh.others)
            own_notes = _body_notes(one.prepared, sensor, start, stop, several=several)
            notes += [f"{person}: {note}" if several else note for note in own_notes]
        return notes

    def _described(self) -> list[dict[str, Any]]:
        """Persons of the scene, origins and places of their meshes, for provenance."""
        return [
            {
                **({} if body.placed is None else asdict(body.placed)),
                "person": person,
                "source": body.source,
            }
            for person, body in zip(self.mesh.persons, self.mesh.bodies, strict=True)
        ]

    def stretch(
        self,
        sensor: VirtualSensor,
        start: int,
        stop: int,
        visibility: Visibility | None = None,
        progress: Progress = silent,
        parts: VertexParts | None = None,
        *,
        shares: bool = True,
    ) -> MapFrames:
        """Doppler values of some frames.

        They equal these columns of the whole map: smoothing over time also uses the frames
        around them.

        Parameters
        ----------
        sensor : VirtualSensor
            Where the radar is.
        start, stop : int
            Half-open range of frames; IndexError for one that is empty or beyond the clip.
        visibility : {"none", "facing", "depth", "exact", "frozen"}, optional
            Otherwise that of the options; Sd2Error for any but ``none`` without faces.
        progress : Progress
            Called with frames done; may raise Cancelled.
        parts : VertexParts, optional
            With them also the values of each part of the body.
        shares : bool
            False if only what moves is to be looked at, and the shares that are seen and beyond the
            axis are left out.
        """
        if not 0 <= start < stop <= self.mesh.frame_count:
            raise IndexError(f"frames {start} to {stop} of {self.mesh.frame_count}")
        by_body = (None,) * len(self.bodies) if parts is None else (parts, *parts.others)
        # Together, so that no thread waits for another between two bodies.
        counted = [
            one._to_count(sensor, (start, stop), one._choose(visibility), its, shares)
            for one, its in zip(self.bodies, by_body, strict=True)
        ]
        processor_s = self._run(counted, progress)
        bodies = zip(self.bodies, counted, by_body, strict=True)
        each = [one._summed(its, sensor, (start, stop), part, shares) for one, its, part in bodies]
        return replace(each[0] if len(each) == 1 else self._joined(each), processor_s=processor_s)

    def _joined(self, each: list[MapFrames]) -> MapFrames:
        """Sum of the stretches of all bodies."""
        members = np.array([[body.represented_count] for body in self.mesh.bodies], np.float64)
        visible = beyond = None
        if each[0].visible_share is not None:
            seen = members * [one.visible_share for one in each]
            visible = (seen.sum(axis=0) / members.sum()).astype(np.float32)
            outside = (seen * [one.beyond_share for one in each]).sum(axis=0)
            beyond = (outside / np.maximum(seen.sum(axis=0), 1)).astype(np.float32)
        limbs = [one.limbs for one in each if one.limbs is not None]
        qualities = {one.quality for one in each}
        return MapFrames(
            np.asarray(np.sum([one.values for one in each], axis=0), np.float32),
            np.sum([one.raw for one in each], axis=0),
            visible,
            beyond,
            "facing" if "facing" in qualities else each[0].quality,
            LimbMaps.of_persons(limbs, self.mesh.persons) if limbs else None,
        )

    def _summed(
        self,
        counted: _Counted,
        sensor: VirtualSensor,
        frames: tuple[int, int],
        parts: VertexParts | None,
        shares: bool,
    ) -> MapFrames:
        """Limb maps of this body alone, among the others, once it is counted."""
        options, times_s, (start, stop) = self.options, self.mesh.times_s, frames
        counts, totals, first, last = counted.counts, counted.totals, counted.start, counted.stop

        def smoothed(counted: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
            """Shares (..., bins, frames) of what was counted, before and after smoothing."""
            raw = np.divide(counted, totals, out=np.zeros(counted.shape), where=totals > 0)
            raw[..., list(options.null_bins), :] = 0
            return raw, smooth(raw, times_s, first, start, stop, options, self.mesh.presence)

        raw, values = smoothed(counts.histogram.sum(axis=1).T)
        limbs = None
        if parts is not None:
            split = smoothed(counts.histogram.transpose(1, 2, 0))[1].astype(np.float32)
            moves = kinematics(self.mesh, parts, sensor, frames)
            limbs = LimbMaps(parts.names, split, moves)
        inside = slice(start - first, stop - first)
        nobody = ~self.mesh.presence.present[first:last]
        counts.visible[nobody] = counts.beyond[nobody] = 0
        visible, beyond = counts.visible[inside], counts.beyond[inside]
        return MapFrames(
            values.astype(np.float32),
            raw[:, inside],
            (visible / self.mesh.represented_count).astype(np.float32) if shares else None,
            (beyond / np.maximum(visible, 1)).astype(np.float32) if shares else None,
            counted.quality,
            limbs,
        )

    def frame(
        self, sensor: VirtualSensor, index: int, visibility: Visibility | None = None
    ) -> FrameScattering:
        """Velocity, range and visibility of every vertex of the first body in one frame.

        Without a person nothing moves and nothing is seen.
        """
        chosen = self._choose(visibility)
        block = self._block_of(index)
        local = index - block.start
        place = self.prepared.sensor(sensor.position_m)
        frames = block.frames
        points = frames.positions[frames.centre[local]]
        ray = points.astype(np.float64) - place[:, None]
        if self.options.velocity == "vid2doppler":
            rows = slice(local, local + 1)
            velocity = self.prepared.velocities_vid2doppler(block, rows, place[None])[0]
        else:
            # The moment in the middle; of an even number the two that meet there.
            moments = frames.before.shape[1]
            low, high = (moments - 1) // 2, moments // 2
            velocity = radial_velocity(
                frames.positions[frames.before[local, low]],
                frames.positions[frames.after[local, high]],
                place,
                frames.duration_s[local, low : high + 1].sum(),
            )
        visible, quality = self._frames.masks.for_frame(block, local, sensor.position_m, chosen)
        if not self.mesh.presence.present[index]:
            visible = np.zeros_like(visible)
        return FrameScattering(
            velocity.astype(np.float32),
            np.sqrt((ray * ray).sum(axis=0)).astype(np.float32),
            visible,
            quality,
        )

    def uncertainty(
        self,
        sensor: VirtualSensor,
        *,
        visibility: Visibility | None = None,
        frames: tuple[int, int] | None = None,
        progress: Progress = silent,
    ) -> CellUncertainty:
        """Uncertainty of the cells of :meth:`map` that follows from that of the mesh's velocities.

        In a scene of several, a body whose velocities nothing is said of is taken to be known.

        Model and limits are those of :mod:`sd2core.doppler.cell_uncertainty`.

        Parameters
        ----------
        sensor : VirtualSensor
            Where the radar is.
        visibility, frames, progress
            As for :meth:`map`.

        Raises
        ------
        Sd2Error
            If the mesh does not say how well its velocities are known.
        """
        start, stop = frames or (0, self.mesh.frame_count)
        if not 0 <= start < stop <= self.mesh.frame_count:
            raise IndexError(f"frames {start} to {stop} of {self.mesh.frame_count}")
        chosen, of = self._choose(visibility), len(self.bodies)
        sensor = replace(sensor, beam=None) if "beam" in self.left_out else sensor
        await_kernels(lambda: progress(0, stop - start))
        known = any(body.uncertainty is not None for body in self.mesh.bodies)
        each = []
        for number, one in enumerate(self.bodies):
            counting = _of_bodies(progress, number, of)
            if known and one.mesh.uncertainty is None:  # what is not said is taken to be right
                counted = one._to_count(sensor, (start, stop), chosen, None, False)
                one._run([counted], counting)
                values = one._summed(counted, sensor, (start, stop), None, False).values
                each.append(CellUncertainty(values, np.zeros_like(values)))
                continue
            frames_of, threads = one._frames, self._threads
            each.append(cell_uncertainty(frames_of, sensor, start, stop, chosen, counting, threads))
        if of == 1:
            return each[0]
        # People move independently of each other.
        variance = np.sum([np.square(one.sd, dtype=np.float64) for one in each], axis=0)
        return CellUncertainty(np.sum([one.expected for one in each], axis=0), np.sqrt(variance))

    def _choose(self, visibility: Visibility | None) -> Visibility:
        chosen: Visibility = self.options.visibility if visibility is None else visibility
        if chosen not in ("none", "facing", "depth", "exact", "frozen"):
            raise Sd2Error(f"visibility is {chosen!r}", "none, facing, depth, exact or frozen")
        if self.mesh.faces is None and chosen != "none":
            raise _no_surface(self.mesh, f"Visibility {chosen}")
        return chosen

    def _to_count(
        self,
        sensor: VirtualSensor,
        frames: tuple[int, int],
        visibility: Visibility,
        parts: VertexParts | None,
        shares: bool,
    ) -> _Counted:
        """Empty counts of what some frames of this body need, and the jobs that fill them."""
        start, stop = frames_within_reach(self.mesh.times_s, *frames, self.options.time_sigma_s)
        sensor = replace(sensor, beam=None) if "beam" in self.left_out else sensor
        counts = Counts.empty(
            stop - start, self.options.axis.bins, 1 if parts is None else len(parts.names)
        )
        numbers = None if parts is None else parts.numbers
        totals = np.empty(stop - start)
        used: set[Quality] = set()
        quick = visibility not in ("depth", "exact")
        at_once = max(_EXACT_VERTICES // self.mesh.vertex_count, 1)

        def job(index: int, low: int, high: int) -> Callable[[Ticket], None]:
            def work(ticket: Ticket) -> None:
                step = high - low if quick else at_once
                ticket.advance(0)
                block = self.prepared.counted(
                    index, self._frames.counting, points=shares or not quick
                )
                for first in range(low, high, step):
                    last = min(first + step, high)
                    rows = slice(first - block.start, last - block.start)
                    target = slice(first - start, last - start)
                    into = counts.rows(target), totals[target]
                    used.add(
                        self._frames.count(
                            block, rows, sensor, visibility, *into, numbers, shares=shares
                        )
                    )
                    ticket.advance(last - first)

            return work

        jobs = []
        blocks = self._frames.blocks_between(start, stop)
        pairs = [self.prepared.pairs_moving(index) for index, *_ in blocks]
        light = quick and None not in pairs and sum(pair or 0 for pair in pairs) <= _LIGHT_PAIRS
        # Light work is cut into equal parts, one for every thread.
        shared = np.linspace(start, stop, worker_count() + 1).astype(int).tolist() if light else []
        for index, low, high in blocks:
            # A block that must be read first is one job: its readers would wait.
            size = _FAST_FRAMES if quick else 2 * at_once
            pieces = -(-(high - low) // size) if self.prepared.has(index) else 1
            cuts = np.linspace(low, high, pieces + 1).astype(int).tolist()
            if light:
                cuts = [low, *(cut for cut in shared if low < cut < high), high]
            jobs += [job(index, a, b) for a, b in pairwise(cuts)]
        return _Counted(start, stop, counts, totals, visibility, used, jobs, light)

    def _run(self, counted: list[_Counted], progress: Progress) -> float:
        """Count several bodies; returns processor seconds."""
        jobs = [job for one in counted for job in one.jobs]
        of, frames = len(counted), counted[0].stop - counted[0].start
        await_kernels(lambda: progress(0, frames))

        def of_clip(done: int, _: int) -> None:
            progress(done // of, frames)

        if self._threads is None and all(one.light for one in counted):
            return run_light_jobs(jobs, of * frames, of_clip)
        return run_jobs(jobs, of * frames, of_clip, self._threads)

    def _block_of(self, frame: int) -> Block:
        if not 0 <= frame < self.mesh.frame_count:
            raise IndexError(f"frame {frame} of {self.mesh.frame_count}")
        return self.prepared.block(frame // self.prepared.block_frames)


def _no_surface(mesh: MeshSequence, wanted: str) -> Sd2Error:
    return Sd2Error(
        f"{wanted}: {mesh.source or 'the mesh'} has no faces, it is a point cloud",
        "visibility none and count weighting",
        "Choose those, or give the faces (--faces)",
    )


def _rounded(shares: NDArray[np.float32]) -> list[float]:
    return np.round(shares.astype(np.float64), 5).tolist()
