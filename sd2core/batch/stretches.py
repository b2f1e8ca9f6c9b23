"""Long clips in stretches of frames, so that memory does not grow with their length."""

from __future__ import annotations

LONGEST_FRAMES = 18_000
"""Of a stretch: ten minutes at 30 frames/s, whose maps are a few MB."""

Stretch = tuple[int, int]
"""Half-open, in frames of the clip."""


def stretches_of(frames: int, longest: int = LONGEST_FRAMES) -> list[Stretch]:
    """A clip in as few stretches as may be, of nearly equal lengths."""
    count = max(1, -(-frames // longest))
    edges = [frames * number // count for number in range(count + 1)]
    return [(edges[number], edges[number + 1]) for number in range(count)]
