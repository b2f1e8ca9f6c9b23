"""Builds the session and every feature; the only place that knows all of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QWidget

from sd2app.accuracy.feature import AccuracyFeature
from sd2app.agreement.feature import AgreementFeature
from sd2app.background.model_worker.client import ModelProcess
from sd2app.background.model_worker.library import core_classifiers, core_denoisers
from sd2app.batch.feature import BatchFeature
from sd2app.classify.feature import ClassifyFeature
from sd2app.dataset_export.feature import DatasetExportFeature
from sd2app.denoise.feature import DenoiseFeature
from sd2app.denoise.text import track_words
from sd2app.denoise.validity import MapValidity
from sd2app.feature import Feature, Shell
from sd2app.figures.feature import FiguresFeature
from sd2app.fit.feature import FitFeature
from sd2app.labels.feature import LabelsFeature
from sd2app.maps.feature import MapsFeature
from sd2app.maps.stack import MapStack
from sd2app.mesh_comparison.feature import MeshComparisonFeature
from sd2app.playback.feature import PlaybackFeature
from sd2app.playback.views import TimeRuler
from sd2app.scene.feature import SceneFeature
from sd2app.sensor.feature import SensorFeature
from sd2app.session.session import Session
from sd2app.shell.files import FilesFeature
from sd2app.shell.parts import Parts
from sd2app.shell.program import ProgramFeature
from sd2app.suggestions.feature import SuggestionsFeature
from sd2app.training.feature import TrainingFeature
from sd2app.video.feature import VideoFeature
from sd2app.widgets.layouts import pane
from sd2app.widgets.pages import InnerPage, paged_panel
from sd2core.labels.recovery import recovery_folder


@dataclass(frozen=True)
class Features:
    """All features, in the order in which they are closed."""

    mesh_comparison: MeshComparisonFeature
    sensor: SensorFeature
    suggestions: SuggestionsFeature
    agreement: AgreementFeature
    dataset_export: DatasetExportFeature
    fit: FitFeature
    batch: BatchFeature
    training: TrainingFeature
    classify: ClassifyFeature
    denoise: DenoiseFeature
    maps: MapsFeature
    accuracy: AccuracyFeature
    video: VideoFeature
    labels: LabelsFeature
    figures: FiguresFeature
    playback: PlaybackFeature
    program: ProgramFeature
    files: FilesFeature
    scene: SceneFeature

    def __iter__(self) -> Iterator[Feature]:
        return (getattr(self, field.name) for field in fields(self))

    def close(self) -> None:
        """Stop every thread and let go of the files."""
        for feature in self:
            feature.close()


def build_features(session: Session, shell: Shell, parts: Parts, parent: QObject) -> Features:
    """Make all features and let them follow the document."""
    process = ModelProcess()
    accuracy = AccuracyFeature(session, shell, parts.accuracy, parent)
    maps = MapsFeature(session, shell, accuracy.model, parent)
    denoisers = parts.denoisers or core_denoisers(process)
    denoise = DenoiseFeature(session, shell, maps.synthesis, denoisers, parent)
    fit = FitFeature(session, shell, parts.fit_command, parent)
    video = VideoFeature(session, shell, fit, parent)
    training = TrainingFeature(session, shell, denoise.model, parts.train_command, parent)
    labels = LabelsFeature(
        session,
        shell,
        parts.recovery or recovery_folder(),
        lambda label: features.suggestions.model.accept(label),
        parent,
    )
    sensor = SensorFeature(
        session,
        shell,
        accuracy.model,
        maps.synthesis,
        lambda: features.batch.show_with_placements(),
        parent,
    )
    classify = ClassifyFeature(
        session,
        shell,
        MapValidity(session, maps.synthesis, denoise.model, parent),
        labels.model,
        labels.edits,
        parts.classifiers or core_classifiers(process),
        lambda finder: features.suggestions.model.start(finder),
        parent,
    )
    suggestions = SuggestionsFeature(session, shell, labels.edits, (classify.gestures,), parent)
    agreement = AgreementFeature(session, shell, labels.model, parent)
    features = Features(
        mesh_comparison=MeshComparisonFeature(
            session,
            shell,
            video.overlay,
            lambda track: maps.view_of(track, (labels.over_maps,)),
        ),
        sensor=sensor,
        suggestions=suggestions,
        agreement=agreement,
        dataset_export=DatasetExportFeature(session, shell, parent),
        fit=fit,
        batch=BatchFeature(
            session,
            shell,
            sensor.placements,
            denoise.model.installed,
            parts.batch_command,
            parent,
        ),
        training=training,
        classify=classify,
        denoise=denoise,
        maps=maps,
        accuracy=accuracy,
        video=video,
        labels=labels,
        figures=FiguresFeature(
            session,
            shell,
            maps.difference,
            lambda: labels.model.labels,
            lambda: track_words(denoise.model.card),
        ),
        playback=PlaybackFeature(session),
        program=ProgramFeature(session, shell, labels),
        files=FilesFeature(session, shell),
        scene=SceneFeature(session, shell, maps.synthesis, sensor.placements),
    )
    session.document.opened.connect(lambda: _take_over(session, features))
    return features


def _take_over(session: Session, features: Features) -> None:
    if session.has_content:
        session.take_over()
        # Each of them uses what those before it have taken over.
        for feature in (
            features.labels,
            features.suggestions,
            features.agreement,
            features.maps,
            features.fit,
        ):
            feature.take_over()


def side_pages(features: Features, views: Mapping[str, QWidget]) -> dict[str, QWidget]:
    """Pages of the panel at the side, by their titles."""
    denoisers, classifiers = features.training.panel(), features.classify.panel()
    train = paged_panel(
        InnerPage("Denoiser", "Train what makes synthetic maps a radar's", denoisers),
        InnerPage("Classifier", "Train what tells gestures apart", classifiers),
    )
    return {
        "Sensor": views["Sensor"],
        "Accuracy": views["Accuracy"],
        "Train": train,
        "Labels": views["Labels"],
        "Agree": views["Agree"],
    }


def track_stack(
    session: Session, features: Features, views: Mapping[str, QWidget]
) -> tuple[QWidget, MapStack]:
    """Everything over the shared time axis: maps, labels, ruler, overview; and the maps of it."""
    labels = features.labels
    maps = features.maps.stack((labels.over_maps,), (labels.over_all,))
    features.denoise.put_buttons(maps)
    labels.let_drag_on(maps.views)
    below = [views[name] for name in ("classes", "suggestions", "labels", "other labels")]
    ruler = TimeRuler(session)
    return pane((maps, 1), *below, ruler, maps.overview), maps
