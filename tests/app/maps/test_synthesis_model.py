"""The synthetic map without a window: order of work, quality, interruption."""

from __future__ import annotations

import shlex
import threading
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
from fake_accuracy import COUNTING, EXACT, FACING, FakeAccuracy
from fake_denoisers import FakeDenoisers
from swinging_recordings import recording
from window_models import build_models

from sd2app.command_line import main as run
from sd2app.maps import model as map_model
from sd2app.maps import quality as map_quality
from sd2app.maps.partial_map import FINAL, PREVIEW
from sd2app.settings import Settings
from sd2app.shell.parts import Parts
from sd2core.accuracy.plans import AccuracyPlan
from sd2core.accuracy.trial import synthesizer_for
from sd2core.doppler.options import PRESETS
from sd2core.doppler.synthesizer import Synthesizer
from sd2core.errors import Sd2Error
from sd2core.files.recording_json import MeshReading
from sd2core.files.resources import resource_path
from sd2core.io.mesh import load_mesh
from sd2core.maps import CellUncertainty, DopplerMap
from sd2core.mesh.things import Thing
from sd2core.mesh.walls import Wall
from sd2core.sensor import Beam, VirtualSensor


@pytest.fixture(scope="module")
def ball(tmp_path_factory):
    path = tmp_path_factory.mktemp("ball") / "ball.npz"
    shape = trimesh.creation.icosphere(subdivisions=2, radius=0.3)
    times_s = np.arange(90) / 30
    vertices = np.repeat(shape.vertices[None], 90, axis=0)
    vertices[:, :, 2] += 2 + 0.2 * np.sin(2 * np.pi * times_s)[:, None]
    np.savez(path, vertices=vertices, faces=shape.faces, times_s=times_s)
    return path


@pytest.fixture
def fake():
    return FakeAccuracy()


@pytest.fixture
def context(qapp, compiled_kernels, fake):
    from PySide6.QtCore import QObject

    parent = QObject()
    context = build_models(
        parent,
        Settings.forgetful(),
        Parts(accuracy=fake.library, denoisers=FakeDenoisers().library),
    )
    yield context
    fake.gate.set()
    context.close()
    parent.deleteLater()


def open_ball(context, qtbot, ball):
    with qtbot.waitSignal(context.document.opened, timeout=10_000):
        context.document.open([ball])


def test_rough_comes_before_exact(context, qtbot, ball):
    ranks = [np.zeros(len(load_mesh(ball).times_s), int)]

    def note(part) -> None:
        ranks.append(ranks[-1].copy())
        ranks[-1][part.start : part.stop] = part.quality

    context.synthesis.painted.connect(note)
    open_ball(context, qtbot, ball)
    qtbot.waitUntil(lambda: context.synthesis.complete, timeout=10_000)
    assert (ranks[1] == PREVIEW).all()
    assert (ranks[-1] == FINAL).all()
    lowest = [quality.min() for quality in ranks]
    assert lowest == sorted(lowest)


def test_the_map_is_that_of_the_library(context, qtbot, ball):
    open_ball(context, qtbot, ball)
    qtbot.waitUntil(lambda: context.synthesis.complete, timeout=10_000)
    expected = Synthesizer(load_mesh(ball), "paper").map(context.sensor.sensor)
    np.testing.assert_allclose(context.synthetic.map.values, expected.values, atol=1e-7)
    assert context.synthetic.map.unit == expected.unit


def test_every_sweep_of_a_fast_hand_is_for_one_placement(context, qtbot, ball):
    open_ball(context, qtbot, ball)
    qtbot.waitUntil(lambda: context.synthesis.complete, timeout=10_000)
    shown = []
    context.synthesis.painted.connect(lambda part: shown.append(part.sensor))
    context.edits.begin_sensor_drag()
    for step in range(200):
        context.edits.drag_sensor((step * 0.005, 0.0, 0.0))
        qtbot.wait(1)
    qtbot.waitUntil(lambda: not context.synthesis.busy, timeout=5_000)
    places = [sensor.position_m[0] for sensor in shown]
    assert len(places) > 10
    assert places == sorted(places)
    assert places[-1] == pytest.approx(199 * 0.005)
    context.edits.end_drag()
    qtbot.waitUntil(lambda: context.synthesis.complete, timeout=10_000)
    assert context.document.undo_stack.count() == 1


def test_a_sweep_need_not_wait_for_what_is_made_of_the_one_before(
    context, qtbot, ball, monkeypatch
):
    open_ball(context, qtbot, ball)
    qtbot.waitUntil(lambda: context.synthesis.complete, timeout=10_000)
    shown, swept, answer = [], [], threading.Event()

    def slowly(part):
        assert answer.wait(10)
        return None, None, part.sensor.position_m[0]  # the first are of the two denoisers

    def counted(self, sensor, *args, _stretch=Synthesizer.stretch, **options):
        swept.append(sensor.position_m[0])
        return _stretch(self, sensor, *args, **options)

    monkeypatch.setattr(Synthesizer, "stretch", counted)
    context.synthesis.postprocess = lambda: slowly
    context.synthesis._rest.setInterval(60_000)  # the hand does not rest, however slow the machine
    context.synthesis.painted.connect(lambda part: shown.append((part.sensor.position_m[0], part)))
    context.edits.begin_sensor_drag()
    for x_m in (0.1, 0.2):
        context.edits.drag_sensor((x_m, 0.0, 0.0))
        qtbot.waitUntil(lambda x_m=x_m: x_m in swept, timeout=10_000)
    assert shown == []  # both maps of a place come together
    answer.set()
    qtbot.waitUntil(lambda: not context.synthesis.busy, timeout=10_000)
    assert [(x_m, part.more[2]) for x_m, part in shown] == [(0.1, 0.1), (0.2, 0.2)]
    context.edits.end_drag()


def test_a_hand_that_holds_still_gets_the_exact_map(context, qtbot, ball):
    open_ball(context, qtbot, ball)
    qtbot.waitUntil(lambda: context.synthesis.complete, timeout=10_000)
    context.edits.begin_sensor_drag()
    context.edits.drag_sensor((0.2, 0.0, 0.0))
    qtbot.waitUntil(lambda: not context.synthesis.complete, timeout=5_000)
    qtbot.waitUntil(lambda: context.synthesis.complete, timeout=10_000)
    assert context.sensor.dragging
    context.edits.drag_sensor((0.3, 0.0, 0.0))
    qtbot.waitUntil(lambda: not context.synthesis.complete, timeout=5_000)
    context.edits.end_drag()


def test_another_recording_replaces_work_under_way(context, qtbot, ball, tmp_path):
    still = tmp_path / "still.npz"
    with np.load(ball) as data:
        np.savez(still, vertices=np.repeat(data["vertices"][:1], 5, axis=0), faces=data["faces"])
    open_ball(context, qtbot, ball)
    with qtbot.waitSignal(context.document.opened, timeout=10_000):
        context.document.open([still])
    qtbot.waitUntil(lambda: context.synthesis.complete, timeout=10_000)
    assert context.synthetic.map.values.shape == (32, 5)
    assert context.synthetic.map.values.max() == 0


@pytest.mark.slow
def test_without_machine_code_exact_waits_for_the_compiler(context, qtbot, ball, monkeypatch):
    state = {"ready": False, "exit": None, "compiled": (0, 11)}
    compiler = SimpleNamespace(poll=lambda: state["exit"], terminate=lambda: None)
    asked = []
    for module in (map_quality, map_model):
        monkeypatch.setattr(module, "kernels_ready", lambda: state["ready"])
    monkeypatch.setattr(map_quality, "kernels_compiled", lambda: state["compiled"])
    monkeypatch.setattr(
        map_quality, "compile_in_background", lambda: asked.append(True) or compiler
    )
    open_ball(context, qtbot, ball)
    qtbot.waitUntil(lambda: "compiling" in context.synthetic.status, timeout=10_000)
    assert not context.synthesis.complete
    assert asked

    def compiling():
        return [(job.done, job.total) for job in context.jobs.jobs if "Compiling" in job.title]

    for done in (0, 4):
        state["compiled"] = (done, 11)
        qtbot.waitUntil(lambda: compiling() == [state["compiled"]], timeout=10_000)
    state.update(ready=True, exit=0)
    qtbot.waitUntil(lambda: not compiling(), timeout=10_000)
    qtbot.waitUntil(lambda: context.synthesis.complete, timeout=10_000)
    qtbot.waitUntil(lambda: context.synthetic.status == "±0 %", timeout=10_000)


def test_a_compiler_that_fails_does_not_keep_exact_away(context, qtbot, ball, monkeypatch):
    compiler = SimpleNamespace(poll=lambda: 1)
    for module in (map_quality, map_model):
        monkeypatch.setattr(module, "kernels_ready", lambda: False)
    monkeypatch.setattr(map_quality, "compile_in_background", lambda: compiler)
    open_ball(context, qtbot, ball)
    qtbot.waitUntil(lambda: context.synthesis.complete, timeout=30_000)


def test_levels_keep_their_reference_until_asked(context, qtbot, ball):
    open_ball(context, qtbot, ball)
    qtbot.waitUntil(lambda: context.synthesis.complete, timeout=10_000)
    reference = context.synthetic.reference
    assert reference > 0
    context.edits.begin_sensor_drag()
    context.edits.drag_sensor((0.0, 0.0, -5.0))
    context.edits.end_drag()
    qtbot.waitUntil(lambda: context.synthesis.complete, timeout=10_000)
    assert context.synthetic.reference == reference
    context.edits.set_references(context.session.maps.strongest(), by_hand=False)
    assert context.synthetic.reference < reference


# --- plans --------------------------------------------------------------------------------


def of_plan(ball, plan, sensor=None):
    mesh = load_mesh(ball)
    return (
        synthesizer_for(plan, mesh, Synthesizer(mesh).options).map(sensor or VirtualSensor()).values
    )


def wait_until_done(context, qtbot):
    qtbot.waitUntil(
        lambda: context.synthesis.complete and not context.synthesis.busy and not context.jobs.jobs,
        timeout=10_000,
    )


@pytest.mark.parametrize(
    "plan",
    [
        FACING,
        AccuracyPlan(mask_stride=5),
        AccuracyPlan(vertices_kept=0.5),
        AccuracyPlan(frame_rate_factor=2),
    ],
)
def test_the_plan_in_use_is_carried_out(context, fake, qtbot, ball, plan):
    fake.plan, fake.error = plan, 0.008
    open_ball(context, qtbot, ball)
    wait_until_done(context, qtbot)
    np.testing.assert_allclose(context.synthetic.map.values, of_plan(ball, plan), atol=1e-7)
    assert context.synthetic.status == "±0.8 %"


def test_a_recording_opens_with_a_rough_map_while_the_plan_is_chosen(context, fake, qtbot, ball):
    fake.gate.clear()
    open_ball(context, qtbot, ball)
    qtbot.waitUntil(lambda: context.trade.choosing, timeout=10_000)
    assert context.synthetic.map is not None
    assert context.synthetic.covered is None
    assert context.synthetic.status == "preview: vertices facing the sensor"
    assert not context.synthesis.complete
    fake.gate.set()
    wait_until_done(context, qtbot)


def test_another_plan_replaces_the_map_without_a_gap(context, fake, qtbot, ball):
    fake.plans[0.1] = FACING
    open_ball(context, qtbot, ball)
    wait_until_done(context, qtbot)
    before, shown = context.synthetic.map.values.copy(), []
    context.synthetic.changed.connect(
        lambda: shown.append((context.synthetic.covered, context.synthetic.map.values.copy()))
    )
    context.trade.set_tolerance(0.1)
    qtbot.waitUntil(lambda: context.trade.in_use.plan == FACING, timeout=10_000)
    wait_until_done(context, qtbot)
    after = of_plan(ball, FACING)
    assert shown
    for covered, values in shown:
        assert covered is None
        # Every column is the old plan's or the new one's.
        old = np.isclose(values, before, atol=1e-7).all(axis=0)
        new = np.isclose(values, after, atol=1e-7).all(axis=0)
        assert (old | new).all()
    np.testing.assert_allclose(context.synthetic.map.values, after, atol=1e-7)


def test_a_clicked_plan_is_carried_out_and_the_tolerance_brings_the_other_back(
    context, fake, qtbot, ball
):
    open_ball(context, qtbot, ball)
    wait_until_done(context, qtbot)
    context.trade.use(COUNTING[0])
    wait_until_done(context, qtbot)
    np.testing.assert_allclose(context.synthetic.map.values, of_plan(ball, FACING), atol=1e-7)
    context.trade.choose_by_tolerance()
    wait_until_done(context, qtbot)
    np.testing.assert_allclose(context.synthetic.map.values, of_plan(ball, EXACT), atol=1e-7)


def test_a_new_place_first_gets_the_plan_in_use_and_then_a_choice_of_its_own(
    context, fake, qtbot, ball
):
    open_ball(context, qtbot, ball)
    wait_until_done(context, qtbot)
    there = VirtualSensor(position_m=(0.4, 0.0, 0.0))
    fake.plan = FACING
    plans = []
    context.synthesis.completed.connect(lambda: plans.append(context.trade.in_use.plan))
    context.edits.place_sensor(there)
    qtbot.waitUntil(lambda: len(plans) == 2, timeout=10_000)
    assert plans == [EXACT, FACING]
    np.testing.assert_allclose(
        context.synthetic.map.values, of_plan(ball, FACING, there), atol=1e-7
    )


def test_a_place_that_was_left_comes_back_without_being_computed(context, qtbot, ball, monkeypatch):
    open_ball(context, qtbot, ball)
    wait_until_done(context, qtbot)
    before = context.synthetic.map.values.copy()
    context.edits.place_sensor(VirtualSensor(position_m=(0.4, 0.0, 0.0)))
    wait_until_done(context, qtbot)
    assert not np.array_equal(context.synthetic.map.values, before)
    made, completed, stretch = [], [], Synthesizer.stretch

    def counted(*arguments, **more):
        made.append(1)
        return stretch(*arguments, **more)

    monkeypatch.setattr(Synthesizer, "stretch", counted)
    context.synthesis.completed.connect(lambda: completed.append(1))
    context.document.undo_stack.undo()
    assert context.synthesis.complete
    assert (made, completed) == ([], [1])
    np.testing.assert_array_equal(context.synthetic.map.values, before)


def test_what_was_kept_of_a_mesh_is_not_shown_of_one_that_differs_in_a_few_frames(
    context, qtbot, ball
):
    usual = context.sensor.sensor
    open_ball(context, qtbot, ball)
    wait_until_done(context, qtbot)
    context.edits.place_sensor(VirtualSensor(position_m=(0.4, 0.0, 0.0)))
    wait_until_done(context, qtbot)
    mended = dict(np.load(ball))
    mended["vertices"][10:30, :, 2] += 0.1
    np.savez(ball.with_name("mended.npz"), **mended)
    open_ball(context, qtbot, ball.with_name("mended.npz"))
    context.edits.place_sensor(usual)
    wait_until_done(context, qtbot)
    np.testing.assert_allclose(
        context.synthetic.map.values,
        Synthesizer(load_mesh(ball.with_name("mended.npz")), "paper").map(usual).values,
        atol=1e-7,
    )


def test_work_for_a_place_that_is_left_again_does_not_come_after_what_was_kept(
    context, qtbot, ball, monkeypatch
):
    open_ball(context, qtbot, ball)
    wait_until_done(context, qtbot)
    before, gate, stretch = (
        context.synthetic.map.values.copy(),
        threading.Event(),
        Synthesizer.stretch,
    )

    def slow(*arguments, **more):
        gate.wait(10)
        return stretch(*arguments, **more)

    monkeypatch.setattr(Synthesizer, "stretch", slow)
    context.edits.place_sensor(VirtualSensor(position_m=(0.4, 0.0, 0.0)))
    qtbot.waitUntil(lambda: context.synthesis.busy, timeout=5_000)
    context.document.undo_stack.undo()
    gate.set()
    wait_until_done(context, qtbot)
    assert context.synthesis.shows_sensor
    np.testing.assert_array_equal(context.synthetic.map.values, before)


def test_a_hand_gets_the_plan_for_dragging(context, fake, qtbot, ball):
    fake.dragging = AccuracyPlan(visibility="depth", depth_resolution=128, mask_stride=5)
    open_ball(context, qtbot, ball)
    wait_until_done(context, qtbot)
    qtbot.waitUntil(lambda: context.synthesis._masks_of is not None, timeout=10_000)
    context.edits.begin_sensor_drag()
    assert not context.synthesis.moving  # the hand has hold of it; nothing moves yet
    context.edits.drag_sensor((0.2, 0.0, 0.0))
    assert context.synthesis.moving
    qtbot.waitUntil(lambda: "while dragging" in context.synthetic.status, timeout=5_000)
    assert context.synthetic.status == "while dragging: ±13 %"
    moved = VirtualSensor(position_m=(0.2, 0.0, 0.0))
    np.testing.assert_allclose(
        context.synthetic.map.values, of_plan(ball, fake.dragging, moved), atol=1e-7
    )
    context.edits.end_drag()
    wait_until_done(context, qtbot)
    assert not context.synthesis.moving


def test_masks_are_kept_within_their_reach_and_not_beyond(context, fake, qtbot, ball):
    fake.dragging = AccuracyPlan(mask_reuse_m=0.1)
    open_ball(context, qtbot, ball)
    wait_until_done(context, qtbot)
    qtbot.waitUntil(lambda: context.synthesis._masks_of is not None, timeout=10_000)
    context.edits.begin_sensor_drag()
    for x_m, words in ((0.05, "while dragging: ±13 %"), (0.15, "facing the sensor")):
        context.edits.drag_sensor((x_m, 0.0, 0.0))
        qtbot.waitUntil(lambda words=words: words in context.synthetic.status, timeout=5_000)
    context.edits.end_drag()


def test_a_hand_interrupts_the_choosing(context, fake, qtbot, ball):
    open_ball(context, qtbot, ball)
    wait_until_done(context, qtbot)
    fake.gate.clear()
    begun = len(fake.surveyed) + len(fake.asked)
    context.edits.place_sensor(VirtualSensor(position_m=(0.3, 0.0, 0.0)))
    # What has not begun is dropped, and cannot notice that it is cancelled.
    qtbot.waitUntil(lambda: len(fake.surveyed) + len(fake.asked) > begun, timeout=60_000)
    assert context.trade.choosing
    context.edits.begin_sensor_drag()
    assert not context.trade.choosing
    context.edits.drag_sensor((0.35, 0.0, 0.0))
    qtbot.waitUntil(lambda: bool(fake.cancelled), timeout=60_000)
    fake.gate.set()
    context.edits.end_drag()
    wait_until_done(context, qtbot)
    assert fake.asked[-1][2] == context.sensor.sensor


def test_a_choice_that_fails_leaves_exact_visibility(context, fake, qtbot, ball):
    from sd2core.errors import Sd2Error

    fake.failure = Sd2Error("There is no choice")
    failures = context.shell.warned = []
    open_ball(context, qtbot, ball)
    wait_until_done(context, qtbot)
    assert context.synthetic.status == "exact visibility"
    assert failures == ["There is no choice."]


def test_the_exported_map_is_not_counted_again_and_names_its_plan(
    context, fake, qtbot, ball, tmp_path, monkeypatch
):
    fake.plan, fake.error = AccuracyPlan(mask_stride=5), 0.008
    open_ball(context, qtbot, ball)
    wait_until_done(context, qtbot)
    maker = synthesizer_for(fake.plan, load_mesh(ball), PRESETS["paper"])
    maker.map(context.sensor.sensor).save(tmp_path / "counted.npz")
    counted = DopplerMap.load(tmp_path / "counted.npz")
    callers, stretch = [], Synthesizer.stretch

    def noted(*given, **more):
        callers.append(threading.current_thread())
        return stretch(*given, **more)

    monkeypatch.setattr(Synthesizer, "stretch", noted)
    context.synthesis.export(tmp_path / "map.npz")
    assert threading.main_thread() not in callers  # others prepare masks
    assert len(counted.meta["visible_share"]) == len(counted.times_s)
    saved = DopplerMap.load(tmp_path / "map.npz")
    np.testing.assert_array_equal(saved.values, context.synthetic.map.values)
    np.testing.assert_array_equal(saved.values, counted.values)
    assert {name: saved.meta[name] for name in counted.meta} == counted.meta
    assert repr(saved) == repr(counted)
    plan = saved.meta["plan"]
    assert plan.pop("text") == str(fake.plan)
    assert AccuracyPlan.from_json(plan) == fake.plan
    assert saved.meta["plan_error_l1"] == 0.008


def test_a_map_names_no_error_that_was_measured_from_elsewhere(context, fake, qtbot, ball):
    fake.error = 0.008
    open_ball(context, qtbot, ball)
    wait_until_done(context, qtbot)
    assert context.synthesis.whole_map().meta["plan_error_l1"] == 0.008
    fake.gate.clear()
    context.sensor.set_sensor(VirtualSensor((0.4, 0.0, 0.0)))
    qtbot.waitUntil(lambda: context.synthesis.complete and context.trade.choosing)
    meta = context.synthesis.whole_map().meta
    assert meta["plan"]["text"] == str(fake.plan)
    assert "plan_error_l1" not in meta
    fake.gate.set()
    wait_until_done(context, qtbot)
    assert context.synthesis.whole_map().meta["plan_error_l1"] == 0.008


@pytest.mark.parametrize(
    "plan",
    [
        AccuracyPlan(left_out=("walls",)),
        AccuracyPlan(left_out=("beam", "things"), mask_stride=2),
        AccuracyPlan(visibility="depth", frame_rate_factor=2),
    ],
)
def test_the_copied_command_makes_the_map_on_screen(
    context, fake, qtbot, tmp_path, monkeypatch, plan
):
    fake.plan = plan
    scene = replace(
        recording(tmp_path / "hall.sd2", radar=False),
        sensor=VirtualSensor((0.3, 0.1, 0.0), azimuth_deg=5.0, beam=Beam(60.0, 40.0)),
        things=(Thing("box", (0.15, 0.2, 1.0), size_m=(0.2, 0.4, 0.1)),),
        walls=(Wall.named("right", 1.0, 3.0),),
    )
    scene.save()
    open_ball(context, qtbot, scene.folder)
    wait_until_done(context, qtbot)
    moved = replace(scene.sensor, position_m=(-0.2, 0.1, 0.0), azimuth_deg=-8.0)
    context.edits.place_sensor(replace(moved, beam=Beam(50.0, 30.0)))  # not saved
    wait_until_done(context, qtbot)
    monkeypatch.chdir(tmp_path)
    program, *words = shlex.split(context.synthesis.line("map.npz"))
    assert (program, run(words)) == ("sd2", 0)
    made = DopplerMap.load(Path("map.npz"))
    np.testing.assert_array_equal(made.values, context.synthetic.map.values)
    everything = Synthesizer(scene.load_mesh(), plan.options(PRESETS["paper"]))
    full = everything.map(context.sensor.sensor).values
    assert np.array_equal(full, made.values) == (not plan.left_out)


def test_of_a_file_alone_the_copied_command_says_how_it_is_read(
    context, qtbot, ball, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    reading = MeshReading(frames_per_s=12.0, scale=0.8, turn="z90")
    context.document.open([ball], {"mesh_reading": reading})
    wait_until_done(context, qtbot)
    _, *words = shlex.split(context.synthesis.line("map.npz"))
    assert run(words) == 0
    made, shown = DopplerMap.load(Path("map.npz")), context.synthetic.map
    np.testing.assert_array_equal(made.times_s, shown.times_s)
    np.testing.assert_array_equal(made.values, shown.values)
    context.document.assign({"walls": (Wall.named("right", 1.0, 3.0),)})
    with pytest.raises(Sd2Error, match=r"never saved"):
        context.synthesis.line("map.npz")


def test_the_copied_command_for_the_sample_says_that_it_is_simulated(context, qtbot):
    """And how well the values are known, where the map on screen does."""
    context.document.open([resource_path("swipes.sd2")])
    qtbot.waitUntil(lambda: context.synthetic.map is not None, timeout=60_000)
    command = context.synthesis.command(Path("map.npz"))
    assert command.mesh == resource_path("swipes.sd2")
    values = context.synthetic.map.values
    context.synthetic.set_uncertainty(CellUncertainty(values, values))
    assert context.synthesis.command(Path("map.npz")).uncertainty


def test_the_library_chooses_for_a_small_scene(qapp, qtbot, ball, compiled_kernels):
    """The real library: it finds a plan within the tolerance, and the map is that plan's."""
    from PySide6.QtCore import QObject

    parent = QObject()
    context = build_models(parent, Settings.forgetful(), Parts(denoisers=FakeDenoisers().library))
    try:
        open_ball(context, qtbot, ball)
        qtbot.waitUntil(lambda: context.trade.in_use is not None, timeout=60_000)
        wait_until_done(context, qtbot)
        choice = context.trade.choice
        assert choice.holds
        assert choice.errors.l1 <= context.trade.tolerance
        np.testing.assert_allclose(
            context.synthetic.map.values, of_plan(ball, choice.plan), atol=1e-6
        )
    finally:
        context.close()
        parent.deleteLater()


def test_a_long_clip_waits_with_what_is_out_of_view_until_the_plan_is_known(
    context, fake, qtbot, ball, monkeypatch
):
    monkeypatch.setattr(map_model, "AT_ONCE", 1000)
    fake.gate.clear()
    open_ball(context, qtbot, ball)
    context.span.set_span(1.0, 2.0)
    qtbot.waitUntil(lambda: context.trade.choosing, timeout=10_000)
    # All was in view at first; nothing is done again.
    wanted = VirtualSensor(position_m=(0.2, 0.0, 0.0))
    context.edits.place_sensor(wanted)
    qtbot.waitUntil(lambda: context.trade.choosing, timeout=10_000)
    covered = context.synthetic.covered
    assert covered[30:60].all()
    assert not covered[:30].any()
    assert not covered[60:].any()
    fake.gate.set()
    wait_until_done(context, qtbot)
    assert context.synthetic.covered is None
