"""Card of a data set: figures counted from its arrays, as JSON and in Markdown."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from sd2core.datasets.layout import SPLITS, Header
from sd2core.datasets.reading import Dataset, open_dataset
from sd2core.datasets.source import KINDS
from sd2core.datasets.splitting import RULE, named_splits, reassigned, split_people
from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write_json, atomic_write_text
from sd2core.files.stores import lost_in_words
from sd2core.files.tables import counted
from sd2core.files.texts import read_json
from sd2core.mesh.vertex_parts import QUANTITIES
from sd2core.numerics.map_accuracy import MapAccuracy

CARD_FORMAT = "sd2-dataset-card"
_ROWS = 8192
_MANY = 12
"""Most descriptions of how maps were made that are listed; more are counted."""


def card_paths(path: Path) -> tuple[Path, Path, Path]:
    """Paths of the Markdown card, the JSON card and the preview sheet beside a data set.

    They have its name without the ending: ``walk.card.md`` of ``walk.h5``; or with it, where those
    are of another data set, or there is such a picture that is no sheet.
    """
    ends = ("card.md", "card.json", "png")
    markdown, as_json, sheet = (path.with_name(f"{path.stem}.{end}") for end in ends)
    of = "" if sheet.exists() else path.name
    with suppress(OSError, Sd2Error, LookupError, TypeError):
        of = str(read_json(as_json)["dataset"])
    if of != path.name:
        markdown, as_json, sheet = (path.with_name(f"{path.name}.{end}") for end in ends)
    return markdown, as_json, sheet


def write_card(path: Path) -> dict[str, Any]:
    """Count a data set, write its card as JSON and Markdown, and return it."""
    with open_dataset(path) as dataset:
        card = describe_dataset(dataset)
    markdown, as_json, _ = card_paths(path)
    atomic_write_json(as_json, card)
    atomic_write_text(markdown, card_text(card))
    return card


def describe_dataset(dataset: Dataset) -> dict[str, Any]:
    """Return the card as JSON can hold it; labels of frames are read in parts."""
    header, labels = dataset.header, len(dataset.header.labels)
    column = {name: np.asarray(dataset[name][:]) for name in _COLUMNS}
    segments = np.zeros((labels, len(SPLITS)), np.int64)  # of each label in each split
    np.add.at(segments, (column["segment_label"], column["split"]), 1)
    frames = np.zeros(labels, np.int64)
    for start in range(0, len(dataset), _ROWS):
        part = np.asarray(dataset["label"][start : start + _ROWS])
        if header.spans is not None:
            part = part[np.asarray(dataset["mask"][start : start + _ROWS])]
        frames += np.bincount(part.ravel(), minlength=labels)
    of_subject = np.bincount(column["subject"], minlength=len(header.subjects))
    available = column["available"].sum(axis=0)
    by_label = _named(header.labels, segments.sum(axis=1))
    by_class: Counter[str] = Counter()
    for label, count in by_label.items():
        if name := header.classes.get(label):
            by_class[name] += count
    return {
        "format": CARD_FORMAT,
        "version": 1,
        "dataset": dataset.path.name,
        **{name: value for name, value in header.as_dict().items() if name not in _NOT_ON_CARD},
        "segments": len(dataset),
        "segment_s": header.length / header.frame_rate_hz,
        "segments_of_split": _named(SPLITS, segments.sum(axis=0)),
        "segments_of_label": by_label,
        "frames_of_label": _named(header.labels, frames),
        "segments_of_class": dict(by_class),
        "segments_of_label_and_split": {
            label: _named(SPLITS, segments[number])
            for number, label in enumerate(header.labels)
        },
        "segments_of_subject": _named(header.subjects, of_subject),
        "segments_of_kind": {
            kind: int(available[KINDS.index(kind)]) for kind in header.kinds
        },
        "purity_mean": float(column["purity"].sum(dtype=np.float64)) / max(len(dataset), 1),
        **{name: _extent(column[name]) for name in _EXTENTS},
        "resampled_segments": int(column["resampled"].sum()),
        **_count_sources(dataset.sources(), header),
    }  # fmt: skip


_NOT_ON_CARD = {"format", "version", "all_kinds"}
_EXTENTS = ("range_m", "azimuth_deg", "elevation_deg")
_COLUMNS = ("segment_label", "purity", "subject", "split", "available", "resampled", *_EXTENTS)


def _extent(values: np.ndarray) -> list[float] | None:
    """Smallest and largest value, or None where none is known."""
    known = values[np.isfinite(values)]
    return [round(float(one), 4) for one in (known.min(), known.max())] if len(known) else None


def _count_sources(sources: Iterable[dict[str, Any]], header: Header) -> dict[str, Any]:
    """Return what a card says of sources, by its names there."""
    totals: Counter[str] = Counter()
    views: dict[tuple[tuple[str, ...], str], set[int]] = {}
    how: dict[str, Counter[str]] = {kind: Counter() for kind in KINDS}
    spans: Counter[str] = Counter()
    everybody: dict[str, None] = {}  # Kinds in which more people are seen than the subject.
    minutes = 0.0
    cutoffs_hz: list[float] = []
    accuracies: list[MapAccuracy] = []
    for entry in sources:
        provenance = entry["provenance"]
        # A scene is one recording, however many of its persons are sources.
        people = tuple(map(str, provenance.get("scene", [entry["subject"]])))
        seen_from = views.setdefault((people, entry["recording"]), set())
        totals["sources"] += 1
        everybody |= dict.fromkeys(provenance.get("everybody", ()))
        totals["empty"] += entry["start"] == entry["stop"]
        # Others show the same movement; its own sensor need not be among them.
        if not seen_from:
            minutes += entry["frames"] / entry["frame_rate_hz"] / 60
            totals["without person"] += entry["frames"] - entry["frames_with_person"]
            totals["damaged"] += provenance.get("damaged_frames", 0)
            totals["simulated"] += bool(provenance.get("simulated"))
            spans.update(entry.get("spans", {}))
        seen_from.add(entry["placement"])
        cutoffs_hz += [made["cutoff_hz"] for made in provenance.get("imu", {}).values()]
        for kind, made in provenance["maps"].items():
            how[kind][made_text(kind, made, provenance)] += 1
            if kind == "synthetic" and "body_error_l1" in made:
                accuracies.append(MapAccuracy.of(provenance | made))
    accuracies.sort(key=lambda one: one.total or 0.0)
    facts = {
        "sources": totals["sources"],
        "recordings": len(views),
        "minutes": minutes,
        # From which a recording is seen, at most.
        "placements": max(map(len, views.values()), default=0),
        "frames_without_person": totals["without person"],
        "frames_damaged": totals["damaged"],
        "sources_without_segments": totals["empty"],
        "simulated_recordings": totals["simulated"],
        # Of the median source with fitted bodies.
        "accuracy": str(accuracies[len(accuracies) // 2]) if accuracies else "",
        "how": {kind: _most_common(ways) for kind, ways in how.items() if ways},
        **({"everybody": list(everybody)} if everybody else {}),
    }
    if header.imu:
        facts["imu_cutoff_hz"] = [min(cutoffs_hz), max(cutoffs_hz)]
    if header.spans is not None:
        facts["spans_counted"] = dict(spans)
    return facts


def _most_common(ways: Counter[str]) -> dict[str, int]:
    """Count the sources of each way in which their maps were made."""
    counts = dict(ways.most_common(_MANY))
    if len(ways) > _MANY:
        counts[f"{len(ways) - _MANY} other descriptions"] = ways.total() - sum(counts.values())
    return counts


def made_text(kind: str, made: dict[str, Any], provenance: dict[str, Any]) -> str:
    """Describe how a map was made, from its metadata."""
    if kind == "synthetic":
        options = made.get("options", {})
        if "pairs" in provenance:
            return f"from the pairs {provenance['pairs']}"
        plan = provenance.get("plan") or made.get("plan")
        count = f"{made.get('count', 'plain')}, " if "body_error_l1" in made else ""
        if plan is not None:
            return f"counted from a mesh: {count}by the plan {plan['text']}"
        return (
            f"counted from a mesh: {count}visibility {options.get('visibility', 'not stated')},"
            f" weight {options.get('weight', 'not stated')}"
        )
    if kind == "denoised":
        denoiser = made.get("denoiser", {})
        name = denoiser.get("title") or denoiser.get("name") or "a denoiser"
        return (
            f"the synthetic map through {name} ({denoiser.get('model', 'model not stated')}),"
            f" trained on {denoiser.get('trained_on', 'unknown')} radar data: "
            f"{denoiser.get('data') or 'not stated which'}"
        )
    if "pairs" in provenance:
        return f"from the pairs {provenance['pairs']}"
    radar = made.get("radar")
    name = radar.get("name", "") if isinstance(radar, dict) else str(radar or "")
    return ("a computed radar signal" if kind == "simulated" else "a radar capture") + (
        f": {name}" if name else ""
    )


def _named(names: tuple[str, ...], counts: np.ndarray) -> dict[str, int]:
    return dict(zip(names, counts.tolist(), strict=True))


# -- In words ------------------------------------------------------------------------------------

_WHAT = {
    "synthetic": "counted from the vertices of a mesh, by their velocity towards the sensor",
    "denoised": "what a trained model makes of the synthetic map: an estimate of a radar's",
    "simulated": "of a radar whose signal was computed; no radar was there",
    "real": "of a radar's capture",
}
_RULES = {
    "foreground": "the label other than background that most frames have, where they are at least"
    " {share:.0%} of the segment; otherwise background",
    "majority": "the label that most frames have, background included",
}


def card_text(card: dict[str, Any]) -> str:
    """Return the card as Markdown."""
    title = card["title"] or card["dataset"]
    parts = [
        f"# {title}",
        _summary(card),
        "## What is simulated, what is measured\n\n" + _simulated(card),
        "## Kinds of maps\n\n" + _table(("kind", "segments", "unit", "origin"), (
            (kind, f"{count:,}", "; ".join(card["units"].get(kind, [])) or "not stated",
             _WHAT[kind])
            for kind, count in card["segments_of_kind"].items()
        )) + _limbs(card) + _imu(card),
        "## Labels\n\n" + _labels(card),
        "## Splits\n\n" + _splits(card),
        "## Axes and sensors\n\n" + _axes(card),
        "## How it was made\n\n" + _made(card),
        "## Limits\n\n" + "\n".join(f"- {one}" for one in limits(card)),
    ]  # fmt: skip
    return "\n\n".join(parts) + "\n"


def limits(card: dict[str, Any]) -> list[str]:
    """Return the limits of the data set, as sentences."""
    notes = []
    if len(card["segments_of_kind"]) and "real" not in card["segments_of_kind"]:
        notes.append(
            "It has no maps of a real radar: how a model does on one must be tested on other data."
        )
    if not card["splits"].get("test"):
        notes.append(
            "There are too few subjects to keep one for a test: nothing measured on it says how a"
            " model does on other people."
        )
    if card["accuracy"]:
        notes.append(
            "Bodies were fitted to videos: in the median source the synthetic map is off the truth"
            f" by {card['accuracy']} (relative L1)."
        )
    if kinds := card.get("everybody"):
        notes.append(
            f"The {' and '.join(kinds)} maps of scenes show everybody, not the subject alone; where"
            " somebody else is labelled otherwise they are not available. Who is in one scene is"
            " in these maps together: keep them in one split to test on them."
        )
    missing = [kind for kind, count in card["segments_of_kind"].items() if count < card["segments"]]
    if missing:
        notes.append(
            f"Not every segment has {' and '.join(missing)}: see the array `available`; values of"
            " what is not available are zero."
        )
    several = [kind for kind, units in card["units"].items() if len(units) > 1]
    if several:
        notes.append(f"Values of {' and '.join(several)} come in several units: scale each source.")
    spans = card.get("spans")
    left_out = card["spans_counted"].items() if spans else ()
    notes += [
        f"{count:,} labelled spans are {why}: they give no segment."
        for why, count in left_out
        if why != "segments"
    ]
    if spans and spans["length"] == "resampled":
        notes.append(
            "Spans were stretched to one length: velocities are as they were, durations are"
            " `end_s` - `start_s`."
        )
    elif card["resampled_segments"]:
        notes.append(
            f"{card['resampled_segments']:,} segments had uneven frames or another frame rate and"
            f" were brought to {card['frame_rate_hz']:g} frames/s by linear interpolation."
        )
    if damaged := card["frames_damaged"]:
        notes.append(lost_in_words(damaged))
    if card["frames_without_person"] > damaged:
        notes.append(
            f"{card['frames_without_person'] - damaged:,} frames without a person are in no"
            " segment."
        )
    if card["sources_without_segments"]:
        notes.append(
            f"{card['sources_without_segments']} sources give no segment:"
            f" {'nothing is labelled there' if spans else 'they are too short, or not pure'}."
        )
    if len([count for count in card["segments_of_label"].values() if count]) < 2:
        notes.append("All segments have the same label.")
    never = [name for name, count in card["segments_of_label"].items() if not count]
    if never:
        notes.append(f"No segment is labelled {', '.join(never)}; single frames may be.")
    if not spans:
        notes.append(
            f"Neighbouring segments share {card['overlap']} frames or more: they are not"
            " independent."
        )
    if card["placements"] > 1:
        notes.append(
            "Placements show the same movements from other places: they add views, not movements."
        )
    return notes


def duration_text(card: dict[str, Any]) -> str:
    """Total length of its recordings: ``15 s``, or ``12.5 minutes``."""
    minutes = card["minutes"]
    return f"{60 * minutes:.0f} s" if minutes < 2 else f"{minutes:,.1f} minutes"


def _summary(card: dict[str, Any]) -> str:
    one_each = ", one of each labelled span," if card.get("spans") else ""
    return (
        f"{card['segments']:,} segments{one_each} of {card['length']} frames"
        f" ({card['segment_s']:.2f} s at {card['frame_rate_hz']:g} frames/s)"
        f" × {card['bins']} velocity bins, from {counted(card['recordings'], 'recording')} of"
        f" {counted(len(card['subjects']), 'subject')}, {duration_text(card)}"
        + (f", each seen from up to {card['placements']} places" if card["placements"] > 1 else "")
        + f". Written by {card['made_by']}; format {card['dataset'].rsplit('.', 1)[-1]},"
        " described in docs/formats.md of SD² Studio."
    )


_KINDS = {
    "simulated": "Maps called *simulated* come from a radar that was computed.",
    "denoised": "Maps called *denoised* are a model's estimate, not a measurement.",
    "synthetic": "Maps called *synthetic* are counted from a mesh, not measured.",
    "real": "Maps called *real* were measured by a radar.",
}


def _simulated(card: dict[str, Any]) -> str:
    sentences = [_KINDS[kind] for kind in card["segments_of_kind"] if kind in _KINDS]
    if card["simulated_recordings"]:
        count, of = card["simulated_recordings"], card["recordings"]
        who = f"{count:,} of {of:,} recordings {'is' if count == 1 else 'are'}"
        sentences.append(
            f"{'Every recording is' if count == of else who} simulated as a whole: no camera was"
            " there either."
        )
    return " ".join(sentences)


def _limbs(card: dict[str, Any]) -> str:
    if not card["parts"]:
        return ""
    parts, joints = ", ".join(card["parts"]), ", ".join(card["joints"])
    return (
        f"\n\nThe array `limbs` holds the synthetic map split by the parts of the body: {parts}."
        f" The array `kinematics` holds of {joints}: {', '.join(QUANTITIES)}."
    )


def _imu(card: dict[str, Any]) -> str:
    if not card.get("imu"):
        return ""
    lowest, highest = (f"{value:.3g}" for value in card["imu_cutoff_hz"])
    return (
        f"\n\nThe array `imu` holds inertial sensors at {', '.join(card['imu'])}, *simulated* on"
        f" the mesh: at every frame ({card['frame_rate_hz']:g} Hz), acceleration with gravity in"
        " m/s² and turn rate in rad/s along x, y, z of the sensor, low-passed at"
        f" {lowest if lowest == highest else f'{lowest} to {highest}'} Hz."
    )


def _labels(card: dict[str, Any]) -> str:
    splits = list(card["segments_of_split"])
    rows = [
        (
            label,
            card["classes"].get(label, "none"),
            f"{count:,}",
            *(f"{card['segments_of_label_and_split'][label][split]:,}" for split in splits),
            f"{card['frames_of_label'][label]:,}",
        )
        for label, count in card["segments_of_label"].items()
    ]
    rule = _RULES[card["label_rule"]].format(share=card["min_share"])
    if card.get("min_purity"):
        rule += f"; segments less than {card['min_purity']:.0%} of which have it are left out"
    spans = card.get("spans")
    if spans:
        rule = f"that of its span; {spans['margin_s']:g} s before and after it are kept"
        if spans["length"] == "padded":
            rule += ", and empty frames fill it (`mask` is false there)"
    classes = ", ".join(
        f"{name} {count:,}" for name, count in card["segments_of_class"].items()
    )  # fmt: skip
    return (
        _table(("label", "class", "segments", *splits, "frames in segments"), rows)
        + f"\n\nBy class: {classes or 'no label has one'}.\n\n"
        f"Every frame has a label (array `label`). That of a segment (`segment_label`) is {rule};"
        f" on average {card['purity_mean']:.0%} of a segment's frames have it (`purity`)."
    )


def _splits(card: dict[str, Any]) -> str:
    rows = [
        (split, f"{count:,}", ", ".join(card["splits"].get(split, [])) or "none")
        for split, count in card["segments_of_split"].items()
    ]
    people = ", ".join(f"{name} {count:,}" for name, count in card["segments_of_subject"].items())
    return (
        _table(("split", "segments", "subjects"), rows)
        + f"\n\nNo subject is in two splits. Segments of each: {people}."
        + f"\n\n{_rule(card)}"
    )


def _rule(card: dict[str, Any]) -> str:
    """Explain how the splits were chosen."""
    splits = {name: tuple(people) for name, people in card["splits"].items()}
    if splits != named_splits(split_people(card["subjects"])):
        return "The people who validate and test were named when the data set was written."
    moved = reassigned(splits)
    if not moved:
        return RULE
    goes = "goes" if len(moved) == 1 else "go"
    return (
        f"{RULE} Here {' and '.join(moved)} {goes} for that reason, and may be elsewhere when there"
        " are more people: name who validates and tests where results are to be compared."
    )


def _axes(card: dict[str, Any]) -> str:
    width = 2 * card["v_max_mps"] / card["bins"]
    nulled = ", ".join(map(str, card["null_bins"])) or "none"
    lines = [
        f"velocity: {card['bins']} bins of {width:g} m/s over ±{card['v_max_mps']:g} m/s,"
        " approaching is positive",
        f"bins set to zero in all kinds: {nulled}",
    ]
    if not card.get("spans"):
        lines.append(f"segments share {card['overlap']} frames with the next one")
    for name, words, unit in (
        ("range_m", "range of the sensor from the body", " m"),
        ("azimuth_deg", "azimuth, as seen from the body", "°"),
        ("elevation_deg", "elevation, as seen from the body", "°"),
    ):
        if card[name] is not None:
            low, high = (f"{value + 0.0:.4g}" for value in card[name])
            lines.append(f"{words}: {low} to {high}{unit}" if low != high else
                         f"{words}: {low}{unit}")  # fmt: skip
        else:
            lines.append(f"{words}: not known")
    return "\n".join(f"- {line}" for line in lines)


def _made(card: dict[str, Any]) -> str:
    rows = [
        (kind, way, f"{count:,}") for kind, counts in card["how"].items()
        for way, count in counts.items()
    ]  # fmt: skip
    typed = card["provenance"].get("command")
    command = f"\n\n```\n{typed}\n```" if typed else ""
    return _table(("kind", "made", "sources"), rows) + command


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(
        "| " + " | ".join(str(cell).replace("|", "\\|") for cell in line) + " |" for line in lines
    )
