"""Radar recordings: one module per maker's format, and radars by name."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from sd2core.errors import Sd2Error
from sd2core.files.hdf5_files import open_hdf5_file
from sd2core.files.limits import check_there
from sd2core.files.paths import as_path
from sd2core.io.kinds import RADAR_MAP_SUFFIXES
from sd2core.io.radar import dca1000
from sd2core.io.radar.acconeer import a111_service, is_acconeer, load_acconeer, refuse_a111
from sd2core.io.radar.capture import RadarCapture
from sd2core.io.radar.described import (
    DATA_NAME,
    description_of,
    is_describable,
    is_described,
    load_described,
    write_described,
)
from sd2core.io.radar.growing import is_growing, load_growing
from sd2core.io.radar.infineon import (
    INFINEON_FILES,
    check_replaceable,
    find_recording,
    load_infineon,
    read_radar_config,
    write_capture,
)
from sd2core.io.radar.judging import judged
from sd2core.io.radar.kkt import RecordedMap, load_kkt
from sd2core.io.radar.point_maps import load_points_map
from sd2core.io.radar.point_tables import TEXT_SUFFIXES
from sd2core.io.radar.points import (
    COLUMNS_OPTION,
    column_names,
    has_columns_told,
    holds_unnamed_columns,
    looks_like_points,
)
from sd2core.io.radar.stored_arrays import DATA, META, array_names
from sd2core.io.readers import RADAR_FILES, FileReader, plug_in_for
from sd2core.plausibility.radar import judge_map
from sd2core.radar_config import RadarConfig
from sd2core.radar_profiles import RADAR_PLUG_INS, RADARS, find_radar
from sd2core.sensor import VelocityAxis

__all__ = [
    "SUPPORTED",
    "RadarCapture",
    "RecordedMap",
    "check_replaceable",
    "companions",
    "holds_map",
    "load_capture",
    "load_recorded_map",
    "named_radar",
    "read_radar_config",
    "without_companions",
    "write_capture",
    "write_described",
]

SUPPORTED = (
    "an Infineon recording: the folder with radar.npy, config.json and radar_timestamp.csv"
    " (or the folder above it, or its radar.npy); an A121's .h5; a DCA1000's .bin with the .cfg or"
    " .json of the radar; what `sd2 listen` wrote; .npy, .h5 or SigMF samples with a description;"
    " or a table of points, .csv, .npy or .mat (docs/radar-files.md)"
)


def load_capture(path: Path | str) -> RadarCapture:
    """Open a raw radar recording; the samples stay on disk.

    Parameters
    ----------
    path : path
        A folder or file of a supported format, see :data:`SUPPORTED`.

    Raises
    ------
    Sd2Error
        When nothing supported is there, or when it is damaged.

    Examples
    --------
    >>> import sd2core as sd2
    >>> from sd2core.files.resources import resource_path
    >>> capture = sd2.load_capture(resource_path("swipes.sd2") / "radar")
    >>> capture.simulated, capture.samples.shape
    (True, (450, 3, 64, 32))
    """
    path = as_path(path).expanduser()
    check_there(path, SUPPORTED)
    for reader in _READERS:
        if reader.fits(path):
            capture = reader.read(path)
            # Of what is simulated and of what it recorded itself the program knows enough.
            own = capture.simulated or reader.read is load_growing
            return capture if own else judged(capture)
    plug_in, faults = plug_in_for(path, RADAR_FILES)
    if plug_in is not None:
        capture = plug_in.use(lambda reader: reader.read(path), RadarCapture)
        if start_s := capture.timebase.start_s:
            expected = "its first frame at 0 s, and when that was as start_unix_s"
            raise Sd2Error(f"{plug_in.words} gives a capture from {start_s:g} s on", expected)
        return capture if capture.simulated else judged(capture)
    holds = sorted(entry.name for entry in path.iterdir())[:6] if path.is_dir() else []
    content = f"; it holds {', '.join(holds) or 'nothing'}" if path.is_dir() else ""
    raise Sd2Error(f"{path} is not a radar recording that can be read{content}", SUPPORTED, faults)


def companions(path: Path) -> list[Path]:
    """Other files that belong to a radar file and lie beside it, as far as they are there."""
    files: list[Path] = []
    if path.is_dir():
        return files
    if is_described(path) or has_columns_told(path):
        files.append(description_of(path))
    if path.suffix.lower() in (META, DATA):
        files += [path.with_suffix(suffix) for suffix in (META, DATA)]
    elif path.suffix.lower() == dca1000.SUFFIX:
        with suppress(Sd2Error):
            files += dca1000.parts_of(path)
            files.append(dca1000.setup_of(path))
    elif path.suffix == ".npy" and not files:
        files += [path.with_name(name) for name in INFINEON_FILES]
    return [one for one in dict.fromkeys(files) if one != path and one.is_file()]


def without_companions(paths: Sequence[Path]) -> list[Path]:
    """Paths without those that only belong to another of them; of several parts, the first.

    Who drops a radar file on the window, or names it on a command line, often takes along what
    lies beside it.
    """
    beside = {path: companions(path) for path in paths}
    return [
        path
        for place, path in enumerate(paths)
        if not any(
            path in beside[other] and (other not in beside[path] or before < place)
            for before, other in enumerate(paths)
        )
    ]


def holds_map(path: Path | str) -> bool:
    """True if a radar recording holds maps: read it by `load_recorded_map`.

    That is so of tables of points, of HDF5 files of a K60168A, and of those that are damaged; a
    file that is not there goes by its name.
    """
    path = Path(path).expanduser()
    if is_described(path):
        return False
    return _maker_of(path) in ("kaikutek", "unknown") or looks_like_points(path)


def _maker_of(path: Path) -> str:
    """Whose HDF5 file it is, "unknown" if that cannot be known, "" if it is another file."""
    if path.suffix.lower() not in RADAR_MAP_SUFFIXES:
        return ""
    try:
        with open_hdf5_file(path, SUPPORTED) as file:
            if is_acconeer(file):
                return "acconeer"
            if a111_service(file, path):
                return "a111"
            return "kaikutek" if "DS1" in file or "LABEL" in file else "other"
    except Exception:  # a damaged file fails in many ways, again where it is read
        return "unknown"


def _refuse_map(path: Path) -> RadarCapture:
    raise Sd2Error(
        f"{path} holds maps of a radar and no raw samples",
        SUPPORTED,
        "Open it in the window, or write its map with `sd2 radar FILE --out map.npz`",
    )


def _holds_dca1000(path: Path) -> bool:
    return path.is_dir() and any(one.suffix.lower() == dca1000.SUFFIX for one in path.iterdir())


def _ask_description(path: Path) -> RadarCapture:
    names = array_names(path)
    held = f"; it holds {', '.join(names[:6])}" if names else ""
    raise Sd2Error(
        f"{path} does not say what radar it is from{held}",
        f"its description, {description_of(path).name}, beside it",
        f"Write it with `sd2 radar describe {path.name}`"
        + (f"; if they are points, with {COLUMNS_OPTION}" if holds_unnamed_columns(path) else ""),
    )


def _ask_columns(path: Path) -> RadarCapture:
    column_names(path)  # refuses it, but for a table of points, which is no capture
    return _refuse_map(path)


_READERS: tuple[FileReader[RadarCapture], ...] = (
    FileReader(load_growing, recognises=is_growing),
    FileReader(load_described, recognises=is_described),
    FileReader(
        lambda path: load_described(path / DATA_NAME),
        recognises=lambda path: is_described(path / DATA_NAME),
    ),
    FileReader(load_acconeer, recognises=lambda path: _maker_of(path) == "acconeer"),
    FileReader(refuse_a111, recognises=lambda path: _maker_of(path) == "a111"),
    FileReader(_refuse_map, recognises=holds_map),
    FileReader(dca1000.load_dca1000, (dca1000.SUFFIX,)),
    FileReader(load_infineon, recognises=lambda path: find_recording(path) is not None),
    FileReader(dca1000.load_dca1000, recognises=_holds_dca1000),
    FileReader(_ask_description, recognises=lambda path: path.is_file() and is_describable(path)),
    FileReader(_ask_columns, TEXT_SUFFIXES),
)
"""Readers of captures; the first that fits is taken, and those of plug-ins after all of them."""


def load_recorded_map(path: Path | str, axis: VelocityAxis | None = None) -> RecordedMap:
    """Open a radar recording that holds a Doppler map, or a table of points, instead of samples.

    ``axis`` is that of the map of points, by default 32 bins over ±2 m/s; other maps have their
    own. Raises Sd2Error if it is none that is known (:mod:`sd2core.io.radar.kkt`,
    :mod:`sd2core.io.radar.points`), or is damaged.
    """
    path = Path(path).expanduser()
    of_points = looks_like_points(path)
    recorded = load_points_map(path, axis) if of_points else load_kkt(path)
    # Without points a frame of such a map is empty.
    findings = judge_map(recorded.doppler.values, recorded.timebase.times_s, measured=not of_points)
    return replace(recorded, notes=(*recorded.notes, *map(str, findings)))


def named_radar(name: str) -> RadarConfig:
    """Radar to simulate, by its name or a file.

    Names are those of :data:`~sd2core.radar_profiles.RADARS` and of plug-ins; a file is a capture's
    ``config.json``, of which one transmitter is simulated. Raises Sd2Error if there is no such
    file, or it describes no possible radar.

    Examples
    --------
    >>> from sd2core.io.radar import named_radar
    >>> named_radar("iwr6843").sampling
    'complex'
    """
    radar = find_radar(name)
    if radar is not None:
        return radar
    path = Path(name)
    if not path.exists() and not path.suffix:
        known = ", ".join([*RADARS, *RADAR_PLUG_INS.names()])
        raise Sd2Error(f"There is no radar {name!r}", f"{known}, or a capture's config.json")
    return replace(read_radar_config(path), transmitters=1)
