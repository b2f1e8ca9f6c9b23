from __future__ import annotations

import hashlib
from pathlib import Path

import pytest
from cli_outcome import Sd2

from sd2core.body import landmark_models as places


def test_model_files_of_the_user(sd2: Sd2, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    known = hashlib.sha256(b"a model").hexdigest()
    monkeypatch.setattr(places, "_SHA256", dict.fromkeys(places._SHA256, known))
    monkeypatch.setattr(places, "default_folder", lambda: tmp_path / "cache")
    monkeypatch.delenv(places.ENVIRONMENT, raising=False)
    for name in places._SHA256:
        (tmp_path / name).write_bytes(b"a model")
        assert f"{tmp_path / 'cache'}" in sd2("fetch-models", "--from", tmp_path / name).out
    assert sd2("fetch-models", "--if-missing").out.startswith("The landmark models are in")
    outcome = sd2("fetch-models", "--from", tmp_path / "none.whl")
    assert outcome.code == 1
    assert "none.whl does not exist" in outcome.err
