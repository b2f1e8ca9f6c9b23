"""``sd2 refine``: a mesh of another tool made smooth in time."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from sd2core.cli.command_parser import command
from sd2core.cli.output import print_facts, print_json, progress_bar
from sd2core.options.shared import Json, MeshInput, Overwrite


class Refine(MeshInput, Overwrite, Json):
    """Options of ``sd2 refine``.

    Parameters
    ----------
    out : FILE
        the mesh to write (.zarr or .npz)
    video : FILE
        the video that it was made from, for its size and its frames per second
    """

    out: Path
    video: Path | None = None


@command("refine", Refine)
def _refine(options: Refine) -> None:
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
    from sd2core.cli.reading import mesh_and_its_sensor
    from sd2core.io.mesh import save_mesh

    mesh, _ = mesh_and_its_sensor(_filled_by_video(options))
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
    if options.json:
        made = {"out": str(options.out), "frames": smooth.frame_count, "velocity_sigma": known}
        print_json(made | {"notes": list(smooth.notes)})
        return
    facts = {
        "frames": f"{smooth.frame_count:,}",
        "velocities": f"±{known['along_mps']:.2f} m/s along the line of sight,"
        f" ±{known['across_mps']:.2f} across it (median)",
    }
    print_facts(f"Wrote {options.out}", facts)
    for note in smooth.notes:
        print(f"note: {note}")


def _filled_by_video(options: Refine) -> Refine:
    """Options that a video supplies for an estimator's file, where they are not typed."""
    from sd2core.io.mesh_models import is_estimate
    from sd2core.io.video import open_video

    if options.video is None:
        return options
    with open_video(options.video) as video:
        size, rate = (video.width, video.height), video.timebase.frames_per_s
    estimate = options.mesh.exists() and is_estimate(options.mesh)
    return replace(
        options,
        fps=options.fps or rate,
        image_size=options.image_size or (size if estimate else None),
    )
