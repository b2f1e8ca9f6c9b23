"""Bundled colours of the maps."""

from __future__ import annotations

import matplotlib
import numpy as np
import pytest

from sd2app.session.display import COLOUR_MAPS
from sd2app.widgets.canvas import lookup_table


@pytest.mark.parametrize("name", COLOUR_MAPS)
def test_the_bundled_colours_are_those_of_matplotlib(name: str) -> None:
    wanted = matplotlib.colormaps[name](np.arange(256), bytes=True)[:, :3]
    found = lookup_table(name)[:, None] >> np.array([16, 8, 0], np.uint32) & 255
    np.testing.assert_array_equal(found, wanted)
    assert (lookup_table(name) >> 24 == 255).all()
