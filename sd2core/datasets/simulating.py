"""Simulated maps of meshes from any place, for a radar of fixed gain and noise."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from sd2core.fmcw.link import LinkBudget
from sd2core.fmcw.options import SignalOptions, WaveOptions
from sd2core.fmcw.processing import doppler_map
from sd2core.fmcw.scene import radar_times_s
from sd2core.fmcw.simulation import simulate_radar
from sd2core.maps import DopplerMap, joined
from sd2core.mesh.sequence import MeshSequence
from sd2core.mocap.recording_pairs import on_clock
from sd2core.progress import Progress, part_of, silent
from sd2core.radar_config import CLUTTER, PAPER_RADAR, RadarConfig
from sd2core.sensor import VelocityAxis, VirtualSensor
from sd2core.timebase import Timebase

_BLOCK_FRAMES = 256
_BLOCK_BYTES = 64 << 20


@dataclass(frozen=True)
class Simulation:
    """Simulation of a radar, equal for all maps, so that they differ by place and motion alone.

    A rough surface, what nothing hides, and the gain and noise of a
    :class:`~sd2core.fmcw.link.LinkBudget`: what is farther away is weaker.
    """

    radar: RadarConfig = PAPER_RADAR
    # Seed of phases and noise; each mesh and place has its own from it, see :func:`seed_of`.
    seed: int = 0

    def as_json(self) -> dict[str, Any]:
        """Return all settings that maps depend on."""
        return {
            "radar": self.radar.as_dict(),
            "seed": self.seed,
            "link": asdict(LinkBudget()),
            "clutter": CLUTTER,
        }


def seed_of(mesh: MeshSequence, sensor: VirtualSensor, simulation: Simulation) -> int:
    """Return the seed for one mesh and place, so that maps do not share their noise."""
    content = json.dumps([simulation.seed, sensor.as_dict()]).encode()
    sums = hashlib.blake2b(content, digest_size=4)
    sums.update(np.ascontiguousarray(mesh.read(0, 1), np.float32).tobytes())
    return int.from_bytes(sums.digest(), "little")


def simulated_map(
    mesh: MeshSequence,
    sensor: VirtualSensor,
    simulation: Simulation,
    axis: VelocityAxis,
    progress: Progress = silent,
) -> DopplerMap:
    """Simulate the map that a radar shows of a mesh, at the times of the mesh's frames.

    The same as the map of a recording whose radar file is the capture that
    ``sd2 simulate radar --link-budget --incoherent`` makes with this sensor and seed. The raw
    samples are of some hundred frames at a time and not kept.

    Parameters
    ----------
    mesh : MeshSequence
        With faces.
    sensor : VirtualSensor
        Place and direction of the radar.
    simulation : Simulation
        Radar, and the seed of phases and noise, see :func:`seed_of`.
    axis : VelocityAxis
        Of the map.
    progress : Progress
        May raise Cancelled.
    """
    clock = mesh.timebase
    # As a capture says it, whose clock begins with its first frame.
    times_s = radar_times_s(clock, simulation.radar)
    mesh_s = (times_s - times_s[0]) + clock.start_s
    # With a neighbour after the last, so that the nearest is among them.
    stop = min(int(np.searchsorted(mesh_s, clock.times_s[-1])) + 1, len(mesh_s))
    options = SignalOptions(seed=seed_of(mesh, sensor, simulation), link=LinkBudget())
    maps = []
    for low in range(0, stop, _BLOCK_FRAMES):
        high = min(low + _BLOCK_FRAMES, stop)
        capture = simulate_radar(
            mesh,
            simulation.radar,
            sensor=sensor,
            visibility="exact",
            frames=(low, high),
            wave=WaveOptions(coherent=False),
            options=options,
            memory_bytes=_BLOCK_BYTES,
            progress=part_of(progress, low, high, stop),
        )
        block = doppler_map(capture, axis=axis, clutter=CLUTTER)
        meta = _of_all_frames(block.meta, capture.meta["simulation"])
        maps.append(replace(block, timebase=Timebase(mesh_s[low:high]), meta=meta))
    return on_clock(joined(maps), clock)


def _of_all_frames(meta: dict[str, Any], simulation: dict[str, Any]) -> dict[str, Any]:
    """Keep the metadata of a block that holds for all frames."""
    of_block = ("beyond_share", "notes")
    of_capture = ("first_frame_s", "clipped_share", "without_person")
    kept = {name: value for name, value in meta.items() if name not in of_block}
    how = {name: value for name, value in simulation.items() if name not in of_capture}
    return kept | {"simulation": how}
