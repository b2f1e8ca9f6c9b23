"""``sd2 radar describe``: a description of radar samples of one's own, from options and answers."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from sd2core.cli.command_parser import Options
from sd2core.cli.options import finite_float, flag, positive_float, positive_int
from sd2core.errors import Sd2Error


class _Entry(NamedTuple):
    """Entry of a description that is an option, and perhaps a question."""

    parse: Callable[[str], Any]
    meaning: str
    metavar: str


_ENTRIES = {
    "axes": _Entry(
        lambda text: tuple(part.strip() for part in text.split(",")),
        "names of the array's dimensions: frame, transmitter, receiver, chirp, sample, iq; or"
        " stream (default: frame,chirp,sample, with receivers and transmitters after the frames)",
        "LIST",
    ),
    "carrier_hz": _Entry(positive_float, "centre frequency of the samples of a chirp", "HZ"),
    "bandwidth_hz": _Entry(
        finite_float, "frequencies that the samples of a chirp cover; 0 for a continuous wave", "HZ"
    ),
    "slope_hz_per_s": _Entry(
        finite_float, "slope of a chirp, in place of the bandwidth", "HZ_PER_S"
    ),
    "sample_rate_hz": _Entry(positive_float, "samples per second within a chirp", "HZ"),
    "chirp_repetition_s": _Entry(
        positive_float, "time between chirps of the same transmitter, in seconds", "S"
    ),
    "frame_repetition_s": _Entry(positive_float, "time between frames, in seconds", "S"),
    "sign": _Entry(
        int, "1 where the phase grows with the distance, -1 where it falls (default: 1)", "SIGN"
    ),
    "zero": _Entry(finite_float, "value that is no signal, such as 2048 (default: 0)", "VALUE"),
    "full_scale": _Entry(positive_float, "value above zero that fills the converter", "VALUE"),
    "samples_per_chirp": _Entry(positive_int, "of a stream: samples that make a chirp", "N"),
    "chirps_per_frame": _Entry(positive_int, "of a stream: chirps that make a frame", "N"),
    "range_start_m": _Entry(
        finite_float, "distance of the first sample, if samples are distances", "M"
    ),
    "range_step_m": _Entry(positive_float, "distance between samples, likewise", "M"),
    "dataset": _Entry(str, "dataset of an HDF5 file of several", "NAME"),
    "name": _Entry(str, "name of the radar on screen", "NAME"),
}


def add_description(parser: Options) -> None:
    """Add the entries of a description."""
    group = parser.add_argument_group("description", "after the word describe; all in SI units")
    for name, entry in _ENTRIES.items():
        group.add_value(flag(name), entry.parse, entry.metavar, entry.meaning)


def refuse_description(options: argparse.Namespace) -> None:
    """Raise Sd2Error for entries of a description where none is written."""
    for name in _ENTRIES:
        if getattr(options, name) is not None:
            raise Sd2Error(
                f"{flag(name)} is given", f"{flag(name)} after `sd2 radar describe FILE` only"
            )


def describe(options: argparse.Namespace) -> None:
    """Write a description, once the capture opens with it, and describe the capture."""
    from sd2core.cli.info.description import describe_capture, show
    from sd2core.files.texts import faults_in
    from sd2core.io.radar.described import (
        RadarDescription,
        capture_of,
        is_describable,
        plain_axes,
        write_description,
    )

    path = options.file
    if not is_describable(path):
        raise Sd2Error(f"{path} cannot be described", "a .npy, .h5 or .sigmf-meta of radar samples")
    told = {name: getattr(options, name) for name in _ENTRIES}
    told = {name: value for name, value in told.items() if value is not None}
    told = _told_by_sigmf(path) | told
    told.setdefault("axes", plain_axes(path, told.get("dataset")))
    _ask(told)
    with faults_in(f"The description of {path}", "all that its radar needs"):
        description = RadarDescription.model_validate(told)
    capture = capture_of(path, description)
    written = write_description(description, path)
    shown = describe_capture(path, capture)
    shown.facts["description"] = str(written)
    shown.data["description"] = str(written)
    show(shown, as_json=options.json)


def _told_by_sigmf(path: Path) -> dict[str, Any]:
    from sd2core.io.radar.sigmf import DATA, META, read_sigmf_meta

    if path.suffix.lower() not in (META, DATA):
        return {}
    meta = read_sigmf_meta(path)
    told = {"carrier_hz": meta.carrier_hz, "sample_rate_hz": meta.sample_rate_hz}
    return {name: value for name, value in told.items() if value is not None}


def _ask(told: dict[str, Any]) -> None:
    """Ask on a terminal for entries that are missing; Sd2Error elsewhere."""
    needed = ["carrier_hz"]
    if "slope_hz_per_s" not in told:
        needed.append("bandwidth_hz")
    if "stream" in told["axes"]:
        needed += ["sample_rate_hz", "samples_per_chirp", "chirps_per_frame"]
    else:
        needed += ["chirp_repetition_s", "frame_repetition_s"]
    for name in needed:
        _ask_for(name, told)
    # Known only now: a continuous wave has no rate within a chirp.
    if told.get("bandwidth_hz") != 0 and "range_step_m" not in told:
        _ask_for("sample_rate_hz", told)


def _ask_for(name: str, told: dict[str, Any]) -> None:
    if name in told:
        return
    entry = _ENTRIES[name]
    if not sys.stdin.isatty():
        raise Sd2Error(
            f"{flag(name)} is missing: {entry.meaning}", "it as an option, or a terminal to ask on"
        )
    while name not in told:
        print(f"{name} ({entry.meaning}): ", end="", file=sys.stderr, flush=True)
        answer = sys.stdin.readline()
        if not answer:
            raise Sd2Error(f"{name} was not answered", entry.meaning)
        try:
            told[name] = entry.parse(answer.strip())
        except (ValueError, argparse.ArgumentTypeError) as error:
            print(f"  {error}", file=sys.stderr)
