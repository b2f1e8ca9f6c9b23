"""A data-set card in words: Markdown from what :mod:`sd2core.datasets.card` counted."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from sd2core.datasets.splitting import RULE, borrowed, split_people

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
    """The card as Markdown."""
    title = card["title"] or card["dataset"]
    parts = [
        f"# {title}",
        _summary(card),
        "## What is simulated, what is measured\n\n" + _simulated(card),
        "## Kinds of maps\n\n" + _table(("kind", "segments", "what 1 means", "what it is"), (
            (kind, f"{count:,}", "; ".join(card["units"].get(kind, [])) or "not stated",
             _WHAT[kind])
            for kind, count in card["segments_of_kind"].items()
        )),
        "## Labels\n\n" + _labels(card),
        "## Splits\n\n" + _splits(card),
        "## Axes and sensors\n\n" + _axes(card),
        "## How it was made\n\n" + _made(card),
        "## Limits\n\n" + "\n".join(f"- {one}" for one in limits(card)),
    ]  # fmt: skip
    return "\n\n".join(parts) + "\n"


def limits(card: dict[str, Any]) -> list[str]:
    """What a user of the data set should know, as sentences."""
    found = []
    if len(card["segments_of_kind"]) and "real" not in card["segments_of_kind"]:
        found.append("No real radar is in it. How a model does on one must be tested on others.")
    if not card["splits"].get("test"):
        found.append(
            "There are too few subjects to keep one for a test: nothing measured on it says how a"
            " model does on other people."
        )
    missing = [kind for kind, count in card["segments_of_kind"].items() if count < card["segments"]]
    if missing:
        found.append(
            f"Not every segment has {' and '.join(missing)}: see the array `available`; values of"
            " what is not available are zero."
        )
    several = [kind for kind, units in card["units"].items() if len(units) > 1]
    if several:
        found.append(f"Values of {' and '.join(several)} come in several units: scale each source.")
    if card["resampled_segments"]:
        found.append(
            f"{card['resampled_segments']:,} segments had uneven frames or another frame rate and"
            f" were brought to {card['frame_rate_hz']:g} frames/s by linear interpolation."
        )
    if card["frames_without_person"]:
        found.append(
            f"{card['frames_without_person']:,} frames without a person are in no segment."
        )
    if card["sources_without_segments"]:
        found.append(
            f"{card['sources_without_segments']} sources are shorter than a segment and give none."
        )
    if len([count for count in card["segments_of_label"].values() if count]) < 2:
        found.append("All segments have the same label.")
    never = [name for name, count in card["segments_of_label"].items() if not count]
    if never:
        found.append(f"No segment is labelled {', '.join(never)}; single frames may be.")
    found.append(
        f"Neighbouring segments share {card['overlap']} frames or more: they are not independent."
    )
    if card["placements"] > 1:
        found.append(
            "Placements show the same movements from elsewhere: they add views, not movements."
        )
    return found


def duration_words(card: dict[str, Any]) -> str:
    """How long its recordings are, each counted once: ``15 s``, or ``12.5 minutes``."""
    minutes = card["minutes"]
    return f"{60 * minutes:.0f} s" if minutes < 2 else f"{minutes:,.1f} minutes"


def _summary(card: dict[str, Any]) -> str:
    return (
        f"{card['segments']:,} segments of {card['length']} frames ({card['segment_s']:.2f} s at"
        f" {card['frame_rate_hz']:g} frames/s) × {card['bins']} velocity bins, from"
        f" {_counted(card['recordings'], 'recording')} of"
        f" {_counted(len(card['subjects']), 'subject')}, {duration_words(card)}"
        + (f", each seen from up to {card['placements']} places" if card["placements"] > 1 else "")
        + f". Written by {card['made_by']}; format {card['dataset'].rsplit('.', 1)[-1]},"
        " described in docs/formats.md of SD² Studio."
    )


def _simulated(card: dict[str, Any]) -> str:
    said = []
    for kind in card["segments_of_kind"]:
        if kind == "simulated":
            said.append("Maps called *simulated* come from a radar that was computed.")
        if kind == "denoised":
            said.append("Maps called *denoised* are a model's estimate, not a measurement.")
        if kind == "synthetic":
            said.append("Maps called *synthetic* are counted from a mesh, not measured.")
        if kind == "real":
            said.append("Maps called *real* were measured by a radar.")
    if card["simulated_recordings"]:
        count, of = card["simulated_recordings"], card["recordings"]
        who = f"{count:,} of {of:,} recordings {'is' if count == 1 else 'are'}"
        said.append(
            f"{'Every recording is' if count == of else who} simulated as a whole: no camera was"
            " there either."
        )
    return " ".join(said)


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
        (split, f"{count:,}", ", ".join(card["splits"].get(split, [])) or "nobody")
        for split, count in card["segments_of_split"].items()
    ]
    people = ", ".join(f"{name} {count:,}" for name, count in card["segments_of_subject"].items())
    return (
        _table(("split", "segments", "subjects"), rows)
        + f"\n\nNo subject is in two splits. Segments of each: {people}."
        + f"\n\n{_rule(card)}"
    )


def _rule(card: dict[str, Any]) -> str:
    """How the splits came about."""
    splits = {name: tuple(people) for name, people in card["splits"].items()}
    by_name = split_people(card["subjects"])
    if splits != {
        "train": by_name.training,
        "validation": by_name.validation,
        "test": by_name.test,
    }:
        return "Whoever validates or tests was named when the data set was written."
    moved = borrowed(splits)
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
        f"bins that are zero on purpose, in all kinds: {nulled}",
        f"segments share {card['overlap']} frames with the next one",
    ]
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
        (kind, way, f"{count:,}") for kind, ways in card["how"].items()
        for way, count in ways.items()
    ]  # fmt: skip
    told = card["provenance"].get("command")
    command = f"\n\n```\n{told}\n```" if told else ""
    return _table(("kind", "made", "sources"), rows) + command


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(
        "| " + " | ".join(str(cell).replace("|", "\\|") for cell in line) + " |" for line in lines
    )


def _counted(number: int, what: str) -> str:
    return f"{number:,} {what}" + ("" if number == 1 else "s")
