"""``sd2 strip``: a figure of several frames side by side."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from sd2core.cli.command_parser import command
from sd2core.cli.output import picked, progress_bar
from sd2core.files.figure_files import SUFFIXES as FIGURES
from sd2core.options.bounds import STRIP_FRAMES
from sd2core.options.kinds import Count, Positive
from sd2core.options.records import ARGUMENTS, Place
from sd2core.options.shared import MeshReading, Overwrite, Sensor

if TYPE_CHECKING:
    from sd2core.figures.strip_source import StripSource
    from sd2core.recording.recording import Recording

_DEFAULT_COUNT = 8


class Strip(Sensor, MeshReading, Overwrite):
    """Options of ``sd2 strip``.

    Parameters
    ----------
    paths : PATH
        a recording, or a video, a mesh, or both
    out : FILE
        the figure to write (.png, .svg or .pdf)
    frames : LIST
        frames such as 0,15,30, or ranges FROM:TO:STEP such as 0:90:15, TO not included
    count : N
        number of frames (default: 8, spread evenly)
    rows : LIST
        some of video, mesh and overlay (the mesh over the video), in this order (default:
        video,mesh, as far as they are there)
    dots
        draw vertices instead of the surface
    colour
        what the colour of the mesh means
    v_max_mps : MPS
        velocity in m/s at which the colours end
    whole
        show the whole picture, not what is around the body
    columns : N
        pictures side by side; more go below
    """

    paths: Annotated[tuple[Path, ...], ARGUMENTS]
    out: Annotated[Path, Place(endings=FIGURES)]
    frames: Annotated[str | None, Place(one_of="frames")] = None
    count: Annotated[Annotated[int, STRIP_FRAMES] | None, Place(one_of="frames")] = None
    rows: str | None = None
    dots: bool = False
    colour: Literal["velocity", "plain"] = "velocity"
    v_max_mps: Annotated[Positive, Place(("--v-max",))] = 2.0
    whole: bool = False
    columns: Count = 10


@command("strip", Strip)
def _strip(options: Strip) -> None:
    """Draw frames side by side: the video above its mesh.

    Every column is a moment, with its time and frame number. Colours of velocity are
    towards the sensor: red approaches, blue recedes. In SVG and PDF text is text;
    pictures and meshes are pictures in it.

      sd2 strip walk.sd2 --out strip.png
      sd2 strip walk.mkv walk.npz --out strip.svg --frames 20:80:10 --dots
      sd2 strip walk.sd2 --out fit.png --rows overlay --colour plain --count 5
    """
    from sd2core.figures.strip import plot_strip, save_strip
    from sd2core.figures.strip_source import StripOptions, parse_frames, spread_frames

    with ExitStack() as stack:
        source = _source(options, stack)
        rows: Any = options.rows.replace(" ", "").split(",") if options.rows else _rows(source)
        how = StripOptions(
            rows=tuple(rows),
            as_dots=options.dots,
            **picked(options, "colour", "v_max_mps", "whole", "columns"),
        )
        total = len(source.clock)
        if options.frames:
            frames = parse_frames(options.frames, total)
        else:
            frames = spread_frames(options.count or _DEFAULT_COUNT, total)
        with progress_bar("Drawing") as progress:
            figure = plot_strip(source, frames, how, progress)
        save_strip(figure, options.out, source, frames, how)
    print(f"{options.out}: {len(frames)} frames")


def _rows(source: StripSource) -> list[str]:
    parts = {"video": source.video, "mesh": source.mesh}
    return [row for row, part in parts.items() if part is not None]


def _source(options: Strip, stack: ExitStack) -> StripSource:
    from dataclasses import replace

    from sd2core.cli.reading import mesh_of
    from sd2core.errors import Sd2Error
    from sd2core.figures.strip_source import StripSource

    recording = _recording(options)
    recording.learn_camera()
    video = mesh = None
    if recording.video is not None:
        with progress_bar("Reading the video") as progress:
            video = stack.enter_context(recording.open_video(progress))
    if recording.mesh is not None:
        mesh = mesh_of(recording, options)
    if video is None and mesh is None:
        raise Sd2Error(f"{options.paths[0]} has neither video nor mesh", "one of them, or both")
    source = StripSource.of(recording, video, mesh, str(options.paths[0]))
    if options.sensor is not None:
        source = replace(source, sensor=replace(source.sensor, position_m=options.sensor))
    return source


def _recording(options: Strip) -> Recording:
    from sd2core.cli.reading import (
        mesh_reading,
        open_recording_from_options,
        refuse_unused_mesh_options,
    )
    from sd2core.errors import Sd2Error
    from sd2core.io.kinds import kind_of
    from sd2core.recording.recording import Recording

    kinds = {kind_of(path): path for path in options.paths}
    if "recording" in kinds and len(options.paths) == 1:
        return open_recording_from_options(kinds["recording"], options)
    if kinds.keys() - {"video", "mesh"} or len(kinds) < len(options.paths):
        raise Sd2Error(
            f"A strip of {', '.join(map(str, options.paths))}",
            "a recording alone, or a video, a mesh, or one of each",
        )
    mesh = kinds.get("mesh")
    refuse_unused_mesh_options(options, options.paths[0], mesh, but=("focal_px",))
    return Recording(
        Path(),
        video=kinds.get("video"),
        mesh=mesh,
        faces=options.faces,
        mesh_reading=mesh_reading(options),
    )
