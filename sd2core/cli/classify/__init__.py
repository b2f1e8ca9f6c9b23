"""``sd2 classify``: find gestures in Doppler maps."""

from __future__ import annotations

import argparse

from sd2core.cli.classify.apply import add_apply
from sd2core.cli.classify.comparison import add_table
from sd2core.cli.classify.eval import add_eval
from sd2core.cli.classify.train import add_train
from sd2core.cli.options import add_command


def add_commands(commands: argparse._SubParsersAction) -> None:
    """Add ``classify`` and what it can do."""
    parser = add_command(
        commands,
        "classify",
        "train gesture classifiers, judge them, and use them",
        description=(
            "A classifier says of every frame of a Doppler map how probable each gesture is. It\n"
            "learns from labelled maps and is judged on people that it has not learnt from."
        ),
        examples=(
            "  sd2 classify train campaign.zarr --out gestures.safetensors\n"
            "  sd2 classify apply walk.sd2 --model gestures.safetensors"
        ),
    )
    kinds = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    add_train(kinds)
    add_eval(kinds)
    add_apply(kinds)
    add_table(kinds)
