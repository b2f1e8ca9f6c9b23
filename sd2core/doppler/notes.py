"""What a user should know about the numbers of a synthetic map."""

from __future__ import annotations

import math

import numpy as np

from sd2core.doppler.prepared import PreparedMesh
from sd2core.mesh.presence import gaps_in_words, runs
from sd2core.numerics.precision import SHARE_OF_A_BIN, stored_velocity_error_mps
from sd2core.scattering.amplitude import NEAREST_RANGE_M
from sd2core.sensor import VirtualSensor


def map_notes(prepared: PreparedMesh, sensor: VirtualSensor, start: int, stop: int) -> list[str]:
    """Sentences about frames without a person, and what single precision does to this map.

    Parameters
    ----------
    start, stop : int
        Frames of the map, half-open.

    Returns
    -------
    list of str
        Nothing in ordinary scenes.
    """
    mesh, options = prepared.mesh, prepared.options
    notes = []
    if not (measured := mesh.presence.measured[start:stop]).all():
        share = gaps_in_words(
            runs(~measured), mesh.times_s[start:stop], mesh.timebase.frame_duration_s
        )
        notes.append(f"Without a person: {share}. Those columns are empty.")
    if np.dtype(mesh.vertices.dtype) == np.float32:
        duration_s = 2.0 * mesh.timebase.frame_duration_s / options.oversampling
        error_mps = stored_velocity_error_mps(prepared.reach_m, duration_s)
        bins = error_mps / options.axis.bin_width_mps
        if bins > SHARE_OF_A_BIN:
            notes.append(
                f"The mesh's coordinates reach {prepared.reach_m:,.4g} m and are stored in single"
                f" precision: velocities are wrong by up to {bins:.2g} bins ({error_mps:.2g} m/s)."
            )
    range_m = max(math.dist(sensor.position_m, prepared.origin_m.tolist()), NEAREST_RANGE_M)
    decades = options.range_exponent * math.log10(options.reference_range_m / range_m)
    if decades - math.log10(mesh.represented_count) < math.log10(np.finfo(np.float32).tiny):
        notes.append(
            f"At {range_m:,.4g} m the range law makes a vertex count 1e{decades:.0f}, less than the"
            " numbers of a map can be: it is empty or nearly so. Choose a farther reference range."
        )
    return notes
