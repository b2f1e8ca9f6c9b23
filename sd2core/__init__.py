"""SD² Studio's library: from a moving mesh to radar Doppler, without any window.

The names below are loaded when they are first used, so that importing the
library costs nothing::

    import sd2core as sd2

    mesh = sd2.load_mesh("walk.npz")
    maps = sd2.Synthesizer(mesh, preset="paper")
    synthetic = maps.map(sd2.VirtualSensor(position_m=(0, 0, 0)), visibility="exact")
    real = sd2.doppler_map(sd2.load_capture("recording/"), v_max_mps=2.0, bins=32)
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from sd2core.version import __version__

if TYPE_CHECKING:
    from sd2core.denoise.files import load_model
    from sd2core.doppler import PRESETS, SynthesisOptions, Synthesizer
    from sd2core.errors import Sd2Error
    from sd2core.fmcw import doppler_map
    from sd2core.imu.virtual import virtual_imu
    from sd2core.io.bodies import with_bodies
    from sd2core.io.mesh import load_mesh, save_mesh
    from sd2core.io.radar import load_capture
    from sd2core.io.radar.capture import RadarCapture
    from sd2core.io.things import with_things, with_walls
    from sd2core.io.video import VideoReader, open_video
    from sd2core.maps import DopplerMap
    from sd2core.mesh.bodies import Body
    from sd2core.mesh.sequence import MeshSequence
    from sd2core.mesh.things import Thing
    from sd2core.mesh.walls import Wall
    from sd2core.radar_config import PAPER_RADAR, RadarConfig
    from sd2core.recording.recording import Recording, Span, open_recording, open_sample
    from sd2core.sensor import Beam, VelocityAxis, VirtualSensor
    from sd2core.timebase import Timebase

__all__ = [
    "PAPER_RADAR",
    "PRESETS",
    "Beam",
    "Body",
    "DopplerMap",
    "MeshSequence",
    "RadarCapture",
    "RadarConfig",
    "Recording",
    "Sd2Error",
    "Span",
    "SynthesisOptions",
    "Synthesizer",
    "Thing",
    "Timebase",
    "VelocityAxis",
    "VideoReader",
    "VirtualSensor",
    "Wall",
    "__version__",
    "doppler_map",
    "load_capture",
    "load_mesh",
    "load_model",
    "open_recording",
    "open_sample",
    "open_video",
    "save_mesh",
    "virtual_imu",
    "with_bodies",
    "with_things",
    "with_walls",
]

_HOME = {
    "Body": "mesh.bodies",
    "PAPER_RADAR": "radar_config",
    "PRESETS": "doppler",
    "Beam": "sensor",
    "DopplerMap": "maps",
    "MeshSequence": "mesh.sequence",
    "RadarCapture": "io.radar.capture",
    "RadarConfig": "radar_config",
    "Recording": "recording.recording",
    "Sd2Error": "errors",
    "Span": "recording.recording",
    "SynthesisOptions": "doppler",
    "Synthesizer": "doppler",
    "Thing": "mesh.things",
    "Timebase": "timebase",
    "VelocityAxis": "sensor",
    "VideoReader": "io.video",
    "VirtualSensor": "sensor",
    "Wall": "mesh.walls",
    "doppler_map": "fmcw",
    "load_capture": "io.radar",
    "load_mesh": "io.mesh",
    "load_model": "denoise.files",
    "open_recording": "recording.recording",
    "open_sample": "recording.recording",
    "open_video": "io.video",
    "save_mesh": "io.mesh",
    "virtual_imu": "imu.virtual",
    "with_bodies": "io.bodies",
    "with_things": "io.things",
    "with_walls": "io.things",
}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
