"""Real mouse and key events on the whole window; the models are what is asserted on."""

from __future__ import annotations

import numpy as np
import pytest
from finding import named
from PySide6.QtCore import QPoint, QPointF, Qt, QTimer
from PySide6.QtGui import QWheelEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QAbstractSpinBox,
    QApplication,
    QLineEdit,
    QMessageBox,
)
from window_models import all_actions, models_of

from sd2app.maps.heatmap_image import Overview
from sd2app.playback.feature import TimeRuler
from sd2app.sensor.scene_pages import ThingsPage
from sd2app.shell.keys.dialog import KeysDialog
from sd2app.widgets.dialogs import controls_of
from sd2app.widgets.inputs import Choice
from sd2core.accuracy.plans import AccuracyPlan
from sd2core.maps import DopplerMap
from sd2core.mesh.things import Thing
from sd2core.recording.recording import open_recording
from sd2core.sensor import VirtualSensor


def heatmaps(window):
    synthetic, real = window.maps.synthetic, window.maps.real
    return synthetic, real


def at(view, time_s, velocity_mps):
    return QPoint(round(view.scale.x_of(time_s)), round(view.y_of(velocity_mps)))


def test_opening_shows_every_part(window):
    c = models_of(window)
    assert window.windowTitle().startswith("ball (simulated)")
    assert c.video.picture.shape == (120, 160, 3)
    assert c.synthetic.map.values.max() > 0
    assert c.synthetic.status == "±0 %"
    assert c.real.map.kind == "simulated"
    assert c.real.title == "Radar (simulated)"
    assert all(view.isVisible() for view in heatmaps(window))
    assert window.messages.text == ""


def test_the_ball_is_where_it_should_be_in_the_map(window):
    # d/dt of 2 + 0.2 sin(2πt): fastest away at t = 0 and 1 s, fastest towards at 0.5 and 1.5 s.
    c = models_of(window)
    mean = c.synthetic.map.mean_velocity_mps()
    peak = 0.2 * 2 * np.pi
    for time_s, sign in ((0.5, 1), (1.0, -1), (1.5, 1)):
        velocity = mean[c.synthetic.map.timebase.nearest_frame(time_s)]
        assert velocity * sign == pytest.approx(peak, abs=0.2)


def test_home_and_end_go_to_the_ends_wherever_the_keyboard_is(window, qtbot):
    playback, tried = models_of(window).playback, set()
    for page in ("Sensor", "Accuracy", "Train", "Labels", "Agreement"):
        window.bring_up(page)
        for control in controls_of([window]):
            if isinstance(control, (QAbstractSpinBox, QLineEdit)):
                continue
            control.setFocus()
            for key, frame in ((Qt.Key.Key_End, 59), (Qt.Key.Key_Home, 0)):
                qtbot.keyClick(control, key)
                assert playback.frame == frame, control
            tried.add(control)
    assert any(isinstance(one, QAbstractItemView) for one in tried)
    assert len(tried) > 20


def test_keys_play_step_and_change_speed(window, qtbot):
    playback = models_of(window).playback
    qtbot.keyClick(window, Qt.Key.Key_Right)
    assert playback.frame == 1
    qtbot.keyClick(window, Qt.Key.Key_Right, Qt.KeyboardModifier.ShiftModifier)
    assert playback.frame == 31
    qtbot.keyClick(window, Qt.Key.Key_Left)
    assert playback.frame == 30
    qtbot.keyClick(window, Qt.Key.Key_Left, Qt.KeyboardModifier.ShiftModifier)
    assert playback.frame == 0
    qtbot.keyClick(window, Qt.Key.Key_End)
    assert playback.frame == 59
    qtbot.keyClick(window, Qt.Key.Key_Home)
    assert playback.frame == 0
    qtbot.keyClick(window, Qt.Key.Key_Comma)
    assert playback.speed == 0.5
    qtbot.keyClick(window, Qt.Key.Key_Period)
    assert playback.speed == 1.0
    qtbot.keyClick(window, Qt.Key.Key_L)
    assert playback.loop
    qtbot.keyClick(window, Qt.Key.Key_Space)
    assert playback.playing
    qtbot.waitUntil(lambda: playback.frame > 3)
    qtbot.keyClick(window, Qt.Key.Key_Space)
    assert not playback.playing


def test_the_picture_follows_the_clock(window, qtbot):
    c = models_of(window)
    for frame in (10, 50, 3):
        c.playback.seek_frame(frame)
        qtbot.waitUntil(lambda frame=frame: c.video.shown_frame == frame)
        assert float(c.video.picture.mean()) == pytest.approx(40 + 3 * frame, abs=4)


def test_a_click_in_a_heatmap_seeks_and_a_drag_scrubs(window, qtbot):
    synthetic, _ = heatmaps(window)
    playback = models_of(window).playback
    qtbot.mouseClick(synthetic, Qt.MouseButton.LeftButton, pos=at(synthetic, 1.25, 0.5))
    assert playback.time_s == pytest.approx(1.25, abs=1 / 30)
    qtbot.mousePress(synthetic, Qt.MouseButton.LeftButton, pos=at(synthetic, 0.5, 0.5))
    qtbot.mouseMove(synthetic, at(synthetic, 0.9, 0.5))
    qtbot.mouseRelease(synthetic, Qt.MouseButton.LeftButton, pos=at(synthetic, 0.9, 0.5))
    assert playback.time_s == pytest.approx(0.9, abs=1 / 30)


def test_hovering_reads_time_velocity_and_level(window, qtbot):
    synthetic, _ = heatmaps(window)
    pointer = models_of(window).pointer
    middle_s = 15.5 / 30.0  # at the frame's edge a pixel's rounding would decide
    qtbot.mouseMove(synthetic, at(synthetic, middle_s, 1.2))
    reading = pointer.reading
    assert reading.frame == 15
    assert reading.velocity_mps == pytest.approx(1.1875)
    assert reading.value == models_of(window).synthetic.map.values[25, 15]
    qtbot.mouseMove(synthetic, at(synthetic, middle_s, 0.0))
    assert pointer.reading.note == "nulled bin"


def wheel(view, position, notches, modifiers=Qt.KeyboardModifier.NoModifier):
    event = QWheelEvent(
        QPointF(position),
        QPointF(view.mapToGlobal(position)),
        QPoint(0, 0),
        QPoint(0, 120 * notches),
        Qt.MouseButton.NoButton,
        modifiers,
        Qt.ScrollPhase.NoScrollPhase,
        False,
    )
    QApplication.sendEvent(view, event)


def test_the_wheel_zooms_about_the_pointer_and_pans_with_shift(window, qtbot):
    synthetic, real = heatmaps(window)
    span = models_of(window).span
    where = at(synthetic, 0.5, 1.0)
    wheel(synthetic, where, 3)
    assert span.duration_s == pytest.approx(2.0 * 0.8**3)
    assert synthetic.scale.time_of(where.x()) == pytest.approx(0.5, abs=0.01)
    assert real.scale.time_of(where.x()) == pytest.approx(0.5, abs=0.01)
    start = span.start_s
    wheel(real, where, -1, Qt.KeyboardModifier.ShiftModifier)
    assert span.start_s == pytest.approx(start + 0.1 * span.duration_s)
    # Beside the spans, of which one would be played.
    qtbot.mouseDClick(synthetic, Qt.MouseButton.LeftButton, pos=at(synthetic, 0.9, 1.0))
    assert (span.start_s, span.end_s) == pytest.approx((0.0, 2.0))


def test_the_overview_pans_and_zooms(window, qtbot):
    overview = window.findChild(Overview)
    span = models_of(window).span
    span.set_span(0.5, 1.0)
    y = overview.height() // 2

    def drag(start_s, stop_s):
        start, stop = (QPoint(round(overview.scale.x_of(t)), y) for t in (start_s, stop_s))
        qtbot.mousePress(overview, Qt.MouseButton.LeftButton, pos=start)
        qtbot.mouseMove(overview, stop)
        qtbot.mouseRelease(overview, Qt.MouseButton.LeftButton, pos=stop)

    drag(0.75, 1.25)
    assert (span.start_s, span.end_s) == pytest.approx((1.0, 1.5), abs=0.01)
    drag(1.0, 0.5)
    assert (span.start_s, span.end_s) == pytest.approx((0.5, 1.5), abs=0.01)


def test_the_ruler_seeks(window, qtbot):
    ruler = window.findChild(TimeRuler)
    middle_px = round(ruler.scale.x_of(1.5 + 0.5 / 30))  # of a frame
    qtbot.mouseClick(ruler, Qt.MouseButton.LeftButton, pos=QPoint(middle_px, 12))
    assert models_of(window).playback.time_s == pytest.approx(1.5, abs=1 / 30)


def test_a_grip_aligns_the_radar_in_one_step_while_that_is_asked_for(window, qtbot):
    _, real = heatmaps(window)
    models = models_of(window)
    recording = models.document.recording

    def drag(start: QPoint, shift_px: int) -> None:
        qtbot.mousePress(real, Qt.MouseButton.LeftButton, pos=start)
        qtbot.mousePress(real, Qt.MouseButton.MiddleButton, pos=start)  # takes nothing away
        for step in (0.3, 0.7, 1.0):
            qtbot.mouseMove(real, start + QPoint(round(step * shift_px), 0))
        for button in (Qt.MouseButton.LeftButton, Qt.MouseButton.MiddleButton):
            qtbot.mouseRelease(real, button, pos=start + QPoint(shift_px, 0))

    shift_px = round(0.25 / real.scale.seconds_per_px)
    drag(QPoint(400, 10), shift_px)  # the title: nothing moves in time
    middle = real.plot_rect().center().toPoint()
    drag(middle, shift_px)  # seeks, as on every map
    assert (recording.radar_offset_s, models.document.undo_stack.count()) == (0.0, 0)
    window.action("align_by_hand").trigger()
    assert real.grip_rect().contains(middle)
    seen_s = models.playback.time_s
    drag(middle, shift_px)
    assert models.playback.time_s == seen_s
    assert recording.radar_offset_s == pytest.approx(0.25, abs=0.005)
    assert models.real.offset_s == recording.radar_offset_s
    assert f"offset +{recording.radar_offset_s:g} s" in real.status()
    assert "offset" in window.action("undo").text()
    qtbot.keyClick(window, Qt.Key.Key_Escape)
    assert real.grip_rect().isEmpty()
    qtbot.keyClick(window, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert recording.radar_offset_s == 0.0
    assert models_of(window).real.offset_s == 0.0
    keys = Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.ShiftModifier
    qtbot.keyClick(window, Qt.Key.Key_Z, keys)
    assert recording.radar_offset_s == pytest.approx(0.25, abs=0.005)


def test_moving_the_sensor_changes_the_map_and_undo_restores_it(window, qtbot):
    c = models_of(window)
    before = c.synthetic.map.values.copy()
    c.edits.place_sensor(VirtualSensor(position_m=(2.0, 0.0, 2.0)))
    qtbot.waitUntil(lambda: c.synthesis.complete, timeout=10_000)
    # Straight from the side the ball moves across the view: only its edges approach or recede,
    # by 1.26 m/s times the sine of half the angle it fills (0.15), spread by 4 sigma of 0.125 m/s.
    assert c.synthetic.map.axis.centres_mps[c.synthetic.map.values[:, 15] > 0].max() < 0.75
    assert c.synthetic.map.axis.centres_mps[before[:, 15] > 0].max() > 1.2
    qtbot.keyClick(window, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    qtbot.waitUntil(lambda: c.synthesis.complete, timeout=10_000)
    np.testing.assert_array_equal(c.synthetic.map.values, before)


def test_typing_a_range_moves_the_sensor_along_its_direction(window, qtbot):
    from sd2app.sensor.panel import SensorPanel

    c = models_of(window)
    panel = window.findChild(SensorPanel)
    box = named(panel, "Range: ")
    box.setFocus()
    box.lineEdit().selectAll()
    qtbot.keyClicks(box, "6")
    qtbot.keyClick(box, Qt.Key.Key_Return)
    assert np.linalg.norm(np.subtract(c.sensor.sensor.position_m, c.synthesis.torso_m)) == (
        pytest.approx(6.0, abs=0.01)
    )
    assert c.sensor.sensor.position_m[2] == pytest.approx(-4.0, abs=0.05)
    qtbot.keyClick(window, Qt.Key.Key_Home, Qt.KeyboardModifier.ShiftModifier)
    assert c.sensor.sensor.position_m == (0.0, 0.0, 0.0)
    assert c.document.undo_stack.undoText() == "Sensor to camera"


def number_boxes(window):
    from sd2app.sensor.panel import SensorPanel
    from sd2app.widgets.inputs import NumberBox

    panel = window.findChild(SensorPanel)
    axes = [named(panel, f"Sensor position, {axis}", NumberBox) for axis in "xyz"]
    return axes, [named(panel, name, NumberBox) for name in ("Range: ", "Azimuth: ", "Elevation: ")]


def type_into(box, text, qtbot):
    qtbot.mouseClick(box.lineEdit(), Qt.MouseButton.LeftButton)
    box.lineEdit().selectAll()
    qtbot.keyClicks(box.lineEdit(), text)


def test_typing_is_not_disturbed_by_playing(window, qtbot):
    c = models_of(window)
    box = number_boxes(window)[1][0]
    c.playback.set_loop(True)
    c.playback.play()
    for text in ("3", ".", "5"):
        if text == "3":
            type_into(box, text, qtbot)
        else:
            qtbot.keyClicks(box.lineEdit(), text)
        frame = c.playback.frame
        qtbot.waitUntil(lambda frame=frame: c.playback.frame != frame)
    qtbot.keyClick(box, Qt.Key.Key_Return)
    c.playback.pause()
    assert c.document.undo_stack.count() == 1
    distance = np.linalg.norm(np.subtract(c.sensor.sensor.position_m, c.synthesis.torso_m))
    assert distance == pytest.approx(3.5, abs=0.45)  # the ball went on swinging by 0.2 m


def test_a_number_box_gives_the_keyboard_back(window, qtbot):
    c = models_of(window)
    x = number_boxes(window)[0][0]
    type_into(x, "0.5", qtbot)
    qtbot.keyClick(x, Qt.Key.Key_Return)
    assert c.sensor.sensor.position_m[0] == 0.5
    assert not x.hasFocus()
    qtbot.keyClick(window, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert c.sensor.sensor.position_m[0] == 0.0
    assert x.value() == 0.0
    type_into(x, "7", qtbot)
    qtbot.keyClick(x, Qt.Key.Key_Escape)
    assert x.value() == 0.0
    assert c.sensor.sensor.position_m[0] == 0.0
    type_into(x, "2", qtbot)
    synthetic, _ = heatmaps(window)
    qtbot.mouseClick(synthetic, Qt.MouseButton.LeftButton, pos=at(synthetic, 0.5, 1.0))
    assert not x.hasFocus()


def test_the_wheel_over_a_box_changes_nothing(window, qtbot):
    from sd2app.widgets.inputs import Choice, NumberBox

    c = models_of(window)
    before = (c.sensor.sensor, c.display.levels, c.document.clutter)
    for widget in [*window.findChildren(NumberBox), *window.findChildren(Choice)]:
        wheel(widget, QPoint(5, 5), 1)
    assert (c.sensor.sensor, c.display.levels, c.document.clutter) == before


def test_levels_push_each_other_along(window, qtbot):
    from sd2app.maps.level_bar import LevelBar

    bar, levels = window.findChild(LevelBar), lambda: models_of(window).display.levels
    low, high = (named(bar, f"Level shown as the {end}") for end in ("first", "last"))
    type_into(low, "15", qtbot)
    qtbot.keyClick(low, Qt.Key.Key_Return)
    assert (levels().low_db, levels().high_db) == (15, 16)
    type_into(high, "-40", qtbot)
    qtbot.keyClick(high, Qt.Key.Key_Return)
    assert (levels().low_db, levels().high_db) == (-41, -40)
    assert (low.value(), high.value()) == (-41, -40)


def test_clutter_removal_can_be_undone(window, qtbot):
    c = models_of(window)
    before, reference = c.real.map.values.copy(), c.real.reference
    c.edits.set_clutter("none")
    qtbot.waitUntil(lambda: not np.array_equal(c.real.map.values, before), timeout=10_000)
    assert c.real.reference == reference
    qtbot.keyClick(window, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    qtbot.waitUntil(lambda: np.array_equal(c.real.map.values, before), timeout=10_000)


@pytest.mark.slow
def test_the_bundled_sample_is_never_written_to(empty_window, qtbot, monkeypatch):
    from PySide6.QtWidgets import QFileDialog

    from sd2core.files.resources import resource_path

    c = models_of(empty_window)
    file = resource_path("swipes.sd2") / "recording.json"
    before = file.read_bytes()
    with qtbot.waitSignal(c.document.opened, timeout=20_000):
        empty_window.features.files.open_sample()
    c.edits.place_sensor(VirtualSensor(position_m=(0.5, 0.0, 0.0)))
    asked = []
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *_: (asked.append(1), ("", ""))[1])
    qtbot.keyClick(empty_window, Qt.Key.Key_S, Qt.KeyboardModifier.ControlModifier)
    assert asked
    assert file.read_bytes() == before


def test_a_mesh_longer_than_its_video_is_played_to_its_end(
    empty_window, small_recording, tmp_path, qtbot
):
    from sd2app.scene.view import SceneView

    with np.load(small_recording / "mesh.npz") as data:
        vertices, faces = data["vertices"], data["faces"]
    c = models_of(empty_window)
    for count, end_s in ((90, 3.0), (30, 2.0)):
        mesh = tmp_path / f"{count}.npz"
        frames = np.arange(count) % len(vertices)
        np.savez(mesh, vertices=vertices[frames], faces=faces, times_s=np.arange(count) / 30)
        with qtbot.waitSignal(c.document.opened, timeout=10_000):
            empty_window.open_paths([small_recording / "video.mp4", mesh])
        assert c.span.extent_s == pytest.approx((0.0, end_s), abs=0.01)
    # The second mesh ends in the middle of the video: no stale body after that.
    qtbot.waitUntil(lambda: empty_window.settled, timeout=20_000)
    view = empty_window.findChild(SceneView)
    c.playback.seek(0.5)
    view.grab()
    assert view.overlay.message == ""
    c.playback.seek(1.5)
    view.grab()
    assert view.overlay.message == "No mesh at this time"
    assert c.synthesis.readout() is None


def test_a_drag_shows_a_preview_and_becomes_exact(window, qtbot):
    c = models_of(window)
    seen = []
    c.synthetic.status_changed.connect(lambda: seen.append(c.synthetic.status))
    c.edits.begin_sensor_drag()
    c.edits.drag_sensor((0.1, 0.0, 0.0))
    qtbot.waitUntil(lambda: c.synthetic.status.startswith("while"), timeout=5_000)
    c.edits.drag_sensor((0.2, 0.0, 0.0))
    c.edits.end_drag()
    qtbot.waitUntil(lambda: c.synthesis.complete, timeout=10_000)
    assert c.synthetic.status == "±0 %"
    assert seen[0] == "while dragging: ±13 %"


def test_dragging_the_sensor_in_3d_follows_the_mouse_in_one_step(window, qtbot):
    from sd2app.scene.offscreen_backend import ImageBackend
    from sd2app.scene.view import SceneView

    c = models_of(window)
    view = window.findChild(SceneView)
    canvas = window.findChild(ImageBackend)
    view.grab()

    def pixel() -> QPoint:
        x, y, _ = view.scene.pose.project(c.sensor.sensor.position_m)[0]
        return QPoint(round(x), round(y))

    start = pixel()
    before = c.synthetic.map.values.copy()
    qtbot.mousePress(canvas, Qt.MouseButton.LeftButton, pos=start)
    for step in (8, 16, 24):
        qtbot.mouseMove(canvas, start + QPoint(step, step // 2))
    assert c.sensor.dragging
    end = start + QPoint(24, 12)
    assert (pixel() - end).manhattanLength() <= 1
    qtbot.waitUntil(lambda: not np.array_equal(before, c.synthetic.map.values), timeout=5_000)
    assert c.synthetic.status.startswith("while dragging")
    qtbot.mouseRelease(canvas, Qt.MouseButton.LeftButton, pos=end)
    assert not c.sensor.dragging
    assert c.document.undo_stack.count() == 1
    qtbot.waitUntil(lambda: c.synthesis.complete, timeout=10_000)
    qtbot.keyClick(window, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert c.sensor.sensor == VirtualSensor()


def test_a_farther_sensor_shows_weaker_levels(window, qtbot):
    c = models_of(window)
    strongest, reference = float(c.synthetic.map.values.max()), c.synthetic.reference
    c.edits.place_sensor(VirtualSensor(position_m=(0.0, 0.0, -2.0)))
    qtbot.waitUntil(lambda: c.synthesis.complete, timeout=10_000)
    assert c.synthetic.reference == reference
    # Range 2 → 4 m at R⁻⁴ is 12 dB; the ball swings by 0.2 m and shows a little more of itself.
    loss_db = 10 * np.log10(strongest / float(c.synthetic.map.values.max()))
    assert loss_db == pytest.approx(12.0, abs=1.5)
    qtbot.keyClick(window, Qt.Key.Key_R)
    assert c.synthetic.reference == pytest.approx(float(c.synthetic.map.values.max()))


def test_a_point_cloud_counts_every_point(empty_window, fake, tmp_path, qtbot):
    fake.plan = fake.dragging = AccuracyPlan(visibility="none")
    rng = np.random.default_rng(0)
    points = np.repeat(rng.normal(size=(1, 25, 3)), 20, axis=0)
    points[:, :, 2] += 3.0 - np.arange(20)[:, None] / 30.0  # approaches at 1 m/s
    np.savez(tmp_path / "cloud.npz", vertices=points, times_s=np.arange(20) / 30.0)
    c = models_of(empty_window)
    with qtbot.waitSignal(c.document.opened, timeout=10_000):
        empty_window.open_paths([tmp_path / "cloud.npz"])
    qtbot.waitUntil(lambda: c.synthesis.complete, timeout=10_000)
    assert c.synthetic.status == "±0 %"
    assert c.synthesis.readout().visible_share == 1.0
    assert np.nanmean(c.synthetic.map.mean_velocity_mps()) == pytest.approx(0.9, abs=0.15)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("missing.mp4", None, "does not exist"),
        ("broken.mp4", b"not a video", "broken.mp4"),
        ("broken.npz", b"not an archive", "cannot be read as .npz"),
        ("notes.txt", b"hello", "is of no kind that is known"),
    ],
)
def test_what_cannot_be_opened_is_a_sentence(window, qtbot, tmp_path, name, content, words):
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    title = window.windowTitle()
    with qtbot.waitSignal(models_of(window).document.failed, timeout=10_000):
        window.open_paths([path])
    assert words in window.messages.text
    assert "Traceback" not in window.messages.text
    assert window.windowTitle() == title


def test_a_recording_with_a_missing_file_shows_the_rest_and_finds_it_again(
    empty_window, recording_copy, qtbot, tmp_path
):
    (tmp_path / "elsewhere").mkdir()
    (recording_copy / "mesh.npz").rename(tmp_path / "elsewhere" / "mesh.npz")
    document = models_of(empty_window).document
    with qtbot.waitSignal(document.failed, timeout=10_000):
        empty_window.open_paths([recording_copy])
    assert document.video is not None
    assert document.mesh is None
    assert "mesh.npz" in empty_window.messages.text
    with qtbot.waitSignal(document.opened, timeout=10_000):
        models_of(empty_window).edits.relink(tmp_path / "elsewhere")
    assert document.mesh is not None
    assert (document.modified, document.undo_stack.undoText()) == (True, "Find missing files")
    document.save()
    assert not open_recording(recording_copy).missing()


def test_a_thing_whose_file_is_gone_is_named_left_out_and_found_again(
    empty_window, recording_copy, qtbot, tmp_path
):
    chair = tmp_path / "chair.obj"
    chair.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    recording = open_recording(recording_copy)
    box = Thing("box", (1.0, 0.3, 1.0))
    recording.things = (Thing(str(chair), (2.0, 0.3, 1.0)), box)
    recording.save()
    (tmp_path / "store").mkdir()
    chair.rename(tmp_path / "store" / "chair.obj")
    document = models_of(empty_window).document
    with qtbot.waitSignal(document.failed, timeout=10_000):
        empty_window.open_paths([recording_copy])
    assert "The mesh of thing 1 is not at" in empty_window.messages.text
    assert "chair.obj" in empty_window.messages.text
    assert document.mesh.surroundings.things == (box,)
    assert empty_window.action("relink").isEnabled()
    empty_window.bring_up("Sensor", "Things")
    chosen = empty_window.findChild(ThingsPage).findChildren(Choice)[1]
    assert chosen.itemText(0) == "1: chair.obj (file missing)"
    edits = models_of(empty_window).edits
    edits.begin_scene_drag(0)  # of those that are there
    edits.drag_in_scene((0.25, 0.0, 0.0))
    edits.drag_in_scene((0.5, 0.0, 0.0))
    edits.end_drag()
    assert document.recording.things[1].position_m == (1.5, 0.3, 1.0)
    edits.relink(tmp_path / "store")
    assert [one.name for one in document.mesh.surroundings.things] == ["chair.obj", "box"]
    assert not document.recording.missing()


def test_saving_keeps_sensor_and_offset(empty_window, recording_copy, qtbot):
    c = models_of(empty_window)
    with qtbot.waitSignal(c.document.opened, timeout=10_000):
        empty_window.open_paths([recording_copy])
    c.edits.place_sensor(VirtualSensor(position_m=(0.5, -0.25, 0.125)))
    c.edits.set_radar_offset(0.5)
    qtbot.waitUntil(lambda: "*" in empty_window.windowTitle(), timeout=5_000)
    qtbot.keyClick(empty_window, Qt.Key.Key_S, Qt.KeyboardModifier.ControlModifier)
    qtbot.waitUntil(lambda: "*" not in empty_window.windowTitle(), timeout=5_000)
    with qtbot.waitSignal(c.document.opened, timeout=10_000):
        empty_window.open_paths([recording_copy])
    assert c.sensor.sensor.position_m == (0.5, -0.25, 0.125)
    assert c.real.offset_s == 0.5


def test_unsaved_edits_are_asked_about(window, monkeypatch):
    models_of(window).edits.set_radar_offset(0.5)
    monkeypatch.setattr(QMessageBox, "question", lambda *_: QMessageBox.StandardButton.Cancel)
    window.close()
    assert window.isVisible()
    monkeypatch.setattr(QMessageBox, "question", lambda *_: QMessageBox.StandardButton.Discard)
    window.close()
    assert not window.isVisible()


def test_closing_during_work_is_safe(empty_window, small_recording, qtbot):
    empty_window.open_paths([small_recording])
    empty_window.close()
    qtbot.wait(200)
    assert not empty_window.isVisible()


def test_opening_can_be_cancelled(window, small_recording, qtbot):
    title = window.windowTitle()
    window.open_paths([small_recording / "mesh.npz"])
    jobs = models_of(window).jobs
    jobs.cancel(jobs.jobs[0])
    assert jobs.jobs == ()
    qtbot.wait(300)
    assert window.windowTitle() == title


def test_the_exported_map_is_the_one_on_screen(window, tmp_path):
    path = tmp_path / "map.npz"
    models_of(window).synthesis.export(path)
    exported = DopplerMap.load(path)
    np.testing.assert_allclose(exported.values, models_of(window).synthetic.map.values, atol=1e-7)
    assert exported.meta["sensor"]["position_m"] == [0.0, 0.0, 0.0]


def test_every_key_is_used_once(window):
    keys = [key for action in all_actions() for key in action.keys]
    assert len(keys) == len(set(keys))


def test_the_question_mark_shows_all_keys(window, qtbot):
    shown = []

    def look():
        dialog = QApplication.activeModalWidget()
        shown.append(dialog)
        dialog.reject()

    QTimer.singleShot(200, look)
    qtbot.keyClick(window, Qt.Key.Key_Question)
    assert isinstance(shown[0], KeysDialog)


@pytest.mark.slow
def test_both_themes_repaint_everything(window, qtbot):
    light = window.grab().toImage()
    window.features.program.set_dark(True)
    qtbot.wait(50)
    dark = window.grab().toImage()

    def brightness(image):
        image = image.scaled(32, 20)
        return np.mean([image.pixelColor(x, y).lightness() for x in range(32) for y in range(20)])

    assert brightness(light) > brightness(dark) + 60
