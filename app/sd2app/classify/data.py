"""Labelled data chosen for a classifier: content and division of people."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from sd2app.widgets.text import duration_text
from sd2core.datasets.labelled import (
    LabelledFacts,
    LabelledSource,
    labelled_facts,
    people_of,
    unfolded,
)
from sd2core.errors import Sd2Error
from sd2core.train.data import Split, split_subjects


@dataclass(frozen=True)
class DataSource:
    """A labelled recording, radar file, data set or folder that was chosen."""

    path: Path
    person: str = ""  # empty where the user has named no one
    facts: tuple[LabelledFacts, ...] = ()  # of all that a folder holds; empty until read
    problem: str = ""  # why it cannot be used

    @property
    def nameable(self) -> bool:
        """True if the user can name its person: pairs and data sets name theirs."""
        return any(one.kind in ("recording", "radar file") for one in self.facts)

    @property
    def people(self) -> tuple[str, ...]:
        """People in it."""
        return people_of(self.facts)

    @property
    def text(self) -> str:
        """Content in words; an ellipsis while that is not known."""
        if not self.facts:
            return "…"
        parts = [_what(self.facts)]
        people = len(self.people)
        if not self.nameable or people > 1:
            parts.append(f"{people} {'person' if people == 1 else 'people'}")
        spans = sum(one.spans for one in self.facts)
        if spans:
            parts.append(f"{spans:,} label{'s' * (spans != 1)}")
        known_s = [one.duration_s for one in self.facts if one.duration_s is not None]
        if len(known_s) == len(self.facts):
            parts.append(duration_text(sum(known_s)))
        placements = max(one.placements for one in self.facts)
        if placements > 1:
            parts.append(f"{placements} placements")
        maps = [name for name in ("synthetic", "denoised", "radar") if self.has(name)]
        if len(maps) < 3:
            parts.append(f"{' and '.join(maps) or 'no'} maps")
        return " · ".join(parts)

    def has(self, name: str) -> bool:
        """True if all of it has maps of a kind, or they can be computed."""
        return all(name in one.maps for one in self.facts)


def looked_into(path: Path, person: str) -> DataSource:
    """Read the content of a source of data; may wait for the disk."""
    try:
        sources = unfolded([LabelledSource(path, person)])
        facts = tuple(labelled_facts(one) for one in sources)
        of_itself = [one.path for one in facts if one.kind in ("pairs", "data set")]
        # A name that was given before is no reason to refuse them.
        return DataSource(path, "" if len(of_itself) == len(facts) else person, facts)
    except (Sd2Error, OSError) as error:
        return DataSource(path, person, problem=str(error))


def division_of(data: Sequence[DataSource]) -> Split | None:
    """Division of people into training, validation and test; None where there are no people.

    Like ``sd2 classify train``: where there is nothing but data sets, they state it themselves.
    Raises Sd2Error if data sets contradict each other.
    """
    facts = [one for source in data for one in source.facts]
    people = people_of(facts)
    if not people:
        return None
    validation: list[str] = []
    test: list[str] = []
    if all(one.kind == "data set" for one in facts):
        for one in facts:
            validation += one.splits.get("validation", ())
            test += one.splits.get("test", ())
    return split_subjects(people, validation or None, test or None)


def why_not_together(data: Sequence[DataSource], maps: Sequence[str] = ()) -> str:
    """Reason why these sources cannot be mixed with these maps; empty when they can."""
    for source in data:
        for name in maps:
            if not source.has(name):
                return f"{source.path.name} has no {name} maps: choose others, or leave it out."
    grids = {one.grid for source in data for one in source.facts if one.grid is not None}
    if len(grids) > 1:
        return (
            "These differ in their velocity axis or frame rate: "
            + "; ".join(
                f"{grid.bins} bins up to ±{grid.v_max_mps:g} m/s at {grid.frame_rate_hz:.4g}"
                " frames/s"
                for grid in sorted(grids)
            )
            + ". Choose data of one kind."
        )
    try:
        division_of(data)
    except Sd2Error as error:
        return str(error)
    return ""


def _what(facts: Sequence[LabelledFacts]) -> str:
    """Short text such as ``simulated pairs`` or ``3 recordings``."""
    kinds = {one.kind for one in facts}
    if len(facts) > 1:
        words = {"recording": "recordings", "radar file": "radar files", "data set": "data sets"}
        kind = next(iter(kinds)) if len(kinds) == 1 else ""
        what = f"{len(facts)} {words.get(kind, 'recordings and radar files')}"
    else:
        what = facts[0].kind
    return f"{what} (simulated)" if any(one.simulated for one in facts) else what
