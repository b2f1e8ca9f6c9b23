"""Colours of the two themes. Text on its background has a contrast of at least 4.5:1.

That holds for what is disabled as well; frames of what is typed, chosen or pressed have 3:1.
Colours of a sensor's axes have 4.5:1 on panels and wells, and differ to the colour-blind.
"""

from __future__ import annotations


class _Colour:
    """A colour of a palette: in the light theme, and in the dark one."""

    def __init__(self, light: str, dark: str) -> None:
        self._of_theme = light, dark

    def __get__(self, palette: Palette, owner: type[Palette]) -> str:
        return self._of_theme[palette.dark]


class Palette:
    """Named colours of a theme as ``#rrggbb``."""

    def __init__(self, dark: bool) -> None:
        self.dark = dark

    window = _Colour("#f3f4f6", "#17191d")
    panel = _Colour("#ffffff", "#1e2126")
    well = _Colour("#e9ebee", "#121417")
    border = _Colour("#d3d7dd", "#343941")
    frame = _Colour("#7b828c", "#6b727d")
    text = _Colour("#1d2127", "#e7e9ec")
    muted = _Colour("#5a6370", "#a0a8b3")
    disabled = _Colour("#626974", "#868e99")
    accent = _Colour("#1f66d1", "#79b0ff")
    accent_text = _Colour("#ffffff", "#0e1116")
    synthetic = _Colour("#1f66d1", "#79b0ff")
    denoised = _Colour("#0b7a5b", "#4fd0a2")
    before = _Colour("#8a4bb0", "#cfa2ee")
    real = _Colour("#b4520b", "#f5a45a")
    level = _Colour("#f7f8f9", "#17191d")
    hatch = _Colour("#9aa1ab", "#5a616c")
    warning = _Colour("#a33a00", "#ffb07a")
    overlay = _Colour("#2fc6a8", "#2fc6a8")
    axis_x = _Colour("#b83a00", "#ff8a4c")
    axis_y = _Colour("#00786b", "#46e0b0")
    axis_z = _Colour("#4b3bc8", "#9a9cff")
    inertial = _Colour("#ffd21f", "#ffd21f")
    # Of the 3D view.
    backdrop = _Colour("#f6f7f9", "#1b1d21")
    grid = _Colour("#bbbfc5", "#53575e")
    shadow = _Colour("#d6d7d9", "#121416")
    plain = _Colour("#c3c9d1", "#aab1bb")
    hidden = _Colour("#8b929c", "#5f6670")
    visible = _Colour("#5e91de", "#79b0ff")
    accent_hot = _Colour("#6d9ce1", "#a8ccff")


LIGHT, DARK = Palette(False), Palette(True)


def palette_for(dark: bool) -> Palette:
    """The colours of a theme."""
    return DARK if dark else LIGHT
