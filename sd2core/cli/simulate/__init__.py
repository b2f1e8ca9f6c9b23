"""``sd2 simulate``: recordings and radar signals with known truth."""

from __future__ import annotations

import argparse
from pathlib import Path

from sd2core.cli.options import add_command
from sd2core.cli.output import progress_bar
from sd2core.cli.simulate.campaign import add_campaign
from sd2core.cli.simulate.radar import add_radar


def add_commands(commands: argparse._SubParsersAction) -> None:
    """Add ``simulate`` with what it makes."""
    parser = add_command(
        commands,
        "simulate",
        "make recordings of a simulated body, radar samples of any mesh, pairs to train on",
        examples=(
            "  sd2 simulate sample swipes.sd2\n"
            "  sd2 simulate radar walk.npz walk-radar\n"
            "  sd2 simulate campaign campaign.zarr"
        ),
    )
    kinds = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    sample = add_command(
        kinds,
        "sample",
        "make the bundled sample recording again",
        handler=_sample,
        description=(
            "A body makes two swipes to the right, left, down and up, 2.2 m in front of the\n"
            "camera and a 60 GHz radar: a rendered video, the mesh, and the raw samples of the\n"
            "radar with noise and static clutter."
        ),
    )
    sample.add_argument("out", type=Path, metavar="OUT", help="the recording to make (NAME.sd2)")
    add_radar(kinds)
    add_campaign(kinds)


def _sample(options: argparse.Namespace) -> None:
    from sd2core.simulate.sample import make_sample

    with progress_bar("Simulating", unit="frame") as progress:
        made = make_sample(options.out, progress)
    print(f"Made {made}")
