"""Raw samples of TI's mmWave radars as the DCA1000 capture card writes them (``.bin``).

Nothing but int16 words, little-endian, in one file or in parts (``NAME_Raw_0.bin``,
``NAME_Raw_1.bin`` …); the configuration of the radar lies beside it. Order of the words after
TI's *Mmwave Radar Device ADC Raw Data Capture* (SWRA581B) and the ``rawDataReader`` of mmWave
Studio, chirp by chirp:

- two lanes of LVDS (xWR16xx, 18xx, 64xx, 68xx): all samples of one receiver after the other;
  complex ones as I0 I1 Q0 Q1 I2 I3 Q2 Q3 …
- four lanes (xWR12xx, xWR14xx): for every sample one value of each receiver; complex ones as
  four I, then their four Q.

With I and Q swapped (``SampleSwap`` of ``adcbufCfg``, ``iqSwapSel``) Q comes first.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.files.limits import check_regular
from sd2core.files.numpy_files import read_words
from sd2core.io.radar.capture import (
    LazySamples,
    RadarCapture,
    by_transmitter,
    sorted_by_transmitter,
)
from sd2core.io.radar.ti_setup import TiSetup, is_studio_json, read_setup
from sd2core.timebase import Timebase

SUFFIX = ".bin"

_EXPECTED = "samples of a DCA1000 (.bin) with the .cfg or .mmwave.json of the radar beside it"
_PART = re.compile(r"(?P<base>.+)_Raw_(?P<number>\d{1,6})", re.IGNORECASE)
_FIRMWARE = (b"MSTR", b"RPRC", b"\x7fELF")
"""First bytes of TI's images for flash (of several cores, of one) and of programs."""
_WORD = np.dtype("<i2")
_JUDGED_WORDS = 1 << 18
_MAX_FRAMES = 10**8


def load_dca1000(path: Path) -> RadarCapture:
    """Open the samples at a ``.bin`` file, all its parts, or a folder of them.

    Frames are read as they are needed. Raises Sd2Error if parts or the configuration are missing,
    or if sizes contradict the configuration.
    """
    parts = parts_of(path)
    _refuse_firmware(parts[0])
    setup_path = setup_of(parts[0])
    setup = read_setup(setup_path)
    config, notes = setup.config, list(setup.notes)
    sizes = [one.stat().st_size for one in parts]
    frames = _frame_count(parts, sizes, setup, setup_path, notes)
    words = _Words(parts, sizes)
    judged = words.read(0, min(_frame_words(setup), _JUDGED_WORDS))
    offset = _is_offset(judged, notes)
    chirps = config.transmitters * config.chirps_per_frame
    length = _frame_words(setup)
    shape = (frames, config.receivers, chirps, config.samples_per_chirp)

    def read(some: slice) -> NDArray[Any]:
        start, stop, _ = some.indices(frames)
        return _in_order(words.read(start * length, stop * length), setup, offset)

    sampled = np.dtype(np.float32 if config.sampling == "real" else np.complex64)
    notes.append(
        f"The file has no times: a frame is taken every {1e3 * config.frame_repetition_s:g} ms, as"
        f" {setup_path.name} says."
    )
    return RadarCapture(
        samples=by_transmitter(LazySamples(shape, sampled, read), config.transmitters),
        config=config,
        timebase=Timebase(np.arange(frames) * config.frame_repetition_s),
        source=str(parts[0]),
        notes=tuple(notes),
        meta={"format": "TI DCA1000", "configuration": setup_path.name, "lanes": setup.lanes},
    )


class FrameDecoder:
    """Samples of single frames by a configuration, as they come from the card.

    ``frame_bytes`` is the size of a frame; ``notes`` say what was assumed of the words, which is
    judged by the first frame as in a file. Raises Sd2Error where the samples do not fill the lanes.
    """

    def __init__(self, setup: TiSetup, name: str) -> None:
        _check_lanes(setup, name)
        self.setup = setup
        self.frame_bytes = _frame_words(setup) * _WORD.itemsize
        self.notes: list[str] = []
        self._offset: bool | None = None

    def samples(self, frame: bytes | bytearray) -> NDArray[Any]:
        """Samples of a frame, float32 or complex64 (channels, chirps, samples)."""
        words = np.frombuffer(frame, _WORD).astype(np.int16, copy=False)
        if self._offset is None:
            self._offset = _is_offset(words[:_JUDGED_WORDS], self.notes)
        signal = _in_order(words, self.setup, self._offset)
        return sorted_by_transmitter(signal, self.setup.config.transmitters)[0]


def parts_of(path: Path) -> list[Path]:
    """Files of one recording, in order; Sd2Error if it is none, or one is missing."""
    if path.is_dir():
        inside = sorted(one for one in path.iterdir() if one.suffix.lower() == SUFFIX)
        bases = {_base(one) for one in inside}
        if len(bases) != 1:
            names = ", ".join(sorted(bases)[:6]) or "none"
            raise Sd2Error(
                f"{path} holds {len(bases)} recordings of a DCA1000 ({names})",
                "one recording",
                "Name the file of the one to open",
            )
        path = inside[0]
    check_regular(path)
    match = _PART.fullmatch(path.stem)
    if match is None:
        return [path]
    numbered = {}
    for one in path.parent.iterdir():
        other = _PART.fullmatch(one.stem)
        if other and other["base"] == match["base"] and one.suffix.lower() == SUFFIX:
            check_regular(one)
            numbered[int(other["number"])] = one
    missing = sorted(set(range(max(numbered) + 1)) - numbered.keys())
    if missing:
        raise Sd2Error(
            f"{path.parent} has no {match['base']}_Raw_{missing[0]}{SUFFIX}",
            f"all parts up to {max(numbered)}",
            "Copy all parts of the recording",
        )
    return [numbered[number] for number in sorted(numbered)]


def setup_of(path: Path) -> Path:
    """Configuration beside a file: of the same name, or the only one; Sd2Error otherwise."""
    for base in dict.fromkeys((path.stem, _base(path))):
        for suffix in (".cfg", ".mmwave.json", ".json"):
            if (beside := path.with_name(base + suffix)).is_file():
                return beside
    others = sorted(path.parent.iterdir())
    setups = [one for one in others if one.suffix.lower() == ".cfg"]
    setups += [one for one in others if one.suffix.lower() == ".json" and is_studio_json(one)]
    if len(setups) != 1:
        names = f": {', '.join(one.name for one in setups[:6])}" if setups else ""
        raise Sd2Error(
            f"{path} has {len(setups)} configurations beside it{names}",
            "the .cfg of the mmWave SDK or the .mmwave.json of mmWave Studio that it was recorded"
            " with, of the same name where there are several",
            "Copy it there; the samples alone do not say their shape",
        )
    return setups[0]


def _base(path: Path) -> str:
    match = _PART.fullmatch(path.stem)
    return match["base"] if match else path.stem


class _Words:
    """Words of several files, one after the other."""

    def __init__(self, parts: list[Path], sizes: list[int]) -> None:
        self._parts = parts
        self._edges = np.concatenate([[0], np.cumsum(np.array(sizes) // _WORD.itemsize)])

    def read(self, start: int, stop: int) -> NDArray[np.int16]:
        """Words ``start`` to ``stop`` (exclusive)."""
        pieces = []
        for part, first, end in zip(self._parts, self._edges, self._edges[1:], strict=False):
            low, high = max(start, int(first)), min(stop, int(end))
            if low < high:
                place = slice(low - int(first), high - int(first))
                pieces.append(read_words(part, _WORD, place))
        return np.concatenate(pieces).astype(np.int16, copy=False)


def _refuse_firmware(path: Path) -> None:
    with path.open("rb") as stream:
        if stream.read(4) in _FIRMWARE:
            raise Sd2Error(
                f"{path} is the firmware of a radar, which is flashed to it",
                _EXPECTED,
                "Take the file that was recorded, such as adc_data_Raw_0.bin",
            )


def _frame_words(setup: TiSetup) -> int:
    config = setup.config
    each = 1 if config.sampling == "real" else 2
    return config.channels * config.chirps_per_frame * config.samples_per_chirp * each


def _frame_count(
    parts: list[Path], sizes: list[int], setup: TiSetup, setup_path: Path, notes: list[str]
) -> int:
    """Number of frames by the size of the file; Sd2Error if it does not fit the configuration."""
    config, total = setup.config, sum(sizes)
    length = _frame_words(setup) * _WORD.itemsize
    frames, left = divmod(total, length)
    turns = f"{config.transmitters} transmitters x " if config.transmitters > 1 else ""
    expected = (
        f"frames of {length:,} bytes ({turns}{config.chirps_per_frame} chirps x"
        f" {config.receivers} receivers x {config.samples_per_chirp} {config.sampling} samples),"
        f" as {setup_path.name} says"
    )
    remedy = "Use the configuration that it was recorded with, and all parts of the recording"
    _check_lanes(setup, str(setup_path))
    if any(size % _WORD.itemsize for size in sizes):
        raise Sd2Error(f"{parts[0]} has {total:,} bytes", f"whole words and {expected}", remedy)
    if not 0 < frames < _MAX_FRAMES or (left and setup.frames):
        raise Sd2Error(f"{parts[0]} has {total:,} bytes in {len(parts)} parts", expected, remedy)
    if setup.frames and frames > setup.frames:
        raise Sd2Error(
            f"{parts[0]} has {total:,} bytes, {frames} frames", f"{setup.frames} {expected}", remedy
        )
    if left:
        notes.append(f"The last {left:,} bytes are no whole frame, and are left out.")
    if frames < setup.frames:
        notes.append(f"There are {frames} frames; {setup_path.name} asks for {setup.frames}.")
    return frames


def _check_lanes(setup: TiSetup, name: str) -> None:
    """Raise Sd2Error if complex samples of a chirp do not fill the lanes."""
    config = setup.config
    if config.sampling != "real" and config.receivers * config.samples_per_chirp % setup.lanes:
        raise Sd2Error(
            f"{name}: {config.samples_per_chirp} complex samples of {config.receivers}"
            f" receivers do not fill {setup.lanes} lanes of LVDS",
            f"a multiple of {setup.lanes} per chirp",
            "Use the configuration that it was recorded with",
        )


def _is_offset(some: NDArray[np.int16], notes: list[str]) -> bool:
    """True if words of the first frame are unsigned counts around mid-scale, by their histogram."""
    signed = float(some.std(dtype=np.float64))
    unsigned = float((some ^ np.int16(-0x8000)).std(dtype=np.float64))
    if unsigned < 0.25 * signed:
        notes.append(
            "The words lie around the ends of int16, not around 0: they are taken for uint16 counts"
            " around 32,768."
        )
        return True
    if some.min() >= 0 and some.mean(dtype=np.float64) > 4.0 * signed > 0:
        notes.append(
            f"All words of the first frame lie around {some.mean(dtype=np.float64):.0f} and none is"
            " negative: they look like unsigned counts, which this card does not write."
        )
    return False


def _in_order(words: NDArray[np.int16], setup: TiSetup, offset: bool) -> NDArray[Any]:
    """Samples of whole frames relative to full scale, (n, receivers, chirps of all, samples)."""
    config = setup.config
    chirps = config.transmitters * config.chirps_per_frame
    if offset:
        words = words ^ np.int16(-0x8000)
    flat = _unpacked(words, setup)
    receivers, length = config.receivers, config.samples_per_chirp
    if setup.lanes == 2:
        signal = flat.reshape(-1, chirps, receivers, length).transpose(0, 2, 1, 3)
    else:
        signal = flat.reshape(-1, chirps, length, receivers).transpose(0, 3, 1, 2)
    signal /= np.float32(32768.0)
    return signal[..., ::-1] if setup.falling else signal


def _unpacked(words: NDArray[np.int16], setup: TiSetup) -> NDArray[Any]:
    """Samples in the order of the file, flat: float32, or complex64 of I and Q."""
    if setup.config.sampling == "real":
        return words.astype(np.float32)
    # As many I as there are lanes, then their Q.
    groups = words.reshape(-1, 2, setup.lanes)
    signal = np.empty((len(groups), setup.lanes), np.complex64)
    first, second = (signal.imag, signal.real) if setup.q_first else (signal.real, signal.imag)
    first[...], second[...] = groups[:, 0], groups[:, 1]
    return signal.ravel()
