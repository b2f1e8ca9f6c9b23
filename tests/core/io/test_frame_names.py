"""Frames and persons by the names of files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2core.errors import Sd2Error
from sd2core.io.frame_names import frames_among, natural_key, numbered_frames
from sd2core.io.mesh import load_mesh


def found(names, person=None):
    return numbered_frames(
        [Path(name) for name in sorted(names, key=natural_key)], person, "frames"
    )


@given(
    st.sets(st.integers(0, 500), min_size=2, max_size=20),
    st.sampled_from(
        ["{:06d}_{}.obj", "img_{:04d}-{}.obj", "f{}_person{}.ply", "{:05d}_mesh_{:03d}.ply"]
    ),
)
def test_frame_and_person_are_the_two_numbers_that_change(frames, form):
    frames = sorted({0, 1, *frames})
    names = [form.format(frame, person) for frame in frames for person in (0, 1)]
    one = found(names, 1)
    assert [file.name for file in one.files] == [form.format(frame, 1) for frame in frames]
    if one.numbers is not None:
        np.testing.assert_array_equal(one.numbers, frames)


def test_words_and_widths_tell_which_number_is_the_person():
    names = [f"person_{p}_frame_{f}.obj" for p in range(5) for f in range(3)]
    assert len(found(names, 4).files) == 3
    names = [f"{p}_{f:06d}.obj" for p in range(2) for f in range(9)]
    assert len(found(names, 1).files) == 9


def test_the_person_seen_longest_is_read_by_default_and_listed():
    names = [f"{f:04d}_0.obj" for f in range(3)] + [f"{f:04d}_1.obj" for f in range(2, 9)]
    taken = found(names)
    assert [file.name[-5] for file in taken.files] == ["1"] * 7
    np.testing.assert_array_equal(taken.numbers, np.arange(2, 9))
    assert "Person 1 is read, seen longest of: 0 (3 frames), 1 (7 frames)." in taken.notes
    with pytest.raises(Sd2Error, match=r"no person 4.*0 \(3 frames\)"):
        found(names, 4)


def test_a_person_is_asked_for_where_there_are_none():
    with pytest.raises(Sd2Error, match="tell no persons"):
        found(["a_1.obj", "a_2.obj"], 1)


def test_numbers_that_count_from_one_or_in_steps_begin_at_the_start():
    np.testing.assert_array_equal(found([f"a{n}.obj" for n in (1, 2, 3, 6)]).numbers, [0, 1, 2, 5])
    stepped = found([f"a{n}.obj" for n in (0, 5, 10, 25)])
    np.testing.assert_array_equal(stepped.numbers, [0, 1, 2, 5])
    assert "steps of 5" in stepped.notes[0]


def test_a_clip_from_the_middle_keeps_its_place():
    late = found([f"a{n}.obj" for n in range(100, 110)])
    np.testing.assert_array_equal(late.numbers, np.arange(100, 110))
    assert "number 100" in late.notes[0]


@pytest.mark.parametrize(
    "names",
    [
        [f"t{1617000000000 + 33 * n + n % 2}.obj" for n in range(9)],  # milliseconds
        ["0.033.obj", "0.067.obj", "1.100.obj"],  # seconds
        ["a.obj", "b.obj"],
    ],
)
def test_numbers_that_do_not_count_frames_are_not_taken_for_it(names):
    taken = found(names)
    assert taken.numbers is None
    assert len(taken.files) == len(names)


def test_two_bodies_in_one_folder_are_not_mixed():
    with pytest.raises(Sd2Error, match=r"3 files like body_0\.obj and 2 like arm_0\.obj"):
        found([*(f"body_{n}.obj" for n in range(3)), "arm_0.obj", "arm_1.obj"])


def test_hidden_files_and_templates_are_left_out_and_named():
    names = ["._1.obj", "1.obj", "2.obj", "template.obj", "smpl.obj", "rest_0.obj", "10.obj"]
    notes: list[str] = []
    kept = frames_among([Path(name) for name in names], notes)
    assert [file.name for file in kept] == ["1.obj", "2.obj", "10.obj"]
    assert "._1.obj" in notes[0]
    assert all(name in notes[1] for name in ("template.obj", "smpl.obj", "rest_0.obj"))
    forest = [Path("forest_1.obj"), Path("forest_2.obj")]
    assert frames_among(forest, []) == forest
    assert frames_among([Path("template.obj")], []) == [Path("template.obj")]


def test_missing_files_are_time_without_a_person(tmp_path: Path) -> None:
    pose = np.random.default_rng(0).uniform((-0.3, -0.9, 2.5), (0.3, 0.9, 2.9), (20, 3))
    for frame in (0, 1, 2, 3, 9, 10):
        points = pose - [0, 0, frame / 30]
        text = "".join("v {:.5f} {:.5f} {:.5f}\n".format(*point) for point in points)
        (tmp_path / f"{frame:06d}_0.obj").write_text(text)
    mesh = load_mesh(tmp_path, frames_per_s=30)
    np.testing.assert_allclose(mesh.times_s[mesh.presence.present] * 30, [0, 1, 2, 3, 9, 10])
    np.testing.assert_allclose(mesh.times_s[~mesh.presence.present] * 30, [4])
    assert "5 video frames hold no mesh, the first after frame 3" in " ".join(mesh.notes)
    assert mesh.findings == ()
