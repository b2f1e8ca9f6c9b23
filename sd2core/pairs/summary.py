"""Description of a store of pairs: its header and its takes; no array is read."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, get_args

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from sd2core.errors import Sd2Error
from sd2core.files.limits import open_regular
from sd2core.files.stores import read_attributes
from sd2core.files.texts import check_version, first_fault, parse_json, whole_lines
from sd2core.options.bounds import (
    BINS,
    COORDINATE_M,
    FRAME_RATE_HZ,
    NUMBER_OF_ROWS,
    PLACEMENT,
)
from sd2core.options.declared import PairProvenance, check_names, check_record
from sd2core.pairs.segments import segment_starts

PairKind = Literal["simulated", "real"]
"""Radar that the targets come from: simulated or real."""

FORMAT = "sd2-pairs"
VERSION = 1
INDEX_NAME = "takes.jsonl"
_MADE_OF_MARS = "sd2 pairs mars"
_CAMPAIGN = "sd2 simulate campaign"
REMAKE = "Make the pairs again with `sd2 simulate campaign` or `sd2 pairs`"

_Finite = Annotated[float, Field(allow_inf_nan=False)]
_Coordinate = Annotated[float, COORDINATE_M]


class TakeKey(NamedTuple):
    """Key of a take, unique in a set."""

    subject: str
    name: str
    placement: int

    @property
    def title(self) -> str:
        """Name for messages."""
        return f"{self.subject}/{self.name}" + (f"@{self.placement}" if self.placement else "")


class TakeEntry(BaseModel):
    """One take as a line of the store describes it."""

    model_config = ConfigDict(frozen=True)

    subject: str
    name: str
    placement: Annotated[int, PLACEMENT]
    start: Annotated[int, NUMBER_OF_ROWS]
    stop: Annotated[int, NUMBER_OF_ROWS]  # Its frames in all arrays, from start on.
    sensor_position_m: tuple[_Coordinate, _Coordinate, _Coordinate]

    @property
    def key(self) -> TakeKey:
        """Key of the take."""
        return TakeKey(self.subject, self.name, self.placement)

    @property
    def rows(self) -> slice:
        """Rows of its frames in all arrays."""
        return slice(self.start, self.stop)


class PairFacts(BaseModel):
    """Facts of a store of pairs, without its values."""

    model_config = ConfigDict(frozen=True)

    path: Path
    kind: PairKind
    bins: Annotated[int, BINS]
    v_max_mps: Annotated[_Finite, Field(gt=0)]
    null_bins: tuple[int, ...]
    frame_rate_hz: Annotated[float, FRAME_RATE_HZ]
    labels: Annotated[tuple[str, ...], Field(min_length=1)]
    provenance: dict[str, Any]
    parts: tuple[str, ...] = ()  # Of the body, by which the input is also split.
    joints: tuple[str, ...] = ()
    takes: tuple[TakeEntry, ...] = ()

    @property
    def of_simulated(self) -> bool:
        """True if no camera saw any of their people."""
        stores = self.provenance.get("mixed", [self.provenance])
        return all(one.get("simulated") is True for one in stores)

    @property
    def has_limbs(self) -> bool:
        """True if the input is also split by the parts of the body."""
        return bool(self.parts)

    @property
    def frames(self) -> int:
        """Number of rows of the arrays that count."""
        return max(take.stop for take in self.takes)

    @property
    def subjects(self) -> tuple[str, ...]:
        """Subjects in the order of their first takes."""
        return tuple(dict.fromkeys(take.subject for take in self.takes))

    @property
    def known_people(self) -> str:
        """Origin whose people are the same in all stores that are made of it; empty: none.

        People of recordings are called as users say; a campaign's are drawn by its seed.
        """
        made_by = self.provenance.get("made_by")
        if made_by == _CAMPAIGN:
            return f"campaign {self.provenance.get('seed')}"
        made_of = self.provenance.get("recordings", self.provenance.get("sources", []))
        if any(str(one).endswith(".sd2") for one in made_of):
            return "recordings"
        of_mars = made_by == _MADE_OF_MARS or "variant" in self.provenance
        return "MARS" if of_mars else ""

    @property
    def placements(self) -> int:
        """Number of places from which the movements are seen."""
        return len({take.placement for take in self.takes})

    @property
    def duration_s(self) -> float:
        """Duration of the movements, each counted once."""
        seen = [take for take in self.takes if take.placement == 0]
        return sum(take.stop - take.start for take in seen) / self.frame_rate_hz

    def segments(self, subject: str, length: int, overlap: int) -> int:
        """Count the windows of a person's takes: :func:`~sd2core.pairs.segments.segment_starts`.

        ``length`` is in frames, of which neighbours share ``overlap``, 0 to ``length - 1``.
        """
        own = (take for take in self.takes if take.subject == subject)
        return sum(len(segment_starts(take.stop - take.start, length, overlap)) for take in own)


def names_together(stores: Sequence[PairFacts]) -> list[dict[str, str]]:
    """Names of the people of each store among all of them, by their names in it.

    People of the same name in different stores are different ones, called ``STORE:NAME``, but for
    stores of the same recordings or movements, see :attr:`PairFacts.known_people`.
    """
    origins = [one.known_people or number for number, one in enumerate(stores)]
    people = {(at, name) for at, one in zip(origins, stores, strict=True) for name in one.subjects}
    count = Counter(name for _, name in people)
    alike = Counter(one.path.stem for one in stores)
    called = [
        one.path.stem if alike[one.path.stem] == 1 else f"{one.path.parent.name} {one.path.stem}"
        for one in stores
    ]
    return [
        {
            name: name if count[name] == 1 else f"{called[origins.index(at)]}:{name}"
            for name in one.subjects
        }
        for at, one in zip(origins, stores, strict=True)
    ]


def is_among(name: str, people: Iterable[str]) -> bool:
    """Tell if a person is among those of a training, which calls some ``STORE:NAME``."""
    return any(name in (one, one.partition(":")[2]) for one in people)


def kept_out(people: Sequence[str], test: Iterable[str], seen: Iterable[str]) -> tuple[str, ...]:
    """Return those whom a training kept for its test and has not seen, or else everybody."""
    test, seen = [*test], [*seen]
    exact = [name for name in people if name in test]
    alike = [name for name in people if is_among(name, test) and not is_among(name, seen)]
    return tuple(exact or alike or people)


def is_pair_store(path: Path) -> bool:
    """Tell if a folder looks like pairs, from one small file."""
    return bool(read_attributes(Path(path)).get("format") == FORMAT)


def pair_facts(path: Path) -> PairFacts:
    """Read the description of a store of pairs.

    Raises Sd2Error when it is none, of another version or kind, damaged or empty.
    """
    path = Path(path)
    if not is_pair_store(path):
        raise Sd2Error(
            f"{path} holds no pairs of synthetic and radar Doppler",
            "a folder made by `sd2 simulate campaign` or `sd2 pairs`",
        )
    header = read_attributes(path)
    check_version(header, path, FORMAT, VERSION, oldest=VERSION, remedy=REMAKE)
    if header.get("kind") not in get_args(PairKind):
        raise Sd2Error(
            f"{path}: its kind is {header.get('kind')!r}", f"one of {get_args(PairKind)}", REMAKE
        )
    try:
        facts = PairFacts.model_validate({**header, "path": path, "takes": ()})
        if any(not 0 <= number < facts.bins for number in facts.null_bins):
            raise ValueError(f"null_bins are {list(facts.null_bins)}")
        check_names(facts.labels, "labels", path)
        check_record(PairProvenance, facts.provenance, f"{path}: its provenance")
    except ValueError as error:
        raise Sd2Error(
            f"{path}: its header is damaged ({_reason_of(error)})", "one as it was written", REMAKE
        ) from error
    takes = read_takes(path, facts.provenance)
    if not takes:
        raise Sd2Error(
            f"{path} holds no take yet",
            "at least one",
            "Wait until the first one is made, or make the pairs again",
        )
    return facts.model_copy(update={"takes": takes})


def read_takes(path: Path, provenance: dict[str, Any]) -> tuple[TakeEntry, ...]:
    """Read the lines of takes; an incomplete last line is left out."""
    by_part = provenance.get("made_by") == _MADE_OF_MARS
    index = path / INDEX_NAME
    if not index.exists():
        return ()
    with open_regular(index) as stream:
        lines = [line.decode(errors="replace") for line in whole_lines(stream)]
    takes = []
    for number, line in enumerate(lines, start=1):
        try:
            take = _read_take(line)
        except ValueError as error:
            raise Sd2Error(
                f"{index}: line {number} cannot be read ({_reason_of(error)}): {line[:80]!r}",
                "one take, as JSON",
                "Delete the line to lose that take alone",
            ) from None
        if by_part and take.name.startswith("stretch-"):
            # Written when the parts of one person were subjects of their own: "1-test".
            subject, _, part = take.subject.rpartition("-")
            take = take.model_copy(update={"subject": subject, "name": f"{part}-{take.name}"})
        takes.append(take)
    return tuple(takes)


def _read_take(line: str) -> TakeEntry:
    """Return the take that a line describes; ValueError if it is none."""
    try:
        take = TakeEntry.model_validate(parse_json(line, "it", "one take"))
    except Sd2Error as error:
        raise ValueError(error.found) from None
    if take.stop <= take.start:
        raise ValueError(f"its frames are {take.start} to {take.stop}")
    return take


def _reason_of(error: ValueError) -> str:
    """Place and reason of what pydantic refused, or what else was said."""
    return first_fault(error) if isinstance(error, ValidationError) else str(error)
