from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class LiftedTrack:
    centre_depth: NDArray[np.float64]
    centre_sigma: NDArray[np.float64]
    depth: NDArray[np.float64]
    depth_sigma: NDArray[np.float64]
    velocity: NDArray[np.float64]
    velocity_sigma: NDArray[np.float64]


class Lifter:
    @classmethod
    def load(cls) -> Lifter:
        raise NotImplementedError

    def lift(self, track: object, camera: object) -> LiftedTrack:
        raise NotImplementedError
