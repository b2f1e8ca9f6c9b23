"""Pictures of all panels and dialogs on one sheet, to be looked at: `make contact-sheet`.

Draws the sample's window into ``build/contact-sheet``, each picture for itself and all of them on
a sheet for each theme; ``--size 1600x1000 --scale 2 --theme dark`` asks for others.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterator

from PySide6.QtCore import QPoint, QTimer
from PySide6.QtGui import QColor, QPainter, QPixmap
from PySide6.QtWidgets import QApplication, QWidget

from sd2app.palette import palette_for
from sd2app.session.display import LAYOUTS
from sd2app.shell.window import MainWindow
from sd2app.widgets.panel import InnerPages
from sd2core.files.resources import resource_path
from tools.documentation.places import REPOSITORY
from tools.documentation.windows import opened, settle, wait_for

FOLDER = REPOSITORY / "build" / "contact-sheet"
DIALOGS = (
    "new_from_video", "listen", "read_mesh", "export_map", "export_maps", "export_strip",
    "export_dataset", "batch", "any_command", "recover_labels", "align", "preferences",
    "messages", "export_labels", "cut_out", "add_track", "find_action", "keys", "manual", "about",
)  # fmt: skip
"""Actions of the menus that ask or show something in a window of its own."""
SHEET_PX, CAPTION_PX, GAP_PX = 2800, 24, 16


def pictures(window: MainWindow) -> Iterator[tuple[str, QPixmap]]:
    """The start page, the layouts, the panels page by page, the dialogs and the tour."""

    def grab(widget: QWidget) -> QPixmap:
        settle(window)
        return widget.grab()

    yield "start", grab(window)
    window.open_paths([resource_path("swipes.sd2")])
    for layout in LAYOUTS:
        window.session.layouts.choose(layout)
        yield f"layout {layout}", grab(window)
    for panel in window.side.names:
        window.bring_up(panel)
        inner = next((one for one in window.side.findChildren(InnerPages) if one.isVisible()), None)
        for page in inner.names if inner else [""]:
            if inner:
                inner.turn_to(page)
            yield f"{panel} {page}".rstrip(), grab(window.side)
    window.fold_side(True)
    yield from ((name, dialog(window, name)) for name in DIALOGS)
    window.action("tour").trigger()
    yield "tour", grab(window)


def dialog(window: MainWindow, action: str) -> QPixmap:
    """What an action shows, closed again."""
    taken: list[QPixmap] = []

    def take() -> None:
        settle(window)
        shown = [one for one in QApplication.topLevelWidgets() if one.isVisible() and one != window]
        for one in shown:
            taken.append(one.grab())
            one.close()
        if not shown:
            QTimer.singleShot(500, take)

    QTimer.singleShot(2000, take)  # which is as long as figures are drawn
    window.action(action).trigger()
    wait_for(lambda: bool(taken))
    return taken[0]


def sheet(shown: list[tuple[str, QPixmap]], dark: bool) -> QPixmap:
    """Pictures beside and below each other, each with its name."""
    places, right, below, low = [], 0, 0, 0
    for _, picture in shown:
        size = picture.deviceIndependentSize().toSize()
        if right and right + size.width() > SHEET_PX:
            right, below, low = 0, low, low
        places.append(QPoint(right, below))
        right += size.width() + GAP_PX
        low = max(low, below + size.height() + CAPTION_PX + GAP_PX)
    whole = QPixmap(SHEET_PX, low)
    whole.fill(QColor(palette_for(dark).well))
    painter = QPainter(whole)
    painter.setPen(QColor(palette_for(dark).text))
    for place, (name, picture) in zip(places, shown, strict=True):
        painter.drawText(place + QPoint(0, CAPTION_PX - 8), name)
        painter.drawPixmap(place + QPoint(0, CAPTION_PX), picture)
    painter.end()
    return whole


def main() -> None:
    """Draw the themes that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--size", default="1280x720", help="of the window, such as 1280x720")
    parser.add_argument("--scale", type=float, default=1.0, help="pixels of the screen per pixel")
    parser.add_argument("--theme", choices=("light", "dark"), action="append")
    arguments = parser.parse_args()
    os.environ["QT_SCALE_FACTOR"] = str(arguments.scale)
    width, height = map(int, arguments.size.split("x"))
    for theme in arguments.theme or ("light", "dark"):
        folder = FOLDER / f"{arguments.size} x{arguments.scale:g} {theme}"
        folder.mkdir(parents=True, exist_ok=True)
        with opened([], size=(width, height)) as window:
            window.features.program.set_dark(theme == "dark")
            shown = list(pictures(window))
        for name, picture in shown:
            picture.save(str(folder / f"{name}.png"))
        sheet(shown, theme == "dark").save(f"{folder}.png")
        print(f"{folder}.png")


if __name__ == "__main__":
    main()
