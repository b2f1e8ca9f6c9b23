"""What a trained model gains, on maps whose peaks are known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QObject, Signal

from sd2app.session.maps import MapModel
from sd2app.session.session import Maps
from sd2app.training import result as training_use
from sd2app.training.result import ModelAdoption, gain_rows, gain_summary
from sd2core.maps import DopplerMap
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase

AXIS = VelocityAxis(8, 2.0)  # bins of 0.5 m/s


class FakeFolder:
    def __init__(self, path: Path) -> None:
        self.path = path
        self.best = path / "best.safetensors"


class FakeRun:
    has_model = True

    def __init__(self, path: Path) -> None:
        self.folder = FakeFolder(path)


class FakeTraining:
    def __init__(self, path: Path) -> None:
        self.run = FakeRun(path)


class FakeDenoising(QObject):
    changed = Signal()

    def __init__(self, path: Path | None, has_recording: bool = True) -> None:
        super().__init__()
        self.path, self.busy, self.comparing = path, False, False
        self._has_recording = has_recording

    def use(self, path: Path | None) -> None:
        if self._has_recording:
            self.path = path
            self.changed.emit()

    def set_comparing(self, comparing: bool) -> None:
        self.comparing = comparing
        self.changed.emit()


def peaks_at(bins: list[int], kind: str = "synthetic", start_s: float = 0.0) -> DopplerMap:
    values = np.zeros((8, len(bins)), np.float32)
    values[bins, np.arange(len(bins))] = 1.0
    timebase = Timebase(start_s + np.arange(len(bins)) / 30.0)
    return DopplerMap(values, AXIS, timebase, kind=kind, unit="power")


@pytest.fixture
def run(tmp_path) -> Path:
    folder = tmp_path / "s4 campaign"
    folder.mkdir()
    (folder / "best.safetensors").write_bytes(b"weights")
    return folder


@pytest.fixture
def made(qtbot, run, tmp_path, monkeypatch):
    monkeypatch.setattr(training_use, "CALM_MS", 1)

    def make(denoise: FakeDenoising) -> tuple[ModelAdoption, dict[str, MapModel]]:
        tracks = {name: MapModel(name) for name in ("plain", "before", "now", "radar")}
        maps = Maps(*(tracks[name] for name in ("plain", "now", "before", "radar")))
        use = ModelAdoption(FakeTraining(run), denoise, maps, lambda: tmp_path / "models")
        return use, tracks

    return make


def test_the_gain_is_told_against_the_radar(made, qtbot, run, tmp_path) -> None:
    denoise = FakeDenoising(tmp_path / "denoiser.safetensors")
    use, tracks = made(denoise)
    # The radar's clock starts a frame later, and has a frame more.
    tracks["radar"].set_map(peaks_at([3, 3, 5, 5, 7], "simulated"))
    tracks["radar"].set_offset(1 / 30.0)
    tracks["plain"].set_map(peaks_at([0, 1, 1, 3, 3]))  # two bins off from its second frame on
    use.use()
    assert denoise.path == tmp_path / "models" / "s4 campaign.safetensors"
    assert denoise.path.read_bytes() == b"weights"
    assert denoise.comparing
    assert use.run == run
    tracks["before"].set_map(peaks_at([0, 3, 2, 5, 4], "denoised"))  # one off in two of four
    tracks["now"].set_map(peaks_at([0, 3, 3, 5, 4], "denoised"))  # one off in one of four
    qtbot.waitUntil(lambda: use.gain is not None and use.gain.before_mps is not None)
    gain = use.gain
    assert gain.frames == 4
    assert gain.plain_mps == pytest.approx(1.0)
    assert gain.before_mps == pytest.approx(0.25)
    assert gain.now_mps == pytest.approx(0.125)
    assert gain_rows(gain) == [
        ("not denoised", "1.000 m/s"),
        ("before, denoiser", "0.250 m/s (−75 %)"),
        ("this model", "0.125 m/s (−88 %)"),
    ]
    assert "the simulated radar's" in gain_summary(gain, True)
    assert "worse" not in gain_summary(gain, True)
    tracks["now"].set_map(peaks_at([7, 7, 7, 0, 0], "denoised"))
    qtbot.waitUntil(lambda: use.gain.now_mps > 1.0)
    assert "worse than no denoising" in gain_summary(use.gain, True)
    use.go_back()
    assert denoise.path == tmp_path / "denoiser.safetensors"
    assert use.gain is None
    use.close()


def test_figures_of_another_map_are_marked_old_until_there_are_new_ones(made, qtbot, tmp_path):
    use, tracks = made(FakeDenoising(tmp_path / "denoiser.safetensors"))
    for name, peaks in (("radar", [3, 3, 3]), ("plain", [1, 1, 1]), ("now", [3, 3, 3])):
        tracks[name].set_map(peaks_at(peaks))
    tracks["before"].set_map(peaks_at([2, 2, 2]))
    use.use()
    qtbot.waitUntil(lambda: use.gain is not None)
    assert (use.gain.now_mps, use.gain.before_mps, use.is_old) == (0.0, 0.5, False)
    tracks["before"].set_map(None)  # not shown, but of the same maps
    tracks["plain"].set_map(peaks_at([2, 2, 2]))  # the sensor moved
    assert use.is_old
    assert gain_summary(use.gain, True, is_old=True).startswith("Old")
    use.denoise.busy = True  # its map comes in pieces
    tracks["now"].set_map(peaks_at([2, 2, 2]), np.array([True, False, False]))
    qtbot.wait(20)
    assert use.is_old
    use.denoise.busy = False
    tracks["now"].set_map(peaks_at([2, 2, 2]))
    qtbot.waitUntil(lambda: not use.is_old)
    assert (use.gain.now_mps, use.gain.before_mps) == (0.5, None)


def test_nothing_is_told_while_a_map_is_on_its_way_or_without_a_radar(made, qtbot) -> None:
    denoise = FakeDenoising(None)
    use, tracks = made(denoise)
    tracks["plain"].set_map(peaks_at([1, 2]))
    tracks["now"].set_map(peaks_at([1, 2], "denoised"))
    use.use()
    assert not denoise.comparing  # there was nothing before
    qtbot.wait(20)
    assert use.gain is None
    assert "Open a recording with a radar" in gain_summary(None, use.has_radar)
    denoise.busy = True
    tracks["radar"].set_map(peaks_at([1, 2], "real"))
    qtbot.wait(20)
    assert use.gain is None
    assert "Denoising" in gain_summary(None, use.has_radar)
    denoise.busy = False
    denoise.changed.emit()
    qtbot.waitUntil(lambda: use.gain is not None)
    assert use.gain.now_mps == 0.0
    use.close()


def test_without_a_recording_the_model_is_kept_and_that_is_said(made, tmp_path) -> None:
    use, _ = made(FakeDenoising(None, has_recording=False))
    said: list[str] = []
    use.noted.connect(said.append)
    use.use()
    assert (tmp_path / "models" / "s4 campaign.safetensors").exists()
    assert said == ["The model is kept as s4 campaign. Open a recording to denoise it with that."]
    assert use.run is None
    use.close()


def test_a_model_that_cannot_be_kept_is_a_failure_in_words(made, run, tmp_path) -> None:
    use, _ = made(FakeDenoising(None))
    (tmp_path / "models").write_text("a file is in the way")
    said: list[str] = []
    use.failed.connect(said.append)
    use.use()
    assert len(said) == 1
    assert use.run is None
