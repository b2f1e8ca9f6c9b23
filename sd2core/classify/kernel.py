"""Classifier in closed form: kernel ridge regression on the window around a frame.

Of few recordings it learns more than networks do: it is fitted to all of them at once, and has
nothing to begin with. Large data are described by windows drawn from them (C. Williams and M.
Seeger, "Using the Nyström method to speed up kernel machines", NIPS 2000).
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor, nn

from sd2core.classify.models import Classifier, State

_SMOOTHED = 7
_EVERY = 3
_RIDGE = 0.3
"""Penalty, in units of a frame of mean weight."""
_SHARPNESS = 8.0
"""Scores are about 0 and 1; as logits they are so much apart."""
_SHARE = 3.0
_MIN_DEVIATION = 1e-3
_BLOCK = 2048


class KernelClassifier(Classifier):
    """Scores by likeness to reference windows; see the head of this module.

    A window has the last ``frames`` frames, so that its middle is the frame that is answered
    after a delay of half of it. It is smoothed, and thinned out; beside the levels of the columns
    stand the roots of each bin's share.
    """

    closed_form = True
    mean: Tensor
    scale: Tensor

    def __init__(self, size: int, classes: int, *, frames: int, references: int) -> None:
        nn.Module.__init__(self)  # there is no head
        self._frames = frames
        numbers = 2 * size * len(range(0, frames, _EVERY))
        self.register_buffer("mean", torch.zeros(numbers))
        self.register_buffer("scale", torch.ones(numbers))
        self.windows = nn.Parameter(torch.zeros(references, numbers), requires_grad=False)
        self.weights = nn.Parameter(torch.zeros(references, classes), requires_grad=False)
        self._size = size

    def initial_state(self, batch: int = 1) -> State:
        """Return silence before the first frame."""
        return self.mean.new_zeros(batch, self._frames - 1, self._size)

    def chunk(self, features: Tensor, state: State) -> tuple[Tensor, State]:
        """Score the next frames."""
        seen = torch.cat([state, features], dim=1)
        kept = seen[:, seen.shape[1] - self._frames + 1 :]
        return _SHARPNESS * (self._likeness(self._described(seen)) @ self.weights), kept

    def fit(
        self,
        features: Sequence[Tensor],
        labels: Sequence[Tensor],
        weights: Tensor,
        of_clips: Sequence[float],
        seed: int,
    ) -> None:
        """Fit to clips.

        Parameters
        ----------
        features : sequence of Tensor, (frames, size)
            One for each clip.
        labels : sequence of Tensor, (frames,)
            Integer classes; below 0 where unknown.
        weights : Tensor, (classes,)
            Weights of the classes.
        of_clips : sequence of float
            Weight of a frame of each clip.
        seed : int
            For the draw of reference windows, where there are more frames than references.
        """
        described = [
            self._of_clip(one)[label >= 0] for one, label in zip(features, labels, strict=True)
        ]
        x = torch.cat(described)
        y = torch.cat([label[label >= 0] for label in labels])
        own_weights = torch.cat(
            [
                torch.full((int((label >= 0).sum()),), weight)
                for label, weight in zip(labels, of_clips, strict=True)
            ]
        )
        deviation, self.mean = torch.std_mean(x, dim=0, correction=0)
        self.scale = 1.0 / deviation.clamp(min=_MIN_DEVIATION)
        x = (x - self.mean) * self.scale
        generator = torch.Generator().manual_seed(seed)
        count = len(self.windows)
        # Of every class alike, as far as there are so many; of few all, and again.
        chance = (weights[y] * own_weights).clamp(min=1e-9)
        drawn = (
            torch.multinomial(chance, count, generator=generator)
            if len(x) > count
            else torch.arange(count) % len(x)
        )
        known = torch.unique(drawn) if len(x) <= count else drawn
        self.windows.data = x[drawn]
        own = self.windows[: len(known)].double()
        weight = weights[y] * own_weights
        weight = (weight / weight.mean()).double()
        normal = _RIDGE * self._kernel(own, own)
        wanted = torch.zeros(len(known), self.weights.shape[1], dtype=torch.float64)
        for start in range(0, len(x), _BLOCK):
            part = slice(start, start + _BLOCK)
            alike = self._kernel(x[part].double(), own)
            weighted = alike * weight[part, None]
            normal += weighted.T @ alike
            wanted += weighted.T @ nn.functional.one_hot(y[part], wanted.shape[1]).double()
        normal += 1e-6 * torch.eye(len(known), dtype=torch.float64)
        solution = torch.zeros(count, wanted.shape[1])
        solution[: len(known)] = torch.linalg.solve(normal, wanted).float()
        self.weights.data = solution

    def _of_clip(self, features: Tensor) -> Tensor:
        before = self.initial_state(1)[0]
        return self._described(torch.cat([before, features])[None])[0]

    def _described(self, seen: Tensor) -> Tensor:
        """Numbers of the windows that end at every frame from the window's length on."""
        # The columns are log10(1 + x / (10 noise)).
        energies = torch.pow(10.0, seen) - 1.0
        share = (energies / energies.sum(dim=-1, keepdim=True).clamp(min=1e-9)).clamp(min=0.0)
        both = torch.cat([seen, _SHARE * share.sqrt()], dim=-1)  # (batch, frames, 2 size)
        windows = both.unfold(1, self._frames, 1)  # (batch, frames, 2 size, window)
        flat = windows.flatten(0, 1)
        smooth = nn.functional.avg_pool1d(
            flat, _SMOOTHED, 1, _SMOOTHED // 2, count_include_pad=False
        )
        return smooth[..., ::_EVERY].flatten(1).unflatten(0, windows.shape[:2])

    def _likeness(self, described: Tensor) -> Tensor:
        standard = (described - self.mean) * self.scale
        return self._kernel(standard, self.windows)

    @staticmethod
    def _kernel(one: Tensor, other: Tensor) -> Tensor:
        squares = one.square().sum(-1, keepdim=True) + other.square().sum(-1)
        distance = squares - 2.0 * one @ other.T
        return torch.exp(-distance.clamp(min=0.0) / one.shape[-1])
