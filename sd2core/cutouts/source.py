"""Source of cut-outs: a recording's video, mesh and maps."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

from sd2core.errors import Sd2Error
from sd2core.labels.spans import Span
from sd2core.maps import DopplerMap, without_shares
from sd2core.mesh.sequence import MeshSequence
from sd2core.timebase import Timebase
from sd2core.version import __version__

Part = Literal["video", "mesh", "maps"]
PARTS: tuple[Part, ...] = ("video", "mesh", "maps")
FORMAT, VERSION = "sd2-cut-out", 1

_LONGEST_SLUG = 40


@dataclass(frozen=True, eq=False)
class CutSource:
    """Recording with the parts to cut out, maps by the name of their file."""

    title: str
    simulated: bool
    timebase: Timebase
    video: Path | None = None
    mesh: MeshSequence | None = None
    maps: Mapping[str, DopplerMap] = field(default_factory=dict)
    sensor_position_m: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if self.video is None and self.mesh is None and not self.maps:
            raise Sd2Error(f"{self.title} has nothing to cut out", "a video, a mesh or a map")

    def only(self, parts: Iterable[Part]) -> CutSource:
        """Return the same source with some of its parts."""
        kept = {*parts}
        return replace(
            self,
            video=self.video if "video" in kept else None,
            mesh=self.mesh if "mesh" in kept else None,
            maps=self.maps if "maps" in kept else {},
        )

    def frames_of(self, span: Span) -> tuple[int, int]:
        """Return the frames on screen during a span, half-open."""
        return self.timebase.frames_between(span.start_s, span.end_s)

    def zero_s(self, span: Span) -> float:
        """Return the time of the first frame of a span, which is 0 s in its cut-out."""
        return self.timebase.time_of(self.frames_of(span)[0])

    def mesh_of(self, span: Span) -> MeshSequence | None:
        """Return the body of whom a span names, of the first where it names none that is there."""
        if self.mesh is None or span.person not in self.mesh.persons:
            return self.mesh
        return self.mesh.bodies[self.mesh.persons.index(span.person)]

    def files(self) -> list[str]:
        """List the files of a cut-out besides ``span.json``."""
        files = ["video.mp4"] if self.video is not None else []
        files += ["mesh.zarr"] if self.mesh is not None else []
        return files + [f"{name}.npz" for name in self.maps]

    def described(self, span: Span) -> dict[str, Any]:
        """Return the content of ``span.json``; the same for the same source and span."""
        first, stop = self.frames_of(span)
        frames, video, mesh = span.frames(self.timebase), self.video, self.mesh_of(span)
        span_fields = asdict(span)
        if not span.person:  # as before there were scenes: those that are written stay the same
            del span_fields["person"]
        return {
            "format": FORMAT,
            "version": VERSION,
            "program": f"SD² Studio {__version__}",
            "span": span_fields,
            "frames": frames and asdict(frames),
            "zero_s": self.zero_s(span),
            "frame_times_s": (self.timebase.times_s[first:stop] - self.zero_s(span)).tolist(),
            "recording": self.title,
            "simulated": self.simulated,
            "sensor_position_m": list(self.sensor_position_m),
            "files": self.files(),
            "sources": {
                "video": video and {"name": video.name, "bytes": video.stat().st_size},
                "mesh": None if mesh is None else mesh.source,
                "maps": {
                    name: {
                        "kind": one.kind,
                        "unit": one.unit,
                        "provenance": without_shares(one.meta),
                    }
                    for name, one in self.maps.items()
                },
            },
        }


def folder_name(span: Span) -> str:
    """Return a name that sorts by time and is unique: ``00001.600s left-to-right 7``."""
    slug = re.sub(r"[^\w.-]+", "-", span.label)[:_LONGEST_SLUG].strip("-.") or "label"
    return f"{span.start_s:09.3f}s_{slug}_{span.id}"
