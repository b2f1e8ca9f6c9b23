"""What the side panel of the window holds, built in one place."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from sd2app.accuracy.panel import AccuracyPanel
from sd2app.agreement.panel import AgreementPanel
from sd2app.classify.panel import ClassPanel
from sd2app.labels.label_set_dialog import LabelSetDialogs
from sd2app.labels.panel import LabelsPanel
from sd2app.sensor.panel import SensorPages, SensorPanel
from sd2app.sensor.placement_dialogs import PlacementDialogs
from sd2app.sensor.placements_page import PlacementsPage
from sd2app.shell.side_panel import SidePanel
from sd2app.training.dialogs import TrainingDialogs
from sd2app.training.page import TrainPage
from sd2app.training.panel import TrainingPanel

if TYPE_CHECKING:
    from sd2app.shell.menus import ActionSet
    from sd2app.shell.window import MainWindow


class SidePages(NamedTuple):
    """The panel, those of its pages that actions turn, and what a page asks."""

    side: SidePanel
    sensor: SensorPages
    train: TrainPage
    labels: LabelsPanel
    train_dialogs: TrainingDialogs


def side_pages(window: MainWindow, actions: ActionSet) -> SidePages:
    """Build them for a window whose dialogs of batches and classifiers stand."""
    c, report = window.context, window.messages.warn
    to_camera, aim = actions["sensor_to_camera"], actions["aim_sensor"]
    asks_places = PlacementDialogs(window, c.placements, report, window.messages.note)
    sensor = SensorPages(
        SensorPanel(c.sensor, c.document, c.synthesis, c.edits, to_camera, aim),
        PlacementsPage(
            c.placements,
            c.trade,
            asks_places.take,
            asks_places.export,
            window.batch_dialogs.show_with_placements,
        ),
    )
    asks_training = TrainingDialogs(window, c.training, c.training_use, report)
    train = TrainPage(
        TrainingPanel(c.training, c.training_use, c.display, asks_training),
        ClassPanel(c.class_training, c.display, window.class_dialogs),
    )
    asks_labels = LabelSetDialogs(window, c.labels, c.label_edits.apply, report)
    labels = LabelsPanel(c, actions, asks_labels)
    side = SidePanel(
        {
            "Sensor": sensor,
            "Accuracy": AccuracyPanel(c.trade, c.display, actions["measure"]),
            "Train": train,
            "Labels": labels,
            "Agree": AgreementPanel(c.agreement, c.playback, actions),
        }
    )
    return SidePages(side, sensor, train, labels, asks_training)
