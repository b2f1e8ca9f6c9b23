"""Quarter turns of a mesh, as commands and recordings name them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, get_args

from sd2core.errors import Sd2Error

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Turn = Literal["x90", "x180", "x270", "y90", "y180", "y270", "z90", "z180", "z270"]
"""Axis of the camera's frame, and degrees about it, right-handed."""


def rotation_of(turn: str) -> NDArray[np.float64]:
    """Matrix (3, 3) of a turn; Sd2Error if it is none.

    Examples
    --------
    >>> rotation_of("x180") @ [1.0, 2.0, 3.0]
    array([ 1., -2., -3.])
    """
    import numpy as np

    if turn not in get_args(Turn):
        raise Sd2Error(f"The turn is {turn!r}", f"one of {', '.join(get_args(Turn))}")
    axis = "xyz".index(turn[0])
    second, third = (axis + 1) % 3, (axis + 2) % 3
    quarter = np.zeros((3, 3))
    quarter[axis, axis] = quarter[third, second] = 1.0
    quarter[second, third] = -1.0
    return np.linalg.matrix_power(quarter, int(turn[1:]) // 90)


def turned_further(turn: str | None, more: str) -> str | None:
    """One turn after another about its axis; ``more`` alone where the axes differ.

    Examples
    --------
    >>> turned_further("x90", "x180"), turned_further("x180", "x180"), turned_further(None, "x90")
    ('x270', None, 'x90')
    """
    if turn is None or turn[0] != more[0]:
        return more
    angle = (int(turn[1:]) + int(more[1:])) % 360
    return f"{turn[0]}{angle}" if angle else None
