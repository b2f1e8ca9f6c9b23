"""Reading a Kinect skeleton and a radar's points."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from mars_files import approaching, write_part

from sd2core.errors import Sd2Error
from sd2core.io.radar.mars import JOINTS, mars_parts, read_mars

FRAMES = np.array([100, 101, 103, 200, 201])
KINECT, RADAR = "kinect_data_test.csv", "radar_data_test.csv"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    folder = tmp_path / "mars_subject7"
    points = [(frame, -0.356, 3.0) for frame in FRAMES] + [(201, 0.712, 1.0)]
    write_part(folder, "test", approaching(5, 0.5), FRAMES, points)
    return folder


def test_it_tells_person_part_and_stretches(folder: Path) -> None:
    assert mars_parts(folder) == ("test",)
    part = read_mars(folder, "test")
    assert (part.subject, part.name) == ("7", "test")
    first, second = part.stretches
    # Frame 102 had no points; after 103 another movement begins.
    assert first.frames.tolist() == [0, 1, 3]
    assert first.frame_count == 4
    np.testing.assert_allclose(first.times_s, [0.0, 0.1, 0.3])
    assert second.frames.tolist() == [0, 1]
    assert second.point_rows.tolist() == [0, 1, 1]


def test_joints_are_in_the_camera_frame(folder: Path) -> None:
    read = np.concatenate([stretch.joints_m for stretch in read_mars(folder, "test").stretches])
    np.testing.assert_allclose(read, approaching(5, 0.5), atol=1e-7)
    head, foot = JOINTS.index("Head"), JOINTS.index("FootLeft")
    assert (read[:, head, 1] < read[:, foot, 1]).all()


def test_approaching_is_positive(folder: Path) -> None:
    first, second = read_mars(folder, "test").stretches
    np.testing.assert_allclose(first.mean_velocity_mps(), 0.356)
    # Three parts approach at 0.356 m/s, one recedes at 0.712 m/s.
    np.testing.assert_allclose(second.mean_velocity_mps(), [0.356, (3 * 0.356 - 0.712) / 4])


@pytest.mark.parametrize(
    ("file", "old", "new", "words"),
    [
        (KINECT, "Neck_Y", "Nick_Y", "no column Neck_Y"),
        (RADAR, "Doppler", "Speed", "no column Doppler"),
        (RADAR, "100,9,0,2,0,-0.356", "100,9,0,2,0,nan", "Doppler of row 1 is nan"),
        (RADAR, "100,9,0,2,0,-0.356", "100,9,0,2,0,fast", "fast"),
        (RADAR, "100,9,0,2,0,-0.356,3", "100,9,0,2,0,-0.356,0", "intensity of point 1 is 0"),
        (RADAR, "101,9", "102.5,9", "102.5"),
        (RADAR, "100,9", "150,9", "frame 101 comes after frame 150"),
        (RADAR, "101,9,0,2,0,-0.356,3,1.6e9\n", "", "5 rows, radar_data_test.csv 4 frames"),
    ],
)
def test_damage_is_explained(folder: Path, file: str, old: str, new: str, words: str) -> None:
    text = (folder / file).read_text()
    assert old in text
    (folder / file).write_text(text.replace(old, new, 1))
    with pytest.raises(Sd2Error) as caught:
        read_mars(folder, "test")
    assert words in str(caught.value)


def test_far_joints_are_no_metres(folder: Path) -> None:
    rows = (folder / KINECT).read_text().splitlines()
    rows[2] = "2100" + rows[2][rows[2].index(",") :]
    (folder / KINECT).write_text("\n".join(rows))
    with pytest.raises(Sd2Error, match="row 2 is at 2100 m"):
        read_mars(folder, "test")


@pytest.mark.parametrize("file", [KINECT, RADAR])
def test_an_empty_part_is_refused(folder: Path, file: str) -> None:
    heading = (folder / file).read_text().splitlines()[0]
    (folder / file).write_text(heading + "\n")
    with pytest.raises(Sd2Error, match="holds no rows"):
        read_mars(folder, "test")


def test_what_is_no_recording_is_refused(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(Sd2Error, match="There is no folder"):
        mars_parts(tmp_path / "nowhere")
    (tmp_path / "empty").mkdir()
    with pytest.raises(Sd2Error, match="holds no MARS recording"):
        mars_parts(tmp_path / "empty")
    with pytest.raises(Sd2Error, match="no part 'train'"):
        read_mars(folder, "train")
    (folder / RADAR).unlink()
    with pytest.raises(Sd2Error, match=f"{KINECT} and no {RADAR}"):
        mars_parts(folder)
