"""Small gesture recordings as the K60168A's software writes them, made up."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray


def maps(frames: int) -> NDArray[np.float16]:
    """Map 0 is 0 but for an echo at range 3, Doppler bin 20, of value 2; map 1 is all 9."""
    values = np.zeros((2, 32, 32, frames), np.float16)
    values[0, 3, 20] = 2.0
    values[1] = 9.0
    return values


def write_kkt(path: Path, frames: int = 12, **changes: Any) -> Path:
    """A recording; ``changes`` replace datasets, None leaves one out.

    ``name`` is the gesture's name, None for a file without that group.
    """
    label = np.zeros((frames, 1), np.uint16)
    label[4:9] = 1
    count = np.repeat((np.arange(frames) + 700)[:, None], 2, axis=1).astype(np.uint16)
    content = {"DS1": maps(frames), "LABEL": label, "FRAME_COUNT": count, "name": "Wave"} | changes
    name = content.pop("name")
    with h5py.File(path, "w") as file:
        for key, values in content.items():
            if values is not None:
                file[key] = values
        if name is not None:
            group = file.create_group("DATA_CONFIG")
            group.attrs["Description"] = "Open->Close->Open"
            group.attrs["Gesture_name"] = name
    return path
