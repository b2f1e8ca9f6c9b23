"""Model of what a counting plan costs, the same on every machine and each time."""

from __future__ import annotations

from sd2core.accuracy.plans import AccuracyPlan

_COUNT_NS, _MOMENT_NS = 1.0, 1.5
_ONE_RANGE = 0.9
"""Share of the counting that is left with one range per frame."""
_FRAME_NS = 1000.0
_FACING_NS = 2.0
_EXACT_NS = 40_000.0, 20.0, 180.0
_DEPTH_NS = 50_000.0, 60.0, 60.0
_PIXEL_NS = 10.0
"""Nanoseconds of processor time: of a frame, of each vertex, of each vertex that moves, and of each
pixel of a depth buffer. Rounded from surveys of the sample's body and of spheres of 162 to 10,242
vertices; they decide between plans and are shown nowhere."""


def modelled_ns(plan: AccuracyPlan, vertices: int, moving_share: float) -> float:
    """Processor time per frame of a counting plan on a nominal machine, in nanoseconds.

    ``vertices`` are those of the full mesh; ``moving_share`` of them leave the nulled bins.
    """
    kept = plan.vertices_kept * vertices
    count_ns = kept * (_COUNT_NS + _MOMENT_NS * plan.frame_rate_factor)
    if plan.range_law == "frame":
        count_ns *= _ONE_RANGE
    mask_ns = 0.0
    if plan.visibility == "facing":
        mask_ns = _FACING_NS * kept
    elif plan.visibility != "none" and not plan.mask_reuse_m:
        once_ns, vertex_ns, moving_ns = _EXACT_NS if plan.visibility == "exact" else _DEPTH_NS
        mask_ns = once_ns + kept * (vertex_ns + moving_ns * moving_share)
        if plan.visibility == "depth":
            mask_ns += _PIXEL_NS * plan.depth_resolution**2
    return _FRAME_NS + count_ns + mask_ns / plan.mask_stride
