"""Options of ``sd2 open`` and ``sd2 demo``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from sd2core.options.kinds import DemoScene
from sd2core.options.records import ARGUMENTS, Place
from sd2core.options.shared import Overwrite


class Screenshot(Overwrite):
    """Picture of the window.

    Parameters
    ----------
    screenshot : FILE.png
        draw the window into a picture instead of on the screen
    """

    # Instead of the copy that `sd2 demo` can write.
    screenshot: Annotated[Path | None, Place(one_of="instead", endings=(".png",))] = None


class Open(Screenshot):
    """Options of ``sd2 open``.

    Parameters
    ----------
    paths : PATH
        a recording; or a video, a mesh and a radar capture, each or together (default: an empty
        window)
    """

    paths: Annotated[tuple[Path, ...], ARGUMENTS] = ()


class Demo(Screenshot):
    """Options of ``sd2 demo``.

    Parameters
    ----------
    out : NAME.sd2
        write a copy of the sample with its files, and open no window
    scene : NUMBER
        of people: one who swipes, or two who walk past each other
    """

    out: Annotated[Path | None, Place(one_of="instead")] = None
    scene: DemoScene = "one"
