"""Planned places of sensors, all as one actor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from vtkmodules.vtkRenderingCore import vtkRenderer

from sd2app.scene import shapes
from sd2app.scene.colours import SceneColours, fractions, marker_colours, mixed
from sd2app.scene.parts import Shape
from sd2core.sensor import VirtualSensor

_LENGTH_M = 0.10
_LEAST_PX = 7.0
_SIZE_STEP = 1.15
"""Relative change of size from which points are rebuilt."""


class Markers:
    """A small pyramid per place, whose tip points where the sensor looks."""

    def __init__(self, renderer: vtkRenderer, colours: SceneColours) -> None:
        self._colours = colours
        self.positions_m = np.zeros((0, 3))
        self._directions = np.zeros((0, 3))
        self._range_m = np.zeros(0)
        self._beyond: NDArray[np.bool_] | None = None
        self._length_m = _LENGTH_M
        self.shape = Shape(renderer, lit=True)
        look = self.shape.actor.GetProperty()
        look.SetInterpolationToFlat()
        look.SetAmbient(0.55)
        look.SetDiffuse(0.45)
        look.EdgeVisibilityOn()
        # An eye at a place looks out of its marker.
        look.BackfaceCullingOn()
        self.shape.show(False)

    def set_sensors(
        self,
        sensors: tuple[VirtualSensor, ...],
        range_m: NDArray[np.floating],
        beyond: NDArray[np.bool_] | None,
    ) -> None:
        """Show N other places, or none.

        ``range_m``, shape (N,), is the distance from the body, for the colours; ``beyond``, shape
        (N,), marks those that a radar would see folded.
        """
        self.positions_m = np.array([one.position_m for one in sensors]).reshape(-1, 3)
        self._directions = np.array([one.boresight for one in sensors]).reshape(-1, 3)
        self._range_m, self._beyond = np.asarray(range_m), beyond
        self.shape.show(bool(sensors))
        if sensors:
            self._build()

    def set_colours(self, colours: SceneColours) -> None:
        """Colours of the theme."""
        self._colours = colours
        edge = mixed(colours.text, colours.background, 0.35)
        self.shape.actor.GetProperty().SetEdgeColor(*fractions(edge))
        if len(self.positions_m):
            self._paint()

    def set_pixel(self, metres: float, scale: float) -> None:
        """Size of a pixel where the body is; markers are never too small to be clicked."""
        length_m = max(_LENGTH_M, _LEAST_PX * metres)
        ratio = length_m / self._length_m
        if len(self.positions_m) and not 1 / _SIZE_STEP < ratio < _SIZE_STEP:
            self._length_m = length_m
            self._build()
        self.shape.set_line_width(scale)

    def _build(self) -> None:
        points, triangles = shapes.pyramids(self.positions_m, self._directions, self._length_m)
        self.shape.set_shape(points, triangles=triangles)
        self._paint()

    def _paint(self) -> None:
        colours = marker_colours(self._range_m, self._beyond, self._colours)
        self.shape.set_point_colours(np.repeat(colours, shapes.PYRAMID_POINTS, axis=0))
