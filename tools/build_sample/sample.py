"""The bundled sample: a body makes eight swipes in front of a camera and a radar.

Video and radar come from the same motion, of the fine surface. The recording's mesh, ``fit.zarr``,
is what `sd2 fit` makes of its video; ``mesh.zarr`` beside it is the true one, on as coarse a
surface. Coordinates of both are rounded so that they are small.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from sd2core.body.fit_video import FitChoices, FitReport, fit_video
from sd2core.body.model import Body, Resolution
from sd2core.body.shape import ShapeSpace
from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_folder
from sd2core.files.stores import create_array, create_group
from sd2core.fmcw import simulate_radar
from sd2core.fmcw.options import Reflector, SignalOptions, WaveOptions
from sd2core.io.mesh import load_mesh
from sd2core.io.mesh_arrays import write_small
from sd2core.io.radar.infineon import write_capture
from sd2core.io.video_writing import write_video
from sd2core.mesh.sequence import MeshSequence
from sd2core.progress import Progress, silent
from sd2core.radar_config import PAPER_RADAR
from sd2core.recording.recording import SUFFIX, Recording
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase
from tools.build_sample.render import Camera, Renderer
from tools.build_sample.swipes import DURATION_S, SPANS, posed, swipes

FRAMES_PER_S = 30
DISTANCE_M = 2.2
TITLE = "Eight swipes at 2.2 m"
RECORDED: Resolution = "medium"

_ROUNDING_M, _FIT_ROUNDING_M = 2.0**-14, 2.0**-12
_PLACE_ACROSS_M = 0.05
_SENSOR = VirtualSensor()

# The room as the radar sees it: wall, skirting corner, a cabinet, a lamp.
_ROOM = (
    Reflector((0.15, 0.05, 3.5), 0.020),
    Reflector((-0.6, 1.0, 3.5), 0.008),
    Reflector((1.3, 0.3, 2.9), 0.010),
    Reflector((-1.1, -0.5, 1.6), 0.002),
)
_RECEIVERS_M = ((-0.03, 0.0, 0.0), (0.0, 0.0, 0.0), (0.03, 0.0, 0.0))
"""So far apart that the speckle of each is its own."""
_SNR_DB = 34.0
"""Against the whole body; the hand echoes some 20 dB weaker than the torso."""
_SEED = 2
_STAGES = 2
_CHUNK_FRAMES = 150


def make_sample(out: Path, progress: Progress = silent, *, duration_s: float = DURATION_S) -> Path:
    """Make the sample recording and return its folder; the same bytes, except for the video.

    ``.sd2`` is appended to a name without it; the folder appears when it is complete. ``progress``
    counts frames twice: drawn, and seen by the radar; in between the video is fitted.
    ``duration_s`` keeps the motion's beginning only; gestures that do not fit are left out. Raises
    Sd2Error when the folder exists and is not empty.
    """
    out = Path(out)
    if out.suffix != SUFFIX:
        out = out.with_name(out.name + SUFFIX)
    if out.exists() and not (out.is_dir() and not any(out.iterdir())):
        raise Sd2Error(f"{out} exists", "a new folder", "Choose another name, or delete it first")
    if not out.absolute().parent.is_dir():
        raise Sd2Error(f"The folder {out.absolute().parent} does not exist", "an existing folder")
    times_s = np.arange(max(round(duration_s * FRAMES_PER_S), 2)) / FRAMES_PER_S
    with atomic_folder(out) as folder:
        _fill(folder, times_s, progress)
        folder.chmod(0o755)
    return out


def _fill(folder: Path, times_s: NDArray[np.float64], progress: Progress) -> None:
    frames = len(times_s)

    def stage(number: int) -> Progress:
        return lambda done, _: progress(number * frames + done, _STAGES * frames)

    camera = Camera()
    fine = body_sequence("high", times_s, camera)
    pictures = Renderer(Body.load("high"), camera).frames(fine, progress=stage(0))
    write_video(folder / "video.mp4", pictures, FRAMES_PER_S, (camera.width, camera.height))
    recorded = body_sequence(RECORDED, times_s, camera)
    write_compact_mesh(_rounded(recorded, _ROUNDING_M), folder / "mesh.zarr")
    fit = _fitted(folder / "video.mp4", camera)
    write_compact_mesh(_rounded(fit, _FIT_ROUNDING_M), folder / "fit.zarr")
    capture = simulate_radar(
        fine,
        replace(PAPER_RADAR, receivers=len(_RECEIVERS_M)),
        sensor=_SENSOR,
        visibility="exact",
        wave=WaveOptions(coherent=False, receiver_offsets_m=_RECEIVERS_M),
        options=SignalOptions(snr_db=_SNR_DB, reflectors=_ROOM, seed=_SEED),
        progress=stage(1),
    )
    write_capture(
        folder / "radar",
        capture.samples[:],
        capture.config,
        capture.timebase.times_s,
        simulated=True,
        meta=capture.meta,
    )
    end_s = float(times_s[-1]) + 1.0 / FRAMES_PER_S
    Recording.create(
        folder,
        video=folder / "video.mp4",
        mesh=folder / "fit.zarr",
        radar=folder / "radar",
        sensor=_SENSOR,
        spans=tuple(span for span in SPANS if span.end_s <= end_s),
        title=TITLE,
        simulated=True,
    )


def _fitted(video: Path, camera: Camera) -> MeshSequence:
    """What `sd2 fit` makes of the video of a person whose height and camera are known."""
    stature_m = ShapeSpace().base_stature_m
    choices = FitChoices(focal_px=camera.focal_px, stature_m=stature_m, resolution=RECORDED)
    report = FitReport(lambda _: silent, lambda *_: None, lambda *_: None)
    with TemporaryDirectory() as place:
        fit_video(video, Path(place) / "fit.zarr", choices, report)
        fit = load_mesh(Path(place) / "fit.zarr")
        return replace(fit, vertices=fit.read(0, fit.frame_count))


def _rounded(mesh: MeshSequence, to_m: float) -> MeshSequence:
    rounded = np.rint(mesh.read(0, mesh.frame_count) / to_m) * to_m
    return replace(mesh, vertices=rounded.astype(np.float32), source="")


def body_sequence(
    resolution: Resolution, times_s: NDArray[np.float64], camera: Camera
) -> MeshSequence:
    """The moving body in the camera frame, (T, V, 3) float64, not rounded."""
    body = Body.load(resolution)
    motion = swipes(body.skeleton, times_s)
    place = np.array([_PLACE_ACROSS_M, camera.above_floor_m, DISTANCE_M])
    vertices = posed(body, motion.rotations, motion.translation_m + place)
    return MeshSequence(vertices, body.faces, Timebase(times_s), source="simulated body")


def write_compact_mesh(mesh: MeshSequence, path: Path) -> None:
    """Write a mesh as Zarr with time running fastest in each chunk.

    Vertices move smoothly, so their bytes repeat along time: about a third of the
    size of the ordinary layout. It is read like any other mesh.
    """
    from zarr.codecs import BloscCodec, TransposeCodec

    group = create_group(path, {"format": "sd2-mesh", "version": 1, "unit": "m"})
    stored = create_array(
        group,
        "vertices",
        shape=mesh.vertices.shape,
        chunks=(min(_CHUNK_FRAMES, mesh.frame_count), mesh.vertex_count, 3),
        dtype="<f4",
        filters=[TransposeCodec(order=(2, 1, 0))],
        compressor=BloscCodec(cname="zstd", clevel=9, shuffle="shuffle"),
    )
    for start in range(0, mesh.frame_count, _CHUNK_FRAMES):
        stop = min(start + _CHUNK_FRAMES, mesh.frame_count)
        stored[start:stop] = mesh.read(start, stop)
    write_small(mesh, group)
