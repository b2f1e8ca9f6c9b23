"""U-Net over velocity and time (O. Ronneberger et al., MICCAI 2015)."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from sd2core.denoise.model import Denoiser

_KERNEL = 3


class UNetDenoiser(Denoiser):
    """Two convolutions per level, down by 2 in time and velocity, and back with bridges.

    Normalised by statistics of the training data (batch normalisation), not of the
    clip: how strong a frame is must not get lost.

    Parameters
    ----------
    bins : int
    channels : int
        Width of the first level; each level below is twice as wide.
    depth : int
        Levels below the first.
    dropout : float
        At the lowest level.
    """

    causal = False
    window = 72

    def __init__(
        self,
        bins: int,
        *,
        channels: int = 12,
        depth: int = 3,
        dropout: float = 0.0,
    ) -> None:
        super().__init__(bins)
        self._step = 2**depth
        widths = [channels * 2**level for level in range(depth + 1)]
        self.down = nn.ModuleList(
            _two_convolutions(before, after)
            for before, after in zip([1, *widths[:-1]], widths, strict=True)
        )
        self.shrink = nn.MaxPool2d(2)
        self.dropout = nn.Dropout(dropout)
        self.grow = nn.ModuleList(
            nn.ConvTranspose2d(2 * width, width, 2, stride=2) for width in widths[:-1]
        )
        self.up = nn.ModuleList(_two_convolutions(2 * width, width) for width in widths[:-1])
        self.head = nn.Conv2d(channels, 1, 1)
        # Convolutions of few channels are half as long again in the other order.
        self.to(memory_format=torch.channels_last)

    def forward(self, values: Tensor) -> Tensor:
        """Any number of frames and bins; windows of 72 frames are what it learns from."""
        frames, bins = values.shape[1:]
        picture = padded(values[:, None], self._step, self._step)  # (B, 1, L', bins')
        picture = picture.contiguous(memory_format=torch.channels_last)
        bridges = []
        for level, convolutions in enumerate(self.down):
            picture = convolutions(picture if level == 0 else self.shrink(picture))
            bridges.append(picture)
        picture = self.dropout(bridges.pop())
        for level in reversed(range(len(bridges))):
            picture = torch.cat([bridges[level], self.grow[level](picture)], 1)
            picture = self.up[level](picture)
        return self.head(picture)[:, 0, :frames, :bins]


def padded(picture: Tensor, frames_step: int, bins_step: int) -> Tensor:
    """Zeros after the last frame and above the last bin, up to multiples."""
    frames, bins = picture.shape[-2:]
    return nn.functional.pad(picture, (0, -bins % bins_step, 0, -frames % frames_step))


def _two_convolutions(before: int, after: int) -> nn.Sequential:
    layers: list[nn.Module] = []
    for inward in (before, after):
        layers += [
            nn.Conv2d(inward, after, _KERNEL, padding=_KERNEL // 2, bias=False),
            nn.BatchNorm2d(after),
            nn.ReLU(),
        ]
    return nn.Sequential(*layers)
