from __future__ import annotations

from pathlib import Path

import av
import numpy as np
import pytest

from sd2core.errors import Sd2Error
from sd2core.imu.files import write_signals
from sd2core.imu.signals import InertialSignals
from sd2core.io.kinds import kind_of
from sd2core.io.mesh import load_mesh
from sd2core.maps import DopplerMap
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase


def test_files_are_told_apart(tmp_path):
    for name, kind in (
        ("a.MP4", "video"),
        ("b.obj", "mesh"),
        ("c.pkl", "mesh"),
        ("d.zarr.zip", "mesh"),
        ("radar.npy", "radar"),
        ("recording.json", "recording"),
    ):
        (tmp_path / name).touch()
        assert kind_of(tmp_path / name) == kind, name
    np.savez(tmp_path / "mesh.npz", vertices=np.zeros((1, 1, 3)))
    assert kind_of(tmp_path / "mesh.npz") == "mesh"
    values = np.ones((4, 2), np.float32)
    DopplerMap(values, VelocityAxis(4), Timebase([0, 1]), "real").save(tmp_path / "map.npz")
    assert kind_of(tmp_path / "map.npz") == "map"


@pytest.mark.parametrize(
    "heading",
    [
        "time_s,acc_x_mps2,acc_y_mps2,acc_z_mps2,gyr_x_radps,gyr_y_radps,gyr_z_radps",
        "\ufeffTimestamp (ms);Accelerometer X [g];Accelerometer Y [g];Accelerometer Z [g];"
        "Gyroscope X [deg/s];Gyroscope Y [deg/s];Gyroscope Z [deg/s];Label",
        "# at: left-wrist\n\n# rate_hz: 100\nax\tay\taz\tgx\tgy\tgz",
    ],
)
def test_a_table_of_an_inertial_sensor_is_known_by_its_heading(tmp_path, heading):
    (tmp_path / "wrist.csv").write_text(heading + "\n", encoding="utf-8")
    assert kind_of(tmp_path / "wrist.csv") == "imu"


@pytest.mark.parametrize(
    "text",
    [
        "",
        "start_s,end_s,label\n0,1,x\n",
        "t,ax,ay,az\n",
        "# only remarks\n",
        "\0\xff",
        "a" + " " * 9999 + "b",
    ],
)
def test_other_tables_are_none(tmp_path, text):
    (tmp_path / "labels.csv").write_bytes(text.encode("latin-1"))
    with pytest.raises(Sd2Error, match=r"no kind that is known|is empty"):
        kind_of(tmp_path / "labels.csv")


@pytest.mark.parametrize("ending", [".csv", ".sto", ".npz"])
def test_what_sd2_imu_writes_is_known(tmp_path, ending):
    signals = InertialSignals(np.arange(3) / 100, np.ones((3, 3)), np.ones((3, 3)))
    write_signals(tmp_path / f"wrist{ending}", signals)
    assert kind_of(tmp_path / f"wrist{ending}") == "imu"


def test_folders_are_told_apart(tmp_path):
    for name, inside, kind in (
        ("x.sd2", "recording.json", "recording"),
        ("mesh.zarr", "zarr.json", "mesh"),
        ("frames", "frame_001.ply", "mesh"),
        ("capture", "radar.npy", "radar"),
    ):
        (tmp_path / name).mkdir()
        (tmp_path / name / inside).touch()
        assert kind_of(tmp_path / name) == kind
    (tmp_path / "outer" / "RadarIfxAvian_00").mkdir(parents=True)
    (tmp_path / "outer" / "RadarIfxAvian_00" / "radar.npy").touch()
    assert kind_of(tmp_path / "outer") == "radar"
    assert kind_of(tmp_path / "frames" / "*.ply") == "mesh"


def test_what_is_nothing_known_is_explained(tmp_path):
    (tmp_path / "notes.txt").write_text("dear diary")
    (tmp_path / "nothing.csv").touch()
    (tmp_path / "bad.npz").write_text("no zip")
    (tmp_path / "empty").mkdir()
    (tmp_path / "maps").mkdir()
    np.savez(tmp_path / "maps" / "1.npz", velocity_mps=np.zeros(3))
    for name, words in (
        ("notes.txt", "is of no kind that is known"),
        ("nothing.csv", "is empty"),
        ("missing.mp4", "does not exist"),
        ("bad.npz", "cannot be read as .npz"),
        ("empty", "holds nothing that is known"),
        ("maps", f"`sd2 info {tmp_path / 'maps' / '1.npz'}`"),
    ):
        with pytest.raises(Sd2Error) as caught:
            kind_of(tmp_path / name)
        assert words in str(caught.value)
        assert name in str(caught.value)


@pytest.mark.parametrize("folder", ["data", "data [1]"])
def test_a_name_with_brackets_is_a_file_and_not_a_pattern(tmp_path, folder):
    path = tmp_path / folder / "walk [1].mkv"
    path.parent.mkdir()
    for name, kind in (("walk [1].mkv", "video"), ("a?b*.npy", "radar"), ("[a].sd2", "recording")):
        if kind == "recording":
            (path.parent / name).mkdir()
            (path.parent / name / "recording.json").touch()
        else:
            (path.parent / name).touch()
        assert kind_of(path.parent / name) == kind
    (path.parent / "1.obj").touch()
    assert kind_of(path.parent / "*.obj") == "mesh"
    with pytest.raises(Sd2Error, match="does not exist"):
        kind_of(path.parent / "walk.mkv")


def test_a_pattern_below_a_folder_with_brackets_finds_its_frames(tmp_path):
    folder = tmp_path / "data [1]"
    folder.mkdir()
    for number in range(3):
        (folder / f"{number}.obj").write_text(
            f"v 0 0 {number + 1}\nv 1 0 2\nv 0 1 2\nf 1 2 3\n", encoding="utf-8"
        )
    assert load_mesh(folder / "*.obj", frames_per_s=30, scale=1).frame_count == 3
    with pytest.raises(Sd2Error, match="does not exist"):
        load_mesh(folder / "walk.npz")


@pytest.mark.parametrize(
    ("name", "codec"),
    [("a.MTS", "libx264"), ("a.3gp", "libx264"), ("a.gif", "gif"), ("a", "mpeg4")],
)
def test_a_video_is_known_by_what_is_in_it(tmp_path, name, codec):
    formats = {".MTS": "mpegts", ".gif": "gif"}
    with av.open(str(tmp_path / name), "w", format=formats.get(Path(name).suffix, "mp4")) as made:
        stream = made.add_stream(codec, rate=10)
        stream.width, stream.height = 64, 64
        stream.pix_fmt = "rgb8" if codec == "gif" else "yuv420p"
        for _ in range(3):
            picture = av.VideoFrame.from_ndarray(np.zeros((64, 64, 3), np.uint8), format="rgb24")
            made.mux(stream.encode(picture))
        made.mux(stream.encode())
    assert kind_of(tmp_path / name) == "video"
    renamed = (tmp_path / name).rename(tmp_path / "x.camera")
    assert kind_of(renamed) == "video"


@pytest.mark.parametrize("name", ["notes.txt", "notes.nfo", "notes", "notes.ans"])
def test_a_text_is_no_video(tmp_path, name):
    (tmp_path / name).write_text("Ten lines\n" * 10)
    with pytest.raises(Sd2Error, match="no kind that is known"):
        kind_of(tmp_path / name)
