"""Make the pairs that the bundled gesture classifier learns from: `python -m tools.gesture_pairs`.

Simulated people face a camera and a radar 2.2 m ahead, as in the sample, and swipe in random
order. The radar's maps are of one look, as the sample's are.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path

from sd2core.simulate.campaign.making import make_campaign
from sd2core.simulate.campaign.protocol import PAPER
from sd2core.simulate.campaign.radar import TargetOptions
from sd2core.simulate.campaign.takes import Campaign

SEED, PEOPLE = 61, 8


def main() -> None:
    """Make so many minutes of eight people, or go on where it was stopped."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path, help="folder of the pairs, .zarr")
    parser.add_argument("--minutes", type=float, default=14.0, help="of all people together")
    asked = parser.parse_args()
    protocol = replace(PAPER, order="random")
    campaign = Campaign(SEED, target=TargetOptions(looks=1), protocol=protocol)
    make_campaign(
        asked.out,
        campaign,
        subjects=PEOPLE,
        minutes=asked.minutes,
        processes=1,
        progress=lambda done, total: print(f"{done} of {total} takes", file=sys.stderr),
    )


if __name__ == "__main__":
    main()
