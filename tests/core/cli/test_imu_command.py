"""``sd2 imu``: a virtual inertial sensor on a mesh or a recording."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cli_outcome import Sd2

from sd2core.datasets.recording_sources import Making
from sd2core.datasets.sources import gather
from sd2core.doppler import Synthesizer
from sd2core.errors import Sd2Error
from sd2core.files.resources import resource_path
from sd2core.imu.files import read_signals
from sd2core.imu.virtual import virtual_imu
from sd2core.io.mesh import load_mesh, save_mesh
from sd2core.maps import DopplerMap
from sd2core.mesh.bodies import Body
from sd2core.progress import silent
from sd2core.recording.recording import Recording


@pytest.fixture(scope="module")
def body(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The bundled body in motion for two seconds, without a person for a fifth of one."""
    mesh = load_mesh(resource_path("swipes.sd2") / "mesh.zarr").between(30, 90)
    there = np.ones(60, bool)
    there[20:26] = False
    path = tmp_path_factory.mktemp("bodies") / "body.npz"
    save_mesh(type(mesh)(mesh.vertices, mesh.faces, mesh.timebase, present=there), path)
    return path


def test_a_wrist_moves_and_gravity_is_read(sd2: Sd2, body: Path, tmp_path: Path) -> None:
    out = tmp_path / "wrist.csv"
    told = sd2("imu", body, "--at", "right-wrist", "--out", out)
    assert told.code == 0, told.err
    assert told.out.startswith(f"{out} (simulated)")
    assert "of which 23 without a body are empty" in told.out
    signals = read_signals(out)
    assert signals.rate_hz == pytest.approx(100.0)
    assert signals.times_s[0] == pytest.approx(1.0)  # on the mesh's own clock
    unknown_s = signals.times_s[~signals.known]
    assert 1.0 + 19 / 30 < unknown_s.min() < unknown_s.max() < 1.0 + 26 / 30
    lengths = np.linalg.norm(signals.acceleration_mps2[signals.known], axis=1)
    assert np.median(lengths) == pytest.approx(9.81, abs=0.5)
    text = out.read_text(encoding="utf-8")
    assert "# axes: x along the bone" in text
    assert "# cutoff_hz: 6.0" in text


@pytest.mark.slow
def test_every_option_changes_what_it_says(sd2: Sd2, body: Path, tmp_path: Path) -> None:
    def made(*options: object) -> np.ndarray:
        out = tmp_path / "one.npz"
        told = sd2("imu", body, "--at", "right-hand", "--out", out, "--overwrite", *options)
        assert told.code == 0, told.err
        signals = read_signals(out)
        return np.hstack([signals.acceleration_mps2, signals.turn_rate_radps])

    ideal = made()
    known = np.isfinite(ideal).all(axis=1)
    lengths = [len(ideal), len(made("--rate", 200))]
    assert lengths == [int(59 / 30 * rate_hz) + 1 for rate_hz in (100, 200)]
    bends = [np.diff(one[:60], n=2, axis=0).std() for one in (ideal, made("--cutoff", 2))]
    assert bends[1] < bends[0] / 2
    flipped = made("--up", "0,1,0")
    np.testing.assert_allclose(flipped[known, 3:], ideal[known, 3:])
    assert not np.allclose(flipped[known, :3], ideal[known, :3], atol=5.0)
    biased = made("--acc-bias", "1,2,3", "--gyr-bias", "-4,0,6")
    np.testing.assert_allclose((biased - ideal)[known], [[1, 2, 3, -4, 0, 6]] * known.sum())
    assert np.abs(made("--acc-range", 8)[known, :3]).max() == 8.0
    assert np.abs(made("--gyr-range", 0.5)[known, 3:]).max() == 0.5
    noise = (made("--acc-noise", 0.01) - ideal)[known]
    assert noise[:, :3].std() == pytest.approx(0.01 * np.sqrt(50), rel=0.1)
    assert (noise[:, 3:] == 0).all()
    other = (made("--gyr-noise", 0.01, "--seed", 1) - made("--gyr-noise", 0.01))[known]
    assert (other[:, 3:] != 0).all()


def test_a_recording_and_a_vertex(sd2: Sd2, body: Path, tmp_path: Path) -> None:
    recording = Recording.create(tmp_path / "a.sd2", mesh=body).folder
    found = []
    for source in (recording, body):
        out = tmp_path / f"{source.stem}-spot.sto"
        told = sd2("imu", source, "--at", 321, "--rate", 30, "--out", out, "--json")
        assert told.code == 0, told.err
        said = json.loads(told.out)
        assert (said["at"], said["simulated"], said["rate_hz"]) == ("vertex 321", True, 30.0)
        assert said["samples"] - said["known_samples"] == 6
        found.append(read_signals(out).acceleration_mps2)
    np.testing.assert_array_equal(*found)


def test_of_several_people_one_is_named(sd2: Sd2, body: Path, tmp_path: Path) -> None:
    recording = Recording.create(tmp_path / "duo.sd2", mesh=body)
    recording.subject = "anna"
    recording.bodies = (Body(str(body), (0.8, 0.0, 0.5), turn_deg=90.0, person="bert"),)
    recording.save()
    out = tmp_path / "wrist.npz"
    command = ("imu", recording.folder, "--at", "right-wrist", "--out", out, "--overwrite")
    for named, said in (((), "shows anna and bert"), (("--person", "carl"), "bert, not carl")):
        refused = sd2(*command, *named)
        assert refused.code == 1
        assert said in refused.err
        assert not out.exists()
    mesh, found = recording.load_mesh(), {}
    for number, name in enumerate(("anna", "bert")):
        assert sd2(*command, "--person", name).code == 0
        found[name] = read_signals(out)
        assert found[name].meta["person"] == name
        alone = virtual_imu(replace(mesh.bodies[number], others=()), "right-wrist")
        np.testing.assert_array_equal(found[name].acceleration_mps2, alone.acceleration_mps2)
    # Turned by 90 degrees, the wrist feels the same along its own axes.
    apart = found["anna"].turn_rate_radps - found["bert"].turn_rate_radps
    assert np.nanmax(np.abs(apart)) < 0.05
    with pytest.raises(Sd2Error, match="shows anna and bert"):
        virtual_imu(mesh, "head")
    # Labels that name nobody do not say whose sensors a data set holds.
    with pytest.raises(Sd2Error, match="shows anna and bert"):
        gather([recording.folder], Making(kinds=("synthetic",), imu=("head",)))[0].load(silent)


def test_who_is_named_is_alone_on_a_map(sd2: Sd2, body: Path, tmp_path: Path) -> None:
    recording = Recording.create(tmp_path / "duo.sd2", mesh=body)
    recording.bodies = (Body(str(body), (0.8, 0.0, 0.5), person="bert"),)
    recording.save()
    out = tmp_path / "bert.npz"
    assert sd2("synth", recording.folder, "--person", "bert", "--out", out).code == 0
    alone = Synthesizer(recording.load_mesh().others[0]).map(recording.sensor)
    np.testing.assert_array_equal(DopplerMap.load(out).values, alone.values)


def test_a_file_of_something_else_is_not_replaced(sd2: Sd2, body: Path, tmp_path: Path) -> None:
    labels = tmp_path / "labels.csv"
    labels.write_text("start_s,end_s,label\n0,1,swipe\n", encoding="utf-8")
    for out in (body, labels):
        before = out.read_bytes()
        told = sd2("imu", body, "--at", "head", "--out", out, "--overwrite")
        assert told.code == 1
        assert "holds no samples of an inertial sensor" in told.err
        assert out.read_bytes() == before
    out = tmp_path / "head.csv"
    out.touch()
    for _ in range(2):  # an empty file, then its own
        assert sd2("imu", body, "--at", "head", "--out", out, "--overwrite").code == 0


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--at", "nose"), "one of head, chest"),
        (("--at", "5000"), "0 to 4999"),
        (("--at", "head", "--cutoff", "20"), "up to 13.5 Hz"),
        (("--at", "head", "--rate", "5"), "12 or more"),
        (("--at", "head", "--up", "0,0,0"), "Upwards is"),
        (("--at", "head", "--seed", "-1"), "a seed of -1"),
    ],
)
def test_what_cannot_be_is_refused_and_nothing_written(
    sd2: Sd2, body: Path, tmp_path: Path, options: tuple[str, ...], words: str
) -> None:
    out = tmp_path / "wrist.csv"
    told = sd2("imu", body, "--out", out, *options)
    assert told.code == 1
    assert words in told.err
    assert not out.exists()
    assert sd2("imu", body, "--at", "head", "--out", tmp_path / "wrist.txt").code == 1
