from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from filmed_people import film

from sd2core.body.camera import camera_of, written_focal_mm
from sd2core.errors import Sd2Error
from sd2core.io.video import open_video

APPLE = "com.apple.quicktime.camera.focal_length.35mm_equivalent"


def clip(path: Path, metadata: dict[str, str] | None = None) -> Path:
    return film(path, [np.zeros((240, 320, 3), np.uint8)] * 2, metadata=metadata)


def test_by_default_56_degrees_across_the_longer_side(tmp_path: Path) -> None:
    with open_video(clip(tmp_path / "a.mp4")) as video:
        camera, source = camera_of(video)
    assert (camera.width, camera.height, source) == (320, 240, "default")
    assert camera.focal_px == pytest.approx(300.0)


def test_what_a_phone_writes(tmp_path: Path) -> None:
    """26 mm before a film of 43.27 mm diagonal; the picture's diagonal is 400 pixels."""
    with open_video(clip(tmp_path / "a.mp4", {APPLE: "26"})) as video:
        camera, source = camera_of(video)
    assert source == "metadata"
    assert camera.focal_px == pytest.approx(400 * 26 / math.hypot(36, 24))


def test_the_user_holds_before_the_file(tmp_path: Path) -> None:
    with open_video(clip(tmp_path / "a.mp4", {APPLE: "26"})) as video:
        assert camera_of(video, focal_px=500.0)[0].focal_px == 500.0
        camera, source = camera_of(video, field_of_view_deg=90.0)
        assert (camera.focal_px, source) == (pytest.approx(160.0), "user")
        with pytest.raises(Sd2Error, match="Both a focal length and a field of view"):
            camera_of(video, 500.0, 90.0)
        with pytest.raises(Sd2Error, match="200°"):
            camera_of(video, field_of_view_deg=200.0)
        with pytest.raises(Sd2Error, match="focal length"):
            camera_of(video, focal_px=-1.0)


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        (APPLE, "26", 26.0),
        ("FocalLengthIn35mmFormat", "24 mm", 24.0),
        ("focal_length_35mm", "135/5", 27.0),
        (APPLE, "0", None),
        (APPLE, "unknown", None),
        (APPLE, "5/0", None),
        ("focal_length", "4.2", None),  # of a sensor of unknown size
        ("encoder", "Lavf 35 mm", None),
    ],
)
def test_what_counts(name: str, value: str, expected: float | None) -> None:
    assert written_focal_mm({"title": "35", name: value}) == expected
