"""Words and colours of the parts of the body that a map is shown of."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from sd2app.session.maps import MapModel
from sd2core.maps import OF
from sd2core.mesh.vertex_parts import PARTS

LIMB_COLOURS: Mapping[str, str] = {
    "trunk": "#9aa3ad",
    "upper_arm.L": "#4fb3ff",
    "upper_arm.R": "#f2a900",
    "forearm.L": "#1f77d0",
    "forearm.R": "#e8600a",
    "thigh.L": "#2bbf8a",
    "thigh.R": "#f57fb5",
    "lower_leg.L": "#008f6b",
    "lower_leg.R": "#c2307f",
}
"""Colour of every part of the body: cool ones on the left, warm ones on the right."""


def title_of(track: MapModel) -> str:
    """Title of a map, with the parts of the body that are shown alone."""
    parts = " + ".join(map(part_words, track.parts))
    return f"{track.title} · {parts}" if parts else track.title


def part_words(part: str) -> str:
    """Part of the body in words, after a person's name in a scene of several."""
    person, of, own = part.rpartition(OF)
    if of:
        return f"{person}{of}{part_words(own)}"
    if part not in PARTS:  # a person
        return part
    name, _, side = part.partition(".")
    words = "head and trunk" if name == "trunk" else name.replace("_", " ")
    return {"L": f"left {words}", "R": f"right {words}"}.get(side, words)


def colours_of(parts: Iterable[str]) -> dict[str, str]:
    """Colour of each of some parts or people: a limb's own, unless another one has it."""
    found: dict[str, str] = {}
    for part in parts:
        free = [one for one in LIMB_COLOURS.values() if one not in found.values()]
        own = LIMB_COLOURS.get(part.rpartition(OF)[2], "")
        found[part] = own if own in free else (free or [*LIMB_COLOURS.values()])[-1]
    return found
