"""The two model files of the landmark search: their place, their download and their check.

They are part of the `mediapipe` wheel (Apache-2.0), which is downloaded as an archive and never
installed or imported: it would bring a second OpenCV.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
import time
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write
from sd2core.files.paths import user_cache
from sd2core.progress import Progress, silent

ENVIRONMENT = "SD2_MODELS"
"""Names the folder of the models, where they are not in the user's cache."""

DETECTOR = "pose_detection.tflite"
LANDMARKER = "pose_landmark_full.tflite"
NOTICE = "LICENSE-mediapipe.txt"

_SHA256 = {
    DETECTOR: "9ba9dd3d42efaaba86b4ff0122b06f29c4122e756b329d89dca1e297fd8f866c",
    LANDMARKER: "e9a5c5cb17f736fafd4c2ec1da3b3d331d6edbe8a0d32395855aeb2cdfd64b9f",
}
_IN_WHEEL = {
    DETECTOR: f"mediapipe/modules/pose_detection/{DETECTOR}",
    LANDMARKER: f"mediapipe/modules/pose_landmark/{LANDMARKER}",
}
_NOTICE_IN_WHEEL = "mediapipe-0.10.21.dist-info/LICENSE"
_REQUIREMENT = "mediapipe==0.10.21"
_WHEEL_SHA256 = "05dc4a9e593655a79558d05d6227d31018c2537a4bd3362b51e230cf22aecfe3"
_WHEEL_BYTES = 35_622_638
# Of this one build, whatever runs here: the models are the same in all of them.
_DOWNLOAD = (
    *("download", _REQUIREMENT, "--no-deps", "--only-binary=:all:"),
    *("--platform", "manylinux_2_28_x86_64", "--python-version", "3.11"),
    *("--no-input", "--disable-pip-version-check", "--quiet", "--retries", "1"),
)
_LOOK_EVERY_S = 0.2
_OFFLINE = ("connection", "resolve", "timed out", "unreachable", "proxy")
_HOW = (
    "Without a connection: fetch that wheel elsewhere and give it to"
    " `sd2 fetch-models --from WHEEL`, or name a folder that holds the two files"
    f" with --models FOLDER or {ENVIRONMENT}"
)


@dataclass(frozen=True)
class LandmarkModels:
    """Paths of the checked model files."""

    detector: Path
    landmarker: Path


def default_folder() -> Path:
    """Folder of the models in the user's cache."""
    return user_cache("models")


def landmark_models(
    folder: Path | None = None, progress: Progress = silent, download: bool = True
) -> LandmarkModels:
    """Find the models, and fetch them into the user's cache where they are missing.

    A given folder is the only place to look; by default that is the folder named by
    ``SD2_MODELS``, or the user's cache. Progress counts bytes while they are fetched and
    may raise ``Cancelled``. Raises Sd2Error if they are missing, not the known ones, or
    cannot be fetched.
    """
    named = folder or (Path(os.environ[ENVIRONMENT]) if os.environ.get(ENVIRONMENT) else None)
    if named is not None:
        return _checked(Path(named))
    cache = default_folder()
    try:
        return _checked(cache)
    except Sd2Error:
        if not download:
            raise
    return fetch_models(progress, into=cache)


def fetch_models(
    progress: Progress = silent, *, source: Path | None = None, into: Path | None = None
) -> LandmarkModels:
    """Fetch the models into the user's cache (or the folder ``into``), or replace them there.

    ``source`` is a wheel of mediapipe, or a folder with one or with the two files; by
    default they are downloaded from the package index of pip. Progress counts bytes and may
    raise ``Cancelled``. Raises Sd2Error if they cannot be fetched or are not the known
    ones.
    """
    into = default_folder() if into is None else Path(into)
    into.mkdir(parents=True, exist_ok=True)
    if source is not None:
        _take(Path(source), into)
        return _checked(into)
    with tempfile.TemporaryDirectory(prefix="sd2-models-") as place:
        wheel = _downloaded(Path(place), progress)
        found = _sha256(wheel)
        if found != _WHEEL_SHA256:
            raise Sd2Error(
                f"The downloaded {wheel.name} is not the known one (sha256 {found})",
                _WHEEL_SHA256,
                f"Try again. {_HOW}",
            )
        _extract(wheel, into)
    return _checked(into)


def _checked(folder: Path) -> LandmarkModels:
    for name, expected in _SHA256.items():
        path = folder / name
        if not path.is_file():
            raise Sd2Error(
                f"The landmark model {name} is not in {folder}",
                f"{DETECTOR} and {LANDMARKER} of {_REQUIREMENT}",
                "Fetch them with `sd2 fetch-models`",
            )
        found = _sha256(path)
        if found != expected:
            raise Sd2Error(
                f"{path} is not the known landmark model (sha256 {found})",
                expected,
                "Fetch it again with `sd2 fetch-models`",
            )
    return LandmarkModels(folder / DETECTOR, folder / LANDMARKER)


def _take(source: Path, into: Path) -> None:
    """Copy from a wheel or folder of the user."""
    if source.is_dir() and (source / DETECTOR).is_file():
        given = _checked(source)
        for path in (given.detector, given.landmarker):
            with path.open("rb") as stream, atomic_write(into / path.name) as copy:
                shutil.copyfileobj(stream, copy)
        return
    wheels = sorted(source.glob("mediapipe-*.whl")) if source.is_dir() else [source]
    if not wheels or not wheels[0].is_file():
        raise Sd2Error(
            f"{source} does not exist" if not source.exists() else f"{source} holds no models",
            f"the wheel of {_REQUIREMENT}, or a folder with it or with {DETECTOR} and {LANDMARKER}",
        )
    _extract(wheels[0], into)


def _extract(wheel: Path, into: Path) -> None:
    """Write the models and their licence; nothing if one is not the known file."""
    try:
        with zipfile.ZipFile(wheel) as archive:
            contents = {name: archive.read(inside) for name, inside in _IN_WHEEL.items()}
            notice = archive.read(_NOTICE_IN_WHEEL)
    except (OSError, KeyError, zipfile.BadZipFile) as error:
        raise Sd2Error(
            f"{wheel} cannot be read as a wheel of mediapipe ({error})", _REQUIREMENT, _HOW
        ) from error
    for name, content in contents.items():
        found = hashlib.sha256(content).hexdigest()
        if found != _SHA256[name]:
            raise Sd2Error(f"{name} in {wheel} is not the known one (sha256 {found})", _REQUIREMENT)
    for name, content in (*contents.items(), (NOTICE, notice)):
        with atomic_write(into / name) as stream:
            stream.write(content)


def _pip() -> Sequence[str]:
    return (sys.executable, "-m", "pip")


def _downloaded(folder: Path, progress: Progress) -> Path:
    """Let pip download the wheel, from whatever index it is set up for."""
    target, scratch = folder / "wheel", folder / "scratch"
    target.mkdir()
    scratch.mkdir()
    # pip writes what arrives under the temporary folder: its growth is the progress, with
    # every version of pip.
    places = {name: str(scratch) for name in ("TMPDIR", "TEMP", "TMP")}
    with (folder / "errors").open("w+", encoding="utf-8", errors="replace") as errors:
        pip = subprocess.Popen(
            [*_pip(), *_DOWNLOAD, "--dest", str(target)],
            stdin=subprocess.DEVNULL,
            stdout=errors,
            stderr=subprocess.STDOUT,
            env=os.environ | places,
        )
        try:
            while pip.poll() is None:
                progress(min(_size(folder), _WHEEL_BYTES), _WHEEL_BYTES)
                time.sleep(_LOOK_EVERY_S)
        finally:
            if pip.poll() is None:
                pip.terminate()
                pip.wait()
        errors.seek(0)
        said = errors.read()
    wheels = list(target.glob("*.whl"))
    if pip.returncode != 0 or not wheels:
        raise _refused(said)
    progress(_WHEEL_BYTES, _WHEEL_BYTES)
    return wheels[0]


def _refused(said: str) -> Sd2Error:
    """Error for a failed download, by the output of pip."""
    if "No module named pip" in said:
        return Sd2Error(
            f"The landmark models cannot be fetched: {sys.executable} has no pip",
            f"pip, to download {_REQUIREMENT}",
            f"Install it with `{sys.executable} -m ensurepip`. {_HOW}",
        )
    lines = [line.strip() for line in said.splitlines() if line.strip()]
    reasons = [line for line in lines if line.startswith("ERROR:")] or lines or ["no reason given"]
    if any(word in line.lower() for line in lines for word in _OFFLINE):
        return Sd2Error(
            "The landmark models cannot be fetched: the package index of pip is out of reach"
            f" ({reasons[-1].removeprefix('ERROR: ')})",
            "a connection, once",
            _HOW,
        )
    return Sd2Error(
        f"The landmark models cannot be fetched: {reasons[-1].removeprefix('ERROR: ')}",
        f"that pip can download {_REQUIREMENT}",
        _HOW,
    )


def _size(folder: Path) -> int:
    total = 0
    for path in folder.rglob("*"):
        try:
            total += path.stat().st_size if path.is_file() else 0
        except OSError:  # gone meanwhile
            continue
    return total


def _sha256(path: Path) -> str:
    try:
        with path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError as error:
        raise Sd2Error(f"{path} cannot be read ({error.strerror})", "a readable file") from error
