"""Data of ``sd2 classify``: data sets, pairs, recordings and radar files."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from sd2core.cli.output import progress_bar, tell_lost
from sd2core.cli.recording_maps import MapName, maps_of
from sd2core.datasets.labelled_source import LabelledSource
from sd2core.errors import Sd2Error
from sd2core.options.kinds import Typed
from sd2core.options.records import ARGUMENTS, OptionRecord

if TYPE_CHECKING:
    from sd2core.classify.data import ClipSet
    from sd2core.denoise.live import TrainedDenoiser
    from sd2core.labels.spans import Labels
    from sd2core.maps import DopplerMap, MapKind
    from sd2core.pairs.store import PairSet
    from sd2core.recording.recording import Recording

DATA_HELP = (
    "DATA is one or several of: a data set (`sd2 export`), a store of pairs (`sd2 simulate\n"
    "campaign`, `sd2 pairs`), a recording (.sd2) with labels, a labelled radar file (.h5 of a\n"
    "K60168A), or a folder of recordings or radar files. Each recording is assumed to show\n"
    "another person, unless named as PERSON=PATH; radar files without a name are assumed to\n"
    "show one and the same person. Labels that name persons are of these, and so are synthetic\n"
    "maps; radar maps show everybody. The four swipes count as horizontal and vertical, other\n"
    "labels by the class that the label set gives them; frames of a labelled recording without\n"
    "a label are background."
)

_WITH_SUBJECTS = ("pairs", "dataset")
_RADARS = ("simulated", "real")


class Sources(OptionRecord):
    """Labelled data.

    Parameters
    ----------
    data : DATA
        labelled data, see above
    denoiser : FILE|NAME
        for denoised maps of pairs (default: the one that comes with SD² Studio)
    """

    data: Annotated[tuple[LabelledSource, ...], ARGUMENTS, Typed(LabelledSource.parsed)]
    denoiser: str | None = None


class SourcesAndMaps(Sources):
    """Labelled data, and which of its maps.

    Parameters
    ----------
    maps : LIST
        some of synthetic, denoised, radar, separated by commas (default: radar)
    """

    maps: str = "radar"


def clips_of(
    sources: Sequence[LabelledSource], maps: Sequence[MapName], denoiser: str | None = None
) -> ClipSet:
    """Return all clips of the sources as one set.

    The denoiser, given by file or name, makes the denoised maps of pairs.
    """
    from sd2core.classify.data import clips_of_pairs, merged
    from sd2core.datasets.labelled import unfolded
    from sd2core.io.kinds import kind_of
    from sd2core.train.data import read_mixed

    stores: list[Path] = []
    sets: list[ClipSet] = []
    for one in unfolded(sources):
        kind = kind_of(one.path)
        if kind not in _WITH_SUBJECTS:
            sets += _single(one, maps, sets[0].frame_rate_hz if sets else None)
        elif one.subject:
            raise Sd2Error(
                f"{one.subject} is named for {one.path}",
                "a person for recordings and radar files only; pairs and data sets say whose"
                " they are",
            )
        elif kind == "dataset":
            sets += _of_dataset(one.path, maps)
        else:
            stores.append(one.path)
    if stores:
        pairs = read_mixed(stores)
        tell_lost(pairs.lost_frames)
        for name in maps:
            wanted: MapKind = pairs.kind if name == "radar" else name
            sets.append(clips_of_pairs(pairs, wanted, _denoiser_of(pairs, wanted, denoiser)))
    return merged(sets)


def _denoiser_of(pairs: PairSet, kind: MapKind, given: str | None) -> TrainedDenoiser | None:
    """Load the denoiser where the maps need it: by default the bundled one for what is there."""
    from sd2core.denoise.files import default_name, load_model

    if kind != "denoised":
        return None
    return load_model(given or default_name(limbs=pairs.has_limbs))


def split_of(
    sources: Sequence[LabelledSource], part: Literal["validation", "test"]
) -> list[str] | None:
    """Return who validates or tests, where all sources are data sets that define it."""
    from sd2core.datasets.reading import open_dataset
    from sd2core.io.kinds import is_dataset

    if not all(is_dataset(one.path) for one in sources):
        return None
    names: list[str] = []
    for one in sources:
        with open_dataset(one.path) as dataset:
            names += dataset.header.splits.get(part, ())
    return list(dict.fromkeys(names)) or None


def _of_dataset(path: Path, maps: Sequence[MapName]) -> list[ClipSet]:
    from sd2core.datasets.clips import clips_of_dataset
    from sd2core.datasets.reading import open_dataset

    with open_dataset(path) as dataset:
        kinds = dataset.header.kinds
        wanted: list[MapKind] = []
        for name in maps:
            matching = [kind for kind in kinds if name == ("radar" if kind in _RADARS else kind)]
            if not matching:
                raise Sd2Error(f"{path} holds no {name} maps", f"one of {', '.join(kinds)}")
            wanted += matching
        return [clips_of_dataset(dataset, kind) for kind in wanted]


def _single(
    one: LabelledSource, maps: Sequence[MapName], frame_rate_hz: float | None
) -> list[ClipSet]:
    """Return the clips of a recording or a radar file, at the frame rate of the first map."""
    from sd2core.classify.data import clips_of_map
    from sd2core.datasets.labelled import clips_of_radar_file, labels_given
    from sd2core.io.radar import holds_map
    from sd2core.recording.recording import is_recording, open_recording

    if holds_map(one.path):
        if tuple(maps) != ("radar",):
            raise Sd2Error(f"{one.path} holds a radar's map only", "--maps radar")
        return [clips_of_radar_file(one, frame_rate_hz)]
    if not is_recording(one.path):
        raise Sd2Error(
            f"{one.path} holds nothing with labels to learn from",
            "pairs, a labelled recording, or a labelled radar file",
        )
    from sd2core.cli.labels.reading import labels_at
    from sd2core.doppler import PRESETS

    recording, labels = open_recording(one.path), labels_at(one.path)
    labels_given(labels, one.path)
    maps_and_labels: Iterable[tuple[str, DopplerMap, Labels]]
    if labels.persons:
        maps_and_labels = _of_persons(recording, one, maps)
    else:
        # Beside maps of a mesh the radar's is on their axis, so that they can be mixed.
        axis = None if recording.mesh is None else PRESETS["paper"].axis
        made = maps_of(recording, tuple(maps), axis=axis)
        maps_and_labels = [(one.subject, doppler, labels) for doppler in made.values()]
    clip_sets: list[ClipSet] = []
    for subject, doppler, own in maps_and_labels:
        rate_hz = clip_sets[0].frame_rate_hz if clip_sets else frame_rate_hz
        clip_sets.append(
            clips_of_map(
                doppler, own, subject=subject, movement=one.path.stem, frame_rate_hz=rate_hz
            )
        )
    return clip_sets


def _of_persons(
    recording: Recording, one: LabelledSource, wanted: Sequence[MapName]
) -> Iterator[tuple[str, DopplerMap, Labels]]:
    """Yield subject, maps and labels of each person whom a recording's labels name."""
    from sd2core.datasets.recording_sources import Making, recording_sources
    from sd2core.options.exporting import KINDS

    kinds = tuple(
        kind for kind in KINDS if kind in wanted or (kind in _RADARS and "radar" in wanted)
    )
    labels, making = recording.effective_labels(), Making(kinds)
    sources = recording_sources([one.path], [one.subject], making)
    for person, lazy in zip(labels.persons, sources, strict=True):
        with progress_bar("Synthesising", unit="") as progress:
            source = lazy.load(progress)
        for doppler in source.maps.values():
            yield source.subject, doppler, labels.of_person(person)
