"""``sd2 simulate``: radar samples of any mesh, and pairs of simulated people to train on."""

from __future__ import annotations

import argparse
import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from sd2core.cli.command_parser import Subcommands, add_command, command_group
from sd2core.cli.output import Report, counted, picked, progress_bar
from sd2core.errors import Sd2Error
from sd2core.options.bounds import ANY, COUNT
from sd2core.options.kinds import Count, Positive, Typed, joined, number_reader, vector
from sd2core.options.records import OptionError, Place
from sd2core.options.shared import Json, Limbs, MeshAndSensor, Overwrite, Simulating

if TYPE_CHECKING:
    from sd2core.fmcw import SignalOptions, WaveOptions
    from sd2core.io.radar.capture import RadarCapture
    from sd2core.mesh.sequence import MeshSequence
    from sd2core.radar_config import RadarConfig
    from sd2core.sensor import VirtualSensor
    from sd2core.simulate.campaign.protocol import Protocol


@dataclass(frozen=True)
class Receivers:
    """How many receivers there are, and where, relative to the transmitter, if that is said."""

    count: int
    offsets_m: tuple[tuple[float, float, float], ...] = ()

    def __str__(self) -> str:
        return ";".join(map(joined, self.offsets_m)) or str(self.count)


def _receivers(text: str) -> Receivers:
    """Read a number of receivers, or ``X,Y,Z;X,Y,Z``."""
    if "," not in text:
        return Receivers(number_reader(COUNT)(text))
    offsets_m = tuple(vector(part) for part in text.split(";"))
    return Receivers(len(offsets_m), offsets_m)


def _plane_at(text: str) -> tuple[float, ...]:
    """Read a place in metres with or without a reflection coefficient."""
    values = tuple(number_reader(ANY)(part) for part in text.split(","))
    if len(values) > 2:
        raise argparse.ArgumentTypeError(f"{text!r} is not a place, or a place and a coefficient")
    return values


def _sizes(text: str) -> tuple[float, float]:
    try:
        least, most = map(float, text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not LEAST,MOST, e.g. 0,1.5") from None
    return least, most


Plane = Annotated[tuple[float, ...], Typed(_plane_at, joined)]


class SimulateRadar(MeshAndSensor, Overwrite, Simulating, Json):
    """Options of ``sd2 simulate radar``.

    Parameters
    ----------
    out : FOLDER
        the capture to write
    method
        sum by a non-uniform FFT, or triangle by triangle, some hundred times slower
    blocks : N
        parts of a frame that follow the range as it changes
    motion
        within a frame: constant velocity (for up to 1/30 s), or the mesh interpolated at every
        chirp, which takes as many sums as there are chirps
    incoherent
        a rough surface: every triangle has a random phase (default: a smooth one)
    visibility
        which triangles echo: those that face the radar, or those that nothing hides
    receivers : N
        how many, half a wavelength apart; or their places relative to the transmitter, as
        X,Y,Z;X,Y,Z in metres to the right, down and ahead (default: the radar's own number)
    beam_width_deg : DEG
        full width of the beam at half power, along where the sensor looks (default: all directions
        alike)
    ground : Y[,C]
        a floor Y metres below the camera reflects; C is its amplitude coefficient (default:
        concrete, -0.39)
    wall : Z[,C]
        a wall Z metres in front of the camera reflects, likewise
    snr_db : DB
        add thermal noise this many decibels below the moving mesh's echo (default: none)
    link_budget
        gain and noise of a 60 GHz radar on one chip, so that what is farther away is weaker
        (default: a gain that suits the strongest echo)
    """

    out: Path
    method: Literal["nufft", "direct"] = "nufft"
    blocks: Count = 1
    motion: Literal["constant", "interpolated"] = "constant"
    incoherent: bool = False
    visibility: Literal["facing", "exact"] = "exact"
    receivers: Annotated[Receivers | None, Typed(_receivers)] = None
    beam_width_deg: Positive | None = None
    ground: Annotated[Plane | None, Place(one_of="plane")] = None
    wall: Annotated[Plane | None, Place(one_of="plane")] = None
    snr_db: Annotated[float | None, Place(one_of="noise")] = None
    link_budget: Annotated[bool, Place(one_of="noise")] = False


class SimulateCampaign(Simulating, Limbs, Json):
    """Options of ``sd2 simulate campaign``.

    Parameters
    ----------
    out : FILE.zarr
        the pairs to write
    people : N
        number of people
    minutes : MIN
        minutes of all people together
    protocol
        what varies from take to take
    order
        of the paper's swipes: one kind in a take, or all four (default: to-and-fro)
    movements
        what people do: swipes, what real people were recorded doing, or both in turn
    motions : FOLDER
        recorded motions, as `python -m tools.motion_capture drive` makes them
    motion_role
        people of that folder: those to learn from, or those kept apart
    radars
        the same radar in all takes, or looks, surface, noise and threshold drawn for each
    seed : N
        seed of all random numbers
    sensors : N
        sensors that see each take: its own, beside the camera, and N - 1 at other ranges and angles
    rate : FPS
        frames per second of the radar, 10 to 120 (default: its own)
    bins : N
        velocity bins, 16 to 128 (default: 32)
    take_seconds : S
        length of a take, in seconds
    workers : N
        worker processes (default: one per core)
    fit_errors : FILE.json
        errors of fits to imitate (default: those measured of `sd2 fit`)
    fit_error_sizes : LEAST,MOST
        how many times as large as those errors are, drawn anew for every take; 0,0: meshes without
        errors (default: 1,1)
    """

    out: Path
    people: Count = 6
    minutes: Positive = 90.0
    protocol: Literal["paper", "varied"] = "varied"
    order: Literal["to-and-fro", "random"] | None = None
    movements: Literal["swipes", "captured", "both"] = "swipes"
    motions: Path | None = None
    motion_role: Literal["learn", "calibrate", "measure"] = "learn"
    radars: Literal["one", "drawn"] = "one"
    sensors: Count = 1
    rate: Positive | None = None
    bins: Count | None = None
    take_seconds: Positive = 15.0
    workers: Count | None = None
    fit_errors: Path | None = None
    fit_error_sizes: Annotated[tuple[float, float], Typed(_sizes, joined)] = (1.0, 1.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.protocol == "varied":
            if self.order == "to-and-fro":
                raise OptionError(
                    "--order to-and-fro with the protocol varied, whose order is random",
                    "another order or protocol",
                    "Add --protocol paper",
                )
        elif self.movements != "swipes" or self.radars != "one" or self.radar != "paper":
            raise OptionError(
                f"--protocol paper with movements {self.movements}, radars {self.radars} and"
                f" radar {self.radar}",
                "swipes before one radar, the paper's",
                "Leave the protocol out",
            )


@command_group("simulate")
def _commands(kinds: Subcommands) -> None:
    """Make radar samples of any mesh, or pairs of simulated people to train on.

    sd2 simulate radar walk.npz --out walk-radar
    sd2 simulate campaign --out campaign.zarr
    """
    add_command(kinds, "radar", options=SimulateRadar, handler=_radar)
    add_command(kinds, "campaign", options=SimulateCampaign, handler=_campaign)


def simulate_with_bar(
    mesh: MeshSequence,
    sensor: VirtualSensor,
    config: RadarConfig,
    visibility: Literal["facing", "exact"],
    *,
    wave: WaveOptions | None = None,
    options: SignalOptions | None = None,
) -> RadarCapture:
    """Raw samples of a mesh, with a bar.

    Parameters
    ----------
    mesh, sensor : MeshSequence, VirtualSensor
        The scene.
    config : RadarConfig
        Radar that is simulated.
    visibility : {"facing", "exact"}
        Triangles that echo.
    wave : WaveOptions, optional
        Sum of echoes, surface, motion, antennas and mirror; by default its defaults.
    options : SignalOptions, optional
        Static surroundings, gain and noise; by default none, no noise.
    """
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


def _radar(options: SimulateRadar) -> Report:
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
    from sd2core.cli.info.description import describe_capture
    from sd2core.cli.reading import mesh_and_sensor
    from sd2core.fmcw import LinkBudget, Mirror, SignalOptions, WaveOptions
    from sd2core.io.radar import named_radar
    from sd2core.io.radar.described import write_described
    from sd2core.io.radar.infineon import check_replaceable, write_capture
    from sd2core.placements.body_extent import notes_on

    check_replaceable(options.out)
    config = named_radar(options.radar)
    offsets: tuple[tuple[float, float, float], ...] = ()
    if options.receivers is not None:
        offsets = options.receivers.offsets_m
        config = replace(config, receivers=options.receivers.count)
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
    description.notes = mesh.notes + notes_on(mesh, sensor, config) + description.notes
    description.data["notes"] = list(description.notes)
    return description


def _protocol(options: SimulateCampaign) -> Protocol:
    from sd2core.simulate.campaign.protocol import PAPER, VARIED

    if options.protocol == "paper":
        return replace(PAPER, order=options.order or PAPER.order)
    drawn = options.radars == "drawn"
    return replace(VARIED, movements=options.movements, drawn_radars=drawn)


def _campaign(options: SimulateCampaign) -> Report:
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
    minutes = first.frames / first.frame_rate_hz / 60.0
    return Report(
        f"Made {counted(made, 'take')}: {options.out} holds"
        f" {counted(len(first.takes), 'simulated take')} of"
        f" {counted(len(pairs.subjects), 'person', 'people')}, {minutes:.1f} minutes"
        + (f", each from {options.sensors} places" if options.sensors > 1 else ""),
        {
            "path": str(options.out),
            "simulated": True,
            "protocol": campaign.protocol.name,
            "subjects": list(pairs.subjects),
            "takes": len(pairs.takes),
            "made": made,
            "frames": pairs.frames,
            "minutes": minutes,
            "placements": options.sensors,
            "labels": list(pairs.labels),
        },
    )
