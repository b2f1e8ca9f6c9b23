"""Order, heights and folding of the maps on screen, as the user set them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from PySide6.QtCore import QObject, Signal

from sd2app.settings import Settings

HEADER_PX = 24
"""Height of the title row of a map, which is all of a folded one."""
BELOW_PX = 4
"""Room below a map: the border that is dragged."""
MIN_PX = HEADER_PX + 72 + BELOW_PX
_KEPT = "maps/arrangement"


class Row(NamedTuple):
    """One map of the stack."""

    wanted_px: int | None = None  # height the user set; None shares what is left over
    folded: bool = False


def heights_px(rows: Sequence[Row], room_px: int) -> list[int]:
    """Heights of all maps; they fill the room, or exceed it where each is as low as allowed."""
    heights = [
        HEADER_PX if row.folded else 0 if row.wanted_px is None else max(row.wanted_px, MIN_PX)
        for row in rows
    ]
    open_rows = [index for index, row in enumerate(rows) if not row.folded]
    sharing = [index for index in open_rows if rows[index].wanted_px is None] or open_rows[-1:]
    left = room_px - sum(heights)
    for count, index in enumerate(sharing):
        share = left // (len(sharing) - count)
        grown = max(heights[index] + share, heights[index], MIN_PX)
        left -= grown - heights[index]
        heights[index] = grown
    return heights


class Arrangement(QObject):
    """Names of maps from top to bottom, with what the user made of each; kept in the settings.

    One map may be enlarged to the whole stack, until the window is closed.
    """

    changed = Signal()

    def __init__(self, names: Sequence[str], settings: Settings, parent: QObject) -> None:
        super().__init__(parent)
        self._settings = settings
        kept = _read(settings.table(_KEPT))
        order = [name for name in kept if name in names]
        self.order = order + [name for name in names if name not in order]
        self._rows = {name: kept.get(name, Row()) for name in names}
        self.enlarged: str | None = None

    def row(self, name: str) -> Row:
        """Height and folding of a map."""
        return self._rows[name]

    def fold(self, name: str, folded: bool) -> None:
        """Fold a map to its title, or open it."""
        self._set(name, self._rows[name]._replace(folded=folded))

    def set_height(self, name: str, height_px: int | None) -> None:
        """Give a map a height; None lets it share what is left over."""
        wanted_px = None if height_px is None else max(height_px, MIN_PX)
        self._set(name, self._rows[name]._replace(wanted_px=wanted_px))

    def move(self, name: str, other: str, below: bool) -> None:
        """Move a map to the place directly above or below another one."""
        order = [each for each in self.order if each != name]
        order.insert(order.index(other) + below, name)
        if order != self.order:
            self.order = order
            self._keep()

    def enlarge(self, name: str | None) -> None:
        """Show one map alone; None shows all."""
        if name != self.enlarged:
            self.enlarged = name
            self.changed.emit()

    def _set(self, name: str, row: Row) -> None:
        if row != self._rows[name]:
            self._rows[name] = row
            self._keep()

    def _keep(self) -> None:
        self._settings.keep_table(_KEPT, {name: self._rows[name] for name in self.order})
        self.changed.emit()


def _read(kept: Mapping[str, Any]) -> Mapping[str, Row]:
    """Rows by name, as they were kept; none where they are damaged."""
    try:
        return {
            name: Row(None if px is None else int(px), bool(folded))
            for name, (px, folded) in kept.items()
        }
    except (ValueError, TypeError, OverflowError):
        return {}
