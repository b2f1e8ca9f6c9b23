"""``sd2 placements``: sensors around a body, their positions and the cost of their maps."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from sd2core.cli.command_parser import command
from sd2core.cli.ladder import UsualRequest
from sd2core.cli.output import (
    Report,
    counted,
    duration,
    picked,
    print_facts,
    print_rows,
    progress_bar,
)
from sd2core.errors import Sd2Error
from sd2core.files.tables import bytes_text
from sd2core.options.kinds import Count, Natural
from sd2core.options.records import OptionError, Place, given_flags
from sd2core.options.shared import Json, MeshInput, Overwrite

if TYPE_CHECKING:
    from sd2core.accuracy import Choice
    from sd2core.mesh.sequence import MeshSequence
    from sd2core.placements.body_extent import SensorCoverage
    from sd2core.placements.placements import PlacementCost, Placements
    from sd2core.radar_config import RadarConfig
    from sd2core.recording.recording import Recording
    from sd2core.sensor import VirtualSensor

_LIMITS = (
    ("inside", "stand in the body"),
    ("out_of_range", "see it beyond the radar's range"),
    ("aliasing", "see it faster than the radar can tell"),
)


class Placing(MeshInput, UsualRequest, Overwrite, Json):
    """Options of ``sd2 placements``.

    Parameters
    ----------
    ranges : LIST
        distances in metres; with --cloud from:to, as 1:4
    azimuths : LIST
        degrees; with --cloud from:to (default: 0)
    elevations : LIST
        degrees; with --cloud from:to (default: 0)
    cloud : N
        so many random places instead of a grid
    seed : N
        seed of the random places (default: 0)
    placements : FILE
        read the places from a file of --out
    out : FILE.json
        the plan to write
    """

    ranges: str | None = None
    azimuths: str | None = None
    elevations: str | None = None
    cloud: Count | None = None
    seed: Natural | None = None
    placements: Path | None = None
    out: Annotated[Path | None, Place(endings=(".json",))] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        typed = given_flags(self, ("ranges", "azimuths", "elevations", "cloud", "seed"))
        if self.placements is not None and typed:
            raise OptionError(f"--placements is given with {', '.join(typed)}", "one of the two")
        if typed and self.ranges is None:
            raise OptionError(
                f"{', '.join(typed)} is given without --ranges", "distances from the body"
            )
        if self.seed is not None and self.cloud is None:
            raise OptionError("--seed is given without --cloud", "it for random places only")


@command("placements", Placing)
def _placements(options: Placing) -> Report:
    """Plan sensors around a body, and say what a map from each would cost.

    A grid of every range, azimuth and elevation that is given, or with --cloud as many
    random places between them. Ranges are distances from the body's centre; azimuth 0
    is between body and camera and grows to the right in the picture, elevation upwards.
    A list is 1,2,4 or 1:4:0.5, both ends included. Without any of these options, the
    places planned in the recording are listed.

      sd2 placements walk.sd2 --ranges 1:4:1 --azimuths -60:60:30 --out grid.json
      sd2 placements walk.sd2 --cloud 200 --ranges 1:4 --azimuths -60:60 --elevations -10:40
      sd2 placements walk.sd2 --placements grid.json --json
    """
    from sd2core.cli.reading import load_mesh_from_options, mesh_of, open_recording_from_options
    from sd2core.placements.body_extent import BodyExtent
    from sd2core.placements.placements import write_placements
    from sd2core.recording.recording import is_recording

    recording = None
    if is_recording(options.mesh):
        recording = open_recording_from_options(options.mesh, options)
    placements = _spec(options, recording)
    if recording is None:
        mesh = load_mesh_from_options(options.mesh, options)
    else:
        mesh = mesh_of(recording, options)
    body = BodyExtent.of(mesh)
    beam = None if recording is None else recording.sensor.beam
    sensors = placements.sensors(body.target_m, beam)
    with progress_bar("Checking", "place") as progress:
        coverage = body.coverage(sensors, progress)
    choice, cost = _cost(mesh, placements, sensors, options)
    if options.out is not None:
        write_placements(options.out, placements)
    radar = _radar(recording)
    listed = _listed(placements, sensors, coverage, radar)
    data = {
        "placements": placements.as_dict(),
        "target_m": body.target_m,
        "radar": picked(radar, "name", "range_max_m", "v_max_mps"),
        "places": listed,
        "cost": picked(cost, "maps", "frames", "frame_ms", "total_s", "total_bytes"),
        "choice": choice.to_json(),
    }
    return Report("", data, say=partial(_print, options.mesh, listed, radar, cost, choice))


def _spec(options: Placing, recording: Recording | None) -> Placements:
    """Placements from the options, or those planned in the recording."""
    from sd2core.files.number_lists import parse_interval, parse_numbers
    from sd2core.placements.placements import PlacementCloud, PlacementGrid, read_placements

    if options.placements is not None:
        return read_placements(options.placements)
    if options.ranges is None:
        if recording is not None and recording.placements is not None:
            return recording.placements
        raise Sd2Error(
            f"{options.mesh} plans no placements",
            "--ranges with --azimuths and --elevations, --cloud, or --placements FILE",
        )
    azimuths, elevations = options.azimuths or "0", options.elevations or "0"
    if options.cloud is None:
        return PlacementGrid(
            parse_numbers(options.ranges), parse_numbers(azimuths), parse_numbers(elevations)
        )
    return PlacementCloud(
        options.cloud,
        parse_interval(options.ranges),
        parse_interval(azimuths),
        parse_interval(elevations),
        options.seed or 0,
    )


def _radar(recording: Recording | None) -> RadarConfig:
    """Radar of the recording's capture, or the paper's."""
    from sd2core.radar_config import PAPER_RADAR

    if recording is None or recording.radar is None or "radar" in recording.missing():
        return PAPER_RADAR
    return PAPER_RADAR if recording.holds_radar_map else recording.load_capture().config


def _cost(
    mesh: MeshSequence, placements: Placements, sensors: tuple[VirtualSensor, ...], options: Placing
) -> tuple[Choice, PlacementCost]:
    """Plan and cost for the sensor at the median range."""
    from sd2core.accuracy.choosing import check_options
    from sd2core.cli.ladder import chosen
    from sd2core.doppler import PRESETS
    from sd2core.placements.placements import PlacementCost

    places = placements.places()
    middle = sorted(range(len(places)), key=lambda number: places[number].range_m)[len(places) // 2]
    synthesis = check_options(mesh, PRESETS["paper"])
    choice = chosen(mesh, sensors[middle], synthesis, options, dragging=False)
    return choice, PlacementCost(
        len(sensors), mesh.frame_count, choice.cost_ms, synthesis.axis.bins
    )


def _listed(
    placements: Placements,
    sensors: tuple[VirtualSensor, ...],
    coverage: SensorCoverage,
    radar: RadarConfig,
) -> list[dict[str, Any]]:
    problems = coverage.problems(radar)
    return [
        {
            **picked(place, "range_m", "azimuth_deg", "elevation_deg"),
            "position_m": sensor.position_m,
            "farthest_m": float(coverage.farthest_m[number]),
            "fastest_mps": float(coverage.fastest_mps[number]),
            **{name: bool(some[number]) for name, some in problems.items()},
        }
        for number, (place, sensor) in enumerate(zip(placements.places(), sensors, strict=True))
    ]


def _print(
    path: Path,
    listed: list[dict[str, Any]],
    radar: RadarConfig,
    cost: PlacementCost,
    choice: Choice,
) -> None:
    from sd2core.radar_config import range_in_words

    numbers = {name: sum(one[name] for one in listed) for name, _ in _LIMITS}
    beyond = [f"{numbers[name]} {words}" for name, words in _LIMITS if numbers[name]]
    limits = f"{range_in_words(radar.range_max_m)}, ±{radar.v_max_mps:.2f} m/s"
    print_facts(
        f"{counted(len(listed), 'placement')} around the body of {path}",
        {
            "radar": f"{radar.name}: {limits}",
            "beyond it": ", ".join(beyond) or "none",
            "cost": f"{counted(cost.maps, 'map')} of {counted(cost.frames, 'frame')}:"
            f" {duration(cost.total_s)}, {bytes_text(cost.total_bytes)} before compression",
            "plan": choice.summary,
        },
    )
    heading = ("range m", "azimuth °", "elevation °", "x", "y", "z", "up to m", "up to m/s", "")
    rows: list[tuple[str, ...]] = [heading]
    for one in listed:
        lengths = (*one["position_m"], one["farthest_m"], one["fastest_mps"])
        angles = (f"{one[name]:.1f}" for name in ("azimuth_deg", "elevation_deg"))
        why = ", ".join(words for name, words in _LIMITS if one[name])
        rows.append((f"{one['range_m']:.2f}", *angles, *(f"{m:.2f}" for m in lengths), why))
    print_rows(rows, right=range(8))
