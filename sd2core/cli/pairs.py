"""``sd2 pairs``: make pairs of synthetic and radar Doppler to learn from."""

from __future__ import annotations

import sys
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from sd2core.cli.command_parser import Subcommands, add_command, command_group
from sd2core.cli.output import Report, counted, progress_bar
from sd2core.errors import Sd2Error
from sd2core.options.bounds import SEED
from sd2core.options.kinds import Bins, Vector, Words
from sd2core.options.records import ARGUMENT, ARGUMENTS, OptionError, OptionRecord, Place, given
from sd2core.options.shared import Axis, Json, Limbs, RadarChoice
from sd2core.options.synthesis import Counting, Visibility, Weight

if TYPE_CHECKING:
    from sd2core.doppler import SynthesisOptions
    from sd2core.mocap.mars_pairs import MarsChoices
    from sd2core.mocap.radar_place import RadarPlace


class MadePairs(Axis, Limbs, Json):
    """The store of pairs, and the axis of its maps.

    Parameters
    ----------
    out : FILE.zarr
        the pairs to write
    """

    out: Path


class Subjects(OptionRecord):
    """People of the recordings.

    Parameters
    ----------
    subjects : LIST
        subject of each recording, separated by commas (default: whom a recording names, or else
        each shows another person)
    """

    subjects: Words | None = None


class Mars(MadePairs):
    """Options of ``sd2 pairs mars``.

    Parameters
    ----------
    folders : FOLDER
        a person's kinect_data_PART.csv and radar_data_PART.csv
    null_bins : LIST
        bins to set to zero in input and target, e.g. 14,15,16 (default: none)
    visibility
        which vertices count (default: facing)
    weight
        weight of a vertex (default: count)
    sensor : X,Y,Z
        where the radar is beside the Kinect, in metres, right, down and forward (default:
        estimated; 0,0,0 where only --radar-offset-s is given)
    radar_offset_s : S
        what the radar shows at a time is the motion so many seconds later (default: estimated;
        0 where only --sensor is given)
    target
        target of each frame: shares that add up to 1, or intensities (default: share)
    """

    folders: Annotated[tuple[Path, ...], ARGUMENTS]
    null_bins: Bins | None = None
    visibility: Visibility | None = None
    weight: Weight | None = None
    sensor: Vector | None = None
    radar_offset_s: float | None = None
    target: Literal["share", "intensity"] | None = None


class Recordings(MadePairs, Counting, Subjects):
    """Options of ``sd2 pairs recordings``.

    Parameters
    ----------
    recordings : RECORDING
        with a mesh and a radar
    null_bins : LIST
        bins to set to zero in input and target, e.g. 14,15,16 (default: 14,15,16 of 32, else
        none)
    """

    recordings: Annotated[tuple[Path, ...], ARGUMENTS]
    null_bins: Bins | None = None


class Label(Json):
    """Options of ``sd2 pairs label``.

    Parameters
    ----------
    pairs : PAIRS.zarr
        the pairs to label
    table : TABLE.csv
        subject,take,label[,start_s,end_s]: a row for each label; * is any subject or take
    take : SUBJECT/TAKE=FILE
        labels of one take, in any format that `sd2 labels convert` reads; several times
    """

    pairs: Annotated[Path, ARGUMENT]
    table: Path | None = None
    take: Annotated[tuple[str, ...], Place(many="again")] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        for text in self.take:
            if "=" not in text:
                raise OptionError(f"--take is {text}", "SUBJECT/TAKE=FILE")


class Vary(MadePairs, Subjects, RadarChoice):
    """Options of ``sd2 pairs vary``.

    Parameters
    ----------
    sources : SOURCE
        recordings with a mesh, or folders of MARS, each with one person's parts
    by
        what is another: the sensor's place (within 25 degrees, 0.8 to 1.25 times as far), the
        shape of the body, or left and right
    null_bins : LIST
        bins to set to zero in input and target, e.g. 14,15,16 (default: 14,15,16 of 32, else
        none; of MARS none)
    seed : N
        seed of all random numbers
    """

    sources: Annotated[tuple[Path, ...], ARGUMENTS]
    by: Literal["places", "shapes", "mirrored"]
    null_bins: Bins | None = None
    seed: Annotated[int, SEED] = 0


@command_group("pairs")
def _commands(kinds: Subcommands) -> None:
    """Make pairs of synthetic and radar Doppler to learn from."""
    add_command(kinds, "mars", options=Mars, handler=_mars)
    add_command(kinds, "recordings", options=Recordings, handler=_recordings)
    add_command(kinds, "label", options=Label, handler=_label)
    add_command(kinds, "vary", options=Vary, handler=_vary)


def _label(options: Label) -> Report:
    """Put labels on pairs, in place of those that are there.

    A row without times labels a whole take; later rows lie over earlier ones, and frames
    without a label are background. Classifiers, studies and exports use the labels.

      sd2 pairs label mars.zarr --table movements.csv
      sd2 pairs label mine.zarr --take anna/walk-1=anna.eaf
    """
    from sd2core.labels.formats import read_label_file
    from sd2core.pairs.labelling import TakeLabel, label_pairs, read_take_labels
    from sd2core.pairs.store import open_takes
    from sd2core.timebase import Timebase

    rows = [] if options.table is None else read_take_labels(options.table)
    clocks = {}
    if options.take:
        facts, arrays = open_takes(options.pairs)
        clocks = {
            f"{take.subject}/{take.name}": Timebase(arrays["times_s"][take.rows])
            for take in facts.takes
        }
    for text in options.take:
        name, _, file = text.partition("=")
        if name not in clocks:
            raise Sd2Error(f"{options.pairs} has no take {name}", f"one of {', '.join(clocks)}")
        subject, _, take = name.rpartition("/")
        reading = read_label_file(Path(file), clocks[name])
        print(f"sd2: {file}: {reading.sentence}", file=sys.stderr)
        rows += [
            TakeLabel(subject, take, span.label, span.start_s, span.end_s, span.person)
            for span in reading.labels.decided
        ]
    if not rows:
        raise Sd2Error("There are no labels to put on pairs", "--table, or --take with a file")
    counts = label_pairs(options.pairs, rows)
    data = {"pairs": str(options.pairs), "frames_of_label": counts}
    frames = {name: counted(count, "frame") for name, count in counts.items()}
    return Report(str(options.pairs), data, frames)


def _choices(options: Mars) -> MarsChoices:
    from sd2core.mocap.mars_pairs import MarsChoices
    from sd2core.mocap.radar_place import RadarPlace

    place = None
    if options.sensor is not None or options.radar_offset_s is not None:
        place = RadarPlace(options.sensor or (0.0, 0.0, 0.0), options.radar_offset_s or 0.0)
    choices = MarsChoices(_mars_synthesis(options), limbs=options.limbs, place=place)
    return replace(choices, target=options.target) if options.target else choices


def _mars_synthesis(options: MadePairs) -> SynthesisOptions:
    from sd2core.cli.reading import chosen_axis
    from sd2core.mocap.mars_pairs import MarsChoices

    synthesis = MarsChoices().synthesis
    axis = chosen_axis(options, synthesis.axis)
    return replace(synthesis, axis=axis, **given(options, ("null_bins", "visibility", "weight")))


def _recordings(options: Recordings) -> Report:
    """Pairs from recordings that have a mesh and a radar capture.

    The synthetic Doppler of each recording's mesh is the input, the Doppler of its
    radar capture the target, aligned by the recording's offset. Labels are its spans. In
    a scene of several both show everybody; where two are labelled differently, neither counts.

      sd2 pairs recordings anna.sd2 ben.sd2 carla.sd2 --out mine.zarr
      sd2 pairs recordings a1.sd2 a2.sd2 b1.sd2 --subjects anna,anna,ben --out mine.zarr
    """
    from sd2core.mocap.recording_pairs import make_recording_pairs

    synthesis = replace(_synthesis(options), **given(options, ("count",)))
    with progress_bar("Making pairs", unit="") as progress:
        made = make_recording_pairs(
            options.recordings,
            options.out,
            synthesis,
            subjects=options.subjects,
            limbs=options.limbs,
            progress=progress,
        )
    data = {
        "pairs": str(options.out),
        "subjects": {
            name: {"takes": takes, "frames": frames}
            for name, (takes, frames) in made.subjects.items()
        },
        "left_out_s": made.left_out_s,
        "damaged_frames": made.damaged,
    }
    facts = {
        name: f"{counted(takes, 'take')}, {counted(frames, 'frame')}"
        for name, (takes, frames) in made.subjects.items()
    }
    if made.left_out_s > 0:
        facts["left out"] = f"{made.left_out_s:.1f} s without a person or a radar frame"
    if made.damaged:
        facts["damaged"] = ", ".join(
            f"{counted(count, 'frame')} of {name}, left out" for name, count in made.damaged.items()
        )
    return Report(str(options.out), data, facts)


def _synthesis(options: MadePairs) -> SynthesisOptions:
    """Choose the synthesis of recordings' maps."""
    from sd2core.cli.reading import chosen_axis
    from sd2core.doppler import PRESETS

    synthesis = PRESETS["paper"]
    axis = chosen_axis(options, synthesis.axis)
    if axis != synthesis.axis:
        # What is nulled by default are bins of the paper's axis.
        synthesis = replace(synthesis, axis=axis, null_bins=())
    return replace(synthesis, **given(options, ("null_bins",)))


def _vary(options: Vary) -> Report:
    """Simulated pairs of the same movements as they were not recorded.

    A body moves as in a recording, or as MARS' Kinect saw it, but is seen from another
    place, is of another shape, or moves left for right. The target is what a simulated
    radar sees of it, the input its synthetic Doppler. Bodies of other shape are made of
    meshes of `sd2 fit` alone. In a mirror, labels that say left or right say the other.
    A study adds these pairs where its plan names them as video.

    It can be stopped at any moment; the same command resumes it.

      sd2 pairs vary anna.sd2 ben.sd2 --by places --out elsewhere.zarr
      sd2 pairs vary mars_subject1 mars_subject4 --by shapes --limbs --out shapes.zarr
    """
    from sd2core.io.radar import named_radar
    from sd2core.recording.recording import is_recording
    from sd2core.simulate.variants import VariantOptions, vary_mars, vary_recordings

    recorded = {is_recording(path) for path in options.sources}
    if len(recorded) > 1:
        raise Sd2Error(
            "Some sources are recordings, others not", "recordings, or folders of MARS, at a time"
        )
    synthesis = _synthesis(options) if True in recorded else _mars_synthesis(options)
    chosen = VariantOptions(
        options.by, synthesis, named_radar(options.radar), options.limbs, options.seed
    )
    with progress_bar("Simulating", unit="source") as progress:
        if True in recorded:
            pairs = vary_recordings(
                options.sources, options.out, chosen, subjects=options.subjects, progress=progress
            )
        else:
            pairs = vary_mars(options.sources, options.out, chosen, progress)
    counts = {name: len(pairs.of([name]).takes) for name in pairs.subjects}
    data = {"pairs": str(options.out), "simulated": True, "takes_of_subject": counts}
    facts = {name: counted(takes, "take") for name, takes in counts.items()}
    return Report(str(options.out), data, {"radar": "simulated"} | facts)


def _mars(options: Mars) -> Report:
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
    subjects = {subject: asdict(one) for subject, one in made.items()}
    facts = {"radar": "real"}
    for subject, one in made.items():
        line = f"{counted(one.takes, 'take')}, {counted(one.frames, 'frame')}"
        if one.stature_m is not None and one.residual_m is not None and one.radar is not None:
            line += (
                f"; a body of {one.stature_m:.2f} m, its joints"
                f" {100 * one.residual_m:.1f} cm from the skeleton's; {_place_words(one.radar)}"
            )
        facts[subject] = line
    data = {"pairs": str(options.out), "kind": "real", "subjects": subjects}
    return Report(str(options.out), data, facts)


def _place_words(place: RadarPlace) -> str:
    """Place of the radar in words, and if it was found."""
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
