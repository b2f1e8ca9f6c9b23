"""Summary of a store of pairs from its description; no array is read."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from sd2core.files.texts import damage_in
from sd2core.pairs.segments import segment_starts
from sd2core.pairs.store import PairKind, read_description


@dataclass(frozen=True)
class TakeFacts:
    """Subject, placement and length of one take."""

    subject: str
    placement: int
    frames: int


@dataclass(frozen=True)
class PairFacts:
    """Facts of a store of pairs, without its values."""

    path: Path
    kind: PairKind
    bins: int
    v_max_mps: float
    frame_rate_hz: float
    takes: tuple[TakeFacts, ...]
    has_limbs: bool = False  # The input is also split by the parts of the body.

    @property
    def subjects(self) -> tuple[str, ...]:
        """Subjects in the order of their first takes."""
        return tuple(dict.fromkeys(take.subject for take in self.takes))

    @property
    def placements(self) -> int:
        """Number of places from which the movements are seen."""
        return len({take.placement for take in self.takes})

    @property
    def duration_s(self) -> float:
        """Duration of the movements, each counted once."""
        return sum(take.frames for take in self.takes if take.placement == 0) / self.frame_rate_hz

    def segments(
        self, subjects: Iterable[str], length: int, overlap: int, *, first_only: bool = False
    ) -> int:
        """Count the windows of the takes of these subjects."""
        wanted = set(subjects)
        return sum(
            len(segment_starts(take.frames, length, overlap))
            for take in self.takes
            if take.subject in wanted and not (first_only and take.placement)
        )


def pair_facts(path: Path) -> PairFacts:
    """Read the description of a store of pairs."""
    path = Path(path)
    header, index = read_description(path)
    takes = tuple(
        TakeFacts(entry["subject"], int(entry["placement"]), entry["stop"] - entry["start"])
        for entry in index
    )
    with damage_in(path):
        return PairFacts(
            path=path,
            kind=header["kind"],
            bins=int(header["bins"]),
            v_max_mps=float(header["v_max_mps"]),
            frame_rate_hz=float(header["frame_rate_hz"]),
            takes=takes,
            has_limbs=bool(header.get("parts")),
        )
