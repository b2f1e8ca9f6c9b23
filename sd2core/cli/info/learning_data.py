"""``sd2 info`` of data to learn from: data sets and pairs."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np

from sd2core.cli.info.description import axis_in_words, bins_in_words
from sd2core.cli.output import Report, counted, listed
from sd2core.datasets.card import describe_dataset, duration_text, limits
from sd2core.datasets.reading import open_dataset
from sd2core.files.stores import lost_in_words
from sd2core.pairs.store import PairSet
from sd2core.plausibility.radar import judge_map


def describe_dataset_at(path: Path) -> Report:
    """Describe a data set: how much, who, what is labelled, from where, and its limits."""
    with open_dataset(path) as dataset:
        card = describe_dataset(dataset)
        axis = dataset.header.axis
        null_bins = dataset.header.null_bins
    ranges_m = card["range_m"]
    facts = {
        "title": card["title"],
        "segments": f"{card['segments']:,} of {card['length']} frames"
        f" ({card['segment_s']:.2f} s at {card['frame_rate_hz']:g} frames/s)",
        "kinds": listed(card["segments_of_kind"]),
        "limb maps": ", ".join(card["parts"]),
        "labels": listed(card["segments_of_label"]),
        "classes": listed(card["segments_of_class"]),
        "splits": listed(card["segments_of_split"]),
        "from": f"{counted(card['recordings'], 'recording')} of"
        f" {counted(len(card['subjects']), 'subject')}, {duration_text(card)}"
        + (f", up to {card['placements']} placements each" if card["placements"] > 1 else ""),
        "range": " to ".join(dict.fromkeys(f"{one:.2f} m" for one in ranges_m or ())),
        "velocity": axis_in_words(axis),
        "nulled bins": bins_in_words(axis, null_bins),
    }
    data = {"kind": "dataset", "path": str(path)} | card
    return Report(f"Data set {path}", data, facts, tuple(limits(card)))


def describe_pairs(path: Path, pairs: PairSet) -> Report:
    """Describe pairs: who, how much, what is labelled, from where it was seen."""
    minutes = {
        subject: sum(len(take.times_s) for take in pairs.takes if take.subject == subject)
        / pairs.frame_rate_hz
        / 60
        for subject in pairs.subjects
    }
    labelled: Counter[str] = Counter()
    for take in pairs.takes:
        counts = np.bincount(take.label[take.label >= 0], minlength=len(pairs.labels))
        labelled.update(dict(zip(pairs.labels, counts.tolist(), strict=True)))
    ranges_m = [float(np.linalg.norm(take.sensor_position_m)) for take in pairs.takes]
    placements = len({take.placement for take in pairs.takes})
    data = {
        "kind": "pairs",
        "path": str(path),
        "pair_kind": pairs.kind,
        "takes": len(pairs.takes),
        "frames": pairs.frames,
        "frames_per_s": pairs.frame_rate_hz,
        "minutes_of_subject": minutes,
        "frames_of_label": dict(labelled),
        "placements": placements,
        "bins": pairs.axis.bins,
        "v_max_mps": pairs.axis.v_max_mps,
        "null_bins": list(pairs.null_bins),
        "protocol": _protocol_in_words(pairs),
        "provenance": pairs.provenance,
    }
    facts = {
        "targets": "a simulated radar" if pairs.kind == "simulated" else "a real radar",
        "protocol": _protocol_in_words(pairs),
        "takes": f"{len(pairs.takes)} of {pairs.frames} frames, {pairs.frame_rate_hz:g} frames/s",
        "subjects": ", ".join(f"{name} {value:.1f} min" for name, value in minutes.items()),
        "labels": ", ".join(
            f"{name} {count / pairs.frames:.0%}" for name, count in labelled.items()
        ),
        "sensors": f"{placements} for each take, up to {max(ranges_m):.2f} m from the camera",
        "velocity": axis_in_words(pairs.axis),
        "nulled bins": bins_in_words(pairs.axis, pairs.null_bins),
    }
    # Where MARS' radar detected nothing there is nothing.
    noisy = pairs.kind == "real" and pairs.provenance.get("made_by") != "sd2 pairs mars"
    notes = tuple(
        f"Take {take.title}: {finding}"
        for take in pairs.takes
        for values, measured in ((take.synthetic, False), (take.radar, noisy))
        for finding in judge_map(values.T, take.times_s, measured=measured)
    )
    if pairs.lost_frames:
        notes = (lost_in_words(pairs.lost_frames), *notes)
    data["notes"] = list(notes)
    return Report(f"Pairs {path}", data, facts, notes)


def _protocol_in_words(pairs: PairSet) -> str:
    if pairs.provenance.get("made_by") != "sd2 simulate campaign":
        return ""
    protocol = {"name": "varied", "order": "random"} | (pairs.provenance.get("protocol") or {})
    return f"{protocol['name']}, swipes {protocol['order'].replace('random', 'in random order')}"
