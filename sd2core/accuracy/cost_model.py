"""Model of what a counting plan costs, the same on every machine and each time."""

from __future__ import annotations

from collections.abc import Collection

from sd2core.accuracy.plans import AccuracyPlan
from sd2core.options.synthesis import ScenePart

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


_BEAM, _THINGS = 3.0, 1.15
"""Factors of a beam on the time of counting, and of things on that of masks (docs/decisions/0080,
0081)."""


def modelled_ns(
    plan: AccuracyPlan,
    vertices: int,
    moving_share: float,
    scene: Collection[ScenePart] = (),
    walls: int = 0,
) -> float:
    """Processor time per frame of a counting plan on a nominal machine, in nanoseconds.

    Parameters
    ----------
    plan : AccuracyPlan
    vertices : int
        Of the full mesh.
    moving_share : float
        Share of them that leaves the nulled bins.
    scene : collection of {"beam", "things", "walls"}
        What the scene has, and a plan may leave out.
    walls : int
        In the scene; by way of each is counted once more.
    """
    modelled = set(scene) - set(plan.left_out)
    kept = plan.vertices_kept * vertices
    count_ns = kept * (_COUNT_NS + _MOMENT_NS * plan.frame_rate_factor)
    if plan.range_law == "frame":
        count_ns *= _ONE_RANGE
    if "beam" in modelled:
        count_ns *= _BEAM
    mask_ns = 0.0
    if plan.visibility == "facing":
        mask_ns = _FACING_NS * kept
    elif plan.visibility != "none" and not plan.mask_reuse_m:
        once_ns, vertex_ns, moving_ns = _EXACT_NS if plan.visibility == "exact" else _DEPTH_NS
        mask_ns = once_ns + kept * (vertex_ns + moving_ns * moving_share)
        if plan.visibility == "depth":
            mask_ns += _PIXEL_NS * plan.depth_resolution**2
    if "things" in modelled:
        mask_ns *= _THINGS
    times = 1 + walls if "walls" in modelled else 1
    return _FRAME_NS + times * (count_ns + mask_ns / plan.mask_stride)
