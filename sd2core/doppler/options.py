"""Options of Doppler synthesis, and their presets."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal, get_args

from sd2core.errors import Sd2Error
from sd2core.sensor import VelocityAxis

Visibility = Literal["none", "facing", "depth", "exact"]
DepthResolution = Literal[128, 256]
Weight = Literal["count", "area", "projected"]
Count = Literal["plain", "expected"]
RangeLaw = Literal["vertex", "frame"]
Beyond = Literal["drop", "wrap", "clip"]
VelocityRule = Literal["central", "vid2doppler"]

MOST_BINS = 254
"""Bin numbers are bytes, and two values say "beyond the axis" and "hidden"."""

STEEPEST_RANGE_LAW = 8
FARTHEST_REFERENCE_M = 1000
"""Within these, the range law stays within single precision at any range."""


@dataclass(frozen=True)
class SynthesisOptions:
    """Options of the synthesis of a Doppler map from a mesh.

    Parameters
    ----------
    visibility : {"none", "facing", "depth", "exact"}
        Vertices that count: all, those whose normal faces the sensor, or those
        that nothing hides, by a depth buffer (fast, approximate) or exactly.
    depth_resolution : {128, 256}
        Pixels along each side of the depth buffer.
    mask_stride : int
        Depth or exact visibility is computed for every ``mask_stride``-th frame and
        used for the frames nearest to it.
    weight : {"count", "area", "projected"}
        A vertex counts 1 (the map is a share of all vertices), its area, or the
        area that it turns towards the sensor, A·cos θ (shares of the surface; a
        plate seen square on gives 1). With a range law of 4 the last is the
        constant-gamma law of rough surfaces. It relies on faces that are
        oriented outwards, as the facing test does.
    count : {"expected", "plain"}
        A vertex is spread over the bins as badly as the mesh says its velocity to be known, as a
        normal distribution, or counts in the bin of that velocity; of a mesh that says nothing
        both are the same map. Vid2Doppler's velocities always count plainly.
    axis : VelocityAxis
        Up to 254 bins.
    null_bins : tuple of int
        Bins set to zero: the static surroundings that a radar's clutter removal
        takes away.
    beyond : {"drop", "wrap", "clip"}
        Treatment of velocities beyond the axis: left out, folded back as an
        undersampled radar would, or counted in the last bin.
    range_exponent : float
        A vertex at range R counts (reference_range_m / R) ** range_exponent.
        4 is the radar equation; 0 turns the law off.
    reference_range_m : float
        Range at which a vertex counts 1.
    range_law : {"vertex", "frame"}
        R is the range of each vertex, or one range per frame, that of the mean of
        its vertices: cheaper, and as good for a body that is small for its range.
    velocity : {"central", "vid2doppler"}
        Central difference of the exact range, or that tool's own arithmetic
        (see :mod:`sd2core.doppler.vid2doppler`).
    oversampling : int
        The frame rate is raised so many times before velocities are taken, and
        folded back: each frame's histogram is the mean over that many moments
        spread evenly around it.
    trajectory_smoothing_s : float
        Sigma of the zero-phase Gaussian on the vertices' paths; 0 is off.
    velocity_sigma_bins, time_sigma_s : float
        Sigmas of the Gaussian on the map; 0 is off.
    null_after_smoothing : bool
        True to empty nulled bins again after smoothing has spread energy into them.

    Examples
    --------
    >>> from dataclasses import replace
    >>> import sd2core as sd2
    >>> quick = replace(sd2.PRESETS["paper"], visibility="facing")
    >>> quick.null_bins
    (14, 15, 16)
    """

    visibility: Visibility = "exact"
    depth_resolution: DepthResolution = 256
    mask_stride: int = 1
    weight: Weight = "count"
    axis: VelocityAxis = field(default_factory=VelocityAxis)
    null_bins: tuple[int, ...] = (14, 15, 16)
    beyond: Beyond = "drop"
    range_exponent: float = 4.0
    reference_range_m: float = 2.2
    range_law: RangeLaw = "vertex"
    velocity: VelocityRule = "central"
    oversampling: int = 1
    trajectory_smoothing_s: float = 0.0
    velocity_sigma_bins: float = 1.0
    time_sigma_s: float = 1.0 / 30.0
    null_after_smoothing: bool = True
    count: Count = "expected"

    def __post_init__(self) -> None:
        for name, allowed in (
            ("visibility", Visibility),
            ("depth_resolution", DepthResolution),
            ("weight", Weight),
            ("beyond", Beyond),
            ("range_law", RangeLaw),
            ("velocity", VelocityRule),
            ("count", Count),
        ):
            value = getattr(self, name)
            if value not in get_args(allowed):
                raise Sd2Error(
                    f"{name} is {value!r}", f"one of {', '.join(map(str, get_args(allowed)))}"
                )
        if self.axis.bins > MOST_BINS:
            raise Sd2Error(f"The velocity axis has {self.axis.bins} bins", f"up to {MOST_BINS}")
        nulled = tuple(sorted({int(number) for number in self.null_bins}))
        if nulled and not 0 <= nulled[0] <= nulled[-1] < self.axis.bins:
            raise Sd2Error(f"null_bins is {nulled}", f"bins from 0 to {self.axis.bins - 1}")
        object.__setattr__(self, "null_bins", nulled)
        for name in (
            "range_exponent",
            "trajectory_smoothing_s",
            "velocity_sigma_bins",
            "time_sigma_s",
        ):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0):
                raise Sd2Error(f"{name} is {value}", "0 or more")
        if self.range_exponent > STEEPEST_RANGE_LAW:
            raise Sd2Error(
                f"range_exponent is {self.range_exponent}", f"up to {STEEPEST_RANGE_LAW}"
            )
        if not 0 < self.reference_range_m <= FARTHEST_REFERENCE_M:
            raise Sd2Error(
                f"The reference range is {self.reference_range_m} m",
                f"more than 0 and up to {FARTHEST_REFERENCE_M} m",
            )
        if self.mask_stride < 1:
            raise Sd2Error(f"mask_stride is {self.mask_stride}", "1 or more frames")
        if self.oversampling < 1:
            raise Sd2Error(f"The oversampling is {self.oversampling}", "1 or more")
        if self.velocity == "vid2doppler" and self.oversampling > 1:
            raise Sd2Error(
                f"The oversampling is {self.oversampling} with vid2doppler's velocities",
                "1: that tool works on the video's frames",
            )
        if self.velocity == "vid2doppler":
            # The default stands for any mesh; that tool counts each vertex in one bin.
            object.__setattr__(self, "count", "plain")


PRESETS: dict[str, SynthesisOptions] = {
    # The paper's chain. It says "Gaussian smoothing" without widths: one bin
    # (0.125 m/s, about the resolution of 64 windowed chirps) and one frame of
    # its 30 frames/s are ours.
    "paper": SynthesisOptions(),
    "vid2doppler": SynthesisOptions(
        range_exponent=0.0,
        velocity="vid2doppler",
        count="plain",
        velocity_sigma_bins=5.0,
        time_sigma_s=0.0,
        # That tool blurs over its own notch.
        null_after_smoothing=False,
    ),
}
"""Named options; ``paper`` is the default.

Examples
--------
>>> import sd2core as sd2
>>> sorted(sd2.PRESETS)
['paper', 'vid2doppler']
>>> sd2.PRESETS["paper"].visibility
'exact'
"""


def chosen_options(
    preset: str, bins: int | None, v_max_mps: float | None, given: Mapping[str, Any]
) -> SynthesisOptions:
    """Preset with some options replaced, ``given`` by name.

    On another axis than the preset's the same velocities are nulled, unless ``null_bins``
    is given. Raises Sd2Error for values that are not allowed.
    """
    base = PRESETS[preset]
    if base.velocity == "vid2doppler" and given.get("count") == "expected":
        raise Sd2Error(
            "count is 'expected' with vid2doppler's velocities",
            "plain: that tool counts each vertex in one bin",
        )
    axis = VelocityAxis(bins or base.axis.bins, v_max_mps or base.axis.v_max_mps)
    values = dict(given)
    if axis != base.axis and "null_bins" not in values:
        values["null_bins"] = same_velocities(base.null_bins, base.axis, axis)
    return replace(base, axis=axis, **values)


def same_velocities(
    bins: tuple[int, ...], axis: VelocityAxis, other: VelocityAxis
) -> tuple[int, ...]:
    """Bins of ``other`` whose centre lies in one of the ``bins`` of ``axis``.

    Bins at 0 m/s are among them if they are on ``axis``, however wide they are.
    """
    at_zero = _bins_at_zero(other) if _bins_at_zero(axis).intersection(bins) else set()
    return tuple(
        number
        for number, centre_mps in enumerate(other.centres_mps)
        if number in at_zero or axis.bin_of(float(centre_mps)) in bins
    )


def _bins_at_zero(axis: VelocityAxis) -> set[int]:
    # Of an even number of bins, two meet at 0.
    return {(axis.bins - 1) // 2, axis.bins // 2}
