"""Pictures to a video file, meshes to a compact one."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.io.mesh_arrays import write_small
from sd2core.mesh import MeshSequence

_CHUNK_FRAMES = 150


def write_video(
    path: Path,
    frames: Iterable[NDArray[np.uint8]],
    frames_per_s: int,
    size: tuple[int, int],
) -> None:
    """Encode sRGB pictures as H.264 in MP4, frame k at ``k / frames_per_s``.

    Parameters
    ----------
    path : Path
    frames : iterable of uint8 arrays, shape (height, width, 3)
    frames_per_s : int
    size : (int, int)
        Width and height, both even.

    Raises
    ------
    Sd2Error
        When this build of PyAV has no H.264 encoder.
    """
    import av

    try:
        av.Codec("libx264", "w")
    except ValueError as error:
        raise Sd2Error(
            "This build of PyAV cannot encode H.264 (libx264)",
            "the wheels of PyAV from the package index",
            "Install it again with: pip install --force-reinstall av",
        ) from error
    with av.open(str(path), "w", options={"movflags": "+faststart"}) as container:
        stream = container.add_stream("libx264", rate=frames_per_s)
        stream.width, stream.height = size
        stream.pix_fmt = "yuv420p"
        # A key frame every half second: scrubbing decodes few frames.
        stream.options = {
            "preset": "slow",
            "crf": "21",
            "g": str(max(frames_per_s // 2, 1)),
            "threads": "1",
        }
        stream.codec_context.time_base = Fraction(1, frames_per_s)
        for number, picture in enumerate(frames):
            frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
            # Without this, players guess the matrix from the picture's size.
            frame = frame.reformat(format="yuv420p", dst_colorspace="ITU601")
            frame.pts = number
            frame.time_base = Fraction(1, frames_per_s)
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))


def write_compact_mesh(mesh: MeshSequence, path: Path) -> None:
    """Write a mesh as Zarr with time running fastest in each chunk.

    Vertices move smoothly, so their bytes repeat along time: about a third of the
    size of the ordinary layout. It is read like any other mesh.
    """
    import zarr
    from zarr.codecs import BloscCodec, TransposeCodec

    group = zarr.open_group(str(path), mode="w-")
    group.attrs.update({"format": "sd2-mesh", "version": 1, "unit": "m"})
    stored = group.create_array(
        "vertices",
        shape=mesh.vertices.shape,
        chunks=(min(_CHUNK_FRAMES, mesh.frame_count), mesh.vertex_count, 3),
        dtype="<f4",
        filters=[TransposeCodec(order=(2, 1, 0))],
        compressors=BloscCodec(cname="zstd", clevel=9, shuffle="shuffle"),
    )
    for start in range(0, mesh.frame_count, _CHUNK_FRAMES):
        stop = min(start + _CHUNK_FRAMES, mesh.frame_count)
        stored[start:stop] = mesh.read(start, stop)
    write_small(mesh, group)
