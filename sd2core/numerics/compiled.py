"""Compilation of numerical kernels, kept on disk and done in the background.

Kernels are serial and release the GIL; callers split their frames over threads
(see docs/decisions/0002). The machine code is kept on disk. Where it is not there
yet, long work waits until another process has made it; a kernel that is called
meanwhile is compiled at that call.
"""

from __future__ import annotations

import atexit
import functools
import hashlib
import importlib
import importlib.metadata
import logging
import os
import platform
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, TypeVar

from sd2core.progress import Progress, silent

Function = TypeVar("Function", bound=Callable[..., Any])

KERNEL_MODULES = (
    "sd2core.scattering.amplitude",
    "sd2core.scattering.beam_kernels",
    "sd2core.scattering.visibility",
    "sd2core.scattering.exact",
    "sd2core.scattering.behind_things",
    "sd2core.scattering.depth",
    "sd2core.doppler.kernels",
    "sd2core.doppler.moving_kernels",
    "sd2core.doppler.limb_kernels",
    "sd2core.fmcw.facet",
    "sd2core.fmcw.kernels",
    "sd2core.body.skinning",
    "sd2core.numerics.raster",
)
"""Every module with kernels; :mod:`sd2core.accuracy.warming` calls all of them."""

_PACKAGE = Path(__file__).resolve().parent.parent
_MARKER = "complete"
_KERNEL_THREAD = "sd2-kernel"
_POLL_S = 0.03
_lock = threading.Lock()
_ready = False
_background: subprocess.Popen[bytes] | None = None


def compiled(function: Function) -> Function:
    """Compile a numerical kernel at its first call, without the GIL, cached on disk.

    Floating-point contraction is allowed, because it only makes results more
    accurate; NaN, infinities and the order of sums keep their meaning. Division
    by zero gives infinity as in NumPy.
    """
    import numba

    directory = cache_directory()
    # The place is read when the function is decorated; whoever else uses numba
    # in this process keeps the place they chose.
    previous = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(directory) if directory else previous
    try:
        kernel: Function = numba.njit(
            nogil=True,
            cache=directory is not None,
            error_model="numpy",
            fastmath={"contract", "nsz"},
        )(function)
    finally:
        numba.config.CACHE_DIR = previous
    return kernel


@functools.lru_cache(maxsize=1)
def cache_directory() -> Path | None:
    """Writable folder for the machine code of this version on this processor.

    The installation itself, else the user's cache folder, else a private
    temporary folder that lives as long as the process. None when nothing at all
    can be written: kernels then live in memory only.
    """
    name = f"kernels-{_fingerprint()}"
    for base in _candidate_folders():
        if _writable(base / name):
            return base / name
    try:
        temporary = Path(tempfile.mkdtemp(prefix="sd2-studio-"))
    except OSError:
        return None
    atexit.register(shutil.rmtree, temporary, ignore_errors=True)
    return temporary / name if _writable(temporary / name) else None


def _candidate_folders() -> Iterator[Path]:
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    if chosen:
        yield Path(chosen)
    yield _PACKAGE / "__pycache__"
    import platformdirs

    yield Path(platformdirs.user_cache_dir("sd2-studio", appauthor=False))


def kernel_folders() -> list[Path]:
    """Folders with machine code, of any version and processor."""
    name = "kernels-" + 16 * "[0-9a-f]"
    return [folder for base in _candidate_folders() for folder in base.glob(name)]


def _writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def _fingerprint() -> str:
    """Changes with everything that machine code depends on.

    Numba itself notices a change of a kernel's own file only, not of a function
    that was inlined from another file.
    """
    import llvmlite.binding  # type: ignore[import-untyped]

    digest = hashlib.sha256()
    for module in (*KERNEL_MODULES, "sd2core.numerics.compiled"):
        digest.update(_source(module))
    for fact in (
        # Numba keeps code by the place of its source: another installation that
        # shares this cache cannot use it.
        str(_PACKAGE),
        platform.python_version(),
        importlib.metadata.version("numba"),
        llvmlite.binding.get_host_cpu_name(),
        llvmlite.binding.get_host_cpu_features().flatten(),
    ):
        digest.update(fact.encode())
    return digest.hexdigest()[:16]


def kernels_ready() -> bool:
    """True if calling the kernels causes no pause: they are on disk or in memory."""
    global _ready
    if not _ready:
        directory = cache_directory()
        _ready = directory is not None and (directory / _MARKER).exists()
    return _ready


def warm_up(progress: Progress = silent) -> None:
    """Compile every kernel that is not on disk yet (about half a minute the first time)."""
    global _ready
    directory, ready = cache_directory(), _ready
    progress(*kernels_compiled())
    _ready = True  # for the work done here, which is not to wait for another process
    try:
        for _ in importlib.import_module("sd2core.accuracy.warming").call_kernels():
            progress(*kernels_compiled())
    except BaseException:
        _ready = ready
        raise
    if directory is not None:
        (directory / _MARKER).touch()


def kernels_compiled() -> tuple[int, int]:
    """Number of kernels whose machine code is on disk, and of all."""
    directory = cache_directory()
    # Numba keeps an index for each.
    on_disk = sum(1 for _ in directory.rglob("*.nbi")) if directory else 0
    return on_disk, sum(_source(name).count(b"\n@compiled") for name in KERNEL_MODULES)


def _source(module: str) -> bytes:
    return _PACKAGE.parent.joinpath(*module.split(".")).with_suffix(".py").read_bytes()


def compile_in_background() -> subprocess.Popen[bytes] | None:
    """Start compiling in another process; None if it is done or impossible.

    A process, because the compiler holds the GIL: in a thread it would freeze
    the window. After a failure it is not started again.
    """
    global _background
    with _lock:
        directory = cache_directory()
        if kernels_ready() or directory is None:
            return None
        if _background is None:
            paths = [str(_PACKAGE.parent), os.environ.get("PYTHONPATH", "")]
            environment = {
                **os.environ,
                "NUMBA_CACHE_DIR": str(directory.parent),
                "PYTHONPATH": os.pathsep.join(filter(None, paths)),
            }
            try:
                _background = subprocess.Popen(
                    [sys.executable, "-m", "sd2core.numerics.compiled"],
                    env=environment,
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.DEVNULL,
                )
            except OSError:
                return None
            atexit.register(_stop_background)
        return _background


def await_kernels(check: Callable[[], object]) -> None:
    """Wait until the kernels are on disk, where another process compiles them.

    Where nothing can be written, or that process fails, kernels are compiled where they are called.

    Parameters
    ----------
    check : callable
        Called while it waits; may raise Cancelled.
    """
    process = compile_in_background()
    if process is not None and process.poll() is None:
        logging.getLogger("sd2core").warning(
            "Compiling the numerical kernels, once after installing: about half a minute"
        )
    while process is not None and process.poll() is None:
        check()
        time.sleep(_POLL_S)


def _stop_background() -> None:
    if _background is not None and _background.poll() is None:
        _background.terminate()
        _background.wait()


def worker_count() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@functools.lru_cache(maxsize=1)
def workers() -> ThreadPoolExecutor:
    """The threads over which kernels are spread; one pool for the whole process."""
    return ThreadPoolExecutor(worker_count(), thread_name_prefix=_KERNEL_THREAD)


def on_worker() -> bool:
    """True in one of these threads, which must not wait for work of the same pool."""
    return threading.current_thread().name.startswith(_KERNEL_THREAD)


if __name__ == "__main__":
    from sd2core.numerics import compiled as module

    module.warm_up()
