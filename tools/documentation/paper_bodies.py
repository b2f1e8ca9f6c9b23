"""Figures 2 and 4 of the paper on the bundled sample; a part of ``docs/paper.md``."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from sd2core.doppler import PRESETS, Synthesizer
from sd2core.figures.strip import plot_strip
from sd2core.figures.strip_source import StripOptions, StripSource
from sd2core.figures.surface import Frame, find_visible_triangles, project_vertices
from sd2core.files.figure_files import save_figure
from sd2core.files.resources import resource_path
from sd2core.mesh.sequence import MeshSequence
from sd2core.recording.recording import open_recording
from sd2core.sensor import VirtualSensor

FRAMES = range(100, 141, 10)
FRAME = 120
NEAR_M, FAR_M = 2.2, 6.0
"""Ranges of Figure 4; the sample's person is at the nearer one from the camera."""
_HEIGHT_PX, _PIXELS_PER_INCH = 560, 150


def draw_bodies(mesh_figure: Path, range_figure: Path) -> dict[str, float]:
    """Draw both figures, and return the numbers that are told of the second."""
    recording = open_recording(resource_path("swipes.sd2"))
    mesh = recording.load_mesh()
    with recording.open_video() as video:
        source = StripSource.of(recording, video, mesh, recording.title)
        strip = plot_strip(source, FRAMES, StripOptions(as_dots=True, v_max_mps=1.5))
        save_figure(strip, mesh_figure, pixels_per_inch=_PIXELS_PER_INCH)
    _draw_ranges(mesh, source, range_figure)
    maps = Synthesizer(mesh, replace(PRESETS["paper"], count="plain"))
    near, far = (maps.map(_sensor(range_m)).values.sum() for range_m in (NEAR_M, FAR_M))
    shares = {"share": 100 * float(far / near), "law": 100 * (NEAR_M / FAR_M) ** 4}
    return {"frame": FRAME, "near": NEAR_M, "far": FAR_M, **shares}


def _sensor(range_m: float) -> VirtualSensor:
    return VirtualSensor((0.0, 0.0, round(NEAR_M - range_m, 3)))


def _draw_ranges(mesh: MeshSequence, source: StripSource, path: Path) -> None:
    figure = Figure(figsize=(7.2, 4.4), dpi=110, layout="constrained")
    for axes, range_m in zip(figure.subplots(1, 2), (NEAR_M, FAR_M), strict=True):
        seen = np.asarray(mesh.frame(FRAME), np.float64) - _sensor(range_m).position_m
        assert mesh.faces is not None  # The sample's mesh has them.
        picture = axes.imshow(_distances_m(seen, mesh.faces, source), cmap="viridis")
        axes.set_axis_off()
        axes.set_title(f"simulated body, from {range_m:g} m", fontsize=9)
        figure.colorbar(picture, ax=axes, label="distance from the sensor (m)", shrink=0.85)
    save_figure(figure, path)


def _distances_m(
    vertices_m: NDArray[np.float64], faces: NDArray[np.int32], source: StripSource
) -> NDArray[np.float64]:
    """Distance of what each pixel shows, NaN beside the body."""
    pixels, _ = project_vertices(vertices_m, source.camera)
    low, high = pixels.min(axis=0), pixels.max(axis=0)
    zoom = _HEIGHT_PX / float((high - low).max())
    width, height = np.ceil(zoom * (high - low)).astype(int)
    frame = Frame(float(low[0]), float(low[1]), int(width), int(height), zoom)
    view = find_visible_triangles(vertices_m, faces, source.camera, frame)
    distances_m = np.full(view.owner.shape, np.nan)
    ranges_m = np.linalg.norm(vertices_m, axis=1)
    distances_m[view.shown] = view.interpolated(ranges_m[:, None])[:, 0]
    return distances_m
