"""What is unlikely about a mesh is offered to be read another way."""

from __future__ import annotations

import numpy as np
import pytest

from sd2app.session.document import DocumentModel
from sd2app.session.sensor import SensorModel
from sd2app.session.tasks import TaskList
from sd2app.session.undo import Edits
from sd2core.files.recording_json import MeshReading
from sd2core.recording.recording import Recording, open_recording

POSE = np.random.default_rng(0).uniform((-0.3, -0.9, 2.5), (0.3, 0.9, 2.9), (60, 3))
BODY = POSE - np.array([0, 0, 0.01]) * np.arange(20)[:, None, None]
TIMES_S = np.arange(20) / 30


@pytest.fixture
def document(qapp):
    made = DocumentModel(TaskList())
    yield made
    made.close()


def opened(document, path, qtbot, signal="opened"):
    with qtbot.waitSignal(getattr(document, signal), timeout=10_000):
        document.open([path])


def test_a_mesh_behind_the_camera_is_turned_and_back_by_the_history(document, qtbot, tmp_path):
    behind = BODY * [1, -1, -1]
    np.savez(tmp_path / "m.npz", vertices=behind, times_s=TIMES_S)
    folder = Recording.create(tmp_path / "walk.sd2", mesh=tmp_path / "m.npz").folder
    opened(document, folder, qtbot)
    (offer,) = document.offers
    assert document.offers_of_open
    assert offer.text.endswith("y probably points up and z backward.")
    edits, stack = Edits(document, SensorModel()), document.undo_stack
    edits.set_radar_offset(0.5)
    with qtbot.waitSignal(document.opened, timeout=10_000):
        edits.cure_mesh(offer.cure)
    np.testing.assert_allclose(document.mesh.read(0, 20), BODY)
    assert (document.offers, stack.count()) == ((), 2)
    stack.undo()
    np.testing.assert_allclose(document.mesh.read(0, 20), behind)
    assert document.offers == (offer,)
    assert document.recording.mesh_reading.turn is None
    stack.undo()
    assert not document.modified
    stack.redo()
    stack.redo()
    np.testing.assert_allclose(document.mesh.read(0, 20), BODY)
    assert open_recording(folder).mesh_reading.turn is None
    document.save()
    assert open_recording(folder).mesh_reading.turn == "x180"


def test_a_turn_too_many_is_taken_back(document, qtbot, tmp_path):
    np.savez(tmp_path / "m.npz", vertices=BODY, times_s=TIMES_S)
    reading = MeshReading(turn="x180")
    folder = Recording.create(
        tmp_path / "walk.sd2", mesh=tmp_path / "m.npz", mesh_reading=reading
    ).folder
    opened(document, folder, qtbot)
    with qtbot.waitSignal(document.opened, timeout=10_000):
        Edits(document, SensorModel()).cure_mesh(document.offers[0].cure)
    assert document.recording.mesh_reading.turn is None
    np.testing.assert_allclose(document.mesh.read(0, 20), BODY)


def test_steps_far_back_are_read_again(document, qtbot, tmp_path):
    np.savez(tmp_path / "m.npz", vertices=BODY, times_s=TIMES_S)
    opened(document, tmp_path / "m.npz", qtbot)
    edits = Edits(document, SensorModel())
    for distance_m in (1.0, 2.0, 3.0):
        with qtbot.waitSignal(document.opened, timeout=10_000):
            reading = MeshReading(distance_m=distance_m)
            edits.read_mesh("Move it", {"mesh_reading": reading})
    document.undo_stack.setIndex(1)
    qtbot.waitUntil(
        lambda: np.allclose(document.mesh.frame(0), BODY[0] + [0, 0, 1]), timeout=10_000
    )
    assert document.recording.mesh_reading.distance_m == 1.0


def test_a_mesh_that_cannot_be_read_another_way_stays(document, qtbot, tmp_path):
    np.savez(tmp_path / "m.npz", vertices=BODY, times_s=TIMES_S)
    opened(document, tmp_path / "m.npz", qtbot)
    with qtbot.waitSignal(document.failed, timeout=10_000) as said:
        Edits(document, SensorModel()).read_mesh("Other", {"mesh": tmp_path / "none.npz"})
    assert "none.npz" in said.args[0]
    np.testing.assert_allclose(document.mesh.read(0, 20), BODY)
    assert document.undo_stack.count() == 0


def test_a_mesh_in_millimetres_is_opened_by_what_is_offered(document, qtbot, tmp_path):
    np.savez(tmp_path / "m.npz", vertices=1000 * BODY, times_s=TIMES_S)
    opened(document, tmp_path / "m.npz", qtbot, "failed")
    assert document.content is None
    (offer,) = document.offers
    assert not document.offers_of_open
    with qtbot.waitSignal(document.opened, timeout=10_000):
        document.open_mesh_so(offer.cure)
    np.testing.assert_allclose(document.mesh.read(0, 20), BODY)
    assert document.recording.mesh_reading.scale == 0.001
    assert document.offers == ()


def test_nothing_is_offered_for_a_sane_mesh_or_after_declining(document, qtbot, tmp_path):
    np.savez(tmp_path / "m.npz", vertices=BODY * [1, -1, -1], times_s=TIMES_S)
    np.savez(tmp_path / "sane.npz", vertices=BODY, times_s=TIMES_S)
    opened(document, tmp_path / "m.npz", qtbot)
    assert document.offers
    with qtbot.waitSignal(document.offered):
        document.decline_offers()
    assert document.offers == ()
    opened(document, tmp_path / "m.npz", qtbot)
    assert document.offers
    opened(document, tmp_path / "sane.npz", qtbot)
    assert document.offers == ()
