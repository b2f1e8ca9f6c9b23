"""Stages for the tests of the scene view."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import pytest
from PySide6.QtGui import QGuiApplication
from scene_stage import Document, Drag, Inertial, Limbs, Placements, Stage, Synthesis, two_plates

from sd2app.session.display import DisplayModel
from sd2app.session.playback import PlaybackModel
from sd2app.session.sensor import SensorModel
from sd2app.session.session import Mode

SIZE = (600, 450)


@pytest.fixture
def make_stage(qtbot: Any) -> Iterator[Callable[[], Stage]]:
    """Build a stage."""
    made: list[Stage] = []

    def make() -> Stage:
        from sd2app.scene.view import SceneView

        document, synthesis, placements = Document(), Synthesis(), Placements()
        playback, sensor, display = PlaybackModel(), SensorModel(), DisplayModel()
        inertial, placing, limbs = Inertial(), Mode(document), Limbs()
        log: list[str] = []

        session = SimpleNamespace(
            document=document,
            playback=playback,
            sensor=sensor,
            display=display,
            placing=placing,
            edits=Drag(sensor, log),
        )
        view = SceneView(session, synthesis, placements, inertial, limbs)
        qtbot.addWidget(view)
        view.resize(*SIZE)
        view.show()
        QGuiApplication.processEvents()
        models = (document, playback, sensor, display, synthesis, placements, inertial, placing)
        made.append(Stage(view, *models, limbs, log))
        return made[-1]

    yield make
    for stage in made:
        stage.view.close()


@pytest.fixture
def stage(make_stage: Callable[[], Stage]) -> Stage:
    """A stage with two plates seen from the camera."""
    made = make_stage()
    made.open(two_plates())
    made.view.set_view("camera")
    made.view.grab()
    return made
