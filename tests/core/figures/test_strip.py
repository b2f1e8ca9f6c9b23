"""A strip of frames: where the body is drawn, in which colour, and what the file says."""

from __future__ import annotations

import io
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from sd2core.body.camera import PinholeCamera
from sd2core.errors import Sd2Error
from sd2core.figures.strip import Body, _reduced, _strip_box, plot_strip, save_strip
from sd2core.figures.strip_source import StripOptions, StripSource
from sd2core.mesh.sequence import MeshSequence
from sd2core.numerics.compiled import warm_up
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase

RATE = 30.0
SPEED_MPS = 1.2


@pytest.fixture(scope="module", autouse=True)
def compiled_kernels() -> None:
    warm_up()


class GreyVideo:
    """Twelve pictures of 160 × 120 that are 10 k bright."""

    width, height = 160, 120
    timebase = Timebase.regular(12, RATE)

    def read(self, frame: int) -> np.ndarray:
        return np.full((120, 160, 3), 10 * frame, np.uint8)


@pytest.fixture(scope="module")
def ball() -> MeshSequence:
    """A ball of 0.3 m at z = 3 m that approaches the camera at 1.2 m/s."""
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.3)
    times_s = np.arange(12) / RATE
    vertices = np.repeat(ball.vertices[None], 12, axis=0).astype(np.float32)
    vertices[:, :, 2] += (3.0 - SPEED_MPS * times_s)[:, None].astype(np.float32)
    return MeshSequence(vertices, np.asarray(ball.faces, np.int32), Timebase(times_s))


@pytest.fixture(scope="module")
def source(ball) -> StripSource:
    camera = PinholeCamera(160, 120, 150.0)
    return StripSource(GreyVideo(), ball, camera, name="ball.sd2")  # type: ignore[arg-type]


def drawn(source: StripSource, frames: list[int], **options: object) -> np.ndarray:
    """Pixels (H, W, 3) of the figure."""
    figure = plot_strip(source, frames, StripOptions(**options))  # type: ignore[arg-type]
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=100)
    return np.asarray(Image.open(stream).convert("RGB")).astype(int)


def strong(pixels: np.ndarray) -> tuple[int, int]:
    """Number of pixels that are clearly red, clearly blue."""
    red, blue = pixels[..., 0] - pixels[..., 2] > 50, pixels[..., 2] - pixels[..., 0] > 50
    return int(red.sum()), int(blue.sum())


def without_bar(pixels: np.ndarray) -> np.ndarray:
    return pixels[:, :-95]


def test_approaching_is_red_and_receding_is_blue(source, ball) -> None:
    red, blue = strong(without_bar(drawn(source, [5, 6], rows=("mesh",))))
    assert red > 2000
    assert blue == 0
    behind = replace(source, sensor=VirtualSensor(position_m=(0, 0, 6.0)))
    red, blue = strong(without_bar(drawn(behind, [5, 6], rows=("mesh",))))
    assert red == 0
    assert blue > 2000


@pytest.mark.slow
def test_everybody_of_a_scene_is_drawn_while_they_are_there(source, ball) -> None:
    receding = np.asarray(ball.vertices)[::-1] + np.float32([0.6, 0.0, 0.0])
    there = np.arange(12) < 8
    both = replace(ball, others=(replace(ball, vertices=receding, present=there),))
    scene = replace(source, mesh=both)
    red, blue = strong(without_bar(drawn(scene, [5, 6], rows=("mesh",))))
    assert min(red, blue) > 1000
    assert strong(without_bar(drawn(scene, [9, 10], rows=("mesh",))))[1] == 0


def test_plain_has_no_velocity_and_no_bar(source) -> None:
    assert strong(drawn(source, [5], rows=("mesh",), colour="plain")) == (0, 0)


@pytest.mark.parametrize("as_dots", [False, True])
def test_the_body_is_as_large_as_the_camera_sees_it(source, as_dots) -> None:
    pixels = drawn(source, [0], rows=("mesh",), whole=True, colour="velocity", as_dots=as_dots)
    warm = without_bar(pixels)[..., 0] - without_bar(pixels)[..., 2] > 15
    rows, columns = np.nonzero(warm)
    # The picture is 1.3 inches of 100 pixels wide; the ball's outline is seen a little enlarged.
    scale = 130 / 160
    expected = 2 * 150 * 0.3 / np.sqrt(3**2 - 0.3**2) * scale
    assert np.ptp(columns) == pytest.approx(expected, abs=3)
    assert np.ptp(rows) == pytest.approx(expected, abs=3)


def test_dots_are_of_the_side_that_is_seen(source, ball) -> None:
    """Of a ball of radius r at a distance d that is the share (1 - r / d) / 2."""
    options = StripOptions(rows=("mesh",), as_dots=True)
    (axes, *_) = plot_strip(source, [0], options).axes
    shown = len(axes.collections[0].get_offsets())
    assert shown / ball.vertex_count == pytest.approx((1 - 0.3 / 3.0) / 2, abs=0.05)


def test_the_video_is_shown_frame_by_frame(source) -> None:
    pixels = drawn(source, [2, 10], rows=("video",), whole=True, colour="plain")
    middle = pixels[pixels.shape[0] // 2 + 10]
    levels = {int(level) for level in np.unique(middle[:, 0]) if (middle[:, 0] == level).sum() > 90}
    assert {20, 100} <= levels


def test_the_overlay_lets_the_person_through(source) -> None:
    pixels = drawn(source, [10], rows=("overlay",), whole=True, colour="plain")
    tinted = pixels[..., 1] - pixels[..., 0] > 30
    assert 500 < tinted.sum() < 3000
    # Half of 100 and half of at most 198.
    assert 100 < pixels[tinted][:, 1].max() < 160


def test_the_box_holds_the_body_of_every_frame(source) -> None:
    options = StripOptions(rows=("mesh",))
    bodies = [Body.at(source, frame, options) for frame in (0, 11)]
    box = _strip_box(source, bodies, options)
    radius_px = 150 * 0.3 / (3 - SPEED_MPS * 11 / RATE)
    assert box.left == pytest.approx(80 - 1.2 * radius_px, abs=2)  # with a tenth of its width
    assert box.left + box.width == pytest.approx(80 + 1.2 * radius_px, abs=2)
    assert box.width < 160
    assert _strip_box(source, bodies, replace(options, whole=True)).width == 160


def test_a_frame_in_which_nobody_was_found_says_so(source, ball, tmp_path) -> None:
    present = np.arange(12) != 4
    gap = replace(source, mesh=replace(ball, present=present))
    options = StripOptions(rows=("mesh",), colour="plain")
    frames = [2, 4, 6]
    path = tmp_path / "gap.svg"
    save_strip(plot_strip(gap, frames, options), path, gap, frames, options)
    assert path.read_text().count("no person") == 1


def text_of(path: Path) -> list[str]:
    return re.findall(r"<text[^>]*>([^<]*)</text>", path.read_text())


@pytest.mark.slow
def test_svg_holds_its_words_as_text_and_stays_small(source, tmp_path) -> None:
    frames, options = [0, 3, 6, 9], StripOptions()
    path = tmp_path / "strip.svg"
    named = replace(source, simulated=True)
    save_strip(plot_strip(named, frames, options), path, named, frames, options)
    words = text_of(path)
    for word in ("0.00 s", "0.10 s", "0.30 s", "6", "Video (simulated)", "Mesh (simulated)", "+2"):
        assert word in words
    assert path.stat().st_size < 2e6
    again = tmp_path / "again.svg"
    save_strip(plot_strip(named, frames, options), again, named, frames, options)
    assert again.read_bytes() == path.read_bytes()


def test_what_was_filmed_is_not_called_simulated(source, tmp_path) -> None:
    options = StripOptions()
    path = tmp_path / "strip.svg"
    save_strip(plot_strip(source, [0], options), path, source, [0], options)
    assert "simulated" not in " ".join(text_of(path))


def test_png_says_where_it_comes_from(source, tmp_path) -> None:
    frames, options = [1, 2], StripOptions(as_dots=True)
    path = tmp_path / "strip.png"
    save_strip(plot_strip(source, frames, options), path, source, frames, options)
    said = json.loads(Image.open(path).text["Description"])
    assert said["source"] == "ball.sd2"
    assert said["frames"] == frames
    assert said["sensor_position_m"] == [0, 0, 0]
    assert said["camera"]["focal_px"] == 150
    assert said["options"]["as_dots"] is True


@pytest.mark.slow
def test_more_frames_than_columns_go_below(source) -> None:
    one = drawn(source, [0, 1, 2, 3], rows=("mesh",), colour="plain")
    two = drawn(source, [0, 1, 2, 3], rows=("mesh",), colour="plain", columns=2)
    assert two.shape[0] > 1.9 * one.shape[0] - 10
    assert two.shape[1] < 0.6 * one.shape[1]


@pytest.mark.parametrize(
    ("options", "found"),
    [
        ({"rows": ()}, "rows"),
        ({"rows": ("mesh", "mesh")}, "rows"),
        ({"rows": ("radar",)}, "rows"),
        ({"v_max_mps": 0.0}, "v_max"),
        ({"columns": 0}, "columns"),
    ],
)
def test_impossible_options_are_refused(options, found) -> None:
    with pytest.raises(Sd2Error, match=found):
        StripOptions(**options)


def test_what_is_not_there_cannot_be_drawn(source) -> None:
    with pytest.raises(Sd2Error, match="no video"):
        plot_strip(replace(source, video=None), [0], StripOptions(rows=("video",)))
    with pytest.raises(Sd2Error, match="no mesh"):
        plot_strip(replace(source, mesh=None), [0], StripOptions(rows=("overlay",)))
    with pytest.raises(Sd2Error, match="no frame 12"):
        plot_strip(source, [12])
    with pytest.raises(Sd2Error, match="0 frames"):
        plot_strip(source, [])


def test_a_name_no_figure_can_have(source, tmp_path) -> None:
    with pytest.raises(Sd2Error, match=r"\.png"):
        save_strip(plot_strip(source, [0]), tmp_path / "strip.jpg", source, [0], StripOptions())


def test_a_large_video_is_made_smaller_without_shifting_it() -> None:
    across = np.zeros((900, 2000, 3), np.uint8)
    across[:] = (np.arange(2000) // 8)[None, :, None]
    small = _reduced(across)
    assert small.shape == (450, 1000, 3)
    assert small[7, 500, 0] == across[7, 1000, 0]
    assert _reduced(across[:, :1500]).shape == (900, 1500, 3)
