"""Options of Doppler synthesis as they are given; what is not comes from a preset."""

from __future__ import annotations

from typing import Annotated, Literal

from sd2core.options import bounds
from sd2core.options.kinds import Bins, Count, NotNegative, Positive, Share
from sd2core.options.records import OptionError, OptionRecord, Place, flag, given_flags
from sd2core.options.shared import Axis, Limbs

Visibility = Literal["none", "facing", "depth", "exact"]
DepthResolution = Literal[128, 256]
Weight = Literal["count", "area", "projected"]
HowCounted = Literal["plain", "expected"]
RangeLaw = Literal["vertex", "frame"]
Beyond = Literal["drop", "wrap", "clip"]
ScenePart = Literal["beam", "things", "walls"]

CHOSEN = (
    "visibility",
    "depth_resolution",
    "mask_stride",
    "vertices_kept",
    "range_law",
    "beyond",
    "oversampling",
    "left_out",
)
"""Options that an accuracy plan chooses."""


class Tolerance(OptionRecord):
    """Error that is allowed.

    Parameters
    ----------
    tolerance : SHARE
        the error that is allowed, as 2% or 0.02: relative L1 of the smoothed map (default:
        none: what the options say)
    """

    tolerance: Annotated[Share | None, Place(one_of="wish")] = None


class Request(Tolerance):
    """Error or time that is allowed.

    Parameters
    ----------
    budget_ms : MS
        instead, the milliseconds per frame that are allowed
    """

    budget_ms: Annotated[Positive | None, Place(one_of="wish")] = None


class Counting(OptionRecord):
    """How a vertex is counted.

    Parameters
    ----------
    count
        count a vertex as badly known as its mesh says its velocity to be, or in one bin
        (default: expected)
    """

    count: HowCounted | None = None


class Synthesis(Counting, Axis, Tolerance, Limbs):
    """How vertices are counted: section ``[synthesise]`` of a plan, and options of ``sd2 synth``.

    Parameters
    ----------
    preset
        the paper's chain, or Vid2Doppler's arithmetic to the last digit
    visibility
        which vertices count: all, those that face the sensor, or those that nothing hides:
        by a depth buffer (fast, approximate) or exactly
    depth_resolution
        pixels along each side of the depth buffer (default: 256)
    mask_stride : N
        compute depth or exact visibility for every N-th frame only, and use it for the
        frames nearest to each (default: 1)
    vertices_kept : SHARE
        simplify the surface to this share of its vertices, e.g. 25% (default: 1, all)
    weight
        a vertex counts as one, by its area, or by the area it turns towards the sensor
    null_bins : LIST
        bins to empty, as 14,15,16, or none (default: those from -0.25 to 0.125 m/s, which
        the paper's radar cannot tell from a static room; on any axis those at 0 m/s)
    beyond
        velocities beyond the axis: left out, folded back as a radar does, or counted in the
        last bin
    range_exponent : N
        echoes weaken with range to the power of N; 4 is the radar equation, 0 is off
    reference_range_m : M
        range at which a vertex counts as one (paper: 2.2)
    range_law
        echoes weaken with the range of each vertex or of the whole frame (default: vertex)
    trajectory_smoothing_s : S
        smooth the mesh's motion over this many seconds (sigma), without delay
    oversampling : N
        raise the frame rate N times before velocities are taken, and average each frame
        over its N moments (default: 1)
    left_out
        count as if the scene had none of these; may be given several times
    velocity_sigma_bins : BINS
        smooth the map along velocity (sigma in bins)
    time_sigma_s : S
        smooth the map along time (sigma in seconds)
    """

    preset: Literal["paper", "vid2doppler"] = "paper"
    visibility: Visibility | None = None
    depth_resolution: DepthResolution | None = None
    mask_stride: Count | None = None
    vertices_kept: Share | None = None
    weight: Weight | None = None
    null_bins: Bins | None = None
    beyond: Beyond | None = None
    range_exponent: Annotated[float, bounds.RANGE_EXPONENT] | None = None
    reference_range_m: Annotated[float, bounds.REFERENCE_RANGE_M] | None = None
    range_law: RangeLaw | None = None
    trajectory_smoothing_s: NotNegative | None = None
    oversampling: Count | None = None
    left_out: Annotated[tuple[ScenePart, ...] | None, Place(many="again")] = None
    velocity_sigma_bins: NotNegative | None = None
    time_sigma_s: NotNegative | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.preset == "vid2doppler" and self.count == "expected":
            raise OptionError(
                "--count expected is given with --preset vid2doppler",
                "plain: that tool counts each vertex in one bin",
            )
        if self.tolerance is not None:
            self.refuse_chosen("tolerance")
            if self.preset != "paper":
                raise OptionError(
                    f"--tolerance is given with --preset {self.preset}",
                    "it with the preset paper: the other has nothing that it can choose",
                )

    def refuse_chosen(self, request: str) -> None:
        """Refuse options that a plan sets where one is chosen by this wish."""
        for name in given_flags(self, CHOSEN):
            raise OptionError(
                f"{name} is given with {flag(request)}",
                f"one of them: with {flag(request)} the plan chooses how",
            )
