"""``sd2 simulate campaign``: simulated pairs to train a denoiser on."""

from __future__ import annotations

import argparse
from pathlib import Path

from sd2core.cli.options import add_command, add_json, positive_float, positive_int
from sd2core.cli.output import print_json, progress_bar


def add_campaign(kinds: argparse._SubParsersAction) -> None:
    """Add ``simulate campaign``."""
    parser = add_command(
        kinds,
        "campaign",
        "make pairs of synthetic Doppler and simulated radar to train a denoiser on",
        handler=_campaign,
        description=(
            "People of random shape swipe to the right, left, down and up in random order,\n"
            "rest, and do other things. Of every take there is the Doppler map that a simulated\n"
            "radar shows of the true motion, and the synthetic one of a body that errs as fits\n"
            "of videos err. Stopped and started again it goes on where it was, and a longer\n"
            "campaign goes on with a shorter one; the same seed makes the same takes."
        ),
        examples=(
            "  sd2 simulate campaign campaign.zarr\n"
            "  sd2 simulate campaign small.zarr --subjects 3 --minutes 5 --seed 1\n"
            "  sd2 simulate campaign ranges.zarr --placements 3"
        ),
    )
    parser.add_argument("out", type=Path, metavar="OUT", help="folder of the pairs")
    parser.add_argument(
        "--subjects",
        type=positive_int,
        default=6,
        metavar="N",
        help="number of people (default: 6)",
    )
    parser.add_argument(
        "--minutes",
        type=positive_float,
        default=90.0,
        metavar="M",
        help="minutes of all people together (default: 90)",
    )
    parser.add_argument(
        "--seed", type=_seed, default=0, metavar="S", help="seed of all random numbers (default: 0)"
    )
    parser.add_argument(
        "--placements",
        type=positive_int,
        default=1,
        metavar="N",
        help="sensors that see each take: its own, beside the camera, and N - 1 at other ranges"
        " and angles (default: 1)",
    )
    parser.add_argument(
        "--take-seconds",
        type=positive_float,
        default=15.0,
        metavar="T",
        help="length of a take (default: 15)",
    )
    parser.add_argument(
        "--processes",
        type=positive_int,
        default=2,
        metavar="P",
        help="worker processes (default: 2)",
    )
    parser.add_argument(
        "--fit-errors",
        type=Path,
        metavar="FILE",
        help="errors of fits to imitate (.json; default: those measured of `sd2 fit`)",
    )
    add_json(parser)


def _seed(text: str) -> int:
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number from 0 on")
    return int(text)


def _campaign(options: argparse.Namespace) -> None:
    from sd2core.pairs.store import read_pairs
    from sd2core.simulate.campaign.making import make_campaign
    from sd2core.simulate.campaign.takes import Campaign

    campaign = Campaign(options.seed, options.take_seconds, options.placements)
    with progress_bar("Simulating", unit="take") as progress:
        made = make_campaign(
            options.out,
            campaign,
            subjects=options.subjects,
            minutes=options.minutes,
            processes=options.processes,
            errors=options.fit_errors,
            progress=progress,
        )
    pairs = read_pairs(options.out)
    first = pairs.placements(first_only=True)
    if options.json:
        print_json(
            {
                "path": str(options.out),
                "simulated": True,
                "subjects": list(pairs.subjects),
                "takes": len(pairs.takes),
                "made": made,
                "frames": pairs.frames,
                "minutes": first.frames / first.frame_rate_hz / 60.0,
                "placements": options.placements,
                "labels": list(pairs.labels),
            }
        )
        return
    print(
        f"Made {made} takes: {options.out} holds {len(first.takes)} simulated takes of"
        f" {len(pairs.subjects)} people, {first.frames / first.frame_rate_hz / 60.0:.1f} minutes"
        + (f", each from {options.placements} places" if options.placements > 1 else "")
    )
