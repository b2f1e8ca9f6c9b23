"""Layouts by their tabs and keys: what each shows, and how much of the window maps have."""

from __future__ import annotations

import pytest
from finding import panel_of
from PySide6.QtCore import QPoint, QRect, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QSlider
from whole_window import close_window
from window_models import models_of

from sd2app.maps.level_bar import ColourScale
from sd2app.session.display import LAYOUTS
from sd2app.settings import Settings
from sd2app.shell.parts import Parts
from sd2app.shell.window import LayoutTabs, MainWindow
from sd2app.suggestions.feature import SuggestionBar

LEFT = Qt.MouseButton.LeftButton


@pytest.fixture
def windows(qtbot, compiled_kernels, fake, fake_models, fake_classes):
    """Makes windows one after the other on the same settings."""
    settings = Settings.forgetful()
    made: list[MainWindow] = []

    def make(*size_px: int, recording=None) -> MainWindow:
        if made:
            close_window(made[-1])
        parts = Parts(
            accuracy=fake, denoisers=fake_models.library, classifiers=fake_classes.library
        )
        window = MainWindow(settings, parts)
        window.resize(*size_px)
        window.show()
        window.populate()
        window.resize(*size_px)
        qtbot.waitUntil(lambda: window.settled, timeout=120_000)
        if recording is not None:
            window.open_paths([recording])
            document = models_of(window).document
            qtbot.waitUntil(lambda: document.content is not None, timeout=60_000)
            qtbot.waitUntil(lambda: window.settled, timeout=120_000)
        made.append(window)
        return window

    yield make
    fake.gate.set()
    fake_classes.gate.set()
    close_window(made[-1])


def choose(window: MainWindow, name: str) -> None:
    """Click the tab of a layout."""
    tabs = window.findChild(LayoutTabs)
    QTest.mouseClick(tabs, LEFT, pos=tabs.tabRect(list(LAYOUTS).index(name)).center())
    QApplication.processEvents()


def share_of_maps(window: MainWindow) -> float:
    """Share of the window's area that all its maps have together, as far as they are in view."""
    stack, area = window.maps, 0
    seen = stack.viewport().rect()
    for name in stack.shown:
        view = stack.view(name)
        top = view.mapTo(stack.viewport(), QPoint(0, 0))
        part = QRect(top, view.size()).intersected(seen)
        area += part.width() * part.height()
    return area / (window.width() * window.height())


@pytest.mark.parametrize(("size", "least"), [((1280, 720), 0.45), ((1600, 1000), 0.55)])
def test_maps_have_most_of_the_window_to_look_and_to_label(
    windows, qtbot, size, least, small_recording
) -> None:
    window = windows(*size, recording=small_recording)
    assert (window.width(), window.height()) == size
    for name in ("Look", "Label"):
        choose(window, name)
        assert len(window.maps.shown) >= 2
        for asked in ("", "with suggestions to decide on"):
            if asked:
                window.action("suggest").trigger()
                qtbot.waitUntil(window.findChild(SuggestionBar).isVisible)
            QApplication.processEvents()
            assert share_of_maps(window) >= least, (name, asked)
        models_of(window).suggestions.stop()
    assert not panel_of(window, "tracks").findChildren(QSlider), "time is scrubbed at one place"


def test_each_layout_has_its_panes_and_remembers_what_was_made_of_it(
    windows, small_recording
) -> None:
    window = windows(1280, 720, recording=small_recording)
    video, scene = panel_of(window, "video"), panel_of(window, "scene")
    assert video.isVisible()
    assert scene.isVisible()
    choose(window, "Label")
    assert (video.isVisible(), scene.isVisible(), window.side.folded) == (True, False, True)
    window.action("pane_scene").trigger()
    window.side.bring_up("Labels")
    assert scene.isVisible()
    QTest.keyClick(window, Qt.Key.Key_F7)
    assert window.findChild(LayoutTabs).tabText(2) == window.session.layouts.name == "Learn"
    assert (video.isVisible(), scene.isVisible(), window.side.shown) == (False, False, "Train")
    assert not window.side.folded
    assert window.action("layout_learn").isChecked()
    again = windows(1280, 720, recording=small_recording)
    assert again.session.layouts.name == "Learn"
    choose(again, "Label")
    assert panel_of(again, "scene").isVisible()
    assert (again.side.shown, again.side.folded) == ("Labels", False)


def test_what_there_is_not_has_no_pane(windows, qtbot, small_recording) -> None:
    window = windows(1280, 720, recording=small_recording / "mesh.npz")
    assert not panel_of(window, "video").isVisible()
    assert panel_of(window, "scene").isVisible()
    with_both = window.maps.width()
    window.open_paths([small_recording / "radar"])
    document = models_of(window).document
    qtbot.waitUntil(lambda: document.mesh is None and window.settled, timeout=60_000)
    assert not panel_of(window, "scene").isVisible()
    assert window.maps.width() > with_both + 200


def test_this_frame_folds_into_the_edge_of_the_maps(windows, small_recording) -> None:
    window = windows(1280, 720, recording=small_recording)
    scale, edge = window.findChild(ColourScale), panel_of(window, "spectrum")
    assert scale.isVisible()
    folded_px, wide_px = edge.width(), window.maps.width()
    assert folded_px < 40
    QTest.mouseClick(scale, LEFT)
    QApplication.processEvents()
    assert not scale.isVisible()
    assert edge.width() > 200
    window.action("pane_spectrum").trigger()
    QApplication.processEvents()
    assert (edge.width(), window.maps.width()) == (folded_px, wide_px)
