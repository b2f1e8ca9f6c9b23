"""Reader of ELAN annotation files, those of this program and others."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, ParseError

from defusedxml import DefusedXmlException
from defusedxml.ElementTree import fromstring

from sd2core.errors import Sd2Error
from sd2core.files.tables import counted
from sd2core.files.texts import read_content
from sd2core.labels.formats.lanes import track_of
from sd2core.labels.formats.numbers import finite_number, whole_number
from sd2core.labels.formats.rows import LabelRows, Row, clean_name
from sd2core.labels.label_set import GESTURES, Label, LabelSet, with_own_keys

LABELS = "sd2-labels"
DETAILS = {
    "note": "sd2-note",
    "author": "sd2-author",
    "confidence": "sd2-confidence",
    "origin": "sd2-origin",
    "person": "sd2-person",
}
PROPERTY = "sd2-label-set"
VOCABULARY_LANGUAGE = "und"

# For labels of a vocabulary without colours: Okabe and Ito's, as in the default set.
_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#f0e442")

_EXPECTED = "an ELAN file (.eaf)"


def read(path: Path, *_: object) -> LabelRows:
    """Read the tiers of a document; what depends on an annotation becomes its note.

    Edges without a time are put evenly between those with one, as ELAN draws them. Raises Sd2Error
    when the file is no such document, or holds a document type: entities in one can make a small
    file huge or name other files, and ELAN writes none.
    """
    document = _document(path)
    slots = ElanTimes(document)
    shift_s = _origin_s(document)
    below = _dependents(document)
    result = LabelRows(label_set=_label_set(document))
    for tier in document.iter("TIER"):
        if tier.find("ANNOTATION/REF_ANNOTATION") is not None or (
            tier.get("LINGUISTIC_TYPE_REF") in DETAILS.values()
        ):
            continue
        name = tier.get("TIER_ID", "")
        result.tracks.append(track_of(name))
        times_ms = slots.of_tier(tier)
        for annotation in tier.iter("ALIGNABLE_ANNOTATION"):
            with result.entry(place := f"annotation {annotation.get('ANNOTATION_ID', '')}"):
                result.rows.append(_row(place, tier, annotation, times_ms, shift_s, below))
    if slots.placed:
        result.remarks.append(
            f"{counted(len(slots.placed), 'edge')} without a time put evenly between those with one"
        )
    return result


def _origin_s(document: Element) -> float:
    """Time in the linked video of ELAN's zero; of the first linked file, where none is a video."""
    linked = document.findall("HEADER/MEDIA_DESCRIPTOR")
    videos = [one for one in linked if one.get("MIME_TYPE", "").startswith("video")]
    origin = next((one.get("TIME_ORIGIN", "") for one in [*videos, *linked]), "")
    return int(origin) / 1000 if re.fullmatch(r"-?\d{1,18}", origin) else 0.0


def _document(path: Path) -> Element:
    content = read_content(path, _EXPECTED)
    try:
        document = fromstring(content, forbid_dtd=True)
    except DefusedXmlException:
        raise Sd2Error(
            f"{path} declares a document type or entities",
            f"{_EXPECTED} without them, as ELAN writes it",
            "Open it in ELAN, if you trust it, and save it again",
        ) from None
    except (ParseError, ValueError, LookupError) as error:
        raise Sd2Error(
            f"{path} is not whole XML: {error}",
            _EXPECTED,
            "Copy the file again, or save it again in ELAN",
        ) from None
    if document.tag != "ANNOTATION_DOCUMENT":
        raise Sd2Error(
            f"{path} is XML whose root is {document.tag[:100]!r}",
            f"{_EXPECTED}, with the root ANNOTATION_DOCUMENT",
            "Save it as .eaf in ELAN",
        )
    units = document.find("HEADER")
    stated = "milliseconds" if units is None else units.get("TIME_UNITS", "milliseconds")
    if stated != "milliseconds":
        raise Sd2Error(f"{path} has times in {stated}", "milliseconds", "Save it again in ELAN")
    return document


def _dependents(document: Element) -> dict[str, list[tuple[str, str, str]]]:
    """Type, tier and text of what refers to each annotation, by the annotation's id."""
    dependents: dict[str, list[tuple[str, str, str]]] = {}
    for tier in document.iter("TIER"):
        kind, name = tier.get("LINGUISTIC_TYPE_REF", ""), tier.get("TIER_ID", "")
        for annotation in tier.iter("REF_ANNOTATION"):
            text = annotation.findtext("ANNOTATION_VALUE") or ""
            if text:
                about = annotation.get("ANNOTATION_REF", "")
                dependents.setdefault(about, []).append((kind, name, text))
    return dependents


def _row(
    place: str,
    tier: Element,
    annotation: Element,
    times_ms: dict[str, float],
    shift_s: float,
    below: dict[str, list[tuple[str, str, str]]],
) -> Row:
    name = annotation.get("ANNOTATION_ID", "")
    edges = [annotation.get(f"TIME_SLOT_REF{side}", "") for side in (1, 2)]
    missing = [edge for edge in edges if edge not in times_ms]
    if missing:
        raise Sd2Error(
            f"the time slot {missing[0][:50]!r} has no time in numbers",
            "annotations with a start and an end",
            "Align it in ELAN, or delete its tier",
        )
    texts = dict.fromkeys(DETAILS, "")
    for kind, dependent, text in below.get(name, []):
        detail = next((one for one, type_name in DETAILS.items() if type_name == kind), None)
        if detail is not None:
            texts[detail] = text
        else:
            texts["note"] += f"{dependent}: {text}\n"
    ours = tier.get("LINGUISTIC_TYPE_REF") == LABELS
    return Row(
        place,
        times_ms[edges[0]] / 1000 + shift_s,
        times_ms[edges[1]] / 1000 + shift_s,
        annotation.findtext("ANNOTATION_VALUE") or "",
        track_of(tier.get("TIER_ID", ""))[0],
        texts["note"] if ours else texts["note"].rstrip("\n"),
        texts["author"] or ("" if ours else tier.get("ANNOTATOR", "")),
        _confidence(texts["confidence"]),
        texts["origin"] or "import",
        whole_number(name[1:]) if name.startswith("a") else None,
        person=texts["person"],
    )


def _confidence(text: str) -> float | None:
    try:
        return float(text) if text.strip() else None
    except ValueError:
        raise Sd2Error(f"the confidence is {text[:50]!r}", "a number from 0 to 1") from None


def _label_set(document: Element) -> LabelSet:
    """The vocabulary of the labels; the default set where there is none."""
    used = {
        kind.get("LINGUISTIC_TYPE_ID"): kind.get("CONTROLLED_VOCABULARY_REF")
        for kind in document.iter("LINGUISTIC_TYPE")
    }
    names = [used.get(tier.get("LINGUISTIC_TYPE_REF")) for tier in document.iter("TIER")]
    wanted = used.get(LABELS) or next((name for name in names if name), None)
    vocabulary = next(
        (one for one in document.iter("CONTROLLED_VOCABULARY") if one.get("CV_ID") == wanted), None
    )
    if wanted is None or vocabulary is None:
        return GESTURES
    set_name, shown = _kept_label_set(document)
    labels: dict[str, Label] = {}
    for value in _entries(vocabulary):
        name = clean_name(value.text or "")
        if name in labels:
            continue
        default = (_COLOURS[len(labels) % len(_COLOURS)], "")
        colour, key = shown.get(name, default)
        try:
            labels[name] = Label(name, colour, key, value.get("DESCRIPTION", ""))
        except Sd2Error:  # somebody edited the property
            labels[name] = Label(name, default[0], "", value.get("DESCRIPTION", ""))
    exact = set_name is not None and clean_name(set_name) == wanted
    own_keys = tuple(with_own_keys(labels.values()))
    return LabelSet(set_name if exact and set_name else wanted, own_keys)


def _entries(vocabulary: Element) -> list[Element]:
    """One value of each entry: the first language of EAF 2.8 and later, or EAF 2.7's only one."""
    values = [entry.find("CVE_VALUE") for entry in vocabulary.iter("CV_ENTRY_ML")]
    return [one for one in values if one is not None] + list(vocabulary.iter("CV_ENTRY"))


def _kept_label_set(document: Element) -> tuple[str | None, dict[str, tuple[str, str]]]:
    """Name of the set, and colour and key of each label, where this program wrote the file."""
    text = next(
        (one.text for one in document.iter("PROPERTY") if one.get("NAME") == PROPERTY), None
    )
    try:
        known: Any = json.loads(text or "{}")
        shown = {str(name): (str(colour), str(key)) for name, colour, key in known["labels"]}
        return str(known["label_set"]), shown
    except (ValueError, KeyError, TypeError, RecursionError):
        return None, {}


class ElanTimes:
    """Times of slots: those that are stated, and those between them.

    Where an annotation is divided, ELAN writes slots without a time, and draws them evenly spaced:
    along the annotations of their tier that follow each other, otherwise in the order of the
    document's slots. One whose time is no number has none.
    """

    def __init__(self, document: Element) -> None:
        self._order: list[str] = []
        self._stated_ms: dict[str, float] = {}
        self._open: set[str] = set()
        self.placed: set[str] = set()
        for slot in document.iter("TIME_SLOT"):
            name, text = slot.get("TIME_SLOT_ID", ""), slot.get("TIME_VALUE")
            self._order.append(name)
            value = finite_number(text or "")  # whole in ELAN, not so in files of others
            if value is not None and value >= 0:
                self._stated_ms[name] = value
            elif text is None:
                self._open.add(name)
        self._in_order_ms = self._between(self._order)

    def of_tier(self, tier: Element) -> dict[str, float]:
        """Times in milliseconds of the slots that a tier refers to, as far as they are known."""
        following: dict[str, str] = {}
        used: set[str] = set()
        for annotation in tier.iter("ALIGNABLE_ANNOTATION"):
            first, second = (annotation.get(f"TIME_SLOT_REF{side}", "") for side in (1, 2))
            following[first] = second
            used |= {first, second}
        along_ms: dict[str, float] = {}
        for first in following:
            chain = {first: None}  # In order; one that comes back to itself ends.
            after = following[first] if first in self._stated_ms else ""
            while after in self._open and after not in chain:
                chain[after] = None
                after = following.get(after, "")
            along_ms |= self._between([*chain, after])
        known_ms = (self._stated_ms, along_ms, self._in_order_ms)
        times_ms = {
            name: next(times[name] for times in known_ms if name in times)
            for name in used
            if any(name in times for times in known_ms)
        }
        self.placed |= self._open.intersection(times_ms)
        return times_ms

    def _between(self, names: Sequence[str]) -> dict[str, float]:
        """Times of slots without one that stand between two with one."""
        times_ms: dict[str, float] = {}
        run: list[str] = []
        before_ms: float | None = None
        for name in names:
            if name in self._open:
                run.append(name)
                continue
            after_ms = self._stated_ms.get(name)
            if before_ms is not None and after_ms is not None:
                step_ms = (after_ms - before_ms) / (len(run) + 1)
                times_ms |= {one: before_ms + step_ms * k for k, one in enumerate(run, start=1)}
            before_ms, run = after_ms, []
        return times_ms
