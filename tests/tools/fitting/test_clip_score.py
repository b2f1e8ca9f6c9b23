from __future__ import annotations

import csv
import math
from dataclasses import replace

import numpy as np
import pytest
from known_clip import STROKES, TIMES, standing, waving, write_clip

from sd2core.body.limbs import LIMBS, vertex_limbs
from sd2core.body.model import Body
from sd2core.compare.joints import JOINTS, own_patches
from sd2core.compare.measures import line_of_sight_velocity, rms
from sd2core.errors import Sd2Error
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.velocity_uncertainty import VelocityUncertainty
from tools.fitting.clip_score import LIMBS as MEASURED
from tools.fitting.clip_score import ClipScore, coverage, score_clip
from tools.fitting.report import Row, as_csv, as_markdown, reach_rows
from tools.fitting.truth import Truth, read_truth


@pytest.fixture(scope="module")
def truth(tmp_path_factory: pytest.TempPathFactory) -> Truth:
    return read_truth(write_clip(tmp_path_factory.mktemp("truth") / "wave", waving()))


@pytest.fixture(scope="module")
def still(tmp_path_factory: pytest.TempPathFactory) -> Truth:
    return read_truth(write_clip(tmp_path_factory.mktemp("truth") / "still", standing(), "still"))


def moved(mesh: MeshSequence, by: np.ndarray) -> MeshSequence:
    return replace(mesh, vertices=mesh.read(0, mesh.frame_count) + by)


def row(scores: list[ClipScore], what: str) -> Row:
    (found,) = (one for one in reach_rows(scores) if what in one.what)
    return found


def test_the_truth_itself_is_perfect(truth: Truth) -> None:
    score = score_clip(truth, truth.mesh(), seconds=7.2)
    assert [one.stroke.label for one in score.strokes] == [one["label"] for one in STROKES]
    for stroke in score.strokes:
        for limb in MEASURED:
            pair = stroke.velocity[limb]
            assert (pair.error, pair.correlation, pair.peak_kept) == (0.0, 1.0, 1.0)
        assert stroke.tempo.peak_kept == 1.0
        assert stroke.map_difference == 0.0
        assert stroke.map_total > 0.0
    assert score.distance_m.max() == score.map_l1 == 0.0
    assert score.seconds_per_frame == pytest.approx(0.2)
    assert score.sigma is None
    unmet = [one.what for one in reach_rows([score]) if one.met is False]
    assert unmet == ["time for a fit"]


def test_strokes_hold_the_hand_that_makes_them(truth: Truth) -> None:
    score = score_clip(truth, truth.mesh())
    joints = own_patches("low").positions(truth.mesh().read(0, len(TIMES)))
    velocity = line_of_sight_velocity(joints, TIMES)[:, JOINTS.index("hand.R")]
    frames = (TIMES >= 0.3) & (TIMES < 0.6)
    np.testing.assert_allclose(score.strokes[0].velocity["hand"].truth, velocity[frames], atol=1e-6)
    assert rms(velocity[frames]) > 0.3


def test_a_drift_is_an_error_of_velocity(truth: Truth) -> None:
    drift = -0.1 * TIMES[:, None, None] * np.array([0.0, 0.0, 1.0])
    score = score_clip(truth, moved(truth.mesh(), drift))
    assert score.velocity.error == pytest.approx(0.1, rel=0.06)
    joints = own_patches("low").positions(truth.mesh().read(0, len(TIMES)))
    hand = joints[:, JOINTS.index("hand.R")]
    cosine = hand[:, 2] / np.linalg.norm(hand, axis=1)
    for stroke in score.strokes:
        during = (stroke.stroke.start_s <= TIMES) & (stroke.stroke.end_s > TIMES)
        assert stroke.velocity["hand"].error == pytest.approx(0.1 * rms(cosine[during]), rel=0.06)
        assert stroke.velocity["hand"].correlation > 0.99
    assert score.distance_m == pytest.approx((0.1 * TIMES).mean(), rel=1e-3)


def test_half_the_motion_keeps_half_the_peak(truth: Truth) -> None:
    mesh = truth.mesh()
    rest = mesh.frame(0)
    half = replace(mesh, vertices=rest + 0.5 * (mesh.read(0, mesh.frame_count) - rest))
    scores = [score_clip(truth, half)]
    assert row(scores, "peak hand speed kept, in space").value == pytest.approx(0.5, abs=0.01)
    kept = row(scores, "peak hand speed kept, along")
    # Smaller arcs point elsewhere, too.
    assert kept.value == pytest.approx(0.5, abs=0.08)
    assert kept.met is False
    assert row(scores, "hands during gestures, line-of-sight velocity: RMS").value > 0.1
    assert row(scores, "Doppler map of the gestures").value > 0.3


def test_motion_of_who_stands_still_is_false(still: Truth) -> None:
    """Noise of 0.5 mm along the line of sight: √2 · 0.5 mm · 15 Hz over the inner frames."""
    noise = np.random.default_rng(0).normal(scale=0.0005, size=(len(TIMES), 1229, 1))
    score = score_clip(still, moved(still.mesh(), noise * np.array([0.0, 0.0, 1.0])))
    inner, ends = math.sqrt(2) * 0.0005 * 15.0, math.sqrt(2) * 0.0005 * 30.0
    expected = math.sqrt((34 * inner**2 + 2 * ends**2) / 36)
    # Seen at an angle of up to 20 degrees, hence a little less.
    assert score.vertex_velocity_mps == pytest.approx(expected, rel=0.06)
    assert score.strokes == ()
    assert row([score], "who stands still").met is True


def test_artefacts_at_the_ends_are_seen(truth: Truth) -> None:
    shake = np.full((len(TIMES), 1, 3), 0.001) * np.array([0, 0, 1.0])
    shake[::2] *= -1
    calm = score_clip(truth, moved(truth.mesh(), shake))
    # The very first and last velocities are differences over half the time.
    assert row([calm], "ends over the middle, place").value == pytest.approx(1.0, abs=0.01)
    shake[:5] *= 4
    shake[-5:] *= 4
    wild = score_clip(truth, moved(truth.mesh(), shake))
    ratio = row([wild], "ends over the middle, place")
    assert ratio.value == pytest.approx(4.0, abs=0.05)
    assert ratio.met is False


@pytest.mark.parametrize(("factor", "covered"), [(1.2, 1.0), (0.8, 0.0)])
def test_sigma_covers_what_it_is_larger_than(truth: Truth, factor: float, covered: float) -> None:
    drift = -0.1 * TIMES[:, None, None] * np.array([0.0, 0.0, 1.0])
    sigma = np.full((len(TIMES), len(LIMBS)), 0.1 * factor, np.float32)
    known = VelocityUncertainty(LIMBS, vertex_limbs(Body.load("low")), sigma, sigma)
    score = score_clip(truth, replace(moved(truth.mesh(), drift), uncertainty=known))
    assert score.sigma is not None
    assert coverage(score.sigma.truth, score.sigma.fitted) == pytest.approx(covered, abs=0.02)
    assert row([score], "1σ of the velocity covers").met is False


def test_frames_without_a_person_are_left_out(truth: Truth) -> None:
    there = np.ones(len(TIMES), bool)
    there[20:] = False
    score = score_clip(truth, replace(truth.mesh(), present=there))
    joints = own_patches("low").positions(truth.mesh().read(0, 20))
    moving = np.sqrt((line_of_sight_velocity(joints, TIMES[:20]) ** 2).mean(axis=0)) >= 0.1
    assert 0 < moving.sum() < len(JOINTS)
    assert score.velocity.truth.size == 20 * moving.sum()
    assert [len(one.velocity["hand"].truth) for one in score.strokes] == [9, 2]


def test_another_surface_is_refused(truth: Truth) -> None:
    other = truth.mesh()
    with pytest.raises(Sd2Error, match="no surface of SD² Studio"):
        score_clip(truth, replace(other, faces=other.faces[::-1].copy()))


def test_a_range_is_met_inside_only() -> None:
    for value, met in ((0.59, False), (0.6, True), (0.75, True), (0.76, False), (math.nan, None)):
        assert Row("", value, least=0.6, most=0.75).met is met
    assert Row("", 0.25, most=0.25).met is True


def test_the_tables_say_the_same_in_every_form(truth: Truth, still: Truth) -> None:
    scores = [score_clip(one, one.mesh()) for one in (truth, still)]
    markdown = as_markdown(scores)
    assert sum(f"| {one.what} | " in markdown for one in reach_rows(scores)) > 10
    for stroke in STROKES:
        assert f"| {stroke['label']} | all | 1 |" in markdown
    rows = [line for line in markdown.splitlines() if line.startswith("|")]
    assert len({line.count("|") for line in rows}) == 3
    clips = list(csv.DictReader(as_csv(scores).splitlines()))
    assert [one["clip"] for one in clips] == ["wave", "still"]
    medians = next(line for line in rows if line.startswith("| gestures"))
    assert medians.split(" | ")[1:3] == ["1", f"{float(clips[0]['joints (m)']):.2g}"]


def test_nothing_to_score_is_no_figure() -> None:
    assert all(one.met is None for one in reach_rows([]))
