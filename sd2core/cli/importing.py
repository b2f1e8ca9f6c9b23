"""``sd2 import`` and ``sd2 relink``: recordings from files."""

from __future__ import annotations

import argparse
import shutil
from pathlib import Path

from sd2core.cli.command_parser import add_command
from sd2core.cli.options import finite_float, flag, given
from sd2core.cli.output import picked, print_json, progress_bar
from sd2core.errors import Sd2Error


def add_commands(commands: argparse._SubParsersAction) -> None:
    """Add ``import`` and ``relink``."""
    parser = add_command(commands, "import", handler=_import)
    parser.add_output("NAME.sd2", "the recording to make")
    parser.add_value("--video", Path, "FILE", "video of the person")
    text = "body mesh fitted to the video (.npz, .zarr, a folder of .obj/.ply/.glb, or the"
    text += " output of VIBE, WHAM or 4D-Humans)"
    parser.add_value("--mesh", Path, "FILE", text)
    parser.add_mesh_reading()
    parser.add_value("--radar", Path, "CAPTURE", "radar capture of the same scene")
    text = "time in the video, in seconds, of the first radar frame"
    parser.add_value("--radar-offset-s", finite_float, "S", text, 0.0)
    parser.add_channel()
    parser.add_value("--imu", Path, "FILE", "samples of an inertial sensor (.csv, .sto, .npz)")
    text = "time in the video, in seconds, of their first sample"
    parser.add_value("--imu-offset-s", finite_float, "S", text, 0.0)
    parser.add_value("--title", str, "TEXT", "what to call it (default: its name)", "")
    parser.add_flag("--copy", "copy the files into the recording")
    parser.add_json()

    parser = add_command(commands, "relink", handler=_relink)
    parser.add_value("recording", Path, "RECORDING", "a recording (.sd2)")
    parser.add_value("folder", Path, "FOLDER", "where to look, and in all folders below")
    parser.add_json()


def copy_sample(out: Path) -> None:
    """Write a copy of the bundled sample recording, with the true body of its person."""
    from sd2core.files.resources import resource_path
    from sd2core.recording.recording import open_recording

    sample = resource_path("swipes.sd2")
    copy = open_recording(sample).save_as(out, copy=True)
    shutil.copytree(sample / "mesh.zarr", copy.folder / "mesh.zarr")
    print(f"Wrote {copy.folder}")


def _import(options: argparse.Namespace) -> None:
    """Make a recording from a video, a mesh and a radar capture.

    A recording is a folder NAME.sd2 that says what belongs together. The files stay
    where they are and are referred to by relative paths; --copy copies them into
    the folder, which can then be handed on as it is. Every file is opened once, so
    that what cannot be read is said here and not later.

      sd2 import --video walk.mkv --mesh walk.npz --out walk.sd2
      sd2 import --radar capture/ --title 'Empty lab' --out lab.sd2
      sd2 import --radar capture/ --receiver 2 --out lab.sd2
      sd2 import --video a.mkv --radar capture/ --radar-offset-s -0.35 --copy --out a.sd2
    """
    from sd2core.cli.info.description import describe_parts, describe_recording, show
    from sd2core.cli.reading import mesh_reading, refuse_unused_mesh_options
    from sd2core.recording.recording import Recording

    # The window lays any mesh over the video by its focal length.
    refuse_unused_mesh_options(options, options.out, options.mesh, but=("focal_px",))
    recording = Recording(
        options.out,
        mesh_reading=mesh_reading(options),
        radar_receiver=options.receiver,
        radar_transmitter=options.transmitter,
        **picked(options, "video", "mesh", "faces", "radar", "imu", "title"),
        **picked(options, "radar_offset_s", "imu_offset_s"),
    )
    chosen = given(options, ("receiver", "transmitter"))
    if chosen and (recording.radar is None or recording.holds_radar_map):
        name = flag(next(iter(chosen)))
        raise Sd2Error(f"{name} is given without raw samples", f"{name} with --radar CAPTURE")
    recording.learn_camera()
    # Opens every file, so that nothing is made of what cannot be read.
    parts = describe_parts(recording)
    with progress_bar("Copying", unit="file") as progress:
        recording = recording.save_as(options.out, copy=options.copy, progress=progress)
    if options.copy:
        parts = describe_parts(recording)
    show(describe_recording(recording, parts), as_json=options.json)


def _relink(options: argparse.Namespace) -> int:
    """Find the missing files of a recording in another folder.

    Files that are not where the recording says are looked for by name in FOLDER and
    everything below it. Of several files with the same name, the one whose folders
    agree best with the old path is taken; when two agree equally well, neither is.

      sd2 relink walk.sd2 /media/disk/experiments
    """
    from sd2core.recording.recording import open_recording

    recording = open_recording(options.recording)
    with progress_bar("Searching", unit="folder") as progress:
        result = recording.relink(options.folder, progress)
    if options.json:
        print_json(
            {
                "found": {role: str(path) for role, path in result.found.items()},
                "ambiguous": {
                    role: [str(path) for path in paths] for role, paths in result.ambiguous.items()
                },
                "missing": list(result.missing),
            }
        )
    else:
        for role, path in result.found.items():
            print(f"{role}: found at {path}")
        for role, paths in result.ambiguous.items():
            print(f"{role}: several files fit equally well, so none was taken:")
            print(*(f"  {path}" for path in paths), sep="\n")
        for role in result.missing:
            print(f"{role}: {getattr(recording, role).name} is not under {options.folder}")
        if not (result.found or result.ambiguous or result.missing):
            print("No file of this recording is missing.")
    return 1 if result.ambiguous or result.missing else 0
