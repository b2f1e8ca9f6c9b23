"""A recording of two people, whose labels say whose they are."""

from __future__ import annotations

from pathlib import Path

from swinging_recordings import recording

from sd2core.labels.spans import Labels, LabelTrack, Span
from sd2core.mesh.bodies import Body
from sd2core.recording.recording import Recording

WHO = (("swing", 1.0, 2.0, "anna"), ("wave", 1.5, 2.5, "bert"), ("rest", 3.0, 3.5, ""))


def scene(folder: Path, who: tuple[tuple[str, float, float, str], ...] = WHO) -> Recording:
    """Anna, and behind her to the right Bert, who swings a second later."""
    made = recording(folder)
    assert made.mesh is not None
    made.subject = "anna"
    made.bodies = (Body(str(made.mesh), (1.0, 0.0, 0.5), start_s=1.0, person="bert"),)
    made.labels = Labels(
        (LabelTrack("all", "free"),),
        tuple(
            Span(number, "all", start_s, end_s, label, person=person)
            for number, (label, start_s, end_s, person) in enumerate(who, start=1)
        ),
    )
    made.save()
    return made
