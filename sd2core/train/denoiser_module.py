"""Training step and its callbacks, driven by Lightning.

Lightning has the loop, the devices and the precision. Epochs are ours: to Lightning the
whole run is one, so that a run can begin in the middle of an epoch, and so that nothing
but a step happens between two steps.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from lightning.pytorch import LightningModule
from torch import nn

from sd2core.denoise.model import Denoiser
from sd2core.mesh.vertex_parts import mirrored_columns
from sd2core.train.callbacks import TrainingCallbacks
from sd2core.train.checkpoint import Checkpoint, moments_of, set_moments
from sd2core.train.data import Windows, frame_weights
from sd2core.train.steps import Step, optimiser_of, set_rate

_SHARP = 4
"""Power of the energies whose mean velocity is nearly that of the strongest."""


class DenoiserModule(LightningModule):
    """Denoiser with all that it learns from.

    ``windows`` hold energies; the scaling of the validation compresses them. Training goes on from
    ``checkpoint`` if there is one.
    """

    def __init__(
        self,
        network: Denoiser,
        windows: Windows,
        callbacks: TrainingCallbacks,
        checkpoint: Checkpoint | None = None,
    ) -> None:
        super().__init__()
        self.network = network
        # Not buffers: they belong to no checkpoint, and need not be broadcast.
        self._inputs = torch.from_numpy(callbacks.exam.scaling.compress_input(windows.inputs))
        self._targets = torch.from_numpy(callbacks.exam.scaling.target.compress(windows.targets))
        balanced = callbacks.config.training.balanced
        weights = frame_weights(windows, callbacks.exam.axis) if balanced else None
        self._weights = None if weights is None else torch.from_numpy(weights)  # (frames,)
        self._frames = torch.arange(windows.length)
        self._mirror: tuple[torch.Tensor, ...] = ()
        if callbacks.exam.scaling.more:
            self._mirror = tuple(torch.from_numpy(each) for each in mirrored_columns())
        self._callbacks = callbacks
        self._moments = checkpoint.moments if checkpoint is not None else None

    def configure_optimizers(self) -> torch.optim.Optimizer:
        """AdamW, with its moments where a run goes on."""
        optimiser = optimiser_of(self.network, self._callbacks.config.training)
        if self._moments is not None:
            set_moments(optimiser, self._moments)
            self._moments = None
        return optimiser

    def on_fit_start(self) -> None:
        """Bring all frames to the device: they are a few hundred MB at most."""
        for name in ("_inputs", "_targets", "_frames"):
            setattr(self, name, getattr(self, name).to(self.device))
        self._mirror = tuple(each.to(self.device) for each in self._mirror)
        if self._weights is not None:
            self._weights = self._weights.to(self.device)

    def on_train_start(self) -> None:
        """Begin the run here, because Lightning has put its own signal handlers in place before."""
        self._callbacks.begin(self)

    def on_train_batch_start(self, batch: Step, batch_idx: int) -> None:
        """Set the learning rate, and seed the random numbers by the position in the run."""
        callbacks = self._callbacks
        callbacks.rate = set_rate(self._optimiser, callbacks.agreed_rate_factor())
        seed = np.random.SeedSequence(
            [callbacks.config.training.seed, batch.epoch, batch.number, self.global_rank]
        )
        torch.manual_seed(int(seed.generate_state(1, np.uint64)[0]))

    def training_step(self, batch: Step, batch_idx: int) -> torch.Tensor:
        """Root mean square error of one batch, of weighted frames if the training is balanced.

        With a network for live frames the sum of both errors.
        """
        callbacks = self._callbacks
        rows = batch.start[:, None] + self._frames  # (segments, length)
        inputs, targets = self._inputs[rows], self._targets[rows]
        if callbacks.config.data.range_factor > 1.0:
            # (g·x / r)^p = g^p · (x / r)^p: gains are as well applied to compressed values.
            scaling = callbacks.exam.scaling
            energies = inputs.shape[-1] - scaling.more
            gains = (batch.gain**scaling.input.exponent)[:, None, None]
            inputs = torch.cat([inputs[..., :energies] * gains, inputs[..., energies:]], dim=-1)
            targets = targets * (batch.gain**scaling.target.exponent)[:, None, None]
        if self._mirror:
            inputs = self._mirrored(inputs)
        loss = self._loss(self.network(inputs).float(), targets, rows, noted=True)
        live = self.network.live
        if live is not None and live is not self.network:
            loss = loss + self._loss(live(inputs).float(), targets, rows)
        return loss

    def _loss(
        self, answers: torch.Tensor, targets: torch.Tensor, rows: torch.Tensor, noted: bool = False
    ) -> torch.Tensor:
        callbacks = self._callbacks
        difference = answers - targets
        if len(callbacks.exam.counted) < difference.shape[-1]:
            difference = difference.index_select(-1, callbacks.counted_on(difference.device))
        squares = difference.square()
        square = squares.mean()
        if noted:
            callbacks.note(square.detach(), len(rows))
        if self._weights is not None:
            square = (squares * self._weights[rows][..., None]).mean()
        # At zero the root has no slope.
        loss = (square + 1e-12).sqrt()
        weight = callbacks.config.training.velocity_weight
        return loss + weight * self._velocity_loss(answers, targets) if weight else loss

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
        exam = self._callbacks.exam
        counted = self._callbacks.counted_on(answers.device)
        velocities = torch.as_tensor(exam.axis.centres_mps, dtype=torch.float32)
        velocities = velocities.to(answers.device)[counted]
        power = 1 / exam.scaling.target.exponent
        found, wanted = (
            values.float().clamp(min=0.0)[..., counted] ** power for values in (answers, targets)
        )
        moving = (wanted.sum(dim=-1) > 0).float()

        def mean_of(energies: torch.Tensor) -> torch.Tensor:
            return (energies * velocities).sum(dim=-1) / (energies.sum(dim=-1) + 1e-3)

        strongest = found.amax(dim=-1, keepdim=True) + 1e-3
        errors = {
            "mean": (mean_of(found), mean_of(wanted)),
            "peak": (mean_of((found / strongest) ** _SHARP), velocities[wanted.argmax(dim=-1)]),
        }
        off = sum(
            nn.functional.smooth_l1_loss(*pair, beta=0.1, reduction="none")
            for pair in errors.values()
        )
        loss: torch.Tensor = (off * moving).sum() / moving.sum().clamp(min=1.0)
        return loss

    def configure_gradient_clipping(
        self,
        optimizer: torch.optim.Optimizer,
        gradient_clip_val: float | None = None,
        gradient_clip_algorithm: str | None = None,
    ) -> None:
        """Clip to a norm.

        Lightning refuses to clip for a fused optimiser in mixed precision, because that
        could unscale gradients by itself; without fp16 nothing is scaled.
        """
        norm = self._callbacks.config.training.clip_norm
        if norm > 0:
            torch.nn.utils.clip_grad_norm_(self.network.parameters(), norm)

    def on_train_batch_end(self, outputs: Any, batch: Step, batch_idx: int) -> None:
        """Count the step; stop training when the run is over."""
        if not self._callbacks.after_step():
            self.trainer.should_stop = True

    def checkpoint_tensors(self) -> tuple[dict[str, torch.Tensor], dict[int, Any]]:
        """Weights, and moments of the optimiser."""
        return self.network.state_dict(), moments_of(self._optimiser)

    @property
    def _optimiser(self) -> torch.optim.Optimizer:
        optimiser: torch.optim.Optimizer = self.trainer.optimizers[0]
        return optimiser
