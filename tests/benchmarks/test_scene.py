"""How fast the 3D view draws on the CPU: the body plays at 600 × 450."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PySide6.QtGui import QColor

from sd2core.io.mesh import load_mesh
from sd2core.sensor import VirtualSensor

SIZE = (600, 450)


class Player:
    """The scene over the off-screen backend, frame by frame."""

    def __init__(self, mesh: Any) -> None:
        from sd2app.scene.offscreen_backend import ImageBackend
        from sd2app.scene.scene import Scene

        self.mesh = mesh
        self.backend = ImageBackend()
        self.backend.resize(*SIZE)
        self.scene = Scene(self.backend.renderer)
        self.scene.set_mesh(mesh)
        self.scene.look_from("overview")
        self.backend.start(self.scene.prepare)
        self.visible = np.arange(mesh.vertex_count) % 2 == 0
        self.index = 0

    def next_frame(self) -> None:
        """Other vertices, velocities and sensor: everything that a drag while playing changes."""
        self.index += 1
        frame = self.index % self.mesh.frame_count
        vertices = self.mesh.frame(frame)
        self.scene.set_vertices(vertices)
        self.scene.set_sensor(VirtualSensor((0.01 * (frame % 20), 0.0, 0.0)))
        self.scene.set_scattering(vertices[:, 2] - 1.3, self.visible)
        self.backend.request_render()
        self.backend.grab()

    def bare_rendering_s(self, rounds: int = 30) -> float:
        """Median time that VTK alone takes for another frame."""
        window = self.scene.renderer.GetRenderWindow()
        spent = []
        for _ in range(rounds):
            self.scene.body.set_points(self.scene.body.points)
            start = time.perf_counter()
            window.Render()
            spent.append(time.perf_counter() - start)
        return float(np.median(spent))


@pytest.mark.benchmark(group="scene")
def test_frames_per_second_of_the_image_backend(
    benchmark: Any, qtbot: Any, shared_data: Path
) -> None:
    player = Player(load_mesh(shared_data / "mesh" / "walk.npz"))
    qtbot.addWidget(player.backend)
    assert player.mesh.vertex_count == 13_718
    benchmark.pedantic(player.next_frame, rounds=60, warmup_rounds=5)
    median_s = benchmark.stats.stats.median
    benchmark.extra_info["frames_per_s"] = 1.0 / median_s
    benchmark.extra_info["times_bare_rendering"] = median_s / player.bare_rendering_s()
    picture = player.backend.grab().toImage()
    middle = player.scene.pose.project([player.scene.extent.centre_m])[0]
    ground = QColor(player.scene.colours.backdrop)
    assert picture.pixelColor(round(middle[0]), round(middle[1])) != ground
    player.backend.shut_down()
