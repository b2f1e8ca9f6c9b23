"""``sd2 compare-meshes``: meshes of one video side by side."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from sd2core.cli.command_parser import command
from sd2core.cli.output import Report, counted, print_rows, progress_bar
from sd2core.errors import Sd2Error
from sd2core.options.kinds import Words
from sd2core.options.records import ARGUMENTS, OptionError
from sd2core.options.shared import Figure, Json, MeshReading, Sensor

if TYPE_CHECKING:
    from sd2core.compare.meshes import Comparison
    from sd2core.mesh.sequence import MeshSequence

_OWN_NAMES = {"mesh.zarr", "mesh.npz"}


class CompareMeshes(Sensor, MeshReading, Figure, Json):
    """Options of ``sd2 compare-meshes``.

    Parameters
    ----------
    meshes : MESH
        two meshes or more, in one frame
    names : LIST
        what to call them, separated by commas
    reference : NAME
        name of the mesh that is right (default: the first)
    sensor : X,Y,Z
        where the radar is, in metres (default: at the camera)
    align
        measure joint distances where they are (default), or from the pelvis; velocities and maps
        are never aligned
    figure : FILE
        draw maps and curves, as .png, .svg or .pdf
    """

    meshes: Annotated[tuple[Path, ...], ARGUMENTS]
    names: Words | None = None
    reference: str | None = None
    align: Literal["none", "root"] = "none"

    def __post_init__(self) -> None:
        super().__post_init__()
        labels = self.labels
        if len(labels) != len(self.meshes):
            found = f"{counted(len(labels), 'name')} for {len(self.meshes)} meshes"
            raise OptionError(found, "one for each")
        if len(set(labels)) != len(labels) or not all(labels):
            raise OptionError(
                f"The labels are {', '.join(labels)}", "different ones", "Give other --names"
            )
        if self.reference is not None and self.reference not in labels:
            raise OptionError(f"The reference is {self.reference!r}", f"one of {', '.join(labels)}")

    @property
    def labels(self) -> list[str]:
        """Names of the meshes."""
        if self.names is not None:
            return list(self.names)
        folders = [path.parent for path in self.meshes]
        labels = [
            folder.name or path.stem
            if path.name in _OWN_NAMES and folders.count(folder) == 1
            else path.stem
            for path, folder in zip(self.meshes, folders, strict=True)
        ]
        return [
            label if labels.count(label) == 1 else str(path)
            for label, path in zip(labels, self.meshes, strict=True)
        ]


@command("compare-meshes", CompareMeshes)
def _compare(options: CompareMeshes) -> Report:
    """Compare meshes of one video: joints, velocities along the line of sight, Doppler maps.

    Every mesh is measured against the first (or --reference): mean distance of the
    joints, velocity of hands, elbows and torso along the line of sight, jitter, and
    the Doppler map that each gives. Any file that `sd2 info` knows as a mesh will do;
    one of them at least has to be made by `sd2 fit`, whose joints are known. Joints
    of other surfaces follow the vertices nearest to them. Options on how to read a
    mesh hold for those that are not made by SD² Studio.

      sd2 compare-meshes fitted.zarr vibe_output.pkl --image-size 640x480
      sd2 compare-meshes ours.zarr wham.pkl --names ours,WHAM --figure both.svg
    """
    from sd2core.compare.figure import draw_comparison
    from sd2core.compare.meshes import compare_meshes
    from sd2core.files.figure_files import save_figure
    from sd2core.sensor import VirtualSensor

    labels = options.labels
    reference = 0 if options.reference is None else labels.index(options.reference)
    sensor = VirtualSensor() if options.sensor is None else VirtualSensor(options.sensor)
    meshes = [_load(path, options) for path in options.meshes]
    with progress_bar("Comparing") as progress:
        comparison = compare_meshes(
            meshes,
            labels,
            reference=reference,
            sensor=sensor,
            alignment=options.align,
            progress=progress,
        )
    if options.figure is not None:
        save_figure(draw_comparison(comparison), options.figure)
    return Report("", comparison.as_dict(), say=partial(_print, comparison))


def _print(comparison: Comparison) -> None:
    """Print a line per mesh, then the notes."""
    from sd2core.compare.joints import JOINTS

    where = "where they are" if comparison.alignment == "none" else "from the pelvis"
    place = ", ".join(f"{value:g}" for value in comparison.sensor.position_m)
    times = comparison.times_s
    head = ("", "joints", "hands", "elbows", "torso", "jitter", "Doppler")
    units = ("", "cm", "m/s (r)", "m/s (r)", "m/s (r)", "m/s³", "L1")
    rows: list[Sequence[str]] = [head, units]
    for number, one in enumerate(comparison.differences):
        is_reference = number == comparison.reference
        cells = [one.label, "reference" if is_reference else f"{100 * one.distance_m.mean():.1f}"]
        for group in ("hands", "elbows", "torso"):
            velocity, same = one.error_mps(group), comparison.group_correlation(number, group)
            cells.append("" if is_reference else f"{velocity:.3f} ({same:.2f})")
        cells.append(f"{one.jitter_mps3.mean():.0f}")
        cells.append("" if is_reference else f"{one.map_l1:.3f}")
        rows.append(cells)
    print(
        f"{len(times)} common frames, {times[0]:.2f} to {times[-1]:.2f} s; sensor at ({place}) m;"
        f" {len(JOINTS)} joints compared {where}"
    )
    print_rows(rows, right=range(1, len(head)))
    for note in comparison.notes:
        print(f"note: {note}")


def _load(path: Path, options: CompareMeshes) -> MeshSequence:
    """Read one mesh; what is said about reading holds for those that are not ours."""
    from sd2core.body.model import own_resolution
    from sd2core.cli.reading import mesh_reading
    from sd2core.io.mesh import load_mesh
    from sd2core.io.mesh_models import is_estimate
    from sd2core.recording.recording import is_recording, open_recording

    if is_recording(path):
        mesh = open_recording(path).load_mesh()
        return mesh.body(options.person) if mesh.others else mesh
    given = {"faces": options.faces, **mesh_reading(options).options()}
    told: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    if not is_estimate(path):
        with suppress(Sd2Error):  # of a size, say, that is only right as it is told
            mesh = load_mesh(path)
            if not told or own_resolution(mesh) is not None:
                return mesh
    return load_mesh(path, **told)
