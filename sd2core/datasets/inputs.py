"""What is exported: recordings, pairs and maps, sorted by what they are."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from sd2core.datasets.map_sources import map_source
from sd2core.datasets.pair_sources import pair_sources
from sd2core.datasets.recording_sources import Making, recording_sources
from sd2core.datasets.source import LazySource
from sd2core.errors import Sd2Error
from sd2core.io.kinds import kind_of
from sd2core.io.radar import holds_map
from sd2core.recording.recording import SUFFIX, is_recording

_EXPECTED = "recordings (.sd2), pairs (.zarr), Doppler maps (.npz), or folders of recordings"


def gather(
    paths: Sequence[Path],
    making: Making,
    *,
    subjects: Sequence[str] | None = None,
    label_files: Sequence[Path] = (),
) -> list[LazySource]:
    """Sources of all that is named, in its order.

    Parameters
    ----------
    paths : sequence of Path
        Recordings, folders of recordings, pairs, Doppler maps.
    making : Making
    subjects : sequence of str, optional
        Who each recording and each map is of, in their order; by default everyone's is of
        another person, who is called as it is. Pairs say it themselves.
    label_files : sequence of Path
        One for each map (``.npz``), or none.

    Raises
    ------
    Sd2Error
        When a path is something else, or their numbers do not fit.
    """
    files = [one for path in paths for one in _expanded(Path(path))]
    pairs = [path for path in files if not is_recording(path) and kind_of(path) == "pairs"]
    single = [path for path in files if path not in pairs]
    names = [path.stem for path in single] if subjects is None else list(subjects)
    if len(names) != len(single):
        raise Sd2Error(
            f"{len(names)} people are named for {len(single)} recordings and maps",
            "one for each, in their order",
        )
    maps = [path for path in single if not is_recording(path)]
    if label_files and len(label_files) != len(maps):
        raise Sd2Error(
            f"{len(label_files)} label files are given for {len(maps)} maps", "one for each map"
        )
    labelled = dict(zip(maps, label_files, strict=False))
    found = pair_sources(pairs, making.kinds, making.model) if pairs else []
    recordings = [(path, name) for path, name in zip(single, names, strict=True)
                  if is_recording(path)]  # fmt: skip
    found += recording_sources(
        [path for path, _ in recordings], [name for _, name in recordings], making
    )
    for path, name in zip(single, names, strict=True):
        if path in maps:
            found.append(map_source(path, name, labelled.get(path)))
    return found


def recordings_of(paths: Sequence[Path]) -> list[Path]:
    """The recordings among inputs and in folders of them.

    Raises
    ------
    Sd2Error
        When a path is nothing that can be exported.
    """
    return [one for path in paths for one in _expanded(Path(path)) if is_recording(one)]


def recordings_in(folder: Path) -> list[Path]:
    """Recordings right in a folder, by name."""
    return sorted(path for path in folder.glob(f"*{SUFFIX}") if is_recording(path))


def _expanded(path: Path) -> list[Path]:
    """The path, or the recordings in it where it is a folder of them."""
    if is_recording(path):
        return [path]
    if path.is_dir():
        inside = recordings_in(path)
        if inside:
            return inside
    kind = kind_of(path)
    if kind in ("pairs", "map") or (kind == "radar" and holds_map(path)):
        return [path]
    raise Sd2Error(f"{path} is of kind {kind}", _EXPECTED)
