"""Fixtures for every layer."""

from __future__ import annotations

import gc
import os
import shutil
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

from sd2app.plain_imports import plain_imports
from sd2core.body.landmark_models import LandmarkModels, landmark_models
from sd2core.datasets import kept_maps
from sd2core.errors import Sd2Error
from sd2core.files.lock import FileLock
from sd2core.numerics.compiled import cache_directory, kernels_ready, warm_up
from sd2core.runs import pace

# Before pytest-qt imports it, so that the modules that tests import are not read for its sake.
with plain_imports():
    import PySide6.QtCore  # noqa: F401

# A busy machine is no failure: no test asserts a time. `make test-slow` draws all examples.
settings.register_profile("quick", deadline=None, max_examples=30)
settings.register_profile("thorough", deadline=None, max_examples=200)
settings.load_profile(os.environ.get("SD2_EXAMPLES", "quick"))

# Modules and tests that are found stay for good: looking for garbage among all of them takes a
# fifth of the time in which they are found, and comes back while they run.
gc.disable()

REPOSITORY = Path(__file__).resolve().parent.parent


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark all but every n-th of the parameters of a test that is ``one_in(n)`` as slow."""
    places: Counter[str] = Counter()
    for item in items:
        mark = item.get_closest_marker("one_in")
        if mark is not None:
            name = item.nodeid.partition("[")[0]
            if places[name] % mark.args[0]:
                item.add_marker(pytest.mark.slow)
            places[name] += 1


def pytest_collection_finish() -> None:
    """Look for garbage among what the tests make."""
    gc.freeze()
    gc.enable()


@pytest.fixture(scope="session")
def kept_apart(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, Path]]:
    """Where the pace of this machine and maps that were computed before are kept, for once."""
    folder = tmp_path_factory.getbasetemp()
    pace_path, maps = folder / "pace.json", folder / "kept"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pace, "_path", lambda: pace_path)
        patch.setattr(kept_maps, "user_cache", lambda name: maps / name)
        yield pace_path, maps


@pytest.fixture(autouse=True)
def nothing_known(kept_apart: tuple[Path, Path]) -> None:
    """Forget what this machine has measured and computed before."""
    pace_path, maps = kept_apart
    pace_path.unlink(missing_ok=True)
    if maps.exists():
        shutil.rmtree(maps, ignore_errors=True)


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of real recordings; it is not part of the repository."""
    folder = Path(os.environ.get("SD2_SHARED_DATA", REPOSITORY.parent / "shared" / "data"))
    if folder.is_dir():
        return folder
    reason = f"the real recordings are not at {folder} (set SD2_SHARED_DATA)"
    if os.environ.get("SD2_REQUIRE_SHARED") == "1":
        pytest.fail(reason)
    pytest.skip(reason)


@pytest.fixture(scope="session")
def built_guide() -> Path:
    """Folder of the guide's site; building it takes too long for a test."""
    folder = REPOSITORY / "build" / "docs"
    if (folder / "index.html").is_file():
        return folder
    reason = f"the guide is not built at {folder} (type `make docs`)"
    if os.environ.get("SD2_REQUIRE_SHARED") == "1":
        pytest.fail(reason)
    pytest.skip(reason)


@pytest.fixture(scope="session")
def compiled_kernels() -> None:
    """Machine code in memory; what is not on disk yet is compiled by one worker alone."""
    folder = cache_directory()
    if folder is not None and not kernels_ready():
        lock = FileLock(folder / "tests.lock")
        while not lock.take():
            time.sleep(0.2)
        try:
            warm_up()
        finally:
            lock.release()
    else:
        warm_up()


@pytest.fixture(scope="session")
def models() -> LandmarkModels:
    """The landmark models; fetched where the tests must not skip."""
    required = os.environ.get("SD2_REQUIRE_SHARED") == "1"
    try:
        return landmark_models(download=required)
    except Sd2Error as error:
        if required:
            pytest.fail(str(error))
        pytest.skip(f"needs the landmark models, see `sd2 doctor --fetch-models` ({error})")
