"""``sd2 info``: what is in a recording, video, mesh, capture, map, pairs, data set or model."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from sd2core.cli.command_parser import command
from sd2core.cli.info.description import (
    Description,
    describe_imu,
    describe_map,
    describe_mesh,
    describe_parts,
    describe_radar,
    describe_recording,
    describe_video,
    show,
)
from sd2core.options.records import ARGUMENT
from sd2core.options.shared import Json, MeshReading


class Info(MeshReading, Json):
    """Options of ``sd2 info``.

    Parameters
    ----------
    path : PATH
        what to describe
    verify
        read every chunk and compare it with its checksum; what is damaged is named
    """

    path: Annotated[Path, ARGUMENT]
    verify: bool = False


@command("info", Info)
def _info(options: Info) -> None:
    """What is in a recording, video, mesh, radar or IMU file, map, pairs, data set or model.

    sd2 info walk.sd2
    sd2 info walk.npz --json
    sd2 info walk.zarr --verify
    """
    if not options.verify:
        show(describe(options.path, options), as_json=options.json)
        return
    from sd2core.cli.info.verifying import in_words, verify
    from sd2core.io.kinds import kind_of

    verified = verify(options.path, kind_of(options.path))
    description = describe(options.path, options)
    description.data["verified"] = verified
    description.facts["verified"] = in_words(verified)
    show(description, as_json=options.json)


def describe(path: Path, options: MeshReading) -> Description:
    """Open whatever ``path`` is and describe it."""
    from sd2core.cli.reading import (
        load_mesh_from_options,
        open_recording_from_options,
        refuse_unused_mesh_options,
    )
    from sd2core.io.kinds import kind_of

    kind = kind_of(path)
    if kind == "recording":
        recording = open_recording_from_options(path, options)
        return describe_recording(recording, describe_parts(recording))
    if kind == "mesh":
        return describe_mesh(path, load_mesh_from_options(path, options))
    refuse_unused_mesh_options(options, path, None)
    if kind == "video":
        from sd2core.io.video import open_video

        with open_video(path) as video:
            return describe_video(path, video)
    if kind == "radar":
        return describe_radar(path)
    if kind == "imu":
        return describe_imu(path)
    if kind == "pairs":
        from sd2core.cli.info.learning_data import describe_pairs
        from sd2core.pairs.store import read_pairs

        return describe_pairs(path, read_pairs(path))
    if kind == "model":
        from sd2core.cli.info.model import describe_model_file

        return describe_model_file(path)
    if kind == "dataset":
        from sd2core.cli.info.learning_data import describe_dataset_at

        return describe_dataset_at(path)
    from sd2core.maps import DopplerMap

    return describe_map(path, DopplerMap.load(path))
