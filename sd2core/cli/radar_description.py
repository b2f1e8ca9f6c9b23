"""``sd2 radar describe``: a description of radar samples of one's own, from options and answers."""

from __future__ import annotations

import argparse
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

from sd2core.cli.output import Report
from sd2core.errors import Sd2Error
from sd2core.options.kinds import Count, Positive, Words
from sd2core.options.records import Group, OptionRecord, given, options_of


class Description(OptionRecord):
    """Entries of a description of radar samples, or of a table of points.

    Parameters
    ----------
    axes : LIST
        names of the array's dimensions: frame, transmitter, receiver, chirp, sample, iq; without
        frame the chirps have no gaps; or stream (default: frame,chirp,sample, with receivers and
        transmitters after the frames; none for a .mat)
    carrier_hz : HZ
        centre frequency of the samples of a chirp
    bandwidth_hz : HZ
        frequencies that the samples of a chirp cover; 0 for a continuous wave
    slope_hz_per_s : HZ_PER_S
        slope of a chirp, in place of the bandwidth
    sample_rate_hz : HZ
        samples per second within a chirp
    chirp_repetition_s : S
        time between chirps of the same transmitter, in seconds
    frame_repetition_s : S
        time between frames, in seconds
    sign : SIGN
        1 where the phase grows with the distance, -1 where it falls (default: 1)
    zero : VALUE
        value that is no signal, such as 2048 (default: 0)
    full_scale : VALUE
        value above zero that fills the converter
    samples_per_chirp : N
        of a stream: samples that make a chirp
    chirps_per_frame : N
        of a stream, or of chirps without gaps: chirps that make a frame
    range_start_m : M
        distance of the first sample, if samples are distances
    range_step_m : M
        distance between samples, likewise
    dataset : NAME
        array of an HDF5 or MATLAB file of several
    name : NAME
        name of the radar on screen
    columns : LIST
        of a table of points: names of its columns in order, of frame, time, x, y, z, range,
        doppler, intensity, and - for others; with --frame-repetition-s and --sign (1: a positive
        velocity recedes)
    """

    GROUP = Group("description", "after the word describe; all in SI units")

    axes: Words | None = None
    carrier_hz: Positive | None = None
    bandwidth_hz: float | None = None
    slope_hz_per_s: float | None = None
    sample_rate_hz: Positive | None = None
    chirp_repetition_s: Positive | None = None
    frame_repetition_s: Positive | None = None
    sign: int | None = None
    zero: float | None = None
    full_scale: Positive | None = None
    samples_per_chirp: Count | None = None
    chirps_per_frame: Count | None = None
    range_start_m: float | None = None
    range_step_m: Positive | None = None
    dataset: str | None = None
    name: str | None = None
    columns: Words | None = None


DESCRIPTION = {one.name: one for one in options_of(Description)}


def describe(path: Path, options: Description) -> Report:
    """Write a description, once the capture opens with it, and describe the capture."""
    from sd2core.cli.info.description import describe_capture
    from sd2core.files.texts import faults_in
    from sd2core.io.radar.described import (
        RadarDescription,
        capture_of,
        description_of,
        is_describable,
        plain_axes,
        read_description,
        write_description,
    )
    from sd2core.io.radar.point_tables import TEXT_SUFFIXES
    from sd2core.io.radar.points import COLUMNS_OPTION, holds_unnamed_columns, looks_like_points
    from sd2core.io.radar.stored_arrays import array_names

    entries = given(options, DESCRIPTION)
    of_points = looks_like_points(path) and not entries.keys() & {"axes", "carrier_hz"}
    if "columns" in entries or of_points or path.suffix.lower() in TEXT_SUFFIXES:
        return _describe_points(path, entries)

    if not is_describable(path):
        raise Sd2Error(
            f"{path} cannot be described", "a .npy, .h5, .mat or .sigmf-meta of radar samples"
        )
    if not entries and holds_unnamed_columns(path):
        if not sys.stdin.isatty():
            raise Sd2Error(
                f"{path} may hold points, or samples of a radar",
                f"{COLUMNS_OPTION} for points; --carrier-hz and others for samples",
            )
        prompt = f"{DESCRIPTION['columns'].words}; nothing if these are samples"
        print(f"columns ({prompt}): ", end="", file=sys.stderr, flush=True)
        if answer := sys.stdin.readline().strip():
            entries["columns"] = tuple(one.strip() for one in answer.split(","))
            return _describe_points(path, entries)
    entries = _entries_of_sigmf(path) | entries
    if len(names := array_names(path)) > 1:
        _ask_for("dataset", entries, f" ({', '.join(names[:9])})")
    if "axes" not in entries:
        axes, shape = plain_axes(path, entries.get("dataset"))
        if axes is None:
            _ask_for("axes", entries, f" (the shape is {shape})")
        else:
            entries["axes"] = axes
    _ask(entries)
    with suppress(Sd2Error):  # there is none, or write_description refuses it
        before = read_description(description_of(path))
        entries |= {"simulated": before.simulated, "sampling": before.sampling}
    with faults_in(f"The description of {path}", "all that its radar needs"):
        description = RadarDescription.model_validate(entries)
    capture = capture_of(path, description)
    written = write_description(description, path)
    shown = describe_capture(path, capture)
    shown.facts["description"] = shown.data["description"] = str(written)
    return shown


def _describe_points(path: Path, entries: dict[str, Any]) -> Report:
    from sd2core.cli.info.description import describe_radar
    from sd2core.io.radar.described import write_description
    from sd2core.io.radar.points import (
        column_names,
        described_points,
        points_description,
        read_points,
    )

    foreign = entries.keys() - {"columns", "dataset", "frame_repetition_s", "sign"}
    if foreign:
        raise Sd2Error(
            f"{DESCRIPTION[min(foreign)].flags[0]} is given for a table of points",
            "--columns, --dataset, --frame-repetition-s and --sign",
        )
    if "columns" not in entries and (before := points_description(path)) is not None:
        entries = before.model_dump(exclude_defaults=True) | entries
    if "columns" not in entries:
        try:
            entries["columns"] = column_names(path, entries.get("dataset"))
        except Sd2Error as error:
            if not sys.stdin.isatty():
                raise
            _ask_for("columns", entries, f"; {error.found}")
    description = described_points(path, entries)
    read_points(path, description)
    written = write_description(description, path)
    shown = describe_radar(path)
    shown.facts["description"] = shown.data["description"] = str(written)
    return shown


def _entries_of_sigmf(path: Path) -> dict[str, Any]:
    from sd2core.io.radar.stored_arrays import DATA, META, read_sigmf_meta

    if path.suffix.lower() not in (META, DATA):
        return {}
    meta = read_sigmf_meta(path)
    entries = {"carrier_hz": meta.carrier_hz, "sample_rate_hz": meta.sample_rate_hz}
    return {name: value for name, value in entries.items() if value is not None}


def _ask(entries: dict[str, Any]) -> None:
    """Ask on a terminal for entries that are missing; Sd2Error elsewhere."""
    needed = ["carrier_hz"]
    if "slope_hz_per_s" not in entries:
        needed.append("bandwidth_hz")
    if "stream" in entries["axes"]:
        needed += ["sample_rate_hz", "samples_per_chirp", "chirps_per_frame"]
    elif "frame" not in entries["axes"]:
        needed += ["chirp_repetition_s", "chirps_per_frame"]
    else:
        needed += ["chirp_repetition_s", "frame_repetition_s"]
    if "range_start_m" in entries or "range_step_m" in entries:
        needed += ["range_start_m", "range_step_m"]
    for name in needed:
        _ask_for(name, entries)
    # Known only now: a continuous wave has no rate within a chirp.
    if entries.get("bandwidth_hz") != 0 and "range_step_m" not in entries:
        _ask_for("sample_rate_hz", entries)


def _ask_for(name: str, entries: dict[str, Any], about: str = "") -> None:
    if name in entries:
        return
    entry = DESCRIPTION[name]
    assert entry.read is not None
    if not sys.stdin.isatty():
        missing = f"{entry.flags[0]} is missing: {entry.words}{about}"
        raise Sd2Error(missing, "it as an option, or a terminal to ask on")
    while name not in entries:
        print(f"{name} ({entry.words}){about}: ", end="", file=sys.stderr, flush=True)
        answer = sys.stdin.readline()
        if not answer:
            raise Sd2Error(f"{name} was not answered", entry.words)
        try:
            entries[name] = entry.read(answer.strip())
        except (ValueError, argparse.ArgumentTypeError) as error:
            print(f"  {error}", file=sys.stderr)
