"""Take the screenshots of the documentation: `make screenshots`.

Draws the real window, on whatever display Qt finds, into docs/images. The real
video is read from the folder of real recordings
(``SD2_SHARED_DATA``, by default ``../shared/data``); without it those pictures
are left as they are.
"""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from sd2app.background.runs import Runs
from sd2app.batch.feature import BatchWindow
from sd2app.dataset_export.feature import ExportDialog
from sd2app.fit.request import FitRequest
from sd2app.live.process import ListenRequest
from sd2app.mesh_comparison.feature import ComparisonWindow
from sd2app.shell.window import MainWindow
from sd2app.study.result_dialog import ClassResultDialog
from sd2core.figures.strip import plot_strip
from sd2core.figures.strip_source import StripOptions, StripSource
from sd2core.files.figure_files import save_figure
from sd2core.mesh.walls import Wall
from sd2core.placements.placements import PlacementCloud, PlacementGrid
from sd2core.recording.recording import open_recording
from sd2core.sensor import Beam, VirtualSensor, aimed_at
from sd2core.simulate.two_people import two_people
from tools.documentation.measured import IMAGES, REPOSITORY, SAMPLE, SHARED
from tools.documentation.runs import sd2
from tools.documentation.windows import application, opened, save, settle, wait_for

SIZES = (1280, 720), (1600, 1000), (2560, 1440)
"""Windows of small, usual and large screens."""

TALL = (1280, 960)
WALK = SHARED / "video" / "walk.mkv"
_CAMPAIGN = ("--people", "4", "--minutes", "4", "--seed", "1")
_COMPARE_STEPS = 40
_LONG_S = 1800.0


def sample(window: MainWindow) -> None:
    """The sample in the middle of a swipe."""
    window.session.playback.seek(1.9)


def beside(window: MainWindow) -> None:
    """The sensor 2 m to the side of the body, in the same moment as :func:`sample`."""
    window.session.playback.seek(1.9)
    torso_m = window.features.maps.synthesis.torso_m
    sensor = VirtualSensor(position_m=(2.0, 0.0, 1.6))
    window.session.edits.place_sensor(aimed_at(sensor, torso_m))


def accuracy(window: MainWindow) -> None:
    """The Accuracy panel on the sample, measured, for a tolerance of 2 %."""
    window.resize(*TALL)
    sample(window)
    window.features.accuracy.model.set_tolerance(0.02)
    window.features.accuracy.measure()


def room() -> None:
    """Two people, a table and a wall on the right, with a beam that follows Anna."""
    with tempfile.TemporaryDirectory() as folder:
        recording = two_people(Path(folder) / "two.sd2")

        def arrange(window: MainWindow) -> None:
            edits = window.session.edits
            edits.add_to_scene(Wall.named("right", 2.5))
            sensor = VirtualSensor((1.2, 0.0, 0.4), beam=Beam(56.0, 28.0))
            edits.place_sensor(aimed_at(sensor, window.features.maps.synthesis.torso_m))
            window.session.playback.seek(4.0)
            window.features.scene.view.set_view("overview")

        take("room.png", [recording.folder], arrange)


def labels(window: MainWindow) -> None:
    """The spans of the sample as a table beside the maps, one of them selected."""
    window.resize(*TALL)
    window.bring_up("Labels", "Spans")
    span = window.features.labels.model.labels.spans[2]
    window.features.labels.edits.go_to(span)


def placements(window: MainWindow) -> None:
    """A cloud of sensors planned around the sample's body."""
    window.resize(*TALL)
    window.session.playback.seek(1.9)
    window.bring_up("Sensor", "Placements")
    window.session.edits.plan_placements(
        PlacementCloud(120, (1.0, 4.0), (-80.0, 80.0), (-10.0, 50.0), seed=2)
    )


def real() -> None:
    """A real person who steps back, with the body that `sd2 fit` makes of the video."""
    with tempfile.TemporaryDirectory() as folder:
        mesh = Path(folder) / "walk.zarr"
        sd2("fit", WALK, "--out", mesh)
        take("real-video.png", [WALK, mesh], lambda window: window.session.playback.seek(2.7))


def strip() -> None:
    """Frames of a swipe of the sample above its mesh."""
    recording = open_recording(SAMPLE)
    with recording.open_video() as video:
        source = StripSource.of(recording, video, recording.load_mesh(), recording.title)
        figure = plot_strip(source, range(48, 84, 5), StripOptions(v_max_mps=1.5))
    save_figure(figure, IMAGES / "strip.png", pixels_per_inch=110)
    print((IMAGES / "strip.png").relative_to(REPOSITORY))


def fitting() -> None:
    """A body being fitted to a real video, with what has been found so far."""
    with tempfile.TemporaryDirectory() as folder:
        video = Path(shutil.copy(WALK, folder))
        with opened([video]) as window:
            fit = window.features.fit.model
            fit.start(FitRequest(video, video.with_suffix(".sd2")))

            def far_enough() -> bool:
                progress = fit.progress
                second_pass = progress is not None and progress.stage == "refine"
                return not fit.busy or (second_pass and progress.done > 0.55 * progress.total)

            wait_for(far_enough)
            if not fit.busy:
                sys.exit(f"The fit ended: {fit.text}")
            save(window, "fitting.png")
            fit.cancel()
            wait_for(lambda: not fit.busy)


def comparison() -> None:
    """The sample's mesh, which is the truth, beside the body that is fitted to its video."""
    with tempfile.TemporaryDirectory() as folder:
        mesh = Path(folder) / "sd2 fit.zarr"
        sd2("fit", SAMPLE / "video.mp4", "--out", mesh)
        with opened([SAMPLE]) as window:
            window.session.playback.seek(2.1)
            window.features.mesh_comparison.compare(mesh)
            compared = window.findChild(ComparisonWindow)
            wait_for(lambda: compared.model.comparison is not None)
            settle(window)
            save(compared, "comparison.png")


def listening() -> None:
    """The sample's radar replayed, with more than ten seconds heard."""
    with tempfile.TemporaryDirectory() as folder, opened([SAMPLE]) as window:
        live = window.features.live.model
        live.start(ListenRequest(Path(folder) / "walk.sd2", replay=SAMPLE))
        wait_for(lambda: live.counts.recorded >= 330)
        save(window, "listening.png")
        live.stop()
        wait_for(lambda: not live.busy)
        settle(window)


def sizes() -> None:
    """The window as small, usual and large screens show it, light and dark."""
    with opened([SAMPLE]) as window:
        sample(window)
        for width, height in SIZES:
            window.resize(width, height)
            for theme in ("light", "dark"):
                window.features.program.set_dark(theme == "dark")
                settle(window)
                save(window, f"window-{width}x{height}-{theme}.png")


def learning() -> None:
    """Denoiser, classifier, data set and batch."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        # Runs and models of whoever takes the pictures are left alone.
        os.environ["XDG_DATA_HOME"] = str(place / "own")
        sample = place / "swipes.sd2"
        shutil.copytree(SAMPLE, sample)
        export(sample)
        batch(sample)
        campaign = place / "campaign.zarr"
        sd2("simulate", "campaign", "--out", campaign, *_CAMPAIGN)
        training(campaign)
        classifier(sample, campaign)


def training(campaign: Path) -> None:
    """The Train panel while a denoiser learns from a small simulated campaign."""
    with opened([SAMPLE], campaign.with_name("runs"), TALL) as window:
        window.session.playback.seek(1.9)
        window.bring_up("Train", "Denoiser")
        model = window.features.training.model
        model.setup.add(campaign)
        model.setup.set_value("epochs", 40)
        wait_for(lambda: not model.setup.problem)
        model.start()
        wait_for(lambda: model.run is not None and model.run.history.epoch >= 12)
        save(window, "training.png")
        model.tell("cancel")
        wait_for(lambda: not model.under_way)


def classifier(sample: Path, campaign: Path) -> None:
    """A classifier that learnt from the campaign, on the sample; then a quick study."""
    with opened([sample], size=TALL) as window:
        window.bring_up("Train", "Classifier")
        model, classify = window.features.classify.training, window.features.classify.model
        model.setup.add(campaign)
        model.setup.set_map("denoised", True)
        wait_for(lambda: not model.setup.problem)
        model.train()
        _wait_for_end(window, model)
        model.use_model()
        wait_for(lambda: classify.track.complete and not classify.busy)
        window.session.playback.seek(3.7)
        settle(window)
        window.messages.dismiss()
        application().processEvents()
        save(window, "classifier.png")
        model.setup.set_value("steps", _COMPARE_STEPS)
        study = window.features.study
        window.bring_up("Train", "Study")
        study.runs.begin()
        _wait_for_end(window, study.runs)
        study.show_result()
        result = window.findChild(ClassResultDialog)
        application().processEvents()
        save(result, "class-result.png")
        result.close()


def export(sample: Path) -> None:
    """A data set of the sample, as it is written, with its preview sheet."""
    with opened([sample]) as window:
        window.action("export_dataset").trigger()
        dialog, model = window.findChild(ExportDialog), window.features.dataset_export.model
        wait_for(lambda: model.ready)
        model.start(sample.with_name("gestures.zarr"))
        wait_for(lambda: not model.under_way)
        settle(window)
        save(dialog, "export.png")
        dialog.close()


def batch(sample: Path) -> None:
    """The batch window after a batch of the sample, seen from nine places."""
    with opened([sample]) as window:
        model = window.features.batch.model
        grid = PlacementGrid((1.5, 2.2, 3.0), (-30.0, 0.0, 30.0))
        model.setup.add(sample)
        model.setup.set_placements(grid, "grid.json")
        window.features.batch.show()
        wait_for(lambda: not model.why_not_start)
        model.start()
        wait_for(lambda: model.run is not None and model.run.phase == "finished")
        wait_for(lambda: model.results.rowCount() > 0)
        settle(window)
        save(window.findChild(BatchWindow), "batch.png")


def _wait_for_end(window: MainWindow, model: Runs[Any]) -> None:
    """Until a training or a study is over."""
    wait_for(lambda: model.run is not None and not model.under_way, _LONG_S)
    settle(window)


def take(name: str, paths: list[Path], arrange: Callable[[MainWindow], None]) -> None:
    """Open, wait, arrange, wait, write."""
    with opened(paths) as window:
        arrange(window)
        settle(window)
        if window.messages.text:
            print(f"{name}: {window.messages.text}", file=sys.stderr)
            window.messages.dismiss()
            application().processEvents()
        save(window, name)


def main() -> None:
    """Take them all."""
    IMAGES.mkdir(exist_ok=True)
    strip()
    take("sample.png", [SAMPLE], sample)
    take("beside.png", [SAMPLE], beside)
    take("accuracy.png", [SAMPLE], accuracy)
    room()
    sizes()
    take("labels.png", [SAMPLE], labels)
    take("placements.png", [SAMPLE], placements)
    comparison()
    listening()
    learning()
    if WALK.exists():
        real()
        fitting()
    else:
        print(f"real-video.png is left as it is: there is no {WALK}", file=sys.stderr)


if __name__ == "__main__":
    main()
