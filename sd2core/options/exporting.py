"""Options of data sets to learn from."""

from __future__ import annotations

from typing import Annotated, Literal

from sd2core.options.bounds import UP_TO_ONE
from sd2core.options.kinds import (
    Bins,
    MapKind,
    Names,
    NotNegative,
    Positive,
    Typed,
    joined,
    name_list,
    share,
)
from sd2core.options.records import NOT_TYPED, Group, OptionRecord, Place
from sd2core.options.shared import KeptOut, Limbs, SegmentFrames

KINDS: tuple[MapKind, ...] = ("synthetic", "denoised", "simulated", "real")
LabelRule = Literal["foreground", "majority"]
"""Rule for a segment's label from those of its frames.

``foreground``: the label other than background that most frames have, where they are at least
``min_share`` of the segment, otherwise background: a gesture that is shorter than half a segment
still names it. ``majority``: the label that most frames have, background included. Of equal counts
the lower label wins."""

SEGMENTS, PEOPLE, MAPS = Group("segments"), Group("people"), Group("maps")


class SpanOptions(OptionRecord):
    """How labelled spans become segments, one of each.

    A longer span than a segment is refused where they are padded.

    Parameters
    ----------
    margin_s : S
        of spans: time kept before and after each
    shortest_s : S
        of spans: leave out shorter ones
    length
        of spans: fill up with empty frames, which the array mask tells apart, or stretch
    """

    GROUP = SEGMENTS

    margin_s: NotNegative = 0.0
    shortest_s: NotNegative = 0.0
    length: Annotated[Literal["padded", "resampled"], Place(("--span-length",))] = "padded"


class PeopleApart(KeptOut):
    """People that are not learnt from.

    Parameters
    ----------
    validation_subjects : LIST
        kept out to validate with, separated by commas, or none (default: about a sixth of all,
        chosen by their names, so that adding people does not move others)
    test_subjects : LIST
        kept out to test with, or none (default: likewise)
    """

    GROUP = PEOPLE


class NullBins(OptionRecord):
    """Bins that are empty in all maps.

    Parameters
    ----------
    null_bins : LIST
        bins to set to zero in all kinds (default: those of the synthetic maps)
    """

    GROUP = MAPS

    null_bins: Bins | None = None


class Exporting(Limbs, SegmentFrames, PeopleApart, NullBins):
    """Content of a data set: section ``[export]`` of a plan, and options of ``sd2 export``.

    Parameters
    ----------
    format
        in a plan: of the file
    kinds : LIST
        some of synthetic,denoised,simulated,real (default: all)
    imu : LIST
        also keep what inertial sensors there would feel at every frame, e.g.
        left-wrist,right-wrist; places as for `sd2 imu`
    frame_rate_hz : FPS
        frames per second; other sources are brought to it (default: the first one's)
    label_rule
        label of a segment: the gesture with most frames, if they are enough, or the label with
        most frames, background included
    min_share : SHARE
        least share of a segment for foreground (default: 20%)
    min_purity : SHARE
        leave out windows with less of their label than this share (default: none)
    spans
        in a plan: one segment of each labelled span
    title : TEXT
        title of the card and the sheet
    """

    GROUP = SEGMENTS

    format: Annotated[Literal["zarr", "h5", "npz"], NOT_TYPED] = "zarr"
    kinds: Annotated[tuple[MapKind, ...], Typed(name_list, joined)] = KINDS
    imu: Names = ()
    frame_rate_hz: Annotated[Positive | None, Place(("--rate",))] = None
    label_rule: LabelRule = "foreground"
    min_share: Annotated[float, UP_TO_ONE, Typed(share)] = 0.2
    min_purity: Annotated[float, UP_TO_ONE, Typed(share)] = 0.0
    spans: Annotated[SpanOptions | None, NOT_TYPED] = None
    title: str = ""

    @property
    def windowed(self) -> bool:
        """True unless segments are spans."""
        return self.spans is None
