"""Receivers and transmitters of a capture, offered in the Sensor panel where there are several."""

from __future__ import annotations

import numpy as np
import pytest
from finding import named
from window_models import models_of

from sd2app.sensor.panel import SensorPanel
from sd2app.widgets.inputs import Choice
from tests.core.io.radar.dca1000_files import TiRecording, write_ti


@pytest.fixture
def panel(empty_window):
    (panel,) = empty_window.findChildren(SensorPanel)
    return panel


def shown(window, path, qtbot):
    c = models_of(window)
    with qtbot.waitSignal(c.document.opened, timeout=30_000):
        window.open_paths([path])
    qtbot.waitUntil(lambda: c.real.map is not None, timeout=30_000)
    return c


def channel(panel, which):
    return named(panel, f"{which} whose signal is shown", Choice)


def offered(panel):
    return [
        [choice.itemText(place) for place in range(choice.count())]
        for choice in (channel(panel, "Receiver"), channel(panel, "Transmitter"))
        if not choice.isHidden()
    ]


def test_only_what_there_is_several_of_is_offered(empty_window, panel, qtbot, tmp_path):
    every = "all (mean power)"
    shown(empty_window, write_ti(tmp_path / "a", TiRecording(transmitters=3)), qtbot)
    assert offered(panel) == [[every, "1", "2"], [every, "1", "2", "3"]]
    shown(empty_window, write_ti(tmp_path / "b", TiRecording(receivers=1)), qtbot)
    assert offered(panel) == []


def test_a_receiver_is_chosen_by_hand(empty_window, panel, qtbot, tmp_path):
    c = shown(empty_window, write_ti(tmp_path, TiRecording()), qtbot)
    every = c.real.map.values.copy()
    channel(panel, "Receiver").setCurrentIndex(2)
    assert c.document.recording.radar_receiver == 2
    qtbot.waitUntil(lambda: not np.array_equal(c.real.map.values, every), timeout=30_000)
    assert c.real.title == "Real, receiver 2"
    c.document.undo_stack.undo()
    assert channel(panel, "Receiver").currentText() == "all (mean power)"
    qtbot.waitUntil(lambda: np.array_equal(c.real.map.values, every), timeout=30_000)
