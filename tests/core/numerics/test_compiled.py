"""Compiled kernels: kept on disk, never in the way, whatever can be written."""

from __future__ import annotations

import importlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import sd2core
import sd2core.accuracy.warming  # before a test keeps machine code elsewhere
from sd2core.numerics import compiled
from sd2core.progress import Cancelled

PACKAGE = Path(sd2core.__file__).parent

ONE_KERNEL = """
import numpy as np
from sd2core.numerics import compiled
from sd2core.doppler.kernels import distances_of
print(compiled.cache_directory())
print(compiled.kernels_ready())
distances_of(np.zeros((1, 3)))
print(sum(distances_of.stats.cache_hits.values()))
"""


def run(code: str, package_parent: Path, **environment: str) -> list[str]:
    inherited = {key: value for key, value in os.environ.items() if key != "NUMBA_CACHE_DIR"}
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**inherited, "PYTHONPATH": str(package_parent), **environment},
        capture_output=True,
        text=True,
        check=True,
        cwd=package_parent,
    )
    return done.stdout.split()


@pytest.fixture
def sealed(tmp_path: Path) -> Path:
    """An installation without a place for caches.

    A plain file stands where each folder would be: unlike missing permissions,
    that stops even the administrator.
    """
    copy = tmp_path / "site" / "sd2core"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__", "resources"))
    (copy / "__pycache__").touch()
    (tmp_path / "file").touch()
    return copy.parent


@pytest.mark.slow
def test_the_installation_keeps_its_machine_code(tmp_path: Path) -> None:
    copy = tmp_path / "sd2core"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__", "resources"))
    folder, ready, hits = run(ONE_KERNEL, tmp_path)
    assert Path(folder).parent == copy / "__pycache__"
    assert (ready, hits) == ("False", "0")
    assert run(ONE_KERNEL, tmp_path) == [folder, "False", "1"]


def test_a_read_only_installation_uses_the_users_cache(sealed: Path, tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    code = "from sd2core.numerics import compiled; print(compiled.cache_directory())"
    variables = {"XDG_CACHE_HOME": str(cache), "LOCALAPPDATA": str(cache), "HOME": str(cache)}
    (folder,) = run(code, sealed, **variables)
    assert cache in Path(folder).parents


@pytest.mark.slow
def test_nothing_writable_but_the_temporary_folder(sealed: Path, tmp_path: Path) -> None:
    blocked, temporary = str(tmp_path / "file"), tmp_path / "temporary"
    temporary.mkdir()
    variables = {"XDG_CACHE_HOME": blocked, "LOCALAPPDATA": blocked, "HOME": blocked}
    variables |= {"TMPDIR": str(temporary), "NUMBA_CACHE_DIR": blocked}
    folder, ready, hits = run(ONE_KERNEL, sealed, **variables)
    assert temporary in Path(folder).parents
    assert (ready, hits) == ("False", "0")
    assert not list(temporary.iterdir()), "the private folder goes with the process"


def test_a_chosen_cache_folder_is_used(sealed: Path, tmp_path: Path) -> None:
    chosen = tmp_path / "chosen"
    code = "from sd2core.numerics import compiled; print(compiled.cache_directory())"
    (folder,) = run(code, sealed, NUMBA_CACHE_DIR=str(chosen))
    assert Path(folder).parent == chosen


def test_nothing_writable_at_all(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(prefix: str) -> str:
        raise PermissionError(prefix)

    monkeypatch.setattr(compiled, "_writable", lambda folder: False)
    monkeypatch.setattr(compiled.tempfile, "mkdtemp", refuse)
    monkeypatch.setattr(compiled, "cache_directory", compiled.cache_directory.__wrapped__)
    monkeypatch.setattr(compiled, "_ready", False)
    assert compiled.cache_directory() is None
    assert not compiled.kernels_ready()
    assert compiled.compile_in_background() is None
    kernel = compiled.compiled(lambda x: x + 1)
    assert kernel(2) == 3


def test_every_module_with_kernels_is_known() -> None:
    with_kernels = {
        ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts)
        for path in PACKAGE.rglob("*.py")
        if "\n@compiled\n" in path.read_text(encoding="utf-8")
    }
    assert with_kernels == set(compiled.KERNEL_MODULES)
    assert with_kernels <= sys.modules.keys(), "its work loads them"


def test_warm_up_makes_ready_and_reports(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(compiled, "_ready", False)
    monkeypatch.setattr(compiled, "cache_directory", lambda: tmp_path)
    monkeypatch.setattr(compiled.subprocess, "Popen", None)  # its own work waits for nobody
    reports: list[tuple[int, int]] = []
    compiled.warm_up(lambda *report: reports.append(report))
    assert compiled.kernels_ready()
    assert (tmp_path / "complete").exists()
    assert len(reports) > 10
    assert {count for _, count in reports} == {compiled.kernels_compiled()[1]}
    assert compiled.compile_in_background() is None


def test_a_warm_up_that_is_stopped_makes_nothing_ready(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(compiled, "_ready", False)
    monkeypatch.setattr(compiled, "cache_directory", lambda: tmp_path)
    reports: list[tuple[int, int]] = []

    def stop(*report: int) -> None:
        reports.append((report[0], report[1]))
        if len(reports) == 2:
            raise Cancelled

    with pytest.raises(Cancelled):
        compiled.warm_up(stop)
    assert not compiled.kernels_ready()


def test_every_kernel_counts_once_its_code_is_on_disk(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(compiled, "cache_directory", lambda: tmp_path)
    kernels = [
        value
        for name in compiled.KERNEL_MODULES
        for value in vars(importlib.import_module(name)).values()
        if hasattr(value, "py_func") and value.py_func.__module__ == name
    ]
    assert compiled.kernels_compiled() == (0, len(kernels))
    (tmp_path / "doppler_1").mkdir()
    for name in ("a-1.py311.nbi", "a-1.py311.1.nbc", "a-1.py311.2.nbc", "b-1.py311.nbi"):
        (tmp_path / "doppler_1" / name).touch()
    assert compiled.kernels_compiled() == (2, len(kernels))


@pytest.mark.slow
def test_warm_up_leaves_nothing_to_compile() -> None:
    """A process that finds the kernels ready compiles nothing when it uses them."""
    compiled.warm_up()
    done, count = compiled.kernels_compiled()
    assert done == count
    code = """
import numpy as np
from sd2core.numerics import compiled
assert compiled.kernels_ready()
from sd2core.doppler import Synthesizer, SynthesisOptions, kernels
from sd2core.mesh.sequence import MeshSequence
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase
from sd2core.scattering import amplitude, depth, exact, visibility
faces = np.array([[0, 1, 2]], np.int32)
faces.flags.writeable = False
vertices = np.random.default_rng(0).normal(size=(40, 3, 3))
for dtype in ("f4", "f8"):
    for weight in ("count", "area", "projected"):
        mesh = MeshSequence(vertices.astype(dtype), faces, Timebase.regular(40, 30), "x")
        maker = Synthesizer(mesh, SynthesisOptions(weight=weight))
        for seen in ("none", "facing", "depth", "exact", "frozen"):
            maker.map(VirtualSensor(), visibility=seen)
        maker.frame(VirtualSensor(), 3)
    Synthesizer(mesh, "vid2doppler").map(VirtualSensor())
misses = [
    (kernel.__name__, sum(kernel.stats.cache_misses.values()))
    for module in (amplitude, depth, exact, visibility, kernels)
    for kernel in vars(module).values()
    if hasattr(kernel, "stats")
]
assert len(misses) > 4
print(sum(count for _, count in misses))
"""
    assert run(code, PACKAGE.parent) == ["0"]


def test_compiling_in_the_background_runs_once(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    started: list[list[str]] = []

    class Process:
        def __init__(self, command: list[str], **_: object) -> None:
            started.append(command)

    monkeypatch.setattr(compiled, "_ready", False)
    monkeypatch.setattr(compiled, "_background", None)
    monkeypatch.setattr(compiled, "cache_directory", lambda: tmp_path)
    monkeypatch.setattr(compiled.subprocess, "Popen", Process)
    monkeypatch.setattr(compiled.atexit, "register", lambda *_: None)
    first = compiled.compile_in_background()
    assert first is not None
    assert compiled.compile_in_background() is first
    assert started == [[sys.executable, "-m", "sd2core.numerics.compiled"]]
    # Once the marker is there, everyone knows.
    (tmp_path / "complete").touch()
    assert compiled.kernels_ready()
    assert compiled.compile_in_background() is None


class Compiler:
    """A process that ends when it was looked at so many times."""

    def __init__(self, looks: int, exit_code: int = 0) -> None:
        self.looks, self._exit_code = looks, exit_code

    def poll(self) -> int | None:
        self.looks -= 1
        return None if self.looks >= 0 else self._exit_code


@pytest.mark.parametrize("exit_code", [0, 1])
def test_long_work_waits_for_the_compiler_and_says_so_once(
    exit_code: int, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    compiler, checks = Compiler(4, exit_code), []
    monkeypatch.setattr(compiled, "compile_in_background", lambda: compiler)
    compiled.await_kernels(lambda: checks.append(compiler.looks))
    assert checks == [2, 1, 0]
    assert [record.name for record in caplog.records] == ["sd2core"]
    compiled.await_kernels(lambda: pytest.fail("the compiler has ended"))
    assert len(caplog.records) == 1


def test_waiting_for_the_compiler_can_be_cancelled(monkeypatch: pytest.MonkeyPatch) -> None:
    def cancel() -> None:
        raise Cancelled

    monkeypatch.setattr(compiled, "compile_in_background", lambda: Compiler(10**9))
    with pytest.raises(Cancelled):
        compiled.await_kernels(cancel)


def test_numba_users_beside_us_keep_their_folder() -> None:
    import numba

    before = numba.config.CACHE_DIR
    compiled.compiled(lambda x: x)
    assert before == numba.config.CACHE_DIR


@pytest.mark.slow
@pytest.mark.timeout(1800)  # all kernels are compiled
def test_kernels_stay_within_their_arrays_when_they_are_compiled(tmp_path: Path) -> None:
    code = "from sd2core.numerics.compiled import warm_up; warm_up()"
    run(code, PACKAGE.parent, NUMBA_BOUNDSCHECK="1", NUMBA_CACHE_DIR=str(tmp_path))
