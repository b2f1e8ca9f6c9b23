"""The map of one part of the body, and denoisers that take the parts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from fake_accuracy import FakeAccuracy
from fake_denoisers import FakeDenoisers, fading
from PySide6.QtCore import QObject
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QWidget
from window_models import build_models

from sd2app.maps.feature import LimbMenu
from sd2app.maps.heatmap_image import heatmap_image
from sd2app.maps.spectrum import SpectrumView
from sd2app.session.maps import LIMB_COLOURS, part_words, title_of
from sd2app.settings import Settings
from sd2app.shell.parts import Parts
from sd2app.widgets.canvas import lookup_table
from sd2core.body.parts import known_parts
from sd2core.doppler.synthesizer import Synthesizer
from sd2core.files.resources import resource_path
from sd2core.io.mesh import load_mesh, save_mesh
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.vertex_parts import PARTS
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase


@pytest.fixture(scope="module")
def body(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("body") / "body.npz"
    save_mesh(load_mesh(resource_path("swipes.sd2") / "mesh.zarr").between(100, 160), path)
    return path


@pytest.fixture(scope="module")
def ball(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("ball") / "ball.npz"
    shape = trimesh.creation.icosphere(subdivisions=2, radius=0.3)
    times_s = np.arange(60) / 30
    vertices = np.repeat(shape.vertices[None], 60, axis=0).astype(np.float32)
    vertices[:, :, 2] += (2 + 0.2 * np.sin(2 * np.pi * times_s)[:, None]).astype(np.float32)
    save_mesh(MeshSequence(vertices, np.asarray(shape.faces, np.int32), Timebase(times_s)), path)
    return path


@pytest.fixture
def denoisers(tmp_path: Path) -> FakeDenoisers:
    made = FakeDenoisers()
    (path := tmp_path / "limbs.safetensors").write_bytes(b"weights")
    made.add(path, 2.0, parts=("trunk", "forearm.R"))
    return made


@pytest.fixture
def context(qapp, compiled_kernels, denoisers):
    parent = QObject()
    context = build_models(
        parent,
        Settings.forgetful(),
        Parts(accuracy=FakeAccuracy().library, denoisers=denoisers.library),
    )
    yield context
    context.close()
    parent.deleteLater()


def open_it(context, qtbot, path):
    with qtbot.waitSignal(context.document.opened, timeout=10_000):
        context.document.open([path])
    rest(context, qtbot)


def rest(context, qtbot):
    def at_rest():
        synthesis = context.synthesis
        return synthesis.complete and not synthesis.busy and not context.denoise.busy

    qtbot.waitUntil(at_rest, timeout=120_000)


def split(path, sensor):
    mesh = load_mesh(path)
    return Synthesizer(mesh).limb_maps(sensor, known_parts(mesh)).limbs


def test_one_part_is_shown_alone(context, qtbot, body):
    open_it(context, qtbot, body)
    track, limbs = context.synthetic, context.limbs
    assert track.map.limbs is None
    whole = track.values.copy()
    limbs.show("forearm.R")
    rest(context, qtbot)
    expected = split(body, VirtualSensor()).values[PARTS.index("forearm.R")]
    np.testing.assert_allclose(track.values, expected, rtol=1e-5, atol=1e-8)
    np.testing.assert_array_equal(track.map.values, whole)
    bin_number, frame = np.unravel_index(expected.argmax(), expected.shape)
    velocity_mps = float(track.map.axis.centres_mps[bin_number])
    reading = track.read(track.map.timebase.time_of(int(frame)), velocity_mps)
    assert reading.value == pytest.approx(float(expected.max()), rel=1e-5)
    np.testing.assert_allclose(
        context.synthesis.whole_map().limbs.values,
        split(body, VirtualSensor()).values,
        rtol=1e-5,
        atol=1e-8,
    )
    limbs.show()
    np.testing.assert_array_equal(track.values, whole)
    limbs.show("trunk")
    open_it(context, qtbot, body)
    assert track.parts == ()


def test_the_spectrum_is_of_the_part_that_is_shown(context, qtbot, body):
    open_it(context, qtbot, body)
    view = SpectrumView(context.session)
    qtbot.addWidget(view)
    view.resize(260, 320)
    context.playback.seek(context.synthetic.map.times_s[15])

    def coloured():
        image = view.grab().toImage()
        wanted = QColor(context.display.palette.synthetic).getRgb()[:3]
        data = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), -1, 4)
        below = data[90:, : image.width(), 2::-1].astype(int)  # not the legend
        return int((np.abs(below - wanted).max(axis=2) < 30).sum())

    moving = coloured()
    assert moving > 30
    context.limbs.show("lower_leg.L")  # it stands still
    rest(context, qtbot)
    assert not context.synthetic.values[:, 15].any()
    assert coloured() < 0.5 * moving
    assert title_of(context.synthetic) == "Synthetic · left lower leg"


def test_what_is_no_body_is_shown_whole(context, qtbot, ball):
    open_it(context, qtbot, ball)
    limbs = context.limbs
    said = context.shell.warned = []
    limbs.show("trunk")
    qtbot.waitUntil(lambda: bool(said), timeout=30_000)
    assert "closed surface of one whole body" in said[0]
    assert limbs.parts == ()


def test_the_menu_chooses_a_part(context, qtbot, body):
    open_it(context, qtbot, body)
    limbs = context.limbs
    parent = QWidget()
    qtbot.addWidget(parent)
    menu = LimbMenu(limbs, parent)
    menu.aboutToShow.emit()
    rows = {action.text(): action for action in menu.actions()}
    assert list(rows)[:4] == ["Whole body", "Head and trunk", "Left upper arm", "Right upper arm"]
    assert rows["Whole body"].isChecked()
    rows["Left lower leg"].trigger()
    assert limbs.parts == ("lower_leg.L",)
    menu.aboutToShow.emit()
    assert rows["Left lower leg"].isChecked()
    assert not rows["Whole body"].isChecked()
    rows["Right forearm"].trigger()
    assert limbs.parts == ("forearm.R", "lower_leg.L")
    rows["Left lower leg"].trigger()
    assert limbs.parts == ("forearm.R",)
    rows["Whole body"].trigger()
    assert limbs.parts == ()
    assert part_words("forearm.L") == "left forearm"
    rest(context, qtbot)


def test_several_parts_add_up_and_each_has_its_colour(context, qtbot, body):
    open_it(context, qtbot, body)
    track, limbs = context.synthetic, context.limbs
    limbs.show("forearm.R", "upper_arm.R")
    rest(context, qtbot)
    assert title_of(track) == "Synthetic · right upper arm + right forearm"
    expected = split(body, VirtualSensor()).values
    upper, forearm = (expected[PARTS.index(part)] for part in ("upper_arm.R", "forearm.R"))
    np.testing.assert_allclose(track.values, upper + forearm, rtol=1e-5, atol=1e-8)
    levels = context.display.levels
    clock = track.map.timebase
    image = heatmap_image(track, levels, clock.start_s, clock.end_s, len(clock), 0)
    data = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), -1, 4)
    shown = data[::-1, : image.width(), 2::-1].astype(float)  # (bins, frames, 3), slowest last
    ground, *own = (
        np.array(QColor(colour).getRgb()[:3])
        for colour in (
            QColor.fromRgb(int(lookup_table(levels.colour_map)[0])),
            LIMB_COLOURS["upper_arm.R"],
            LIMB_COLOURS["forearm.R"],
        )
    )
    shade = track.shade(upper + forearm, levels)[..., None]
    of_upper = (upper / np.maximum(upper + forearm, 1e-30))[..., None]
    mix = of_upper * own[0] + (1 - of_upper) * own[1]
    assert of_upper.max() > 0.9
    assert of_upper[shade > 0.5].min() < 0.1
    np.testing.assert_allclose(
        shown, np.where(shade > 0, ground + shade * (mix - ground), ground), atol=1.5
    )


def test_what_is_picked_replaces_adds_or_ends_it(context, qtbot, body):
    open_it(context, qtbot, body)
    limbs = context.limbs
    heard = []
    limbs.changed.connect(lambda: heard.append(limbs.parts))
    for part, adds, expected in (
        ("trunk", False, ("trunk",)),
        ("forearm.L", False, ("forearm.L",)),
        ("thigh.R", True, ("forearm.L", "thigh.R")),
        (None, True, ("forearm.L", "thigh.R")),
        ("forearm.L", True, ("thigh.R",)),
        ("thigh.R", False, ()),  # once more ends it
        ("trunk", True, ("trunk",)),
        (None, False, ()),
    ):
        limbs.pick(part, adds=adds)
        assert limbs.parts == expected
    assert len(heard) == 7
    qtbot.waitUntil(lambda: limbs.vertex_parts is not None, timeout=30_000)
    np.testing.assert_array_equal(limbs.vertex_parts.numbers, known_parts(load_mesh(body)).numbers)
    rest(context, qtbot)


def test_every_part_has_a_colour_of_its_own():
    assert list(LIMB_COLOURS) == list(PARTS)
    assert len({*LIMB_COLOURS.values()}) == len(PARTS)


def test_a_denoiser_of_parts_gets_them(context, denoisers, qtbot, body):
    (path,) = denoisers.cards
    open_it(context, qtbot, body)
    context.denoise.use(path)
    rest(context, qtbot)
    expected = split(body, VirtualSensor()).inputs(("forearm.R",)).T
    np.testing.assert_allclose(
        context.denoised.map.values, fading(expected, np.float32(2.0)), rtol=1e-4, atol=1e-7
    )
    # Elsewhere, too.
    context.edits.place_sensor(VirtualSensor((0.8, 0.0, 0.3)))
    rest(context, qtbot)
    moved = split(body, context.sensor.sensor).inputs(("forearm.R",)).T
    np.testing.assert_allclose(
        context.denoised.map.values, fading(moved, np.float32(2.0)), rtol=1e-4, atol=1e-7
    )
    assert context.synthesis.split
    context.denoise.use(None)
    context.edits.place_sensor(VirtualSensor((0.4, 0.0, 0.3)))
    rest(context, qtbot)
    assert not context.synthesis.split


def test_a_denoiser_of_parts_says_what_it_lacks(context, denoisers, qtbot, ball):
    (path,) = denoisers.cards
    open_it(context, qtbot, ball)
    said = context.shell.warned = []
    context.denoise.use(path)
    qtbot.waitUntil(lambda: bool(said), timeout=60_000)
    assert "are not known of this mesh" in said[0]
    assert context.denoised.map is None
    assert context.synthetic.map is not None
