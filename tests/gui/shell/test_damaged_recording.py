"""A recording that was not copied to its end."""

from __future__ import annotations

import shutil

import pytest
from window_models import models_of

from sd2app.shell.messages import MessageNotice
from sd2core.files.resources import resource_path
from tests.damaged_files import change, cut, lose


@pytest.mark.slow
@pytest.mark.parametrize("damage", [cut, change, lose])
def test_the_rest_of_a_damaged_mesh_is_shown(empty_window, qtbot, tmp_path, damage):
    recording = shutil.copytree(resource_path("swipes.sd2"), tmp_path / "swipes.sd2")
    damage(recording / "fit.zarr" / "vertices" / "c" / "1" / "0" / "0")
    c = models_of(empty_window)
    with qtbot.waitSignal(c.document.opened, timeout=20_000):
        empty_window.open_paths([recording])
    qtbot.waitUntil(lambda: empty_window.settled, timeout=20_000)
    qtbot.waitUntil(lambda: c.synthesis.complete, timeout=60_000)
    values = c.synthetic.map.values
    assert not values[:, 150:300].any()
    assert values[:, :150].any()
    assert values[:, 300:].any()
    c.playback.seek_frame(200)
    qtbot.waitUntil(lambda: empty_window.settled, timeout=20_000)
    notice = empty_window.findChild(MessageNotice)
    assert "fit.zarr is damaged: frames 150 to 299 of vertices" in notice.text
