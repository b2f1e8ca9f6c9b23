"""Use of a trained model, and its gain over the model before."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from PySide6.QtCore import QObject, Signal

from sd2app.background.latest import ClosingModel, delayed
from sd2app.denoise.model import DenoiseModel
from sd2app.session.session import Maps
from sd2app.training.model import TrainingModel
from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write

CALM_MS = 150


@dataclass(frozen=True)
class Improvement:
    """Mean error of the peak velocity per frame, against the radar's map of the recording.

    ``plain_mps`` is that of the synthetic map, ``before_mps`` of the model that was in use before,
    if there was one; ``frames`` is the number of frames with both maps.
    """

    plain_mps: float
    before_mps: float | None
    now_mps: float
    before_title: str
    frames: int
    simulated: bool


class ModelAdoption(ClosingModel):
    """Keeps the best model of a run among the user's models, and denoises with it.

    ``models`` gives the folder of the user's models.
    """

    changed = Signal()  # the model in use, or its gain
    noted = Signal(str)
    failed = Signal(str)

    def __init__(
        self,
        training: TrainingModel,
        denoise: DenoiseModel,
        maps: Maps,
        models: Callable[[], Path],
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._training, self.denoise, self._maps = training, denoise, maps
        self._models = models
        self._kept: Path | None = None
        self._run: Path | None = None
        self.previous: Path | None = None  # model that was in use before
        self._gain: Improvement | None = None
        self._gain_of: object = None  # the maps that it compares
        self._before: tuple[object, float] | None = None  # maps, and the earlier model's error
        # Maps change many times while one is denoised piece by piece.
        self._calm = delayed(self._compare, CALM_MS, self)
        for changed in (denoise.changed, *(track.changed for track in maps.all)):
            changed.connect(self._wait)

    # --- what is known --------------------------------------------------------------------

    @property
    def run(self) -> Path | None:
        """The run whose model is in use; None when it is another one's."""
        return self._run if self._kept is not None and self.denoise.path == self._kept else None

    @property
    def gain(self) -> Improvement | None:
        """Improvement over the earlier model; None while unknown or without a radar."""
        return self._gain if self.run is not None else None

    @property
    def is_old(self) -> bool:
        """True while the gain is of other maps than those on screen."""
        return self._gain is not None and self._gain_of != (*self._compared(), self._shown())

    @property
    def has_radar(self) -> bool:
        """True if there is a radar's map to compare with."""
        return self._maps.real.map is not None

    # --- what one can do ------------------------------------------------------------------

    def use(self) -> None:
        """Denoise with the best model of the run in view, beside what was there before."""
        run = self._training.run
        if run is None or not run.has_model:
            return
        try:
            kept = self._keep(run.folder.path.name, run.folder.best)
            previous = self.denoise.path
            self.denoise.use(kept)
        except (OSError, Sd2Error) as error:
            self.failed.emit(str(error))
            return
        self._kept, self._run = kept, run.folder.path
        if previous != kept:
            self.previous = previous
        self._gain = self._before = None
        if self.denoise.path != kept:
            self.noted.emit(
                f"The model is kept as {kept.stem}. Open a recording to denoise it with that."
            )
        else:
            self.denoise.set_comparing(self.previous is not None)
        self._compare()

    def go_back(self) -> None:
        """Denoise with the model that was in use before."""
        try:
            self.denoise.use(self.previous)
            self.denoise.set_comparing(False)
        except Sd2Error as error:
            self.failed.emit(str(error))
        self.changed.emit()

    def _keep(self, name: str, best: Path) -> Path:
        """Copy the model to the user's models, so that it outlives the run."""
        folder = self._models()
        folder.mkdir(parents=True, exist_ok=True)
        kept = folder / f"{name}{best.suffix}"
        with atomic_write(kept) as stream:
            stream.write(best.read_bytes())
        return kept

    # --- what it gains --------------------------------------------------------------------

    def _compared(self) -> tuple[object, ...]:
        """Maps on which models are compared: the one to be denoised, and the radar's."""
        plain, radar = self._maps.synthetic, self._maps.real
        return plain.revision, radar.revision, radar.offset_s

    def _shown(self) -> int:
        return self._maps.denoised.revision

    def _wait(self) -> None:
        if self._kept is not None:
            if self.is_old and not self._calm.isActive():
                self.changed.emit()
            self._calm.start()

    def _compare(self) -> None:
        from sd2core.denoise.metrics import velocity_error
        from sd2core.mocap.recording_pairs import on_clock

        maps = self._maps
        plain, now, radar = maps.synthetic.map, maps.denoised.map, maps.real.map
        whole = maps.synthetic.covered is None and maps.denoised.covered is None
        ready = self.run is not None and not self.denoise.busy and whole
        if ready and plain is not None and now is not None and radar is not None:
            target = on_clock(radar.shifted(maps.real.offset_s), plain.timebase)
            true = target.peak_velocity_mps(), target.present
            before, compared = maps.before.map, self._compared()
            if before is not None:
                self._before = compared, velocity_error(before.peak_velocity_mps(), *true).mae_mps
            elif self._before is not None and self._before[0] != compared:
                self._before = None
            off = velocity_error(plain.peak_velocity_mps(), *true)
            gain = Improvement(
                off.mae_mps,
                None if self._before is None else self._before[1],
                velocity_error(now.peak_velocity_mps(), *true).mae_mps,
                self.previous.stem if self.previous is not None else "",
                off.frames,
                radar.kind == "simulated",
            )
            # Without a frame in which the radar saw a movement there is nothing to tell.
            self._gain = gain if off.frames else None
            self._gain_of = *compared, self._shown()
        elif radar is None or now is None:
            self._gain = None
        self.changed.emit()


def gain_summary(gain: Improvement | None, has_radar: bool, *, is_old: bool = False) -> str:
    """Caption of the figures below, or the reason why there are none."""
    if gain is not None and is_old:
        return "Old: the figures are of the map before the one on screen."
    if gain is not None:
        radar = "the simulated radar's" if gain.simulated else "the radar's"
        worse = " Here it is worse than no denoising." if gain.now_mps > gain.plain_mps else ""
        return (
            f"Peak velocity off {radar}, on average over {gain.frames:,} frames of this"
            f" recording.{worse}"
        )
    if not has_radar:
        return "Open a recording with a radar capture to see how much nearer it comes to that."
    return "Denoising this recording…"


def gain_rows(gain: Improvement) -> list[tuple[str, str]]:
    """Errors before and after."""

    def row(name: str, value_mps: float) -> tuple[str, str]:
        text = f"{value_mps:.3f} m/s"
        if name != "not denoised" and gain.plain_mps > 0:
            change = round(100 * (value_mps / gain.plain_mps - 1))
            text += f" ({change:+d} %)".replace("-", "−")
        return name, text

    rows = [row("not denoised", gain.plain_mps)]
    if gain.before_mps is not None:
        rows.append(row(f"before, {gain.before_title}", gain.before_mps))
    return [*rows, row("this model", gain.now_mps)]
