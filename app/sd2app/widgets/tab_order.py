"""Order in which Tab goes through the controls: region by region, each as one reads."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import QWidget


def controls_of(regions: Sequence[QWidget]) -> list[QWidget]:
    """Enabled controls that are visible, from region to region, in rows from top left."""
    return [control for region in regions for control in _rows_of(region)]


def tab_to(regions: Sequence[QWidget], focus: QWidget | None, forward: bool) -> QWidget | None:
    """Give the keyboard to the control after the one that has it, or before; None without any."""
    controls, step = controls_of(regions), 1 if forward else -1
    if not controls:
        return None
    at = controls.index(focus) + step if focus in controls else min(step, 0)
    control, reason = controls[at % len(controls)], Qt.FocusReason
    control.setFocus(reason.TabFocusReason if forward else reason.BacktabFocusReason)
    return control


def _rows_of(region: QWidget) -> list[QWidget]:
    found = {one: one.mapTo(region, QPoint(0, 0)) for one in _controls(region)}
    rows: list[list[QWidget]] = []
    for one in sorted(found, key=lambda one: found[one].y() + one.height() / 2):
        middle_px = found[one].y() + one.height() / 2
        # A row is what the first control of it has beside itself.
        if rows and middle_px < found[rows[-1][0]].y() + rows[-1][0].height():
            rows[-1].append(one)
        else:
            rows.append([one])
    return [one for row in rows for one in sorted(row, key=lambda one: found[one].x())]


def _controls(region: QWidget) -> list[QWidget]:
    tab = Qt.FocusPolicy.TabFocus.value
    return [
        one
        for one in region.findChildren(QWidget)
        if one.focusPolicy().value & tab
        and one.isVisibleTo(region)
        and region.isVisible()
        and one.isEnabled()
        and one.focusProxy() is None
        and one.window() is region.window()
    ]
