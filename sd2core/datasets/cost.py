"""How long simulating radars for an export would take here."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

from sd2core.datasets.recording_sources import Making, places_of
from sd2core.datasets.simulating import simulated_map
from sd2core.errors import Sd2Error
from sd2core.mesh.sequence import MeshSequence
from sd2core.recording.recording import open_recording
from sd2core.sensor import VirtualSensor

_TIMED_FRAMES = 60
_WARMING_FRAMES = 4


def simulation_s(recordings: Sequence[Path], making: Making) -> float:
    """Seconds that the simulated maps of all recordings and places would take.

    Timed on some frames of the first recording that can be simulated; the others are taken
    to cost as much per frame.

    Parameters
    ----------
    recordings : sequence of Path
        Those that cannot be read count for nothing.
    making : Making
    """
    if making.simulation is None or "simulated" not in making.kinds:
        return 0.0
    frames, each_s = 0, 0.0
    for path in recordings:
        try:
            recording = open_recording(path)
            mesh = recording.load_mesh() if recording.mesh is not None else None
        except Sd2Error:
            continue  # the counting says it
        if mesh is None or mesh.faces is None:
            continue
        if not frames:
            each_s = _timed_s(mesh, recording.sensor, making)
        frames += mesh.frame_count * (1 + len(places_of(recording, making)))
    return frames * each_s


def _timed_s(mesh: MeshSequence, sensor: VirtualSensor, making: Making) -> float:
    """Of a frame, in the middle of the clip."""
    assert making.simulation is not None
    middle = mesh.frame_count // 2
    begun_s = 0.0
    for count in (_WARMING_FRAMES, _TIMED_FRAMES):
        start = max(middle - count // 2, 0)
        stop = min(start + count, mesh.frame_count)
        begun_s = time.perf_counter()
        simulated_map(mesh, sensor, making.simulation, making.synthesis.axis, (start, stop))
    return (time.perf_counter() - begun_s) / (stop - start)
