"""The denoised map in the window, by mouse and keys; models with known answers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from answering import once_asked
from copied import copied_record
from dropping import drop
from fake_denoisers import fading
from finding import button_of
from PySide6.QtCore import QPoint, Qt, QTimer
from PySide6.QtGui import QColor, QGuiApplication
from PySide6.QtWidgets import QApplication, QFileDialog, QLabel, QPushButton, QTextBrowser
from window_models import models_of

from sd2app.figures.feature import MapFigureDialog
from sd2app.maps.feature import MapExportDialog
from sd2app.maps.readout import reading_lines
from sd2app.maps.spectrum import SpectrumView
from sd2app.widgets.model_menu import ModelButton, ModelCardDialog, ModelMenu
from sd2core.denoise.files import LIMBS_MODEL, MAP_MODEL
from sd2core.errors import Sd2Error
from sd2core.maps import DopplerMap


@pytest.fixture
def fake_models(fake_models, tmp_path):
    """Two models in files; the window has none by default."""
    for name, gain in (("kitchen", 2.0), ("hall", 3.0)):
        (path := tmp_path / f"{name}.safetensors").write_bytes(b"weights")
        fake_models.add(path, gain, about={"limits": ["Knows kitchens only"]})
    return fake_models


def wait(window, qtbot):
    qtbot.waitUntil(lambda: window.settled and models_of(window).synthesis.complete, timeout=20_000)


def choose(window, qtbot, button, words):
    """Click on the button, then on the entry of its menu that begins with some words."""

    def click():
        menu = QApplication.activePopupWidget()
        if not isinstance(menu, ModelMenu) or not menu.isVisible():
            QTimer.singleShot(20, click)
            return
        action = next(
            one for one in menu.actions() if one.text().replace("&", "").startswith(words)
        )
        qtbot.mouseClick(menu, Qt.MouseButton.LeftButton, pos=menu.actionGeometry(action).center())

    QTimer.singleShot(20, click)
    # A menu that opens with an entry under a still pointer takes no click on that entry.
    qtbot.mouseMove(button)
    qtbot.mouseClick(button, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: QApplication.activePopupWidget() is None, timeout=5_000)
    window.activateWindow()  # keys belong to it again
    qtbot.waitUntil(window.isActiveWindow, timeout=5_000)
    wait(window, qtbot)


def shown_button(window):
    (button,) = (one for one in window.findChildren(ModelButton) if one.isVisible())
    return button


def is_of(context, gain):
    expected = fading(context.synthetic.map.values, np.float32(gain))
    return np.allclose(context.denoised.map.values, expected, rtol=1e-5, atol=1e-9)


@pytest.fixture
def denoised(window, fake_models, qtbot):
    """The window on the ball, denoised."""
    choose(window, qtbot, shown_button(window), "kitchen")
    return window


def test_a_click_chooses_a_model_and_the_track_appears(window, qtbot):
    c, tracks = models_of(window), window.maps
    assert not tracks.denoised.isVisible()
    assert shown_button(window).text() == "No denoiser"
    choose(window, qtbot, shown_button(window), "kitchen")
    assert is_of(c, 2.0)
    assert tracks.denoised.isVisible()
    tops = [tracks.synthetic.y(), tracks.denoised.y(), tracks.real.y()]
    assert tops == sorted(tops)
    assert shown_button(window).text() == "kitchen"
    assert "simulated data only" in tracks.denoised.status()
    choose(window, qtbot, shown_button(window), "hall")
    assert is_of(c, 3.0)
    qtbot.keyClick(window, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    wait(window, qtbot)
    assert is_of(c, 2.0)
    choose(window, qtbot, shown_button(window), "No model")
    assert c.denoised.map is None
    assert not tracks.denoised.isVisible()


@pytest.mark.one_in(2)
@pytest.mark.parametrize("fits", [True, False])
def test_a_map_that_comes_later_moves_nothing(
    empty_window, fake_models, qtbot, small_recording, fits
):
    window, c, tracks = empty_window, models_of(empty_window), empty_window.maps
    fake_models.add(Path(f"/models/{MAP_MODEL}.safetensors"), 2.0)
    fake_models.add(Path(f"/models/{LIMBS_MODEL}.safetensors"), 7.0, parts=("trunk", "forearm.R"))
    fake_models.gate.clear()
    with qtbot.waitSignal(c.document.opened, timeout=20_000):
        window.open_paths([small_recording])
    qtbot.waitUntil(lambda: bool(fake_models.asked), timeout=20_000)
    assert c.denoised.map is None
    views = (tracks.synthetic, tracks.denoised, tracks.real)
    assert all(view.isVisible() for view in views)
    assert shown_button(window).text() != "No denoiser"
    before = [view.geometry() for view in views]
    if not fits:
        fake_models.failure = Sd2Error("The model is not for this map", "another")
    fake_models.gate.set()
    wait(window, qtbot)
    if fits:
        assert is_of(c, 2.0)
        assert [view.geometry() for view in views] == before
    else:
        qtbot.waitUntil(lambda: not tracks.denoised.isVisible(), timeout=5_000)


def test_a_model_file_that_is_dropped_is_used(window, fake_models, qtbot, tmp_path):
    drop(window, tmp_path / "hall.safetensors")
    qtbot.waitUntil(lambda: models_of(window).denoise.path == tmp_path / "hall.safetensors")
    wait(window, qtbot)
    assert is_of(models_of(window), 3.0)
    drop(window, tmp_path / "other.safetensors")
    qtbot.waitUntil(lambda: "no model file" in window.messages.text)
    assert is_of(models_of(window), 3.0)


def test_the_difference_has_a_sign_and_says_what_it_is(denoised, qtbot):
    c, view = models_of(denoised), denoised.maps.difference
    assert not view.isVisible()
    qtbot.keyClick(denoised, Qt.Key.Key_X)
    assert view.isVisible()
    qtbot.wait(100)  # until the tracks have found their heights
    assert view.title() == "Denoised − radar (simulated)"
    assert "as strong altogether" in view.status()
    levels, palette = c.display.levels, c.display.palette
    # The ball is seen by the denoiser where the radar, pure noise, sees little: and the
    # other way round at velocities that the ball does not have.
    time_s, fast, slow = 0.5, 1.2, -1.7
    cells = {v: (c.denoised.read(time_s, v), c.real.read(time_s, v)) for v in (fast, slow)}
    # Made as strong as the radar's map where both know something.
    kept = [n for n in range(32) if n not in view._difference.blank_bins]
    ours, theirs = (track.map.values[kept].sum(axis=0).mean() for track in (c.denoised, c.real))
    assert view._difference.gain == pytest.approx(theirs / ours, rel=0.1)
    gain = view._difference.gain
    shade = {
        v: float(c.real.shade(np.float32(gain * one.value), levels))
        - float(c.real.shade(np.float32(other.value), levels))
        for v, (one, other) in cells.items()
    }
    assert shade[fast] > 0.1
    assert shade[slow] < -0.1
    image = view.grab().toImage()
    for velocity, name in ((fast, palette.denoised), (slow, palette.real)):
        x, y = round(view.scale.x_of(time_s)) + 3, round(view.y_of(velocity))
        hue = image.pixelColor(x, y).hue()
        assert abs(hue - QColor(name).hue()) < 12, (velocity, hue)
    qtbot.mouseMove(view, QPoint(round(view.scale.x_of(time_s)) + 2, round(view.y_of(fast))))
    reading = c.pointer.reading
    assert reading.track == "Denoised − radar (simulated)"
    wanted = f"{shade[fast] * (levels.high_db - levels.low_db):+.1f} dB"
    assert reading.text == wanted, reading
    assert wanted in reading_lines(reading)[1]
    qtbot.mouseMove(view, QPoint(round(view.scale.x_of(time_s)), round(view.y_of(0.0))))
    assert c.pointer.reading.text == "not defined"
    qtbot.keyClick(denoised, Qt.Key.Key_X)
    assert not view.isVisible()


def test_without_a_model_the_difference_says_why_it_cannot_be(window, qtbot):
    action = window.action("difference")
    assert not action.isEnabled()
    assert "no denoised map" in action.toolTip()
    qtbot.keyClick(window, Qt.Key.Key_X)
    assert not window.maps.difference.isVisible()


@pytest.mark.slow
def test_playing_live_shows_frames_as_the_clock_reaches_them(denoised, fake_models, qtbot):
    c = models_of(denoised)
    whole = c.denoised.map.values.copy()
    qtbot.keyClick(denoised, Qt.Key.Key_V)
    assert c.denoise.live
    assert "live" not in c.denoised.status
    c.playback.seek_frame(10)
    qtbot.keyClick(denoised, Qt.Key.Key_Space)
    qtbot.waitUntil(lambda: fake_models.steps > 8, timeout=10_000)
    # What has been denoised is shown a little later.
    qtbot.waitUntil(lambda: bool(c.denoised.covered[10:14].all()), timeout=10_000)
    covered, frame = c.denoised.covered.copy(), c.playback.frame
    assert covered[10:14].all()
    assert not covered[:10].any()
    assert not covered[frame + 1 :].any()
    assert "live, frame by frame" in c.denoised.status
    # A causal model that begins at frame 10 knows nothing of the frames before.
    values = c.synthetic.map.values[:, 10:14]
    np.testing.assert_allclose(
        c.denoised.map.values[:, 10:14], fading(values, np.float32(2.0)), rtol=1e-5, atol=1e-9
    )
    c.playback.seek_frame(2)
    qtbot.waitUntil(lambda: bool(c.denoised.covered[2:6].all()), timeout=10_000)
    assert not c.denoised.covered[10:].any() or c.playback.frame >= 10
    assert fake_models.sessions >= 2
    qtbot.keyClick(denoised, Qt.Key.Key_Space)
    wait(denoised, qtbot)
    assert c.denoised.covered is None
    assert "live" not in c.denoised.status
    np.testing.assert_allclose(c.denoised.map.values, whole, rtol=1e-5, atol=1e-9)
    assert c.settings.stored("denoise_live", False)


@pytest.mark.slow
def test_the_model_before_stands_below_this_one(denoised, qtbot):
    c, tracks = models_of(denoised), denoised.maps
    assert not denoised.action("compare_models").isEnabled()
    choose(denoised, qtbot, shown_button(denoised), "hall")
    qtbot.keyClick(denoised, Qt.Key.Key_B)
    wait(denoised, qtbot)
    assert tracks.before.isVisible()
    assert tracks.denoised.y() < tracks.before.y() < tracks.real.y()
    np.testing.assert_allclose(
        c.before.map.values,
        fading(c.synthetic.map.values, np.float32(2.0)),
        rtol=1e-5,
        atol=1e-9,
    )
    assert "kitchen" in tracks.before.status()
    qtbot.keyClick(denoised, Qt.Key.Key_B)
    assert not tracks.before.isVisible()


@pytest.mark.slow
def test_the_spectrum_has_a_curve_of_it(denoised, qtbot):
    view, c = denoised.findChild(SpectrumView), models_of(denoised)

    def pixels(name):
        image = view.grab().toImage()
        wanted = QColor(getattr(c.display.palette, name)).getRgb()[:3]
        data = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), -1, 4)
        below = data[90:, : image.width(), 2::-1].astype(int)  # not the legend
        return int((np.abs(below - wanted).max(axis=2) < 30).sum())

    c.playback.seek(0.5)
    assert pixels("denoised") > 30
    c.denoise.use(None)
    wait(denoised, qtbot)
    assert pixels("denoised") == 0


def test_the_card_says_what_the_model_is(denoised, qtbot):
    texts = []

    def read(dialog):
        texts.extend(label.text() for label in dialog.findChildren(QLabel))
        texts.extend(dialog.findChild(QTextBrowser).toPlainText().splitlines())
        dialog.reject()

    once_asked(ModelCardDialog, read)
    denoised.action("model_card").trigger()
    assert "kitchen" in texts
    assert "simulated data only" in texts
    assert "Knows kitchens only" in texts
    assert "GRU, 4,321 parameters" in texts


@pytest.mark.slow
def test_map_and_figure_are_exported(denoised, qtbot, tmp_path, monkeypatch):
    c = models_of(denoised)
    name = tmp_path / "out.npz"
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *_: (str(name), ""))

    def write(dialog: MapExportDialog) -> None:
        qtbot.mouseClick(button_of(dialog, "Copy command"), Qt.MouseButton.LeftButton)
        button = next(one for one in dialog.findChildren(QPushButton) if one.text() == "Export…")
        qtbot.mouseClick(button, Qt.MouseButton.LeftButton)

    once_asked(MapExportDialog, write)
    denoised.action("export_denoised").trigger()
    first, second = QGuiApplication.clipboard().text().split(" && ")
    assert first.startswith("sd2 synth ")
    QGuiApplication.clipboard().setText(second)
    assert (copied_record().map, copied_record().out.name) == (
        Path("ball-synthetic.npz"),
        "ball-denoised.npz",
    )
    made = DopplerMap.load(name)
    assert made.kind == "denoised"
    np.testing.assert_allclose(made.values, c.denoised.map.values, rtol=1e-5, atol=1e-9)
    name = tmp_path / "maps.svg"
    denoised.action("difference").trigger()

    def export(dialog: MapFigureDialog) -> None:
        qtbot.mouseClick(button_of(dialog, "Copy command"), Qt.MouseButton.LeftButton)
        button = next(one for one in dialog.findChildren(QPushButton) if one.text() == "Export…")
        qtbot.mouseClick(button, Qt.MouseButton.LeftButton)

    once_asked(MapFigureDialog, export)
    denoised.action("export_maps").trigger()
    line = QGuiApplication.clipboard().text()
    assert line.startswith("sd2 labels figure ")
    assert "--maps synthetic,denoised,radar" in line
    text = name.read_text(encoding="utf-8")
    for words in (
        "Synthetic",
        "Denoised · kitchen (simulated data only)",
        "Radar (simulated)",
        "Denoised − radar (simulated)",
    ):
        assert words in text, words
    assert denoised.messages.text == ""
