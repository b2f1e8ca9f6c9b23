"""VTK actors of the scene, over copies of their arrays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkCommonMath import vtkMatrix4x4
from vtkmodules.vtkFiltersCore import vtkGlyph3D, vtkTriangleMeshPointNormals
from vtkmodules.vtkFiltersSources import vtkPlatonicSolidSource, vtkSphereSource
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper, vtkRenderer

from sd2app.palette import Palette
from sd2app.scene import shapes
from sd2app.scene.colours import fractions, marker_colours, mixed
from sd2app.scene.shapes import coarse_faces, is_closed_outward
from sd2core.figures.colours import rgb
from sd2core.scattering.beam import half_power_rim, sensor_axes
from sd2core.sensor import Beam, VirtualSensor

_ANY_BEAM = Beam(90.0, 90.0)
_MARKER_M = 0.10
_MARKER_MIN_PX = 7.0
_INERTIAL_M = 0.028
_INERTIAL_MIN_PX = 5.5


def _actor(renderer: vtkRenderer) -> vtkActor:
    actor = vtkActor()
    actor.SetMapper(vtkPolyDataMapper())
    actor.PickableOff()
    renderer.AddActor(actor)
    return actor


def _cells(connectivity: NDArray[np.integer] | None) -> vtkCellArray:
    """Cells of one size from an (n, k) array."""
    cells = vtkCellArray()
    if connectivity is not None:
        flat = np.ascontiguousarray(connectivity, np.int32).ravel()
        cells.SetData(connectivity.shape[1], numpy_to_vtk(flat, deep=True))
    return cells


def _matrix(linear: NDArray[np.float64], offset: NDArray[np.float64]) -> vtkMatrix4x4:
    """Transform p -> linear p + offset."""
    rows = np.vstack([np.column_stack([linear, offset]), (0.0, 0.0, 0.0, 1.0)])
    matrix = vtkMatrix4x4()
    matrix.DeepCopy(rows.ravel().tolist())
    return matrix


class Shape:
    """One actor over one polygon or line set, with optional colours per point.

    ``line_px`` is the width of its lines in pixels of the widget.
    """

    def __init__(
        self,
        renderer: vtkRenderer,
        points: NDArray[np.floating] | None = None,
        *,
        triangles: NDArray[np.integer] | None = None,
        segments: NDArray[np.integer] | None = None,
        lit: bool = False,
        line_px: float = 1.0,
    ) -> None:
        self.points = np.zeros((0, 3), np.float32)  # of its own frame, before :meth:`place`
        self._points = vtkPoints()
        self.data = vtkPolyData()
        self.data.SetPoints(self._points)
        self.actor = _actor(renderer)
        self.actor.GetMapper().SetInputData(self.data)
        self.look = self.actor.GetProperty()
        self.look.SetLighting(lit)
        self._line_px = line_px
        if points is not None:
            self.set_shape(points, triangles=triangles, segments=segments)

    def set_shape(
        self,
        points: NDArray[np.floating],
        *,
        triangles: NDArray[np.integer] | None = None,
        segments: NDArray[np.integer] | None = None,
    ) -> None:
        """Replace points and cells; colours have to be given again."""
        self.set_points(points)
        self.data.SetPolys(_cells(triangles))
        self.data.SetLines(_cells(segments))
        self.data.SetVerts(_cells(None))
        self.clear_point_colours()

    def set_points(self, points: NDArray[np.floating]) -> None:
        """Move its points, of which there are as many as before."""
        self.points = np.array(points, np.float32, order="C")
        self._points.SetData(numpy_to_vtk(self.points, deep=True))
        self.data.Modified()

    def clear_point_colours(self) -> None:
        """Draw all of it in one colour."""
        self.data.GetPointData().SetScalars(None)

    def set_point_colours(self, colours: NDArray[np.uint8]) -> None:
        """Set one colour per point, (n, 3) or with opacity (n, 4)."""
        scalars = numpy_to_vtk(np.ascontiguousarray(colours), deep=True)
        self.data.GetPointData().SetScalars(scalars)

    def set_colour(self, colour: str) -> None:
        """Set one colour for all of it."""
        self.look.SetColor(*fractions(colour))

    def place(self, linear: NDArray[np.float64], offset: NDArray[np.float64]) -> None:
        """Set its transform: p -> linear p + offset."""
        self.actor.SetUserMatrix(_matrix(linear, offset))

    def show(self, visible: bool) -> None:
        """Show or hide it."""
        self.actor.SetVisibility(visible)

    def set_pixel_scale(self, scale: float) -> None:
        """Set the pixels of the render window per pixel of the widget."""
        self.look.SetLineWidth(self._line_px * scale)


class Body(Shape):
    """The mesh as a lit surface or as dots, with its shadow on the floor."""

    def __init__(self, renderer: vtkRenderer) -> None:
        super().__init__(renderer, lit=True)
        self._normals = vtkTriangleMeshPointNormals()
        self._normals.SetInputData(self.data)
        self._dots = False
        self._has_faces = False
        # The shadow shares the vertices, has fewer faces, and is flattened by its matrix.
        self._shadow_data = vtkPolyData()
        self._shadow_data.SetPoints(self._points)
        self.shadow = _actor(renderer)
        self.shadow.GetMapper().SetInputData(self._shadow_data)
        self.shadow.GetProperty().SetLighting(False)
        self.show(False)
        self.look.SetAmbient(0.30)
        self.look.SetDiffuse(0.76)
        self.look.SetSpecular(0.0)

    def set_topology(self, vertices: NDArray[np.floating], faces: NDArray | None) -> None:
        """Take over another mesh."""
        self.set_shape(vertices, triangles=faces)
        self._has_faces = faces is not None and len(faces) > 0
        self.look.BackfaceCullingOff()
        if faces is not None and self._has_faces:
            self._shadow_data.SetPolys(_cells(coarse_faces(vertices, faces)))
            self.look.SetBackfaceCulling(is_closed_outward(vertices, faces))
        self.set_as_dots(self._dots)

    @property
    def drawn_as_dots(self) -> bool:
        """True if vertices are drawn, by choice or because there are no faces."""
        return self._dots or not self._has_faces

    def set_as_dots(self, dots: bool) -> None:
        """Draw vertices instead of the surface."""
        self._dots = dots
        self.look.SetLighting(not self.drawn_as_dots)
        if self.drawn_as_dots:
            self.data.SetVerts(_cells(np.arange(len(self.points))[:, None]))
            self.actor.GetMapper().SetInputData(self.data)
            self.look.SetRepresentationToPoints()
        else:
            self.data.SetVerts(_cells(None))
            self.actor.GetMapper().SetInputConnection(self._normals.GetOutputPort())
            self.look.SetRepresentationToSurface()
        self.show(bool(self.actor.GetVisibility()))

    def set_floor(self, floor_m: float) -> None:
        """Height on which the shadow falls."""
        flat = np.diag([1.0, 0.0, 1.0])
        self.shadow.SetUserMatrix(_matrix(flat, np.array([0.0, floor_m - 0.002, 0.0])))

    def show(self, visible: bool) -> None:
        """Show or hide it; dots throw no shadow."""
        super().show(visible)
        self.shadow.SetVisibility(visible and not self.drawn_as_dots)


class SensorGlyph:
    """Sphere, boresight axis, a plumb line to the floor, and the cone of a beam's half power."""

    def __init__(self, renderer: vtkRenderer) -> None:
        line = np.array([(0, 1)])
        points, triangles, wire = shapes.cone(half_power_rim(_ANY_BEAM))
        self.cone = Shape(renderer, points, triangles=triangles)
        self.edges = Shape(renderer, points, segments=wire)
        self.axis = Shape(renderer, np.array([(0, 0, 0), (0, 0, 1)]), segments=line, line_px=1.8)
        self.plumb = Shape(renderer, np.array([(0, 0, 0), (0, 1, 0)]), segments=line)
        points, circle = shapes.ring()
        self.foot = Shape(renderer, points, segments=circle)
        self.shapes = (self.cone, self.edges, self.axis, self.plumb, self.foot)
        source = vtkSphereSource()
        source.SetThetaResolution(28)
        source.SetPhiResolution(20)
        source.SetRadius(1.0)
        self.sphere = _actor(renderer)
        self.sphere.GetMapper().SetInputConnection(source.GetOutputPort())
        look = self.sphere.GetProperty()
        look.SetAmbient(0.45)
        look.SetDiffuse(0.6)
        look.SetSpecular(0.25)
        look.SetSpecularPower(20)
        self._beam: Beam | None = _ANY_BEAM
        self._shown = True

    def set_sensor(self, sensor: VirtualSensor, floor_m: float, reach_m: float) -> None:
        """Place it; the cone is drawn ``reach_m`` long."""
        if sensor.beam != self._beam:
            self._beam = sensor.beam
            if sensor.beam is not None:
                points, _, _ = shapes.cone(half_power_rim(sensor.beam))
                for shape in (self.cone, self.edges):
                    shape.set_points(points)
            self.show(self._shown)
        position = np.asarray(sensor.position_m)
        turn = sensor_axes(sensor).T
        for shape in (self.cone, self.edges):
            shape.place(reach_m * turn, position)
        self.axis.place(1.18 * reach_m * turn, position)
        height = floor_m - position[1]
        self.plumb.place(np.diag([1.0, height, 1.0]), position)
        on_floor = np.array([position[0], floor_m - 0.004, position[2]])
        self.foot.place(0.06 * np.eye(3), on_floor)
        self.sphere.SetPosition(*position)

    def set_colours(self, colours: Palette, hot: bool) -> None:
        """Colours of the theme; ``hot`` while the pointer is on it or drags it."""
        colour = colours.accent_hot if hot else colours.accent
        self.sphere.GetProperty().SetColor(*fractions(colour))
        fade = np.zeros((len(self.cone.points), 4), np.uint8)
        fade[:, :3] = rgb(colours.accent)
        fade[0, 3] = 92
        fade[1:, 3] = 14
        self.cone.set_point_colours(fade)
        self.edges.set_colour(mixed(colours.accent, colours.backdrop, 0.45))
        self.axis.set_colour(colours.accent)
        for quiet in (self.plumb, self.foot):
            quiet.set_colour(mixed(colours.accent, colours.backdrop, 0.55))

    def show(self, visible: bool) -> None:
        """Show or hide it (the eye may be inside it)."""
        self._shown = visible
        self.sphere.SetVisibility(visible)
        for shape in self.shapes:
            shape.show(visible)
        for shape in (self.cone, self.edges):
            shape.show(visible and self._beam is not None)


class GroundGrid:
    """Grid on the floor; opacity is mixed into the colour, so nothing is translucent."""

    def __init__(self, renderer: vtkRenderer) -> None:
        self.shapes = (Shape(renderer), Shape(renderer))
        self._opacity = np.zeros(0, np.float32)

    def set_ground(self, ground: shapes.Ground, colours: Palette) -> None:
        """Take over other lines."""
        self._opacity = ground.opacity
        for shape, segments in zip(self.shapes, (ground.minor, ground.major), strict=True):
            shape.set_shape(ground.points, segments=segments)
        self.set_colours(colours)

    def set_colours(self, colours: Palette) -> None:
        """Colours of the theme."""
        for shape, strength in zip(self.shapes, (0.42, 1.0), strict=True):
            share = (strength * self._opacity)[:, None]
            blend = (1 - share) * rgb(colours.backdrop) + share * rgb(colours.grid)
            shape.set_point_colours(np.rint(blend).astype(np.uint8))


class Markers(Shape):
    """Planned places of sensors: a small pyramid each, whose tip points where the sensor looks."""

    def __init__(self, renderer: vtkRenderer, colours: Palette) -> None:
        super().__init__(renderer, lit=True)
        self._theme = colours
        self.positions_m = np.zeros((0, 3))
        self._axes = np.zeros((0, 3, 3))
        self._range_m = np.zeros(0)
        self._beyond: NDArray[np.bool_] | None = None
        self._length_m = _MARKER_M
        self.look.SetInterpolationToFlat()
        self.look.SetAmbient(0.55)
        self.look.SetDiffuse(0.45)
        self.look.EdgeVisibilityOn()
        # An eye at a place looks out of its marker.
        self.look.BackfaceCullingOn()

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
        self._axes = np.array([sensor_axes(one) for one in sensors]).reshape(-1, 3, 3)
        self._range_m, self._beyond = np.asarray(range_m), beyond
        self.show(bool(sensors))
        self._build()

    def set_colours(self, colours: Palette) -> None:
        """Colours of the theme."""
        self._theme = colours
        self.look.SetEdgeColor(*fractions(mixed(colours.text, colours.backdrop, 0.35)))
        if len(self.positions_m):
            shades = marker_colours(self._range_m, self._beyond, colours)
            self.set_point_colours(np.repeat(shades, shapes.PYRAMID_POINTS, axis=0))

    def set_pixel(self, metres: float) -> None:
        """Size of a pixel where the body is; markers are never too small to be clicked."""
        length_m = max(_MARKER_M, _MARKER_MIN_PX * metres)
        if length_m != self._length_m:
            self._length_m = length_m
            self._build()

    def _build(self) -> None:
        if len(self.positions_m):
            points, triangles = shapes.pyramids(self.positions_m, self._axes, self._length_m)
            self.set_shape(points, triangles=triangles)
            self.set_colours(self._theme)


class InertialMarkers(Shape):
    """Inertial sensors on the body: an octahedron each, half of it in the skin."""

    def __init__(self, renderer: vtkRenderer) -> None:
        super().__init__(renderer, lit=True)
        solid = vtkPlatonicSolidSource()
        solid.SetSolidTypeToOctahedron()
        self._solids = vtkGlyph3D()
        self._solids.SetSourceConnection(solid.GetOutputPort())
        self._solids.SetInputData(self.data)
        mapper = self.actor.GetMapper()
        mapper.SetInputConnection(self._solids.GetOutputPort())
        mapper.ScalarVisibilityOff()  # which number the faces
        self.look.SetInterpolationToFlat()
        self.look.SetAmbient(0.6)
        self.look.SetDiffuse(0.4)
        self.look.EdgeVisibilityOn()
        self.look.SetEdgeColor(0.0, 0.0, 0.0)

    def mark(self, points_m: NDArray[np.floating], metres_per_px: float) -> None:
        """Show sensors at N points, (N, 3), as large as can be seen."""
        self.set_shape(points_m)
        self.show(len(points_m) > 0)
        self._solids.SetScaleFactor(max(_INERTIAL_M, _INERTIAL_MIN_PX * metres_per_px))

    def set_colours(self, colours: Palette) -> None:
        """Colours of the theme."""
        self.set_colour(colours.inertial)
