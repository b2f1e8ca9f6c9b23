"""Use of a trained denoiser: on whole maps, and live on single frames."""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from sd2core.denoise import resample_to_model as matching
from sd2core.denoise.card import ModelCard
from sd2core.denoise.model import Denoiser
from sd2core.denoise.scaling import whole_map
from sd2core.errors import Sd2Error
from sd2core.maps import DopplerMap
from sd2core.mesh.presence import Presence, runs
from sd2core.pairs.segments import LENGTH, OVERLAP, cut, join, segment_starts
from sd2core.progress import Progress, silent
from sd2core.version import __version__

CHUNK = 512
"""Number of frames of a long map that a causal model computes at once."""

PIECE = 2048
"""Number that a model that looks both ways over any number of frames is given together."""

_KEPT = ("sensor", "simulated")
"""What the provenance of a denoised map has from the synthetic one."""

_LEVELS = ("weight", "range_exponent", "velocity", "velocity_sigma_bins", "time_sigma_s")
"""Options of a synthetic map that its levels and widths depend on."""

_FAINT = 0.1
"""A map's strongest cell, in mean energies learnt from, below which it is said to be faint. Of the
sample farther away, bundled models keep half of their usual share at 0.15, a twentieth at 0.03."""

_ROUND = 64
_BATCH = 16


class TrainedDenoiser:
    """Network with the card that describes its use; it is put into evaluation mode."""

    def __init__(self, network: Denoiser, card: ModelCard) -> None:
        if network.bins != card.axis.bins:
            raise Sd2Error(
                f"The network has {network.bins} bins, its axis {card.axis.bins}", "the same number"
            )
        if (network.parts, network.more) != (card.maps, card.more):
            raise Sd2Error(
                f"The network takes {network.parts} maps and {network.more} numbers, its card says"
                f" {card.maps} and {card.more}",
                "the same numbers",
            )
        self.network = network.eval()
        self.card = card

    @property
    def device(self) -> torch.device:
        """Device of the weights."""
        return next((one.device for one in self.network.parameters()), torch.device("cpu"))

    def denoise(self, doppler: DopplerMap, progress: Progress = silent) -> DopplerMap:
        """Turn a synthetic map into the map that a radar would show.

        Frames without a person stay empty, and cut the map into clips of their own
        (docs/decisions/0021). A map of another frame rate, or of uneven frames, is
        interpolated to the model's rate and back.

        Parameters
        ----------
        doppler : DopplerMap
            Of kind ``synthetic``, on the model's axis, of any length; with limb maps where the
            card says parts.
        progress : callable
            Called with frames; may raise ``Cancelled``.

        Raises
        ------
        Sd2Error
            When the map is not of the kind that the model was trained on.
        """
        matching.check_map(doppler, self.card)
        denoised = np.zeros(doppler.values.shape[::-1], np.float32)  # (frames, bins)
        energies = matching.input_of(doppler, self.card.parts)
        resampled = matching.apply_to_stretches(
            self.denoise_values, doppler, energies, self.card.frame_rate_hz, denoised, progress
        )
        denoised[:, list(doppler.unseen_bins)] = 0.0
        return replace(
            doppler,
            values=denoised.T,
            kind="denoised",
            unit=self.card.unit,
            null_bins=self.card.null_bins,
            meta=self._provenance(doppler, resampled),
            uncertainty=None,
            limbs=None,
        )

    def denoise_values(
        self, energies: NDArray[np.float32], progress: Progress = silent
    ) -> NDArray[np.float32]:
        """Denoise one clip at the model's frame rate, (frames, bins).

        Energies are (frames, features) as the card counts them, and not negative. They come in
        the unit of the synthetic maps of the training, and the result is in that of its radar
        maps. Of several persons (:meth:`by_person`) the answers are added up.
        """
        each = self.by_person(energies)
        answer = np.zeros((len(energies), self.card.axis.bins), np.float32)
        if not len(energies):
            return answer
        run = self._in_chunks if self.network.causal else self._in_windows
        for number, one in enumerate(each):

            def counting(frames: int, total: int, before: int = number) -> None:
                progress((before * total + frames) // len(each), total)

            given = self.compressed(one)
            answer += self.expanded(run(given, counting), given)
        return answer

    def by_person(self, energies: NDArray[np.float32]) -> list[NDArray[np.float32]]:
        """Energies (frames, features) of each person, of which limb maps stand side by side.

        Raises Sd2Error when they are of another number of axes or of features.
        """
        features = self.card.features
        persons, more = divmod(energies.shape[-1], features)
        if energies.ndim != 2 or more or not (persons == 1 or (persons and self.card.parts)):
            raise Sd2Error(f"The values are of shape {energies.shape}", f"(frames, {features})")
        return np.split(energies, persons, axis=-1)

    def compressed(self, energies: NDArray[np.float32]) -> NDArray[np.float32]:
        """Input of the network from energies (…, features)."""
        values = np.array(energies, dtype=np.float32)
        values[..., self.card.null_features] = 0.0
        return self.card.scaling.compress_input(values)

    def expanded(
        self, answer: NDArray[np.float32], given: NDArray[np.float32]
    ) -> NDArray[np.float32]:
        """Energies (…, bins) from output of the network, of its input (…, features).

        Where nothing moves there is nothing, and nowhere less than the floor (decision 53). What
        the model does not know stays the synthetic map's
        (:class:`~sd2core.denoise.known.KnownMovements`).
        """
        scaling, known = self.card.scaling, self.card.known
        maps = given[..., : self.card.features - self.card.more]
        energies = scaling.target.expand(answer)
        energies[~maps.any(axis=-1)] = 0.0
        if known is None:
            energies[energies < scaling.floor] = 0.0
        else:
            whole = whole_map(scaling.input.expand(maps), self.card.axis.bins)
            energies = known.mixed(energies, whole, self.card.axis, scaling.floor)
        energies[..., list(self.card.null_bins)] = 0.0
        return energies

    def live(self) -> LiveDenoiser:
        """Denoiser of single frames, at the model's frame rate."""
        return LiveDenoiser(self)

    def _in_chunks(self, values: NDArray[np.float32], progress: Progress) -> NDArray[np.float32]:
        # Later frames do not affect a causal model, so the end is padded: few lengths occur that
        # way, and their convolution kernels are computed once.
        frames = len(values)
        step = _ROUND if frames <= CHUNK else CHUNK
        padded = np.zeros((-(-frames // step) * step, values.shape[1]), np.float32)
        padded[:frames] = values
        with torch.no_grad():
            if len(padded) <= max(self.network.longest, CHUNK):
                whole = torch.from_numpy(padded)[None].to(self.device)
                answers: NDArray[np.float32] = self.network(whole)[0].cpu().numpy()
                return answers[:frames]
            done = np.empty((len(padded), self.card.axis.bins), np.float32)
            state = self.network.initial_state(1)
            for start in range(0, frames, CHUNK):
                progress(start, frames)
                chunk = torch.from_numpy(padded[start : start + CHUNK])[None].to(self.device)
                answer, state = self.network.chunk(chunk, state)
                done[start : start + CHUNK] = answer[0].cpu().numpy()
        return done[:frames]

    def _in_windows(self, values: NDArray[np.float32], progress: Progress) -> NDArray[np.float32]:
        """Apply a model to windows, which overlap and are blended."""
        frames = len(values)
        if (window := self.network.window) is not None:
            overlap = OVERLAP if window > OVERLAP else window // 2
        else:
            window, overlap = (frames, 0) if frames <= PIECE else (PIECE, LENGTH)
        known = np.pad(values, ((0, max(0, window - frames)), (0, 0)), "symmetric")
        starts = segment_starts(len(known), window, overlap)
        windows = cut(known, starts, window)
        done = np.empty((*windows.shape[:2], self.card.axis.bins), np.float32)
        with torch.no_grad():
            for first in range(0, len(windows), _BATCH):
                progress(min(int(starts[first]), frames), frames)
                batch = torch.from_numpy(windows[first : first + _BATCH]).to(self.device)
                done[first : first + _BATCH] = self.network(batch).cpu().numpy()
        return join(done, starts, len(known))[:frames]

    def _provenance(self, doppler: DopplerMap, resampled: bool) -> dict[str, Any]:
        card, notes = self.card, []
        emptied = sorted(set(card.null_bins) - set(doppler.null_bins))
        if emptied:
            notes.append(
                f"bins {', '.join(map(str, emptied))} were emptied, as in the maps that the model"
                " learnt from"
            )
        if otherwise := self._counted_otherwise(doppler):
            notes.append(
                f"unlike what the model learnt from, the map has {', '.join(otherwise)}: its levels"
                " or widths are others"
            )
        if resampled:
            notes.append(
                f"frames at {doppler.timebase.frames_per_s:.4g}/s were interpolated to the model's"
                f" {card.frame_rate_hz:g}/s and back"
            )
        if card.known is not None:
            strange = card.known.strange(doppler.values.T, card.axis)
            notes += filter(None, [card.known.note(strange)])
        share = float(doppler.values.max(initial=0.0)) / card.scaling.input.reference
        if 0.0 < share < _FAINT:
            notes.append(
                f"its strongest cell has {share:.2g} times the mean energy that the model learnt"
                " from: little or nothing of echoes so faint stands out of a radar's noise"
            )
        about = {
            "model": card.model,
            "name": card.name,
            "title": card.title,
            "trained_on": card.trained_on,
            "data": card.about.get("data"),
        }
        meta: dict[str, Any] = {"denoiser": about, "input": doppler.meta, "version": __version__}
        meta |= {name: doppler.meta[name] for name in _KEPT if name in doppler.meta}
        if notes:
            meta["notes"] = notes
        return meta

    def _counted_otherwise(self, doppler: DopplerMap) -> list[str]:
        """Options of a map that none had which the model learnt from, as far as both tell them."""
        pairs, own = self.card.about.get("provenance"), doppler.meta.get("options")
        if not (isinstance(pairs, dict) and isinstance(own, dict)):
            return []
        mixed = pairs.get("mixed", [pairs])
        stores = [one.get("synthesis") for one in mixed if isinstance(one, dict)]
        learnt = [one for one in stores if isinstance(one, dict) and {*_LEVELS} <= one.keys()]
        return [
            f"{name} {own[name]} in place of {learnt[0][name]}"
            for name in _LEVELS
            if name in own and learnt and own[name] not in [one[name] for one in learnt]
        ]


class LiveDenoiser:
    """Denoiser of single frames, without delay.

    A causal model gives the result for the whole map (``equals_batch`` is True). One that looks at
    later frames gives that of its causal part, if it has one; otherwise it gets the last frames
    only and denoises the newest, at the window's border, where it knows less than in the middle.
    """

    def __init__(self, trained: TrainedDenoiser) -> None:
        self._trained = trained
        self._causal = trained.network.live
        self.equals_batch = trained.network.causal
        self.reset()

    def reset(self) -> None:
        """Forget the frames so far and begin a new clip."""
        self._of_persons: list[LiveDenoiser] = []  # of a scene of several, whose answers add up
        self._frames: deque[NDArray[np.float32]] = deque(
            maxlen=self._trained.network.window or LENGTH
        )
        with torch.no_grad():
            self._state = None if self._causal is None else self._causal.initial_state(1)

    def step(self, energies: NDArray[np.float32], present: bool = True) -> NDArray[np.float32]:
        """Denoise the next frame, (bins,), of energies (features,), see :meth:`advance`."""
        return self.advance(energies[None], np.array([present]))[0]

    def advance(
        self, energies: NDArray[np.float32], present: NDArray[np.bool_] | None = None
    ) -> NDArray[np.float32]:
        """Denoise the next frames, (frames, bins), of energies (frames, features).

        Without a person (``present`` False, one per frame; None: a person is in all) the result is
        empty, and a new clip begins.
        """
        each = self._trained.by_person(energies)
        if len(each) > 1:
            if not self._of_persons:
                self._of_persons = [LiveDenoiser(self._trained) for _ in each]
            both = zip(self._of_persons, each, strict=True)
            return np.asarray(sum(live.advance(one, present) for live, one in both), np.float32)
        answers = np.zeros((len(energies), self._trained.card.axis.bins), np.float32)
        begins = 0
        for start, stop in runs(Presence.of(present, len(energies)).present):
            if start > begins:
                self.reset()
            answers[start:stop] = self._run(energies[start:stop])
            begins = stop
        if begins < len(energies):
            self.reset()
        return answers

    def _run(self, energies: NDArray[np.float32]) -> NDArray[np.float32]:
        """Denoise frames without a gap."""
        trained = self._trained
        compressed = trained.compressed(energies)
        answers = []
        with torch.no_grad():
            if self._causal is None:
                answers = [self._of_window(frame) for frame in compressed]
            else:
                for chunk in torch.from_numpy(compressed).to(trained.device).split(CHUNK):
                    answer, self._state = self._causal.chunk(chunk[None], self._state)
                    answers.append(answer[0])
        return trained.expanded(torch.cat(answers).cpu().numpy(), compressed)

    def _of_window(self, compressed: NDArray[np.float32]) -> torch.Tensor:
        """Answer (1, bins) to a frame, as the last one of its window."""
        network = self._trained.network
        self._frames.append(compressed)
        known = np.stack(self._frames)
        missing = (network.window or LENGTH) - len(known)
        # The past is mirrored until there is enough of it.
        known = np.pad(known, ((missing, 0), (0, 0)), "symmetric")
        answer: torch.Tensor = network(torch.from_numpy(known)[None].to(self._trained.device))
        return answer[0, -1:]
