"""DopplerMap: energy per velocity bin and frame, with all one needs to read it."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write
from sd2core.files.numpy_files import open_npz_file
from sd2core.files.texts import check_version, faults_in
from sd2core.mesh.presence import checked, runs
from sd2core.mesh.vertex_parts import JOINTS, KINEMATICS, PARTS, QUANTITIES, WHOLE
from sd2core.numerics.map_accuracy import MapAccuracy
from sd2core.options.kinds import MapKind as MapKind
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase, frames_that_begin

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from xarray import DataArray

FORMAT_VERSION = 1

OF = ": "
"""Between the name of a person and a part, in a scene of several."""

_SHARES = "visible_share", "beyond_share"
"""Of a provenance: lists of a number per frame."""

_NOTHING, _MUTED = "#e9ebee", "#5a6370"
"""Colours of what is not known."""


@dataclass(frozen=True, eq=False)
class CellUncertainty:
    """Uncertainty of the values of a map; both arrays have the shape (bins, frames)."""

    expected: NDArray[np.float32]  # The map's values, blurred by the uncertainty of the velocities.
    sd: NDArray[np.float32]  # Standard deviation of every value.

    def __post_init__(self) -> None:
        for name in ("expected", "sd"):
            object.__setattr__(self, name, np.ascontiguousarray(getattr(self, name), np.float32))
        if self.expected.shape != self.sd.shape:
            raise Sd2Error(
                f"expected is of shape {self.expected.shape}, sd of {self.sd.shape}", "the same"
            )

    def deviation(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        """Root-mean-square deviation of the truth from a map's values, (bins, frames).

        sqrt(sd² + (expected − value)²). The standard deviation alone would call a value
        certain that is almost certainly wrong.
        """
        return np.hypot(self.sd, self.expected - values)

    def between(self, start: int, stop: int) -> CellUncertainty:
        """Uncertainty of frames ``start`` to ``stop`` (exclusive)."""
        return CellUncertainty(self.expected[:, start:stop], self.sd[:, start:stop])


@dataclass(frozen=True, eq=False)
class LimbMaps:
    """Split of a map by the parts of the body; added up, they are the map."""

    parts: tuple[str, ...]
    values: NDArray[np.float32]  # (parts, bins, frames)
    # (joints, quantities, frames) as sd2core.mesh.vertex_parts names them, in a scene the joints of
    # one person after the other, NaN of whom they are not known; files of before have none.
    kinematics: NDArray[np.float32] | None = None

    def __post_init__(self) -> None:
        values = np.ascontiguousarray(self.values, np.float32)
        if values.ndim != 3 or not len(self.parts) == len(values) > 0:
            raise Sd2Error(
                f"Limb maps of shape {values.shape} and {len(self.parts)} parts",
                "(parts, bins, frames), at least one part",
            )
        object.__setattr__(self, "parts", tuple(str(part) for part in self.parts))
        object.__setattr__(self, "values", values)
        moves, joints = self.kinematics, len(JOINTS) * max(1, len(self.persons))
        if moves is not None and moves.shape != (joints, len(QUANTITIES), values.shape[2]):
            raise Sd2Error(
                f"Kinematics of shape {moves.shape}",
                f"({joints} joints, {len(QUANTITIES)} quantities, {values.shape[2]} frames)",
            )

    @classmethod
    def of_persons(cls, each: Sequence[LimbMaps], persons: Sequence[str]) -> LimbMaps:
        """Join those of several persons, with their names in front."""
        parts = [
            f"{person}{OF}{part}"
            for person, one in zip(persons, each, strict=True)
            for part in one.parts
        ]
        values, moves = np.concatenate([one.values for one in each]), None
        if any(one.kinematics is not None for one in each):
            nothing = np.full((len(JOINTS), len(QUANTITIES), values.shape[2]), np.nan, np.float32)
            known = [nothing if one.kinematics is None else one.kinematics for one in each]
            moves = np.concatenate(known)
        return cls(tuple(parts), values, moves)

    @property
    def by_person(self) -> tuple[LimbMaps, ...]:
        """Limb maps of each person, without the name; of one alone, these themselves."""
        result = []
        for number, person in enumerate(self.persons):
            rows = [row for row, one in enumerate(self.parts) if one.rpartition(OF)[0] == person]
            moves = self.kinematics
            if moves is not None:
                moves = moves[number * len(JOINTS) : (number + 1) * len(JOINTS)]
                moves = None if np.isnan(moves).any() else moves
            names = (self.parts[row].rpartition(OF)[2] for row in rows)
            result.append(LimbMaps(tuple(names), self.values[rows], moves))
        return tuple(result) or (self,)

    @property
    def persons(self) -> tuple[str, ...]:
        """Names of the persons of a scene of several; empty of one alone."""
        return tuple(dict.fromkeys(one.rpartition(OF)[0] for one in self.parts if OF in one))

    @property
    def of_everybody(self) -> bool:
        """True if the parts of the body are known of each person."""
        return WHOLE not in {one.rpartition(OF)[2] for one in self.parts}

    def shown(self, part: str) -> NDArray[np.float32] | None:
        """Map (bins, frames) of a part, or of all parts of a person; None if there is none."""
        if part in self.parts:
            return self.values[self.parts.index(part)]
        rows = [one.startswith(f"{part}{OF}") for one in self.parts]
        return self.values[rows].sum(axis=0) if any(rows) else None

    def inputs(self, parts: Sequence[str]) -> NDArray[np.float32]:
        """Energies by frame, part and bin, (frames, len(parts) · bins), or the map and kinematics.

        A part without a side (``forearm``) is the sum of both. For
        :data:`~sd2core.mesh.vertex_parts.KINEMATICS` alone columns are those of the map, all
        quantities of all joints, and the root of what is seen of each part. In a scene of several
        there are as many columns of each person, one person after the other. Raises Sd2Error if a
        part is missing.
        """
        if self.persons:
            return np.concatenate([one.inputs(parts) for one in self.by_person], axis=1)
        if tuple(parts) == (KINEMATICS,):
            return np.ascontiguousarray(self._moving().T)
        energies = []
        for part in parts:
            rows = [
                number
                for number, name in enumerate(self.parts)
                if part in (name, name.partition(".")[0])
            ]
            if not rows:
                raise Sd2Error(
                    f"The limb maps have no part {part!r}", f"some of {', '.join(self.parts)}"
                )
            energies.append(self.values[rows].sum(axis=0))
        return np.ascontiguousarray(np.concatenate(energies).T)

    def _moving(self) -> NDArray[np.float32]:
        """The map, and kinematics below it."""
        if self.kinematics is None:
            raise Sd2Error(
                "The limb maps have no kinematics, or not of everybody",
                "kinematics, which this version keeps of whose parts of the body are known",
                "Make the map or the pairs again with --limbs, or use a model of the map alone",
            )
        seen = np.sqrt(self.values.sum(axis=1))
        joints = self.kinematics.reshape(-1, seen.shape[1])
        return np.concatenate([self.values.sum(axis=0), joints, seen])

    def between(self, start: int, stop: int) -> LimbMaps:
        """Limb maps of frames ``start`` to ``stop`` (exclusive)."""
        return self.of_frames(slice(start, stop))

    def empty(self, frames: int) -> LimbMaps:
        """Limb maps like these of so many frames, all zero."""
        values, moves = self.values, self.kinematics
        return LimbMaps(
            self.parts,
            np.zeros((*values.shape[:2], frames), np.float32),
            None if moves is None else np.zeros((*moves.shape[:2], frames), np.float32),
        )

    def put(self, start: int, other: LimbMaps) -> None:
        """Write others of the same parts over the frames from ``start`` on."""
        inside = slice(start, start + other.values.shape[-1])
        here = self.values[..., inside]
        # Most parts stand still for long; what is zero and stays so takes no memory.
        changes = other.values.any(axis=-1) | here.any(axis=-1)  # (parts, bins)
        here[changes] = other.values[changes]
        if self.kinematics is not None and other.kinematics is not None:
            self.kinematics[..., inside] = other.kinematics

    def of_frames(self, frames: slice) -> LimbMaps:
        """Limb maps of some of the frames."""
        moves = self.kinematics
        return LimbMaps(
            self.parts, self.values[..., frames], None if moves is None else moves[..., frames]
        )


def joints_of(parts: Sequence[str]) -> tuple[str, ...]:
    """Joints in the kinematics of limb maps of these parts; none unless all persons have bodies."""
    persons = dict.fromkeys("".join(part.rpartition(OF)[:2]) for part in parts)
    whole = all(of + part in parts for of in persons for part in PARTS)
    return tuple(of + joint for of in persons for joint in JOINTS) if whole else ()


@dataclass(frozen=True, eq=False)
class DopplerMap:
    """Doppler energy on a velocity axis over time.

    Parameters
    ----------
    values : float32 array, shape (bins, frames)
        Not negative; velocity ascending, positive when approaching.
    timebase : Timebase
        One time per frame.
    unit : str
        Meaning of the value 1, e.g. ``"share of vertices"`` or ``"power"``.
    null_bins : tuple of int
        Bins that were set to zero on purpose.
    unseen_bins : tuple of int
        Bins that the radar cannot see because they lie beyond its v_max.
    meta : dict
        Provenance that fits into JSON: sensor, options, sources, version.
    present : bool array, shape (frames,), optional
        False in columns without a person. None: there is a person in all of them.
    uncertainty : CellUncertainty, optional
        Uncertainty of the values, if the mesh states that of its velocities.
    limbs : LimbMaps, optional
        The same map split by the parts of the body.

    Examples
    --------
    >>> import numpy as np
    >>> import sd2core as sd2
    >>> values = np.zeros((32, 3), np.float32)
    >>> values[20] = 1.0
    >>> times = sd2.Timebase.regular(frames=3, frames_per_s=30)
    >>> doppler = sd2.DopplerMap(values, sd2.VelocityAxis(), times, kind="synthetic", unit="count")
    >>> float(doppler.axis.centres_mps[doppler.values[:, 0].argmax()])
    0.5625
    >>> doppler.within(1.0)
    <DopplerMap synthetic, 16 bins over ±1 m/s · 3 frames, 0.100 s, 30.00 frames/s · count>
    """

    values: NDArray[np.float32]
    axis: VelocityAxis
    timebase: Timebase
    kind: MapKind
    unit: str = ""
    null_bins: tuple[int, ...] = ()
    unseen_bins: tuple[int, ...] = ()
    meta: dict[str, Any] = field(default_factory=dict)
    present: NDArray[np.bool_] | None = None
    uncertainty: CellUncertainty | None = None
    limbs: LimbMaps | None = None

    def __post_init__(self) -> None:
        values = np.ascontiguousarray(self.values, dtype=np.float32)
        if values.shape != (self.axis.bins, len(self.timebase)):
            raise Sd2Error(
                f"The Doppler map has shape {values.shape}",
                f"({self.axis.bins} bins, {len(self.timebase)} frames)",
            )
        if self.kind not in get_args(MapKind):
            raise Sd2Error(f"The map is of kind {self.kind!r}", f"one of {get_args(MapKind)}")
        for name in ("null_bins", "unseen_bins"):
            object.__setattr__(self, name, self.axis.checked_bins(getattr(self, name), name))
        object.__setattr__(self, "values", values)
        if self.present is not None:
            present = checked(self.present, values.shape[1])
            object.__setattr__(self, "present", None if present.all() else present)
        if self.uncertainty is not None and self.uncertainty.sd.shape != values.shape:
            raise Sd2Error(
                f"The map is of shape {values.shape}, its uncertainty of"
                f" {self.uncertainty.sd.shape}",
                "the same",
            )
        if self.limbs is not None and self.limbs.values.shape[1:] != values.shape:
            raise Sd2Error(
                f"The map is of shape {values.shape}, its limb maps of"
                f" {self.limbs.values.shape[1:]}",
                "the same",
            )

    @property
    def shape(self) -> tuple[int, int]:
        """Number of bins and of frames."""
        return self.axis.bins, len(self.timebase)

    def __array__(
        self, dtype: np.dtype[Any] | None = None, copy: bool | None = None
    ) -> NDArray[Any]:
        return np.array(self.values, dtype=dtype, copy=copy)

    def __repr__(self) -> str:
        emptied = len(self.null_bins)
        parts = [
            f"{self.kind}, {self.axis.words}",
            self.timebase.words,
            *([self.unit] if self.unit else []),
            *([f"{emptied} bins emptied"] if emptied else []),
            *(["by parts of the body"] if self.limbs is not None else []),
        ]
        return f"<DopplerMap {' · '.join(parts)}>"

    def of_person(self, person: str) -> DopplerMap:
        """Return the map of one person of a scene of several, less what the others hide.

        Its frames are the same; it needs limb maps.
        """
        assert self.limbs is not None
        limbs = self.limbs.by_person[self.limbs.persons.index(person)]
        return replace(
            self,
            values=limbs.values.sum(axis=0),
            meta=without_shares(self.meta) | {"person": person},  # they are of everybody
            uncertainty=None,
            limbs=limbs,
        )

    def db(self, reference: float | None = None) -> NDArray[np.float64]:
        """Levels in dB, (bins, frames); -inf where a cell is empty, NaN where it was emptied.

        0 dB is the strongest cell, or ``reference``, an energy above 0.
        """
        most = float(self.values.max(initial=0.0)) if reference is None else float(reference)
        if not (most > 0 and np.isfinite(most)):
            raise Sd2Error(
                f"0 dB is an energy of {most:g}" + ("" if reference is not None else ": no cell"),
                "a finite energy above 0",
                "Give a reference",
            )
        with np.errstate(divide="ignore"):
            level = 10.0 * np.log10(self.values.astype(np.float64) / most)
        level[[*self.null_bins, *self.unseen_bins]] = np.nan
        return np.asarray(level)

    def plot(self, axes: Axes | None = None, *, low_db: float = -30.0) -> Axes:
        """Draw the map with matplotlib, by default into pyplot's axes, and return these.

        Velocities are positive when approaching. Colours go from ``low_db``, below 0, to the
        strongest cell.
        """
        if axes is None:
            from matplotlib import pyplot

            axes = pyplot.gca()
        level = np.clip(self.db(), low_db, 0.0)
        clock = self.timebase
        shown = draw_cells(axes, level, self.axis, clock, self.present, low=low_db, high=0.0)
        axes.figure.colorbar(shown, ax=axes, label="level (dB)")
        radar = {"real": "radar", "simulated": "radar (simulated)"}.get(self.kind, self.kind)
        axes.set(xlabel="time (s)", ylabel="velocity (m/s)", title=radar)
        return axes

    def to_xarray(self) -> DataArray:
        """Return an ``xarray.DataArray`` with velocities and times as coordinates.

        It is sliced by both: ``a.sel(time_s=slice(1, 2), velocity_mps=slice(0, None))``.
        """
        try:
            from xarray import DataArray
        except ModuleNotFoundError:
            raise Sd2Error(
                "xarray is not installed",
                "the package xarray",
                'Install it: pip install "sd2-core[notebook]"',
            ) from None
        return DataArray(
            self.values,
            {
                "velocity_mps": ("velocity_mps", self.axis.centres_mps, {"units": "m/s"}),
                "time_s": ("time_s", self.times_s, {"units": "s"}),
            },
            ("velocity_mps", "time_s"),
            self.kind,
            {"units": self.unit, "kind": self.kind, "null_bins": list(self.null_bins)},
        )

    @property
    def carrier_hz(self) -> float | None:
        """Centre frequency of the radar that the map is of; None if its provenance names none."""
        match self.meta.get("radar"):
            case {"start_frequency_hz": float() as low, "end_frequency_hz": float() as high}:
                return 0.5 * (low + high)
            case _:
                return None

    @property
    def accuracy(self) -> MapAccuracy:
        """How far the map may be from the truth, as far as its provenance says."""
        return MapAccuracy.of(self.meta)

    @property
    def of_simulated(self) -> bool:
        """True if its provenance says that no camera saw whom it is of."""
        return self.meta.get("simulated") is True

    @property
    def times_s(self) -> NDArray[np.float64]:
        """Time of every frame, shape (frames,)."""
        return self.timebase.times_s

    @property
    def present_mask(self) -> NDArray[np.bool_]:
        """Frames with a person, shape (frames,)."""
        return np.ones(len(self.timebase), bool) if self.present is None else self.present

    def shifted(self, offset_s: float) -> DopplerMap:
        """Map moved by ``offset_s`` to later times."""
        return replace(self, timebase=self.timebase.shifted(offset_s))

    def between(self, start: int, stop: int) -> DopplerMap:
        """Map of frames ``start`` to ``stop`` (exclusive), at their times."""
        known = self.uncertainty
        return replace(
            self,
            values=self.values[:, start:stop],
            timebase=Timebase(self.times_s[start:stop]),
            meta=_between(self.meta, start, stop),
            present=None if self.present is None else self.present[start:stop],
            uncertainty=None if known is None else known.between(start, stop),
            limbs=None if self.limbs is None else self.limbs.between(start, stop),
        )

    def during(self, start_s: float, end_s: float) -> DopplerMap:
        """Map of the frames from one time to another (exclusive)."""
        inside = frames_that_begin(self.times_s, start_s, end_s)
        if inside.start >= inside.stop:
            raise Sd2Error(
                f"The map has no frame from {start_s:g} to {end_s:g} s",
                f"times between {self.times_s[0]:g} and {self.timebase.end_s:g} s",
            )
        return self.between(inside.start, inside.stop)

    def within(self, v_mps: float) -> DopplerMap:
        """Map of the bins whose velocities are between -v and v, on an axis of its own."""
        left_out = int((~(self.axis.edges_mps >= -v_mps - 1e-9)).sum())  # all for NaN
        bins = self.axis.bins - 2 * left_out
        if bins < 2:
            raise Sd2Error(
                f"The map has {max(bins, 0)} bins within ±{v_mps:g} m/s",
                f"2 or more; a bin is {self.axis.bin_width_mps:g} m/s wide",
            )
        kept = slice(left_out, left_out + bins)

        def of(numbers: Sequence[int]) -> tuple[int, ...]:
            return tuple(one - left_out for one in numbers if 0 <= one - left_out < bins)

        known = self.uncertainty
        return replace(
            self,
            values=self.values[kept],
            # That is beyond the wider axis.
            meta={name: one for name, one in self.meta.items() if name != "beyond_share"},
            axis=VelocityAxis(bins, self.axis.v_max_mps * bins / self.axis.bins),
            null_bins=of(self.null_bins),
            unseen_bins=of(self.unseen_bins),
            uncertainty=None
            if known is None
            else CellUncertainty(known.expected[kept], known.sd[kept]),
            # Kinematics are of the whole body.
            limbs=None
            if self.limbs is None
            else LimbMaps(self.limbs.parts, self.limbs.values[:, kept], self.limbs.kinematics),
        )

    def mean_velocity_mps(self) -> NDArray[np.float64]:
        """Energy-weighted mean velocity per frame; NaN where a frame is empty."""
        return mean_velocity_mps(self.values.T, self.axis)

    def peak_velocity_mps(self) -> NDArray[np.float64]:
        """Velocity of the strongest bin per frame; NaN where a frame is empty."""
        return peak_velocity_mps(self.values.T, self.axis)

    def save(self, path: Path) -> None:
        """Write ``values``, ``velocity_mps``, ``times_s`` and ``meta`` to one ``.npz``.

        Also ``present`` if there are columns without a person, ``expected`` and ``sd`` if
        the uncertainty of the values is known, and ``parts``, ``limbs`` and ``kinematics`` if
        the map is split. Raises Sd2Error for what :meth:`load` would refuse.
        """
        from sd2core.options.declared import MapMeta  # loads pydantic

        if not np.isfinite(self.values).all():
            raise Sd2Error(f"Values of the map for {path} are NaN or infinite", "finite numbers")
        meta = {
            "format": "sd2-doppler-map",
            "version": FORMAT_VERSION,
            "kind": self.kind,
            "unit": self.unit,
            "v_max_mps": self.axis.v_max_mps,
            "null_bins": self.null_bins,
            "unseen_bins": self.unseen_bins,
            "provenance": self.meta,
        }
        text = json.dumps(meta, default=np.generic.tolist)  # of numbers of NumPy
        with faults_in(path, "the provenance of a map, as docs/formats.md says"):
            MapMeta.model_validate(json.loads(text)["provenance"])
        arrays: dict[str, Any] = {
            "values": self.values,
            "velocity_mps": self.axis.centres_mps,
            "times_s": self.times_s,
            "meta": text,
        }
        if self.present is not None:
            arrays["present"] = self.present
        if self.uncertainty is not None:
            arrays |= {"expected": self.uncertainty.expected, "sd": self.uncertainty.sd}
        if self.limbs is not None:
            arrays |= {"parts": np.array(self.limbs.parts), "limbs": self.limbs.values}
            if self.limbs.kinematics is not None:
                arrays["kinematics"] = self.limbs.kinematics
        with atomic_write(Path(path)) as stream:
            np.savez_compressed(stream, **arrays)

    @classmethod
    def load(cls, path: Path) -> DopplerMap:
        """Read what :meth:`save` wrote.

        Raises
        ------
        Sd2Error
            When the file is not a Doppler map or is damaged.
        """
        path = Path(path)
        expected = "an .npz written by `sd2 synth`"
        with open_npz_file(path, "a Doppler map", expected) as data:
            arrays = dict(data)
        missing = {"values", "velocity_mps", "times_s", "meta"} - arrays.keys()
        if missing:
            raise Sd2Error(
                f"{path} has no {', '.join(sorted(missing))}; it holds {', '.join(sorted(arrays))}",
                "a Doppler map with values, velocity_mps, times_s and meta",
            )
        if arrays["values"].dtype.kind != "f" or not np.isfinite(arrays["values"]).all():
            raise Sd2Error(f"{path}: values hold NaN, infinity or no numbers", "finite numbers")
        try:
            from sd2core.options.declared import MapMeta, check_record  # loads pydantic

            meta = json.loads(str(arrays["meta"]))
            check_version(meta, path, "sd2-doppler-map", FORMAT_VERSION, oldest=0)
            check_record(MapMeta, meta["provenance"], f"{path}: its provenance")
            axis = VelocityAxis(len(arrays["velocity_mps"]), float(meta["v_max_mps"]))
            if not np.allclose(axis.centres_mps, arrays["velocity_mps"], atol=1e-6):
                raise Sd2Error(f"{path}: velocity_mps does not match v_max_mps {axis.v_max_mps}")
            return cls(
                values=arrays["values"],
                axis=axis,
                timebase=Timebase(arrays["times_s"]),
                kind=meta["kind"],
                unit=meta["unit"],
                null_bins=tuple(meta["null_bins"]),
                unseen_bins=tuple(meta["unseen_bins"]),
                meta=meta["provenance"],
                present=arrays.get("present"),
                uncertainty=CellUncertainty(arrays["expected"], arrays["sd"])
                if {"expected", "sd"} <= arrays.keys()
                else None,
                limbs=LimbMaps(
                    tuple(arrays["parts"].tolist()), arrays["limbs"], arrays.get("kinematics")
                )
                if {"parts", "limbs"} <= arrays.keys()
                else None,
            )
        except Sd2Error as error:
            raise error.within(path) from error
        except (KeyError, TypeError, ValueError, AttributeError, RecursionError) as error:
            raise Sd2Error(
                f"{path}: its description is damaged ({error!r})", "the meta written by `sd2 synth`"
            ) from error


def draw_cells(
    axes: Axes,
    level: NDArray[np.float64],
    axis: VelocityAxis,
    timebase: Timebase,
    present: NDArray[np.bool_] | None,
    *,
    low: float,
    high: float,
    colours: Any = "viridis",
) -> Any:
    """Draw levels over seconds and m/s; grey where nothing is known.

    Parameters
    ----------
    axes : matplotlib Axes
    level : float64 array, shape (bins, frames)
        In any unit; NaN where nothing is known.
    axis : VelocityAxis
    timebase : Timebase
        Of the frames.
    present : bool array, shape (frames,), or None
        False in frames without a person; None: there is one in all.
    low, high : float
        Levels of the first and the last colour.
    colours : str or matplotlib Colormap

    Returns
    -------
    matplotlib QuadMesh
        What a colour bar is made for.
    """
    times_s = timebase.edges_s
    axes.set_facecolor(_NOTHING)
    gaps = 1 + np.flatnonzero(np.diff(timebase.times_s) > timebase.longest_s)
    shown = axes.pcolormesh(
        np.insert(times_s, gaps, times_s[gaps - 1] + timebase.longest_s),
        axis.edges_mps,
        np.ma.masked_invalid(np.insert(level, gaps, np.nan, axis=1)),
        cmap=colours,
        vmin=low,
        vmax=high,
        rasterized=True,
    )
    for start, stop in () if present is None else runs(~present):
        axes.axvspan(times_s[start], times_s[stop], facecolor=_NOTHING, edgecolor=_MUTED,
                     hatch="////", linewidth=0)  # fmt: skip
    return shown


def peak_velocity_mps(
    energies: NDArray[np.floating], axis: VelocityAxis, floor: float = 0.0
) -> NDArray[np.float64]:
    """Centre of the strongest bin per frame, (frames,); NaN where a frame is empty.

    ``energies`` has the shape (frames, bins); a frame that does not exceed ``floor`` is empty.
    """
    _check(energies, axis)
    peak = axis.centres_mps[energies.argmax(axis=1)]
    return np.where(energies.max(axis=1) > floor, peak, np.nan)


def without_shares(meta: Mapping[str, Any]) -> dict[str, Any]:
    """Provenance less its shares, a number per frame, also of the map that was denoised."""
    kept = {name: value for name, value in meta.items() if name not in _SHARES}
    source = meta.get("input")
    return kept | ({"input": without_shares(source)} if isinstance(source, dict) else {})


def _between(meta: Mapping[str, Any], start: int, stop: int) -> dict[str, Any]:
    """Provenance of some of the frames."""
    cut = {name: meta[name][start:stop] for name in _SHARES if isinstance(meta.get(name), list)}
    source = meta.get("input")
    made_of = {"input": _between(source, start, stop)} if isinstance(source, dict) else {}
    return {**meta, **cut, **made_of}


def joined(maps: Sequence[DopplerMap]) -> DopplerMap:
    """Concatenate maps of one axis in time, without limb maps; metadata are those of the first."""
    return replace(
        maps[0],
        values=np.concatenate([one.values for one in maps], axis=1),
        timebase=Timebase(np.concatenate([one.times_s for one in maps])),
        present=np.concatenate([one.present_mask for one in maps]),
        uncertainty=None,
        limbs=None,
    )


def mean_velocity_mps(
    energies: NDArray[np.floating], axis: VelocityAxis, floor: float = 0.0
) -> NDArray[np.float64]:
    """Energy-weighted mean velocity per frame, (frames,); NaN where a frame is empty.

    Parameters as for :func:`peak_velocity_mps`.
    """
    _check(energies, axis)
    values = energies.astype(np.float64)
    total = values.sum(axis=1)
    known = (values.max(axis=1) > floor) & (total > 0)
    return np.divide(values @ axis.centres_mps, total, out=np.full_like(total, np.nan), where=known)


def _check(energies: NDArray[np.floating], axis: VelocityAxis) -> None:
    if energies.ndim != 2 or energies.shape[1] != axis.bins:
        raise Sd2Error(f"The values are of shape {energies.shape}", f"(frames, {axis.bins})")
