"""``sd2 simulate``: radar samples of any mesh, and pairs of simulated people to train on."""

from __future__ import annotations

import argparse
import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from sd2core.cli.command_parser import Options, add_command
from sd2core.cli.options import finite_float, position, positive_float, positive_int
from sd2core.cli.output import picked, print_json, progress_bar
from sd2core.errors import Sd2Error

if TYPE_CHECKING:
    from sd2core.fmcw import SignalOptions, WaveOptions
    from sd2core.io.radar import RadarCapture
    from sd2core.mesh.sequence import MeshSequence
    from sd2core.radar_config import RadarConfig
    from sd2core.sensor import VirtualSensor
    from sd2core.simulate.campaign.protocol import Protocol


def add_commands(commands: argparse._SubParsersAction) -> None:
    """Make radar samples of any mesh, or pairs of simulated people to train on.

    sd2 simulate radar walk.npz --out walk-radar
    sd2 simulate campaign --out campaign.zarr
    """
    parser = add_command(commands, "simulate", about=add_commands)
    kinds = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    _add_radar(kinds)
    _add_campaign(kinds)


def _add_radar(kinds: argparse._SubParsersAction) -> None:
    parser = add_command(kinds, "radar", handler=_radar)
    parser.add_mesh_and_sensor()
    parser.add_output("FOLDER", "the capture to write")
    add_radar_choice(parser)
    text = "sum by a non-uniform FFT, or triangle by triangle, some hundred times slower"
    parser.add_choice("--method", ("nufft", "direct"), text, "nufft")
    parser.add_value(
        "--blocks", positive_int, "N", "parts of a frame that follow the range as it changes", 1
    )
    text = "within a frame: constant velocity, or the mesh interpolated at every chirp, which"
    text += " takes as many sums as there are chirps"
    parser.add_choice("--motion", ("constant", "interpolated"), text, "constant")
    parser.add_flag(
        "--incoherent", "a rough surface: every triangle has a random phase (default: a smooth one)"
    )
    text = "which triangles echo: those that face the radar, or those that nothing hides"
    parser.add_choice("--visibility", ("facing", "exact"), text, "exact")
    parser.add_value(
        "--receivers",
        receivers,
        "N",
        "how many, half a wavelength apart; or their places relative to the transmitter,"
        " as X,Y,Z;X,Y,Z in metres to the right, down and ahead (default: the radar's own number)",
    )
    text = "full width of the beam at half power, along where the sensor looks (default: all"
    text += " directions alike)"
    parser.add_value("--beam-width-deg", positive_float, "DEG", text)
    plane = parser.add_mutually_exclusive_group()
    text = "a floor Y metres below the camera reflects; C is its amplitude coefficient"
    text += " (default: concrete, -0.39)"
    plane.add_value("--ground", plane_at, "Y[,C]", text)
    plane.add_value(
        "--wall", plane_at, "Z[,C]", "a wall Z metres in front of the camera reflects, likewise"
    )
    noise = parser.add_mutually_exclusive_group()
    text = "add thermal noise this many decibels below the moving mesh's echo (default: none)"
    noise.add_value("--snr-db", finite_float, "DB", text)
    text = "gain and noise of a 60 GHz radar on one chip, so that what is farther away is weaker"
    text += " (default: a gain that suits the strongest echo)"
    noise.add_flag("--link-budget", text)
    parser.add_value("--seed", int, "N", "seed of noise and random phases", 0)
    parser.add_mesh_reading()
    parser.add_json()


def add_radar_choice(parser: Options) -> None:
    """Add ``--radar``."""
    from sd2core.radar_profiles import RADARS

    text = f"a radar by its name ({', '.join(RADARS)}; docs/radar-files.md), or that of a"
    text += " capture's config.json (default: paper)"
    parser.add_value("--radar", str, "NAME|CONFIG.json", text, "paper")


def simulate_with_bar(
    mesh: MeshSequence,
    sensor: VirtualSensor,
    config: RadarConfig,
    visibility: Literal["facing", "exact"],
    *,
    wave: WaveOptions | None = None,
    options: SignalOptions | None = None,
) -> RadarCapture:
    """Raw samples of a mesh, with a bar; without noise unless the options say otherwise."""
    from sd2core.fmcw import SignalOptions, simulate_radar

    with progress_bar("Simulating") as progress:
        return simulate_radar(
            mesh,
            config,
            sensor=sensor,
            visibility=visibility,
            wave=wave,
            options=options or SignalOptions(snr_db=math.inf),
            progress=progress,
        )


def receivers(text: str) -> int | tuple[tuple[float, float, float], ...]:
    """Parse a number of receivers, or ``X,Y,Z;X,Y,Z``."""
    if "," not in text:
        return positive_int(text)
    return tuple(position(part) for part in text.split(";"))


def plane_at(text: str) -> tuple[float, ...]:
    """Parse a place in metres with or without a reflection coefficient."""
    values = tuple(finite_float(part) for part in text.split(","))
    if len(values) > 2:
        raise argparse.ArgumentTypeError(f"{text!r} is not a place, or a place and a coefficient")
    return values


def _radar(options: argparse.Namespace) -> None:
    """Compute the raw samples that a radar would record of a moving mesh.

    Sums the echo of every triangle, with its phase, to the beat signal of an FMCW
    radar, and writes the samples in the format of a capture, marked as simulated.
    The camera is at 0,0,0 and looks along z; x is to its right and y down, in
    metres.

      sd2 simulate radar walk.npz --out walk-radar
      sd2 radar walk-radar --out map.npz    (its Doppler map)
      sd2 simulate radar walk.npz --out left --sensor -1,0,0 --snr-db 20 --receivers 3
      sd2 simulate radar walk.npz --out floor --ground 1.1 --beam-width-deg 60
      sd2 simulate radar walk.npz --out like-mine --radar capture/config.json
    """
    from sd2core.cli.info.description import describe_capture, show
    from sd2core.cli.reading import mesh_and_sensor
    from sd2core.fmcw import LinkBudget, Mirror, SignalOptions, WaveOptions
    from sd2core.io.radar import check_replaceable, named_radar, write_capture, write_described

    check_replaceable(options.out)
    config = named_radar(options.radar)
    offsets: tuple[tuple[float, float, float], ...] = ()
    if options.receivers is not None:
        placed = not isinstance(options.receivers, int)
        offsets = options.receivers if placed else ()
        config = replace(config, receivers=len(offsets) if placed else options.receivers)
    mirror = None
    if options.ground is not None:
        mirror = Mirror.ground(*options.ground)
    elif options.wall is not None:
        mirror = Mirror.wall(*options.wall)
    wave = WaveOptions(
        model=options.method,
        coherent=not options.incoherent,
        receiver_offsets_m=offsets,
        mirror=mirror,
        **picked(options, "blocks", "motion", "beam_width_deg"),
    )
    mesh, sensor = mesh_and_sensor(options)
    capture = simulate_with_bar(
        mesh,
        sensor,
        config,
        options.visibility,
        wave=wave,
        options=SignalOptions(
            snr_db=math.inf if options.snr_db is None else options.snr_db,
            seed=options.seed,
            link=LinkBudget() if options.link_budget else None,
        ),
    )
    write = write_capture if config.sampling == "real" else write_described
    folder = write(
        options.out,
        capture.samples[:],
        capture.config,
        capture.timebase.times_s,
        simulated=True,
        meta=capture.meta,
    )
    description = describe_capture(folder, capture)
    description.notes = mesh.notes + description.notes
    description.data["notes"] = list(description.notes)
    show(description, as_json=options.json)


def _add_campaign(kinds: argparse._SubParsersAction) -> None:
    parser = add_command(kinds, "campaign", handler=_campaign)
    parser.add_output("FILE.zarr", "the pairs to write", goes_on=True)
    parser.add_value("--people", positive_int, "N", "number of people", 6)
    parser.add_value("--minutes", positive_float, "MIN", "minutes of all people together", 90.0)
    parser.add_choice("--protocol", ("paper", "varied"), "what varies from take to take", "varied")
    text = "of the paper's swipes: one kind in a take, or all four (default: to-and-fro)"
    parser.add_choice("--order", ("to-and-fro", "random"), text)
    text = "what people do: swipes, what real people were recorded doing, or both in turn"
    parser.add_choice("--movements", ("swipes", "captured", "both"), text, "swipes")
    text = "recorded motions, as `python -m tools.motion_capture drive` makes them"
    parser.add_value("--motions", Path, "FOLDER", text)
    text = "people of that folder: those to learn from, or those kept apart"
    parser.add_choice("--motion-role", ("learn", "calibrate", "measure"), text, "learn")
    add_radar_choice(parser)
    text = "the same radar in all takes, or looks, surface, noise and threshold drawn for each"
    parser.add_choice("--radars", ("one", "drawn"), text, "one")
    parser.add_value("--seed", _seed, "N", "seed of all random numbers", 0)
    text = "sensors that see each take: its own, beside the camera, and N - 1 at other ranges"
    text += " and angles"
    parser.add_value("--sensors", positive_int, "N", text, 1)
    text = "frames per second of the radar, 10 to 120 (default: its own)"
    parser.add_value("--rate", positive_float, "FPS", text)
    parser.add_value("--bins", positive_int, "N", "velocity bins, 16 to 128 (default: 32)")
    parser.add_value("--take-seconds", positive_float, "S", "length of a take, in seconds", 15.0)
    parser.add_value("--workers", positive_int, "N", "worker processes (default: one per core)")
    parser.add_limbs()
    text = "errors of fits to imitate (default: those measured of `sd2 fit`)"
    parser.add_value("--fit-errors", Path, "FILE.json", text)
    text = "how many times as large as those errors are, drawn anew for every take; 0,0: meshes"
    text += " without errors (default: 1,1)"
    parser.add_value("--fit-error-sizes", _sizes, "LEAST,MOST", text, (1.0, 1.0))
    parser.add_json()


def _sizes(text: str) -> tuple[float, float]:
    try:
        least, most = map(float, text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not LEAST,MOST, e.g. 0,1.5") from None
    return least, most


def _seed(text: str) -> int:
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number from 0 on")
    return int(text)


def _protocol(options: argparse.Namespace) -> Protocol:
    from sd2core.simulate.campaign.protocol import PAPER, VARIED

    if options.protocol == "paper":
        if options.movements != "swipes" or options.radars != "one" or options.radar != "paper":
            raise Sd2Error(
                f"--protocol paper with movements {options.movements}, radars {options.radars} and"
                f" radar {options.radar}",
                "swipes before one radar, the paper's",
                "Leave the protocol out",
            )
        return replace(PAPER, order=options.order or PAPER.order)
    if options.order == PAPER.order:
        raise Sd2Error(
            "--order to-and-fro with the protocol varied, whose order is random",
            "another order or protocol",
            "Add --protocol paper",
        )
    drawn = options.radars == "drawn"
    return replace(VARIED, movements=options.movements, drawn_radars=drawn)


def _campaign(options: argparse.Namespace) -> None:
    """Make pairs of synthetic Doppler and simulated radar to train a denoiser on.

    People of random shape swipe to the right, left, down and up, or move as real people
    were recorded (--movements captured), or both in turn. Varied, they stand
    anywhere, turned a little, swipe in random order, rest, and do other things. As in
    the paper, they face a radar and a camera 2.2 m ahead, and swipe to and fro in one
    take, up and down in another, and rest in a third. Of every take there is the
    Doppler map that a simulated radar shows of the true motion, and the synthetic one
    of a body that errs as fits of videos err. Stopped and started again it goes on
    where it was, and a longer campaign goes on with a shorter one; the same seed makes
    the same takes.

      sd2 simulate campaign --out campaign.zarr
      sd2 simulate campaign --people 3 --minutes 5 --seed 1 --out small.zarr
      sd2 simulate campaign --sensors 3 --out ranges.zarr
      sd2 simulate campaign --radar iwr6843 --out as-that-radar.zarr
      sd2 simulate campaign --protocol paper --out as-in-the-paper.zarr
      sd2 simulate campaign --movements both --motions motions --radars drawn --out all
    """
    from sd2core.doppler.options import chosen_options
    from sd2core.io.radar import named_radar
    from sd2core.numerics.compiled import worker_count
    from sd2core.options.synthesis import Synthesis
    from sd2core.pairs.store import read_pairs
    from sd2core.simulate.campaign.making import make_campaign
    from sd2core.simulate.campaign.radar import radar_at
    from sd2core.simulate.campaign.takes import Campaign

    radar = named_radar(options.radar)
    rate, bins = options.rate or 1.0 / radar.frame_repetition_s, options.bins or 32
    if not (10 <= rate <= 120 and 16 <= bins <= 128):
        raise Sd2Error(f"{rate:g} frames/s and {bins} bins", "10 to 120 frames/s, 16 to 128 bins")
    campaign = Campaign(
        options.seed,
        options.take_seconds,
        options.sensors,
        radar_at(rate, bins, radar),
        limbs=options.limbs,
        protocol=_protocol(options),
        motions=options.motions,
        role=options.motion_role,
        error_sizes=options.fit_error_sizes,
        synthesis=chosen_options(Synthesis(bins=bins)),
    )
    with progress_bar("Simulating", unit="take") as progress:
        made = make_campaign(
            options.out,
            campaign,
            subjects=options.people,
            minutes=options.minutes,
            processes=options.workers or worker_count(),
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
                "protocol": campaign.protocol.name,
                "subjects": list(pairs.subjects),
                "takes": len(pairs.takes),
                "made": made,
                "frames": pairs.frames,
                "minutes": first.frames / first.frame_rate_hz / 60.0,
                "placements": options.sensors,
                "labels": list(pairs.labels),
            }
        )
        return
    print(
        f"Made {made} takes: {options.out} holds {len(first.takes)} simulated takes of"
        f" {len(pairs.subjects)} people, {first.frames / first.frame_rate_hz / 60.0:.1f} minutes"
        + (f", each from {options.sensors} places" if options.sensors > 1 else "")
    )
