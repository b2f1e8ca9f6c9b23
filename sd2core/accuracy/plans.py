"""Plans: one value for every setting that trades accuracy for speed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, fields, replace
from itertools import product
from typing import Any, Literal, get_args

from sd2core.doppler.options import SynthesisOptions
from sd2core.errors import Sd2Error
from sd2core.fmcw.options import Motion, WaveOptions
from sd2core.options.synthesis import (
    Beyond,
    DepthResolution,
    RangeLaw,
    ScenePart,
    Visibility,
    Weight,
)

Signal = Literal["histogram", "fmcw", "direct"]
Family = Literal["histogram", "fmcw"]

FRAME_RATE_FACTORS = (1, 2, 4, 8)
MASK_STRIDES = (1, 2, 5, 10)
MASK_REUSE_M = (0.02, 0.05, 0.1, 0.3)
VERTICES_KEPT = (1.0, 0.5, 0.25, 0.1)
BLOCKS = (1, 2, 4)

_OCCLUSION = ("depth", "exact")


@dataclass(frozen=True)
class AccuracyPlan:
    """One value for every setting that trades accuracy for speed.

    Parameters
    ----------
    signal : {"histogram", "fmcw", "direct"}
        Counting, the FMCW signal by a non-uniform FFT, or its direct sum.
    visibility, depth_resolution, mask_stride
        As in :class:`sd2core.doppler.SynthesisOptions`. FMCW takes ``facing`` and
        ``exact``, for facets.
    mask_reuse_m : float
        Distance that the sensor may have moved since the mask was made; 0 computes a mask
        for every place.
    vertices_kept : float
        Share of the mesh's vertices; 1 is the full mesh.
    weight : {"count", "area", "projected"}
        Weight of a vertex: a choice of quantity, not of accuracy.
    range_law : {"vertex", "frame"}
        Range law for each vertex, or one factor for each frame.
    beyond : {"drop", "wrap", "clip"}
        Treatment of velocities beyond the axis.
    frame_rate_factor : int
        Factor by which the frame rate is raised before velocities are taken.
    blocks : int
        FMCW: parts of a frame's chirps with a beat frequency of their own.
    motion : {"constant", "interpolated"}
        FMCW: within a frame, constant velocity or interpolated at every chirp.
    left_out : tuple of {"beam", "things", "walls"}
        Parts of the scene that counting leaves out of account.
    """

    signal: Signal = "histogram"
    visibility: Visibility = "exact"
    depth_resolution: DepthResolution = 256
    mask_stride: int = 1
    mask_reuse_m: float = 0.0
    vertices_kept: float = 1.0
    weight: Weight = "count"
    range_law: RangeLaw = "vertex"
    beyond: Beyond = "wrap"
    frame_rate_factor: int = 1
    blocks: int = 1
    motion: Motion = "constant"
    left_out: tuple[ScenePart, ...] = ()

    def __post_init__(self) -> None:
        # JSON knows no tuples.
        object.__setattr__(self, "left_out", tuple(sorted(self.left_out)))
        if not set(self.left_out) <= set(get_args(ScenePart)):
            raise Sd2Error(
                f"A plan leaves out {self.left_out}", f"some of {', '.join(get_args(ScenePart))}"
            )
        if self.signal not in get_args(Signal):
            raise Sd2Error(f"signal is {self.signal!r}", f"one of {', '.join(get_args(Signal))}")
        if self.family == "fmcw" and self.visibility not in ("facing", "exact"):
            raise Sd2Error(f"An FMCW plan has visibility {self.visibility}", "facing or exact")
        if not 0 < self.vertices_kept <= 1:
            raise Sd2Error(f"vertices_kept is {self.vertices_kept}", "above 0 and up to 1")
        if not self.mask_reuse_m >= 0:
            raise Sd2Error(f"mask_reuse_m is {self.mask_reuse_m}", "0 or more metres")
        if self.visibility not in _OCCLUSION and (self.mask_stride > 1 or self.mask_reuse_m > 0):
            raise Sd2Error(
                f"A mask is to be reused with visibility {self.visibility}",
                "depth or exact: the others keep none",
            )

    @property
    def family(self) -> Family:
        """Family of the plan; plans of one family share their reference."""
        return "histogram" if self.signal == "histogram" else "fmcw"

    def __str__(self) -> str:
        return " · ".join(self._words())

    def _words(self) -> Iterator[str]:
        if self.signal == "histogram":
            by = {"count": "vertex", "area": "area", "projected": "projected area"}[self.weight]
            yield f"counted by {by}"
        else:
            yield "FMCW" if self.signal == "fmcw" else "FMCW summed directly"
        sight = self.visibility
        yield f"depth {self.depth_resolution}" if sight == "depth" else f"visibility {sight}"
        if self.mask_stride > 1:
            yield f"mask every {self.mask_stride} frames"
        if self.mask_reuse_m > 0:
            yield f"mask kept within {self.mask_reuse_m:g} m"
        if self.vertices_kept < 1:
            yield f"{100 * self.vertices_kept:g} % of the vertices"
        if self.family == "fmcw":
            yield "one block" if self.blocks == 1 else f"{self.blocks} blocks"
            if self.motion == "interpolated":
                yield "motion at every chirp"
            return
        if self.range_law == "frame":
            yield "one range per frame"
        if self.frame_rate_factor > 1:
            yield f"frame rate × {self.frame_rate_factor}"
        yield {"drop": "beyond dropped", "wrap": "wrapped", "clip": "clipped"}[self.beyond]
        if self.left_out:
            yield f"without {', '.join(self.left_out)}"

    def options(self, base: SynthesisOptions) -> SynthesisOptions:
        """Synthesis options of a counting plan; what it does not choose is taken from ``base``."""
        return replace(
            base,
            visibility=self.visibility,
            depth_resolution=self.depth_resolution,
            mask_stride=self.mask_stride,
            weight=self.weight,
            range_law=self.range_law,
            beyond=self.beyond,
            oversampling=self.frame_rate_factor,
        )

    def wave(self, base: WaveOptions) -> WaveOptions:
        """Options of an FMCW plan; what it does not choose is taken from ``base``."""
        model: Literal["nufft", "direct"] = "direct" if self.signal == "direct" else "nufft"
        return replace(base, model=model, blocks=self.blocks, motion=self.motion)

    def to_json(self) -> dict[str, Any]:
        """Every setting by name, for provenance."""
        return asdict(self)

    def provenance(self, error_l1: float) -> dict[str, Any]:
        """Entries for the metadata of a map: the plan and its measured error."""
        return {"plan": self.to_json() | {"text": str(self)}, "plan_error_l1": error_l1}

    @classmethod
    def from_json(cls, content: dict[str, Any]) -> AccuracyPlan:
        """A plan from :meth:`to_json`. Raises Sd2Error for settings that are unknown here."""
        unknown = set(content) - {field.name for field in fields(cls)}
        if unknown:
            raise Sd2Error(f"A plan names {', '.join(sorted(unknown))}", "settings of this version")
        return cls(**content)


def reference_plan(
    family: Family, weight: Weight = "count", *, surface: bool = True
) -> AccuracyPlan:
    """Plan that errors are measured against: every setting at its most accurate.

    Of a point cloud, without a ``surface``, every point is seen.
    """
    if family == "fmcw":
        return AccuracyPlan(signal="direct", weight=weight, motion="interpolated")
    return AccuracyPlan(
        visibility="exact" if surface else "none",
        weight=weight,
        frame_rate_factor=max(FRAME_RATE_FACTORS),
    )


def visibility_plans(*, surface: bool = True) -> Iterator[AccuracyPlan]:
    """Plans of every visibility; for a point cloud there is only one."""
    yield AccuracyPlan(visibility="none")
    if not surface:
        return
    yield AccuracyPlan(visibility="facing")
    for stride in MASK_STRIDES:
        for resolution in get_args(DepthResolution):
            yield AccuracyPlan(visibility="depth", depth_resolution=resolution, mask_stride=stride)
        yield AccuracyPlan(mask_stride=stride)


def counting_plans(
    weight: Weight = "count",
    *,
    surface: bool = True,
    range_law: bool = True,
    vertices_kept: Sequence[float] = VERTICES_KEPT,
) -> Iterator[AccuracyPlan]:
    """Plans of every combination of the counting settings, without reused masks.

    Parameters
    ----------
    weight : {"count", "area", "projected"}
        Of all plans: a choice of quantity.
    surface : bool
        False for a point cloud, which has no visibility and cannot be decimated.
    range_law : bool
        False if there is none to apply by vertex or by frame.
    vertices_kept : sequence of float
        Shares that the surface can be decimated to, and 1: a few faces cannot be.
    """
    laws: tuple[RangeLaw, ...] = ("vertex", "frame") if range_law else ("vertex",)
    for sight, kept, factor, law in product(
        visibility_plans(surface=surface),
        vertices_kept if surface else (1.0,),
        FRAME_RATE_FACTORS,
        laws,
    ):
        yield replace(
            sight, weight=weight, vertices_kept=kept, frame_rate_factor=factor, range_law=law
        )


def compared_plans(
    weight: Weight = "count",
    *,
    surface: bool = True,
    range_law: bool = True,
    vertices_kept: Sequence[float] = VERTICES_KEPT,
    scene: Sequence[ScenePart] = (),
) -> Iterator[AccuracyPlan]:
    """Counting plans of a table: every setting alone, and the main combinations.

    Parameters
    ----------
    weight, surface, range_law, vertices_kept
        As for :func:`counting_plans`.
    scene : sequence of {"beam", "things", "walls"}
        What the scene has: each is left out once.
    """
    base = AccuracyPlan(visibility="exact" if surface else "none", weight=weight)
    for plan in counting_plans(
        weight, surface=surface, range_law=range_law, vertices_kept=vertices_kept
    ):
        lowered = sum(
            getattr(plan, name) != getattr(base, name)
            for name in ("visibility", "mask_stride", "vertices_kept", "range_law")
        ) + (plan.frame_rate_factor > 1)
        usual = (
            plan.mask_stride in (1, 5)
            and plan.vertices_kept in (1, 0.25)
            and plan.frame_rate_factor in (1, 4)
            and plan.range_law == "vertex"
        )
        if lowered <= 1 or usual:
            yield plan
    yield replace(base, beyond="drop")
    yield from (replace(base, left_out=(part,)) for part in scene)
    if surface:
        for reach_m in MASK_REUSE_M:
            yield replace(base, mask_reuse_m=reach_m)


def wave_plans() -> Iterator[AccuracyPlan]:
    """FMCW plans of a table; the last one leaves nothing out but subdivision."""
    base = AccuracyPlan(signal="fmcw")
    for sight in ("facing", "exact"):
        for kept in VERTICES_KEPT[:3]:
            yield replace(base, visibility=sight, vertices_kept=kept)
    for blocks in BLOCKS[1:]:
        yield replace(base, blocks=blocks)
    yield replace(base, motion="interpolated")
    yield replace(base, signal="direct")
