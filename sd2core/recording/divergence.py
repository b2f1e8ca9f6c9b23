"""What somebody else saved in a recording since it was read here, and how both go together."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from sd2core.files.tables import counted
from sd2core.labels.comparison import compare
from sd2core.labels.merging import chosen, merge
from sd2core.labels.spans import Labels

WORDS = {
    "sensor": "sensor",
    "placements": "plan of placements",
    "things": "set of things",
    "bodies": "set of bodies",
    "walls": "set of walls",
    "radar_offset_s": "offset of the radar",
    "radar_receiver": "receiver of the radar",
    "radar_transmitter": "transmitter of the radar",
    "denoiser": "denoiser",
    "bundled_denoiser": "denoiser",
    "title": "title",
    "subject": "name of the person",
    "simulated": "word on what is simulated",
    "camera": "camera",
    "video": "video",
    "mesh": "mesh",
    "faces": "faces of the mesh",
    "mesh_reading": "way to read the mesh",
    "radar": "radar file",
    "imu": "file of the inertial sensor",
    "imu_offset_s": "offset of the inertial sensor",
    "imu_places": "set of inertial sensors",
}
"""Settings in ``recording.json``, and what a user calls them."""


@dataclass(frozen=True)
class State:
    """Settings and labels of a recording at one time."""

    settings: Mapping[str, Any]
    labels: Labels


@dataclass(frozen=True)
class Merge:
    """Settings and labels of both sides, and sentences on what both had changed."""

    state: State
    notes: tuple[str, ...]


@dataclass(frozen=True)
class Divergence:
    """States of a recording: as it was read, as it is here, and as it is on disk by now."""

    base: State
    mine: State
    theirs: State

    @property
    def changes(self) -> list[str]:
        """Words for what was saved elsewhere and is not the same here; empty without any."""
        settings = [f"another {words}" for words in named(self._changed())]
        if self.theirs.labels == self.mine.labels:
            return settings
        labels = str(compare(self.base.labels, self.theirs.labels))
        return [labels, *settings] if labels else settings

    def merged(self) -> Merge:
        """Settings and labels with the changes of both sides; see :func:`.merging.merge`.

        Of a setting that both changed, mine holds.
        """
        base, mine, theirs = (one.settings for one in (self.base, self.mine, self.theirs))
        settings = {name: chosen(base[name], mine[name], theirs[name]) for name in mine}
        labels = merge(self.base.labels, self.mine.labels, self.theirs.labels)
        notes = []
        if labels.both:
            both = counted(labels.both, "span")
            notes.append(f"Of {both} that both had changed, both are there.")
        if labels.aside:
            aside = counted(labels.aside, "span")
            notes.append(f"On tracks “(both)” lie {aside} that had no room.")
        if clash := named(name for name in self._changed() if mine[name] != base[name]):
            notes.append(f"Both had changed the {' and the '.join(clash)}: yours is kept.")
        return Merge(State(settings, labels.labels), tuple(notes))

    def _changed(self) -> list[str]:
        """Settings that were changed elsewhere, to something else than here."""
        base, mine, theirs = (one.settings for one in (self.base, self.mine, self.theirs))
        return [name for name in WORDS if theirs[name] not in (base[name], mine[name])]


def named(names: Iterable[str]) -> list[str]:
    """Settings in words, each once."""
    return list(dict.fromkeys(WORDS[name] for name in names))
