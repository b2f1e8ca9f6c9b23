"""The mesh over the video: where it is drawn, how strongly, and that the choice is kept."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from PySide6.QtGui import QColor, QImage, QPainter

from sd2app.settings import Settings
from sd2app.video.feature import OverlayModel, OverlayStyle
from sd2app.widgets.mesh_painting import tinted
from sd2core.body.camera import PinholeCamera
from sd2core.figures.surface import Frame, shade_mesh

CAMERA = PinholeCamera(160, 120, 150.0)


@pytest.fixture(scope="module", autouse=True)
def kernels(compiled_kernels: None) -> None:
    """Surfaces are drawn as dots until there is machine code."""


@pytest.fixture(scope="module")
def ball() -> trimesh.Trimesh:
    """A ball of 0.3 m at (0.4, −0.2, 3) m."""
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.3)
    ball.apply_translation((0.4, -0.2, 3.0))
    return ball


def centre_px(drawn: np.ndarray) -> tuple[float, float]:
    rows, columns = np.nonzero(drawn)
    return columns.mean() + 0.5, rows.mean() + 0.5


def test_a_ball_is_drawn_where_the_camera_sees_it(ball) -> None:
    light = shade_mesh(ball.vertices, np.asarray(ball.faces, np.int32), CAMERA)
    x, y = centre_px(light > 0)
    assert x == pytest.approx(80 + 150 * 0.4 / 3, abs=0.5)
    assert y == pytest.approx(60 - 150 * 0.2 / 3, abs=0.5)
    radius_px = 150 * 0.3 / 3
    assert (light > 0).sum() == pytest.approx(np.pi * radius_px**2, rel=0.05)
    # Square on in the middle, edge-on at the rim.
    assert light[50, 100] > 0.97
    assert light[50, 86] == pytest.approx(0.35 + 0.65 * (1 - 0.9**2) ** 0.5, abs=0.05)


def test_dots_lie_within_the_same_outline(ball) -> None:
    surface = shade_mesh(ball.vertices, np.asarray(ball.faces, np.int32), CAMERA) > 0
    dots = shade_mesh(ball.vertices, None, CAMERA) > 0
    assert centre_px(dots) == pytest.approx(centre_px(surface), abs=1.0)
    assert 0.05 * surface.sum() < dots.sum() < 0.9 * surface.sum()
    assert not (dots & ~np.pad(surface, 1)[:-2, 1:-1] & ~surface)[:, :80].any()


def test_what_is_behind_the_camera_is_not_drawn(ball) -> None:
    behind = ball.vertices - (0, 0, 6)
    for faces in (None, np.asarray(ball.faces, np.int32)):
        assert not shade_mesh(behind, faces, CAMERA).any()


def test_a_part_of_the_picture_is_drawn_enlarged(ball) -> None:
    faces = np.asarray(ball.faces, np.int32)
    whole = shade_mesh(ball.vertices, faces, CAMERA) > 0
    part = shade_mesh(ball.vertices, faces, CAMERA, Frame(80, 30, 120, 120, zoom=3.0)) > 0
    x, y = centre_px(whole)
    assert centre_px(part) == pytest.approx((3 * (x - 80), 3 * (y - 30)), abs=1.5)
    assert part.sum() == pytest.approx(9 * whole.sum(), rel=0.05)


@pytest.mark.parametrize(("opacity", "mixed"), [(0.0, 100), (0.25, 125), (1.0, 200)])
def test_opacity_mixes_mesh_and_picture(opacity, mixed) -> None:
    light = np.array([[1.0, 0.0], [0.0, 0.0]], np.float32)
    pixels = tinted(light, (200, 200, 200), opacity)
    picture = QImage(2, 2, QImage.Format.Format_RGB32)
    picture.fill(QColor(100, 100, 100))
    with QPainter(picture) as painter:
        painter.drawImage(
            0, 0, QImage(pixels.data, 2, 2, 8, QImage.Format.Format_ARGB32_Premultiplied)
        )
    assert picture.pixelColor(0, 0).red() == pytest.approx(mixed, abs=1)
    assert all(picture.pixelColor(x, y).red() == 100 for x, y in ((1, 0), (0, 1), (1, 1)))


def test_channels_are_in_their_places() -> None:
    (pixel,) = tinted(np.ones((1, 1), np.float32), (10, 20, 30), 1.0)[0]
    assert pixel == 0xFF0A141E


def test_the_choice_is_remembered() -> None:
    settings = Settings.forgetful()
    OverlayModel(settings).set_style(opacity=0.8, as_dots=True, shown=False)
    assert OverlayModel(settings).style == OverlayStyle(shown=False, opacity=0.8, as_dots=True)


def test_what_was_stored_badly_is_not_believed() -> None:
    settings = Settings.forgetful()
    settings.set_value("overlay/opacity", "seven")
    settings.set_value("overlay/shown", "FALSE")
    style = OverlayModel(settings).style
    assert style.opacity == OverlayStyle.opacity
    assert style.shown is False


def test_opacity_stays_between_nothing_and_all() -> None:
    overlay = OverlayModel(Settings.forgetful())
    overlay.set_style(opacity=7.0)
    assert overlay.style.opacity == 1.0
