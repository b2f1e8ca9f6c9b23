"""An installation says what it does, and why it failed."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """The script, with a log of its own."""
    spec = importlib.util.spec_from_file_location("install", ROOT / "scripts" / "install.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    monkeypatch.setattr(module, "ROOT", tmp_path)
    monkeypatch.setattr(module, "LOG", tmp_path / "install.log")
    return module


def python(code: str) -> list[str]:
    return [sys.executable, "-u", "-c", code]


def test_what_is_waited_for_is_said_also_while_other_lines_come(
    install: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(install, "SILENCE_S", 0.2)
    code = (
        "import time; print('Downloading torch (182.9MiB)')\n"
        "for n in range(20): time.sleep(0.05); print(f' Downloaded other{n}')\n"
        "print('Installed 2 packages in 3ms')"
    )
    assert install.run(python(code)) == 0
    first, *between, last = capsys.readouterr().out.splitlines()
    assert first == "  Downloading torch (182.9MiB)"
    assert last == "  Installed 2 packages in 3ms"
    assert between
    assert all("waiting for torch (182.9MiB)" in line for line in between)
    assert "Downloaded other19" in install.LOG.read_text("utf-8")


@pytest.mark.parametrize(
    ("said", "remedy"),
    [
        (
            "error: No solution found when resolving dependencies\\n  cause: soupsieve",
            "Try another",
        ),
        ("ERROR: ResolutionImpossible: see the pins", "Try another"),
        ("error: Failed to fetch\\n  cause: dns error", "Check the connection"),
        ("ERROR: [Errno 28] No space left on device", "Make room"),
        ("error: what nobody has seen yet", "report these lines"),
    ],
)
def test_a_failure_says_its_whole_reason_and_what_to_do(
    install: ModuleType, capsys: pytest.CaptureFixture[str], said: str, remedy: str
) -> None:
    code = f"print('before'); print('{said}'); print('  and the last line'); raise SystemExit(3)"
    assert install.explain(install.run(python(code))) == 3
    printed = capsys.readouterr().out
    for line in (*said.split("\\n"), "and the last line"):
        assert line.strip() in printed
    assert remedy in printed
    assert "install.log" in printed


def test_uv_looks_where_pip_is_configured_to_look(
    install: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(install, "PYTHON", sys.executable)
    monkeypatch.setenv("PIP_CONFIG_FILE", "/dev/null")
    monkeypatch.setenv("PIP_INDEX_URL", "https://mirror.example/simple")
    monkeypatch.setenv("PIP_FIND_LINKS", "/one /two")
    monkeypatch.setenv("PIP_CERT", "/certificates.pem")
    places, certificates = install.pip_places()
    pairs = list(zip(places[::2], places[1::2], strict=True))
    assert ("--default-index", "https://mirror.example/simple") in pairs
    assert [place for option, place in pairs if option == "--find-links"][:2] == ["/one", "/two"]
    assert certificates == "/certificates.pem"


def test_too_little_room_is_said_before_anything_is_done(
    install: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(install, "NEEDED_GB", {"program": 1e9})
    monkeypatch.setattr(sys, "argv", ["install.py"])
    assert install.main() == 1
    assert "GB are needed" in capsys.readouterr().out
    assert not install.LOG.exists()
