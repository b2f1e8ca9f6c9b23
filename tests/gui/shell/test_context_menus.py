"""Context menus of timeline, video, scene and the axes below the maps, by a right click."""

from __future__ import annotations

import label_hands as hands
import numpy as np
import pytest
from answering import menu_at, pick, texts_of
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QMenu
from window_models import models_of

from sd2app.maps.heatmap_image import Overview
from sd2app.playback.feature import TimeRuler
from sd2app.scene.offscreen_backend import ImageBackend
from sd2app.scene.view import SceneView
from sd2app.video.feature import VideoView

PICTURE = ["Copy picture", "Copy as SVG", "Save picture…"]
FRAME = ["Label from here", "Export strip of frames…"]


def marks(window) -> list[tuple[str, float]]:
    return [(mark.label, mark.start_s) for mark in models_of(window).labels.marks]


def test_the_timeline_plays_and_labels_from_a_place_and_exports(labelled) -> None:
    c, view = models_of(labelled), hands.timeline(labelled)
    menu = menu_at(view, hands.at(labelled, 0.5))
    assert texts_of(menu) == [
        *("Play “there” in a loop", "Label from here", "Spans", "Tracks"),
        *("Export labels…", "Export cut-outs…"),
        *PICTURE,
    ]
    pick(menu, "Play “there” in a loop")
    assert c.playback.stretch_s == pytest.approx((0.2, 0.8))
    c.playback.pause()
    c.playback.set_stretch(None)
    pick(menu_at(view, hands.at(labelled, 0.9)), "Label from here", "up-to-down")
    assert marks(labelled) == [("up-to-down", pytest.approx(0.9, abs=1 / 30))]
    hands.key(labelled, "Escape")


def test_a_map_labels_from_a_place(labelled) -> None:
    view = labelled.maps.synthetic
    place = QPoint(round(view.scale.x_of(0.9)), round(view.y_of(1.0)))
    pick(menu_at(view, place), "Label from here", "left-to-right")
    assert marks(labelled) == [("left-to-right", pytest.approx(0.9, abs=1 / 30))]
    hands.key(labelled, "Escape")


def test_the_video_labels_the_frame_on_screen(labelled) -> None:
    c, view = models_of(labelled), labelled.findChild(VideoView)
    c.playback.seek_frame(27)
    menu = menu_at(view, view.rect().center())
    assert texts_of(menu) == [*FRAME, *PICTURE]
    pick(menu, "Label from here", "down-to-up")
    assert marks(labelled) == [("down-to-up", c.playback.time_s)]
    assert c.playback.frame == 27
    hands.key(labelled, "Escape")


def test_the_scene_reads_the_mesh_at_a_place(labelled, qtbot) -> None:
    scene, canvas = labelled.findChild(SceneView), labelled.findChild(ImageBackend)
    c = models_of(labelled)
    c.playback.seek_frame(27)
    qtbot.waitUntil(lambda: c.synthesis.frame is not None, timeout=10_000)
    scene.grab()
    x, y, depth = scene.scene.pose.project(c.document.mesh.frame(27)).T
    nearest = depth.argmin()
    QTest.mouseClick(
        canvas, Qt.MouseButton.RightButton, pos=QPoint(round(x[nearest]), round(y[nearest]))
    )
    menu = scene.findChildren(QMenu)[0]
    place = f"Place inertial sensor at vertex {nearest}"
    assert texts_of(menu) == ["Copy value", place, *FRAME, *PICTURE]
    pick(menu, "Copy value")
    range_m = float(QGuiApplication.clipboard().text().split(" m ")[0])
    distances_m = np.linalg.norm(c.document.mesh.frame(27), axis=1)  # the sensor is at the origin
    assert distances_m.min() - 0.01 <= range_m <= distances_m.max() + 0.01


def test_a_right_click_on_an_axis_moves_nothing(labelled) -> None:
    c = models_of(labelled)
    for kind in (TimeRuler, Overview):
        view = labelled.findChild(kind)
        place = QPoint(round(view.scale.x_of(1.5)), view.height() // 2)
        menu = menu_at(view, place)
        assert texts_of(menu) == PICTURE
        menu.close()
        QTest.mouseMove(view, place + QPoint(40, 0))
        assert c.playback.frame == 0
        assert c.span.extent_s == (c.span.start_s, c.span.end_s)
