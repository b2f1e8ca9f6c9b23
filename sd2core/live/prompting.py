"""Prompts of a guided session as labels of its recordings."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from sd2core.errors import Sd2Error
from sd2core.fmcw.processing import doppler_map
from sd2core.labels.spans import Labels, LabelTrack, Span
from sd2core.labels.suggest import suggest_spans
from sd2core.live.clocks import Clocks
from sd2core.live.protocol import Protocol, Take
from sd2core.maps import DopplerMap
from sd2core.options.suggesting import SuggestOptions
from sd2core.radar_config import CLUTTER
from sd2core.recording.recording import open_recording
from sd2core.sensor import VelocityAxis

TRACK = "Gestures"
NO_MOTION = "no motion was found"
"""In the note of a span whose edges are those of the prompt."""


def prompted_span(
    doppler: DopplerMap, label: str, prompt_s: float, end_s: float, reaction_s: float
) -> Span:
    """Find when what was asked for was done.

    Parameters
    ----------
    doppler : DopplerMap
        What the radar saw.
    label : str
    prompt_s, end_s : float
        When the person was told to begin, and when the prompt went, on the clock of the map.
    reaction_s : float
        Motion counts that takes as long as a suggestion must (``SuggestOptions``) from so long
        after the prompt on: not what ends then.

    Returns
    -------
    Span
        From the beginning of the first motion to the end of the last. An edge that lies
        outside of the prompt is that of the prompt, ``reaction_s`` later at its beginning; so
        are both where there is no motion.
    """
    begin_s = min(prompt_s + reaction_s, end_s)
    options = SuggestOptions()
    motions = [
        one
        for one in suggest_spans(doppler, options)
        if min(one.end_s, end_s) - max(one.start_s, begin_s) >= options.min_duration_s
    ]
    span = Span(1, TRACK, begin_s, end_s, label, note=NO_MOTION)
    if not motions:
        return span
    first_s, last_s = motions[0].start_s, motions[-1].end_s
    return replace(
        span,
        start_s=first_s if first_s >= prompt_s else begin_s,
        end_s=min(last_s, end_s),
        note="",
    )


def label_take(folder: Path, protocol: Protocol, take: Take, prompt_s: float, end_s: float) -> Span:
    """Label the recording of a take and name who is in it; return the label.

    Parameters
    ----------
    folder : Path
        Recording that has ended.
    protocol : Protocol
    take : Take
    prompt_s, end_s : float
        When the prompt came and went, by the monotonic clock.
    """
    clocks = Clocks.read(folder)
    if clocks is None:
        raise Sd2Error(f"{folder} has no clocks", "a recording of a camera and a radar")
    recording = open_recording(folder)
    doppler = doppler_map(recording.load_capture(), axis=VelocityAxis(), clutter=CLUTTER)
    doppler = doppler.shifted(recording.radar_offset_s)
    shown_s = (clocks.recording_s(prompt_s), clocks.recording_s(end_s))
    span = prompted_span(doppler, take.gesture, *shown_s, protocol.reaction_s)
    recording.labels = Labels((LabelTrack(TRACK),), (span,), protocol.label_set)
    recording.subject = take.person
    recording.save()
    return span
