"""Take the screenshots of the documentation: `make screenshots`.

Draws the real window, on whatever display Qt finds, into docs/images. The real
video and its mesh are read from the folder of real recordings
(``SD2_SHARED_DATA``, by default ``../shared/data``); without it those pictures
are left as they are.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path

from PySide6.QtWidgets import QApplication

from sd2app.screenshot import wait_until_settled
from sd2app.settings import Settings
from sd2app.theme import apply_theme
from sd2app.views.window import MainWindow
from sd2core.resources import resource_path
from sd2core.sensor import VirtualSensor, aimed_at

REPOSITORY = Path(__file__).resolve().parent.parent
IMAGES = REPOSITORY / "docs" / "images"
SHARED = Path(os.environ.get("SD2_SHARED_DATA", REPOSITORY.parent / "shared" / "data"))
LIMIT_S = 120.0


def sample(window: MainWindow) -> None:
    """The sample in the middle of a swipe."""
    window.context.playback.seek(1.9)


def far_in_the_dark(window: MainWindow) -> None:
    """The sensor moved aside to 6 m, range colours, dark theme."""
    context = window.context
    window.set_dark(True)
    context.playback.seek(2.0)
    sensor = VirtualSensor(position_m=(2.6, -0.6, -2.8))
    context.edits.place_sensor(aimed_at(sensor, context.synthesis.torso_m))
    window.set_scene_view("overview")
    context.display.set_mesh_colour("range")


def trade(window: MainWindow) -> None:
    """The Trade panel on the sample, measured, for a tolerance of 2 %."""
    window.resize(1280, 960)
    window.context.playback.seek(1.9)
    window.context.trade.set_tolerance(0.02)
    window.measure_scene()


def real(window: MainWindow) -> None:
    """A real person with the mesh fitted to the video."""
    window.context.playback.seek(1.9)


def strip() -> None:
    """Frames of a swipe of the sample above its mesh."""
    from sd2core.figures.strip import plot_strip
    from sd2core.figures.strip_source import StripOptions, StripSource
    from sd2core.recording import open_recording

    recording = open_recording(resource_path("swipes.sd2"))
    with recording.open_video() as video:
        source = StripSource.of(recording, video, recording.load_mesh(), recording.title)
        figure = plot_strip(source, range(48, 84, 5), StripOptions(v_max_mps=1.5))
    figure.savefig(IMAGES / "strip.png", dpi=110)
    print((IMAGES / "strip.png").relative_to(REPOSITORY))


def take(
    application: QApplication, name: str, paths: list[Path], arrange: Callable[[MainWindow], None]
) -> None:
    """Open, wait, arrange, wait, write."""
    apply_theme(application, False)
    settings = Settings.forgetful()
    settings.dark = False
    window = MainWindow(settings)
    window.resize(1280, 800)
    window.show()
    window.populate()
    window.open_paths(paths)
    for step in (lambda _: None, arrange):
        step(window)
        if not wait_until_settled(application, window, LIMIT_S):
            sys.exit(f"{name}: the window was still busy after {LIMIT_S:.0f} s")
    if window.messages.text:
        print(f"{name}: {window.messages.text}", file=sys.stderr)
        window.messages.hide()
        application.processEvents()
    window.grab().save(str(IMAGES / name))
    window.context.document.undo_stack.setClean()
    window.close()
    application.processEvents()
    print(IMAGES.joinpath(name).relative_to(REPOSITORY))


def main() -> None:
    """Take them all."""
    application = QApplication(sys.argv[:1])
    IMAGES.mkdir(exist_ok=True)
    strip()
    swipes = [resource_path("swipes.sd2")]
    take(application, "sample.png", swipes, sample)
    take(application, "dark.png", swipes, far_in_the_dark)
    take(application, "trade.png", swipes, trade)
    walk = [SHARED / "video" / "walk.mkv", SHARED / "mesh" / "walk.npz"]
    if all(path.exists() for path in walk):
        take(application, "real-video.png", walk, real)
    else:
        print(f"real-video.png is left as it is: there is no {walk[0]}", file=sys.stderr)


if __name__ == "__main__":
    main()
