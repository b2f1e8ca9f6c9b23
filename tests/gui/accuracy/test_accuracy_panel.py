"""The Accuracy panel by real mouse and key events; the models are what is asserted on."""

from __future__ import annotations

import pytest
from fake_accuracy import COUNTING, EXACT, FACING, WAVES, measurement_of, result_of, stale
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLabel, QToolButton, QToolTip
from window_models import models_of

from sd2app.accuracy.feature import AccuracyPanel, ReasonList, ToleranceRow
from sd2app.accuracy.plot import AccuracyPlot
from sd2app.shell.status_bar import StatusLine
from sd2app.widgets.inputs import Choice as ChoiceBox
from sd2app.widgets.inputs import NumberBox
from sd2app.widgets.panel import ElidedLabel
from sd2app.widgets.text import milliseconds
from sd2core.accuracy.plans import AccuracyPlan
from sd2core.sensor import VirtualSensor

STRIDE = AccuracyPlan(mask_stride=5)
EXACT_RESULT = COUNTING[3]


@pytest.fixture
def panel(window, fake, qtbot):
    """The panel in front, the ball chosen for."""
    qtbot.keyClick(window, Qt.Key.Key_T)
    panel = window.findChild(AccuracyPanel)
    assert panel.isVisible()
    return panel


@pytest.fixture
def plot(panel, window, qtbot):
    """The plot with its points."""
    measured = models_of(window).trade.measured
    measured.measure()
    qtbot.waitUntil(lambda: measured.job is None, timeout=5_000)
    plot = panel.findChild(AccuracyPlot)
    assert plot.isVisible()
    # Each part around it is laid out in turn.
    places = []
    while len(places) < 5 or len(set(places[-5:])) > 1:
        QApplication.processEvents()
        places.append(plot.mapToGlobal(QPoint(0, 0)).toTuple())
    return plot


def texts(panel):
    return "\n".join(label.text() for label in panel.findChildren(QLabel) if label.isVisible())


def button(panel, text):
    found = [b for b in panel.findChildren(QToolButton) if b.text().startswith(text)]
    assert len(found) == 1
    return found[0]


def place(plot, result):
    return plot.tip_place(next(mark for mark in plot.marks if mark.of is result))


def at(plot, result):
    return place(plot, result).toPoint()


def done(window):
    c = models_of(window)
    return c.synthesis.complete and not c.synthesis.busy and not c.jobs.jobs


def test_an_icon_and_a_key_bring_the_panel_up(window, qtbot):
    assert window.side.shown == "Sensor"
    qtbot.mouseClick(window.side.button("Accuracy"), Qt.MouseButton.LeftButton)
    assert window.side.shown == "Accuracy"
    qtbot.keyClick(window, Qt.Key.Key_S)
    assert window.side.shown == "Sensor"
    qtbot.keyClick(window, Qt.Key.Key_T)
    assert window.side.shown == "Accuracy"


def test_without_a_mesh_the_panel_says_what_it_is_for(empty_window, qtbot):
    qtbot.keyClick(empty_window, Qt.Key.Key_T)
    panel = empty_window.findChild(AccuracyPanel)
    assert "Open a mesh" in texts(panel)
    assert not panel.findChild(ToleranceRow).isVisible()


def test_the_panel_says_what_the_tolerance_means_and_what_the_plan_costs(panel):
    shown = texts(panel)
    assert "5 %: the differences from the reference map add up to 5 % of it" in shown
    # 0.6 ms for each of 60 frames.
    said = (
        "Chosen: visibility exact, whose map is 0 % off the reference and costs 0.6 ms per frame,"
        " 36 ms for the clip."
    )
    assert said in shown.replace("\N{NO-BREAK SPACE}", " ")
    assert "Measure this scene to see them all" in shown


def test_a_preset_and_the_number_box_set_the_tolerance(panel, window, fake, qtbot):
    trade = models_of(window).trade
    fake.plans = {0.1: FACING, 0.02: STRIDE}
    qtbot.mouseClick(button(panel, "10 %"), Qt.MouseButton.LeftButton)
    assert trade.tolerance == 0.1
    qtbot.waitUntil(lambda: trade.in_use.plan == FACING, timeout=5_000)
    assert button(panel, "10 %").isChecked()
    box = panel.findChild(NumberBox)
    assert box.value() == pytest.approx(10.0)
    box.setFocus()
    box.selectAll()
    qtbot.keyClicks(box, "2")
    qtbot.keyClick(box, Qt.Key.Key_Return)
    assert trade.tolerance == pytest.approx(0.02)
    qtbot.waitUntil(lambda: trade.in_use.plan == STRIDE, timeout=5_000)
    assert not box.hasFocus()
    assert models_of(window).settings.tolerance == pytest.approx(0.02)
    assert models_of(window).document.undo_stack.count() == 0


@pytest.mark.slow
def test_a_tolerance_that_no_plan_holds_is_said(panel, window, fake, qtbot):
    fake.holds = False
    qtbot.mouseClick(button(panel, "0.5 %"), Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: "No plan holds 0.5 % here" in texts(panel), timeout=5_000)


def test_reasons_are_folded_until_they_are_asked_for(panel, qtbot):
    reasons = panel.findChild(ReasonList)
    assert not reasons.isVisible()
    qtbot.mouseClick(button(panel, "Why this plan"), Qt.MouseButton.LeftButton)
    assert reasons.isVisible()
    qtbot.mouseClick(button(panel, "Why this plan"), Qt.MouseButton.LeftButton)
    assert not reasons.isVisible()


def test_the_plot_has_a_legend_of_what_is_in_it(panel, plot, window):
    def legend():
        return texts(panel).replace("\N{NO-BREAK SPACE}", " ")

    assert "◉ chosen   ◇ cheapest measured within the tolerance" in legend()
    assert "only while dragging" not in legend()
    before = plot.grab().toImage()
    # Another plan is the cheapest at 0.1 %: the one that is exact.
    models_of(window).trade.set_tolerance(0.001)
    assert before != plot.grab().toImage()
    moving = result_of(AccuracyPlan(mask_reuse_m=0.1), 0.02, 0.3)
    measured = models_of(window).trade.measured
    measured._known["histogram"] = measurement_of(moving)
    measured.changed.emit()
    assert "○ only while dragging" in legend()
    assert "cheapest" not in legend()


def test_reasons_are_listed_with_what_is_modelled_first(panel):
    labels = list(panel.findChild(ReasonList).findChildren(QLabel))
    shown = [label.text() for label in labels]
    assert shown[0] == "✓"
    assert shown[1].startswith("What stands in between changes this map by 14\N{NO-BREAK SPACE}%")
    assert shown[2] == "–"
    assert labels[3].accessibleName().startswith("Left out: 91 %")


def test_measuring_shows_progress_and_then_the_points(panel, window, fake, qtbot):
    measured = models_of(window).trade.measured
    fake.gate.clear()
    qtbot.mouseClick(button(panel, "Measure this scene"), Qt.MouseButton.LeftButton)
    assert measured.job is not None
    assert button(panel, "Cancel").isVisible()
    qtbot.mouseClick(button(panel, "Cancel"), Qt.MouseButton.LeftButton)
    assert measured.job is None
    qtbot.keyClick(window, Qt.Key.Key_M, Qt.KeyboardModifier.ControlModifier)
    assert measured.job is not None
    fake.gate.set()
    qtbot.waitUntil(lambda: measured.measurement is not None, timeout=5_000)
    assert panel.findChild(AccuracyPlot).isVisible()
    # Under each tolerance the cheapest plan within it; the one chosen costs 0.6 ms.
    assert button(panel, "2 %").text() == "2 %\n0.6"
    assert button(panel, "0.5 %").text() == "0.5 %\n0.6"
    assert "measured" in texts(panel).lower()


def test_the_cheap_is_left_and_the_near_is_low(plot):
    cheap, exact = COUNTING[0], COUNTING[-1]
    assert place(plot, cheap).x() < place(plot, exact).x()
    assert place(plot, cheap).y() < place(plot, exact).y()
    # No error stands on the edge.
    assert place(plot, exact).y() == pytest.approx(plot.plot_rect().bottom())
    for result in COUNTING:
        assert plot.plot_rect().adjusted(-1, -1, 1, 1).contains(place(plot, result))


def test_hovering_says_what_a_point_is(plot, qtbot):
    qtbot.mouseMove(plot, at(plot, COUNTING[2]))
    assert plot.pointed.of.plan == STRIDE
    shown = QToolTip.text()
    for words in (
        str(STRIDE),
        "Error 0.8 % after smoothing, 1.2 % before",
        "Peak velocity off by 0.008 m/s",
        "0.6 ms per frame on all cores, 1.2 ms on one thread",
        "3 MiB",
        "Click to use it",
    ):
        assert words in shown
    qtbot.mouseMove(plot, QPoint(2, 2))
    assert plot.pointed is None


def test_a_click_uses_a_point_until_the_tolerance_rules_again(plot, panel, window, qtbot):
    trade = models_of(window).trade
    qtbot.mouseClick(plot, Qt.MouseButton.LeftButton, pos=at(plot, COUNTING[0]))
    assert trade.in_use.plan == FACING
    assert "You clicked this point" in texts(panel)
    qtbot.waitUntil(lambda: done(window), timeout=10_000)
    assert models_of(window).synthetic.status == "±13 %"
    qtbot.mouseClick(button(panel, "Choose by tolerance"), Qt.MouseButton.LeftButton)
    assert trade.in_use.plan == EXACT
    assert "You clicked" not in texts(panel)
    # Beside every point nothing happens.
    qtbot.mouseClick(plot, Qt.MouseButton.LeftButton, pos=QPoint(2, 2))
    assert trade.in_use.plan == EXACT


@pytest.mark.slow
def test_a_click_moves_nothing_and_text_and_plot_name_one_cost(plot, panel, window, qtbot):
    def settled():
        for _ in range(5):
            QApplication.processEvents()
        return plot.mapToGlobal(QPoint(0, 0)), plot.size(), [at(plot, one) for one in COUNTING]

    trade, before = models_of(window).trade, settled()
    for result in (EXACT_RESULT, COUNTING[0], COUNTING[1], EXACT_RESULT):
        qtbot.mouseClick(plot, Qt.MouseButton.LeftButton, pos=at(plot, result))
        assert settled() == before
        assert f"costs {milliseconds(result.cost.all_cores_ms.median)} per frame" in texts(panel)
    trade.choose_by_tolerance()
    qtbot.waitUntil(lambda: done(window), timeout=10_000)
    assert settled() == before
    measured = trade.measured.counting.of(trade.in_use.plan)
    assert trade.in_use.cost_ms == measured.cost.all_cores_ms.median
    assert trade.choice.cost_ms != measured.cost.all_cores_ms.median, "the estimate differs"


def test_keys_go_from_point_to_point_and_use_one(plot, window, qtbot):
    trade, playback = models_of(window).trade, models_of(window).playback
    frame = playback.frame
    plot.setFocus(Qt.FocusReason.TabFocusReason)
    assert plot.pointed.of.plan == EXACT
    # The front: facing, mask every 5 frames, exact; the depth buffer is behind it.
    qtbot.keyClick(plot, Qt.Key.Key_Left)
    assert plot.pointed.of.plan == STRIDE
    qtbot.keyClick(plot, Qt.Key.Key_Left)
    qtbot.keyClick(plot, Qt.Key.Key_Left)
    assert plot.pointed.of.plan == FACING
    qtbot.keyClick(plot, Qt.Key.Key_Down)
    assert plot.pointed.of.plan == COUNTING[1].plan
    assert "depth 128" in plot.accessibleDescription()
    qtbot.keyClick(plot, Qt.Key.Key_Return)
    assert trade.in_use.plan == COUNTING[1].plan
    assert playback.frame == frame
    qtbot.keyClick(plot, Qt.Key.Key_Escape)
    assert not plot.hasFocus()
    qtbot.keyClick(window, Qt.Key.Key_Right)
    assert playback.frame == frame + 1


def test_fmcw_plans_are_shown_and_said_how_to_run(panel, plot, window, qtbot):
    trade = models_of(window).trade
    family = panel.findChild(ChoiceBox)
    family.setFocus()
    qtbot.keyClick(family, Qt.Key.Key_Down)
    assert trade.measured.family == "fmcw"
    assert not plot.isVisible()
    assert "The radar signal itself" in texts(panel)
    trade.measured.measure()
    qtbot.waitUntil(lambda: trade.measured.job is None, timeout=5_000)
    qtbot.mouseClick(plot, Qt.MouseButton.LeftButton, pos=at(plot, WAVES[0]))
    assert trade.in_use.plan == EXACT
    assert "--method fmcw" in window.messages.text


def test_what_was_measured_elsewhere_is_said_to_be(panel, window, fake, qtbot):
    there = VirtualSensor(position_m=(0.5, 0.0, 0.0))
    fake.known["histogram", there] = stale(measurement_of(*COUNTING))
    models_of(window).edits.place_sensor(there)
    qtbot.waitUntil(lambda: "Measured for another placement" in texts(panel), timeout=10_000)


@pytest.mark.slow
def test_many_points_are_painted_in_both_themes(panel, window, fake, qtbot):
    """Every state of the plot is painted without a word from Qt."""
    here = models_of(window).sensor.sensor
    many = [
        result_of(
            AccuracyPlan(mask_stride=stride, vertices_kept=kept), 0.1 * kept / stride, kept / stride
        )
        for stride in (1, 2, 5, 10)
        for kept in (1.0, 0.5, 0.25, 0.1)
    ]
    fake.known["histogram", here] = measurement_of(*many)
    models_of(window).trade.measured._place = None
    models_of(window).trade.measured.rest_at(here)
    qtbot.waitUntil(lambda: models_of(window).trade.measured.measurement is not None)
    plot = panel.findChild(AccuracyPlot)
    pictures = set()
    for dark in (False, True):
        window.features.program.set_dark(dark)
        plot.setFocus(Qt.FocusReason.TabFocusReason)
        qtbot.keyClick(plot, Qt.Key.Key_Right)
        picture = plot.grab().toImage()
        pictures.add(picture.pixelColor(1, picture.height() - 1).name())
    assert len(pictures) == 2


def test_where_the_exact_map_is_empty_infinite_errors_are_painted(panel, window, fake, qtbot):
    """Of a body that is hidden, plans that see through what hides it are off by infinity."""
    here, measured = models_of(window).sensor.sensor, models_of(window).trade.measured
    through = result_of(AccuracyPlan(visibility="none"), float("inf"), 0.01)
    fake.known["histogram", here] = measurement_of(through, EXACT_RESULT)
    measured._place = None
    measured.rest_at(here)
    qtbot.waitUntil(lambda: measured.measurement is not None)
    plot = panel.findChild(AccuracyPlot)
    qtbot.waitUntil(lambda: len(plot.marks) == 2)
    assert plot.rect().contains(at(plot, through))
    assert not plot.grab().isNull()


def test_the_status_line_says_how_exact_the_map_is_and_a_click_says_why(window, qtbot):
    button = next(
        one
        for one in window.findChild(StatusLine).findChildren(QToolButton)
        if "how?" in one.text()
    )
    shown = button.text

    c = models_of(window)
    assert shown() == "±0 % · how?"
    assert f"{EXACT} · ±0 % · 0.6 ms/frame" in button.toolTip()
    c.edits.begin_sensor_drag()
    assert shown() == "±0 % · how?"
    c.edits.drag_sensor((0.1, 0.0, 0.0))
    assert shown() == "while dragging ±13 % · how?"
    c.edits.end_drag()
    assert shown() == "±0 % · how?"
    QTest.mouseClick(button, Qt.MouseButton.LeftButton)
    assert window.side.shown == "Accuracy"


def test_a_long_line_gives_way(qtbot):
    label = ElidedLabel()
    qtbot.addWidget(label)
    label.setText("word " * 60)
    label.resize(120, 20)
    label.show()
    assert label.minimumSizeHint().width() <= 60
    assert label.toolTip() == "word " * 60
    assert label.grab().width() == 120
