"""Colours of the mesh as arrays; no VTK."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sd2app.palette import Palette
from sd2app.session.display import MeshColour
from sd2app.widgets.time_axis import tick_step
from sd2core.figures.colours import SEQUENTIAL, Rgb, look_up, rgb, velocity_colours


def fractions(colour: str) -> tuple[float, float, float]:
    """``#rrggbb`` as three numbers from 0 to 1, as VTK wants them."""
    red, green, blue = (int(value) / 255.0 for value in rgb(colour))
    return (red, green, blue)


def mixed(colour: str, other: str, share: float) -> str:
    """Mix of ``colour`` with ``share`` of ``other``."""
    blend = (1.0 - share) * rgb(colour) + share * rgb(other)
    return "#" + np.rint(blend).astype(np.uint8).tobytes().hex()


def range_colours(range_m: NDArray[np.floating], limits_m: tuple[float, float]) -> Rgb:
    """Sequential colours of ranges between two limits; (V, 3)."""
    return look_up(SEQUENTIAL, range_m, *limits_m)


def marker_colours(
    range_m: NDArray[np.floating], beyond: NDArray[np.bool_] | None, colours: Palette
) -> Rgb:
    """Colours of places by their range, nearest to farthest; (N, 3).

    Those beyond what a radar can tell have the colour of warnings.
    """
    nearest_m, farthest_m = float(range_m.min()), float(range_m.max())
    result = range_colours(range_m, (nearest_m, max(farthest_m, nearest_m + 1e-3)))
    if beyond is None:
        return result
    return np.where(beyond[:, None], rgb(colours.warning), result)


def range_limits(nearest_m: float, farthest_m: float) -> tuple[float, float]:
    """Limits of a colour bar around a span of ranges: round and never empty.

    The step grows with the span, so that moving the sensor a little does not
    change the limits at every step.
    """
    step = tick_step(max(farthest_m - nearest_m, 0.05 * abs(farthest_m), 0.1), 8)
    low = max(math.floor(nearest_m / step + 1e-9) * step, 0.0)
    high = math.ceil(farthest_m / step - 1e-9) * step
    return (low, max(high, low + step))


@dataclass(frozen=True, eq=False)
class Colouring:
    """Meaning of a mesh's colour, and the values of its vertices, (V,) each."""

    mode: MeshColour = "velocity"
    v_max_mps: float = 2.0  # end of the velocity colours
    velocity_mps: NDArray[np.floating] | None = None
    range_m: NDArray[np.floating] | None = None
    range_limits_m: tuple[float, float] = (0.0, 1.0)
    visible: NDArray[np.bool_] | None = None
    as_dots: bool = False
    limbs: tuple[tuple[str, str], ...] = ()  # words and colours of parts that are shown alone
    vertex_limb: NDArray[np.intp] | None = None  # of these, from 1; 0: none of them


def mesh_colours(colouring: Colouring, colours: Palette, count: int) -> Rgb:
    """Colours of ``count`` vertices, shape (count, 3).

    What is not known yet is drawn plain. Hidden vertices are muted in every
    mode but ``plain``: they do not contribute to the spectrum.
    """
    mode, visible, as_dots = colouring.mode, colouring.visible, colouring.as_dots
    if colouring.vertex_limb is not None and len(colouring.vertex_limb) == count:
        shades = [colours.plain, *(colour for _, colour in colouring.limbs)]
        result = np.stack([rgb(shade) for shade in shades])[colouring.vertex_limb]
        if visible is None:
            return result
        muted = (0.5 * result + 0.5 * rgb(colours.hidden)).astype(np.uint8)
        return np.where(visible[:, None], result, muted)
    if mode == "velocity" and colouring.velocity_mps is not None:
        result = velocity_colours(colouring.velocity_mps, colouring.v_max_mps)
    elif mode == "range" and colouring.range_m is not None:
        result = range_colours(colouring.range_m, colouring.range_limits_m)
    elif mode == "visibility" and visible is not None:
        result = np.tile(rgb(colours.visible), (count, 1))
    else:
        result, visible = np.tile(rgb(colours.plain), (count, 1)), None
    # Dots have no shading: on a light ground the pale middle would vanish.
    if as_dots and rgb(colours.backdrop).mean() >= 128:
        result = (0.76 * result).astype(np.uint8)
    if visible is None:
        return result
    # Dots do not cover one another: what is hidden has to step back further.
    hidden = mixed(colours.hidden, colours.backdrop, 0.7) if as_dots else colours.hidden
    if mode == "range" and not as_dots:
        muted = (0.3 * result + 0.7 * rgb(hidden)).astype(np.uint8)
        return np.where(visible[:, None], result, muted)
    return np.where(visible[:, None], result, rgb(hidden))
