"""Networks over windows of 72 frames: U-Net and Swin transformer."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from sd2core.denoise.model import Denoiser

_KERNEL = 3


class UNetDenoiser(Denoiser):
    """U-Net over velocity and time (O. Ronneberger et al., MICCAI 2015).

    Two convolutions per level, down by 2 in time and velocity, and back with skip connections.

    Normalised by statistics of the training data (batch normalisation), not of the
    clip: how strong a frame is must not get lost.

    Parameters
    ----------
    parts, more : int
        Maps in the input, and numbers per frame after them.
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
        parts: int = 1,
        more: int = 0,
        channels: int = 12,
        depth: int = 3,
        dropout: float = 0.0,
    ) -> None:
        super().__init__(bins, parts, more)
        given = self.prepare_pictures()
        self._step = 2**depth
        widths = [channels * 2**level for level in range(depth + 1)]
        self.down = nn.ModuleList(
            _two_convolutions(before, after)
            for before, after in zip([given, *widths[:-1]], widths, strict=True)
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
        """Denoise (batch, frames, features) of any number of frames; it learns from 72."""
        frames, bins = values.shape[1], self.bins
        picture = padded(self.pictures(values), self._step, self._step)  # (B, channels, L', bins')
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
    """Pad with zeros after the last frame and above the last bin, up to multiples of the steps."""
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


PATCH = 2
"""Frames and bins that become one token."""

WINDOW = (6, 4)
"""Tokens in time and velocity that attend to each other."""

HEAD_WIDTH = 16


class SwinDenoiser(Denoiser):
    """Small Swin transformer, shaped as a U, over velocity and time.

    Z. Liu et al., "Swin Transformer: Hierarchical Vision Transformer using Shifted Windows",
    ICCV 2021, with the coarse level brought back to the fine one through a skip connection, as
    in H. Cao et al., "Swin-Unet", 2021. Patches of 2 × 2 cells are the tokens. A token learns which
    velocity it stands for, because windows alone do not say.

    Parameters
    ----------
    parts, more : int
        Maps in the input, and numbers per frame after them.
    channels : int
        Width of the fine level, a multiple of 16; the coarse one is twice as wide.
    depth : int
        Blocks per level; every second one has its windows shifted.
    """

    causal = False
    window = 72

    def __init__(
        self,
        bins: int,
        *,
        parts: int = 1,
        more: int = 0,
        channels: int = 48,
        depth: int = 2,
        dropout: float = 0.0,
    ) -> None:
        super().__init__(bins, parts, more)
        self._frames_step, self._bins_step = (2 * PATCH * size for size in WINDOW)
        columns = (bins + -bins % self._bins_step) // PATCH
        self.embed = nn.Conv2d(self.prepare_pictures(), channels, PATCH, stride=PATCH)
        self.velocity = nn.Parameter(
            nn.init.trunc_normal_(torch.empty(columns, channels), std=0.02)
        )
        self.fine = _level(channels, depth, dropout)
        self.merge = nn.Sequential(
            nn.LayerNorm(4 * channels), nn.Linear(4 * channels, 2 * channels, bias=False)
        )
        self.coarse = _level(2 * channels, depth, dropout)
        self.expand = nn.Linear(2 * channels, 4 * channels, bias=False)
        self.bridge = nn.Linear(2 * channels, channels)
        self.norm = nn.LayerNorm(channels)
        self.head = nn.Linear(channels, PATCH * PATCH)

    def forward(self, values: Tensor) -> Tensor:
        """Denoise (batch, frames, features) of any number of frames; it learns from 72."""
        frames, bins = values.shape[1], self.bins
        picture = padded(self.pictures(values), self._frames_step, self._bins_step)
        tokens = self.embed(picture).permute(0, 2, 3, 1) + self.velocity  # (B, L/2, bins/2, C)
        fine = self.fine(tokens)
        coarse = self.coarse(self.merge(_gathered(fine)))
        back = _spread(self.expand(coarse))
        out = self.head(self.norm(self.bridge(torch.cat([fine, back], -1))))
        return _spread(out)[:, :frames, :bins, 0]


class WindowBlock(nn.Module):
    """Attention within windows, then a perceptron, both with a residual connection.

    ``shifted`` moves the windows by half their size, so that neighbours meet.
    """

    def __init__(self, channels: int, shifted: bool, dropout: float) -> None:
        super().__init__()
        self.heads = max(1, channels // HEAD_WIDTH)
        self._shift = tuple(size // 2 for size in WINDOW) if shifted else (0, 0)
        self.norm_attention = nn.LayerNorm(channels)
        self.attend = nn.Linear(channels, 3 * channels)
        self.project = nn.Linear(channels, channels)
        tall, wide = WINDOW
        self.bias = nn.Parameter(torch.zeros((2 * tall - 1) * (2 * wide - 1), self.heads))
        self.register_buffer("_relative", _relative_positions(), persistent=False)
        self.perceptron = nn.Sequential(
            nn.LayerNorm(channels),
            nn.Linear(channels, 2 * channels),
            nn.GELU(),
            nn.Dropout(dropout),
            nn.Linear(2 * channels, channels),
            nn.Dropout(dropout),
        )
        self.dropout = nn.Dropout(dropout)

    def forward(self, tokens: Tensor) -> Tensor:
        """Apply to (B, rows, columns, C); rows and columns are multiples of the window."""
        tokens = tokens + self.dropout(self._attention(self.norm_attention(tokens)))
        return tokens + self.perceptron(tokens)

    def _attention(self, tokens: Tensor) -> Tensor:
        batch, rows, columns, channels = tokens.shape
        down, right = self._shift
        tokens = torch.roll(tokens, (-down, -right), (1, 2))
        windows = _windows(tokens)  # (B, W, P, C)
        count, places = windows.shape[1:3]
        three = self.attend(windows).view(batch, count, places, 3, self.heads, -1)
        query, key, value = three.permute(3, 0, 1, 4, 2, 5)  # each (B, W, heads, P, c)
        bias = self.bias[self._relative].permute(2, 0, 1)  # (heads, P, P)
        if any(self._shift):
            bias = bias + _apart(rows, columns, self._shift, tokens.device)[:, None]
        mixed = nn.functional.scaled_dot_product_attention(
            query, key, value, bias.to(query.dtype).expand(batch, count, -1, -1, -1)
        )
        mixed = self.project(mixed.transpose(2, 3).reshape(batch, count, places, channels))
        return torch.roll(_unwindowed(mixed, rows, columns), (down, right), (1, 2))


def _level(channels: int, depth: int, dropout: float) -> nn.Sequential:
    return nn.Sequential(
        *(WindowBlock(channels, number % 2 == 1, dropout) for number in range(depth))
    )


def _gathered(tokens: Tensor) -> Tensor:
    """Merge four neighbours into one token of four times the width."""
    batch, rows, columns, channels = tokens.shape
    blocks = tokens.view(batch, rows // 2, 2, columns // 2, 2, channels)
    return blocks.transpose(2, 3).reshape(batch, rows // 2, columns // 2, 4 * channels)


def _spread(tokens: Tensor) -> Tensor:
    """Split one token into four neighbours of a quarter of the width."""
    batch, rows, columns, channels = tokens.shape
    blocks = tokens.view(batch, rows, columns, 2, 2, channels // 4)
    return blocks.transpose(2, 3).reshape(batch, 2 * rows, 2 * columns, channels // 4)


def _windows(tokens: Tensor) -> Tensor:
    """Cut into windows, (B, rows, columns, C) to (B, windows, places, C)."""
    batch, rows, columns, channels = tokens.shape
    tall, wide = WINDOW
    blocks = tokens.view(batch, rows // tall, tall, columns // wide, wide, channels)
    return blocks.transpose(2, 3).reshape(batch, -1, tall * wide, channels)


def _unwindowed(windows: Tensor, rows: int, columns: int) -> Tensor:
    batch, _, _, channels = windows.shape
    tall, wide = WINDOW
    blocks = windows.view(batch, rows // tall, columns // wide, tall, wide, channels)
    return blocks.transpose(2, 3).reshape(batch, rows, columns, channels)


def _relative_positions() -> Tensor:
    """Number of the offset between every two places of a window, (P, P)."""
    tall, wide = WINDOW
    grid = torch.stack(torch.meshgrid(torch.arange(tall), torch.arange(wide), indexing="ij"))
    places = grid.flatten(1)
    apart = places[:, :, None] - places[:, None]
    return (apart[0] + tall - 1) * (2 * wide - 1) + apart[1] + wide - 1


def _apart(rows: int, columns: int, shift: tuple[int, ...], device: torch.device) -> Tensor:
    """Attention mask: −∞ between places that only the shift brought together, (windows, P, P)."""
    part = torch.zeros(1, rows, columns, 1, device=device)
    part[:, rows - shift[0] :] += 1
    part[:, :, columns - shift[1] :] += 2
    parts = _windows(part)[0, :, :, 0]
    return torch.zeros(*parts.shape, parts.shape[1], device=device).masked_fill(
        parts[:, :, None] != parts[:, None], -torch.inf
    )
