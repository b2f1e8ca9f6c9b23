"""Campaigns of recorded motion: as recorded, of anybody's shape, turned anyhow, people apart."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sd2core.body.rig import JOINT, JOINTS
from sd2core.body.shape import BodyShape, ShapeSpace
from sd2core.errors import Sd2Error
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.vertex_parts import QUANTITIES
from sd2core.mocap.body_motion import RATE_HZ, BodyMotion, load_motions
from sd2core.pairs.store import Take
from sd2core.sensor import VelocityAxis
from sd2core.simulate.campaign import takes
from sd2core.simulate.campaign.captured import CapturedMotions
from sd2core.simulate.campaign.protocol import PAPER, VARIED
from sd2core.simulate.campaign.radar import TargetOptions, radar_at
from sd2core.simulate.campaign.scene import RANGES_M, random_subject
from sd2core.simulate.campaign.takes import Campaign, TakeMaker

SPACE = ShapeSpace()
SWINGS_HZ = {"ann": 0.5, "bob": 1.5}
WALKS_MPS = 1.0
SECONDS = {"ann": 12.0, "bob": 5.0}


def recorded(person: str, role: str = "learn") -> BodyMotion:
    """Somebody who walks ahead and swings an arm at a rate of their own."""
    times_s = np.arange(round(SECONDS[person] * RATE_HZ)) / RATE_HZ
    vectors = np.zeros((len(times_s), len(JOINTS), 3))
    vectors[:, JOINT["shoulder.R"], 0] = 0.6 * np.sin(2 * np.pi * SWINGS_HZ[person] * times_s)
    way_m = np.zeros((len(times_s), 3))
    way_m[:, 2] = -WALKS_MPS * times_s
    shape = BodyShape(np.zeros(len(SPACE)), 1.7)
    return BodyMotion(f"{person}-{role}", person, role, shape, vectors, way_m, 0.01)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def motions(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("motions")
    for person in SWINGS_HZ:
        recorded(person).save(folder / f"{person}.npz")
    recorded("bob", "measure").save(folder / "bob-again.npz")
    return folder


def campaign(motions: Path | None, **more: object) -> Campaign:
    protocol = replace(VARIED, movements="captured")
    told = {"seed": 1, "take_seconds": 2.0, "target": TargetOptions(looks=1), "limbs": True}
    return Campaign(**(told | {"protocol": protocol, "motions": motions} | more))  # type: ignore[arg-type]


def speeds(take: Take) -> np.ndarray:
    """Speed of the trunk in every frame, m/s."""
    assert take.limbs is not None
    assert take.limbs.kinematics is not None
    found: np.ndarray = take.limbs.kinematics[0, QUANTITIES.index("speed_mps")]
    return found


@pytest.mark.one_in(3)
@pytest.mark.parametrize(("number", "person"), [(0, "ann"), (1, "bob"), (2, "ann")])
def test_a_subject_moves_as_one_of_the_people(motions: Path, number: int, person: str) -> None:
    captured = CapturedMotions(motions, "learn", SPACE)
    subject = random_subject(SPACE, 1, number)
    skeleton, times_s = SPACE.skeleton(subject.shape), np.arange(450) / 30.0
    longest = 0
    for seed in range(4):
        rng = np.random.default_rng(seed)
        performed = captured.perform(rng, subject, number, skeleton, times_s)
        rotations, place_m = performed.motion
        frames = len(performed.label)
        longest = max(longest, frames)
        assert len(rotations) == len(place_m) == frames
        assert not performed.label.any()
        # Whoever walks crosses the middle of the room, as fast as their legs and pace are.
        way_m = place_m[:, 2]
        assert way_m.max() == pytest.approx(-way_m.min(), abs=0.02)
        pace = np.abs(np.diff(way_m)).mean() * 30.0 / WALKS_MPS
        scale = subject.shape.stature_m / 1.7
        assert 0.7 < pace / scale < 1.35
        swing = rotations[:, skeleton.index["upperarm01.R"], 1, 2]
        crossings = np.count_nonzero(np.diff(np.sign(swing - swing.mean())))
        rate_hz = 0.5 * crossings / (frames / 30.0)
        assert rate_hz == pytest.approx(SWINGS_HZ[person], rel=0.45)
    assert longest <= 30.0 * SECONDS[person] * 1.25


@pytest.mark.slow
def test_takes_repeat_are_turned_and_keep_away(motions: Path) -> None:
    maker = TakeMaker(campaign(motions))
    made = [maker.make(0, number)[0] for number in range(6)]
    again = TakeMaker(campaign(motions)).make(0, 2)[0]
    assert again.synthetic.tobytes() == made[2].synthetic.tobytes()
    assert again.radar.tobytes() == made[2].radar.tobytes()
    towards = []
    for take in made:
        assert take.radar.any(axis=1).mean() > 0.8
        assert np.median(speeds(take)) == pytest.approx(WALKS_MPS, rel=0.4)
        assert take.limbs is not None
        assert take.limbs.kinematics is not None
        towards.append(float(np.median(take.limbs.kinematics[0, 0])))
    # Some come, some go.
    assert min(towards) < -0.3
    assert max(towards) > 0.3


@pytest.mark.slow
def test_nobody_comes_too_near(motions: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    nearest: list[float] = []

    def noted(mesh: MeshSequence, radar: object, sensor: object, axis: VelocityAxis, *_, **__):
        nearest.append(float(mesh.vertices[:, :, 2].mean(axis=1).min()))
        return np.zeros((mesh.frame_count, axis.bins), np.float32)

    monkeypatch.setattr(takes, "radar_target", noted)  # only where they are is asked
    maker = TakeMaker(campaign(motions, take_seconds=12.0, limbs=False))
    for number in range(3):
        maker.make(0, number)
    assert len(nearest) == 3
    assert min(nearest) > RANGES_M[0] - 0.2


@pytest.mark.slow
def test_both_in_turn_and_radars_drawn(motions: Path) -> None:
    both = replace(VARIED, movements="both")
    maker = TakeMaker(campaign(motions, protocol=both))
    assert maker.make(0, 0)[0].synthetic.tobytes() == (
        TakeMaker(campaign(None, protocol=VARIED)).make(0, 0)[0].synthetic.tobytes()
    )
    captured = maker.make(0, 1)[0]
    assert np.median(speeds(captured)) > 0.5
    drawn = TakeMaker(campaign(motions, protocol=replace(both, drawn_radars=True))).make(0, 1)[0]
    assert drawn.synthetic.tobytes() == captured.synthetic.tobytes()
    assert drawn.radar.tobytes() != captured.radar.tobytes()
    usual, rng = TargetOptions(), np.random.default_rng(0)
    radars = [usual.drawn(rng) for _ in range(40)]
    assert {radar.looks for radar in radars} == {1, 2, 4, 8, 12}
    assert {radar.smooth for radar in radars} == {True, False}
    noise_db = [radar.link.noise_figure_db for radar in radars if radar.link is not None]
    assert min(noise_db) < 6.0
    assert max(noise_db) > 18.0


def test_only_who_paces_needs_frames_that_fit_the_gait(motions: Path) -> None:
    asked = {"radar": radar_at(25.0, 32)}
    for others in (campaign(motions, **asked), campaign(None, protocol=PAPER, **asked)):
        assert len(TakeMaker(others).make(0, 1)[0].times_s) == 50
    for protocol in (VARIED, replace(VARIED, movements="both")):
        with pytest.raises(Sd2Error, match=r"25 frames/s.*240 is a multiple of.*--rate 24"):
            campaign(motions if protocol != VARIED else None, protocol=protocol, **asked)


def test_a_campaign_of_before_says_what_it_said() -> None:
    assert "smooth" not in Campaign().provenance()["target"]
    assert set(Campaign(protocol=PAPER).provenance()["protocol"]) == {
        "name", "order", "place", "heading", "others",
    }  # fmt: skip
    said = Campaign(protocol=replace(VARIED, drawn_radars=True)).provenance()["protocol"]
    assert (said["name"], said["drawn_radars"]) == ("varied", True)


def test_what_is_missing_is_said(motions: Path, tmp_path: Path) -> None:
    with pytest.raises(Sd2Error, match=r"Movements captured.*from None.*--motions"):
        campaign(None)
    with pytest.raises(Sd2Error, match=r"Movements swipes.*captured or both"):
        campaign(motions, protocol=VARIED)
    with pytest.raises(Sd2Error, match=r"holds no recorded motion to calibrate of 3\.1 s"):
        TakeMaker(campaign(motions, role="calibrate"))
    (tmp_path / "broken.npz").write_bytes(b"PK")
    with pytest.raises(Sd2Error, match=r"broken\.npz"):
        load_motions(tmp_path, "learn")
    np.savez(tmp_path / "broken.npz", other=np.zeros(3))
    with pytest.raises(Sd2Error, match=r"broken\.npz holds no body's motion.*drive"):
        load_motions(tmp_path, "learn")
