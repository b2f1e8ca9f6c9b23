"""Files of an inertial sensor's samples: CSV, OpenSim's ``.sto``, and ``.npz``.

All state the axes. Rows of a virtual sensor come at its rate without a break; where nothing is
known they hold NaN (in CSV an empty cell). A ``.sto`` has a column of three numbers for each sensor
and quantity, as OpenSim's tables of vectors do (STOFileAdapter of the OpenSim API, DataType=Vec3).
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write
from sd2core.files.limits import open_regular
from sd2core.files.numpy_files import open_npz_file
from sd2core.files.texts import check_version, errors_in, lines_of
from sd2core.imu.signals import InertialSignals
from sd2core.imu.tables import meta_of, read_table, text_of

SUFFIXES = (".csv", ".sto", ".npz")
FORMAT, VERSION = "sd2-imu", 1

_CSV_COLUMNS = (
    "time_s", "acc_x_mps2", "acc_y_mps2", "acc_z_mps2", "gyr_x_radps", "gyr_y_radps", "gyr_z_radps"
)  # fmt: skip
_STO_ENDS = ("_accelerometer", "_gyroscope")
_EXPECTED_STO = "a .sto that `sd2 imu` wrote"
_EXPECTED_NPZ = "an .npz that `sd2 imu` wrote"
_ARRAYS = ("times_s", "acceleration_mps2", "turn_rate_radps")
_LONGEST_HEADER = 200
_OF_THE_TABLE = {"DataRate", "DataType", "version", "units", "OpenSimVersion"}


def write_signals(path: Path, signals: InertialSignals) -> None:
    """Write samples; the ending of the name says how. Values of a CSV have nine digits.

    Raises Sd2Error for another ending.

    Examples
    --------
    >>> import tempfile
    >>> signals = InertialSignals(np.arange(3) / 100, np.full((3, 3), 5.0), np.zeros((3, 3)))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_signals(Path(folder, "rest.csv"), signals)
    ...     again = read_signals(Path(folder, "rest.csv"))
    >>> again.rate_hz, again.acceleration_mps2[0]
    (100.0, array([5., 5., 5.]))
    """
    path = Path(path)
    write = _of_suffix(path, {".csv": _write_csv, ".sto": _write_sto, ".npz": _write_npz})
    write(path, signals)


def read_signals(path: Path) -> InertialSignals:
    """Read what :func:`write_signals` wrote, or the CSV of a real sensor; see :mod:`.tables`.

    Raises Sd2Error when the file is no such file or damaged.
    """
    path = Path(path)
    if not path.exists():
        raise Sd2Error(f"{path} does not exist", "samples of an inertial sensor", "Check the path")
    read = _of_suffix(path, {".csv": read_table, ".sto": _read_sto, ".npz": _read_npz})
    try:
        return read(path)
    except OSError as error:
        raise Sd2Error(f"{path} cannot be read: {error.strerror or error}") from error


def _of_suffix(path: Path, ways: dict[str, Callable[..., Any]]) -> Callable[..., Any]:
    way = ways.get(path.suffix.lower())
    if way is None:
        raise Sd2Error(f"The file is {path}", f"a name that ends in {', '.join(SUFFIXES)}")
    return way


# -- CSV -----------------------------------------------------------------------------------------


def _write_csv(path: Path, signals: InertialSignals) -> None:
    rows = np.column_stack([signals.acceleration_mps2, signals.turn_rate_radps])
    with atomic_write(path) as stream:
        for name, value in signals.meta.items():
            stream.write(f"# {name}: {text_of(value)}\n".encode())
        stream.write(f"{','.join(_CSV_COLUMNS)}\n".encode())
        for time_s, row in zip(signals.times_s.tolist(), rows.tolist(), strict=True):
            cells = ("" if math.isnan(value) else f"{value:.9g}" for value in row)
            stream.write(f"{time_s:.9f},{','.join(cells)}\n".encode())


# -- OpenSim -------------------------------------------------------------------------------------


def _write_sto(path: Path, signals: InertialSignals) -> None:
    name = str(signals.meta.get("at", "imu")).replace(" ", "-")
    header = [
        *(f"{name}={text_of(value)}" for name, value in signals.meta.items()),
        f"DataRate={signals.rate_hz:.6f}",
        "DataType=Vec3",
        "version=3",
        "units=s, m/s^2, rad/s",
        "endheader",
        "\t".join(["time", *(name + end for end in _STO_ENDS)]),
    ]
    with atomic_write(path) as stream:
        stream.write(("\n".join(header) + "\n").encode())
        for time_s, *vectors in zip(
            signals.times_s.tolist(),
            signals.acceleration_mps2.tolist(),
            signals.turn_rate_radps.tolist(),
            strict=True,
        ):
            cells = [",".join(f"{value:.9g}" for value in vector) for vector in vectors]
            stream.write("\t".join([f"{time_s:.9f}", *cells]).encode() + b"\n")


def _read_sto(path: Path) -> InertialSignals:
    with open_regular(path) as stream:
        try:
            lines = (line.decode("utf-8").strip() for line in lines_of(stream))
            facts = _sto_header(path, lines)
            names = next(lines, "").split("\t")
            if len(names) != 3 or not all(
                name.endswith(end) for name, end in zip(names[1:], _STO_ENDS, strict=True)
            ):
                raise Sd2Error(f"{path} has the columns {str(names)[:200]}", _EXPECTED_STO)
            rows = (line.replace("\t", ",") for line in lines if line)
            first = next(rows, None)
            if first is None:
                raise Sd2Error(f"{path} holds no rows", _EXPECTED_STO)
            table = np.loadtxt(chain([first], rows), delimiter=",", comments=None, ndmin=2)
            if table.shape[1] != 7:
                raise Sd2Error(f"{path} has {table.shape[1]} numbers in a row", "seven")
        except ValueError as error:
            raise Sd2Error(f"{path} cannot be read ({str(error)[:200]})", _EXPECTED_STO) from error
    meta = {"at": names[1].removesuffix(_STO_ENDS[0]), "source": path.name} | facts
    with errors_in(path, remedy=""):
        return InertialSignals(table[:, 0], table[:, 1:4], table[:, 4:], meta)


def _sto_header(path: Path, lines: Iterator[str]) -> dict[str, Any]:
    """Metadata of the header; Sd2Error if its table is not of vectors."""
    facts: dict[str, str] = {}
    for _ in range(_LONGEST_HEADER):
        line = next(lines, None)
        if line is None or line == "endheader":
            break
        name, _, value = line.partition("=")
        if value:
            facts[name] = value
    if facts.get("DataType") != "Vec3":
        stated = facts.get("DataType", "no type that is stated")[:40]
        raise Sd2Error(f"{path} is a table of {stated}", _EXPECTED_STO)
    return meta_of({name: text for name, text in facts.items() if name not in _OF_THE_TABLE})


# -- NPZ -----------------------------------------------------------------------------------------


def _write_npz(path: Path, signals: InertialSignals) -> None:
    meta = {"format": FORMAT, "version": VERSION, **signals.meta}
    arrays = {name: getattr(signals, name) for name in _ARRAYS}
    with atomic_write(path) as stream:
        np.savez_compressed(stream, **arrays, meta=json.dumps(meta))


def _read_npz(path: Path) -> InertialSignals:
    with open_npz_file(path, "samples of an inertial sensor", _EXPECTED_NPZ) as data:
        missing = {*_ARRAYS, "meta"} - data.keys()
        if missing:
            raise Sd2Error(f"{path} has no {', '.join(sorted(missing))}", _EXPECTED_NPZ)
        meta = json.loads(str(data["meta"]))
        check_version(meta, path, FORMAT, VERSION)
        del meta["format"], meta["version"]
        times_s, acceleration, turn_rate = (np.asarray(data[name], np.float64) for name in _ARRAYS)
        with errors_in(path, remedy=""):
            return InertialSignals(times_s, acceleration, turn_rate, meta)
