"""``sd2 pairs``: make pairs of synthetic and radar Doppler to learn from."""

from __future__ import annotations

import argparse
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING

from sd2core.cli.command_parser import Options, add_command
from sd2core.cli.options import bin_list, finite_float, given, position
from sd2core.cli.output import print_facts, print_json, progress_bar

if TYPE_CHECKING:
    from sd2core.mocap.mars_pairs import MarsChoices
    from sd2core.mocap.radar_place import RadarPlace


def add_commands(commands: argparse._SubParsersAction) -> None:
    """Make pairs of synthetic and real Doppler to learn from."""
    parser = add_command(commands, "pairs", about=add_commands)
    kinds = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    _add_mars(kinds)
    _add_recordings(kinds)
    _add_label(kinds)


def _add_recordings(kinds: argparse._SubParsersAction) -> None:
    parser = add_command(kinds, "recordings", handler=_recordings)
    parser.add_value("recordings", Path, "RECORDING", "with a mesh and a radar", nargs="+")
    _add_pairs(parser, "14,15,16 of 32, else none")
    parser.add_count()
    text = "subject of each recording, separated by commas (default: each shows another person)"
    parser.add_value("--subjects", lambda text: tuple(text.split(",")), "LIST", text)


def _add_label(kinds: argparse._SubParsersAction) -> None:
    parser = add_command(kinds, "label", handler=_label)
    parser.add_value("pairs", Path, "PAIRS.zarr", "the pairs to label")
    text = "subject,take,label[,start_s,end_s]: a row for each label; * is any subject or take"
    parser.add_value("--table", Path, "TABLE.csv", text)
    text = "labels of one take, in any format that `sd2 labels convert` reads; several times"
    parser.add_value("--take", str, "SUBJECT/TAKE=FILE", text, [], action="append")
    parser.add_json()


def _label(options: argparse.Namespace) -> None:
    """Put labels on pairs, in place of those that are there.

    A row without times labels a whole take; later rows lie over earlier ones, and frames
    without a label are background. Classifiers, studies and exports use the labels.

      sd2 pairs label mars.zarr --table movements.csv
      sd2 pairs label mine.zarr --take anna/walk-1=anna.eaf
    """
    from sd2core.errors import Sd2Error
    from sd2core.labels.formats import read_labels
    from sd2core.pairs.labelling import TakeLabel, label_pairs, read_take_labels
    from sd2core.pairs.store import read_pairs
    from sd2core.timebase import Timebase

    rows = [] if options.table is None else read_take_labels(options.table)
    clocks = {}
    if options.take:
        takes = read_pairs(options.pairs).takes
        clocks = {f"{take.subject}/{take.name}": Timebase(take.times_s) for take in takes}
    for said in options.take:
        name, sign, file = said.partition("=")
        if not sign:
            raise Sd2Error(f"--take is {said}", "SUBJECT/TAKE=FILE")
        if name not in clocks:
            raise Sd2Error(f"{options.pairs} has no take {name}", f"one of {', '.join(clocks)}")
        subject, _, take = name.rpartition("/")
        rows += [
            TakeLabel(subject, take, span.label, span.start_s, span.end_s)
            for span in read_labels(Path(file), clocks[name]).spans
            if span.origin != "suggestion"
        ]
    if not rows:
        raise Sd2Error("There are no labels to put on pairs", "--table, or --take with a file")
    counts = label_pairs(options.pairs, rows)
    if options.json:
        print_json({"pairs": str(options.pairs), "frames_of_label": counts})
        return
    print_facts(str(options.pairs), {name: f"{count:,} frames" for name, count in counts.items()})


def _add_pairs(parser: Options, usual_null_bins: str) -> None:
    """Add the store of pairs, and the axis and nulled bins of its maps."""
    parser.add_output("FILE.zarr", "the pairs to write", goes_on=True)
    parser.add_axis()
    text = f"bins to set to zero in input and target, e.g. 14,15,16 (default: {usual_null_bins})"
    parser.add_value("--null-bins", bin_list, "LIST", text)
    parser.add_limbs()
    parser.add_json()


def _add_mars(kinds: argparse._SubParsersAction) -> None:
    parser = add_command(kinds, "mars", handler=_mars)
    text = "a person's kinect_data_PART.csv and radar_data_PART.csv"
    parser.add_value("folders", Path, "FOLDER", text, nargs="+")
    _add_pairs(parser, "none")
    text = "which vertices count (default: facing)"
    parser.add_choice("--visibility", ("none", "facing", "depth", "exact"), text)
    parser.add_choice(
        "--weight", ("count", "area", "projected"), "weight of a vertex (default: count)"
    )
    text = "where the radar is beside the Kinect, in metres, right, down and forward (default:"
    text += " estimated; 0,0,0 where only --radar-offset-s is given)"
    parser.add_value("--sensor", position, "X,Y,Z", text)
    text = "what the radar shows at a time is the motion so many seconds later (default:"
    text += " estimated; 0 where only --sensor is given)"
    parser.add_value("--radar-offset-s", finite_float, "S", text)
    text = "target of each frame: shares that add up to 1, or intensities (default: share)"
    parser.add_choice("--target", ("share", "intensity"), text)


def _choices(options: argparse.Namespace) -> MarsChoices:
    from sd2core.cli.reading import chosen_axis
    from sd2core.mocap.mars_pairs import MarsChoices
    from sd2core.mocap.radar_place import RadarPlace

    choices = MarsChoices()
    synthesis = choices.synthesis
    axis = chosen_axis(options, synthesis.axis)
    changes = given(options, ("null_bins", "visibility", "weight"))
    choices = replace(choices, synthesis=replace(synthesis, axis=axis, **changes))
    place = None
    if options.sensor is not None or options.radar_offset_s is not None:
        place = RadarPlace(options.sensor or (0.0, 0.0, 0.0), options.radar_offset_s or 0.0)
    choices = replace(choices, limbs=options.limbs, place=place)
    return replace(choices, target=options.target) if options.target else choices


def _recordings(options: argparse.Namespace) -> None:
    """Pairs from recordings that have a mesh and a radar capture.

    The synthetic Doppler of each recording's mesh is the input, the Doppler of its
    radar capture the target, aligned by the recording's offset. Labels are its spans.

      sd2 pairs recordings anna.sd2 ben.sd2 carla.sd2 --out mine.zarr
      sd2 pairs recordings a1.sd2 a2.sd2 b1.sd2 --subjects anna,anna,ben --out mine.zarr
    """
    from sd2core.cli.reading import chosen_axis
    from sd2core.doppler import PRESETS
    from sd2core.mocap.recording_pairs import make_recording_pairs

    synthesis = PRESETS["paper"]
    axis = chosen_axis(options, synthesis.axis)
    if axis != synthesis.axis:
        # What is nulled by default are bins of the paper's axis.
        synthesis = replace(synthesis, axis=axis, null_bins=())
    synthesis = replace(synthesis, **given(options, ("null_bins", "count")))
    with progress_bar("Making pairs", "step") as progress:
        made = make_recording_pairs(
            options.recordings,
            options.out,
            synthesis,
            subjects=options.subjects,
            limbs=options.limbs,
            progress=progress,
        )
    if options.json:
        subjects = {
            name: {"takes": takes, "frames": frames}
            for name, (takes, frames) in made.subjects.items()
        }
        print_json({"pairs": str(options.out), "subjects": subjects, "left_out_s": made.left_out_s})
        return
    facts = {
        name: f"{takes} takes, {frames:,} frames" for name, (takes, frames) in made.subjects.items()
    }
    if made.left_out_s > 0:
        facts["left out"] = f"{made.left_out_s:.1f} s without a person or a radar frame"
    print_facts(str(options.out), facts)


def _mars(options: argparse.Namespace) -> None:
    """Pairs from MARS recordings: a Kinect skeleton and a radar's points.

    A body of the person's size moves as the Kinect saw it; its synthetic Doppler is
    the input, the Doppler of the radar's points the target. Persons are the subjects.
    Where the radar stands beside the Kinect, and how its clock lies, is found by what
    makes the mean velocities of both agree best, for each person.

    It can be stopped at any moment; the same command resumes it.

      sd2 pairs mars mars_subject1 mars_subject4 --out mars.zarr
      sd2 pairs mars mars_subject1 --out nulled.zarr --null-bins 14,15,16
    """
    from sd2core.mocap.mars_pairs import make_mars_pairs

    with progress_bar("Making pairs") as progress:
        made = make_mars_pairs(options.folders, options.out, _choices(options), progress)
    if options.json:
        print_json(
            {
                "pairs": str(options.out),
                "kind": "real",
                "subjects": {
                    subject: {
                        "takes": takes,
                        "frames": frames,
                        "stature_m": made.stature_m.get(subject),
                        "residual_m": made.residual_m.get(subject),
                        "radar": asdict(made.places[subject]) if subject in made.places else None,
                    }
                    for subject, (takes, frames) in made.subjects.items()
                },
            }
        )
        return
    facts = {"radar": "real"}
    for subject, (takes, frames) in made.subjects.items():
        line = f"{takes} takes, {frames:,} frames"
        if subject in made.stature_m:
            line += (
                f"; a body of {made.stature_m[subject]:.2f} m, its joints"
                f" {100 * made.residual_m[subject]:.1f} cm from the skeleton's;"
                f" {_place_words(made.places[subject])}"
            )
        facts[subject] = line
    print_facts(str(options.out), facts)


def _place_words(place: RadarPlace) -> str:
    """Where the radar stands, and whether that was found."""
    right, down, forward = place.position_m
    words = (
        f"the radar {right:+.2f} m right, {down:+.2f} m down and {forward:+.2f} m before the"
        f" Kinect, its clock {1e3 * place.offset_s:+.0f} ms"
    )
    if place.correlation is None:
        return f"{words} (given)"
    return (
        f"{words} (estimated: mean velocities correlate with {place.correlation:.2f} instead of"
        f" {place.correlation_before:.2f})"
    )
