"""Packages with plug-ins on the path, and forgotten afterwards."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from added_plug_ins import Install

from sd2core.plug_ins import forget

SAMPLE = Path(__file__).resolve().parents[2] / "plugin_sample"


@pytest.fixture(autouse=True)
def _forgotten() -> Iterator[None]:
    before = set(sys.modules)
    forget()
    yield
    forget()
    for name in [name for name in sys.modules if name not in before]:
        if name.partition(".")[0] in ("sd2_sample", "added", "other"):
            del sys.modules[name]


@pytest.fixture
def sample(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(SAMPLE))


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Install:
    def installed(package: str, group: str, entry: str, text: str = "") -> None:
        folder = tmp_path / "site" / package
        about = folder / f"{package.replace('-', '_')}-1.0.dist-info"
        about.mkdir(parents=True)
        (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
        (about / "entry_points.txt").write_text(f"[sd2_studio.{group}]\n{entry}\n")
        module = entry.partition("=")[2].partition(":")[0].strip()
        (folder / f"{module}.py").write_text(text)
        monkeypatch.syspath_prepend(str(folder))

    return installed
