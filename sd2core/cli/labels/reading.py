"""Reading and writing of label files named on the command line, and their frame times."""

from __future__ import annotations

import math
import sys
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from sd2core.errors import Sd2Error
from sd2core.options.kinds import Positive
from sd2core.options.records import ARGUMENT, Group, OptionRecord, Place

if TYPE_CHECKING:
    from sd2core.labels.spans import Labels
    from sd2core.recording.recording import Recording
    from sd2core.timebase import Timebase

_MAX_FRAMES = 100_000_000


class FrameTimes(OptionRecord):
    """Source of the times of frames.

    Parameters
    ----------
    recording : RECORDING
        those of a recording
    video : FILE
        those of a video
    mesh : FILE
        those of a mesh
    fps : FPS
        so many per second from 0 s on
    """

    GROUP = Group("frame times", "one of these; a recording brings its own")

    recording: Annotated[Path | None, Place(one_of="clock")] = None
    video: Annotated[Path | None, Place(one_of="clock")] = None
    mesh: Annotated[Path | None, Place(one_of="clock")] = None
    fps: Annotated[Positive | None, Place(one_of="clock")] = None


class LabelReading(FrameTimes):
    """How a file with labels is read.

    Parameters
    ----------
    format : NAME
        the format of FILE: sd2, csv, audacity, elan, textgrid, boris, mne, subtitles,
        label-studio
    observation : NAME
        which one of a BORIS project or a Label Studio export with several
    mark_s : S
        length of marks without a duration; by default the frame that is shown then
    """

    GROUP = Group("label file", "what it may not say about itself")

    format: str | None = None
    observation: str | None = None
    mark_s: Positive | None = None


class LabelFile(LabelReading):
    """A file with labels, and how it is read; see :func:`read_named`.

    Parameters
    ----------
    file : FILE
        the file with labels
    """

    file: Annotated[Path, ARGUMENT]


def read_named(options: LabelFile) -> tuple[Labels, Timebase | None]:
    """Read the labels that are named, and the frame times as far as they are known."""
    clock = clock_of(options, options.file)
    labels = labels_at(options.file, clock, options)
    return labels, with_rate(options, clock, labels)


def labels_at(
    path: Path, timebase: Timebase | None = None, how: LabelReading | None = None
) -> Labels:
    """Read labels of a ``labels.json``, a recording, a radar file or another program's file.

    ``timebase`` has the times of frames, for files that have frames only and for marks without a
    duration. What was taken of another program's file, and what was not, is said on standard
    error. Raises Sd2Error if the file does not exist, or cannot be read.
    """
    from sd2core.io.radar import holds_map, load_recorded_map
    from sd2core.labels.formats import is_own, read_label_file
    from sd2core.recording.recording import is_recording, open_recording

    if not path.exists():
        raise Sd2Error(f"{path} does not exist", "a file with labels", "Check the path")
    how = how or LabelReading()
    if how.format is None and is_recording(path):
        return open_recording(path).effective_labels()
    if how.format is None and holds_map(path):
        return load_recorded_map(path).labels
    reading = read_label_file(
        path,
        timebase,
        how.format,
        observation=how.observation,
        frames_per_s=how.fps,
        mark_s=how.mark_s,
    )
    if reading.beyond or not (how.format == "sd2" or (how.format is None and is_own(path))):
        print(f"sd2: {path}: {reading.sentence}", file=sys.stderr)
    return reading.labels


def clock_of(options: FrameTimes, *sources: Path) -> Timebase | None:
    """Return the frame times of the options, else those of the first source that has some.

    A source is a file with labels: a recording, a radar file, or a ``labels.json`` that
    names its recording or video. None without any.
    """
    from sd2core.io.radar import holds_map, load_recorded_map
    from sd2core.labels import files
    from sd2core.labels.formats import is_own
    from sd2core.recording.recording import is_recording, open_recording

    if options.recording is not None:
        return recording_clock(open_recording(options.recording))
    if options.video is not None:
        return _video_clock(options.video)
    if options.mesh is not None:
        from sd2core.io.mesh import load_mesh

        return load_mesh(options.mesh).timebase
    for path in sources:
        if is_recording(path):
            return recording_clock(open_recording(path))
        if holds_map(path):
            return load_recorded_map(path).timebase
        if path.suffix.lower() == ".json" and path.exists() and is_own(path):
            file = files.read_labels(path)
            if file.recording is not None and file.recording.exists():
                return recording_clock(open_recording(file.recording))
            if file.video is not None and file.video.exists():
                return _video_clock(file.video)
    return None


def media_of(options: FrameTimes, source: Path) -> Path | None:
    """Return the video that labels are of, where it or its recording is named."""
    from sd2core.recording.recording import is_recording, open_recording

    folder = options.recording or source
    if options.video is not None or not is_recording(folder):
        return options.video
    return open_recording(folder).video


def with_rate(options: FrameTimes, timebase: Timebase | None, *labels: Labels) -> Timebase | None:
    """Return the same frame times, or those of ``--fps`` for as long as the labels."""
    from sd2core.timebase import Timebase

    if options.fps is None:
        return timebase
    end_s = max((span.end_s for one in labels for span in one.spans), default=0.0)
    frames = max(math.ceil(end_s * options.fps - 1e-6), 1)
    if frames > _MAX_FRAMES:
        raise Sd2Error(
            f"The labels end at {end_s:g} s; at {options.fps:g} frames/s these are"
            f" {frames:,} frames",
            f"up to {_MAX_FRAMES:,}",
        )
    return Timebase.regular(frames, options.fps)


def needed(timebase: Timebase | None, why: str) -> Timebase:
    """Return the frame times, or raise an error where there are none."""
    if timebase is None:
        raise Sd2Error(
            f"{why} needs the times of frames",
            "--recording, --video, --mesh or --fps",
            "Name the recording that was labelled, or its frame rate",
        )
    return timebase


def recording_clock(recording: Recording) -> Timebase:
    """Return the frame times of a recording: the video's, else the mesh's, and the radar's beyond.

    A radar that cannot be read adds none to those of the others.
    """
    from sd2core.timebase import common_clock

    missing, clocks = recording.missing(), []
    if recording.video is not None and "video" not in missing:
        clocks.append(_video_clock(recording.video))
    elif recording.mesh is not None and "mesh" not in missing:
        clocks.append(recording.load_mesh().timebase)
    if recording.radar is not None and "radar" not in missing:
        with suppress(*([Sd2Error] if clocks else [])):
            radar = recording.load_radar_map() if recording.holds_radar_map else None
            clock = recording.load_capture().timebase if radar is None else radar.timebase
            clocks.append(clock.shifted(recording.radar_offset_s))
    if not clocks:
        raise Sd2Error(
            f"{recording.folder} has no video, mesh or radar capture at hand",
            "one of them, for the times of frames",
            "Give the frame rate with --fps",
        )
    return common_clock(clocks)


def write(
    path: Path,
    labels: Labels,
    timebase: Timebase | None,
    file_format: str | None = None,
    *,
    media: Path | None = None,
    over: str | None = None,
) -> list[str]:
    """Write labels by the file's suffix; return the losses as sentences.

    Parameters
    ----------
    path : Path
        File to write.
    labels : Labels
        What is written.
    timebase : Timebase or None
        Times of frames; None suffices for a ``labels.json``, Sd2Error for other formats.
    file_format : str, optional
        Name of the format; by default by the suffix.
    media : Path, optional
        The video, for formats that link to it.
    over : str, optional
        Digest of the file that they replace, where they were made of it: Sd2Error if it was saved
        meanwhile.
    """
    from sd2core.files.digests import cached_digest
    from sd2core.labels import files
    from sd2core.labels.formats import write_labels

    if over is not None and over != cached_digest(path):
        raise Sd2Error(
            f"{path} was saved by a window or another program while this command ran",
            "the file as it was read",
            "Run the command again",
        )
    if file_format == "sd2" or (file_format is None and path.suffix.lower() == ".json"):
        files.write_labels(path, labels, timebase=timebase, video=media)
        return []
    clock = needed(timebase, str(path))
    return [str(loss) for loss in write_labels(path, labels, clock, file_format, media=media)]


def print_lost(lost: list[str]) -> None:
    """Print the losses that :func:`write` returned."""
    for sentence in lost:
        print(f"  not kept: {sentence}")


def check_label_output(path: Path) -> str:
    """Refuse a file that cannot be written.

    Return the digest of what is there, for :func:`write`; empty without a file.
    """
    from sd2core.cli.output_folders import check_output
    from sd2core.files.digests import cached_digest

    check_output(path, path.suffix.lower())
    return cached_digest(path)


def _video_clock(path: Path) -> Timebase:
    from sd2core.io.video import open_video

    with open_video(path) as video:
        return video.timebase
