"""The 3D view: colours, gestures, models."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from answering import pick, texts_of
from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QColor, QGuiApplication, QImage, QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLabel, QMenu
from scene_stage import LEFT, RIGHT, Stage, two_plates

from sd2app.scene import offscreen_backend as image_backend
from sd2app.scene.navigation import Target
from sd2app.session.maps import LIMB_COLOURS
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.vertex_parts import VertexParts
from sd2core.placements.placements import Place, PlacementCloud
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase

ALL = np.ones(8, bool)
HALF = np.arange(8) < 4


def as_array(picture: QImage) -> np.ndarray:
    picture = picture.convertToFormat(QImage.Format.Format_RGB888)
    rows = np.frombuffer(picture.constBits(), np.uint8)
    rows = rows.reshape(picture.height(), picture.bytesPerLine())
    return rows[:, : 3 * picture.width()].reshape(picture.height(), picture.width(), 3).astype(int)


def greyness(colour: QColor) -> int:
    return max(colour.red(), colour.green(), colour.blue()) - min(
        colour.red(), colour.green(), colour.blue()
    )


def drag(stage: Stage, start: QPoint, *stops: QPoint, modifiers: Any = None) -> None:
    held = modifiers or Qt.KeyboardModifier.NoModifier
    widget = stage.view.childAt(start)
    QTest.mousePress(widget, Qt.MouseButton.LeftButton, held, start)
    for stop in stops:
        QTest.mouseMove(widget, stop)
    QTest.mouseRelease(widget, Qt.MouseButton.LeftButton, held, stops[-1])


# Colours


def test_an_approaching_plate_is_red_and_a_receding_one_blue(stage: Stage) -> None:
    stage.scatter(np.where(HALF, 1.5, -1.5), ALL)
    left, right = stage.colour_at(LEFT), stage.colour_at(RIGHT)
    assert left.red() > left.blue() + 60
    assert right.blue() > right.red() + 60


def test_hidden_vertices_are_grey(stage: Stage) -> None:
    stage.scatter(np.full(8, 1.5), HALF)
    assert greyness(stage.colour_at(LEFT)) > 60
    assert greyness(stage.colour_at(RIGHT)) < 25


def test_a_mesh_of_unknown_velocity_is_plain(stage: Stage) -> None:
    assert greyness(stage.colour_at(LEFT)) < 25


def test_range_colours_follow_the_distance_to_the_sensor(stage: Stage) -> None:
    stage.display.set_mesh_colour("range")
    stage.sensor.set_sensor(VirtualSensor((-2.0, 0.0, 2.0)))
    near, far = stage.colour_at(LEFT), stage.colour_at(RIGHT)
    assert near.green() > far.green() + 40
    low, high = stage.view.scene.colouring.range_limits_m
    assert low <= 1.35
    assert high >= 2.65
    assert high - low < 2.2


def test_visibility_is_the_accent_or_grey(stage: Stage) -> None:
    stage.display.set_mesh_colour("visibility")
    stage.scatter(np.zeros(8), HALF)
    assert greyness(stage.colour_at(LEFT)) > 60
    assert greyness(stage.colour_at(RIGHT)) < 25


def test_dots_leave_gaps_that_the_surface_fills(stage: Stage) -> None:
    ground = QColor(stage.view.scene.colours.backdrop)
    assert stage.colour_at(LEFT) != ground
    stage.display.set_as_dots(True)
    assert stage.colour_at(LEFT) == ground
    assert stage.colour_at((-0.65, -0.25, 2.0)) != ground
    stage.display.set_as_dots(False)
    assert stage.colour_at(LEFT) != ground


def test_a_point_cloud_is_drawn_as_dots(stage: Stage) -> None:
    plates = two_plates()
    stage.open(MeshSequence(plates.vertices, None, plates.timebase))
    stage.view.set_view("camera")
    ground = QColor(stage.view.scene.colours.backdrop)
    assert stage.colour_at(LEFT) == ground
    assert stage.colour_at((-0.65, -0.25, 2.0)) != ground


def test_both_themes_have_their_ground(stage: Stage) -> None:
    for dark in (True, False):
        stage.display.set_dark(dark)
        ground = stage.view.grab().toImage().pixelColor(300, 20)
        expected = stage.display.palette.backdrop
        assert ground.name() == expected


@pytest.mark.parametrize(("mode", "drawn"), [("velocity", True), ("range", True), ("plain", False)])
def test_a_colour_bar_says_what_colours_mean(stage: Stage, mode: str, drawn: bool) -> None:
    stage.display.set_mesh_colour(mode)
    stage.scatter(np.zeros(8), ALL)
    corner = as_array(stage.view.grab().toImage())[20:260, -40:-10]
    colours = np.unique(corner.reshape(-1, 3), axis=0)
    saturated = np.ptp(colours, axis=1) > 60
    assert (saturated.sum() > 60) == drawn


# Time and models


def test_another_frame_moves_the_vertices(stage: Stage) -> None:
    stage.open(two_plates(5))
    stage.view.grab()
    stage.playback.seek(0.4)
    stage.view.grab()
    np.testing.assert_allclose(stage.view.scene.body.points[:, 2], 1.6, atol=1e-6)


def test_a_turn_of_the_event_loop_renders_once(stage: Stage) -> None:
    stage.open(two_plates(5))
    QGuiApplication.processEvents()
    backend = stage.view.findChild(image_backend.ImageBackend)
    before = backend.renderings
    stage.playback.seek(0.2)
    stage.sensor.set_sensor(VirtualSensor((0.5, 0.0, 0.0)))
    stage.display.set_dark(True)
    QGuiApplication.processEvents()
    assert backend.renderings == before + 1


def test_a_hidden_view_neither_renders_nor_computes(stage: Stage) -> None:
    stage.open(two_plates(5))
    stage.view.grab()
    backend = stage.view.findChild(image_backend.ImageBackend)
    stage.view.hide()
    before = (backend.renderings, stage.synthesis.asked)
    for time_s in (0.1, 0.2, 0.3):
        stage.playback.seek(time_s)
        QGuiApplication.processEvents()
    assert (backend.renderings, stage.synthesis.asked) == before


def test_the_picture_becomes_smooth_at_rest(stage: Stage, qtbot: Any) -> None:
    stage.scatter(np.full(8, 1.5), ALL)
    stage.view.set_view("overview")
    QGuiApplication.processEvents()
    backend = stage.view.findChild(image_backend.ImageBackend)
    before = backend.renderings
    qtbot.waitUntil(lambda: backend.renderings == before + 1, timeout=5000)
    coarse = stage.view.grab().toImage()
    assert coarse.size() == stage.view.size()


def test_a_recording_without_a_mesh_shows_the_sensor_and_says_so(stage: Stage) -> None:
    stage.open(None)
    assert stage.view.overlay.message == "No mesh in this recording"
    stage.view.set_view("overview")
    stage.view.grab()
    sensor = stage.colour_at(stage.sensor.sensor.position_m)
    assert greyness(sensor) > 60


def test_wrongly_sized_scattering_of_another_mesh_is_not_used(stage: Stage) -> None:
    stage.scatter(np.full(3, 1.5), np.ones(3, bool))
    assert greyness(stage.colour_at(LEFT)) < 25


# The picture and the projection agree


@pytest.mark.parametrize("preset", ["overview", "camera", "side", "top"])
def test_vtk_draws_where_the_projection_says(stage: Stage, preset: str) -> None:
    corner = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], np.float32) * 0.04
    faces = np.array([(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])
    where = np.array([0.3, 0.2, 1.7], np.float32)
    vertices = np.concatenate([corner - corner.mean(axis=0) + where, [(-1, -1, 1), (1, 1, 3)]])
    mesh = MeshSequence(vertices[None].astype(np.float32), faces, Timebase([0.0]))
    stage.sensor.set_sensor(VirtualSensor((-2.0, 0.0, 0.0)))
    stage.open(mesh)
    stage.display.set_mesh_colour("visibility")
    stage.scatter(np.zeros(6), np.ones(6, bool))
    for lines in stage.view.scene.ground.shapes:
        lines.show(False)
    stage.view.scene.body.shadow.SetPosition(0.0, 9.0, 0.0)
    stage.view.set_view(preset)
    picture = as_array(stage.view.grab().toImage())
    expected = stage.view.scene.pose.project(where)[0]
    x0, y0 = round(expected[0]), round(expected[1])
    patch = picture[y0 - 14 : y0 + 15, x0 - 14 : x0 + 15]
    rows, columns = np.nonzero(patch[..., 2] - patch[..., 0] > 50)
    assert len(rows) > 3
    assert abs(columns.mean() - 14 + 0.5 + x0 - expected[0]) < 2.0
    assert abs(rows.mean() - 14 + 0.5 + y0 - expected[1]) < 2.0


# Gestures with real events


def test_the_sensor_follows_the_mouse_to_the_pixel(stage: Stage) -> None:
    stage.view.set_view("overview")
    stage.view.grab()
    start = stage.pixel_of(stage.sensor.sensor.position_m)
    for offset in (QPoint(60, 30), QPoint(-25, 90)):
        start = stage.pixel_of(stage.sensor.sensor.position_m)
        drag(stage, start, start + offset / 2, start + offset)
        reached = stage.pixel_of(stage.sensor.sensor.position_m)
        assert (reached - (start + offset)).manhattanLength() <= 1
    assert stage.log == ["begin", "drag", "drag", "end"] * 2
    picture = stage.view.grab().toImage()
    assert greyness(picture.pixelColor(reached)) > 60  # the sphere is drawn there


def test_turning_the_view_leaves_the_sensor_alone(stage: Stage) -> None:
    stage.view.set_view("overview")
    stage.view.grab()
    pose = stage.view.scene.pose
    drag(stage, QPoint(300, 420), QPoint(340, 400))
    assert stage.view.scene.pose != pose
    assert stage.sensor.sensor == VirtualSensor()
    assert stage.log == []


def test_a_double_click_resets_the_view(stage: Stage) -> None:
    stage.view.set_view("overview")
    stage.view.grab()
    pose = stage.view.scene.pose
    drag(stage, QPoint(300, 420), QPoint(340, 400))
    QTest.mouseDClick(stage.view.childAt(300, 420), Qt.MouseButton.LeftButton, pos=QPoint(300, 420))
    stage.view.grab()
    assert stage.view.scene.pose == pose


def test_the_wheel_zooms(stage: Stage) -> None:
    distance = stage.view.scene.pose.distance_m
    where = QPointF(250, 200)
    turn = QWheelEvent(
        where,
        where,
        QPoint(),
        QPoint(0, 120),
        Qt.MouseButton.NoButton,
        Qt.KeyboardModifier.NoModifier,
        Qt.ScrollPhase.NoScrollPhase,
        False,
    )
    QGuiApplication.sendEvent(stage.view.childAt(250, 200), turn)
    assert stage.view.scene.pose.distance_m < distance


def test_the_cursor_tells_what_can_be_held(stage: Stage) -> None:
    stage.view.set_view("overview")
    stage.view.grab()
    here = stage.pixel_of(stage.sensor.sensor.position_m)
    widget = stage.view.childAt(here)
    QTest.mouseMove(widget, here)
    assert widget.cursor().shape() == Qt.CursorShape.OpenHandCursor
    QTest.mousePress(widget, Qt.MouseButton.LeftButton, pos=here)
    assert widget.cursor().shape() == Qt.CursorShape.ClosedHandCursor
    QTest.mouseRelease(widget, Qt.MouseButton.LeftButton, pos=here)
    QTest.mouseMove(widget, QPoint(300, 430))
    assert widget.cursor().shape() == Qt.CursorShape.ArrowCursor
    QGuiApplication.sendEvent(widget, QEvent(QEvent.Type.Leave))
    assert stage.view.navigator.target is None


def test_the_view_keeps_no_keys_for_itself(stage: Stage) -> None:
    assert stage.view.focusPolicy() == Qt.FocusPolicy.NoFocus
    widget = stage.view.childAt(10, 10)
    assert widget.focusPolicy() == Qt.FocusPolicy.NoFocus
    QTest.mouseClick(widget, Qt.MouseButton.LeftButton, pos=QPoint(300, 430))
    assert not widget.hasFocus()


def test_resizing_keeps_a_ready_made_view_framed(stage: Stage) -> None:
    stage.view.set_view("overview")
    stage.view.grab()
    stage.view.resize(320, 400)
    QGuiApplication.processEvents()
    stage.view.grab()
    points = stage.view.scene.extent.points_m
    x, y, _ = stage.view.scene.pose.project(points).T
    assert ((x > 0) & (x < 320) & (y > 0) & (y < 400)).all()


def test_the_view_from_the_sensor_goes_with_it(stage: Stage) -> None:
    stage.view.set_view("sensor")
    stage.sensor.set_sensor(VirtualSensor((0.3, -0.2, -0.5), azimuth_deg=20.0))
    stage.view.grab()
    np.testing.assert_allclose(stage.view.scene.pose.position, (0.3, -0.2, -0.5), atol=1e-9)
    assert stage.view.scene.pose.azimuth_deg == 20.0


def test_dragging_the_sensor_does_not_move_the_view(stage: Stage) -> None:
    stage.view.set_view("overview")
    stage.view.grab()
    pose = stage.view.scene.pose
    stage.sensor.set_dragging(True)
    stage.sensor.set_sensor(VirtualSensor((1.0, 0.0, -3.0)))
    stage.view.grab()
    assert stage.view.scene.pose == pose


def test_hiding_the_view_ends_a_drag(stage: Stage) -> None:
    stage.view.set_view("overview")
    stage.view.grab()
    here = stage.pixel_of(stage.sensor.sensor.position_m)
    QTest.mousePress(stage.view.childAt(here), Qt.MouseButton.LeftButton, pos=here)
    stage.view.hide()
    assert stage.log == ["begin", "end"]


@pytest.mark.one_in(7)
@pytest.mark.parametrize("mode", ["velocity", "range"])
@pytest.mark.parametrize(
    ("vertices", "sensor"),
    [
        ([(0, 0, 2)], (0, 0, 0)),  # a single point
        ([(0, 0, 2)] * 3, (0, 0, 2)),  # no extent, and the sensor is on it
        ([(1e6, 0, 2), (1e6, 1, 2), (1e6 + 1, 0, 2)], (0, 0, 0)),
        ([(0, 0, 0), (1, 0, 0), (0, 1, 0)], (1e6, -1e6, 1e6)),
        ([(0, 0, -2), (1, 0, -2), (0, 1, -2)], (0, 0, 0)),  # behind the camera
    ],
)
@pytest.mark.parametrize("preset", ["overview", "camera", "sensor", "side", "top"])
def test_odd_places_are_drawn_without_complaint(
    stage: Stage, mode: str, vertices: list[Any], sensor: Any, preset: str
) -> None:
    points = np.asarray(vertices, np.float64)
    faces = np.array([(0, 1, 2)]) if len(points) == 3 else None
    stage.display.set_mesh_colour(mode)
    stage.sensor.set_sensor(VirtualSensor(sensor))
    stage.open(MeshSequence(points[None], faces, Timebase([0.0])))
    stage.scatter(np.zeros(len(points)), np.ones(len(points), bool))
    stage.view.set_view(preset)
    picture = as_array(stage.view.grab().toImage())
    ground = QColor(stage.view.scene.colours.backdrop)
    assert (picture[2, 2] == (ground.red(), ground.green(), ground.blue())).all()
    assert np.isfinite(stage.view.scene.pose.position).all()


def test_a_mesh_that_cannot_be_read_any_more_is_said(stage: Stage) -> None:
    class Gone:
        shape = (3, 8, 3)
        dtype = np.float32

        def __getitem__(self, key: slice) -> np.ndarray:
            if stage.playback.time_s > 0.0:
                raise OSError("the disk was taken away")
            return np.asarray(two_plates(3).vertices)[key]

    stage.open(MeshSequence(Gone(), two_plates().faces, Timebase.regular(3, 10.0)))
    stage.view.grab()
    stage.playback.seek(0.1)
    stage.view.grab()
    assert "taken away" in stage.view.overlay.message


def test_an_unknown_view_is_an_error(stage: Stage) -> None:
    with pytest.raises(ValueError, match="behind"):
        stage.view.set_view("behind")


# Without OpenGL, and the end


def test_without_opengl_the_view_says_what_to_install(
    make_stage: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse() -> None:
        raise image_backend.NoOpenGL(image_backend.GL_BROKEN)

    monkeypatch.setattr(image_backend, "_off_screen_window", refuse)
    made = make_stage()
    assert made.view._backend is None
    text = made.view.findChild(QLabel).text()
    assert "OpenGL" in text
    assert "apt-get install" in text
    made.open(two_plates())
    made.view.set_view("top")
    made.display.set_dark(True)
    made.view.request_render()
    made.view.grab()


def test_a_closed_view_stays_quiet(stage: Stage) -> None:
    stage.view.close()
    stage.playback.seek(0.0)
    stage.sensor.set_sensor(VirtualSensor((1.0, 0.0, 0.0)))
    stage.display.set_dark(True)
    stage.open(two_plates(3))
    stage.view.set_view("top")
    stage.view.grab()


_LEFT_OPEN = """
from PySide6.QtWidgets import QMenu, QApplication
from sd2app.scene.offscreen_backend import ImageBackend
from sd2app.scene.scene import Scene
application = QApplication([])
backend = ImageBackend()
scene = Scene(backend.renderer)
backend.start(scene.prepare)
backend.show()
application.processEvents()
assert backend.renderings == 1
print("drawn")
"""


@pytest.mark.slow
def test_a_view_that_nobody_closed_does_not_crash_at_exit() -> None:
    run = subprocess.run(
        [sys.executable, "-c", _LEFT_OPEN], capture_output=True, text=True, timeout=120, check=False
    )
    assert run.returncode == 0, run.stderr
    assert run.stdout.strip() == "drawn"
    assert run.stderr == ""


_WITHOUT_DRIVER = """
from PySide6.QtWidgets import QMenu, QApplication
from sd2app.scene.offscreen_backend import ImageBackend, NoOpenGL
application = QApplication([])
try:
    ImageBackend()
except NoOpenGL as problem:
    print(problem)
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="libglvnd is on Linux")
def test_a_machine_without_a_driver_gets_a_sentence_and_no_crash(tmp_path: Path) -> None:
    run = subprocess.run(
        [sys.executable, "-c", _WITHOUT_DRIVER],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
        env={
            **os.environ,
            "QT_QPA_PLATFORM": "offscreen",
            "__EGL_VENDOR_LIBRARY_DIRS": str(tmp_path),
        },
    )
    assert run.returncode == 0, run.stderr
    assert run.stdout.strip() == image_backend.GL_BROKEN
    assert run.stderr == ""


def test_importing_the_view_loads_no_matplotlib() -> None:
    code = (
        "import sys; import sd2app.scene.view;"
        "print([m for m in ('matplotlib', 'scipy') if m in sys.modules])"
    )
    run = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=True
    )
    assert run.stdout.strip() == "[]"


# Planned places


def test_planned_places_are_drawn_in_the_colour_of_their_range(stage: Stage) -> None:
    stage.view.set_view("side")
    stage.plan((Place(0.9), Place(1.9, 0.0, 30.0)))
    stage.view.grab()
    near, far = (stage.colour_at(point_m) for point_m in stage.marker_middles_m())
    # Bright yellow and dark violet, both shaded.
    assert near.green() > near.blue() + 60
    assert far.blue() > far.green() + 10
    stage.placements.shown = False
    stage.placements.changed.emit()
    ground = stage.view.scene.colours.backdrop
    assert greyness(stage.colour_at(stage.marker_middles_m()[1])) <= greyness(QColor(ground)) + 6


def test_a_place_beyond_the_radar_has_the_colour_of_a_warning(stage: Stage) -> None:
    stage.view.set_view("side")
    stage.plan((Place(0.9), Place(1.9, 0.0, 30.0)), (False, True))
    stage.view.grab()
    colour = stage.colour_at(stage.marker_middles_m()[1])
    assert colour.red() > colour.blue() + 40


def test_a_click_on_a_place_picks_it_and_its_words_are_shown(stage: Stage) -> None:
    stage.view.set_view("side")
    stage.plan((Place(0.9), Place(1.9, 0.0, 30.0)))
    stage.view.grab()
    place = stage.pixel_of(tuple(stage.view.scene.markers.positions_m[1]))
    widget = stage.view.childAt(place)
    QTest.mouseMove(widget, place + QPoint(60, 60))
    before = as_array(stage.view.grab().toImage())
    QTest.mouseMove(widget, place)
    assert stage.view.navigator.target == Target("marker", 1)
    assert widget.cursor().shape() == Qt.CursorShape.PointingHandCursor
    assert (as_array(stage.view.grab().toImage()) != before).any()
    QTest.mouseClick(widget, Qt.MouseButton.LeftButton, pos=place)
    assert stage.placements.picked == [1]
    assert stage.log == []


def test_pointing_at_the_mesh_reads_the_vertex_in_front(stage: Stage) -> None:
    vertices_m = stage.document.mesh.frame(0)
    stage.scatter(np.linspace(-1.0, 1.0, len(vertices_m)), np.arange(len(vertices_m)) % 2 == 0)
    stage.view.set_view("camera")
    stage.view.grab()
    for vertex, point_m in enumerate(vertices_m):
        place = stage.pixel_of(tuple(point_m))
        read = stage.view.reading_at(place.x(), place.y())
        assert read.startswith(f"{vertex:.2f} m")
        assert read.endswith("hidden from the sensor" if vertex % 2 else "seen by the sensor")
    before = as_array(stage.view.grab().toImage())
    QTest.mouseMove(stage.view.childAt(place), place)
    assert (as_array(stage.view.grab().toImage()) != before).any()
    assert stage.view.reading_at(2, 2) == ""


def test_a_right_click_offers_the_picture_and_a_drag_does_not(stage: Stage) -> None:
    menus = lambda: stage.view.findChildren(QMenu)  # noqa: E731
    start, button = QPoint(300, 300), Qt.MouseButton.RightButton
    widget = stage.view.childAt(start)
    QTest.mousePress(widget, button, pos=start)
    QTest.mouseMove(widget, start + QPoint(40, 0))
    QTest.mouseRelease(widget, button, pos=start + QPoint(40, 0))
    assert not menus()
    QTest.mousePress(widget, Qt.MouseButton.LeftButton, pos=start)
    QTest.mouseClick(widget, button, pos=start)  # while the other one is held
    assert not menus()
    QTest.mouseRelease(widget, Qt.MouseButton.LeftButton, pos=start)
    QTest.mouseClick(widget, button, pos=start)
    assert texts_of(menus()[0]) == ["Copy picture", "Copy as SVG", "Save picture…"]
    pick(menus()[0], "Copy picture")
    assert QGuiApplication.clipboard().image().size() == stage.view.grab().toImage().size()


def test_a_thousand_places_are_one_actor(stage: Stage) -> None:
    renderer = stage.view.scene.renderer
    count = renderer.GetActors().GetNumberOfItems()
    stage.plan(PlacementCloud(1000, (1.0, 4.0), (-180.0, 180.0), (-90.0, 90.0)).places())
    stage.view.grab()
    assert len(stage.view.scene.markers.positions_m) == 1000
    assert renderer.GetActors().GetNumberOfItems() == count


# Parts of the body


@pytest.fixture
def limbed(stage: Stage) -> Stage:
    """The left plate is a trunk, the right one a forearm."""
    stage.limbs.vertex_parts = VertexParts(("trunk", "forearm.R"), np.repeat([0, 1], 4))
    return stage


def click(stage: Stage, place: QPoint, keys: Any = Qt.KeyboardModifier.NoModifier) -> None:
    QTest.mouseClick(stage.view.childAt(place), Qt.MouseButton.LeftButton, keys, place)


def test_a_click_picks_a_part_and_with_keys_several(limbed: Stage) -> None:
    left, right = limbed.pixel_of(LEFT), limbed.pixel_of(RIGHT)
    click(limbed, left)
    click(limbed, right, Qt.KeyboardModifier.ControlModifier)
    click(limbed, right, Qt.KeyboardModifier.ShiftModifier)
    click(limbed, QPoint(20, 430))
    several = [("forearm.R", True)] * 2
    assert limbed.limbs.picked == [("trunk", False), *several, (None, False)]
    drag(limbed, left, left + QPoint(30, 0))  # turns the view
    drag(limbed, left, left + QPoint(30, 0), left)  # there and back is no click either
    assert len(limbed.limbs.picked) == 4
    limbed.view.set_view("overview")
    limbed.view.grab()
    click(limbed, limbed.pixel_of(limbed.sensor.sensor.position_m))
    assert len(limbed.limbs.picked) == 4


def test_chosen_parts_have_their_colours_and_the_rest_is_plain(limbed: Stage) -> None:
    limbed.scatter([2.0] * 8, [True] * 8)
    assert greyness(limbed.colour_at(LEFT)) > 60  # it approaches
    limbed.limbs.parts = ("forearm.R",)
    limbed.limbs.changed.emit()
    assert greyness(limbed.colour_at(LEFT)) < 25
    hue = limbed.colour_at(RIGHT).hue()
    assert abs(hue - QColor(LIMB_COLOURS["forearm.R"]).hue()) < 8
    limbed.limbs.parts = ()
    limbed.limbs.changed.emit()
    assert greyness(limbed.colour_at(LEFT)) > 60


def test_limbs_of_another_person_are_picked_on_their_body(limbed: Stage) -> None:
    """Anna's plates stand 0.5 m below the first person's: a forearm and a thigh."""
    first = limbed.limbs.vertex_parts
    anna = VertexParts(("forearm.L", "thigh.L"), np.repeat([0, 1], 4))
    limbed.limbs.persons = ("person 1", "anna")
    limbed.limbs.vertex_parts = replace(first, others=(anna,))
    mesh = two_plates()
    below = replace(mesh, vertices=mesh.vertices + np.float32([0, 0.55, 0]), person="anna")
    limbed.document.mesh = replace(mesh, others=(below,))
    limbed.document.changed.emit()
    limbed.view.grab()
    lower = [tuple(np.add(place, (0, 0.55, 0))) for place in (LEFT, RIGHT)]
    for place in (LEFT, *lower):
        click(limbed, limbed.pixel_of(place))
    names = ["person 1: trunk", "anna: forearm.L", "anna: thigh.L"]
    assert limbed.limbs.picked == [(name, False) for name in names]
    assert limbed.log == ["take 0", "end"] * 2
    limbed.limbs.parts = ("anna: thigh.L",)
    limbed.limbs.changed.emit()
    hue = limbed.colour_at(lower[1]).hue()
    assert abs(hue - QColor(LIMB_COLOURS["thigh.L"]).hue()) < 8
    assert limbed.colour_at(lower[0]) != limbed.colour_at(lower[1])
    assert greyness(limbed.colour_at(LEFT)) < 25


def test_the_pointer_names_the_part(limbed: Stage) -> None:
    limbed.scatter([0.5] * 8, [True] * 8)
    place = limbed.pixel_of(RIGHT)
    QTest.mouseMove(limbed.view.childAt(place), place)
    assert limbed.view.overlay.reading.startswith("right forearm")
    assert "Ctrl" in limbed.view.overlay.hint
    QTest.mouseMove(limbed.view.childAt(place), QPoint(20, 430))
    assert limbed.view.overlay.reading == limbed.view.overlay.hint == ""
