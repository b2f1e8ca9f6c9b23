"""Options of a data set: what goes together in them."""

from __future__ import annotations

from dataclasses import fields

from sd2core.errors import Sd2Error
from sd2core.imu.mounting import checked_places
from sd2core.imu.signals import MIN_FRAMES
from sd2core.options.exporting import KINDS, Exporting, SpanOptions


def dataset_options(export: Exporting, spans: SpanOptions | None = None) -> Exporting:
    """Options of a data set as a plan or a command says them, kinds in their usual order.

    ``spans`` take the place of those in ``export``. Raises Sd2Error where options do not go
    together.
    """
    if not export.kinds or not {*export.kinds} <= {*KINDS}:
        raise Sd2Error(
            f"The kinds of maps are {', '.join(export.kinds) or 'none'}",
            f"some of {', '.join(KINDS)}",
        )
    kinds = tuple(kind for kind in KINDS if kind in export.kinds)
    if export.limbs and "synthetic" not in kinds:
        raise Sd2Error(
            f"Limb maps of {', '.join(kinds)} maps", "the kind synthetic, which they split"
        )
    checked_places(export.imu)
    if export.imu and export.segment_frames < MIN_FRAMES:
        raise Sd2Error(f"Segments are {export.segment_frames} frames long", f"{MIN_FRAMES} or more")
    values = {one.name: getattr(export, one.name) for one in fields(Exporting)}
    return Exporting(**values | {"kinds": kinds, "spans": spans or export.spans})
