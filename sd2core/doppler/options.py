"""Options of Doppler synthesis, and their presets."""

from __future__ import annotations

from dataclasses import field, fields, replace
from typing import Annotated, Literal

from sd2core.errors import Sd2Error
from sd2core.options import bounds
from sd2core.options.kinds import Count, NotNegative
from sd2core.options.records import OptionRecord, given
from sd2core.options.synthesis import (
    Beyond,
    DepthResolution,
    HowCounted,
    RangeLaw,
    Synthesis,
    Visibility,
    Weight,
)
from sd2core.sensor import VelocityAxis

VelocityRule = Literal["central", "vid2doppler"]

MAX_BINS = 254
"""Bin numbers are bytes, and two values say "beyond the axis" and "hidden"."""


class SynthesisOptions(OptionRecord):
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
        A vertex is spread over the bins as badly as its velocity is known, as a normal
        distribution of half the deviation that the mesh states, or counts in the bin of that
        velocity; of a mesh that says nothing both are the same map. Vid2Doppler's velocities
        always count plainly.
    axis : VelocityAxis
        Up to 254 bins. On another than the preset's ``null_bins`` are other velocities: see
        :func:`same_velocities`, which :func:`chosen_options` calls.
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
    mask_stride: Count = 1
    weight: Weight = "count"
    axis: VelocityAxis = field(default_factory=VelocityAxis)
    null_bins: tuple[int, ...] = (14, 15, 16)
    beyond: Beyond = "drop"
    range_exponent: Annotated[float, bounds.RANGE_EXPONENT] = 4.0
    reference_range_m: Annotated[float, bounds.REFERENCE_RANGE_M] = 2.2
    range_law: RangeLaw = "vertex"
    velocity: VelocityRule = "central"
    oversampling: Count = 1
    trajectory_smoothing_s: NotNegative = 0.0
    velocity_sigma_bins: NotNegative = 1.0
    time_sigma_s: NotNegative = 1.0 / 30.0
    null_after_smoothing: bool = True
    count: HowCounted = "expected"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.axis.bins > MAX_BINS:
            raise Sd2Error(f"The velocity axis has {self.axis.bins} bins", f"up to {MAX_BINS}")
        nulled = self.axis.checked_bins(self.null_bins, "null_bins")
        object.__setattr__(self, "null_bins", nulled)
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


def chosen_options(synthesis: Synthesis) -> SynthesisOptions:
    """Return the preset with what is given in place of its own.

    On another axis than the preset's the same velocities are nulled, unless ``null_bins``
    is given. Raises Sd2Error for values that are not allowed.
    """
    base = PRESETS[synthesis.preset]
    values = given(synthesis, (one.name for one in fields(SynthesisOptions)))
    axis = VelocityAxis(
        synthesis.bins or base.axis.bins, synthesis.v_max_mps or base.axis.v_max_mps
    )
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
