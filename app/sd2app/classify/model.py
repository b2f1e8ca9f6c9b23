"""The classifier in use, the map that it classifies, the probabilities, and all in words."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from PySide6.QtCore import QObject, Signal, SignalInstance

from sd2app.background.latest import LatestRunner, ReportingModel, delayed
from sd2app.background.model_worker.client import ClassifierLibrary, RemoteClassifier
from sd2app.classify.run import ClassRun
from sd2app.classify.track import ClassReading, ClassTrack
from sd2app.denoise.model import DenoiseModel
from sd2app.labels.model import LabelsModel
from sd2app.session.maps import MapModel
from sd2app.session.session import Session
from sd2app.suggestions.model import SearchResult, SpanFinder, Threshold
from sd2app.widgets.model_page import ModelPage, about_sections, map_and_file_rows, model_title
from sd2app.widgets.run_text import PHASES
from sd2core.classify.card import ClassifierCard
from sd2core.classify.files import GESTURES
from sd2core.classify.spans import predicted_spans
from sd2core.cli.classify.trained import Apply
from sd2core.options.records import words_of
from sd2core.options.suggesting import PredictedSpans

_PATIENCE_MS = 1500
"""Delay after the first map before the last session's classifier is loaded."""

_MODEL, _SHOWN, _NONE = "classify/model", "classify/shown", "classify/none"


class ClassifyModel(ReportingModel, SpanFinder):
    """The chosen classifier, remembered and used for all recordings, and the map that it reads.

    It is a finder of suggestions too: of spans that it recognises as gestures.
    """

    title = "classifier"
    threshold = Threshold(
        0.0, 100.0, 50.0, 5.0, 0, " %", "How sure the classifier must be of a span on average"
    )

    changed = Signal()  # the classifier, the map that it reads, or its visibility
    moved = Signal()  # probabilities of frames, or the frame on screen
    counts_changed = Signal()  # probabilities are valid or outdated: sensor moved, or map followed

    def __init__(
        self,
        session: Session,
        denoise: DenoiseModel,
        labels: LabelsModel,
        library: ClassifierLibrary,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        maps = session.maps
        self._real, self._playback, self._settings = maps.real, session.playback, session.settings
        # The denoised one first: it follows the sensor and looks like a radar's.
        self._in_favour = (maps.denoised, maps.real, maps.synthetic)
        self.searched = (maps.synthetic, maps.denoised, maps.real)
        self._labels, self._library = labels, library
        self.track = ClassTrack(denoise.is_current, self)
        # The classifier that is in use or being loaded, and the card of the one in use.
        self.path: Path | None = next(iter(self._settings.paths(_MODEL)), None)
        self.card: ClassifierCard | None = None
        chosen = self.path is not None or self._settings.stored(_NONE, False)
        usual = None if chosen else library.named(GESTURES)
        if usual is not None:
            self.path, self.card = usual.path, usual
        self._problem = ""
        # Under the maps, as the user wants it.
        self.shown = self._settings.stored(_SHOWN, usual is None)
        # The bundled one is loaded once it is asked for.
        self._asleep = usual is not None and not self.shown
        self._runner = LatestRunner("classifier", self, self._set_loaded, self._fail)
        self._patience = delayed(self._load, _PATIENCE_MS, self)
        self.track.changed.connect(self.moved)
        for track in self.searched:
            track.came_or_went.connect(self._follow)
        self._playback.frame_changed.connect(lambda _: self.moved.emit())
        denoise.current_changed.connect(self.counts_changed)
        self.counts_changed.connect(self.moved)

    # --- what is known --------------------------------------------------------------------

    @property
    def loading(self) -> bool:
        """True while it is being loaded."""
        return self._runner.busy

    @property
    def problem(self) -> str:
        """Reason why nothing is classified; empty where something is, or nothing was asked for."""
        return self._problem or self.track.problem

    @property
    def source(self) -> MapModel | None:
        """The map that is looked at: the one chosen, else one of a kind that was learnt from."""
        sources = self.sources
        if self._chosen in sources:
            return self._chosen
        ordered = [one for one in self._in_favour if one in sources]
        known = [one for one in ordered if self._knows(one)]
        return next(iter(known or ordered), None)

    @property
    def knows_source(self) -> bool:
        """True if the classified map is of a kind that the classifier learnt from."""
        return self.source is not None and self._knows(self.source)

    @property
    def visible(self) -> bool:
        """True if there are probabilities and they are to be shown."""
        return self.shown and self.path is not None and self.source is not None

    @property
    def reading(self) -> ClassReading | None:
        """Classes of the frame on screen; None where they are not known."""
        return self.track.at(self._playback.time_s)

    def available(self) -> Sequence[ClassifierCard]:
        """The user's classifiers, and the one in use."""
        cards = list(self._library.available())
        if self.card is not None and self.card.path not in {card.path for card in cards}:
            cards.append(self.card)
        return cards

    def label_of(self, name: str) -> str:
        """Label of a span of a class: the class's own where there is just one."""
        offered = self._labels.labels.label_set
        labels = offered.of_class(name)
        if offered.find(name) is None and len(labels) == 1:
            return labels[0].name
        return name

    def describe(self, path: Path) -> ClassifierCard:
        """Card of a file; raises where it is no classifier."""
        return self._library.describe(path)

    # --- finding gestures -----------------------------------------------------------------

    @property
    def why_not(self) -> str:
        """Reason why no gestures can be found; empty where they can."""
        if self.path is None:
            return "Choose a classifier first, under Model"
        if not self.sources:
            return "There is no map to look in"
        return self.problem

    @property
    def signals(self) -> tuple[SignalInstance, ...]:
        """Signals after which a search may become possible."""
        return (self.track.changed, self.changed)

    @property
    def ready(self) -> bool:
        """True once every frame of the map is classified."""
        return self.track.complete

    def look(self, threshold: float) -> SearchResult:
        """Search."""
        source, card = self.source, self.track.card
        assert source is not None
        assert source.map is not None
        assert card is not None
        doppler = source.map
        spans = predicted_spans(
            self.track.shares,
            doppler.timebase.shifted(source.offset_s),
            card.classes,
            PredictedSpans(min_confidence=threshold / 100.0 or None),
            present=doppler.present,
        )
        named = tuple(replace(span, label=self.label_of(span.label)) for span in spans)
        return SearchResult(named, "" if named else "Nothing: no gesture is that sure")

    def words(self, recording: Path, threshold: float) -> list[str]:
        """Words of ``sd2 classify apply``."""
        command = Apply(
            map=recording,
            of=None if self.source is None else self.source.name,
            model=self.path,
            min_confidence=threshold / 100.0 or None,
            out=Path("found.json"),
        )
        return words_of("classify apply", command)

    # --- requests -------------------------------------------------------------------------

    def use(self, path: Path | None) -> None:
        """Classify with a file, or with none; Sd2Error if the file is no classifier."""
        card = self.describe(path) if path is not None else None
        self.path = None if path is None else Path(path).absolute()
        self._settings.set_paths(_MODEL, [self.path] if self.path is not None else [])
        self._settings.set_value(_NONE, self.path is None)
        self._asleep = False
        self.card = card
        self.track.use(None)
        if path is not None:
            self.set_shown(True)
        self._load()
        self._follow()
        self.changed.emit()

    def wake(self) -> None:
        """Have the classifier loaded, where it waits to be asked for."""
        if self._asleep:
            self._asleep = False
            self._load()

    def set_source(self, source: MapModel | None) -> None:
        """Look at another map; None leaves it to the classifier."""
        self._chosen = source
        self._follow()
        self.changed.emit()

    def set_shown(self, shown: bool) -> None:
        """Show the probabilities under the maps, or not."""
        if shown != self.shown:
            self.shown = shown
            self.wake()
            self._settings.set_value(_SHOWN, shown)
            self.changed.emit()

    # --- following ------------------------------------------------------------------------

    def _knows(self, track: MapModel) -> bool:
        kinds = {track.map.kind} if track.map is not None else set()
        if track is self._real:
            kinds |= {"simulated", "real"}
        return self.card is not None and bool(kinds & set(self.card.trained_on))

    def _follow(self) -> None:
        source = self.source
        if source is not self.track.source:
            self.track.look_at(source)
            self.changed.emit()
        waits = self.path is not None and source is not None and self.track.card is None
        if waits and not (self._asleep or self._problem or self.busy):
            self._patience.start()

    def _load(self) -> None:
        self._patience.stop()
        self._runner.cancel()
        self._problem = ""
        path, library = self.path, self._library
        if path is not None and self.source is not None:
            self._runner.submit(lambda emit: library.load(path))
        self.changed.emit()

    def _set_loaded(self, loaded: RemoteClassifier) -> None:
        self.card = loaded.card
        self.track.look_at(self.source)
        self.track.use(loaded)
        self.changed.emit()

    def _fail(self, error: Exception) -> None:
        self._problem = str(error)
        self.card = None
        super()._fail(error)
        self.changed.emit()


MODEL_WORDS = {"lstm": "LSTM (the paper's)", "s4": "S4", "kernel": "kernel (few recordings)"}
FEATURE_WORDS = {"columns": "all speeds", "peak": "strongest speed alone (the paper's)"}
_KINDS = {
    "simulated": "simulated radar",
    "real": "real radar",
    "synthetic": "synthetic",
    "denoised": "denoised synthetic",
}


def kinds_text(kinds: Iterable[str]) -> str:
    """Kinds of maps; what is simulated is called so."""
    return " and ".join(_KINDS.get(kind, kind) for kind in kinds)


def learned_text(card: ClassifierCard) -> str:
    """Kinds of maps that it learned from, in words."""
    return f"learned from {kinds_text(card.trained_on)} maps"


def network_text(card: ClassifierCard) -> str:
    """Network and features in words."""
    model = MODEL_WORDS.get(card.model, card.model)
    return f"{model}, {FEATURE_WORDS.get(card.features.kind, card.features.kind)}"


def classifier_page(card: ClassifierCard) -> ModelPage:
    """Page with the card of a classifier."""
    rows = [
        ("Kind", f"{network_text(card)}, {card.parameters:,} parameters"),
        ("Learned from", f"{kinds_text(card.trained_on)} maps"),
        ("Classes", ", ".join(card.classes)),
        ("Answers", delay_text(card) + (", having seen what follows" * bool(card.delay_frames))),
        *map_and_file_rows(card.axis, card.frame_rate_hz, card.path),
    ]
    simulated = "real" not in card.trained_on
    return ModelPage(model_title(card), simulated, rows, list(about_sections(card.about)))


def reading_text(reading: ClassReading | None) -> str:
    """The class of a frame and how sure it is."""
    if reading is None:
        return ""
    if reading.nobody:
        return "no person"
    best = reading.best
    text = f"{reading.classes[best]} {100 * reading.shares[best]:.0f} %"
    return f"{text}, {ago_text(reading.ago_s)}" if reading.ago_s else text


def ago_text(seconds: float) -> str:
    """Age of an answer in words."""
    return f"{seconds:.1f} s ago"


def delay_text(card: ClassifierCard) -> str:
    """Delay of the classifier's answers."""
    return f"{card.delay_s:.2g} s late" if card.delay_frames else "at once"


def run_headline(run: ClassRun) -> str:
    """Current phase of the run in words."""
    history = run.history
    if run.phase != "running":
        return PHASES[run.phase]
    return f"Training: step {history.done} of {history.total}"


def note(run: ClassRun) -> str:
    """Advice for a run that was stopped or did not reach its end."""
    if run.phase == "died":
        return "It was killed, or the machine was switched off."
    if run.phase == "stopped":
        return "The best so far is kept." if run.result else "There was nothing to keep yet."
    return ""
