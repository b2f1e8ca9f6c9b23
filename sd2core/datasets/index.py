"""Header and index of a data set, made of its sources after a check that they fit together."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from sd2core.datasets.cutting import count_spans
from sd2core.datasets.layout import Header
from sd2core.datasets.source import Source
from sd2core.denoise.resample_to_model import MAX_RESAMPLED, can_resample
from sd2core.errors import Sd2Error
from sd2core.files.texts import refuse_change
from sd2core.labels.per_frame import BACKGROUND
from sd2core.maps import DopplerMap, joints_of
from sd2core.mesh.vertex_parts import JOINTS, KINEMATICS, PARTS
from sd2core.options.exporting import Exporting
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase
from sd2core.version import __version__


@dataclass
class Names:
    """Subjects, labels, classes, units and kinds of all sources, in order of appearance."""

    subjects: dict[str, int] = field(default_factory=dict)
    labels: dict[str, int] = field(default_factory=lambda: {BACKGROUND: 0})
    classes: dict[str, str] = field(default_factory=dict)
    units: dict[str, dict[str, None]] = field(default_factory=dict)
    kinds: set[str] = field(default_factory=set)

    def learn(self, entry: dict[str, Any]) -> None:
        """Add the line of a source."""
        # Who has no segment is in no split.
        if entry["stop"] > entry["start"]:
            self.subjects.setdefault(entry["subject"], len(self.subjects))
        for label in entry["labels"]:
            self.labels.setdefault(label, len(self.labels))
        self.classes |= entry["classes"]
        for kind, unit in entry["units"].items():
            self.units.setdefault(kind, {})[unit] = None
        self.kinds |= {kind for kind, count in entry["segments_of_kind"].items() if count}

    def check(self, source: Source) -> None:
        """Refuse a source that gives a label another class."""
        for label, name in source.classes.items():
            if self.classes.get(label, name) != name:
                raise Sd2Error(
                    f"{source.key.title}: the label {label!r} is of class {name!r}",
                    f"{self.classes[label]!r}, as in the sources before",
                )


def header_of(source: Source, options: Exporting) -> Header:
    """Return the header of a new data set; its first source fills in open options."""
    first: DopplerMap = next(iter(source.maps.values()))
    nulled = sorted({number for one in source.maps.values() for number in one.null_bins})
    header = empty_header(options, first.axis, first.timebase, tuple(nulled))
    limbs = source.maps["synthetic"].limbs if options.limbs and "synthetic" in source.maps else None
    if limbs is not None and (joints := joints_of(limbs.parts)):  # perhaps of several persons
        header = replace(header, parts=limbs.parts, joints=joints)
    return header


def empty_header(
    options: Exporting, axis: VelocityAxis, timebase: Timebase, nulled: tuple[int, ...] = ()
) -> Header:
    """Return the header of a data set without segments; what the options leave open is given.

    Parameters
    ----------
    options : Exporting
        Take precedence where they name null bins or a frame rate.
    axis : VelocityAxis
        Of all maps.
    timebase : Timebase
        Its frame rate, to three decimals, is that of the segments.
    nulled : tuple of int
        Bins that are empty in the maps.
    """
    return Header(
        length=options.segment_frames,
        overlap=options.overlap_frames,
        axis=axis,
        null_bins=nulled if options.null_bins is None else tuple(options.null_bins),
        frame_rate_hz=options.frame_rate_hz or round(timebase.frames_per_s, 3),
        label_rule=options.label_rule,
        min_share=options.min_share,
        min_purity=options.min_purity,
        spans=options.spans,
        kinds_wanted=options.kinds,
        parts=PARTS if options.limbs else (),
        joints=JOINTS if options.limbs else (),
        imu=options.imu,
        title=options.title,
        made_by=f"SD² Studio {__version__}",
    )


def check_fits(source: Source, header: Header) -> None:
    """Refuse a source of another axis, frame rate, emptied bins, or without what is wanted."""
    title = source.key.title
    if not {*source.maps} & {*header.kinds_wanted}:
        raise Sd2Error(
            f"{title} has maps of kind {', '.join(source.maps)}",
            f"one of {', '.join(header.kinds_wanted)}",
        )
    if header.parts and "synthetic" in source.maps:
        limbs = source.maps["synthetic"].limbs
        if limbs is None or limbs.parts != header.parts:
            raise Sd2Error(
                f"The synthetic map of {title} is "
                + ("not split" if limbs is None else f"split into {', '.join(limbs.parts)}"),
                f"limb maps of {', '.join(header.parts)}",
                "Make it with `sd2 synth --limbs`, or export without limbs",
            )
        if header.joints:
            limbs.inputs((KINEMATICS,))  # refuses those of before there were kinematics
    lacking = [name for name in header.imu if name not in source.imu]
    if lacking:
        raise Sd2Error(
            f"{title} has no inertial sensor at {', '.join(lacking)}",
            f"sensors at {', '.join(header.imu)}, as the data set has",
            "Export recordings with a mesh, or without inertial sensors",
        )
    for one in source.maps.values():
        if one.axis != header.axis:
            raise Sd2Error(
                f"{title} has {one.axis.words}",
                f"{header.axis.words}, as the data set has",
            )
        extra = sorted({*one.null_bins} - {*header.null_bins})
        if extra:
            raise Sd2Error(
                f"{title}: bins {', '.join(map(str, extra))} of the {one.kind} map were emptied",
                "energy there, as in the sources before",
                "Export with --null-bins that name them, or make the maps again",
            )
    rate_hz = next(iter(source.maps.values())).timebase.frames_per_s
    if len(source.times_s) > 1 and not can_resample(rate_hz, header.frame_rate_hz):
        raise Sd2Error(
            f"{title} has {rate_hz:.4g} frames/s",
            f"{header.frame_rate_hz:g} frames/s, or up to {MAX_RESAMPLED:g} times more or less",
        )


def entry_of(source: Source, header: Header, fingerprint: str) -> dict[str, Any]:
    """Return the line of a source in the index, without its rows."""
    range_m, azimuth_deg, elevation_deg = source.spherical
    kinds = [kind for kind in header.kinds_wanted if kind in source.maps]
    spans, grid = header.spans, (header.frame_rate_hz, header.length)
    return {
        "subject": source.subject,
        "recording": source.recording,
        "placement": source.placement,
        "fingerprint": fingerprint,
        "frames": len(source.times_s),
        "frames_with_person": int(source.present.sum()),
        "frame_rate_hz": round(next(iter(source.maps.values())).timebase.frames_per_s, 3),
        "labels": list(source.labels),
        "classes": dict(source.classes),
        "units": {kind: source.maps[kind].unit for kind in kinds},
        "sensor": source.sensor.as_dict(),
        "seen_from": None
        if source.target_m is None
        else {"range_m": range_m, "azimuth_deg": azimuth_deg, "elevation_deg": elevation_deg},
        "provenance": source.made_of(),
        **({} if spans is None else {"spans": count_spans(source.outline(), *grid, spans)}),
    }


def refuse_other_settings(out: Path, header: Header, options: Exporting) -> None:
    """Refuse to go on with a data set that was begun with other options."""
    for what, before, now in (
        ("segments of", header.length, options.segment_frames),
        ("an overlap of", header.overlap, options.overlap_frames),
        ("kinds", list(header.kinds_wanted), list(options.kinds)),
        ("limb maps", bool(header.parts), options.limbs),
        ("kinematics", bool(header.joints), options.limbs),
        ("inertial sensors at", list(header.imu), list(options.imu)),
        ("frames/s", header.frame_rate_hz, options.frame_rate_hz),
        ("null bins", header.null_bins, options.null_bins),
        ("the label rule", header.label_rule, options.label_rule),
        ("the least share", header.min_share, options.min_share),
        ("the least purity", header.min_purity, options.min_purity),
        ("spans as", header.spans or "windows", options.spans or "windows"),
    ):
        if now is not None:
            refuse_change(out, before, now, what, "write another data set")
