"""The 3D view: mesh, sensor, camera and ground. The only place that knows VTK."""

from sd2app.scene.view import SceneView

__all__ = ["SceneView"]
