"""A canvas draws again what has changed, and keeps the rest."""

from __future__ import annotations

import pytest
from PySide6.QtGui import QColor, QPainter

from sd2app.widgets.canvas import Canvas


class Layers(Canvas):
    """A red map with a blue label over its left half, each kept, and what was drawn."""

    def __init__(self) -> None:
        super().__init__()
        self.drawn: list[str] = []

    def ground(self, painter: QPainter) -> None:
        self.drawn.append("ground")
        painter.fillRect(self.rect(), QColor("red"))

    def label(self, painter: QPainter) -> None:
        self.drawn.append("label")
        painter.fillRect(0, 0, self.width() // 2, self.height(), QColor("blue"))

    def paint(self, painter: QPainter) -> None:
        self.paint_kept(painter, self.ground)
        self.paint_kept(painter, self.label)

    def colours(self) -> tuple[str, str]:
        image = self.grab().toImage()
        return tuple(image.pixelColor(x, 10).name() for x in (5, self.width() - 5))


@pytest.fixture
def layers(qtbot) -> Layers:
    canvas = Layers()
    qtbot.addWidget(canvas)
    canvas.resize(60, 20)
    return canvas


def test_pictures_are_laid_over_each_other_and_drawn_once(layers: Layers) -> None:
    assert layers.colours() == ("#0000ff", "#ff0000")
    assert layers.colours() == ("#0000ff", "#ff0000")
    assert layers.drawn == ["ground", "label"]


@pytest.mark.parametrize("change", [Layers.redraw, lambda canvas: canvas.resize(80, 20)])
def test_all_is_drawn_again_after_a_redraw_or_in_another_size(layers: Layers, change) -> None:
    layers.colours()
    change(layers)
    assert layers.colours() == ("#0000ff", "#ff0000")
    assert layers.drawn == 2 * ["ground", "label"]
