"""A denoiser with all that it learns from, and its error on a batch."""

from __future__ import annotations

import torch
from torch import nn

from sd2core.denoise.model import Denoiser
from sd2core.mesh.vertex_parts import mirrored_columns
from sd2core.options.training import TrainConfig
from sd2core.train.data import Windows, frame_weights
from sd2core.train.steps import Batch
from sd2core.train.validate import Validator

_SHARP = 4
"""Power of the energies whose mean velocity is nearly that of the strongest."""


class Learner(nn.Module):
    """Denoiser with all that it learns from, on the device of ``validator``.

    ``windows`` hold energies; the scaling of the validation (``validator``) compresses them. All
    frames are brought to the device: they are a few hundred MB at most.
    """

    def __init__(
        self, network: Denoiser, windows: Windows, validator: Validator, config: TrainConfig
    ) -> None:
        super().__init__()
        device = validator.inputs.device
        self.network = network.to(device)
        self._validator = validator
        self._range_factor = config.data.range_factor
        self._velocity_weight = config.training.velocity_weight
        # Not buffers: they belong to no checkpoint, and need not be broadcast.
        scaling = validator.scaling
        self._inputs = torch.from_numpy(scaling.compress_input(windows.inputs)).to(device)
        self._targets = torch.from_numpy(scaling.target.compress(windows.targets)).to(device)
        self._weights: torch.Tensor | None = None  # (frames,)
        if config.training.balanced:
            self._weights = torch.from_numpy(frame_weights(windows, validator.axis)).to(device)
        self._frames = torch.arange(windows.length, device=device)
        self._counted = torch.tensor(validator.counted, device=device)
        self._mirror: tuple[torch.Tensor, ...] = ()
        if scaling.more:
            self._mirror = tuple(torch.from_numpy(each).to(device) for each in mirrored_columns())

    def forward(self, batch: Batch) -> tuple[torch.Tensor, torch.Tensor]:
        """Error to learn from, and mean square error of the network, of one batch.

        The first is the root mean square error, of weighted frames if the training is balanced;
        with a network for live frames the sum of both errors.
        """
        rows = batch.start[:, None] + self._frames  # (segments, length)
        inputs, targets = self._inputs[rows], self._targets[rows]
        if self._range_factor > 1.0:
            # (g·x / r)^p = g^p · (x / r)^p: gains are as well applied to compressed values.
            scaling = self._validator.scaling
            energies = inputs.shape[-1] - scaling.more
            gains = (batch.gain**scaling.input.exponent)[:, None, None]
            inputs = torch.cat([inputs[..., :energies] * gains, inputs[..., energies:]], dim=-1)
            targets = targets * (batch.gain**scaling.target.exponent)[:, None, None]
        if self._mirror:
            inputs = self._mirrored(inputs)
        loss, square = self._errors(self.network(inputs).float(), targets, rows)
        live = self.network.live
        if live is not None and live is not self.network:
            loss = loss + self._errors(live(inputs).float(), targets, rows)[0]
        return loss, square.detach()

    def _errors(
        self, answers: torch.Tensor, targets: torch.Tensor, rows: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor]:
        difference = answers - targets
        if len(self._counted) < difference.shape[-1]:
            difference = difference.index_select(-1, self._counted)
        squares = difference.square()
        square = weighted = squares.mean()
        if self._weights is not None:
            weighted = (squares * self._weights[rows][..., None]).mean()
        # At zero the root has no slope.
        loss = (weighted + 1e-12).sqrt()
        if self._velocity_weight:
            loss = loss + self._velocity_weight * self._velocity_loss(answers, targets)
        return loss, square

    def _mirrored(self, inputs: torch.Tensor) -> torch.Tensor:
        """Kinematics with left and right exchanged in half of the segments: the map is the same."""
        order, signs = self._mirror
        first = inputs.shape[-1] - len(order)
        other = torch.cat([inputs[..., :first], inputs[..., first:][..., order] * signs], dim=-1)
        turned = torch.rand(len(inputs), 1, 1, device=inputs.device) < 0.5
        return torch.where(turned, other, inputs)

    def _velocity_loss(self, answers: torch.Tensor, targets: torch.Tensor) -> torch.Tensor:
        """Mean errors of the mean and the peak velocity, m/s; below 0.1 m/s they count less.

        The peak of an answer is its mean velocity with the eighth power of the amplitude, which
        has a slope.
        """
        velocities = torch.as_tensor(self._validator.axis.centres_mps, dtype=torch.float32)
        velocities = velocities.to(answers.device)[self._counted]
        power = 1 / self._validator.scaling.target.exponent
        estimate, wanted = (
            values.float().clamp(min=0.0)[..., self._counted] ** power
            for values in (answers, targets)
        )
        moving = (wanted.sum(dim=-1) > 0).float()

        def mean_of(energies: torch.Tensor) -> torch.Tensor:
            return (energies * velocities).sum(dim=-1) / (energies.sum(dim=-1) + 1e-3)

        strongest = estimate.amax(dim=-1, keepdim=True) + 1e-3
        errors = {
            "mean": (mean_of(estimate), mean_of(wanted)),
            "peak": (mean_of((estimate / strongest) ** _SHARP), velocities[wanted.argmax(dim=-1)]),
        }
        off = sum(
            nn.functional.smooth_l1_loss(*pair, beta=0.1, reduction="none")
            for pair in errors.values()
        )
        return (off * moving).sum() / moving.sum().clamp(min=1.0)
