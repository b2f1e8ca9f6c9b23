"""Use of a trained classifier: on whole maps, and on live frames."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from numpy.typing import NDArray

from sd2core.classify.card import ClassifierCard
from sd2core.classify.data import UNKNOWN, Clip, ClipSet
from sd2core.classify.features import SILENCE
from sd2core.classify.metrics import Score, score
from sd2core.classify.models import Classifier, State
from sd2core.denoise import resample_to_model as matching
from sd2core.errors import Sd2Error
from sd2core.maps import DopplerMap
from sd2core.progress import Progress, silent

CHUNK = 512
"""Frames of a long map that are computed at once; the state carries over."""

Probabilities = NDArray[np.float32]


class TrainedClassifier:
    """Network, put into evaluation mode, with its card."""

    def __init__(self, network: Classifier, card: ClassifierCard) -> None:
        self.network = network.eval()
        self.card = card

    @property
    def classes(self) -> tuple[str, ...]:
        """Classes in the order of the probabilities."""
        return self.card.classes

    def probabilities(self, doppler: DopplerMap, progress: Progress = silent) -> Probabilities:
        """Compute the probability of every class in every frame of a map.

        Frames without a person are background for certain, and what was before them is
        forgotten: every stretch is a clip of its own (docs/decisions/0021). A map of
        another frame rate, or of uneven frames, is brought to the model's rate and its
        answers back.

        Parameters
        ----------
        doppler : DopplerMap
            Of any kind, on the model's axis, of any length.
        progress : callable
            Called with frames; may raise ``Cancelled``.

        Returns
        -------
        float32 array, shape (frames, classes)
            Rows add up to 1.

        Raises
        ------
        Sd2Error
            When the map is not on the axis that the model knows.
        """
        matching.check_bins(doppler, self.card)
        answers = np.tile(self.card.no_person(), (len(doppler.timebase), 1))
        energies = matching.input_of(doppler)
        matching.apply_to_stretches(
            self.probabilities_of, doppler, energies, self.card.frame_rate_hz, answers, progress
        )
        return answers

    def probabilities_of(
        self, energies: NDArray[np.float32], progress: Progress = silent
    ) -> Probabilities:
        """Compute one clip at the model's frame rate, (frames, bins) → (frames, classes)."""
        session, found = self.live(), []
        for start in range(0, len(energies), CHUNK):
            progress(start, len(energies))
            found.append(session.advance(energies[start : start + CHUNK]))
        return np.concatenate([*found, session.finish()])

    def live(self) -> LiveClasses:
        """Session for the frames of one stretch, all with a person."""
        return LiveClasses(self)


class LiveClasses:
    """Session that takes the frames of one stretch, all with a person, as they come."""

    def __init__(self, classifier: TrainedClassifier) -> None:
        self._network, self._card = classifier.network, classifier.card
        self._heard = SILENCE
        with torch.no_grad():
            self._state: State = self._network.initial_state(1)
        self._owed = 0  # Frames of which the answer is not known yet.

    def advance(self, energies: NDArray[np.float32]) -> Probabilities:
        """Process the next frames, (frames, bins) → (answers, classes).

        Answers are to the earliest frames that had none: one per frame once the card's delay has
        passed.
        """
        if not len(energies):
            return self._none
        shown, self._heard = self._card.features.of(energies, self._heard)
        answers, self._state = self._ask(shown)
        self._owed += len(shown) - len(answers)
        return answers

    def finish(self) -> Probabilities:
        """Return the outstanding answers, as if silence followed; the session stays usable."""
        if not self._owed:
            return self._none
        silence = np.zeros((self._card.delay_frames, self._card.features.size), np.float32)
        return self._ask(silence)[0]

    @property
    def _none(self) -> Probabilities:
        return np.zeros((0, len(self._card.classes)), np.float32)

    def _ask(self, shown: NDArray[np.float32]) -> tuple[Probabilities, State]:
        """Run the network; answers before the first frame of a clip are dropped."""
        with torch.no_grad():
            answer, state = self._network.chunk(torch.from_numpy(shown)[None], self._state)
            probabilities: Probabilities = torch.softmax(answer[0], dim=-1).numpy()
        return probabilities[max(self._card.delay_frames - self._owed, 0) :], state


def judge(classifier: TrainedClassifier, clips: Sequence[Clip], known: ClipSet) -> Score:
    """Score a classifier on clips of ``known``."""
    card = classifier.card
    strange = [name for name in known.classes if name not in card.classes]
    if strange:
        raise Sd2Error(
            f"The data hold the class {', '.join(strange)}",
            f"classes that the classifier knows: {', '.join(card.classes)}",
        )
    if known.axis != card.axis or not set(known.null_bins) <= set(card.null_bins):
        raise Sd2Error(
            f"The maps have {known.axis.words}, bins {list(known.null_bins)} emptied",
            f"{card.axis.words}, bins {list(card.null_bins)} emptied, as the classifier knows them",
        )
    if abs(known.frame_rate_hz / card.frame_rate_hz - 1.0) > matching.SAME_RATE:
        raise Sd2Error(
            f"The maps have {known.frame_rate_hz:.4g} frames/s",
            f"{card.frame_rate_hz:.4g} frames/s, as the classifier knows them",
        )
    if not clips:
        raise Sd2Error("There is no clip to judge on", "at least one")
    table = np.array([*(card.classes.index(name) for name in known.classes), UNKNOWN])
    return score(
        [table[clip.label] for clip in clips],
        [classifier.probabilities_of(clip.energies).argmax(axis=1) for clip in clips],
        card.classes,
        known.frame_rate_hz,
        card.background,
        card.delay_s,
    )
