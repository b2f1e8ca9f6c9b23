"""ELAN annotation files (.eaf), format 3.0.

Source: "ELAN Annotation Format 3.0 and ELAN", The Language Archive, MPI for Psycholinguistics.
Each row of spans is a tier of alignable annotations with the labels as controlled vocabulary.
All else about spans are dependent tiers (symbolic association) below it. Times are whole
milliseconds. Colours and keys, which ELAN itself keeps elsewhere, are a property of the
document that ELAN leaves alone.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import replace
from datetime import datetime
from itertools import count
from pathlib import Path
from urllib.parse import quote
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write
from sd2core.files.paths import plain_path, stored_path
from sd2core.files.tables import counted
from sd2core.labels.formats.elan_reading import DETAILS, LABELS, PROPERTY, VOCABULARY_LANGUAGE
from sd2core.labels.formats.lanes import Lane, edges_s, lanes_of
from sd2core.labels.formats.losses import ASPECTS, LabelFormat, Loss, details_of, hold_texts
from sd2core.labels.formats.rows import clean_name
from sd2core.labels.label_set import LabelSet
from sd2core.labels.spans import Labels, Span
from sd2core.timebase import Timebase

FORMAT = LabelFormat(
    name="elan",
    title="ELAN",
    suffixes=(".eaf",),
    made_for="ELAN 6 and 7, EAF 3.0",
    keeps=frozenset(ASPECTS),
    resolution_s=0.001,
    remark="Whole milliseconds from 0 on.",
)

LAST_MS = 2**32 - 1
"""The schema's times are unsigned 32-bit integers."""

# What XML 1.0 has no characters for.
_BANNED = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_SCHEMA = "http://www.mpi.nl/tools/elan/EAFv3.0.xsd"
_XSI = "http://www.w3.org/2001/XMLSchema-instance"
_CONSTRAINTS = {
    "Time_Subdivision": "Time subdivision of parent annotation's time interval, no time gaps "
    "allowed within this interval",
    "Symbolic_Subdivision": "Symbolic subdivision of a parent annotation. Annotations refering to "
    "the same parent are ordered",
    "Symbolic_Association": "1-1 association with a parent annotation",
    "Included_In": "Time alignable annotations within the parent annotation's time interval, gaps "
    "are allowed",
}
_MIME = {".mp4": "video/mp4", ".mkv": "video/x-matroska", ".mov": "video/quicktime",
         ".avi": "video/x-msvideo", ".webm": "video/webm", ".wav": "audio/x-wav"}  # fmt: skip


def write(path: Path, labels: Labels, _: Timebase, media: Path | None) -> list[Loss]:
    """Write an annotation document; what it cannot hold is returned.

    The video is linked in full and relative to the file. Raises Sd2Error when a span ends after
    2**32 - 1 ms, about 49 days.
    """
    held, replaced = hold_texts(labels, _BANNED, FORMAT.title)
    held, moved = _in_range(path, held)
    document = Element(
        "ANNOTATION_DOCUMENT",
        {
            "AUTHOR": _common(span.author for span in held.spans),
            "DATE": datetime.now().astimezone().isoformat(timespec="seconds"),
            "FORMAT": "3.0",
            "VERSION": "3.0",
            "xmlns:xsi": _XSI,
            "xsi:noNamespaceSchemaLocation": _SCHEMA,
        },
    )
    lanes = lanes_of(held, edges_ms)
    details: dict[str, dict[int, str]] = {}
    for span in held.spans:
        for kind, detail in details_of(span).items():
            details.setdefault(kind, {})[span.id] = str(detail)
    last = max((span.id for span in held.spans), default=0)
    _header(document, path, media, held.label_set, last + len(details) * len(held.spans))
    slots = _time_order(document, lanes)
    entries = {one.name: f"cve{number}" for number, one in enumerate(held.label_set.labels)}
    _tiers(document, lanes, slots, entries, details, last)
    _types(document, held.label_set)
    indent(document)
    text = tostring(document, encoding="unicode")
    # A bare carriage return would be read as a new line.
    content = '<?xml version="1.0" encoding="UTF-8"?>\n' + text.replace("\r", "&#13;") + "\n"
    with atomic_write(path) as stream:
        stream.write(content.encode("utf-8"))
    return replaced + moved


def edges_ms(span: Span) -> tuple[int, int]:
    """Start and end in whole milliseconds, at least one apart."""
    start_ms = round(span.start_s * 1000)
    return start_ms, max(round(span.end_s * 1000), start_ms + 1)


def _in_range(path: Path, labels: Labels) -> tuple[Labels, list[Loss]]:
    """Spans that ELAN has times for, and what happened to their edges."""
    late = max((span.end_s for span in labels.spans), default=0.0)
    if late * 1000 > LAST_MS - 1:
        raise Sd2Error(
            f"A span of the labels for {path} ends at {late:g} s",
            f"times up to {LAST_MS / 1000:,.0f} s, the last that ELAN has",
            "Write another format",
        )
    losses: list[Loss] = []
    kept = tuple(span for span in labels.spans if edges_ms(span)[1] > 0 and span.end_s > 0)
    gone = len(labels.spans) - len(kept)
    if gone:
        words = f"ELAN has no times before 0: {counted(gone, 'earlier span')} left out"
        losses.append(Loss("spans", gone, words))
    spans = tuple(span if span.start_s >= 0 else replace(span, start_s=0.0) for span in kept)
    cut = sum(a != b for a, b in zip(spans, kept, strict=True))
    if cut:
        words = f"ELAN has no times before 0: {counted(cut, 'span')} cut there"
        losses.append(Loss("times", cut, words))
    off_ms = [
        max(abs(ms - s * 1000) for ms, s in zip(edges_ms(span), edges_s(span), strict=True))
        for span in spans
    ]
    moved = [off for off in off_ms if off > 1e-6]
    if moved:
        words = f"ELAN counts whole milliseconds: edges of {counted(len(moved), 'span')} moved by "
        words += f"up to {max(moved):.2g} ms"
        losses.append(Loss("times", len(moved), words))
    return replace(labels, spans=spans), losses


def _header(
    document: Element, path: Path, media: Path | None, label_set: LabelSet, last_id: int
) -> None:
    header = SubElement(document, "HEADER", {"MEDIA_FILE": "", "TIME_UNITS": "milliseconds"})
    if media is not None:
        here = plain_path(path).parent
        relative = stored_path(plain_path(media), here)
        if not relative.startswith((".", "/")):
            relative = f"./{relative}"
        kind = _MIME.get(media.suffix.lower(), "unknown")
        place = {"MEDIA_URL": plain_path(media).as_uri(), "RELATIVE_MEDIA_URL": quote(relative)}
        SubElement(header, "MEDIA_DESCRIPTOR", place, MIME_TYPE=kind)
    SubElement(header, "PROPERTY", NAME="lastUsedAnnotationId").text = str(last_id)
    labels = [[one.name, one.colour, one.key] for one in label_set.labels]
    shown = json.dumps({"label_set": label_set.name, "labels": labels})
    SubElement(header, "PROPERTY", NAME=PROPERTY).text = shown


def _time_order(document: Element, lanes: list[Lane]) -> dict[int, list[str]]:
    """Two slots of its own for every span, in the order of time; their names by id."""
    order = SubElement(document, "TIME_ORDER")
    edges = sorted(
        (edge_ms, side, span.id)
        for lane in lanes
        for span in lane.spans
        for side, edge_ms in enumerate(edges_ms(span))
    )
    names: dict[int, list[str]] = {}
    for number, (edge_ms, _, span_id) in enumerate(edges, start=1):
        names.setdefault(span_id, []).append(f"ts{number}")  # of the start first
        SubElement(order, "TIME_SLOT", {"TIME_SLOT_ID": f"ts{number}", "TIME_VALUE": str(edge_ms)})
    return names


def _tiers(
    document: Element,
    lanes: list[Lane],
    slots: dict[int, list[str]],
    entries: dict[str, str],
    details: dict[str, dict[int, str]],
    last_id: int,
) -> None:
    numbers = count(last_id + 1)
    taken = {lane.name for lane in lanes}
    for lane in lanes:
        attributes = {"LINGUISTIC_TYPE_REF": LABELS, "TIER_ID": lane.name}
        author = _common(span.author for span in lane.spans)
        if author:
            attributes["ANNOTATOR"] = author
        tier = SubElement(document, "TIER", attributes)
        for span in lane.spans:
            first, second = slots[span.id]
            # The entry of the vocabulary, so that renaming it in ELAN renames the annotation.
            entry = {"CVE_REF": entries[span.label]} if span.label in entries else {}
            slot = {"TIME_SLOT_REF1": first, "TIME_SLOT_REF2": second}
            _annotation(tier, "ALIGNABLE_ANNOTATION", span.label, f"a{span.id}", **slot, **entry)
        for kind in filter(details.get, DETAILS):
            name = f"{lane.name} - {kind}"
            while name in taken:
                name += "'"
            taken.add(name)
            below = SubElement(
                document, "TIER", LINGUISTIC_TYPE_REF=DETAILS[kind], PARENT_REF=lane.name,
                TIER_ID=name,
            )  # fmt: skip
            for span in lane.spans:
                if (text := details[kind].get(span.id)) is not None:
                    about = {"ANNOTATION_REF": f"a{span.id}"}
                    _annotation(below, "REF_ANNOTATION", text, f"a{next(numbers)}", **about)


def _annotation(tier: Element, kind: str, value: str, name: str, **attributes: str) -> None:
    outer = SubElement(tier, "ANNOTATION")
    inner = SubElement(outer, kind, {"ANNOTATION_ID": name}, **attributes)
    SubElement(inner, "ANNOTATION_VALUE").text = value


def _types(document: Element, label_set: LabelSet) -> None:
    """Types of tiers, and the labels as vocabulary, in the order of the schema."""
    vocabulary_id = clean_name(label_set.name)  # one line, not empty
    kind = {"GRAPHIC_REFERENCES": "false"}
    labelled = {"CONTROLLED_VOCABULARY_REF": vocabulary_id, **kind}
    SubElement(
        document, "LINGUISTIC_TYPE", labelled, LINGUISTIC_TYPE_ID=LABELS, TIME_ALIGNABLE="true"
    )
    below = {"CONSTRAINTS": "Symbolic_Association", **kind}
    for name in DETAILS.values():
        SubElement(
            document, "LINGUISTIC_TYPE", below, LINGUISTIC_TYPE_ID=name, TIME_ALIGNABLE="false"
        )
    language = VOCABULARY_LANGUAGE
    defined = {"LANG_DEF": "http://cdb.iso.org/lg/CDB-00130975-001", "LANG_ID": language}
    SubElement(document, "LANGUAGE", defined, LANG_LABEL=f"undetermined ({language})")
    for stereotype, description in _CONSTRAINTS.items():
        SubElement(document, "CONSTRAINT", DESCRIPTION=description, STEREOTYPE=stereotype)
    vocabulary = SubElement(document, "CONTROLLED_VOCABULARY", CV_ID=vocabulary_id)
    SubElement(vocabulary, "DESCRIPTION", LANG_REF=language)
    for number, label in enumerate(label_set.labels):
        entry = SubElement(vocabulary, "CV_ENTRY_ML", CVE_ID=f"cve{number}")
        meaning = _BANNED.sub("\N{REPLACEMENT CHARACTER}", label.gesture_class)
        value = SubElement(entry, "CVE_VALUE", DESCRIPTION=meaning, LANG_REF=language)
        value.text = label.name


def _common(texts: Iterator[str]) -> str:
    """The one text that all of them are, or nothing."""
    different = set(texts)
    return different.pop() if len(different) == 1 else ""
