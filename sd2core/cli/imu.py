"""``sd2 imu``: what an inertial sensor on the body would measure."""

from __future__ import annotations

from pathlib import Path

from sd2core.cli.command_parser import command
from sd2core.cli.output import Report, progress_bar
from sd2core.errors import Sd2Error
from sd2core.options.inertial import SensorErrors
from sd2core.options.kinds import Positive, Vector
from sd2core.options.shared import Json, MeshInput, Overwrite


class Imu(MeshInput, Overwrite, SensorErrors, Json):
    """Options of ``sd2 imu``.

    Parameters
    ----------
    at : PLACE|VERTEX
        where on the body, or which vertex
    out : FILE
        the samples to write (.csv, .sto or .npz)
    rate : HZ
        samples per second
    cutoff : HZ
        where the zero-phase low pass leaves half of the amplitude, in Hz (default: 6, or a
        fifth of the mesh's frame rate if that is lower)
    up : X,Y,Z
        upwards in the mesh's frame (default: 0,-1,0, as for a camera held level)
    """

    at: str
    out: Path
    rate: Positive = 100.0
    cutoff: Positive | None = None
    up: Vector = (0.0, -1.0, 0.0)


@command("imu", Imu)
def _imu(options: Imu) -> Report:
    """What an inertial sensor on the body would measure (simulated).

    Fixes an accelerometer and a gyroscope to the body and writes what they would feel:
    m/s² with gravity (at rest 9.81 upwards) and rad/s, along the sensor's own axes. On
    meshes of `sd2 fit` places have names: head, chest, pelvis, and left- or right- with
    upper-arm, forearm, wrist, hand, thigh, shank, foot. There x runs along the bone,
    away from the trunk or up it, and z points out of the body. On a vertex of any other
    surface z points out of it, x as near to upwards as lies in it, in the first frame.
    y completes them right-handed. Where there is no body for a while, the samples are
    empty. Of several people --person says who. See docs/imu.md.

      sd2 imu walk.zarr --at left-wrist --out wrist.csv
      sd2 imu walk.npz --at 4711 --rate 200 --out spot.sto
      sd2 imu walk.sd2 --at right-foot --acc-noise 0.002 --acc-range 20 --out foot.npz
    """
    from sd2core.cli.info.description import signals_data
    from sd2core.cli.reading import mesh_and_its_sensor
    from sd2core.imu.files import write_signals
    from sd2core.imu.virtual import virtual_imu

    _check_output(options.out)
    mesh, _ = mesh_and_its_sensor(options)
    with progress_bar("Moving the sensor") as progress:
        signals = virtual_imu(
            mesh,
            options.at,
            rate_hz=options.rate,
            cutoff_hz=options.cutoff,
            up=options.up,
            errors=options,
            progress=progress,
        )
    write_signals(options.out, signals)
    summary = signals_data(signals)
    unknown = summary["samples"] - summary["known_samples"]
    who = [name for name in ("at", "person") if name in signals.meta]
    return Report(
        f"{options.out} (simulated)",
        {"file": str(options.out), **summary, **signals.meta},
        {
            "at": " of ".join(str(signals.meta[name]) for name in who),
            "axes": str(signals.meta["axes"]),
            "samples": f"{summary['samples']:,} at {options.rate:g} Hz"
            + (f", of which {unknown:,} without a body are empty" if unknown else ""),
            "low pass": f"{signals.meta['cutoff_hz']:g} Hz, of a mesh with"
            f" {signals.meta['frames_per_s']:.4g} frames/s",
            "acceleration": f"up to {summary['largest_acceleration_mps2']:.1f} m/s², with gravity",
            "turn rate": f"up to {summary['largest_turn_rate_radps']:.2f} rad/s",
        },
    )


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
