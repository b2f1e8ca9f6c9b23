"""``sd2 doctor --clean``: caches go after asking, and nothing else."""

from __future__ import annotations

from pathlib import Path

import pytest
from cli_outcome import Sd2

from sd2core.files.paths import user_cache, user_data

FINGERPRINT = "kernels-0123456789abcdef"


@pytest.fixture(autouse=True)
def places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    """Caches of every kind, where nothing else is; machine code in two places."""
    cache = tmp_path / "cache" / "sd2-studio"
    package = tmp_path / "package"
    monkeypatch.setattr("platformdirs.user_cache_dir", lambda *_, **__: str(cache))
    monkeypatch.setattr(
        "platformdirs.user_data_dir", lambda *_, **__: str(tmp_path / "data" / "sd2-studio")
    )
    monkeypatch.setattr("sd2core.numerics.compiled._PACKAGE", package)
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    caches = [
        *(user_cache(name) for name in ("contents", "ladder", "models", "pace", FINGERPRINT)),
        package / "__pycache__" / FINGERPRINT,
    ]
    for folder in caches:
        fill(folder / "inner")
    return caches


def fill(folder: Path) -> None:
    folder.mkdir(parents=True)
    (folder / "file").write_bytes(bytes(1000))


@pytest.fixture
def not_caches(tmp_path: Path) -> list[Path]:
    """What is the user's own, or another program's."""
    kept = [user_data(name) for name in ("recovery", "models", "runs", "exports")]
    kept += [tmp_path / "cache" / "other", tmp_path / "package" / "__pycache__" / "kernels-of-mine"]
    for folder in kept:
        fill(folder)
    return kept


def answer(monkeypatch: pytest.MonkeyPatch, word: str) -> None:
    monkeypatch.setattr("sys.stdin.isatty", lambda: True, raising=False)
    monkeypatch.setattr("builtins.input", lambda question: print(question) or word)


def test_caches_are_listed_with_their_sizes_and_removed(
    sd2: Sd2, places: list[Path], not_caches: list[Path]
) -> None:
    outcome = sd2("doctor", "--clean", "--yes")
    assert outcome.code == 0, outcome.err
    for path in places:
        assert f"1 kB  {path}" in outcome.out
        assert not path.exists()
    assert not user_cache("").exists()
    assert all((path / "file").is_file() for path in not_caches)
    assert sd2("doctor", "--clean").out == "There are no caches\n"


@pytest.mark.parametrize(("word", "gone"), [("y", True), ("Y", True), ("", False), ("no", False)])
def test_it_asks(
    sd2: Sd2, places: list[Path], monkeypatch: pytest.MonkeyPatch, word: str, gone: bool
) -> None:
    answer(monkeypatch, word)
    outcome = sd2("doctor", "--clean")
    assert outcome.code == 0, outcome.err
    assert "Remove them?" in outcome.out
    assert all(path.exists() is not gone for path in places)


def test_without_a_terminal_it_lists_only(sd2: Sd2, places: list[Path]) -> None:
    outcome = sd2("doctor", "--clean")
    assert outcome.code == 1
    assert str(places[0]) in outcome.out
    assert "--yes" in outcome.err
    assert all(path.exists() for path in places)


def test_edits_to_recover_stay_where_caches_and_data_have_one_place(
    sd2: Sd2, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("platformdirs.user_data_dir", lambda *_, **__: str(user_cache("")))
    fill(user_data("recovery"))
    assert sd2("doctor", "--clean", "--yes").code == 0
    assert (user_data("recovery") / "file").is_file()
    assert user_cache("models").is_dir()


def test_what_cannot_be_removed_is_named(
    sd2: Sd2, places: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sd2core.cli.preparing.remove", lambda path: None)
    outcome = sd2("doctor", "--clean", "--yes")
    assert outcome.code == 1
    assert f"{places[-1]} could not be removed" in outcome.err


def test_yes_goes_with_clean(sd2: Sd2) -> None:
    outcome = sd2("doctor", "--yes")
    assert outcome.code == 1
    assert "without --clean" in outcome.err
