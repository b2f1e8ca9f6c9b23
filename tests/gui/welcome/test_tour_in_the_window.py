"""The tour in the window: it points, waits for the hand, and is never in the way."""

from __future__ import annotations

import pytest
from label_hands import key
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLabel
from window_models import models_of

from sd2app.maps.heatmap import HeatmapView
from sd2app.welcome import feature
from sd2app.welcome.feature import Ring


@pytest.fixture
def touring(window, qtbot, monkeypatch):
    """The window with the tour begun; the small recording stands for the sample."""
    monkeypatch.setattr(feature, "is_bundled", lambda path: True)
    window.activateWindow()
    qtbot.waitUntil(window.isActiveWindow, timeout=5000)
    window.action("tour").trigger()
    yield window
    window.features.welcome.tour.leave()


def text_of(callout) -> str:
    return "\n".join(one.text() for one in callout.findChildren(QLabel))


def at(window) -> int:
    return window.features.welcome.tour.kept


def test_it_points_at_a_thing_without_hiding_it(touring) -> None:
    tour, callout = touring.features.welcome.tour, touring.tour
    for number, step in enumerate(tour.steps):
        touring.session.settings.set_value("tour/step", number)
        tour.changed.emit()
        assert callout.isVisible()
        assert touring.findChild(Ring).isVisible(), step.title
        assert touring.rect().contains(callout.geometry()), step.title
        assert "{" not in text_of(callout)


def test_playing_and_clicking_into_a_gesture_are_seen(touring, qtbot) -> None:
    playback = models_of(touring).playback
    key(touring, "Space")
    qtbot.wait(400)
    assert at(touring) == 0  # still playing
    key(touring, "Space")
    qtbot.waitUntil(lambda: at(touring) == 1)

    view = next(one for one in touring.findChildren(HeatmapView) if one.isVisible())
    span = models_of(touring).labels.labels.spans[0]
    x = view.scale.x_of((span.start_s + span.end_s) / 2)
    QTest.mouseClick(view, Qt.MouseButton.LeftButton, pos=QPoint(round(x), view.height() // 2))

    qtbot.waitUntil(lambda: at(touring) == 2)
    assert span.start_s <= playback.time_s < span.end_s


def test_a_moved_sensor_and_its_undoing_are_seen(touring, qtbot) -> None:
    tour = touring.features.welcome.tour
    tour.skip()
    tour.skip()
    edits = touring.session.edits
    edits.begin_sensor_drag()
    edits.drag_sensor((0.5, 0.0, 0.5))
    qtbot.wait(400)
    assert at(touring) == 2  # the hand still holds it
    edits.end_drag()
    qtbot.waitUntil(lambda: at(touring) == 3)

    key(touring, "Z", Qt.KeyboardModifier.ControlModifier)

    qtbot.waitUntil(lambda: at(touring) == 4)


@pytest.mark.parametrize("by", ["escape", "later"])
def test_it_can_be_left_and_goes_on_there(touring, qtbot, by) -> None:
    QTest.mouseClick(touring.tour.skip, Qt.MouseButton.LeftButton)
    assert at(touring) == 1

    if by == "escape":
        key(touring, "Escape")
    else:
        QTest.mouseClick(touring.tour.later, Qt.MouseButton.LeftButton)

    assert touring.tour.isHidden()
    assert touring.findChild(Ring).isHidden()
    touring.action("tour").trigger()
    assert touring.tour.isVisible()
    assert "2 of" in text_of(touring.tour)


def test_the_ring_lets_the_mouse_through(touring) -> None:
    ring = touring.findChild(Ring)
    assert ring.isVisible()
    middle = ring.geometry().center()

    assert touring.childAt(middle) is not ring
