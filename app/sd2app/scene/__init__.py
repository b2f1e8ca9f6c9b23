"""The 3D view: mesh, sensor, camera and ground. The only place that knows VTK."""
