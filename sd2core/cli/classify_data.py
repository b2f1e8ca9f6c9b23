"""What ``sd2 classify`` learns from and is judged on: pairs, recordings, files of a radar."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from sd2core.cli.recording_maps import MAP_NAMES, MapName, maps_of, parsed_maps, usual_maps
from sd2core.errors import Sd2Error

if TYPE_CHECKING:
    from sd2core.classify.data import ClipSet
    from sd2core.denoise.live import TrainedDenoiser
    from sd2core.spectrum import MapKind

DATA_HELP = (
    "DATA is one or several of: a store of pairs (`sd2 simulate campaign`, `sd2 pairs`), a\n"
    "recording (.sd2) with labels, a labelled radar file (.h5 of a K60168A), or a folder of\n"
    "recordings or radar files. A recording is taken for a person of its own; who it is can be\n"
    "said as PERSON=PATH. Radar files without a person are taken for one and the same person.\n"
    "The four swipes count as horizontal and vertical, other labels by the class that the label\n"
    "set gives them; frames of a labelled recording without a label are background."
)

_ONE = "one person"


class Source(NamedTuple):
    """What one argument names.

    Parameters
    ----------
    path : Path
    subject : str
        Empty where nothing was said.
    """

    path: Path
    subject: str


def source(text: str) -> Source:
    """Parse ``PATH`` or ``PERSON=PATH``."""
    name, sign, path = text.partition("=")
    if sign and name and path and "/" not in name and not Path(text).exists():
        return Source(Path(path), name)
    return Source(Path(text), "")


def add_data(parser: argparse.ArgumentParser) -> None:
    """Add what there is to learn from or to judge on, and which of its maps."""
    add_sources(parser)
    parser.add_argument(
        "--maps",
        default="radar",
        metavar="NAMES",
        help=f"some of {', '.join(MAP_NAMES)}, separated by commas (default: radar)",
    )


def add_sources(parser: argparse.ArgumentParser) -> None:
    """Add what there is to learn from or to judge on, and the denoiser."""
    parser.add_argument(
        "data", nargs="+", type=source, metavar="DATA", help="labelled data, see above"
    )
    parser.add_argument(
        "--denoiser",
        metavar="FILE|NAME",
        help="for denoised maps of pairs (default: the one that comes with SD² Studio)",
    )


def clips_of(
    sources: Sequence[Source],
    maps: Sequence[MapName] | None,
    denoiser: TrainedDenoiser | None = None,
) -> ClipSet:
    """All clips of the sources, as one set.

    Parameters
    ----------
    sources : sequence of Source
    maps : sequence of str, optional
        None: the radar's and, where there are some, synthetic ones.
    denoiser : TrainedDenoiser, optional
        For denoised maps of pairs.

    Raises
    ------
    Sd2Error
        When one cannot be read, holds no labels, or they cannot be mixed.
    """
    from sd2core.classify.data import clips_of_pairs, merged
    from sd2core.io.kinds import kind_of
    from sd2core.train.data import read_mixed

    stores: list[Path] = []
    sets: list[ClipSet] = []
    for one in _unfolded(sources):
        if not one.path.is_dir() or kind_of(one.path) != "pairs":
            sets += _single(one, maps)
        elif one.subject:
            raise Sd2Error(
                f"{one.subject} is named for {one.path}",
                "a person for recordings and radar files only; pairs say whose they are",
            )
        else:
            stores.append(one.path)
    if stores:
        pairs = read_mixed(stores)
        for name in maps or ("synthetic", "radar"):
            kind: MapKind = pairs.kind if name == "radar" else name
            sets.append(clips_of_pairs(pairs, kind, denoiser))
    return merged(sets)


def denoiser_for(maps: Sequence[MapName], name: str | None) -> TrainedDenoiser | None:
    """The denoiser, where one of the maps needs it."""
    from sd2core.denoise.files import DEFAULT_NAME, load_model

    return load_model(name or DEFAULT_NAME) if "denoised" in maps else None


def asked_maps(options: argparse.Namespace) -> tuple[MapName, ...]:
    """What ``--maps`` says."""
    return parsed_maps(options.maps)


def _unfolded(sources: Sequence[Source]) -> list[Source]:
    """Folders of recordings or radar files as what they hold."""
    found: list[Source] = []
    for one in sources:
        if not one.path.exists():
            raise Sd2Error(f"{one.path} does not exist", "labelled data", "Check the path")
        inside = _inside(one.path)
        found += [Source(path, one.subject) for path in inside] if inside else [one]
    return found


def _inside(folder: Path) -> list[Path]:
    from sd2core.io.kinds import RADAR_MAP_SUFFIXES

    if not folder.is_dir() or folder.suffix in (".sd2", ".zarr"):
        return []
    return sorted(
        path
        for path in folder.iterdir()
        if (path.suffix == ".sd2" and path.is_dir()) or path.suffix.lower() in RADAR_MAP_SUFFIXES
    )


def _single(one: Source, maps: Sequence[MapName] | None) -> list[ClipSet]:
    """Of a recording, or of a radar's own file."""
    from sd2core.classify.data import clips_of_map
    from sd2core.io.radar import holds_map, load_recorded_map
    from sd2core.recording import is_recording, open_recording

    if holds_map(one.path):
        if maps is not None and tuple(maps) != ("radar",):
            raise Sd2Error(f"{one.path} holds a radar's map only", "--maps radar")
        recorded = load_recorded_map(one.path)
        return [
            clips_of_map(
                recorded.doppler,
                recorded.labels,
                subject=one.subject or _ONE,
                movement=one.path.stem,
            )
        ]
    if not is_recording(one.path):
        raise Sd2Error(
            f"{one.path} holds nothing with labels to learn from",
            "pairs, a labelled recording, or a labelled radar file",
        )
    from sd2core.cli.label_reading import labels_at
    from sd2core.doppler import PRESETS

    recording, labels = open_recording(one.path), labels_at(one.path)
    # Beside maps of a mesh the radar's is on their axis, so that they can be mixed.
    axis = None if recording.mesh is None else PRESETS["paper"].axis
    if not any(span.origin != "suggestion" for span in labels.spans):
        raise Sd2Error(
            f"{one.path} has no labels",
            "a recording in which gestures are labelled",
            "Label it in the window, or leave it out",
        )
    return [
        clips_of_map(
            doppler, labels, subject=one.subject or recording.title, movement=one.path.stem
        )
        for doppler in maps_of(recording, tuple(maps or usual_maps(recording)), axis=axis).values()
    ]
