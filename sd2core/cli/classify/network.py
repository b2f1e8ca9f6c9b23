"""Options of ``sd2 classify`` for the network."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from sd2core.classify.defaults import DELAY_S, MODELS, WIDTH
from sd2core.cli.options import not_negative_float, positive_int

if TYPE_CHECKING:
    from sd2core.classify.experiment import Network


def add_network(parser: argparse.ArgumentParser) -> None:
    """Add model, features, width and delay."""
    group = parser.add_argument_group("network")
    group.add_argument(
        "--model",
        choices=MODELS,
        default=MODELS[0],
        help=f"two LSTM layers (the paper's), or two S4 layers (default: {MODELS[0]})",
    )
    group.add_argument(
        "--features",
        choices=("columns", "peak"),
        default="columns",
        help="input per frame: whole columns (the default), or the strongest bin (the paper's)",
    )
    group.add_argument(
        "--width",
        type=positive_int,
        default=WIDTH,
        metavar="N",
        help=f"units or channels of a layer (default: {WIDTH}; the paper's: 16)",
    )
    group.add_argument(
        "--delay-s",
        type=not_negative_float,
        default=DELAY_S,
        metavar="S",
        help="classify a frame so much later, with the frames after it known (default:"
        f" {DELAY_S:g}; the paper's: 0, at once)",
    )


def network_of(options: argparse.Namespace) -> Network:
    """Return the network chosen by the options."""
    from sd2core.classify.experiment import Network

    return Network(options.model, options.features, options.width, options.delay_s)
