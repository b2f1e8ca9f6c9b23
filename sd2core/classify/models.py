"""Causal networks: features of frames in, one logit per class and frame out."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import torch
from torch import Tensor, nn

from sd2core.classify.defaults import CLASSIFIERS, ENTRIES, WIDTH, model_names
from sd2core.denoise.registry import Architecture, check_option
from sd2core.denoise.s4_layer import S4Layer
from sd2core.denoise.s4_stack import S4Stack
from sd2core.errors import Sd2Error
from sd2core.plug_ins import PlugIn

State = Any
"""What a network remembers of the frames before."""


class Classifier(nn.Module):
    """Base of the classifiers: layers along time, then a common head.

    The head is the paper's: layer norm, dense, dropout, dense (softmax is left to the loss
    and to whoever asks for probabilities). ``width`` is the number of channels before it.
    """

    whole: bool = False
    """Whether it learns from whole stretches at once instead of piece by piece."""
    closed_form: bool = False
    """Whether it is fitted at once, instead of by steps."""

    def __init__(self, width: int, classes: int, dropout: float) -> None:
        super().__init__()
        self.head = nn.Sequential(
            nn.LayerNorm(width),
            nn.Linear(width, width),
            nn.ReLU(),
            nn.Dropout(dropout),
            nn.Linear(width, classes),
        )

    def chunk(self, features: Tensor, state: State) -> tuple[Tensor, State]:
        """Process the next frames: (batch, frames, size) → (batch, frames, classes)."""
        raise NotImplementedError

    def initial_state(self, batch: int = 1) -> State:
        """Return the state before the first frame."""
        raise NotImplementedError

    def forward(self, features: Tensor) -> Tensor:
        """Process whole clips."""
        return self.chunk(features, self.initial_state(len(features)))[0]

    def ssm_parameters(self) -> Iterator[nn.Parameter]:
        """Yield the parameters of state spaces, which learn more slowly."""
        return iter(())


class LstmClassifier(Classifier):
    """Two stateful LSTM layers of ``width`` units, as in the paper (there 16)."""

    def __init__(
        self, size: int, classes: int, *, width: int = WIDTH, depth: int = 2, dropout: float = 0.2
    ) -> None:
        super().__init__(width, classes, dropout)
        self.layers = nn.LSTM(size, width, depth, batch_first=True)
        # Cells that remember from the start learn much sooner (R. Jozefowicz et al., "An
        # empirical exploration of recurrent network architectures", ICML 2015).
        with torch.no_grad():
            for layer in range(depth):
                for part in ("ih", "hh"):
                    forget = getattr(self.layers, f"bias_{part}_l{layer}")[width : 2 * width]
                    forget.fill_(0.5)

    def initial_state(self, batch: int = 1) -> State:
        """Return zeros, twice (layers, batch, width)."""
        zeros = self.head[1].weight.new_zeros(
            self.layers.num_layers, batch, self.layers.hidden_size
        )
        return zeros, zeros

    def chunk(self, features: Tensor, state: State) -> tuple[Tensor, State]:
        """Process the next frames with the layers' cells."""
        hidden, state = self.layers(features, state)
        return self.head(hidden), state


class S4Classifier(S4Stack, Classifier):
    """S4 layers of the denoiser between a linear layer and the head.

    ``size`` is the number of features per frame, ``width`` the channels, ``state_size`` the
    numbers that each channel remembers; the dropout also applies within the layers.
    """

    whole = True

    def __init__(
        self,
        size: int,
        classes: int,
        *,
        width: int = WIDTH,
        depth: int = 2,
        state_size: int = 16,
        dropout: float = 0.2,
    ) -> None:
        super().__init__(width, classes, dropout)
        self.lift = nn.Linear(size, width)
        # Memories from one frame to about two seconds, the length of a gesture.
        self.layers = nn.ModuleList(
            S4Layer(width, state_size, dropout=dropout, dt_min=0.02, dt_max=1.0)
            for _ in range(depth)
        )


def options(name: str) -> dict[str, Any]:
    """Return the options of a model with their defaults."""
    return dict((ENTRIES[name] if name in ENTRIES else _plug_in(name).load()).options)


def build(name: str, size: int, classes: int, **given: Any) -> Classifier:
    """Build one of :data:`MODELS`, or of a plug-in, with random weights from torch's generator.

    ``size`` is the number of features per frame; ``given`` replaces :func:`options`.
    """
    known = options(name)
    for option, value in given.items():
        check_option(f"classifier {name}", option, value, known)

    def built(entry: Architecture) -> Classifier:
        return entry.made(size, classes, **entry.fixed, **{**known, **given})

    if name in ENTRIES:
        return built(ENTRIES[name])
    return _plug_in(name).use(built, Classifier)


def _plug_in(name: str) -> PlugIn[Architecture]:
    plug_in = CLASSIFIERS.find(name)
    if plug_in is None:
        raise Sd2Error(f"There is no classifier {name!r}", f"one of {', '.join(model_names())}")
    return plug_in


def parameter_groups(network: Classifier, rate: float, ssm_rate: float) -> list[dict[str, Any]]:
    """Group the parameters by learning rate; state spaces have no weight decay."""
    slow = list(network.ssm_parameters())
    ids = {id(one) for one in slow}
    rest = [one for one in network.parameters() if id(one) not in ids]
    groups: list[dict[str, Any]] = [{"params": rest, "peak_lr": rate}]
    if slow:
        groups.append({"params": slow, "peak_lr": ssm_rate, "weight_decay": 0.0})
    return groups
