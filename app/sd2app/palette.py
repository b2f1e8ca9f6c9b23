"""Colours of the two themes. Text on its background has a contrast of at least 4.5:1.

That holds for what is disabled as well; frames of what is typed, chosen or pressed have 3:1.
Colours of a sensor's axes have 4.5:1 on panels and wells, and differ to the colour-blind.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Palette:
    """Named colours as ``#rrggbb``."""

    window: str
    panel: str
    well: str
    border: str
    frame: str
    text: str
    muted: str
    disabled: str
    accent: str
    accent_text: str
    synthetic: str
    denoised: str
    before: str
    real: str
    level: str
    hatch: str
    warning: str
    overlay: str
    axis_x: str
    axis_y: str
    axis_z: str
    inertial: str


LIGHT = Palette(
    window="#f3f4f6",
    panel="#ffffff",
    well="#e9ebee",
    border="#d3d7dd",
    frame="#7b828c",
    text="#1d2127",
    muted="#5a6370",
    disabled="#626974",
    accent="#1f66d1",
    accent_text="#ffffff",
    synthetic="#1f66d1",
    denoised="#0b7a5b",
    before="#8a4bb0",
    real="#b4520b",
    level="#f7f8f9",
    hatch="#9aa1ab",
    warning="#a33a00",
    overlay="#2fc6a8",
    axis_x="#b83a00",
    axis_y="#00786b",
    axis_z="#4b3bc8",
    inertial="#ffd21f",
)
DARK = Palette(
    window="#17191d",
    panel="#1e2126",
    well="#121417",
    border="#343941",
    frame="#6b727d",
    text="#e7e9ec",
    muted="#a0a8b3",
    disabled="#868e99",
    accent="#79b0ff",
    accent_text="#0e1116",
    synthetic="#79b0ff",
    denoised="#4fd0a2",
    before="#cfa2ee",
    real="#f5a45a",
    level="#17191d",
    hatch="#5a616c",
    warning="#ffb07a",
    overlay="#2fc6a8",
    axis_x="#ff8a4c",
    axis_y="#46e0b0",
    axis_z="#9a9cff",
    inertial="#ffd21f",
)


def palette_for(dark: bool) -> Palette:
    """The colours of a theme."""
    return DARK if dark else LIGHT
