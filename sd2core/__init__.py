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
    from sd2core.denoise.files import load_model as load_model
    from sd2core.doppler import PRESETS as PRESETS
    from sd2core.doppler import SynthesisOptions as SynthesisOptions
    from sd2core.doppler import Synthesizer as Synthesizer
    from sd2core.errors import Sd2Error as Sd2Error
    from sd2core.fmcw import doppler_map as doppler_map
    from sd2core.imu.virtual import virtual_imu as virtual_imu
    from sd2core.io.bodies import with_bodies as with_bodies
    from sd2core.io.mesh import load_mesh as load_mesh
    from sd2core.io.mesh import save_mesh as save_mesh
    from sd2core.io.radar import load_capture as load_capture
    from sd2core.io.radar.capture import RadarCapture as RadarCapture
    from sd2core.io.things import with_things as with_things
    from sd2core.io.things import with_walls as with_walls
    from sd2core.io.video import VideoReader as VideoReader
    from sd2core.io.video import open_video as open_video
    from sd2core.maps import DopplerMap as DopplerMap
    from sd2core.mesh.bodies import Body as Body
    from sd2core.mesh.sequence import MeshSequence as MeshSequence
    from sd2core.mesh.things import Thing as Thing
    from sd2core.mesh.walls import Wall as Wall
    from sd2core.radar_config import PAPER_RADAR as PAPER_RADAR
    from sd2core.radar_config import RadarConfig as RadarConfig
    from sd2core.recording.recording import Recording as Recording
    from sd2core.recording.recording import Span as Span
    from sd2core.recording.recording import open_recording as open_recording
    from sd2core.recording.recording import open_sample as open_sample
    from sd2core.sensor import Beam as Beam
    from sd2core.sensor import VelocityAxis as VelocityAxis
    from sd2core.sensor import VirtualSensor as VirtualSensor
    from sd2core.timebase import Timebase as Timebase

_MODULES = {
    "denoise.files": "load_model",
    "doppler": "PRESETS SynthesisOptions Synthesizer",
    "errors": "Sd2Error",
    "fmcw": "doppler_map",
    "imu.virtual": "virtual_imu",
    "io.bodies": "with_bodies",
    "io.mesh": "load_mesh save_mesh",
    "io.radar": "load_capture",
    "io.radar.capture": "RadarCapture",
    "io.things": "with_things with_walls",
    "io.video": "VideoReader open_video",
    "maps": "DopplerMap",
    "mesh.bodies": "Body",
    "mesh.sequence": "MeshSequence",
    "mesh.things": "Thing",
    "mesh.walls": "Wall",
    "radar_config": "PAPER_RADAR RadarConfig",
    "recording.recording": "Recording Span open_recording open_sample",
    "sensor": "Beam VelocityAxis VirtualSensor",
    "timebase": "Timebase",
}
_HOME = {name: module for module, names in _MODULES.items() for name in names.split()}

__all__ = ["__version__", *_HOME]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
