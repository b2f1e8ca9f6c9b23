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

from PySide6.QtWidgets import QApplication

from sd2app.background.runs import Runs
from sd2app.batch.dialog import BatchWindow
from sd2app.dataset_export.dialog import ExportDialog
from sd2app.shell.app import wait_until_settled
from sd2app.shell.window import MainWindow
from sd2app.study.result_dialog import ClassResultDialog
from sd2core.files.resources import resource_path
from sd2core.placements.placements import PlacementGrid
from tools.documentation.windows import LIMIT_S, opened, save, wait_for

_CAMPAIGN = ("--people", "4", "--minutes", "4", "--seed", "1")
_COMPARE_STEPS = 100
_LONG_S = 1800.0


def learning(application: QApplication) -> None:
    """Denoiser, classifier, data set and batch."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        # Runs and models of whoever takes the pictures are left alone.
        os.environ["XDG_DATA_HOME"] = str(place / "own")
        sample = place / "swipes.sd2"
        shutil.copytree(resource_path("swipes.sd2"), sample)
        export(application, sample)
        batch(application, sample)
        campaign = place / "campaign.zarr"
        command = [sys.executable, "-m", "sd2app.command_line", "simulate", "campaign"]
        command += ["--out", str(campaign), *_CAMPAIGN]
        if subprocess.run(command, check=False).returncode != 0:
            print("No pictures of trainings: there is nothing to learn from", file=sys.stderr)
            return
        training(application, campaign)
        classifier(application, sample, campaign)


def training(application: QApplication, campaign: Path) -> None:
    """The Train panel while a denoiser learns from a small simulated campaign."""
    window = opened(application, [resource_path("swipes.sd2")], campaign.with_name("runs"))
    window.session.playback.seek(1.9)
    window.resize(1280, 960)
    window.bring_up("Train", "Denoiser")
    model = window.features.training.model
    model.setup.add(campaign)
    model.setup.set_value("epochs", 40)
    wait_for(application, lambda: not model.setup.problem)
    model.start()
    wait_for(application, lambda: model.run is not None and model.run.history.epoch >= 12)
    save(window, "training.png")
    model.tell("cancel")
    wait_for(application, lambda: not model.under_way)
    window.close()


def classifier(application: QApplication, sample: Path, campaign: Path) -> None:
    """A classifier that learnt from the campaign, on the sample; then a quick study."""
    window = opened(application, [sample])
    window.resize(1280, 960)
    window.bring_up("Train", "Classifier")
    model, classify = window.features.classify.training, window.features.classify.model
    model.setup.add(campaign)
    model.setup.set_map("denoised", True)
    wait_for(application, lambda: not model.setup.problem)
    model.train()
    _wait_for_end(application, window, model)
    model.use_model()
    wait_for(application, lambda: classify.track.complete and not classify.busy)
    window.session.playback.seek(3.7)
    wait_until_settled(application, window, LIMIT_S)
    window.messages.dismiss()
    application.processEvents()
    save(window, "classifier.png")
    model.setup.set_value("steps", _COMPARE_STEPS)
    study = window.features.study
    window.bring_up("Train", "Study")
    save(window, "study-page.png")
    study.runs.begin()
    _wait_for_end(application, window, study.runs)
    study.show_result()
    result = window.findChild(ClassResultDialog)
    application.processEvents()
    save(result, "class-result.png")
    result.close()
    window.close()


def export(application: QApplication, sample: Path) -> None:
    """A data set of the sample, as it is written, with its preview sheet."""
    window = opened(application, [sample])
    window.action("export_dataset").trigger()
    dialog, model = window.findChild(ExportDialog), window.features.dataset_export.model
    wait_for(application, lambda: model.ready)
    model.start(sample.with_name("gestures.zarr"))
    wait_for(application, lambda: not model.under_way)
    wait_until_settled(application, window, LIMIT_S)
    save(dialog, "export.png")
    dialog.close()
    window.close()


def batch(application: QApplication, sample: Path) -> None:
    """The batch window after a batch of the sample, seen from nine places."""
    window = opened(application, [sample])
    model = window.features.batch.model
    grid = PlacementGrid((1.5, 2.2, 3.0), (-30.0, 0.0, 30.0))
    model.setup.add(sample)
    model.setup.set_placements(grid, "grid.json")
    window.features.batch.show()
    wait_for(application, lambda: not model.why_not_start)
    model.start()
    wait_for(application, lambda: model.run is not None and model.run.phase == "finished")
    wait_for(application, lambda: model.results.rowCount() > 0)
    wait_until_settled(application, window, LIMIT_S)
    save(window.findChild(BatchWindow), "batch.png")
    window.close()


def _wait_for_end(application: QApplication, window: MainWindow, model: Runs[Any]) -> None:
    """Until a training or a study is over."""
    wait_for(application, lambda: model.run is not None and not model.under_way, _LONG_S)
    wait_until_settled(application, window, LIMIT_S)
