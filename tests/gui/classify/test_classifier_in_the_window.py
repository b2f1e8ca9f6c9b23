"""The classifier in the window, by mouse and keys; one with known answers."""

from __future__ import annotations

import shutil
from dataclasses import replace
from math import ceil

import fake_class_command
import numpy as np
import pytest
from answering import answer, once_asked
from dropping import drop, hover
from fake_classifiers import CLASSES, expected
from label_hands import CONTROL, LEFT, SHIFT, key
from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import QFileDialog, QLabel, QTextBrowser, QToolButton
from small_pairs import write_pairs
from window_models import models_of

from sd2app.classify.feature import ClassSetupView
from sd2app.classify.strip import ClassPlot, ClassReadout, ClassStrip, stacked_image
from sd2app.labels.timeline import LabelTimeline
from sd2app.shell.side_panel import RailButton
from sd2app.suggestions.feature import SuggestionBar
from sd2app.widgets.chart import ChartView
from sd2app.widgets.inputs import Choice, NumberBox, TypedLine
from sd2app.widgets.model_menu import ModelButton, ModelCardDialog
from sd2core.classify.defaults import WIDTH, pace_kind
from sd2core.classify.files import user_classifiers_folder
from sd2core.files.resources import resource_path
from sd2core.runs.pace import keep_pace


@pytest.fixture
def fake_classes(fake_classes, tmp_path):
    """One classifier in a file."""
    (path := tmp_path / "waves.safetensors").write_bytes(b"weights")
    fake_classes.add(path, kinds=("synthetic",))
    return fake_classes


@pytest.fixture
def classified(window, fake_classes, qtbot):
    """The window on the ball, which approaches and recedes once a second; nothing is marked."""
    c = models_of(window)
    (path,) = fake_classes.cards
    window.features.classify.drop_of(path).run()
    qtbot.waitUntil(lambda: c.classify.track.complete and not c.classify.busy, timeout=10_000)
    for _ in range(2):
        key(window, "N")
        key(window, "Backspace")
    c.playback.seek_frame(0)
    return window


def truth(window):
    return expected(models_of(window).synthetic.map.values.T)


def labels(window):
    return [(span.label, span.origin) for span in models_of(window).labels.labels.spans]


def found(window, qtbot):
    key(window, "G", SHIFT)
    qtbot.waitUntil(lambda: not models_of(window).suggestions.waiting, timeout=10_000)


def press(view, text, qtbot):
    (button,) = (
        one for one in view.findChildren(QToolButton) if one.isVisible() and one.text() == text
    )
    qtbot.mouseClick(button, LEFT)


# --- the read-out and the strip ---------------------------------------------------------------


def test_a_file_is_chosen_and_the_strip_appears(window, fake_classes, qtbot, monkeypatch):
    strip = window.findChild(ClassStrip)
    assert not strip.isVisible()
    (path,) = fake_classes.cards
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *_: (str(path), ""))
    window.action("open_classifier").trigger()
    qtbot.waitUntil(lambda: models_of(window).classify.track.complete, timeout=10_000)
    assert strip.isVisible()
    key(window, "I", SHIFT)
    assert not strip.isVisible()
    key(window, "I", SHIFT)
    assert strip.isVisible()
    menu = strip.findChild(ModelButton).menu()
    menu.aboutToShow.emit()
    entries = {action.text().replace("&", "").split("\t")[0]: action for action in menu.actions()}
    assert entries["waves"].isChecked()
    entries["No model"].trigger()
    assert not strip.isVisible()
    assert models_of(window).classify.reading is None


def test_the_readout_follows_keys_and_clicks(classified, qtbot):
    readout, plot = classified.findChild(ClassReadout), classified.findChild(ClassPlot)
    c, shares = models_of(classified), truth(classified)
    for _ in range(8):
        key(classified, "Right")
    for frame in (8, 40):
        if frame != 8:
            x = ceil(plot.scale.x_of(c.playback.timebase.time_of(frame)))
            qtbot.mouseClick(plot, LEFT, pos=QPoint(x, 10))
        assert c.playback.frame == frame
        best = int(shares[frame].argmax())
        assert readout.text == f"{CLASSES[best]} {100 * shares[frame, best]:.0f} %"
    classified.grab()  # all of it can be painted


@pytest.mark.slow
def test_what_belongs_to_another_sensor_is_not_shown_as_current(classified, fake_classes, qtbot):
    c, readout = models_of(classified), classified.findChild(ClassReadout)
    before = readout.text
    assert before
    fake_classes.gate.clear()
    # Typed: until the map has followed, what is on screen is of where the sensor was.
    c.edits.place_sensor(replace(c.sensor.sensor, position_m=(0.3, 0.0, 0.0)))
    assert readout.text == ""
    position = c.sensor.sensor.position_m
    c.edits.begin_sensor_drag()
    c.edits.drag_sensor((position[0] + 0.5, position[1], position[2]))
    qtbot.waitUntil(lambda: c.synthesis.moving, timeout=10_000)
    assert readout.text == ""
    c.edits.end_drag()
    fake_classes.gate.set()
    qtbot.waitUntil(
        lambda: c.synthesis.complete and c.classify.track.complete and not c.classify.busy,
        timeout=20_000,
    )
    shares = truth(classified)[c.playback.frame]
    assert readout.text == f"{CLASSES[int(shares.argmax())]} {100 * shares.max():.0f} %"


def test_the_strip_takes_no_room_from_the_panels(classified, qtbot):
    before = classified.size()
    classified.resize(960, 640)
    qtbot.waitUntil(lambda: classified.width() == 960)
    rail = classified.findChild(RailButton)
    # What is cut lies beyond the window.
    assert rail.mapTo(classified, rail.rect().bottomRight()).x() < 960
    strip = classified.findChild(ClassStrip)
    assert strip.minimumSizeHint().width() < 500
    classified.resize(before)


def test_another_map_is_looked_at(classified, qtbot):
    c, strip = models_of(classified), classified.findChild(ClassStrip)
    choice = strip.findChild(Choice)
    assert [choice.itemText(at) for at in range(choice.count())] == [
        "on synthetic", "on radar (simulated)",
    ]  # fmt: skip
    choice.setFocus()
    qtbot.keyClick(choice, Qt.Key.Key_Down)
    choice.activated.emit(choice.currentIndex())
    qtbot.waitUntil(lambda: c.classify.track.complete, timeout=10_000)
    assert c.classify.source is c.real
    assert not c.classify.knows_source


def test_the_strip_stacks_what_is_probable():
    shares = np.array([[0.5, 0.25, 0.25], [0.0, 1.0, 0.0]], np.float32)
    frames = np.array([0, 1, -1])
    image = stacked_image(shares, np.array([True, False]), frames, [1, 2, 3], 4)
    column = [[image.pixelColor(x, y).getRgb() for y in range(4)] for x in range(3)]
    # From the top: the last class, the middle one, twice the first.
    assert [pixel[2] for pixel in column[0]] == [3, 2, 1, 1]
    assert {pixel[2] for pixel in column[1]} == {2}
    assert column[0][0][3] == 255
    assert 0 < column[1][0][3] < 255  # not of the map as it is
    assert {pixel[3] for pixel in column[2]} == {0}


# --- predictions as suggestions ---------------------------------------------------------------


def test_found_by_a_key_decided_on_and_undone(classified, qtbot):
    c, bar = models_of(classified), classified.findChild(SuggestionBar)
    found(classified, qtbot)
    assert bar.isVisible()
    names = [label for label, _ in labels(classified)]
    assert set(names) == {"horizontal", "vertical"}
    assert {origin for _, origin in labels(classified)} == {"suggestion"}
    first = c.labels.selected[0]
    best = CLASSES.index(first.label)
    frames = slice(*c.playback.timebase.frames_between(first.start_s, first.end_s))
    assert first.confidence == pytest.approx(truth(classified)[frames, best].mean(), abs=1e-5)
    key(classified, "Y")
    taken = next(span for span in c.labels.labels.spans if span.origin == "person")
    assert (taken.label, taken.confidence) == (first.label, first.confidence)
    # The next one is corrected, and one is turned down.
    key(classified, "3")
    assert ("up-to-down", "person") in labels(classified)
    key(classified, "W")
    count = len(labels(classified))
    key(classified, "Z", CONTROL)
    assert len(labels(classified)) == count + 1
    key(classified, "Y", SHIFT)
    assert {origin for _, origin in labels(classified)} == {"person"}
    for _ in range(3):
        key(classified, "Z", CONTROL)
    assert {origin for _, origin in labels(classified)} == {"suggestion"}


def test_an_edge_is_dragged_before_it_is_accepted(classified, qtbot):
    c = models_of(classified)
    found(classified, qtbot)
    span = c.labels.selected[0]
    view = classified.findChild(LabelTimeline)
    row = view.rows.row_of("Suggestions")
    y = round(row.top_px + row.height_px / 2)
    start = QPoint(round(view.scale.x_of(span.end_s)) - 2, y)
    end = QPoint(round(view.scale.x_of(span.end_s - 0.2)) - 2, y)
    qtbot.mousePress(view, LEFT, Qt.KeyboardModifier.AltModifier, start)
    for share in (0.5, 1.0):
        qtbot.mouseMove(view, start + (end - start) * share)
    qtbot.mouseRelease(view, LEFT, Qt.KeyboardModifier.AltModifier, end)
    shorter = c.labels.labels.span(span.id)
    assert shorter.end_s < span.end_s
    assert (shorter.origin, shorter.confidence) == ("suggestion", span.confidence)


@pytest.mark.slow
def test_how_sure_it_must_be_is_typed(classified, qtbot):
    c, bar = models_of(classified), classified.findChild(SuggestionBar)
    found(classified, qtbot)
    many = len(c.suggestions.pending)
    sure = sorted(span.confidence for span in c.suggestions.pending)
    (box,) = bar.findChildren(NumberBox)
    assert box.suffix() == " %"
    box.setFocus()
    box.selectAll()
    limit = round(100 * sure[0]) + 1
    qtbot.keyClicks(box, str(limit))
    qtbot.keyClick(box, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: not c.suggestions.waiting, timeout=10_000)
    assert c.suggestions.threshold == limit
    assert len(c.suggestions.pending) < many


def test_without_a_classifier_the_key_says_what_to_do(window, qtbot):
    action = window.action("find_gestures")
    assert not action.isEnabled()
    assert "Choose a classifier" in action.toolTip()


# --- files ------------------------------------------------------------------------------------


def test_the_card_calls_simulated_what_is(classified, qtbot):
    texts = []

    def read(dialog):
        texts.extend(label.text() for label in dialog.findChildren(QLabel))
        texts.extend(dialog.findChild(QTextBrowser).toPlainText().splitlines())
        dialog.reject()

    once_asked(ModelCardDialog, read)
    classified.action("classifier_card").trigger()
    assert {"waves", "simulated data only", "background, horizontal, vertical"} <= set(texts)


def test_a_classifier_that_is_dropped_is_used(window, fake_classes, qtbot):
    (path,) = fake_classes.cards
    assert [one.text for one in hover(window, path).drops] == ["Classify with this model"]
    drop(window, path)
    qtbot.waitUntil(lambda: models_of(window).classify.track.complete, timeout=10_000)
    assert models_of(window).classify.path == path
    assert models_of(window).denoise.path is None


def test_what_is_no_classifier_is_said(window, tmp_path):
    window.features.classify._classifiers.use(tmp_path / "other.safetensors")
    assert "other.safetensors is no classifier" in window.messages.text
    assert models_of(window).classify.path is None


# --- training and comparing -------------------------------------------------------------------


def panel_of(window):
    """The page of classifiers."""
    return window.findChild(ClassSetupView).parentWidget()


@pytest.fixture
def trainable(window, tmp_path, qtbot):
    """The page of classifiers with data, and a command that learns nothing."""
    training = models_of(window).class_training
    key(window, "C", SHIFT)
    panel = panel_of(window)
    assert panel.isVisible()
    training.setup.add(write_pairs(tmp_path / "campaign.zarr"))
    qtbot.waitUntil(lambda: not training.setup.problem, timeout=60_000)
    yield window
    if training.under_way:
        training.run.tell("cancel")
        qtbot.waitUntil(lambda: training.run is None, timeout=20_000)


def test_trained_by_clicks_watched_and_used(trainable, fake_classes, qtbot):
    training, panel = (
        models_of(trainable).class_training,
        panel_of(trainable),
    )
    training.select(None)
    press(panel, "Start training", qtbot)
    qtbot.waitUntil(lambda: training.run is not None and not training.run.under_way, timeout=20_000)
    curve = panel.findChild(ChartView)
    assert curve.isVisible()
    curve.setFocus(Qt.FocusReason.TabFocusReason)
    assert curve.pointed.y == 80
    qtbot.keyClick(curve, Qt.Key.Key_Right)
    assert curve.pointed.y == 70
    assert "Recall 70.0 %" in curve.accessibleDescription()
    kept = user_classifiers_folder() / f"{training.run.folder.path.name}.safetensors"
    fake_classes.add(kept)
    press(panel, "Use this model", qtbot)
    assert models_of(trainable).classify.path == kept
    assert kept.is_file()
    answer(qtbot, "Discard")
    press(panel, "Delete…", qtbot)
    assert training.run is None


@pytest.mark.slow
def test_a_person_is_typed_and_who_does_what_is_said(trainable, tmp_path, qtbot):
    training, panel = (
        models_of(trainable).class_training,
        panel_of(trainable),
    )
    setup = training.setup
    shutil.copytree(resource_path("swipes.sd2"), copy := tmp_path / "copy.sd2")
    setup.remove(tmp_path / "campaign.zarr")
    setup.add(resource_path("swipes.sd2"))
    setup.add(copy)
    qtbot.waitUntil(lambda: all(one.facts for one in setup.data), timeout=60_000)
    assert not setup.problem

    def said() -> str:
        return " ".join(one.text() for one in panel.findChildren(QLabel) if one.isVisible())

    qtbot.waitUntil(lambda: "Learns from 1 person" in said(), timeout=60_000)
    # Rows that were replaced are hidden until they are deleted.
    (line,) = [
        one
        for one in panel.findChildren(TypedLine)
        if "copy.sd2" in one.accessibleName() and one.isVisible()
    ]
    line.setFocus()
    qtbot.keyClicks(line, "ben")
    qtbot.keyClick(line, Qt.Key.Key_Return)
    qtbot.waitUntil(
        lambda: setup.division is not None and setup.division.validation == ("ben",),
        timeout=60_000,
    )
    assert [one.person for one in setup.data] == ["", "ben"]
    assert "Learns from 1 person; the best model is chosen by ben." in said()
    assert "300 steps. The first ones tell how long it takes." in said()
    keep_pace(pace_kind("lstm", "columns", WIDTH), 10.0, 20)
    setup.changed.emit()
    assert "Takes about 2 min" in said()
    assert "300 steps of about 500 ms, as measured here before." in said()


@pytest.mark.slow
def test_stopped_by_a_click(trainable, qtbot, monkeypatch):
    training, panel = (
        models_of(trainable).class_training,
        panel_of(trainable),
    )
    monkeypatch.setenv(fake_class_command.STEP_S, "0.5")
    press(panel, "Start training", qtbot)
    qtbot.waitUntil(lambda: training.run.history.done >= 1, timeout=20_000)
    assert trainable.side.button("Train").toolTip().startswith("Train · ")
    press(panel, "Stop", qtbot)
    qtbot.waitUntil(lambda: not training.run.under_way, timeout=20_000)
    assert training.run.phase == "stopped"
    assert training.run.result is not None
