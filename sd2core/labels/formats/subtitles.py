"""Subtitles: cues of WebVTT (.vtt) and SubRip (.srt), read only.

Source: W3C, "WebVTT: The Web Video Text Tracks Format". A cue is a span and its text the label; its
voice, ``<v NAME>``, is the track.
"""

from __future__ import annotations

import html
import re
from pathlib import Path

from sd2core.errors import Sd2Error
from sd2core.files.texts import read_text
from sd2core.labels.formats.losses import DEFAULT_TRACK, LabelFormat
from sd2core.labels.formats.rows import UNNAMED, LabelRows, Row
from sd2core.labels.typed_times import seconds_of

FORMAT = LabelFormat(
    name="subtitles",
    title="Subtitles",
    suffixes=(".vtt", ".srt"),
    made_for="WebVTT and SubRip",
    keeps=frozenset({"tracks"}),
    resolution_s=0.001,
)

_EXPECTED = "cues of WebVTT or SubRip: lines with --> between two times, texts below"
_VOICE = re.compile(r"<v(?:\.[^\s>]*)?\s+([^>]+)>")
_TAG = re.compile(r"<[^>]*>")


def read(path: Path, *_: object) -> LabelRows:
    """Read all cues; one without a text is unnamed.

    Raises Sd2Error when the file has no cues.
    """
    result = LabelRows()
    blocks = re.split(r"\n[ \t]*\n", "\n".join(read_text(path, _EXPECTED).splitlines()))
    cues = 0
    for block in blocks:
        lines = block.strip("\n").split("\n")
        at = next((k for k, line in enumerate(lines) if "-->" in line), None)
        if at is None or lines[0].startswith("NOTE"):
            continue
        cues += 1
        with result.entry(f"cue {cues}"):
            start_s, end_s = _times(lines[at])
            text = "\n".join(lines[at + 1 :])
            voice = _VOICE.search(text)
            label = " ".join(html.unescape(_TAG.sub("", text)).split())
            track = html.unescape(voice[1]) if voice else DEFAULT_TRACK
            result.rows.append(Row(f"cue {cues}", start_s, end_s, label or UNNAMED, track))
    if not cues and not blocks[0].startswith("WEBVTT"):
        raise Sd2Error(f"{path} has no cues", _EXPECTED, "Check the file, or name its format")
    return result


def _times(line: str) -> tuple[float, float]:
    first, _, rest = line.partition("-->")
    texts = first, (rest.split() or [""])[0]  # Settings of the cue stand behind.
    start_s, end_s = (seconds_of(text) if ":" in text else None for text in texts)
    if start_s is None or end_s is None:
        raise Sd2Error(f"its times are {line[:100]!r}", "00:01.500 --> 00:02.500")
    return start_s, end_s
