"""Inertial sensors of a recording, without a window."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QObject
from turning_bodies import turning_body

from sd2app.imu import model as module
from sd2app.imu.model import ImuModel, place_words, reading_lines, status_parts
from sd2app.session.content import recording_of
from sd2app.session.session import Session
from sd2app.settings import Settings
from sd2core.errors import Sd2Error
from sd2core.imu.files import read_signals, write_signals
from sd2core.imu.mounting import mounted
from sd2core.imu.signals import InertialSignals
from sd2core.imu.virtual import virtual_imu
from sd2core.io.mesh import save_mesh
from sd2core.mesh.sequence import MeshSequence
from sd2core.recording.recording import Recording, open_recording

FRAMES = 30


@pytest.fixture(scope="module")
def body(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("body") / "mesh.npz"
    save_mesh(turning_body(FRAMES), path)
    return path


class Desk:
    """A session with the sensors of its recording."""

    def __init__(self, qtbot: Any, parent: QObject) -> None:
        self.qtbot, self.said = qtbot, list[str]()
        self.session = Session(parent, Settings.forgetful())
        self.session.document.opened.connect(self.session.attach)
        self.model = ImuModel(self.session, parent)
        self.model.failed.connect(self.said.append)
        self.model.noted.connect(self.said.append)

    @property
    def recording(self) -> Recording:
        recording = self.session.document.recording
        assert recording is not None
        return recording

    @property
    def history(self) -> Any:
        return self.session.document.undo_stack

    def open(self, path: Path) -> Desk:
        with self.qtbot.waitSignal(self.session.document.opened, timeout=20_000):
            self.session.document.open([path])
        return self.settle()

    def settle(self) -> Desk:
        self.qtbot.waitUntil(lambda: not self.model.busy, timeout=20_000)
        return self

    def seat(self, place: str) -> int:
        mesh = self.session.document.mesh
        assert mesh is not None
        return mounted(mesh, place).vertex

    def add(self, path: Path) -> Desk:
        self.model.add_file(path)
        return self.settle()


@pytest.fixture
def desk(qtbot: Any) -> Iterator[Desk]:
    parent = QObject()
    desk = Desk(qtbot, parent)
    yield desk
    desk.model.close()
    desk.session.document.close()
    parent.deleteLater()


@pytest.fixture
def walk(body: Path, tmp_path: Path) -> Path:
    return Recording.create(tmp_path / "walk.sd2", mesh=body).folder


def samples(start_s: float, count: int = 50) -> InertialSignals:
    values = np.random.default_rng(3).normal(size=(2, count, 3))
    values[0, :, 1] += 9.81
    return InertialSignals(start_s + np.arange(count) / 100, *values)


def written(path: Path, start_s: float) -> Path:
    write_signals(path, samples(start_s))
    return path


def test_a_click_places_a_sensor_and_undo_takes_it_away(desk: Desk, walk: Path) -> None:
    model = desk.open(walk).model
    assert not model.visible
    model.place(desk.seat("left-wrist"))
    assert desk.recording.imu_places == ("left-wrist",)
    assert desk.history.undoText() == "Place inertial sensor"
    desk.settle()
    mesh = desk.session.document.mesh
    assert mesh is not None
    expected = virtual_imu(mesh, "left-wrist")
    assert model.signals is not None
    np.testing.assert_array_equal(model.signals.channels, expected.channels)
    assert model.vertices == {"left-wrist": desk.seat("left-wrist")}
    # It turns at 1 rad in 29 frames about the axis that is upright.
    assert np.linalg.norm(model.signals.turn_rate_radps[50]) == pytest.approx(30 / 29, rel=1e-3)
    assert status_parts(model) == ["simulated, low pass 6 Hz"]

    desk.history.undo()
    assert (desk.recording.imu_places, model.visible, model.signals) == ((), False, None)
    desk.history.redo()
    assert model.signals is not None  # at once: it is known


def test_a_place_has_one_sensor_and_the_last_placed_is_shown(desk: Desk, walk: Path) -> None:
    model = desk.open(walk).model
    for place in ("head", "right-foot", "head"):
        model.place(desk.seat(place))
    assert desk.recording.imu_places == ("head", "right-foot")
    assert desk.history.count() == 2
    desk.settle()
    assert model.current == "head"
    model.show("right-foot")
    desk.settle()
    assert model.signals is not None
    assert model.signals.meta["at"] == "right-foot"
    assert model.vertices.keys() == {"head", "right-foot"}
    model.remove("right-foot")
    assert (model.current, model.signals.meta["at"]) == ("head", "head")
    assert model.places == ("head",)


def test_what_is_stale_is_left_off(desk: Desk, walk: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The first is cancelled while it reads the mesh, and never shown."""
    asked: list[str] = []
    gate = threading.Event()

    def slow(mesh: MeshSequence, at: str, progress: Any) -> InertialSignals:
        asked.append(at)
        if at == "head":
            gate.wait(20.0)
        signals = virtual_imu(mesh, at, progress=progress)
        asked.append(f"{at} done")
        return signals

    monkeypatch.setattr(module, "virtual_imu", slow)
    model = desk.open(walk).model
    model.place(desk.seat("head"))
    desk.qtbot.waitUntil(lambda: asked == ["head"], timeout=20_000)
    model.place(desk.seat("chest"))
    gate.set()
    desk.settle()
    assert asked == ["head", "chest", "chest done"]
    assert model.signals is not None
    assert model.signals.meta["at"] == "chest"


def test_a_sensor_that_does_not_fit_the_mesh_hinders_no_other(desk: Desk, walk: Path) -> None:
    recording = open_recording(walk)
    recording.imu_places = ("999999", "head")
    recording.save()
    model = desk.open(walk).model
    assert model.signals is None
    assert "the sensor is to be on number 999999" in status_parts(model)[0]
    assert model.vertices.keys() == {"head"}
    model.show("head")
    desk.settle()
    assert model.signals is not None
    assert not desk.said


def test_any_surface_has_sensors_on_vertices_and_a_cloud_has_none(
    desk: Desk, tmp_path: Path
) -> None:
    body = turning_body(FRAMES)
    vertices, faces = body.read(0, FRAMES), np.asarray(body.faces)
    save_mesh(MeshSequence(vertices, faces[:-4], body.timebase), tmp_path / "other.npz")
    model = desk.open(tmp_path / "other.npz").model
    model.place(7)
    assert desk.recording.imu_places == ("7",)
    assert place_words("7") == "vertex 7"
    save_mesh(MeshSequence(vertices, None, body.timebase), tmp_path / "cloud.npz")
    desk.open(tmp_path / "cloud.npz")
    assert "point cloud" in model.why_not
    model.place(7)
    assert desk.recording.imu_places == ()


def test_sensors_are_saved_with_the_recording(desk: Desk, walk: Path, tmp_path: Path) -> None:
    model = desk.open(walk).model
    model.place(desk.seat("right-hand"))
    desk.add(written(tmp_path / "hand.csv", 0.25))
    desk.session.edits.begin_offset_drag("imu_offset_s")
    desk.session.edits.drag_offset(0.1)
    desk.session.edits.drag_offset(-0.125)
    desk.session.edits.end_drag()
    assert desk.history.undoText() == "Inertial sensor offset"
    desk.session.document.save()
    again = open_recording(walk)
    assert (again.imu, again.imu_offset_s) == (tmp_path / "hand.csv", 0.125)
    assert again.imu_places == ("right-hand",)
    desk.history.undo()
    assert desk.recording.imu_offset_s == 0.25


def test_a_real_file_on_the_same_clock_lies_where_its_times_say(
    desk: Desk, walk: Path, tmp_path: Path
) -> None:
    model = desk.open(walk).add(written(tmp_path / "wrist.csv", 0.25)).model
    assert (desk.recording.imu, desk.recording.imu_offset_s) == (tmp_path / "wrist.csv", 0.25)
    assert model.visible
    assert model.shift_s == pytest.approx(0.0, abs=1e-9)
    assert not desk.said
    assert status_parts(model) == ["measured: wrist.csv", "from 00:00.250"]
    desk.history.undo()
    assert (desk.recording.imu, model.visible) == (None, False)
    desk.history.redo()
    desk.settle()
    assert model.measured is not None
    model.remove_file()
    assert (model.measured, desk.recording.imu) == (None, None)


def test_a_real_file_on_a_clock_of_its_own_begins_with_the_recording(
    desk: Desk, walk: Path, tmp_path: Path
) -> None:
    model = desk.open(walk).add(written(tmp_path / "wrist.csv", 1.6e9)).model
    assert desk.recording.imu_offset_s == 0.0
    assert model.shift_s == pytest.approx(-1.6e9)
    assert desk.said[0].startswith("wrist.csv has a clock of its own")
    first = samples(1.6e9).acceleration_mps2[0, 0]
    assert f"x {first:+.1f}".replace("-", "−") in reading_lines(model, 0.0)[1]


def test_files_that_are_added_leave_the_sensors_alone(
    desk: Desk, walk: Path, tmp_path: Path
) -> None:
    model = desk.open(walk).model
    model.place(desk.seat("head"))
    desk.add(written(tmp_path / "wrist.csv", 0.25))
    save_mesh(turning_body(FRAMES + 10), tmp_path / "longer.npz")
    with desk.qtbot.waitSignal(desk.session.document.opened, timeout=20_000):
        desk.session.edits.add([tmp_path / "longer.npz"])
    desk.settle()
    assert (desk.recording.imu, desk.recording.imu_offset_s) == (tmp_path / "wrist.csv", 0.25)
    assert desk.recording.imu_places == ("head",)
    assert model.signals is not None
    assert model.signals.times_s[-1] == pytest.approx((FRAMES + 9) / 30)
    with desk.qtbot.waitSignal(desk.session.document.opened, timeout=20_000):
        desk.session.edits.add([written(tmp_path / "other.csv", 0.5), tmp_path / "longer.npz"])
    assert (desk.recording.imu, desk.recording.imu_offset_s) == (tmp_path / "other.csv", 0.25)


def test_samples_alone_are_no_recording(tmp_path: Path) -> None:
    with pytest.raises(Sd2Error, match="are shown beside something"):
        recording_of([written(tmp_path / "wrist.csv", 0.0)])


def test_a_damaged_file_is_named_and_not_added(desk: Desk, walk: Path, tmp_path: Path) -> None:
    (tmp_path / "wrist.csv").write_text("t,ax,ay,az,gx,gy,gz\n0,1,1,1,1,1,1\n")
    desk.open(walk).add(tmp_path / "wrist.csv")
    assert desk.recording.imu is None
    assert desk.history.count() == 0
    assert "no unit" in desk.said[0]


def test_a_file_that_is_gone_is_named_once(desk: Desk, walk: Path, tmp_path: Path) -> None:
    desk.session.document.failed.connect(desk.said.append)
    recording = open_recording(walk)
    recording.imu = tmp_path / "gone.csv"
    recording.save()
    model = desk.open(walk).model
    assert not model.visible
    (said,) = desk.said
    assert said.startswith("The inertial sensor's file is not at")


@pytest.mark.parametrize("ending", [".csv", ".sto", ".npz"])
def test_what_is_shown_is_written(desk: Desk, walk: Path, tmp_path: Path, ending: str) -> None:
    model = desk.open(walk).model
    model.place(desk.seat("left-wrist"))
    desk.settle()
    assert model.file_name == "walk-left-wrist.csv"
    model.save(tmp_path / f"out{ending}")
    assert desk.said == [f"The samples are in {tmp_path / f'out{ending}'}."]
    assert model.signals is not None
    again = read_signals(tmp_path / f"out{ending}")
    np.testing.assert_allclose(again.channels, model.signals.channels, rtol=1e-6, atol=1e-9)


def test_values_are_those_of_the_nearest_sample() -> None:
    values = np.arange(12.0).reshape(2, 2, 3) - 6.0
    signals = InertialSignals(np.array([0.0, 0.01]), *values, {"cutoff_hz": 6.0})
    model: Any = SimpleNamespace(signals=signals, measured=None)
    assert reading_lines(model, 0.006) == (
        "00:00.006",
        "simulated: x −3.0  y −2.0  z −1.0 m/s²",
        "x +3.00  y +4.00  z +5.00 rad/s",
    )
    assert "x −6.0" in reading_lines(model, -0.04)[1]
    assert reading_lines(model, 0.07) == ()
    values[0, 1, 1] = np.nan
    signals = InertialSignals(np.array([0.0, 0.01]), *values, {"cutoff_hz": 6.0})
    assert reading_lines(SimpleNamespace(signals=signals, measured=None), 0.01)[1] == (
        "simulated: not known"
    )


def test_folding_is_remembered(qtbot: Any) -> None:
    parent, settings = QObject(), Settings.forgetful()
    session = Session(parent, settings)
    model = ImuModel(session, parent)
    assert not model.folded
    model.set_folded(True)
    assert ImuModel(session, parent).folded
    parent.deleteLater()
