"""Labels against the recording that they belong to."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sd2core.errors import Sd2Error

_SLACK_S = 0.5
"""What programs put after the last frame, or round."""


def judge_spans(
    spans_s: Sequence[tuple[float, float]], start_s: float, end_s: float
) -> list[Sd2Error]:
    """Findings on spans, (start, end) each, outside a recording or over half a second beyond it.

    Examples
    --------
    >>> judge_spans([(1.0, 2.0)], 0.0, 15.0)
    []
    >>> print(judge_spans([(1.0, 2.0), (20.0, 21.0)], 0.0, 15.0)[0].found)
    1 of 2 labels reaches beyond the recording (0 to 15 s), as far as 21 s
    """
    spans = np.asarray(spans_s, np.float64).reshape(-1, 2)
    beyond_s = np.maximum(start_s - spans[:, 0], spans[:, 1] - end_s)
    outside = (spans[:, 0] >= end_s) | (spans[:, 1] <= start_s)
    reaching = (spans[:, 0] < start_s - _SLACK_S) | (spans[:, 1] > end_s + _SLACK_S)
    count = int((outside | reaching).sum())
    if not count:
        return []
    worst = spans[int(np.argmax(beyond_s))]
    far_s = worst[1] if worst[1] - end_s >= start_s - worst[0] else worst[0]
    cause = "The labels are probably of another recording, or their times have an offset"
    if end_s > 0 and float(np.median(spans[:, 1])) > 100 * end_s:
        cause = "Their times are probably milliseconds"
    return [
        Sd2Error(
            f"{count:,} of {len(spans):,} labels {'reaches' if count == 1 else 'reach'} beyond the"
            f" recording ({start_s:.4g} to {end_s:.4g} s), as far as {far_s:.6g} s",
            "labels within it",
            cause,
        )
    ]
