"""Everything that is drawn in 3D, over any VTK renderer; no Qt."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from vtkmodules.vtkRenderingCore import vtkLight, vtkRenderer

from sd2app.palette import palette_for
from sd2app.scene import shapes
from sd2app.scene.camera import EyePose, Margins
from sd2app.scene.colours import (
    MeshColour,
    SceneColours,
    fractions,
    mesh_colours,
    range_limits,
)
from sd2app.scene.extent import Extent
from sd2app.scene.markers import Markers
from sd2app.scene.parts import Body, CameraGlyph, GroundGrid, SensorGlyph
from sd2core.mesh.sequence import MeshSequence
from sd2core.sensor import VirtualSensor

Preset = Literal["overview", "camera", "sensor", "side", "top"]
SENSOR_RADIUS_M = 0.045
SENSOR_LEAST_PX = 7.0
_DOTS_PX = (1.4, 6.0)
_INSIDE_M = 0.25
_FAR_OFF_M = 30.0
_NOTHING = Extent.of_points(np.array([[-0.4, -0.6, 1.8], [0.4, 1.1, 2.6]]))


class Scene:
    """Mesh, sensor, camera, ground and light in an empty renderer.

    Nothing is rendered here: a backend calls :meth:`prepare` and renders.
    """

    def __init__(self, renderer: vtkRenderer) -> None:
        self.renderer = renderer
        self.colours = SceneColours.of(palette_for(False), False)
        self.pose = EyePose()
        self.margins = Margins(left=64.0, top=28.0, right=144.0, bottom=28.0)
        self.extent = _NOTHING
        self.sensor = VirtualSensor()
        self.metre_labels: tuple[shapes.MetreLabel, ...] = ()
        self.range_limits_m = (0.0, 1.0)
        self._mode: MeshColour = "velocity"
        self._v_max_mps = 2.0
        self._velocity: NDArray[np.floating] | None = None
        self._visible: NDArray[np.bool_] | None = None
        self._has_mesh = False
        self._hot = False
        self._stale_colours = False
        self._covered: shapes.GridRectangle | None = None
        self._light_up()
        # One convex cone needs no sorting, which costs 4 ms on a CPU.
        renderer.SetUseOIT(False)
        self.ground = GroundGrid(renderer)
        self.body = Body(renderer)
        self.camera_glyph = CameraGlyph(renderer)
        self.sensor_glyph = SensorGlyph(renderer)
        self.markers = Markers(renderer, self.colours)
        self._set_floor()
        self.set_sensor(self.sensor)
        self.set_colours(self.colours)

    # What is shown

    @property
    def has_mesh(self) -> bool:
        """True if there is a mesh."""
        return self._has_mesh

    @property
    def mode(self) -> MeshColour:
        """Quantity that the colour of the mesh shows."""
        return self._mode

    @property
    def v_max_mps(self) -> float:
        """End of the velocity colours."""
        return self._v_max_mps

    @property
    def vertices_m(self) -> NDArray[np.float32]:
        """Vertices on screen, (V, 3)."""
        return self.body.points

    def set_mesh(self, mesh: MeshSequence, frame: int = 0) -> None:
        """Take over another clip and show one frame of it."""
        self.extent = Extent.of_mesh(mesh)
        self._velocity = self._visible = None
        self.body.set_topology(mesh.frame(frame), mesh.faces)
        self.body.show(True)
        self._has_mesh = True
        self._set_floor()
        self.set_sensor(self.sensor)

    def clear_mesh(self) -> None:
        """Show sensor and camera alone."""
        self._has_mesh = False
        self._velocity = self._visible = None
        self.body.show(False)
        self.extent = _NOTHING
        self._set_floor()
        self.set_sensor(self.sensor)

    def show_mesh(self, shown: bool) -> None:
        """Draw the mesh, or leave it out at a time that it does not cover."""
        self.body.show(shown and self.has_mesh)

    def set_vertices(self, vertices: NDArray[np.floating]) -> None:
        """Move the mesh to another frame."""
        self.body.set_vertices(vertices)
        self._stale_colours = True

    def set_scattering(
        self,
        velocity_mps: NDArray[np.floating] | None,
        visible: NDArray[np.bool_] | None,
    ) -> None:
        """Radial velocity and visibility of the frame's vertices, (V,) each; None if unknown."""
        self._velocity = self._of_this_mesh(velocity_mps)
        self._visible = self._of_this_mesh(visible)
        self._stale_colours = True

    def set_v_max(self, v_max_mps: float) -> None:
        """End of the velocity colours."""
        self._v_max_mps = v_max_mps
        self._stale_colours = True

    def set_mode(self, mode: MeshColour) -> None:
        """Choose what the colour of the mesh means."""
        self._mode = mode
        self._stale_colours = True

    def set_as_dots(self, dots: bool) -> None:
        """Draw vertices instead of the surface."""
        self.body.set_as_dots(dots)
        self._stale_colours = True

    def set_sensor(self, sensor: VirtualSensor) -> None:
        """Place the sensor."""
        self.sensor = sensor
        position = np.asarray(sensor.position_m)
        away = float(np.linalg.norm(self.extent.centre_m - position))
        self.sensor_glyph.set_sensor(
            sensor, self.extent.floor_m, reach_m=min(max(0.38 * away, 0.3), 1.0)
        )
        ranges = np.linalg.norm(self.extent.points_m - position, axis=1)
        self.range_limits_m = range_limits(float(ranges.min()), float(ranges.max()))
        self._lay_ground()
        self._stale_colours = True

    def set_markers(
        self,
        sensors: tuple[VirtualSensor, ...],
        range_m: NDArray[np.floating],
        beyond: NDArray[np.bool_] | None,
    ) -> None:
        """Show planned places; see :meth:`Markers.set_sensors`."""
        self.markers.set_sensors(sensors, range_m, beyond)
        self._lay_ground()

    def set_hot(self, hot: bool) -> None:
        """Show that the sensor is under the pointer or dragged."""
        if hot != self._hot:
            self._hot = hot
            self.sensor_glyph.set_colours(self.colours, hot)

    def set_colours(self, colours: SceneColours) -> None:
        """Change the theme."""
        self.colours = colours
        self.renderer.SetBackground(*fractions(colours.background))
        self.ground.set_colours(colours)
        self.camera_glyph.set_colours(colours)
        self.sensor_glyph.set_colours(colours, self._hot)
        self.markers.set_colours(colours)
        self.body.shadow.GetProperty().SetColor(*fractions(colours.shadow))
        self._stale_colours = True

    # Where it is seen from

    def preset_pose(self, preset: Preset, size_px: tuple[float, float]) -> EyePose:
        """Pose of one of the ready-made views for a widget of this size."""
        body, sensor = self.extent, np.asarray(self.sensor.position_m)
        if preset in ("camera", "sensor"):
            position = np.zeros(3) if preset == "camera" else sensor
            azimuth = 0.0 if preset == "camera" else self.sensor.azimuth_deg
            elevation = 0.0 if preset == "camera" else self.sensor.elevation_deg
            return self._looking_from(position, azimuth, elevation, size_px)
        points = [body.points_m]
        if np.linalg.norm(body.centre_m) < _FAR_OFF_M:
            points.append(_box(np.zeros(3), CameraGlyph.SIZE_M))
        if np.linalg.norm(body.centre_m - sensor) < _FAR_OFF_M:
            points.append(_box(sensor, 0.25))
            points.append(np.array([[sensor[0], body.floor_m, sensor[2]]]))
        points.append(self._near_markers_m())
        azimuth, elevation = {
            "overview": (-52.0, -16.0),
            "side": (-90.0, 0.0),
            "top": (0.0, -89.5),
        }[preset]
        pose = EyePose(azimuth_deg=azimuth, elevation_deg=elevation)
        return pose.framed(np.concatenate(points), size_px, self.margins)

    def _looking_from(
        self,
        position: NDArray[np.float64],
        azimuth_deg: float,
        elevation_deg: float,
        size_px: tuple[float, float],
    ) -> EyePose:
        # The eye stays put, so the angle has to open until the body fits.
        pose = EyePose(tuple(position), azimuth_deg, elevation_deg, distance_m=1e-9)
        right, down, forward = pose.axes
        relative = self.extent.points_m - position
        depth = relative @ forward
        distance = max(float((self.extent.centre_m - position) @ forward), 0.5)
        ahead = depth > 0.1
        tangent = 0.45
        if ahead.any():
            # Half the picture's height is one unit; the colour bar keeps its place free.
            unit = size_px[1] / 2
            room_left = size_px[0] / 2 / unit
            room_right = max(size_px[0] / 2 - self.margins.right, 0.1 * size_px[0]) / unit
            x, y = relative[ahead] @ right, np.abs(relative[ahead] @ down)
            tallest = np.maximum(np.maximum(x / room_right, -x / room_left), y) / depth[ahead]
            tangent = float(np.clip(1.06 * tallest.max(), 0.12, 1.4))
        focus = position + distance * forward
        return EyePose(
            (float(focus[0]), float(focus[1]), float(focus[2])),
            azimuth_deg,
            elevation_deg,
            distance,
            2 * float(np.degrees(np.arctan(tangent))),
        )

    # Before a rendering

    def prepare(self, size_px: tuple[float, float], pixel_scale: float) -> None:
        """Bring everything up to date for the next rendering.

        ``size_px`` is the widget's size in device-independent pixels, ``pixel_scale`` the pixels of
        the render window per such pixel.
        """
        if self._stale_colours:
            self._colour_mesh()
        for part in (self.sensor_glyph, self.camera_glyph, self.ground):
            part.set_pixel_scale(pixel_scale)
        if self._has_mesh and self.body.drawn_as_dots:
            self.body.set_dot_size(self._dot_px(size_px) * pixel_scale)
        eye = self.pose.position
        pixel = self.pose.metres_per_pixel(tuple(self.extent.centre_m), size_px[1])
        self.markers.set_pixel(pixel if np.isfinite(pixel) else 0.0, pixel_scale)
        self.sensor_glyph.set_radius(self.sensor_radius_m(size_px))
        self.sensor_glyph.show(self.sensor_shown)
        self.camera_glyph.show(self.camera_shown)
        _, down, forward = self.pose.axes
        camera = self.renderer.GetActiveCamera()
        camera.SetPosition(*eye)
        camera.SetFocalPoint(*(eye + forward))
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
    def knows_hidden(self) -> bool:
        """True once the visibility of the vertices is known."""
        return self._visible is not None

    @property
    def legend_state(self) -> tuple[object, ...]:
        """Everything that a legend depends on."""
        return (
            self._has_mesh,
            self._mode,
            self._v_max_mps,
            self.range_limits_m,
            self.knows_hidden,
        )

    def sensor_radius_m(self, size_px: tuple[float, float]) -> float:
        """Radius of the sphere: never too small on screen to take hold of."""
        pixel = self.pose.metres_per_pixel(self.sensor.position_m, size_px[1])
        return max(SENSOR_RADIUS_M, SENSOR_LEAST_PX * pixel) if np.isfinite(pixel) else 0.01

    def body_box_px(self, size_px: tuple[float, float]) -> tuple[float, float, float, float] | None:
        """Left, top, right and bottom of where the body moves, None behind the eye."""
        pixels = self.pose.project(self.extent.points_m, size_px)
        pixels = pixels[pixels[:, 2] > 0.1, :2]
        if not len(pixels):
            return None
        return (*pixels.min(axis=0), *pixels.max(axis=0))

    def _dot_px(self, size_px: tuple[float, float]) -> float:
        """Size of dots that leaves gaps between those of a dense mesh."""
        box = self.body_box_px(size_px)
        if box is None:
            return _DOTS_PX[0]
        area = (box[2] - box[0]) * (box[3] - box[1])
        return float(np.clip(0.7 * np.sqrt(area / len(self.vertices_m)), *_DOTS_PX))

    def _colour_mesh(self) -> None:
        self._stale_colours = False
        if not self._has_mesh:
            return
        ranges = None
        if self._mode == "range":
            offset = self.vertices_m - np.asarray(self.sensor.position_m, np.float32)
            ranges = np.sqrt(np.einsum("ij,ij->i", offset, offset))
        self.body.set_point_colours(
            mesh_colours(
                self._mode,
                self.colours,
                len(self.vertices_m),
                velocity_mps=self._velocity,
                v_max_mps=self._v_max_mps,
                range_m=ranges,
                range_limits_m=self.range_limits_m,
                visible=self._visible,
                as_dots=self.body.drawn_as_dots,
            )
        )

    def _of_this_mesh(self, values: NDArray | None) -> NDArray | None:
        fits = values is not None and self._has_mesh and len(values) == len(self.vertices_m)
        return values if fits else None

    def _near_markers_m(self) -> NDArray[np.float64]:
        """Planned places that are not far off, (n, 3)."""
        places = self.markers.positions_m
        return places[np.linalg.norm(places - self.extent.centre_m, axis=1) < _FAR_OFF_M]

    def _set_floor(self) -> None:
        self.body.set_floor(self.extent.floor_m)
        self._covered = None
        self._lay_ground()

    def _lay_ground(self) -> None:
        """Grid under body, camera and sensor; in steps, so that it rarely changes."""
        low, high = self.extent.low_m, self.extent.high_m
        for place in (np.zeros(3), np.asarray(self.sensor.position_m)):
            if np.linalg.norm(self.extent.centre_m - place) < _FAR_OFF_M:
                low, high = np.minimum(low, place), np.maximum(high, place)
        if len(planned := self._near_markers_m()):
            low, high = np.minimum(low, planned.min(axis=0)), np.maximum(high, planned.max(axis=0))
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
