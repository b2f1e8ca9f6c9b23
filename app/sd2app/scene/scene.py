"""Everything that is drawn in 3D, over any VTK renderer; no Qt."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from vtkmodules.vtkRenderingCore import vtkLight, vtkRenderer

from sd2app.palette import LIGHT, Palette
from sd2app.scene import shapes
from sd2app.scene.camera import EyePose, Margins, Preset, triple
from sd2app.scene.colours import Colouring, fractions, mesh_colours, range_limits
from sd2app.scene.parts import Body, GroundGrid, InertialMarkers, Markers, SensorGlyph, Shape
from sd2app.scene.shapes import Extent
from sd2app.scene.things import Movables, Walls
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.things import Surroundings
from sd2core.sensor import VirtualSensor

SENSOR_RADIUS_M = 0.045
SENSOR_MIN_PX = 7.0
_CAMERA_M = 0.20
_DOTS_PX = (1.4, 6.0)
_INSIDE_M = 0.25
_FAR_OFF_M = 30.0
_EDGE_PX = 10.0
"""Nearer than this to the edge of the picture, the sensor counts as outside."""
_NOTHING = Extent.of_points(np.array([[-0.4, -0.6, 1.8], [0.4, 1.1, 2.6]]))


class Scene:
    """Mesh, sensor, camera, ground and light in an empty renderer.

    Nothing is rendered here: a backend calls :meth:`prepare` and renders.
    """

    def __init__(self, renderer: vtkRenderer) -> None:
        self.renderer = renderer
        self.colours = LIGHT
        self.pose = EyePose()
        self.preset: Preset | None = None  # ready-made view that is kept when the size changes
        self.margins = Margins(left=64.0, top=28.0, right=144.0, bottom=28.0)
        self.extent = _NOTHING
        self.sensor = VirtualSensor()
        self.metre_labels: tuple[shapes.MetreLabel, ...] = ()
        self.colouring = Colouring()
        self.has_mesh = False
        self._hot = False
        self._stale_colours = False
        self._covered: shapes.GridRectangle | None = None
        self._framed: tuple[object, ...] | None = None
        self._followed: tuple[EyePose, EyePose] | None = None  # poses before and after
        self._light_up()
        # One convex cone needs no sorting, which costs 4 ms on a CPU.
        renderer.SetUseOIT(False)
        self.ground = GroundGrid(renderer)
        self.body = Body(renderer)
        points, segments = shapes.frustum(_CAMERA_M)
        self.camera_glyph = Shape(renderer, points, segments=segments, line_px=1.3)
        self.sensor_glyph = SensorGlyph(renderer)
        self.markers = Markers(renderer, self.colours)
        self.inertial = InertialMarkers(renderer)
        self.movables = Movables(renderer, self.colours)
        self.walls = Walls(renderer, self.colours)
        self._inertial_rows = np.zeros(0, np.intp)
        self._set_extent(_NOTHING)
        self.set_colours(self.colours)

    # What is shown

    @property
    def knows_hidden(self) -> bool:
        """True once the visibility of the vertices is known."""
        return self.colouring.visible is not None

    @property
    def mesh_shown(self) -> bool:
        """True while a body is drawn."""
        return self.has_mesh and bool(self.body.actor.GetVisibility())

    def set_mesh(self, mesh: MeshSequence, frame: int = 0) -> None:
        """Take over another clip and show one frame of it."""
        extent = Extent.of_mesh(mesh)
        self.body.set_topology(mesh.frame(frame), mesh.faces)
        self.has_mesh = True
        self.show_mesh(True)
        self._set_extent(extent)

    def clear_mesh(self) -> None:
        """Show sensor and camera alone."""
        self.has_mesh = False
        self.show_mesh(False)
        self._set_extent(_NOTHING)

    def show_mesh(self, shown: bool) -> None:
        """Draw the mesh, or leave it out at a time that it does not cover."""
        self.body.show(shown and self.has_mesh)

    def set_vertices(self, vertices: NDArray[np.floating]) -> None:
        """Move the mesh to another frame."""
        self.body.set_points(vertices)
        self._stale_colours = True

    def change_colours(self, **changes: object) -> None:
        """Change some of what the colour of the mesh means; see :class:`Colouring`."""
        self.colouring = replace(self.colouring, **changes)  # type: ignore[arg-type]
        self._stale_colours = True

    def set_scattering(
        self, velocity_mps: NDArray[np.floating] | None, visible: NDArray[np.bool_] | None
    ) -> None:
        """Radial velocity and visibility of the frame's vertices, (V,) each; None if unknown."""
        self.change_colours(
            velocity_mps=self._of_this_mesh(velocity_mps), visible=self._of_this_mesh(visible)
        )

    def set_sensor(self, sensor: VirtualSensor) -> None:
        """Place the sensor."""
        self.sensor = sensor
        position = np.asarray(sensor.position_m)
        away = float(np.linalg.norm(self.extent.centre_m - position))
        self.sensor_glyph.set_sensor(
            sensor, self.extent.floor_m, reach_m=min(max(0.38 * away, 0.3), 1.0)
        )
        ranges = np.linalg.norm(self.extent.points_m - position, axis=1)
        self.change_colours(range_limits_m=range_limits(float(ranges.min()), float(ranges.max())))
        self._lay_ground()

    def set_markers(
        self,
        sensors: tuple[VirtualSensor, ...],
        range_m: NDArray[np.floating],
        beyond: NDArray[np.bool_] | None,
    ) -> None:
        """Show planned places; see :meth:`Markers.set_sensors`."""
        self.markers.set_sensors(sensors, range_m, beyond)
        self._framed = None
        self._lay_ground()

    def set_things(self, around: Surroundings | None) -> None:
        """Show what stands around the body."""
        self.movables.set_things(*((around.surfaces, around.things) if around else ((), ())))
        self.walls.set_walls(around.walls if around else (), self.extent.centre_m)
        self._framed = None
        self._lay_ground()

    def set_people(self, meshes: tuple[MeshSequence, ...], frame: int) -> None:
        """Show the bodies beside the first one."""
        self.movables.set_people(meshes, frame, self.extent.floor_m)
        self._framed = None
        self._lay_ground()

    def set_limbs(
        self, limbs: Sequence[tuple[str, str]], vertex_limbs: Sequence[NDArray[np.intp]]
    ) -> None:
        """Colour parts of bodies: their words and colours, and which each vertex has, from 1.

        Nothing is coloured of bodies that ``vertex_limbs``, the first body's first, has none of.
        """
        first, *others = vertex_limbs or (None,)
        self.change_colours(limbs=tuple(limbs), vertex_limb=first)
        for number, person in enumerate(self.movables.people):
            limb = others[number] if number < len(others) else None
            person.set_limbs([colour for _, colour in limbs], limb)
        self.movables.set_colours(self.colours)

    def set_inertial(self, vertices: Iterable[int]) -> None:
        """Show inertial sensors on vertices of the mesh."""
        self._inertial_rows = np.array(list(vertices), np.intp)

    def set_hot(self, hot: bool) -> None:
        """Show that the sensor is under the pointer or dragged."""
        if hot != self._hot:
            self._hot = hot
            self.sensor_glyph.set_colours(self.colours, hot)

    def set_colours(self, colours: Palette) -> None:
        """Change the theme."""
        self.colours = colours
        self.renderer.SetBackground(*fractions(colours.backdrop))
        self.ground.set_colours(colours)
        self.camera_glyph.set_colour(colours.muted)
        self.sensor_glyph.set_colours(colours, self._hot)
        self.markers.set_colours(colours)
        self.inertial.set_colours(colours)
        self.movables.set_colours(colours)
        self.walls.set_colours(colours)
        self.body.shadow.GetProperty().SetColor(*fractions(colours.shadow))
        self._stale_colours = True

    # Where it is seen from

    def look_from(self, preset: Preset) -> None:
        """Keep to one of the ready-made views until the user turns away."""
        self.preset, self._framed = preset, None

    def preset_pose(self, preset: Preset) -> EyePose:
        """Pose of one of the ready-made views in the present size."""
        sensor = np.asarray(self.sensor.position_m)
        if preset == "camera":
            return self._looking_from(np.zeros(3), 0.0, 0.0)
        if preset == "sensor":
            return self._looking_from(sensor, self.sensor.azimuth_deg, self.sensor.elevation_deg)
        azimuth, elevation = {
            "overview": (-52.0, -16.0),
            "side": (-90.0, 0.0),
            "top": (0.0, -89.5),
        }[preset]
        pose = EyePose(azimuth_deg=azimuth, elevation_deg=elevation, size_px=self.pose.size_px)
        return pose.framed(self._everything_m(), self.margins)

    def _everything_m(self) -> NDArray[np.float64]:
        """Points (n, 3) around all that is to be seen and is not far off."""
        body, sensor = self.extent, np.asarray(self.sensor.position_m)
        points = [body.points_m]
        if np.linalg.norm(body.centre_m) < _FAR_OFF_M:
            points.append(_box(np.zeros(3), _CAMERA_M))
        if self._sensor_away_m < _FAR_OFF_M:
            points.append(_box(sensor, 0.25))
            points.append(np.array([[sensor[0], body.floor_m, sensor[2]]]))
        points += [self._near(self.markers.positions_m), self._near(self.movables.points_m)]
        return np.concatenate(points)

    @property
    def _sensor_away_m(self) -> float:
        return float(np.linalg.norm(self.extent.centre_m - np.asarray(self.sensor.position_m)))

    @property
    def sensor_in_sight(self) -> bool:
        """True if the picture shows the sensor, or is seen from within it."""
        return not self.sensor_shown or self._shows_sensor(self.pose)

    def _shows_sensor(self, pose: EyePose) -> bool:
        x, y, depth = pose.project(self.sensor.position_m)[0]
        right, bottom = np.subtract(pose.size_px, _EDGE_PX)
        return bool(depth > 0 and _EDGE_PX <= x <= right and _EDGE_PX <= y <= bottom)

    def keep_sensor_in_sight(self) -> None:
        """Step back from a sensor that left the picture, so that it and the body are seen.

        The direction of the view stays. Once the view of before would show the sensor again, that
        one is back. The views from camera and sensor do not move, nor does one that it is far from.
        """
        before = self.pose
        if self.sensor_in_sight:
            if self._followed and self._followed[1] == before:
                self.pose = self._followed[0] if self._shows_sensor(self._followed[0]) else before
        elif self.preset not in ("camera", "sensor") and self._sensor_away_m < _FAR_OFF_M:
            self.pose = before.framed(self._everything_m(), self.margins)
            self._followed = before, self.pose

    def _looking_from(
        self, position: NDArray[np.float64], azimuth_deg: float, elevation_deg: float
    ) -> EyePose:
        # The eye stays put, so the angle has to open until the body fits.
        width, height = self.pose.size_px
        pose = EyePose(tuple(position), azimuth_deg, elevation_deg, distance_m=1e-9)
        right, down, forward = pose.axes
        relative = self.extent.points_m - position
        depth = relative @ forward
        distance = max(float((self.extent.centre_m - position) @ forward), 0.5)
        ahead = depth > 0.1
        tangent = 0.45
        if ahead.any():
            # Half the picture's height is one unit; the colour bar keeps its place free.
            room_left = width / height
            room_right = max(width / 2 - self.margins.right, 0.1 * width) / (height / 2)
            x, y = relative[ahead] @ right, np.abs(relative[ahead] @ down)
            tallest = np.maximum(np.maximum(x / room_right, -x / room_left), y) / depth[ahead]
            tangent = float(np.clip(1.06 * tallest.max(), 0.12, 1.4))
        return EyePose(
            triple(position + distance * forward),
            azimuth_deg,
            elevation_deg,
            distance,
            2 * float(np.degrees(np.arctan(tangent))),
            self.pose.size_px,
        )

    # Before a rendering

    def prepare(self, size_px: tuple[float, float], pixel_scale: float) -> None:
        """Bring everything up to date for the next rendering.

        ``size_px`` is the widget's size in device-independent pixels, ``pixel_scale`` the pixels of
        the render window per such pixel.
        """
        self.pose = replace(self.pose, size_px=size_px)
        # While the sensor moves the view stands still, or the sensor would slip from under the
        # pointer; only the view from the sensor goes with it.
        framed = (self.preset, size_px, self.sensor if self.preset == "sensor" else None)
        if self.preset is not None and self._framed != framed:
            self._framed = framed
            self.pose = self.preset_pose(self.preset)
        if self._stale_colours:
            self._colour_mesh()
        for shape in (
            self.camera_glyph, self.markers, *self.sensor_glyph.shapes, *self.ground.shapes,
            *self.walls.shapes, *(one for thing in self.movables.things for one in thing.shapes),
        ):  # fmt: skip
            shape.set_pixel_scale(pixel_scale)
        if self.has_mesh and self.body.drawn_as_dots:
            self.body.look.SetPointSize(self._dot_px() * pixel_scale)
        pixel = self.pose.metres_per_pixel(self.extent.centre_m)
        self.markers.set_pixel(pixel if np.isfinite(pixel) else 0.0)
        rows = self._inertial_rows if self.mesh_shown else self._inertial_rows[:0]
        rows = rows[rows < len(self.body.points)]  # the mesh may be another already
        self.inertial.mark(self.body.points[rows], pixel if np.isfinite(pixel) else 0.0)
        self.sensor_glyph.sphere.SetScale(self.sensor_radius_m)
        self.sensor_glyph.show(self.sensor_shown)
        self.camera_glyph.show(self.camera_shown)
        _, down, forward = self.pose.axes
        camera = self.renderer.GetActiveCamera()
        camera.SetPosition(*self.pose.position)
        camera.SetFocalPoint(*(self.pose.position + forward))
        camera.SetViewUp(*-down)
        camera.SetViewAngle(self.pose.angle_deg)
        camera.SetClippingRange(
            max(0.02, 0.03 * self.pose.distance_m), self.pose.distance_m + 2 * _FAR_OFF_M
        )

    @property
    def sensor_shown(self) -> bool:
        """True if the sensor is drawn: not while the virtual camera is inside it."""
        offset = self.pose.position - np.asarray(self.sensor.position_m)
        return bool(np.linalg.norm(offset) > _INSIDE_M)

    @property
    def camera_shown(self) -> bool:
        """True if the camera is drawn."""
        return bool(np.linalg.norm(self.pose.position) > _INSIDE_M)

    @property
    def sensor_radius_m(self) -> float:
        """Radius of the sphere: never too small on screen to take hold of."""
        pixel = self.pose.metres_per_pixel(self.sensor.position_m)
        return max(SENSOR_RADIUS_M, SENSOR_MIN_PX * pixel) if np.isfinite(pixel) else 0.01

    @property
    def body_box_px(self) -> tuple[float, float, float, float] | None:
        """Left, top, right and bottom of where the body moves, None behind the eye."""
        pixels = self.pose.project(self.extent.points_m)
        pixels = pixels[pixels[:, 2] > 0.1, :2]
        if not len(pixels):
            return None
        return (*pixels.min(axis=0), *pixels.max(axis=0))

    def _dot_px(self) -> float:
        """Size of dots that leaves gaps between those of a dense mesh."""
        box = self.body_box_px
        if box is None:
            return _DOTS_PX[0]
        area = (box[2] - box[0]) * (box[3] - box[1])
        return float(np.clip(0.7 * np.sqrt(area / len(self.body.points)), *_DOTS_PX))

    def _colour_mesh(self) -> None:
        self._stale_colours = False
        if not self.has_mesh:
            return
        colouring = replace(self.colouring, as_dots=self.body.drawn_as_dots)
        if colouring.mode == "range":
            offset = self.body.points - np.asarray(self.sensor.position_m, np.float32)
            colouring = replace(colouring, range_m=np.sqrt(np.einsum("ij,ij->i", offset, offset)))
        self.body.set_point_colours(mesh_colours(colouring, self.colours, len(self.body.points)))

    def _of_this_mesh(self, values: NDArray | None) -> NDArray | None:
        fits = values is not None and self.has_mesh and len(values) == len(self.body.points)
        return values if fits else None

    def _near(self, places: NDArray[np.float64]) -> NDArray[np.float64]:
        """Places, of (n, 3), that are not far off."""
        return places[np.linalg.norm(places - self.extent.centre_m, axis=1) < _FAR_OFF_M]

    def _set_extent(self, extent: Extent) -> None:
        """Take over the space of another body, of which nothing else is known yet."""
        self.extent = extent
        self.body.set_floor(extent.floor_m)
        self._covered = None
        self.set_scattering(None, None)
        self.set_sensor(self.sensor)

    def _lay_ground(self) -> None:
        """Grid under body, camera and sensor; in steps, so that it rarely changes."""
        low, high = self.extent.low_m, self.extent.high_m
        for place in (np.zeros(3), np.asarray(self.sensor.position_m)):
            if np.linalg.norm(self.extent.centre_m - place) < _FAR_OFF_M:
                low, high = np.minimum(low, place), np.maximum(high, place)
        for places in (self.markers.positions_m, self.movables.points_m):
            if len(near := self._near(places)):
                low, high = np.minimum(low, near.min(axis=0)), np.maximum(high, near.max(axis=0))
        covered = shapes.grid_rectangle(low[[0, 2]], high[[0, 2]])
        if covered == self._covered:
            return
        self._covered = covered
        ground = shapes.ground(self.extent.floor_m, *covered)
        self.metre_labels = ground.labels
        self.ground.set_ground(ground, self.colours)

    def _light_up(self) -> None:
        # One light beside the eye gives shape, a weak one from the other side
        # keeps shadows readable; both turn with the view.
        self.renderer.AutomaticLightCreationOff()
        self.renderer.RemoveAllLights()
        for position, strength in (((-0.5, 0.7, 1.0), 0.86), ((0.9, 0.1, 0.6), 0.22)):
            light = vtkLight()
            light.SetLightTypeToCameraLight()
            light.SetPosition(*position)
            light.SetFocalPoint(0.0, 0.0, 0.0)
            light.SetIntensity(strength)
            self.renderer.AddLight(light)


def _box(centre: NDArray[np.float64], half: float) -> NDArray[np.float64]:
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
    return centre + half * signs
