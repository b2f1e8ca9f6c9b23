"""``sd2 labels cut``: a folder per labelled span with its video, mesh and maps."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from sd2core.cli.labels.reading import labels_at, recording_clock
from sd2core.cli.options import add_command, add_json
from sd2core.cli.output import counted, print_json, progress_bar
from sd2core.cli.recording_maps import add_labelled_recording, chosen_maps, maps_of
from sd2core.errors import Sd2Error

if TYPE_CHECKING:
    from sd2core.cutouts.source import CutSource
    from sd2core.recording.recording import Recording
    from sd2core.timebase import Timebase

_PARTS = "video,mesh,maps"


def add_cut(kinds: argparse._SubParsersAction) -> None:
    """Add ``cut``."""
    parser = add_command(
        kinds,
        "cut",
        "cut labelled spans out: video, mesh and maps of each",
        handler=_cut,
        description=(
            "Makes a folder per span with video.mp4 (its very frames, encoded again), mesh.zarr,\n"
            "a map file each, and span.json; index.csv and index.json list them all. In each\n"
            "folder 0 s is the span's first frame. Folders that are there already and the same\n"
            "are kept; a folder has its name only once it is complete. Suggestions that were not\n"
            "accepted are left out."
        ),
        examples=(
            "  sd2 labels cut walk.sd2 --out cuts\n"
            "  sd2 labels cut walk.sd2 --out swipes --label up-to-down --label down-to-up"
            " --parts video,maps"
        ),
    )
    add_labelled_recording(parser)
    parser.add_argument(
        "--out", type=Path, required=True, metavar="FOLDER", help="folder, made if missing"
    )
    parser.add_argument(
        "--label", action="append", metavar="NAME", help="only spans with this label; may be given"
        " several times",
    )  # fmt: skip
    parser.add_argument(
        "--parts", default=_PARTS, metavar="LIST", help=f"some of {_PARTS} (default: all)"
    )
    parser.add_argument(
        "--replace", action="store_true", help="replace folders that hold something else"
    )
    add_json(parser)


def _cut(options: argparse.Namespace) -> None:
    from sd2core.cutouts.cutting import cut_out, plan_cuts
    from sd2core.recording.recording import open_recording

    recording = open_recording(options.recording)
    clock = recording_clock(recording)
    labels = labels_at(options.labels or options.recording, clock)
    wanted = options.label
    spans = [
        span
        for span in labels.spans
        if span.origin != "suggestion" and (wanted is None or span.label in wanted)
    ]
    if not spans:
        there = ", ".join(sorted({span.label for span in labels.spans})) or "nothing"
        raise Sd2Error(
            f"{options.labels or options.recording} has no span to cut out", f"one of {there}"
        )
    source = _source(options, recording, clock)
    cuts = plan_cuts(source, spans, options.out)
    others = [cut for cut in cuts if cut.state == "other"]
    if others and not options.replace:
        raise Sd2Error(
            f"{counted(len(others), 'folder')} in {options.out} hold something else, such as"
            f" {others[0].path.name}",
            "folders of these very spans, or none",
            "Choose another folder, or say --replace",
        )
    with progress_bar("Cutting") as progress:
        written = cut_out(
            source, cuts, options.out, replace_others=options.replace, progress=progress
        )
    if options.json:
        print_json(
            {
                "folder": str(options.out),
                "written": [path.name for path in written],
                "same": [cut.path.name for cut in cuts if cut.state == "same"],
            }
        )
        return
    same = len(cuts) - len(written)
    print(
        f"{options.out}: {counted(len(written), 'span')} cut out"
        + (f", {same} were there already" if same else "")
    )


def _source(options: argparse.Namespace, recording: Recording, clock: Timebase) -> CutSource:
    from sd2core.cutouts.source import PARTS, CutSource
    from sd2core.sensor import VelocityAxis

    parts = options.parts.replace(" ", "").split(",")
    if not {*parts} <= {*PARTS}:
        raise Sd2Error(f"The parts are {options.parts!r}", f"some of {_PARTS}")
    mesh = None
    names = chosen_maps(options, recording)
    if recording.mesh is not None and ("mesh" in parts or "maps" in parts):
        with progress_bar("Reading the mesh") as progress:
            mesh = recording.load_mesh(progress)
    return CutSource(
        recording.title,
        recording.simulated,
        clock,
        recording.video if "video" in parts else None,
        mesh if "mesh" in parts else None,
        {str(name): one for name, one in maps_of(recording, names, mesh, VelocityAxis()).items()}
        if "maps" in parts
        else {},
        recording.sensor.position_m,
    )
