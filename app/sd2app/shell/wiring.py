"""Builds the models once and passes them on; there is no other shared state."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from PySide6.QtCore import QObject

from sd2app.accuracy.ladder import CORE, Ladder
from sd2app.accuracy.model import AccuracyModel
from sd2app.agreement.model import AgreementModel
from sd2app.background.model_worker.client import DenoiseProcess
from sd2app.batch.estimate import COMMAND as BATCH_COMMAND
from sd2app.batch.model import BatchModel
from sd2app.classify.finder import GestureFinder
from sd2app.classify.library import ClassifierLibrary, core_classifiers
from sd2app.classify.model import ClassifyModel
from sd2app.classify.training import ClassTraining
from sd2app.dataset_export.model import ExportModel
from sd2app.denoise.library import DenoiserLibrary, core_library
from sd2app.denoise.live import LiveDenoiseModel
from sd2app.denoise.model import DenoiseModel
from sd2app.denoise.validity import MapValidity
from sd2app.fit.clock import FitFollower
from sd2app.fit.importer import FitTaker
from sd2app.fit.model import COMMAND, FitModel
from sd2app.fit.offer import FitOffer
from sd2app.labels.autosave import LabelSession
from sd2app.labels.cut_out_model import CutOutModel
from sd2app.labels.dragging import LabelDragging
from sd2app.labels.edits import LabelEdits
from sd2app.labels.loop import SpanLoop
from sd2app.labels.marking import LabelMarking
from sd2app.labels.model import LabelsModel
from sd2app.labels.reaction import ReactionModel
from sd2app.labels.track_edits import LabelTracks
from sd2app.maps.difference import DifferenceModel
from sd2app.maps.model import SynthesisModel
from sd2app.maps.uncertainty import UncertaintyModel
from sd2app.sensor.placements import PlacementsModel
from sd2app.session.content import reference_of
from sd2app.session.display import DisplayModel
from sd2app.session.document import DocumentModel
from sd2app.session.playback import PlaybackModel
from sd2app.session.sensor import SensorModel
from sd2app.session.tasks import TaskList
from sd2app.session.time_window import TimeWindow
from sd2app.session.tracks import MapModel, PointerModel
from sd2app.session.undo import Edits
from sd2app.session.video import VideoModel
from sd2app.settings import Settings
from sd2app.shell.actions import ACTIONS
from sd2app.shell.keys.bindings import KeyBindings
from sd2app.suggestions.finders import MotionFinder
from sd2app.suggestions.model import SuggestionsModel
from sd2app.training.model import COMMAND as TRAIN_COMMAND
from sd2app.training.model import TrainingModel
from sd2app.training.result import TrainingUse
from sd2app.video.overlay_settings import OverlayModel
from sd2core.denoise.files import user_models_folder
from sd2core.labels.recovery import recovery_folder


@dataclass(frozen=True)
class Context:
    """Everything a window is about."""

    settings: Settings
    jobs: TaskList
    document: DocumentModel
    playback: PlaybackModel
    video: VideoModel
    sensor: SensorModel
    display: DisplayModel
    overlay: OverlayModel
    span: TimeWindow
    pointer: PointerModel
    synthetic: MapModel
    denoised: MapModel
    before: MapModel
    real: MapModel
    trade: AccuracyModel
    synthesis: SynthesisModel
    placements: PlacementsModel
    uncertainty: UncertaintyModel
    denoise: DenoiseModel
    live: LiveDenoiseModel
    classify: ClassifyModel
    gestures: GestureFinder
    class_training: ClassTraining
    difference: DifferenceModel
    edits: Edits
    labels: LabelsModel
    keys: KeyBindings
    label_session: LabelSession
    label_edits: LabelEdits
    suggestions: SuggestionsModel
    agreement: AgreementModel
    cut_out: CutOutModel
    label_dragging: LabelDragging
    label_marking: LabelMarking
    label_tracks: LabelTracks
    reaction: ReactionModel
    span_loop: SpanLoop
    fit: FitModel
    fit_follower: FitFollower
    fit_offer: FitOffer
    fit_taker: FitTaker
    batch: BatchModel
    training: TrainingModel
    training_use: TrainingUse
    export: ExportModel

    @property
    def tracks(self) -> tuple[MapModel, ...]:
        """All maps, from top to bottom."""
        return (self.synthetic, self.denoised, self.before, self.real)

    def reset_references(self) -> None:
        """Make the strongest bin of each map 0 dB."""
        for track in self.tracks:
            if track.map is not None:
                track.set_reference(reference_of(track.map.values, track.map.null_bins))

    def close(self) -> None:
        """Stop every thread and let go of the files."""
        self.playback.pause()
        self.placements.close()
        self.suggestions.close()
        self.agreement.close()
        self.cut_out.close()
        self.export.close()
        self.fit.close()
        self.batch.close()
        self.training_use.close()
        self.training.close()
        self.uncertainty.close()
        self.live.close()
        self.class_training.close()
        self.classify.close()
        self.denoise.close()
        self.synthesis.close()
        self.trade.close()
        self.video.close()
        self.label_session.close()
        self.document.close()


def build_context(
    parent: QObject,
    settings: Settings,
    ladder: Ladder | None = None,
    fit_command: Sequence[str] | None = None,
    denoisers: DenoiserLibrary | None = None,
    train_command: Sequence[str] | None = None,
    recovery: Path | None = None,
    batch_command: Sequence[str] | None = None,
    classifiers: ClassifierLibrary | None = None,
) -> Context:
    """Make the models and let them follow the document.

    Ladder, denoisers and classifiers are the library's, the commands that fit, train and work
    in batches ``sd2`` itself, and the recovery folder of labels is the user's by default.
    """
    jobs = TaskList(parent)
    document = DocumentModel(jobs, parent)
    playback = PlaybackModel(parent)
    sensor = SensorModel(parent)
    span = TimeWindow(parent)
    synthetic = MapModel("Synthetic", parent)
    denoised, before = MapModel("Denoised", parent), MapModel("Denoised before", parent)
    real = MapModel("Real", parent)
    trade = AccuracyModel(jobs, settings, ladder or CORE, parent)
    fit = FitModel(settings, parent, fit_command or COMMAND)
    follower = FitFollower(fit, document, playback, parent)
    synthesis = SynthesisModel(document, sensor, playback, span, synthetic, jobs, trade, parent)
    display, edits = DisplayModel(parent), Edits(document, sensor)
    process = DenoiseProcess()
    denoise = DenoiseModel(
        document,
        synthesis,
        span,
        synthetic,
        denoised,
        before,
        jobs,
        denoisers or core_library(process),
        edits.choose_denoiser,
        parent,
    )
    training = TrainingModel(settings, parent, train_command or TRAIN_COMMAND)
    labels = LabelsModel(parent)
    label_session = LabelSession(document, labels, recovery or recovery_folder(), parent)
    label_edits = LabelEdits(document, labels, playback, label_session, parent)
    reaction = ReactionModel(settings, parent)
    maps = (synthetic, denoised, real)
    library = classifiers or core_classifiers(process)
    validity = MapValidity(sensor, synthesis, denoise, synthetic, denoised, parent)
    classify = ClassifyModel(maps, playback, validity, labels, settings, library, parent)
    gestures = GestureFinder(classify)
    context = Context(
        settings=settings,
        jobs=jobs,
        document=document,
        playback=playback,
        video=VideoModel(playback, parent),
        sensor=sensor,
        display=display,
        overlay=OverlayModel(settings, parent),
        span=span,
        pointer=PointerModel(parent),
        synthetic=synthetic,
        denoised=denoised,
        before=before,
        real=real,
        trade=trade,
        synthesis=synthesis,
        placements=PlacementsModel(document, sensor, trade, edits, parent),
        uncertainty=UncertaintyModel(document, synthesis, trade, synthetic, jobs, settings, parent),
        denoise=denoise,
        live=LiveDenoiseModel(playback, synthetic, denoise, settings, parent),
        classify=classify,
        gestures=gestures,
        class_training=ClassTraining(
            settings, classify.use, parent, step_times=training.step_times
        ),
        difference=DifferenceModel(denoised, real, display, settings, parent),
        edits=edits,
        labels=labels,
        keys=KeyBindings(ACTIONS, labels, settings, parent),
        label_session=label_session,
        label_edits=label_edits,
        suggestions=SuggestionsModel(
            labels,
            playback,
            (MotionFinder(maps), gestures),
            document.undo_stack,
            label_edits.apply,
            parent,
        ),
        agreement=AgreementModel(labels, playback, span, parent),
        cut_out=CutOutModel(
            document, {"synthetic": synthetic, "denoised": denoised, "radar": real}, jobs, parent
        ),
        label_dragging=LabelDragging(labels, playback, label_edits, parent),
        label_marking=LabelMarking(labels, playback, reaction, label_edits, parent),
        label_tracks=LabelTracks(labels, label_edits),
        reaction=reaction,
        span_loop=SpanLoop(labels, playback, parent),
        fit=fit,
        fit_follower=follower,
        fit_offer=FitOffer(document, fit, parent),
        fit_taker=FitTaker(fit, follower, document, settings, parent),
        batch=BatchModel(settings, parent, batch_command or BATCH_COMMAND),
        training=training,
        training_use=TrainingUse(
            training, denoise, synthetic, before, denoised, real, user_models_folder, parent
        ),
        export=ExportModel(jobs, parent),
    )
    context.label_edits.done_at.connect(span.reveal_any)
    document.opened.connect(lambda: _take_over(context))
    document.changed.connect(lambda: _follow_capture(context))
    playback.frame_changed.connect(
        lambda _: playback.playing and span.reveal(playback.time_s)  # turn the page
    )
    return context


def _take_over(context: Context) -> None:
    document = context.document
    content = document.content
    if content is None:
        return
    context.playback.set_timebase(content.timebase)
    context.span.set_extent(content.timebase.start_s, content.timebase.end_s)
    context.video.set_reader(content.video)
    context.sensor.set_sensor(content.recording.sensor)
    context.label_session.take_over()
    context.suggestions.open()
    context.agreement.clear()
    _follow_capture(context, new=True)
    context.synthesis.take_over()
    # The clock of another recording begins anew, which is nobody's wish to stay.
    context.fit_follower.set_following(True)


def _follow_capture(context: Context, new: bool = False) -> None:
    document, real = context.document, context.real
    radar_map, recording = document.radar_map, document.recording
    if recording is not None:
        real.set_offset(recording.radar_offset_s)
    content = document.content
    brought = content is not None and content.radar_labels is not None
    if brought and recording is not None and recording.unlabelled:
        context.labels.set_labels(document.labels)  # they are on the radar's clock
    if radar_map is real.map and not new:
        return
    real.title = "Radar (simulated)" if radar_map and radar_map.kind == "simulated" else "Real"
    # Another way of removing clutter is compared against the same 0 dB.
    if radar_map is not None and new:
        real.set_reference(reference_of(radar_map.values, radar_map.null_bins))
    real.set_map(radar_map)
