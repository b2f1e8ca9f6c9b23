"""``sd2 imu``: what an inertial sensor on the body would measure."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING

from sd2core.cli.command_parser import Options, add_command
from sd2core.cli.options import not_negative_float, positive_float, vector
from sd2core.cli.output import print_facts, print_json, progress_bar
from sd2core.errors import Sd2Error

if TYPE_CHECKING:
    from sd2core.imu.sensor_errors import SensorErrors


def add_commands(commands: argparse._SubParsersAction) -> None:
    """Add ``imu``."""
    parser = add_command(commands, "imu", handler=_imu)
    parser.add_value("mesh", Path, "MESH", "a mesh, or a recording")
    text = "where on the body, or which vertex"
    parser.add_value("--at", str, "PLACE|VERTEX", text, required=True)
    parser.add_output("FILE", "the samples to write (.csv, .sto or .npz)")
    parser.add_value("--rate", positive_float, "HZ", "samples per second", 100.0)
    text = "where the zero-phase low pass leaves half of the amplitude, in Hz (default: 6, or a"
    text += " fifth of the mesh's frame rate if that is lower)"
    parser.add_value("--cutoff", positive_float, "HZ", text)
    text = "upwards in the mesh's frame (default: 0,-1,0, as for a camera held level)"
    parser.add_value("--up", vector, "X,Y,Z", text, (0.0, -1.0, 0.0))
    _add_errors(parser)
    parser.add_mesh_reading()
    parser.add_json()
    parser.set_defaults(sensor=None)


def _add_errors(parser: Options) -> None:
    group = parser.add_argument_group("sensor errors", "none by default")
    for short, long, unit in (("acc", "accelerometer", "m/s²"), ("gyr", "gyroscope", "rad/s")):
        text = f"constant error of the {long}, in {unit}"
        group.add_value(f"--{short}-bias", vector, "X,Y,Z", text, (0.0, 0.0, 0.0))
        group.add_argument(
            f"--{short}-noise",
            type=not_negative_float,
            default=0.0,
            metavar="DENSITY",
            help=f"density of its white noise, in {unit}/√Hz",
        )
        group.add_argument(
            f"--{short}-range",
            type=positive_float,
            default=math.inf,
            metavar="LARGEST",
            help=f"its range, plus and minus, in {unit}; what is beyond is clipped",
        )
    group.add_value("--seed", int, "N", "seed of the noise", 0)


def _imu(options: argparse.Namespace) -> None:
    """What an inertial sensor on the body would measure (simulated).

    Fixes an accelerometer and a gyroscope to the body and writes what they would feel:
    m/s² with gravity (at rest 9.81 upwards) and rad/s, along the sensor's own axes. On
    meshes of `sd2 fit` places have names: head, chest, pelvis, and left- or right- with
    upper-arm, forearm, wrist, hand, thigh, shank, foot. There x runs along the bone,
    away from the trunk or up it, and z points out of the body. On a vertex of any other
    surface z points out of it, x as near to upwards as lies in it, in the first frame.
    y completes them right-handed. Where there is no body for a while, the samples are
    empty. See docs/imu.md.

      sd2 imu walk.zarr --at left-wrist --out wrist.csv
      sd2 imu walk.npz --at 4711 --rate 200 --out spot.sto
      sd2 imu walk.sd2 --at right-foot --acc-noise 0.002 --acc-range 20 --out foot.npz
    """
    from sd2core.cli.info.description import signals_data
    from sd2core.cli.reading import mesh_and_sensor
    from sd2core.imu.files import write_signals
    from sd2core.imu.virtual import virtual_imu

    _check_output(options.out)
    errors = _errors(options)
    mesh, _ = mesh_and_sensor(options)
    with progress_bar("Moving the sensor") as progress:
        signals = virtual_imu(
            mesh,
            options.at,
            rate_hz=options.rate,
            cutoff_hz=options.cutoff,
            up=options.up,
            errors=errors,
            progress=progress,
        )
    write_signals(options.out, signals)
    told = signals_data(signals)
    if options.json:
        print_json({"file": str(options.out), **told, **signals.meta})
        return
    unknown = told["samples"] - told["known_samples"]
    print_facts(
        f"{options.out} (simulated)",
        {
            "at": str(signals.meta["at"]),
            "axes": str(signals.meta["axes"]),
            "samples": f"{told['samples']:,} at {options.rate:g} Hz"
            + (f", of which {unknown:,} without a body are empty" if unknown else ""),
            "low pass": f"{signals.meta['cutoff_hz']:g} Hz, of a mesh with"
            f" {signals.meta['frames_per_s']:.4g} frames/s",
            "acceleration": f"up to {told['largest_acceleration_mps2']:.1f} m/s², with gravity",
            "turn rate": f"up to {told['largest_turn_rate_radps']:.2f} rad/s",
        },
    )


def _errors(options: argparse.Namespace) -> SensorErrors | None:
    from sd2core.imu.sensor_errors import SensorErrors

    errors = SensorErrors(
        acceleration_bias_mps2=options.acc_bias,
        turn_rate_bias_radps=options.gyr_bias,
        acceleration_noise=options.acc_noise,
        turn_rate_noise=options.gyr_noise,
        acceleration_range_mps2=options.acc_range,
        turn_rate_range_radps=options.gyr_range,
        seed=options.seed,
    )
    return None if errors == SensorErrors(seed=options.seed) else errors


def _check_output(path: Path) -> None:
    """Refuse an output that cannot be written, or is a file of something else."""
    from sd2core.cli.output_folders import check_output
    from sd2core.imu.files import SUFFIXES, read_signals

    check_output(path, *SUFFIXES)
    # `mktemp` leaves an empty file to be filled.
    if path.exists() and path.stat().st_size:
        try:
            read_signals(path)
        except Sd2Error as error:
            raise Sd2Error(
                f"The output file {path} exists and holds no samples of an inertial sensor",
                "a new name, or such a file to replace",
                "Choose another name, or delete that file first",
            ) from error
