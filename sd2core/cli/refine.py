"""``sd2 refine``: a mesh of another tool made smooth in time."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from sd2core.cli.command_parser import command
from sd2core.cli.output import Report, progress_bar
from sd2core.options.shared import Json, MeshInput, Overwrite

if TYPE_CHECKING:
    from sd2core.mesh.sequence import MeshSequence


class Refine(MeshInput, Overwrite, Json):
    """Options of ``sd2 refine``.

    Parameters
    ----------
    out : FILE
        the mesh to write (.zarr or .npz)
    video : FILE
        the video that it was made from, for its size, and its times where the mesh has none
    """

    out: Path
    video: Path | None = None


@command("refine", Refine)
def _refine(options: Refine) -> Report:
    """Make a mesh of another tool smooth in time, and say how well its velocities are known.

    Estimators of bodies look at one frame after the other, and jitter between frames is
    false Doppler. What moves keeps its speed, and nothing lags; steps of one frame are
    left out. Frames without a person separate stretches. Maps of the result show how
    uncertain they are, as those of `sd2 fit` do.

      sd2 refine wham_output.pkl --video walk.mp4 --out walk.zarr
      sd2 refine sam3d/ --fps 30 --out walk.npz
    """
    import numpy as np

    from sd2core.body.mesh_refining import refined
    from sd2core.io.mesh import save_mesh

    mesh = _read(options)
    with progress_bar("Finding the jitter") as progress:
        smooth = refined(mesh.body(), progress)
    with progress_bar("Writing the mesh") as progress:
        save_mesh(smooth, options.out, progress)
    assert smooth.uncertainty is not None
    present = smooth.presence.present
    known = {
        "along_mps": float(np.median(smooth.uncertainty.along_mps[present])),
        "across_mps": float(np.median(smooth.uncertainty.across_mps[present])),
    }
    made = {"out": str(options.out), "frames": smooth.frame_count, "velocity_sigma": known}
    facts = {
        "frames": f"{smooth.frame_count:,}",
        "velocities": f"±{known['along_mps']:.2f} m/s along the line of sight,"
        f" ±{known['across_mps']:.2f} across it (median)",
    }
    data = made | {"notes": list(smooth.notes)}
    return Report(f"Wrote {options.out}", data, facts, smooth.notes)


def _read(options: Refine) -> MeshSequence:
    """Mesh with size and times of the video, where neither its file nor an option has them."""
    from sd2core.cli.reading import mesh_and_its_sensor
    from sd2core.io.mesh import NO_TIMES
    from sd2core.io.mesh_models import is_estimate
    from sd2core.io.video import open_video

    if options.video is None:
        return mesh_and_its_sensor(options)[0]
    with open_video(options.video) as video:
        size, clock = (video.width, video.height), video.timebase
    if options.image_size is None and options.mesh.exists() and is_estimate(options.mesh):
        options = replace(options, image_size=size)
    mesh, _ = mesh_and_its_sensor(options)
    if NO_TIMES not in mesh.notes:
        return mesh
    mesh, _ = mesh_and_its_sensor(replace(options, fps=clock.frames_per_s))
    return replace(mesh, timebase=clock) if len(clock) == mesh.frame_count else mesh
