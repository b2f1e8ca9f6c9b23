"""Two or more meshes of one video side by side, one of them the reference."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from sd2core.body.model import own_resolution
from sd2core.compare.joints import GROUPS, JOINTS, JointPatches, carry_patches, own_patches, rows_of
from sd2core.compare.measures import (
    common_times,
    correlation,
    jitter,
    line_of_sight_velocity,
    map_l1,
    rms,
    synthesize_alike,
)
from sd2core.errors import Sd2Error
from sd2core.files.tables import counted
from sd2core.maps import DopplerMap
from sd2core.mesh.presence import Presence
from sd2core.mesh.sequence import MeshSequence
from sd2core.plausibility.clock import gaps_between
from sd2core.progress import Progress, silent
from sd2core.scattering.resampling import resample_mesh
from sd2core.sensor import VirtualSensor

Floats = NDArray[np.float64]
Alignment = Literal["none", "root"]


@dataclass(frozen=True, eq=False)
class Difference:
    """Differences of one mesh from the reference, per joint (J,)."""

    label: str
    distance_m: Floats  # mean distance of each joint over time, after the alignment
    velocity_rms_mps: Floats  # RMS of the difference of the velocities along the line of sight
    correlation: Floats  # of those velocities; NaN where one does not change
    jitter_mps3: Floats
    """Of this mesh by itself: RMS third difference, see :func:`sd2core.compare.measures.jitter`."""
    map_l1: float  # relative difference of the smoothed Doppler maps

    def error_mps(self, group: str) -> float:
        """RMS difference of the velocities over a group of :data:`GROUPS`."""
        return rms(self.velocity_rms_mps[rows_of(GROUPS[group])])


@dataclass(frozen=True, eq=False)
class Comparison:
    """Result of :func:`compare_meshes`."""

    labels: tuple[str, ...]
    reference: int  # number of the mesh that the others are measured against
    times_s: Floats  # (T,), common to all
    sensor: VirtualSensor
    alignment: Alignment
    """Joint distances are those of the places (``none``), or of the places from the pelvis
    (``root``). Velocities and maps are never aligned."""
    joints_m: tuple[Floats, ...]  # of every mesh, (T, J, 3), not aligned
    velocity_mps: tuple[Floats, ...]
    """Along the line of sight, positive when approaching; (T, J) of every mesh."""
    measured: NDArray[np.bool_]
    """Frames that count, shape (T,): those in which every mesh has a person."""
    maps: tuple[DopplerMap, ...]
    differences: tuple[Difference, ...]  # of every mesh, the reference included
    notes: tuple[str, ...]  # the meshes' own; interpolated, carried over or omitted parts

    def group_correlation(self, number: int, group: str) -> float:
        """Correlation of a mesh's velocities with the reference's, over all joints of a group.

        A joint that rests counts little beside one that moves.
        """
        rows = rows_of(GROUPS[group])
        one, reference = (
            self.velocity_mps[each][self.measured][:, rows] for each in (number, self.reference)
        )
        return correlation(one, reference)

    def as_dict(self) -> dict[str, Any]:
        """Everything but the curves and maps, for JSON."""
        return {
            "reference": self.labels[self.reference],
            "alignment": self.alignment,
            "sensor_m": list(self.sensor.position_m),
            "frames": len(self.times_s),
            "start_s": float(self.times_s[0]),
            "end_s": float(self.times_s[-1]),
            "joints": list(JOINTS),
            "meshes": [
                {
                    "label": one.label,
                    "joint_distance_m": one.distance_m.tolist(),
                    "velocity_rms_mps": one.velocity_rms_mps.tolist(),
                    "velocity_correlation": one.correlation.tolist(),
                    "jitter_mps3": one.jitter_mps3.tolist(),
                    "map_l1": one.map_l1,
                }
                for one in self.differences
            ],
            "notes": list(self.notes),
        }


def compare_meshes(
    meshes: Sequence[MeshSequence],
    labels: Sequence[str],
    *,
    reference: int = 0,
    sensor: VirtualSensor | None = None,
    alignment: Alignment = "none",
    progress: Progress = silent,
) -> Comparison:
    """Compare meshes of one person in one video.

    Parameters
    ----------
    meshes : sequence of MeshSequence
        In one camera frame. Of one or more topologies; at least one of them ours,
        or all of one topology that is not: then there are no joints to compare and
        an error says so.
    labels : sequence of str
        One per mesh.
    reference : int
        Which of them the others are measured against.
    sensor : VirtualSensor, optional
        By default at the camera.
    alignment : {"none", "root"}
        Of joint distances; see :class:`Comparison`.
    progress : Progress
        Counts frames of the Doppler maps.

    Raises
    ------
    Sd2Error
        When they have no time in common, none of them is a surface of ours, or two
        are too far apart to be of the same person.
    """
    if len(meshes) < 2 or len(labels) != len(meshes):
        raise Sd2Error(
            f"{counted(len(meshes), 'mesh', 'meshes')} and {counted(len(labels), 'label')}",
            "two meshes at least",
        )
    if not 0 <= reference < len(meshes):
        raise Sd2Error(f"reference is {reference}", f"0 to {len(meshes) - 1}")
    sensor = sensor or VirtualSensor()
    times_s = common_times(meshes, reference)
    pairs = list(zip(meshes, labels, strict=True))
    notes = [f"{label}: {note}" for mesh, label in pairs for note in mesh.notes]
    placed = []
    for mesh, label in pairs:
        moved, interpolated = resample_mesh(mesh, times_s)
        if interpolated:
            notes.append(f"{label}: interpolated to the frame times of {labels[reference]}.")
        elif len(times_s) < mesh.frame_count:
            notes.append(f"{label}: {len(times_s)} of {mesh.frame_count} frames are compared.")
        placed.append(replace(moved, surroundings=None).between(0, moved.frame_count))
    if any(mesh.surroundings is not None for mesh in meshes):
        notes.append("The maps are of the bodies alone, without walls and things around them.")
    patches = _patches(placed, labels, notes)
    joints = tuple(
        one.positions(np.asarray(mesh.vertices)) for one, mesh in zip(patches, placed, strict=True)
    )
    presence = Presence.of(
        np.logical_and.reduce([mesh.presence.present for mesh in placed]),
        len(times_s),
        gaps_between(times_s),
    )
    measured = presence.measured
    if not measured.all():
        placed = [replace(mesh, present=presence.present) for mesh in placed]
        notes.append(
            f"{int((~measured).sum())} of {len(times_s)} frames are left out: not every mesh has a"
            " person there."
        )
    if measured.sum() < 2:
        raise Sd2Error(
            "The meshes have no two neighbouring frames in common with a person in all of them",
            "meshes of the same person",
        )
    velocity = tuple(
        line_of_sight_velocity(one, times_s, sensor.position_m, presence) for one in joints
    )
    if len({mesh.vertex_count for mesh in placed}) > 1:
        notes.append(
            "The surfaces have different vertices: part of the difference of the maps is where a "
            "surface is denser, not how it moves."
        )
    if any(mesh.faces is None for mesh in placed):
        notes.append("A mesh has no faces: all vertices count in the maps, hidden ones too.")
    maps = synthesize_alike(placed, sensor, progress)
    differences = tuple(
        Difference(
            label,
            _distances(joints[number][measured], joints[reference][measured], alignment),
            np.sqrt(((velocity[number] - velocity[reference])[measured] ** 2).mean(axis=0)),
            np.array(
                [
                    correlation(
                        velocity[number][measured, joint], velocity[reference][measured, joint]
                    )
                    for joint in range(len(JOINTS))
                ]
            ),
            jitter(joints[number], times_s, presence),
            map_l1(maps[number], maps[reference]),
        )
        for number, label in enumerate(labels)
    )
    return Comparison(
        tuple(labels),
        reference,
        times_s,
        sensor,
        alignment,
        joints,
        velocity,
        measured,
        maps,
        differences,
        tuple(notes),
    )


def _patches(
    meshes: Sequence[MeshSequence], labels: Sequence[str], notes: list[str]
) -> list[JointPatches]:
    """Patches of every mesh: our own, or carried over from the first that is ours."""
    resolutions = [own_resolution(mesh) for mesh in meshes]
    ours = next((number for number, one in enumerate(resolutions) if one is not None), None)
    if ours is None:
        raise Sd2Error(
            "None of the meshes is a surface of SD² Studio, so their joints are not known",
            "one of them at least made by `sd2 fit` from the same video",
            "Fit the video too, and compare the others with that mesh",
        )
    own = resolutions[ours]
    assert own is not None
    patches = []
    for mesh, label, resolution in zip(meshes, labels, resolutions, strict=True):
        if resolution is not None:
            patches.append(own_patches(resolution))
            continue
        carried = carry_patches(
            own_patches(own), np.asarray(meshes[ours].vertices), np.asarray(mesh.vertices)
        )
        notes.append(
            f"{label}: its {mesh.vertex_count} vertices are not those of a surface of ours; each"
            f" joint follows the vertices nearest to its patch on {labels[ours]} in frame"
            f" {carried.frame}, {carried.distance_m * 100:.1f} cm away on average."
        )
        patches.append(carried.patches)
    return patches


def _distances(joints_m: Floats, reference_m: Floats, alignment: Alignment) -> Floats:
    apart = joints_m - reference_m
    if alignment == "root":
        (root,) = rows_of(("pelvis",))
        apart = apart - apart[:, root : root + 1]
    return np.asarray(np.linalg.norm(apart, axis=-1).mean(axis=0))
