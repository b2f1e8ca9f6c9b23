"""VTK actors of the scene; each keeps its arrays and changes them in place."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkCommonMath import vtkMatrix4x4
from vtkmodules.vtkFiltersCore import vtkTriangleMeshPointNormals
from vtkmodules.vtkFiltersSources import vtkSphereSource
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper, vtkRenderer

from sd2app.scene import shapes, surface
from sd2app.scene.colours import SceneColours, fractions, mixed
from sd2core.figures.colours import rgb
from sd2core.sensor import VirtualSensor


def _cells(connectivity: NDArray[np.integer]) -> vtkCellArray:
    """Cells of one size from an (n, k) array."""
    flat = np.ascontiguousarray(connectivity, np.int32).ravel()
    cells = vtkCellArray()
    cells.SetData(connectivity.shape[1], numpy_to_vtk(flat, deep=True))
    return cells


def _matrix(linear: NDArray[np.float64], offset: NDArray[np.float64]) -> vtkMatrix4x4:
    """Transform p -> linear p + offset."""
    matrix = vtkMatrix4x4()
    for row in range(3):
        for column in range(3):
            matrix.SetElement(row, column, float(linear[row, column]))
        matrix.SetElement(row, 3, float(offset[row]))
    return matrix


class Shape:
    """One actor over one polygon or line set, with optional colours per point."""

    def __init__(
        self,
        renderer: vtkRenderer,
        points: NDArray[np.floating] | None = None,
        *,
        triangles: NDArray[np.integer] | None = None,
        segments: NDArray[np.integer] | None = None,
        lit: bool = False,
    ) -> None:
        self._renderer = renderer
        self.points = np.zeros((0, 3), np.float32)
        self._points = vtkPoints()
        self.data = vtkPolyData()
        self.data.SetPoints(self._points)
        self.mapper = vtkPolyDataMapper()
        self.mapper.SetInputData(self.data)
        self.actor = vtkActor()
        self.actor.SetMapper(self.mapper)
        self.actor.PickableOff()
        self.actor.GetProperty().SetLighting(lit)
        self._colours: NDArray[np.uint8] | None = None
        self._colour_array: Any = None
        if points is not None:
            self.set_shape(points, triangles=triangles, segments=segments)
        renderer.AddActor(self.actor)

    def set_shape(
        self,
        points: NDArray[np.floating],
        *,
        triangles: NDArray[np.integer] | None = None,
        segments: NDArray[np.integer] | None = None,
    ) -> None:
        """Replace points and cells; colours have to be given again."""
        self.points = np.array(points, np.float32, order="C")
        self._point_array = numpy_to_vtk(self.points)
        self._points.SetData(self._point_array)
        self.data.SetPolys(_cells(triangles) if triangles is not None else vtkCellArray())
        self.data.SetLines(_cells(segments) if segments is not None else vtkCellArray())
        self.data.SetVerts(vtkCellArray())
        self.data.GetPointData().SetScalars(None)
        self._colours = None
        self.moved()

    def moved(self) -> None:
        """Tell VTK that ``points`` changed."""
        self._point_array.Modified()
        self._points.Modified()
        self.data.Modified()

    def set_point_colours(self, colours: NDArray[np.uint8]) -> None:
        """Set one colour per point, (n, 3) or with opacity (n, 4)."""
        if self._colours is None or self._colours.shape != colours.shape:
            self._colours = np.ascontiguousarray(colours).copy()
            self._colour_array = numpy_to_vtk(self._colours)
            self.data.GetPointData().SetScalars(self._colour_array)
        else:
            self._colours[:] = colours
        self._colour_array.Modified()
        self.data.Modified()

    @property
    def point_colours(self) -> NDArray[np.uint8] | None:
        """Colours that were set, or None."""
        return self._colours

    def set_colour(self, colour: str, opacity: float = 1.0) -> None:
        """Set one colour for all of it."""
        self.actor.GetProperty().SetColor(*fractions(colour))
        self.actor.GetProperty().SetOpacity(opacity)

    def place(self, linear: NDArray[np.float64], offset: NDArray[np.float64]) -> None:
        """Set its transform: p -> linear p + offset."""
        self.actor.SetUserMatrix(_matrix(linear, offset))

    def show(self, visible: bool) -> None:
        """Show or hide it."""
        self.actor.SetVisibility(visible)

    def set_line_width(self, pixels: float) -> None:
        """Width of its lines in pixels of the render window."""
        self.actor.GetProperty().SetLineWidth(pixels)


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
        mapper = vtkPolyDataMapper()
        mapper.SetInputData(self._shadow_data)
        self.shadow = vtkActor()
        self.shadow.SetMapper(mapper)
        self.shadow.PickableOff()
        self.shadow.GetProperty().SetLighting(False)
        renderer.AddActor(self.shadow)
        self.show(False)
        look = self.actor.GetProperty()
        look.SetAmbient(0.30)
        look.SetDiffuse(0.76)
        look.SetSpecular(0.0)

    def set_topology(self, vertices: NDArray[np.floating], faces: NDArray | None) -> None:
        """Take over another mesh."""
        self.set_shape(vertices, triangles=faces)
        self._has_faces = faces is not None and len(faces) > 0
        look = self.actor.GetProperty()
        look.BackfaceCullingOff()
        if faces is not None and self._has_faces:
            self._shadow_data.SetPolys(_cells(surface.coarse_faces(vertices, faces)))
            look.SetBackfaceCulling(surface.is_closed_outward(vertices, faces))
        self.set_as_dots(self._dots)

    def set_vertices(self, vertices: NDArray[np.floating]) -> None:
        """Move the vertices of the same mesh."""
        self.points[:] = vertices
        self.moved()

    def moved(self) -> None:
        """Tell VTK that ``points`` changed."""
        super().moved()
        self._shadow_data.Modified()

    @property
    def drawn_as_dots(self) -> bool:
        """True if vertices are drawn, by choice or because there are no faces."""
        return self._dots or not self._has_faces

    def set_as_dots(self, dots: bool) -> None:
        """Draw vertices instead of the surface."""
        self._dots = dots
        look = self.actor.GetProperty()
        if self.drawn_as_dots:
            if self.data.GetNumberOfVerts() == 0 and len(self.points):
                self.data.SetVerts(_cells(np.arange(len(self.points))[:, None]))
            self.mapper.SetInputData(self.data)
            look.SetLighting(False)
            look.SetRepresentationToPoints()
        else:
            self.data.SetVerts(vtkCellArray())
            self.mapper.SetInputConnection(self._normals.GetOutputPort())
            look.SetLighting(True)
            look.SetRepresentationToSurface()
        self.data.Modified()
        self._update_shadow()

    def set_floor(self, floor_m: float) -> None:
        """Height on which the shadow falls."""
        flat = np.diag([1.0, 0.0, 1.0])
        self.shadow.SetUserMatrix(_matrix(flat, np.array([0.0, floor_m - 0.002, 0.0])))

    def show(self, visible: bool) -> None:
        """Show or hide it."""
        super().show(visible)
        self._update_shadow()

    def _update_shadow(self) -> None:
        self.shadow.SetVisibility(bool(self.actor.GetVisibility()) and not self.drawn_as_dots)

    def set_dot_size(self, pixels: float) -> None:
        """Size of dots in pixels of the render window."""
        self.actor.GetProperty().SetPointSize(pixels)


class SensorGlyph:
    """Sphere, boresight axis, field of view and a plumb line to the floor."""

    def __init__(self, renderer: vtkRenderer) -> None:
        points, triangles, wire = shapes.cone(90.0)
        self.cone = Shape(renderer, points, triangles=triangles)
        self.edges = Shape(renderer, points, segments=wire)
        self.axis = Shape(renderer, np.array([(0, 0, 0), (0, 0, 1)]), segments=np.array([(0, 1)]))
        self.plumb = Shape(renderer, np.array([(0, 0, 0), (0, 1, 0)]), segments=np.array([(0, 1)]))
        points, circle = shapes.ring()
        self.foot = Shape(renderer, points, segments=circle)
        source = vtkSphereSource()
        source.SetThetaResolution(28)
        source.SetPhiResolution(20)
        source.SetRadius(1.0)
        self.sphere = vtkActor()
        mapper = vtkPolyDataMapper()
        mapper.SetInputConnection(source.GetOutputPort())
        self.sphere.SetMapper(mapper)
        self.sphere.PickableOff()
        self.sphere.GetProperty().SetAmbient(0.45)
        self.sphere.GetProperty().SetDiffuse(0.6)
        self.sphere.GetProperty().SetSpecular(0.25)
        self.sphere.GetProperty().SetSpecularPower(20)
        renderer.AddActor(self.sphere)
        self._sensor = VirtualSensor()
        self._angle_deg = 90.0

    def set_sensor(self, sensor: VirtualSensor, floor_m: float, reach_m: float) -> None:
        """Place it; the field of view is drawn ``reach_m`` long."""
        if sensor.field_of_view_deg != self._angle_deg:
            self._angle_deg = sensor.field_of_view_deg
            points, _, _ = shapes.cone(self._angle_deg)
            for shape in (self.cone, self.edges):
                shape.points[:] = points
                shape.moved()
        position = np.asarray(sensor.position_m)
        turn = shapes.rotation_to(sensor.boresight)
        for shape in (self.cone, self.edges):
            shape.place(reach_m * turn, position)
        self.axis.place(1.18 * reach_m * turn, position)
        height = floor_m - position[1]
        self.plumb.place(np.diag([1.0, height, 1.0]), position)
        on_floor = np.array([position[0], floor_m - 0.004, position[2]])
        self.foot.place(0.06 * np.eye(3), on_floor)
        self.sphere.SetPosition(*position)

    def set_radius(self, radius_m: float) -> None:
        """Size of the sphere."""
        self.sphere.SetScale(radius_m)

    def set_colours(self, colours: SceneColours, hot: bool) -> None:
        """Colours of the theme; ``hot`` while the pointer is on it or drags it."""
        colour = colours.sensor_hot if hot else colours.sensor
        self.sphere.GetProperty().SetColor(*fractions(colour))
        count = len(self.cone.points)
        fade = np.zeros((count, 4), np.uint8)
        fade[:, :3] = rgb(colours.sensor)
        fade[0, 3] = 92
        fade[1:, 3] = 14
        self.cone.set_point_colours(fade)
        self.edges.set_colour(mixed(colours.sensor, colours.background, 0.45))
        self.axis.set_colour(colours.sensor)
        quiet = mixed(colours.sensor, colours.background, 0.55)
        self.plumb.set_colour(quiet)
        self.foot.set_colour(quiet)

    def show(self, visible: bool) -> None:
        """Show or hide it (the eye may be inside it)."""
        self.sphere.SetVisibility(visible)
        for shape in (self.cone, self.edges, self.axis, self.plumb, self.foot):
            shape.show(visible)

    def set_pixel_scale(self, scale: float) -> None:
        """Scale the widths of lines."""
        self.axis.set_line_width(1.8 * scale)
        for shape in (self.edges, self.plumb, self.foot):
            shape.set_line_width(1.0 * scale)


class CameraGlyph:
    """A wire camera at the origin."""

    SIZE_M = 0.20

    def __init__(self, renderer: vtkRenderer) -> None:
        points, segments = shapes.frustum()
        self.wire = Shape(renderer, self.SIZE_M * points, segments=segments)

    def set_colours(self, colours: SceneColours) -> None:
        """Colours of the theme."""
        self.wire.set_colour(colours.camera)

    def show(self, visible: bool) -> None:
        """Show or hide it (the eye may be inside it)."""
        self.wire.show(visible)

    def set_pixel_scale(self, scale: float) -> None:
        """Scale the widths of lines."""
        self.wire.set_line_width(1.3 * scale)


class GroundGrid:
    """Grid on the floor; opacity is mixed into the colour, so nothing is translucent."""

    def __init__(self, renderer: vtkRenderer) -> None:
        self._shapes = (Shape(renderer), Shape(renderer))
        self._lines: tuple[shapes.Lines, shapes.Lines] | None = None
        self.show(False)

    def set_ground(self, ground: shapes.Ground, colours: SceneColours) -> None:
        """Take over other lines."""
        self._lines = (ground.minor, ground.major)
        for shape, lines in zip(self._shapes, self._lines, strict=True):
            shape.set_shape(lines.points, segments=lines.segments)
        self.set_colours(colours)
        self.show(True)

    def set_colours(self, colours: SceneColours) -> None:
        """Colours of the theme."""
        if self._lines is None:
            return
        for shape, lines, strength in zip(self._shapes, self._lines, (0.42, 1.0), strict=True):
            share = (strength * lines.opacity)[:, None]
            blend = (1 - share) * rgb(colours.background) + share * rgb(colours.grid)
            shape.set_point_colours(np.rint(blend).astype(np.uint8))

    def show(self, visible: bool) -> None:
        """Show or hide it."""
        for shape in self._shapes:
            shape.show(visible)

    def set_pixel_scale(self, scale: float) -> None:
        """Scale the widths of lines."""
        for shape in self._shapes:
            shape.set_line_width(1.0 * scale)
