"""Options of a data set."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, get_args

from sd2core.errors import Sd2Error
from sd2core.imu.mounting import checked_places
from sd2core.imu.signals import MIN_FRAMES
from sd2core.maps import MapKind
from sd2core.mesh.vertex_parts import JOINTS, PARTS
from sd2core.options.exporting import KINDS, Exporting, LabelRule, SpanOptions
from sd2core.pairs.segments import LENGTH, OVERLAP, segment_starts

_ALIKE = (
    *("kinds", "frame_rate_hz", "null_bins", "label_rule", "min_share", "min_purity"),
    *("limbs", "imu", "title"),
)
"""Options with the same name wherever they are given."""


@dataclass(frozen=True)
class DatasetOptions:
    """Options of a data set.

    Parameters
    ----------
    kinds : tuple of str
        Maps to take, where a source has them.
    limbs : bool
        Also take the split of synthetic maps by the parts of the body; one without it is refused.
    length, overlap : int
        Frames of a segment, and how many it shares with the next one.
    frame_rate_hz : float, optional
        Frame rate of all segments; None: that of the first source. Sources at another rate, or
        whose frames come unevenly, are brought to it.
    null_bins : tuple of int, optional
        Bins that are zero in all kinds; None: those of the first source.
    label_rule : {"foreground", "majority"}
        ``foreground``: the label other than background that most frames have, where they
        are at least ``min_share`` of the segment, otherwise background: a gesture that is
        shorter than half a segment still names it. ``majority``: the label that most
        frames have, background included. Of equal counts the lower label wins.
    min_share : float
        0 to 1.
    min_purity : float
        Least share of a window's frames that have its label, 0 to 1; others are left out.
    spans : SpanOptions, optional
        One segment per labelled span, named by it; None: windows, wherever spans begin.
    validation, test : tuple of str, optional
        Subjects that validate and test; None: chosen by their names, see
        :mod:`sd2core.datasets.splitting`.
    imu : tuple of str
        Places of inertial sensors on the body (:data:`sd2core.imu.mounting.PLACES`), whose signals
        at the frames are kept; a source without them is refused.
    provenance : dict
        Origin of the data set; kept as JSON.

    Raises
    ------
    Sd2Error
        When one of them cannot be.
    """

    kinds: tuple[MapKind, ...] = KINDS
    length: int = LENGTH
    overlap: int = OVERLAP
    frame_rate_hz: float | None = None
    null_bins: tuple[int, ...] | None = None
    label_rule: LabelRule = "foreground"
    min_share: float = 0.2
    min_purity: float = 0.0
    spans: SpanOptions | None = None
    validation: tuple[str, ...] | None = None
    test: tuple[str, ...] | None = None
    limbs: bool = False
    imu: tuple[str, ...] = ()
    title: str = ""
    provenance: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not self.kinds or not {*self.kinds} <= {*KINDS}:
            raise Sd2Error(
                f"The kinds of maps are {', '.join(self.kinds) or 'none'}",
                f"some of {', '.join(KINDS)}",
            )
        object.__setattr__(self, "kinds", tuple(kind for kind in KINDS if kind in self.kinds))
        if self.limbs and "synthetic" not in self.kinds:
            raise Sd2Error(
                f"Limb maps of {', '.join(self.kinds)} maps", "the kind synthetic, which they split"
            )
        checked_places(self.imu)
        least = MIN_FRAMES if self.imu else 1
        if self.length < least:
            raise Sd2Error(f"Segments are {self.length} frames long", f"{least} or more")
        segment_starts(0, self.length, self.overlap)  # refuses an overlap that cannot be
        if self.frame_rate_hz is not None and not 0 < self.frame_rate_hz < math.inf:
            raise Sd2Error(f"The frame rate is {self.frame_rate_hz}", "a positive number")
        if self.label_rule not in get_args(LabelRule):
            raise Sd2Error(
                f"The label rule is {self.label_rule!r}", f"one of {', '.join(get_args(LabelRule))}"
            )
        for what, value in (("share of a label", self.min_share), ("purity", self.min_purity)):
            if not 0 <= value <= 1:
                raise Sd2Error(f"The least {what} is {value}", "0 to 1")

    @property
    def parts(self) -> tuple[str, ...]:
        """Parts of the body by which synthetic maps are split; none without ``limbs``."""
        return PARTS if self.limbs else ()

    @property
    def joints(self) -> tuple[str, ...]:
        """Joints whose kinematics are kept beside limb maps."""
        return JOINTS if self.limbs else ()


def dataset_options(
    export: Exporting, spans: SpanOptions | None, provenance: dict[str, Any] | None = None
) -> DatasetOptions:
    """Options of a data set as a plan or a command says them."""
    return DatasetOptions(
        length=export.segment_frames,
        overlap=export.overlap_frames,
        validation=export.validation_subjects,
        test=export.test_subjects,
        spans=spans,
        provenance=provenance or {},
        **{name: getattr(export, name) for name in _ALIKE},
    )
