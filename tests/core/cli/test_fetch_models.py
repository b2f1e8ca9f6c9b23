"""``sd2 doctor --fetch-models``, and the older ``sd2 fetch-models``."""

from __future__ import annotations

import hashlib
from pathlib import Path

import pytest
from cli_outcome import Sd2

from sd2core.body import landmark_models as places

COMMANDS = [("doctor", "--fetch-models"), ("fetch-models",)]


@pytest.mark.parametrize("words", COMMANDS)
def test_model_files_of_the_user(
    sd2: Sd2, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...]
) -> None:
    known = hashlib.sha256(b"a model").hexdigest()
    monkeypatch.setattr(places, "_SHA256", dict.fromkeys(places._SHA256, known))
    monkeypatch.setattr(places, "default_folder", lambda: tmp_path / "cache")
    monkeypatch.delenv(places.ENVIRONMENT, raising=False)
    for name in places._SHA256:
        (tmp_path / name).write_bytes(b"a model")
        assert f"{tmp_path / 'cache'}" in sd2(*words, "--from", tmp_path / name).out
    there = sd2(*words, "--if-missing")
    assert there.out.startswith("The landmark models are in")
    assert ("`sd2 doctor --fetch-models`" in there.err) == (words == ("fetch-models",))
    outcome = sd2(*words, "--from", tmp_path / "none.whl")
    assert outcome.code == 1
    assert "none.whl does not exist" in outcome.err


@pytest.mark.parametrize("option", [("--from", "models"), ("--if-missing",)])
def test_options_of_fetching_go_with_it(sd2: Sd2, option: tuple[str, ...]) -> None:
    outcome = sd2("doctor", *option)
    assert outcome.code == 1
    assert f"{option[0]} is given without --fetch-models" in outcome.err


def test_one_job_at_a_time(sd2: Sd2) -> None:
    assert sd2("doctor", "--fetch-models", "--warm-up").code == 2
    assert sd2("doctor", "--fetch-models", "--clean").code == 2
