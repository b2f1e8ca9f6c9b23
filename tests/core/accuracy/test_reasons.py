"""Every reason on a scene built to require just that, and on one that does not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from accuracy_scenes import FPS, FRAMES, ball, moving, plate, steady, swinging, together

from sd2core.accuracy.choosing import choose
from sd2core.accuracy.plans import counting_plans
from sd2core.accuracy.reasons import reasons_for
from sd2core.accuracy.results import Choice, Reason
from sd2core.accuracy.survey import survey_scene
from sd2core.doppler import PRESETS
from sd2core.mesh.sequence import MeshSequence
from sd2core.sensor import VirtualSensor

CAMERA = VirtualSensor()
PAPER = PRESETS["paper"]
TOLERANCE = 0.02


def chosen(mesh: MeshSequence, tolerance: float = TOLERANCE) -> Choice:
    choice = choose(mesh, CAMERA, tolerance=tolerance)
    assert choice.holds, choice.summary
    assert choice.errors.l1 <= tolerance
    return choice


def reason(choice: Choice, setting: str) -> Reason:
    return next(reason for reason in choice.reasons if reason.setting == setting)


APPROACHING = steady((0, 0, 6), (0, 0, -0.9))


def test_a_body_half_behind_a_plate_requires_occlusion() -> None:
    scene = together(ball(APPROACHING), plate((0.25, 0, 1), 0.5, 0.5))
    choice = chosen(scene)
    found = reason(choice, "occlusion")
    assert found.modelled
    assert found.value > 0.3
    assert choice.plan.visibility in ("depth", "exact")
    assert "%" in found.text


def test_there_are_reasons_for_every_plan() -> None:
    survey = survey_scene(ball(APPROACHING, fineness=2), CAMERA, PAPER)
    errors = survey.trial.errors(survey.base)
    for plan in counting_plans(vertices_kept=survey.trial.vertices_kept):
        assert reasons_for(survey, plan, {plan: errors}, tolerance=0.9)


@pytest.mark.slow
def test_a_lone_sphere_does_not_require_occlusion() -> None:
    # Fine, because the facing test and the true rim differ by up to a facet.
    choice = chosen(ball(APPROACHING, fineness=5), 0.03)
    found = reason(choice, "occlusion")
    assert not found.modelled
    assert found.value <= 0.03
    assert choice.plan.visibility == "facing"


def test_a_fast_hand_requires_wrapping() -> None:
    hand = ball(swinging((0.6, 0, 2), 3.0, 1.0), radius_m=0.1)
    choice = chosen(together(ball(swinging((0, 0, 2), 1.0, 0.7)), hand), 0.05)
    found = reason(choice, "aliasing")
    assert found.modelled
    assert choice.plan.beyond == "wrap"
    # Half of the scene's vertices move as 3 m/s |cos|, beyond 2 m/s for arccos(2/3)/(pi/2).
    expected = 0.5 * np.arccos(2 / 3) / (np.pi / 2)
    share = float(found.text.split("%")[0]) / 100
    assert share == pytest.approx(expected, abs=0.1)


@pytest.mark.slow
def test_a_slow_hand_does_not_require_wrapping() -> None:
    found = reason(chosen(ball(swinging((0, 0, 2), 1.5, 0.7))), "aliasing")
    assert not found.modelled
    assert found.value == 0
    assert "no velocity passes 2 m/s" in found.text


def long_rod(middle_m: float, length_m: float) -> MeshSequence:
    """A rod along the line of sight that points slightly away from it."""
    rod = trimesh.creation.box((0.05, 0.05, length_m)).subdivide().subdivide().subdivide()
    rod.apply_transform(trimesh.transformations.rotation_matrix(0.4, (0, 1, 0)))
    # It turns about its middle, so that near and far parts have other velocities.
    times_s = np.arange(FRAMES) / FPS
    angle = 0.5 * np.sin(2 * np.pi * 0.5 * times_s)
    x, y, z = np.asarray(rod.vertices).T
    turned = np.stack(
        [
            np.cos(angle)[:, None] * x + np.sin(angle)[:, None] * z,
            np.broadcast_to(y, (FRAMES, len(y))),
            -np.sin(angle)[:, None] * x + np.cos(angle)[:, None] * z,
        ],
        axis=2,
    )
    still = moving(rod, steady((0, 0, middle_m), (0, 0, 0)))
    vertices = (turned + np.array([0, 0, middle_m])).astype(np.float32)
    return replace(still, vertices=vertices)


def test_a_long_body_near_the_sensor_requires_the_range_law() -> None:
    choice = chosen(long_rod(1.2, 1.0), 0.05)
    found = reason(choice, "range_law")
    assert found.modelled
    assert found.value > 0.05
    assert choice.plan.range_law == "vertex"


@pytest.mark.slow
def test_a_small_body_far_away_does_not_require_the_range_law() -> None:
    scene = ball(APPROACHING, radius_m=0.005)
    survey = survey_scene(scene, CAMERA, PAPER)
    # What there is to save is a few per cent, less than a busy machine lets one tell.
    by_frame = replace(survey.base, range_law="frame")
    survey.count_ms.update(dict.fromkeys(survey.count_ms, 1.0) | {by_frame: 0.5})
    survey.mask_ms.update(dict.fromkeys(survey.mask_ms, 0.0))
    choice = choose(scene, CAMERA, tolerance=0.1, survey=survey)
    assert choice.holds
    found = reason(choice, "range_law")
    assert not found.modelled
    assert found.value < TOLERANCE
    assert choice.plan.range_law == "frame"


@pytest.mark.slow
def test_a_quick_to_and_fro_requires_a_higher_frame_rate() -> None:
    choice = chosen(ball(swinging((0, 0, 2), 1.5, 3.0)), 0.1)
    found = reason(choice, "motion")
    assert found.modelled
    assert choice.plan.frame_rate_factor > 1


@pytest.mark.slow
def test_uniform_motion_does_not_require_a_higher_frame_rate() -> None:
    choice = chosen(ball(APPROACHING))
    found = reason(choice, "motion")
    assert not found.modelled
    assert found.value < TOLERANCE
    assert choice.plan.frame_rate_factor == 1


@pytest.mark.slow
def test_passing_behind_a_picket_fence_requires_a_mask_for_each_frame() -> None:
    pickets = [plate((x, 0, 1.0), 0.02, 1.0) for x in np.arange(-1.0, 1.0, 0.04)]
    scene = together(ball(steady((-1.5, 0, 3), (0.8, 0, -0.5))), *pickets)
    choice = chosen(scene)
    found = reason(choice, "mask_age")
    assert found.modelled
    assert choice.plan.mask_stride == 1


@pytest.mark.slow
def test_a_still_plate_over_a_calm_body_lets_masks_grow_old() -> None:
    scene = together(ball(APPROACHING, frames=120), plate((0.25, 0, 1), 0.5, 0.5, frames=120))
    choice = chosen(scene, 0.05)
    found = reason(choice, "mask_age")
    assert not found.modelled
    assert choice.plan.mask_stride > 1


def test_still_surroundings_are_not_modelled() -> None:
    scene = together(ball(APPROACHING, fineness=3), plate((1.5, 0, 3), 0.5, 0.5))
    found = reason(chosen(scene), "static")
    still = 1 - 642 / scene.vertex_count
    assert not found.modelled
    assert found.value == pytest.approx(still, abs=1e-6)


@pytest.mark.slow
def test_where_all_moves_all_is_modelled() -> None:
    found = reason(chosen(ball(APPROACHING)), "static")
    assert found.modelled
    assert found.value == 0


@pytest.mark.slow
def test_a_fine_plain_surface_does_not_require_all_vertices() -> None:
    choice = chosen(ball(APPROACHING, fineness=5), 0.05)
    found = reason(choice, "geometry")
    assert not found.modelled
    assert choice.plan.vertices_kept < 1


def test_a_coarse_body_requires_all_vertices() -> None:
    blocks = [
        ball(swinging((x, 0, 3), 1.8, 0.3 + 0.2 * x * x), radius_m=0.02, fineness=0)
        for x in np.linspace(-1, 1, 12)
    ]
    choice = chosen(together(*blocks), 0.05)
    found = reason(choice, "geometry")
    assert found.modelled
    assert choice.plan.vertices_kept == 1


def test_what_moves_of_several_people_is_told_of_all_of_them() -> None:
    """Beside somebody who stands still, nobody's vertices were said to leave the nulled bins."""
    still = ball(steady((0, 0, 3), (0, 0, 0)), fineness=2)
    hand = ball(swinging((0.6, 0, 2), 3.0, 1.0), fineness=2)
    choice = choose(replace(still, others=(hand,)), CAMERA, tolerance=0.05)
    assert reason(choice, "static").value == pytest.approx(0.5)
    assert reason(choice, "aliasing").modelled
