"""Builds the session and every feature; the only place that knows all of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from PySide6.QtWidgets import QWidget

from sd2app.accuracy.feature import AccuracyFeature
from sd2app.agreement.feature import AgreementFeature
from sd2app.background.model_worker.client import ModelProcess, core_classifiers, core_denoisers
from sd2app.batch.feature import BatchFeature
from sd2app.classify.feature import ClassifyFeature
from sd2app.commands.feature import CommandsFeature
from sd2app.dataset_export.feature import DatasetExportFeature
from sd2app.denoise.feature import DenoiseFeature
from sd2app.denoise.text import track_words
from sd2app.feature import Feature, Shell
from sd2app.figures.feature import FiguresFeature
from sd2app.fit.feature import FitFeature
from sd2app.foreign_mesh.feature import ForeignMeshFeature
from sd2app.imu.feature import ImuFeature
from sd2app.labels.feature import LabelsFeature
from sd2app.live.feature import LiveFeature
from sd2app.manual.help import ManualOpener
from sd2app.maps.feature import MapsFeature
from sd2app.maps.heatmap import HeatmapView
from sd2app.maps.stack import MapStack
from sd2app.mesh_comparison.feature import MeshComparisonFeature
from sd2app.playback.feature import PlaybackFeature, TimeRuler
from sd2app.scene.feature import SceneFeature
from sd2app.sensor.feature import SensorFeature
from sd2app.session.session import Session
from sd2app.shell.files import FilesFeature
from sd2app.shell.parts import Parts
from sd2app.shell.program import ProgramFeature
from sd2app.study.feature import StudyFeature
from sd2app.suggestions.feature import SuggestionsFeature
from sd2app.training.feature import TrainingFeature
from sd2app.video.feature import VideoFeature
from sd2app.welcome.feature import WelcomeFeature
from sd2app.welcome.tour import tour_steps
from sd2app.widgets.layouts import pane
from sd2app.widgets.panel import InnerPages, LatePage
from sd2core.cli import build_parser
from sd2core.files.paths import user_cache
from sd2core.labels.recovery import recovery_folder


class Features:
    """All features, which follow the document."""

    # Others are made before these, and ask them later.
    labels: LabelsFeature
    suggestions: SuggestionsFeature
    batch: BatchFeature

    def __init__(self, session: Session, shell: Shell, parts: Parts) -> None:
        process = ModelProcess()
        self.accuracy = accuracy = AccuracyFeature(session, shell, parts.accuracy)
        self.maps = maps = MapsFeature(session, shell, accuracy.model)
        denoisers = parts.denoisers or core_denoisers(process)
        self.denoise = denoise = DenoiseFeature(session, shell, maps.synthesis, denoisers)
        self.fit = FitFeature(session, shell, parts.fit_command)
        self.foreign_mesh = ForeignMeshFeature(session, shell)
        self.video = VideoFeature(
            session,
            shell,
            self.fit.landmarks_at,
            (self.fit.model.changed,),
            lambda menu, place: self.labels.offer_frame(menu, place),
        )
        self.training = TrainingFeature(session, shell, denoise.model, parts.train_command)
        self.labels = labels = LabelsFeature(
            session,
            shell,
            maps.synthesis,
            parts.recovery or recovery_folder(),
            lambda label: self.suggestions.model.accept(label),
        )
        self.sensor = SensorFeature(
            session,
            shell,
            accuracy.model,
            maps.synthesis,
            lambda: self.batch.show_with_placements(),
        )
        self.classify = ClassifyFeature(
            session,
            shell,
            denoise.model,
            labels.model,
            labels.edits,
            parts.classifiers or core_classifiers(process),
            lambda finder: self.suggestions.model.start(finder),
            parts.learn_command,
        )
        self.study = StudyFeature(session, shell, self.classify.training.setup, parts.learn_command)
        finders = (self.classify.model,)
        self.suggestions = SuggestionsFeature(session, shell, labels.edits, finders)
        self.agreement = AgreementFeature(session, shell, labels.model)
        self.mesh_comparison = MeshComparisonFeature(
            session,
            shell,
            self.video.overlay,
            lambda track: HeatmapView(track, session, (labels.over_maps,)),
        )
        self.dataset_export = DatasetExportFeature(session, shell)
        self.batch = BatchFeature(
            session, shell, self.sensor.placements, denoise.model, parts.batch_command
        )
        self.commands = CommandsFeature(session, shell)
        self.figures = FiguresFeature(
            session,
            shell,
            maps.difference,
            lambda: labels.model.labels,
            lambda: track_words(denoise.model.card),
        )
        self.live = LiveFeature(session, shell, parts.listen_command)
        self.playback = PlaybackFeature(session)
        parser = parts.parser or (lambda: build_parser()[0])
        manual = ManualOpener(parser, session.settings, session.parent)
        self.program = ProgramFeature(session, shell, labels, manual)
        self.imu = ImuFeature(session, shell)
        self.files = FilesFeature(
            session,
            shell,
            self.fit.model,
            labels.edits,
            self.imu.model.add_file,
            self.foreign_mesh.ask,
        )
        self.welcome = WelcomeFeature(
            session,
            shell,
            tour_steps(
                session,
                labels.model,
                denoise.model,
                maps.difference,
                self.suggestions.model,
                self.training.model,
                self.training.adoption,
            ),
            self.files.open_sample,
            self.files.reopen,
            parts.pictures or user_cache("pictures"),
        )
        self.scene = SceneFeature(
            session,
            shell,
            maps.synthesis,
            self.sensor.placements,
            self.imu.model,
            maps.limbs,
            labels.offer_frame,
        )
        self._in_order: tuple[Feature, ...] = (
            self.mesh_comparison, self.foreign_mesh, self.sensor, self.suggestions, self.agreement,
            self.dataset_export, self.fit, self.batch, self.commands, self.training, self.study,
            self.classify, self.denoise, self.maps, self.accuracy, self.video, self.labels,
            self.figures, self.live, self.playback, self.program, self.imu, self.files, self.scene,
            self.welcome,
        )  # fmt: skip
        session.document.opened.connect(lambda: _attach(session, self))

    def __iter__(self) -> Iterator[Feature]:
        """Iterate over all of them, in the order in which they are closed."""
        return iter(self._in_order)

    def close(self) -> None:
        """Stop every thread and let go of the files."""
        for feature in self:
            feature.close()


def _attach(session: Session, features: Features) -> None:
    if session.has_content():
        session.attach()
        # Each of them uses what those before it have taken over.
        for feature in (
            features.labels,
            features.suggestions,
            features.agreement,
            features.maps,
            features.fit,
            features.welcome,
        ):
            feature.attach()


def side_pages(features: Features, views: Mapping[str, QWidget]) -> dict[str, QWidget]:
    """Pages of the panel at the side, by their titles."""
    denoisers, classifiers, studies = (
        LatePage(one.panel) for one in (features.training, features.classify, features.study)
    )
    train = InnerPages(
        ("Denoiser", "Train what makes synthetic maps a radar's", denoisers),
        ("Classifier", "Train what tells gestures apart", classifiers),
        ("Study", "Find out whether synthetic data help", studies),
        inset_px=8,
    )
    pages = {**views, "Train": train}
    return {name: pages[name] for name in ("Sensor", "Accuracy", "Train", "Labels", "Agreement")}


def track_stack(
    session: Session, features: Features, views: Mapping[str, QWidget]
) -> tuple[QWidget, MapStack]:
    """Everything over the shared time axis: maps, inertial sensor, labels, ruler; and the maps."""
    labels = features.labels
    maps = features.maps.stack((labels.over_maps,), (labels.over_all,))
    features.denoise.put_buttons(maps)
    fit = features.fit.on_screen
    maps.set_under_way(lambda: fit.under_way, fit.changed)
    inertial = features.imu.track((labels.over_maps,))
    labels.let_drag_on((*maps.views, inertial))
    below = [views[name] for name in ("classes", "labels", "other labels")]
    ruler = TimeRuler(session)
    return pane((maps, 1), inertial, *below, ruler, maps.overview), maps
