"""How often the FMCW signal and counting agree on a frame's peak velocity, within one bin.

The frames of the bundled sample that move, by number of looks: a look is a set of random
phases of the rough surface. What is counted is the area turned towards the sensor over
R^4, shown through the radar's own window and clutter filter.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from facet_visibility import facet_visibility
from numpy.typing import NDArray
from velocity_response import velocity_response

from sd2core.doppler import SynthesisOptions, Synthesizer
from sd2core.files.resources import resource_path
from sd2core.fmcw import ProcessingOptions, WaveOptions, frame_spectra
from sd2core.mesh.sequence import MeshSequence
from sd2core.numerics.compiled import warm_up
from sd2core.radar_config import PAPER_RADAR
from sd2core.recording.recording import open_recording
from sd2core.sensor import VelocityAxis, VirtualSensor
from sd2core.timebase import Timebase

CAMERA, AXIS = VirtualSensor(), VelocityAxis()
NULLED = [14, 15, 16]
LOOKS = 36
FILTERED = ProcessingOptions(clutter="mean")


@pytest.mark.benchmark(group="agreement of FMCW and counting")
def test_agreement(benchmark: Any, capsys: pytest.CaptureFixture[str]) -> None:
    warm_up()
    mesh = open_recording(resource_path("swipes.sd2")).load_mesh()
    counted, moving = expected(mesh)
    times_s = mesh.times_s[moving]
    visible = np.zeros((mesh.frame_count, len(mesh.faces)), np.bool_)  # type: ignore[arg-type]
    some = MeshSequence(mesh.vertices[moving], mesh.faces, Timebase(times_s - times_s[0]))
    visible[moving] = facet_visibility(some, CAMERA)

    def power(wave: WaveOptions, seed: int) -> NDArray[np.float32]:
        return frame_spectra(
            mesh,
            PAPER_RADAR,
            times_s,
            visibility=visible,
            wave=wave,
            processing=FILTERED,
            seed=seed,
        )

    looks = benchmark.pedantic(
        lambda: np.array([power(WaveOptions(coherent=False), seed) for seed in range(LOOKS)]),
        rounds=1,
    )
    lines = [f"{len(moving)} of {mesh.frame_count} frames move"]
    for together in (1, 4, 12, LOOKS):
        sets = looks.reshape(LOOKS // together, together, *looks.shape[1:]).sum(axis=1)
        shares = [agreeing(counted, found) for found in sets]
        lines.append(
            f"rough, looks averaged {together}: {100 * np.mean(shares):.1f} % within one bin"
            f" ({100 * min(shares):.1f} to {100 * max(shares):.1f} %, {len(shares)} sets)"
        )
    smooth = agreeing(counted, power(WaveOptions(), 0))
    lines.append(f"smooth, one look: {100 * smooth:.1f} %")
    with capsys.disabled():
        print("\n" + "\n".join(lines))
    assert agreeing(counted, looks.sum(axis=0)) >= 0.95


def expected(mesh: MeshSequence) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """What the radar should show of what is counted, and the frames that move."""
    fine = VelocityAxis(252, AXIS.v_max_mps)
    options = SynthesisOptions(
        weight="projected", axis=fine, null_bins=(), velocity_sigma_bins=0, time_sigma_s=0
    )
    response = velocity_response(PAPER_RADAR, fine.centres_mps, processing=FILTERED)
    counted = response @ Synthesizer(mesh, options).map(CAMERA).values
    moving = np.flatnonzero(~np.isin(counted.argmax(axis=0), NULLED))
    return counted[:, moving], moving


def agreeing(counted: NDArray[np.float64], power: NDArray[np.float32]) -> float:
    """Share of the frames whose peaks, outside the nulled bins, are within one bin."""
    one, other = counted.copy(), power.copy()
    one[NULLED] = other[NULLED] = 0
    return float(np.mean(np.abs(one.argmax(axis=0) - other.argmax(axis=0)) <= 1))
