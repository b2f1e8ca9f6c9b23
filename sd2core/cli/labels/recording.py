"""``sd2 labels figure`` and ``sd2 labels cut``: a labelled recording drawn, or cut into spans."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from sd2core.cli.command_parser import command
from sd2core.cli.labels.reading import labels_at, recording_clock
from sd2core.cli.output import Report, counted, progress_bar
from sd2core.cli.recording_maps import MapName, maps_of, parsed_maps, usual_maps
from sd2core.errors import Sd2Error
from sd2core.files.figure_files import SUFFIXES as FIGURES
from sd2core.options.records import ARGUMENT, OptionRecord, Place
from sd2core.options.shared import Json, Overwrite

if TYPE_CHECKING:
    from sd2core.cutouts.source import CutSource
    from sd2core.labels.spans import Labels
    from sd2core.maps import DopplerMap
    from sd2core.recording.recording import Recording
    from sd2core.timebase import Timebase


_PARTS = "video,mesh,maps"


class LabelledRecording(OptionRecord):
    """A recording, which of its maps, and labels in place of its own.

    Parameters
    ----------
    recording : RECORDING
        a recording (.sd2)
    maps : LIST
        some of synthetic, denoised, radar (default: those of its mesh and its radar)
    labels : FILE
        other labels than the recording's own
    """

    recording: Annotated[Path, ARGUMENT]
    maps: str | None = None
    labels: Path | None = None


class DrawnLabels(LabelledRecording, Overwrite):
    """Options of ``sd2 labels figure``.

    Parameters
    ----------
    out : FILE
        the figure to write (.png, .svg or .pdf)
    from_s : S
        start of the figure, in seconds
    to_s : S
        end of the figure, in seconds
    """

    out: Annotated[Path, Place(endings=FIGURES)]
    from_s: float | None = None
    to_s: float | None = None


class Cut(LabelledRecording, Json):
    """Options of ``sd2 labels cut``.

    Parameters
    ----------
    out : FOLDER
        where to write a folder for each span
    label : LABEL
        only spans with this label; may be given several times
    parts : LIST
        some of video,mesh,maps (default: all)
    replace_others
        replace folders that hold something else
    """

    out: Path
    label: Annotated[tuple[str, ...], Place(many="again")] = ()
    parts: str = _PARTS
    replace_others: Annotated[bool, Place(("--overwrite", "--replace"))] = False


@command("figure", DrawnLabels)
def _figure(options: DrawnLabels) -> None:
    """Draw the Doppler maps of a recording with its labels.

    Maps one above the other on one time axis, the labels below them with names and a
    hatch for each, and their edges on the maps. 0 dB is the strongest bin of a map.
    Suggestions that were not accepted are not drawn.

      sd2 labels figure walk.sd2 --out walk.pdf
      sd2 labels figure walk.sd2 --out detail.png --maps synthetic,denoised --from-s 2 --to-s 6
    """
    from sd2core.figures.maps import Levels, MapRow, draw_maps, save_maps
    from sd2core.recording.recording import open_recording
    from sd2core.sensor import VelocityAxis
    from sd2core.timebase import common_clock

    recording = open_recording(options.recording)
    clock = recording_clock(recording)
    labels = labels_at(options.labels or options.recording, clock)
    maps = maps_of(recording, _maps(options, recording), axis=VelocityAxis())
    rows = [
        MapRow(doppler, _title(name, doppler), _strongest(doppler))
        for name, doppler in maps.items()
    ]
    shown = common_clock([clock, *(doppler.timebase for doppler in maps.values())])
    figure = draw_maps(
        rows,
        Levels(),
        start_s=shown.start_s if options.from_s is None else options.from_s,
        end_s=shown.end_s if options.to_s is None else options.to_s,
        labels=labels,
        heading=recording.title + (" (simulated)" if recording.simulated else ""),
    )
    about = {
        "recording": recording.title,
        "simulated": recording.simulated,
        "sensor_position_m": list(recording.sensor.position_m),
    }
    save_maps(figure, options.out, rows, about)
    print(f"{options.out}: {', '.join(row.title.lower() for row in rows)}")


def _maps(options: LabelledRecording, recording: Recording) -> tuple[MapName, ...]:
    """Maps of ``--maps``, or the usual ones."""
    return parsed_maps(options.maps) if options.maps else usual_maps(recording)


def _title(name: str, doppler: DopplerMap) -> str:
    if name != "radar":
        return name.capitalize()
    return "Radar (simulated)" if doppler.kind == "simulated" else "Radar"


def _strongest(doppler: DopplerMap) -> float:
    import numpy as np

    values = np.delete(doppler.values, doppler.null_bins, axis=0)
    return float(values.max(initial=0.0)) or 1.0


def _nothing_to_cut(path: Path, labels: Labels, wanted: tuple[str, ...]) -> Sd2Error:
    known = sorted({span.label for span in labels.decided})
    if wanted and known:
        return Sd2Error(
            f"{path} has no span of {' or '.join(wanted)}", f"one of {', '.join(known)}"
        )
    suggested = len(labels.spans) - len(labels.decided)
    return Sd2Error(
        f"{path} has no labelled spans"
        + (f", only {counted(suggested, 'suggestion')}" if suggested else ""),
        "spans to cut out",
        "Mark some in the window (`sd2 open`), accept suggestions there, or name a label file with"
        " --labels",
    )


@command("cut", Cut)
def _cut(options: Cut) -> Report:
    """Cut labelled spans out: video, mesh and maps of each.

    Makes a folder per span with video.mp4 (its very frames, encoded again), mesh.zarr,
    a map file each, and span.json; index.csv and index.json list them all. In each
    folder 0 s is the span's first frame. Folders that are there already and the same
    are kept; a folder has its name only once it is complete. Suggestions that were not
    accepted are left out.

      sd2 labels cut walk.sd2 --out cuts
      sd2 labels cut walk.sd2 --out swipes --label up-to-down --label down-to-up --parts video,maps
    """
    from sd2core.cutouts.cutting import cut_out, plan_cuts, without_frame
    from sd2core.recording.recording import open_recording

    recording = open_recording(options.recording)
    clock = recording_clock(recording)
    labels = labels_at(options.labels or options.recording, clock)
    wanted = options.label
    spans = [span for span in labels.decided if not wanted or span.label in wanted]
    if not spans:
        raise _nothing_to_cut(options.labels or options.recording, labels, wanted)
    source = _source(options, recording, clock)
    cuts = plan_cuts(source, spans, options.out)
    others = [cut for cut in cuts if cut.state == "other"]
    if others and not options.replace_others:
        raise Sd2Error(
            f"{counted(len(others), 'folder')} in {options.out} hold something else, such as"
            f" {others[0].path.name}",
            "folders of these very spans, or none",
            "Choose another folder, or say --overwrite",
        )
    with progress_bar("Cutting") as progress:
        written = cut_out(
            source, cuts, options.out, replace_others=options.replace_others, progress=progress
        )
    same = [cut.path.name for cut in cuts if cut.state == "same"]
    return Report(
        f"{options.out}: {counted(len(written), 'span')} cut out"
        + (f", {len(same)} were there already" if same else "")
        + ("." + left_out if (left_out := without_frame(cuts)) else ""),
        {
            "folder": str(options.out),
            "written": [path.name for path in written],
            "same": same,
            "without_frame": [cut.span.id for cut in cuts if cut.state == "empty"],
        },
    )


def _source(options: Cut, recording: Recording, clock: Timebase) -> CutSource:
    from sd2core.cutouts.source import PARTS, CutSource
    from sd2core.sensor import VelocityAxis
    from sd2core.timebase import common_clock

    parts = options.parts.replace(" ", "").split(",")
    if not {*parts} <= {*PARTS}:
        raise Sd2Error(f"The parts are {options.parts!r}", f"some of {_PARTS}")
    mesh = None
    names = _maps(options, recording)
    if recording.mesh is not None and ("mesh" in parts or "maps" in parts):
        with progress_bar("Reading the mesh") as progress:
            mesh = recording.load_mesh(progress)
    maps = maps_of(recording, names if "maps" in parts else (), mesh, VelocityAxis())
    clocks = [clock, *(one.timebase for one in (mesh, *maps.values()) if one is not None)]
    return CutSource(
        recording.title,
        recording.simulated,
        common_clock(clocks),
        recording.video if "video" in parts else None,
        mesh if "mesh" in parts else None,
        {str(name): one for name, one in maps.items()},
        recording.sensor.position_m,
    )
