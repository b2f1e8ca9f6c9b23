"""The moving picture of the README: the sensor is dragged round the body, and the maps follow.

``make moving-picture`` draws the real window on the bundled sample, which is simulated, and
writes ``docs/images/dragging.gif``.
"""

from __future__ import annotations

import math

from PIL import Image
from PySide6.QtGui import QImage

from sd2app.shell.window import MainWindow
from tools.documentation.measured import IMAGES, REPOSITORY, SAMPLE
from tools.documentation.windows import opened, wait_for

SIZE = (1280, 720)
SHOWN_WIDTH = 880
STEPS = 36
"""Pictures of one way to the side and back."""

FRAME_MS = 90
FOLLOWS_S = 0.35
"""Longer than any map takes to follow the hand."""

COLOURS = 256
LIMIT_BYTES = 3_000_000


def main() -> None:
    """Drag, draw, write."""
    with opened([SAMPLE], size=SIZE) as window:
        window.session.playback.seek(1.9)
        _run(1.0)
        edits = window.session.edits
        pictures = [_picture(window)]
        edits.begin_sensor_drag()
        for step in range(1, STEPS + 1):
            turned = math.sin(math.pi * step / STEPS) ** 2
            edits.drag_sensor((1.7 * turned, -0.25 * turned, 0.9 * turned))
            _run(FOLLOWS_S)
            pictures.append(_picture(window))
        edits.end_drag()
    # All colours of the maps' table are covered; the means then keep greys grey.
    palette = pictures[STEPS // 2].quantize(COLOURS, Image.Quantize.MAXCOVERAGE, kmeans=2)
    frames = [one.quantize(palette=palette, dither=Image.Dither.NONE) for one in pictures]
    path = IMAGES / "dragging.gif"
    frames[0].save(
        path, save_all=True, append_images=frames[1:], duration=FRAME_MS, loop=0, optimize=True
    )
    size = path.stat().st_size
    print(f"{path.relative_to(REPOSITORY)}: {size / 1e6:.1f} MB")
    if size > LIMIT_BYTES:
        raise SystemExit(f"It may have {LIMIT_BYTES / 1e6:.0f} MB: take fewer STEPS or COLOURS")


def _run(seconds: float) -> None:
    """Let the window work for a while."""
    wait_for(lambda: False, seconds)


def _picture(window: MainWindow) -> Image.Image:
    """The window as it is, in the width that a page shows."""
    drawn = window.grab().toImage().convertToFormat(QImage.Format.Format_RGB888)
    pixels = bytes(drawn.constBits())
    whole = Image.frombytes(
        "RGB", (drawn.width(), drawn.height()), pixels, "raw", "RGB", drawn.bytesPerLine()
    )
    height = round(SHOWN_WIDTH * drawn.height() / drawn.width())
    return whole.resize((SHOWN_WIDTH, height), Image.Resampling.LANCZOS)


if __name__ == "__main__":
    main()
