"""Doppler map of live frames, column by column."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.fmcw.chain import FrameChain, ProcessingOptions
from sd2core.fmcw.processing import binned, weights_of
from sd2core.io.radar.capture import RadarCapture
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase


class LiveMap:
    """Columns of the Doppler map of frames as they come.

    They are those that :func:`~sd2core.fmcw.doppler_map` computes of all frames together, bit for
    bit. The clutter filter ``moving`` looks ahead and is refused (Sd2Error).

    Parameters
    ----------
    like : RadarCapture
        Capture of the same radar, of any number of frames, with samples of the same type.
    axis : VelocityAxis
    options : ProcessingOptions

    Examples
    --------
    >>> import numpy as np
    >>> import sd2core as sd2
    >>> from sd2core.files.resources import resource_path
    >>> from sd2core.fmcw import LiveMap, ProcessingOptions
    >>> capture = sd2.load_capture(resource_path("swipes.sd2") / "radar")
    >>> live = LiveMap(capture, sd2.VelocityAxis(32, 2.0), ProcessingOptions("mean"))
    >>> whole = sd2.doppler_map(capture, bins=32, v_max_mps=2.0, clutter="mean")
    >>> bool((live.column(capture.samples[7:8]) == whole.values[:, 7]).all())
    True
    """

    def __init__(self, like: RadarCapture, axis: VelocityAxis, options: ProcessingOptions) -> None:
        if options.clutter == "moving":
            raise Sd2Error(
                "The clutter filter is 'moving', which averages over later frames",
                "a filter that a frame is enough for: none, mean or regression",
            )
        self.axis, self._like = axis, like
        self._chain = FrameChain(like.config, options)
        self._weights = weights_of(axis, self._chain)

    def column(self, frame: NDArray[Any]) -> NDArray[np.float32]:
        """Column (bins,) of the next frame (1, channels, chirps, samples).

        Raises Sd2Error if a sample is none, as :meth:`RadarCapture.read` does.
        """
        alone = replace(self._like, samples=frame, timebase=Timebase([0.0]))
        signal = self._chain.without_own_clutter(alone.read(0, 1))
        return binned(self._weights, self._chain.power_over_doppler(signal))[:, 0]
