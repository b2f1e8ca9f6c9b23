"""The model that denoises the recording, and the map that it makes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from PySide6.QtCore import QObject, Signal

from sd2app.background.latest import LatestRunner, ReportingModel, delayed
from sd2app.background.model_worker.client import DenoiserLibrary, RemoteDenoiser
from sd2app.denoise.map import TEXTURE_SEED, DenoisedMap
from sd2app.denoise.text import origin_words, track_words
from sd2app.maps.model import SynthesisModel
from sd2app.maps.partial_map import Part
from sd2app.maps.quality import Postprocess
from sd2app.session.maps import MapModel
from sd2app.session.session import Session
from sd2app.widgets.text import quoted
from sd2core.cli.denoise import Denoise
from sd2core.denoise.files import default_name
from sd2core.errors import Sd2Error
from sd2core.files.resources import is_bundled
from sd2core.options.records import words_of

if TYPE_CHECKING:
    from sd2core.denoise.card import ModelCard

_TEXTURED, _LIVE = "textured", "denoise_live"
_PATIENCE_MS = 2000
"""Longest delay of the first model, which waits for the synthetic map."""


class _Choice(NamedTuple):
    """Fields of a recording: a file, the name of a bundled model (empty: none), or neither."""

    denoiser: Path | None = None
    bundled_denoiser: str | None = None


_UNSAID, _NO_MODEL = _Choice(), _Choice(bundled_denoiser="")
"""The bundled default, where there is one; and the map as it is."""


class DenoiseModel(ReportingModel):
    """Follows the recording's choice, loads the model in the background, and uses it."""

    changed = Signal()  # choice, model or comparison
    current_changed = Signal()  # which maps are of the sensor's present place
    noted = Signal(str)

    def __init__(
        self, session: Session, synthesis: SynthesisModel, library: DenoiserLibrary, parent: QObject
    ) -> None:
        super().__init__(parent)
        self._session, self._synthesis, self._library = session, synthesis, library
        self._document, self._synthetic = session.document, session.maps.synthetic
        self.map, self.before_map = (
            DenoisedMap(track, session, self)
            for track in (session.maps.denoised, session.maps.before)
        )
        self.path: Path | None = None  # of the model that is in use or being loaded
        self.problem = ""  # why the chosen model is not in use; empty where it is
        self._choice = _UNSAID
        self._loaded: RemoteDenoiser | None = None
        self._before: RemoteDenoiser | None = None
        self._comparing = False
        self.textured, self.live = (  # by the user
            session.settings.stored(name, False) for name in (_TEXTURED, _LIVE)
        )
        self._awake = False
        self._splits = True  # False once it is known that the mesh's parts are not
        self._runner = LatestRunner("denoiser", self, self._set_model, self._fail)
        self._patience = delayed(self._wake, _PATIENCE_MS, self)
        self.map.failed.connect(self._say_problem)
        self.map.idle.connect(self.changed)
        self.before_map.failed.connect(lambda _: self.set_comparing(False))
        self._document.opened.connect(self._open)
        self._document.changed.connect(self._follow)
        synthesis.postprocess = self._postprocess
        synthesis.painted.connect(self._take)
        synthesis.completed.connect(self._wake)
        synthesis.completed.connect(self._check_parts)
        self._synthetic.changed.connect(self._watch)
        for signal in (self._synthetic.changed, self.changed):
            signal.connect(self._keep_place)
        playing_changed = session.playback.playing_changed
        for signal in (self._synthetic.changed, self.changed, playing_changed):
            signal.connect(self._follow_clock)
        moved = session.sensor.changed, synthesis.moving_changed
        for signal in (*moved, synthesis.completed, synthesis.painted):
            signal.connect(self.current_changed)

    # --- what is known --------------------------------------------------------------------

    @property
    def card(self) -> ModelCard | None:
        """Card of the model in use."""
        return self._loaded.card if self._loaded else None

    @property
    def before(self) -> ModelCard | None:
        """Card of the model that was in use before this one."""
        return self._before.card if self._before else None

    @property
    def comparing(self) -> bool:
        """True while the previous model's map is shown as well."""
        return self._comparing and self._before is not None

    @property
    def busy(self) -> bool:
        """True while a model is being loaded or a map denoised."""
        waiting = self.path is not None and self._patience.isActive()
        return waiting or any(worker.busy for worker in self._workers())

    @property
    def can_export(self) -> bool:
        """True if there is a map to write."""
        return self._loaded is not None and self._synthesis.complete

    def is_current(self, track: MapModel) -> bool:
        """True while a map is of the sensor's place, and it rests; only two follow the sensor."""
        maps = self._session.maps
        if track not in (maps.synthetic, maps.denoised):
            return True
        rests = not self._synthesis.moving and self._synthesis.shows_sensor
        return rests and (track is maps.synthetic or self.map.shows_source)

    def available(self) -> Sequence[ModelCard]:
        """Models that can be chosen by name, and the one that is chosen."""
        cards = list(self._library.available())
        known = {card.path for card in cards}
        return [*cards, *(one for one in (self.before, self.card) if one and one.path not in known)]

    def by_name(self) -> dict[str, ModelCard]:
        """Models that can be chosen, as commands call them: an installed one by its name."""
        installed = [card.path for card in self._library.available()]
        return {
            card.name if card.path in installed else str(card.path): card
            for card in self.available()
        }

    # --- requests -------------------------------------------------------------------------

    def use(self, path: Path | None) -> None:
        """Denoise this recording with a model file, or with none; can be undone.

        Raises Sd2Error if the file is no model.
        """
        if self._document.recording is None:
            self.noted.emit("Open a recording first: a model is chosen for a recording.")
            return
        if path is not None:
            self._library.describe(path)
        choice = _NO_MODEL if path is None else _Choice(denoiser=path.absolute())
        if path is not None and is_bundled(path):
            choice = _Choice(bundled_denoiser=path.stem)
        if choice == self._choice and self._loaded is None:
            self.problem = ""
            self._load()  # once more, after it failed
        self._session.edits.change("Choose denoiser", choice._asdict())

    def set_comparing(self, comparing: bool) -> None:
        """Show the map of the model before beside that of this one, or not."""
        if comparing != self._comparing:
            self._comparing = comparing
            self._show_before()
            self.changed.emit()

    def set_textured(self, textured: bool) -> None:
        """Show the map as the radar would, with its speckle and gaps, or the mean."""
        self.textured = textured
        self._session.settings.set_value(_TEXTURED, textured)
        self._set_model(self._loaded)

    def set_live(self, live: bool) -> None:
        """Denoise frame by frame while playing, or the whole map."""
        self.live = live
        self._session.settings.set_value(_LIVE, live)
        self.changed.emit()

    def export(self, path: Path) -> None:
        """Write what the model makes of the synthetic map on screen, with its provenance.

        Raises Sd2Error if there is none yet.
        """
        if self._loaded is None:
            raise Sd2Error("No model denoises this recording", "one", "Choose it under Model")
        made = self._loaded.denoise(self._synthesis.whole_map())
        texture = self._loaded.card.texture
        if self.textured and texture is not None:
            made = texture.on(made, TEXTURE_SEED)
        made.save(path)

    def line(self, name: str) -> str:
        """Commands for a terminal: the synthetic map, and what this model makes of it."""
        assert self.card is not None
        synthetic = Path(name.replace("-denoised", "-synthetic"))
        model = next(named for named, card in self.by_name().items() if card.path == self.card.path)
        textured = self.textured and self.card.texture is not None
        seed = TEXTURE_SEED if textured else None
        denoise = Denoise(map=synthetic, out=Path(name), model=model, texture=seed)
        return f"{self._synthesis.line(synthetic.name)} && {quoted(words_of('denoise', denoise))}"

    def close(self) -> None:
        """Stop computing and let go of the models."""
        self._runner.cancel()
        self._library.close()
        super().close()

    # --- following the recording ----------------------------------------------------------

    def _open(self) -> None:
        # What was in use for another recording is nothing to compare with here.
        previous, self._loaded, self._before = self._loaded, None, None
        self._comparing = False
        self._splits = True
        self._show_before()
        self._follow(fresh=True)
        if previous is not None and previous.card.path == self.path:
            self._loaded = previous
        else:
            self.map.use(None)

    def _follow(self, fresh: bool = False) -> None:
        choice, recording = _UNSAID, self._document.recording
        if recording is not None:
            bundled = None if recording.denoiser else recording.bundled_denoiser
            choice = _Choice(recording.denoiser, bundled)
        if choice == self._choice and not fresh:
            return
        self._choice = choice
        self.problem = ""
        path = self._path_of(choice)
        if path != self.path or path is None:
            self.path = path
            self._load()
        self.changed.emit()

    def _path_of(self, choice: _Choice) -> Path | None:
        if self._document.recording is None or choice == _NO_MODEL:
            return None
        if choice.denoiser is not None:
            # What is missing was said when the recording was opened.
            exists = choice.denoiser.is_file()
            self.problem = "" if exists else f"The model {choice.denoiser} is not there"
            return choice.denoiser if exists else None
        name = choice.bundled_denoiser
        card = self._library.named(name or default_name(limbs=self._splits))
        if card is None and name:
            self._say_problem(
                f"This recording was denoised with the model {name}, which does not"
                " come with this version. Choose another under Model."
            )
        return card.path if card is not None else None

    def _load(self) -> None:
        """Load what is chosen, once it can be used."""
        self._runner.cancel()
        path = self.path
        if path is None:
            self._set_model(None)
        elif self._before is not None and self._before.card.path == path:
            self._set_model(self._before)
        elif self._awake:
            library = self._library
            self._runner.submit(lambda emit: library.load(path))

    def _watch(self) -> None:
        if self._synthetic.map is None:
            self._awake = False
            self._patience.stop()
            self.map.clear()
            self.before_map.clear()
        elif not self._awake and not self._patience.isActive():
            self._patience.start()

    def _wake(self) -> None:
        """Load the waiting model: the synthetic map is complete, or the delay is over."""
        self._patience.stop()
        if self._awake or self._synthetic.map is None:
            return
        self._awake = True
        loaded = self._loaded.card.path if self._loaded else None
        if self.path is not None and loaded != self.path:
            self._load()
        self.changed.emit()

    def _follow_clock(self) -> None:
        known = self._synthetic.map is not None and self.map.denoiser is not None
        self.map.set_live(self.live and known and self._session.playback.playing)

    def _keep_place(self) -> None:
        """Have a map that comes later not move those below it."""
        coming = self.path is not None and not self.problem and self._synthetic.map is not None
        self.map.track.set_awaited(coming)

    # --- the model ------------------------------------------------------------------------

    def _set_model(self, loaded: RemoteDenoiser | None) -> None:
        if self._loaded is not None and loaded is not self._loaded:
            self._before = self._loaded
        self._loaded = loaded
        self._synthesis.want_limbs("denoiser", loaded is not None and bool(loaded.card.parts))
        # The model's name stands beside the title, on the button that chooses it.
        if loaded is None:
            self.map.use(None)
        else:
            texture = loaded.card.texture if self.textured else None
            words = ("drawn · " if texture is not None else "") + origin_words(loaded.card)
            self.map.use(loaded, words, texture)
        self._show_before()
        self.changed.emit()

    def _show_before(self) -> None:
        shown = self._before if self._comparing else None
        wanting = shown is not None and bool(shown.card.parts)
        self._synthesis.want_limbs("the denoiser before", wanting)
        if shown is None:
            self.before_map.use(None)
        else:
            self.before_map.use(shown, track_words(shown.card))

    def _fail(self, error: Exception) -> None:
        self._set_model(None)
        self._say_problem(str(error))

    def _say_problem(self, words: str) -> None:
        self.problem = words
        self._loaded = None
        # The user did not ask for the default; that it cannot be used here is no failure.
        if self._choice != _UNSAID:
            self.failed.emit(words)
        self.changed.emit()

    def _check_parts(self) -> None:
        """Without parts of the body, take the model for the map, or say that one needs them."""
        card, made = self.card, self._synthetic.map
        known = made is not None and made.limbs is not None and made.limbs.of_everybody
        if card is None or not card.parts or known or not self._synthesis.complete:
            return
        self.map.use(None)
        self._loaded = None
        if self._choice == _UNSAID:
            self._splits = False
            self._follow(fresh=True)
        else:
            self._say_problem(
                f"{track_words(card)} takes the Doppler of the parts of the body, which are not"
                " known of this mesh. Choose another under Model."
            )

    # --- following the synthetic map ------------------------------------------------------

    def _postprocess(self) -> Postprocess | None:
        """Postprocessing of a sweep, which makes both maps."""
        parts = [one.postprocess() for one in (self.map, self.before_map)]
        if not any(parts):
            return None
        return lambda swept: [part and part(swept) for part in parts]

    def _take(self, part: Part) -> None:
        for number, one in enumerate((self.map, self.before_map)):
            if self._synthesis.moving:
                made = part.more[number] if part.more is not None else None
                one.take_sweep(part.sensor, part.start, made)
            else:
                one.take(part.sensor)
