"""Other edits of a recording survive as JSON, and what differs is named."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2core.errors import Sd2Error
from sd2core.files.recording_json import CameraEntry, MeshReading
from sd2core.mesh.bodies import Body
from sd2core.mesh.things import Thing
from sd2core.mesh.walls import Wall
from sd2core.placements.placements import PlacementGrid
from sd2core.recording.edited import decoded_fields, differing, edited_fields
from sd2core.recording.recording import Recording
from sd2core.sensor import Beam, VirtualSensor

metres = st.floats(-50, 50)
angles = st.floats(-89, 89)
recordings = st.builds(
    Recording,
    st.just(Path("walk.sd2")),
    sensor=st.builds(
        VirtualSensor,
        position_m=st.tuples(metres, metres, metres),
        azimuth_deg=angles,
        elevation_deg=angles,
        beam=st.none()
        | st.builds(
            Beam,
            st.floats(1, 179),
            st.floats(1, 179),
            st.just(()) | st.just(((-90, -9, -7), (0, 0, 0), (90, -9, -7))),
        ),
    ),
    placements=st.none()
    | st.builds(PlacementGrid, st.lists(st.floats(0.1, 9), min_size=1, max_size=3).map(tuple)),
    radar_offset_s=st.floats(-9, 9),
    imu=st.none() | st.just(Path("wrist.csv").absolute()),
    imu_offset_s=st.floats(-9, 9),
    imu_places=st.lists(st.sampled_from(["left-wrist", "head", "4711"]), unique=True).map(tuple),
    things=st.lists(
        st.builds(
            Thing,
            st.sampled_from(["table", str(Path("chair.obj").absolute())]),
            st.tuples(metres, metres, metres),
            angles,
            st.none() | st.just((1.0, 2.0, 0.1)),
        ),
        max_size=3,
    ).map(tuple),
    bodies=st.lists(
        st.builds(
            Body,
            st.just(str(Path("anna.npz").absolute())),
            st.tuples(metres, metres, metres),
            angles,
            st.floats(-9, 9),
            st.sampled_from(["", "anna"]),
            st.sampled_from([{}, {"scale": 0.001, "image_size": (640, 480)}]),
        ),
        max_size=2,
    ).map(tuple),
    walls=st.lists(
        st.builds(Wall, st.floats(0.1, 9), angles, st.floats(-90, 90), st.floats(0, 40)),
        max_size=3,
    ).map(tuple),
    radar_receiver=st.none() | st.integers(1, 8),
    radar_transmitter=st.none() | st.integers(1, 8),
    mesh=st.none() | st.just(Path("body.pkl").absolute()),
    faces=st.none() | st.just(Path("faces.npy").absolute()),
    mesh_reading=st.builds(
        MeshReading,
        scale=st.none() | st.just(0.001),
        person=st.none() | st.just("ida"),
        turn=st.none() | st.just("x180"),
        image_size=st.none() | st.just((640, 480)),
    ),
    camera=st.none() | st.builds(CameraEntry, focal_px=st.floats(100, 2000)),
)


@given(recordings)
def test_what_was_encoded_is_decoded(recording: Recording) -> None:
    entry = edited_fields(recording)
    fields = decoded_fields(json.loads(json.dumps(entry)))
    assert fields == {name: getattr(recording, name) for name in fields}
    assert not differing(entry, edited_fields(recording))


def test_what_differs_is_named() -> None:
    one, other = Recording(Path("a.sd2")), Recording(Path("a.sd2"), radar_offset_s=0.5)
    assert differing(edited_fields(one), edited_fields(other)) == ["offset of the radar"]


def test_entries_of_earlier_versions_are_read(tmp_path: Path) -> None:
    placed = Recording(tmp_path / "a.sd2", radar_offset_s=0.5, imu_places=("head",))
    entry = {
        name: value
        for name, value in edited_fields(placed).items()
        if name in ("sensor", "placements", "radar_offset_s")
    }
    assert decoded_fields(entry).keys() == {"sensor", "placements", "radar_offset_s"}
    assert not differing(entry, edited_fields(placed))
    other = Recording(tmp_path / "a.sd2", imu_places=("chest",))
    assert differing(edited_fields(placed), edited_fields(other)) == [
        "offset of the radar", "set of inertial sensors"
    ]  # fmt: skip


@pytest.mark.parametrize("entry", [{}, {"sensor": {"position_m": "there"}}, {"sensor": {}}])
def test_something_else_is_refused(entry: dict) -> None:
    with pytest.raises(Sd2Error, match="cannot be read"):
        decoded_fields(entry)


@pytest.mark.parametrize("number", [0, -1, "left"])
def test_a_receiver_that_cannot_be_is_refused(number: object) -> None:
    entry = edited_fields(Recording(Path("a.sd2"))) | {"radar_receiver": number}
    with pytest.raises(Sd2Error, match="cannot be read"):
        decoded_fields(entry)
