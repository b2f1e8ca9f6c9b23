"""Synthetic Doppler of a real skeleton against a real radar, with and without nulled bins."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from mars_nulling import (
    FULL,
    LAGS,
    NULLED,
    PARTS,
    SYMMETRIC,
    Segment,
    at_rest,
    correlation,
    read_part,
    unsmoothed,
)

from sd2core.cli import build_parser, run
from sd2core.doppler import SynthesisOptions
from sd2core.maps import DopplerMap


@pytest.fixture(scope="module", params=PARTS)
def segments(request: pytest.FixtureRequest, shared_data: Path) -> list[Segment]:
    return read_part(shared_data / "paired" / "mars_subject1", request.param)


def test_rows_and_segments_are_those_of_the_files(segments: list[Segment]) -> None:
    assert sum(len(segment.radar_mps) for segment in segments) in (2350, 2365)
    assert len(segments) == 10
    for segment in segments:
        assert np.isfinite(segment.radar_mps).all()
        assert segment.joints_m.shape[1:] == (25, 3)
        # About 1.9 m in front of the sensor, upright: the head (3) above the feet (15).
        assert np.median(segment.joints_m[..., 2]) == pytest.approx(1.9, abs=0.3)
        assert (segment.joints_m[:, 3, 1] < segment.joints_m[:, 15, 1]).all()


def test_velocity_follows_the_radar_without_delay(segments: list[Segment]) -> None:
    synthetic = [segment.synthetic_mps(FULL) for segment in segments]
    assert not np.isnan(np.concatenate(synthetic)).any()
    found = {lag: correlation(synthetic, segments, lag) for lag in LAGS}
    assert max(found, key=lambda lag: found[lag]) == 0
    assert found[0] >= 0.65


def test_nulled_bins_cost_a_quarter_of_the_correlation(segments: list[Segment]) -> None:
    synthetic = [segment.synthetic_mps(NULLED) for segment in segments]
    # An empty frame says that nothing moves.
    assert correlation(at_rest(synthetic), segments) == pytest.approx(0.5, abs=0.05)
    # Leaving those frames out does not bring it back.
    full = correlation([segment.synthetic_mps(FULL) for segment in segments], segments)
    assert correlation(synthetic, segments) < full - 0.05


def test_nulled_bins_empty_every_third_frame(segments: list[Segment]) -> None:
    def empty(options: SynthesisOptions) -> float:
        synthetic = [segment.synthetic_mps(options) for segment in segments]
        return float(np.isnan(np.concatenate(synthetic)).mean())

    assert empty(unsmoothed(FULL)) == 0.0
    assert empty(unsmoothed(NULLED)) == pytest.approx(0.38, abs=0.03)
    # The preset's smoothing over time lends some of them a neighbour's velocity.
    assert empty(NULLED) < empty(unsmoothed(NULLED))


def test_a_symmetric_notch_costs_less(segments: list[Segment]) -> None:
    found = {
        name: correlation(at_rest(segment.synthetic_mps(options) for segment in segments), segments)
        for name, options in (("asymmetric", NULLED), ("symmetric", SYMMETRIC))
    }
    assert found["symmetric"] > found["asymmetric"]


def test_the_command_line_gives_the_same(segments: list[Segment], tmp_path: Path) -> None:
    segment = segments[0]
    mesh = tmp_path / "skeleton.npz"
    np.savez(mesh, vertices=segment.joints_m, times_s=segment.mesh.times_s)
    for name, nulled, options in (("full", "none", FULL), ("nulled", "14,15,16", NULLED)):
        out = tmp_path / f"{name}.npz"
        arguments = ["synth", str(mesh), "--out", str(out), "--visibility", "none"]
        parser, _ = build_parser()
        assert run(parser, [*arguments, "--null-bins", nulled]) == 0
        found = DopplerMap.load(out).mean_velocity_mps()
        np.testing.assert_allclose(found, segment.synthetic_mps(options), atol=1e-6)
