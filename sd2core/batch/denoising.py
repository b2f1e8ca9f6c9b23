"""Task that denoises a synthetic map."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sd2core.denoise.resample_to_model import input_of
from sd2core.denoise.texture import content_of
from sd2core.maps import DopplerMap

if TYPE_CHECKING:
    from sd2core.denoise.live import TrainedDenoiser


def denoise(
    maps: Sequence[Path], model: str, digest: str, outs: Sequence[Path], texture: int | None = None
) -> None:
    """Denoise a map, given in parts in order, and write one file per part, in order.

    Parameters
    ----------
    maps : sequence of Path
        Files of the parts.
    model : str
        File of the denoiser.
    digest : str
        Hash of that file's content: a worker loads the model again when it is another.
    outs : sequence of Path
        Files to write, as many as ``maps``.
    texture : int, optional
        Seed with which a map is drawn as a radar would show it; that of several parts is known by
        the first of them. None leaves the texture out; Sd2Error if the model knows none.
    """
    trained = _model(model, digest)
    outs[0].parent.mkdir(parents=True, exist_ok=True)
    if len(maps) == 1:
        denoised = trained.denoise(DopplerMap.load(maps[0]))
        if texture is not None:
            denoised = trained.card.needed_texture().on(denoised, texture)
        denoised.save(outs[0])
    else:
        _denoise_long(trained, maps, outs, texture)


def _denoise_long(
    trained: TrainedDenoiser, maps: Sequence[Path], outs: Sequence[Path], texture: int | None
) -> None:
    """Denoise one stretch after the other, keeping the model's state."""
    from sd2core.denoise.live import denoise_long
    from sd2core.denoise.resample_to_model import check_map, clips, is_regular

    files, rate_hz = _Files(maps, trained.card.parts), trained.card.frame_rate_hz
    check_map(files.part(0), trained.card)
    runs = clips(files.times_s, files.present_mask, rate_hz)
    regular = all(is_regular(files.times_s[start:stop], rate_hz) for start, stop in runs)
    writer = _Writer(trained, files, outs, resampled=not regular, texture=texture)
    denoise_long(trained, runs, files.times_s, files.read, writer.take)
    writer.end()


class _Files:
    """Frames from the files of stretches; the last two stay in memory."""

    def __init__(self, maps: Sequence[Path], parts: Sequence[str]) -> None:
        self._parts = parts
        self.part = lru_cache(maxsize=2)(lambda number: DopplerMap.load(maps[number]))
        times_s, present = [], []
        for number in range(len(maps)):
            part = self.part(number)
            times_s.append(part.times_s)
            present.append(part.present_mask)
        self.times_s = np.concatenate(times_s)
        self.present_mask = np.concatenate(present)
        self.edges = np.cumsum([0, *map(len, times_s)])

    def holding(self, frame: int) -> int:
        """Return the stretch that holds a frame of the whole map."""
        return int(np.searchsorted(self.edges, frame, side="right")) - 1

    def read(self, start: int, stop: int) -> NDArray[np.float32]:
        """Return energies of frames of the whole map, (n, features)."""
        pieces = []
        for number in range(self.holding(start), self.holding(stop - 1) + 1):
            low, high = self.edges[number], self.edges[number + 1]
            part = self.part(number).between(max(start - low, 0), min(stop, high) - low)
            pieces.append(input_of(part, self._parts))
        return np.concatenate(pieces)


class _Writer:
    """Writes denoised frames, which come in order, to one file per stretch."""

    def __init__(
        self,
        trained: TrainedDenoiser,
        files: _Files,
        outs: Sequence[Path],
        resampled: bool,
        texture: int | None,
    ) -> None:
        self._trained, self._files, self._outs = trained, files, outs
        self._resampled, self._texture = resampled, texture
        # Of the whole map in each of its stretches: joined, they have the first one's metadata.
        self._note = trained.note(map(files.part, range(len(outs))))
        self._content: int | None = None
        self._number = 0
        self._energies = self._empty()

    def take(self, first: int, energies: NDArray[np.float32]) -> None:
        """Take frames from ``first`` on; frames that are skipped stay empty."""
        while len(energies):
            while first >= self._files.edges[self._number + 1]:
                self._next()
            low, high = self._files.edges[self._number : self._number + 2]
            count = min(len(energies), high - first)
            self._energies[first - low : first - low + count] = energies[:count]
            first, energies = first + count, energies[count:]

    def end(self) -> None:
        """Write the remaining stretches."""
        while self._number < len(self._outs):
            self._next()

    def _next(self) -> None:
        part = self._files.part(self._number)
        denoised = self._trained.as_denoised(part, self._energies, self._resampled, self._note)
        if self._texture is not None:
            if self._content is None:
                self._content = content_of(denoised)
            law, first = self._trained.card.needed_texture(), int(self._files.edges[self._number])
            denoised = law.on(denoised, self._texture, first, self._content)
        denoised.save(self._outs[self._number])
        self._number += 1
        if self._number < len(self._outs):
            self._energies = self._empty()

    def _empty(self) -> NDArray[np.float32]:
        low, high = self._files.edges[self._number : self._number + 2]
        return np.zeros((high - low, self._trained.card.axis.bins), np.float32)


@lru_cache(maxsize=1)
def _model(path: str, digest: str) -> TrainedDenoiser:
    """Load a model, which the process keeps from one task to the next."""
    from sd2core.denoise.files import load_model
    from sd2core.denoise.model import use_one_thread

    # There are as many processes as cores.
    use_one_thread()
    return load_model(Path(path))
