"""Pictures of what is learnt and made in bulk; part of `make screenshots`.

All of it is of a small simulated campaign and of the sample, which is simulated as well.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from sd2app.background.runs import Runs
from sd2app.batch.feature import BatchWindow
from sd2app.dataset_export.dialog import ExportDialog
from sd2app.shell.window import MainWindow
from sd2app.study.result_dialog import ClassResultDialog
from sd2core.files.resources import resource_path
from sd2core.placements.placements import PlacementGrid
from tools.documentation.windows import application, opened, save, settle, wait_for

_CAMPAIGN = ("--people", "4", "--minutes", "4", "--seed", "1")
_COMPARE_STEPS = 40
_LONG_S = 1800.0
_SIZE = (1280, 960)


def learning() -> None:
    """Denoiser, classifier, data set and batch."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        # Runs and models of whoever takes the pictures are left alone.
        os.environ["XDG_DATA_HOME"] = str(place / "own")
        sample = place / "swipes.sd2"
        shutil.copytree(resource_path("swipes.sd2"), sample)
        export(sample)
        batch(sample)
        campaign = place / "campaign.zarr"
        command = [sys.executable, "-m", "sd2app.command_line", "simulate", "campaign"]
        command += ["--out", str(campaign), *_CAMPAIGN]
        if subprocess.run(command, check=False).returncode != 0:
            print("No pictures of trainings: there is nothing to learn from", file=sys.stderr)
            return
        training(campaign)
        classifier(sample, campaign)


def training(campaign: Path) -> None:
    """The Train panel while a denoiser learns from a small simulated campaign."""
    with opened([resource_path("swipes.sd2")], campaign.with_name("runs"), _SIZE) as window:
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
    with opened([sample], size=_SIZE) as window:
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
