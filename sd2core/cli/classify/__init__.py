"""``sd2 classify``: find gestures in Doppler maps."""

from __future__ import annotations

import argparse

from sd2core.cli.classify.comparison import add_table
from sd2core.cli.classify.train import add_train
from sd2core.cli.classify.trained import add_apply, add_eval
from sd2core.cli.command_parser import add_command


def add_commands(commands: argparse._SubParsersAction) -> None:
    """Train, evaluate and apply gesture classifiers.

    A classifier gives the probability of each gesture in every frame of a Doppler map.
    It is trained on labelled maps and evaluated on people it was not trained on.

      sd2 classify train campaign.zarr --out gestures.safetensors
      sd2 classify apply walk.sd2
    """
    parser = add_command(commands, "classify", about=add_commands)
    kinds = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    add_train(kinds)
    add_eval(kinds)
    add_apply(kinds)
    add_table(kinds)
