"""``sd2 info`` of a data set."""

from __future__ import annotations

from pathlib import Path

from sd2core.cli.info.description import Description, bins_in_words
from sd2core.cli.output import counted
from sd2core.datasets.card import describe_dataset, duration_text, limits
from sd2core.datasets.reading import open_dataset


def describe_dataset_at(path: Path) -> Description:
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
        "kinds": _listed(card["segments_of_kind"]),
        "labels": _listed(card["segments_of_label"]),
        "classes": _listed(card["segments_of_class"]),
        "splits": _listed(card["segments_of_split"]),
        "from": f"{counted(card['recordings'], 'recording')} of"
        f" {counted(len(card['subjects']), 'subject')}, {duration_text(card)}, up to"
        f" {counted(card['placements'], 'placement')} each",
        "range": "" if ranges_m is None else f"{ranges_m[0]:g} to {ranges_m[1]:g} m",
        "velocity": f"{axis.bins} bins of {axis.bin_width_mps:g} m/s over ±{axis.v_max_mps:g} m/s,"
        " approaching is positive",
        "nulled bins": bins_in_words(axis, null_bins),
    }
    data = {"kind": "dataset", "path": str(path)} | card
    return Description(f"Data set {path}", data, facts, tuple(limits(card)))


def _listed(counts: dict[str, int]) -> str:
    return ", ".join(f"{name} {count:,}" for name, count in counts.items())
