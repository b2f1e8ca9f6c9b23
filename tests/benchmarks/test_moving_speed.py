"""What counting only the vertices that move brings, as ratios within one run.

The scenes are the bundled sample (gestures of somebody who stands), and bodies of which more and
more moves.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from timing import best_s

import sd2core as sd2
from sd2core.body.parts import known_parts
from sd2core.doppler import PRESETS, Synthesizer, moving
from sd2core.doppler.prepared import PreparedMesh
from sd2core.files.resources import resource_path
from sd2core.mesh.sequence import MeshSequence
from sd2core.numerics.compiled import warm_up
from sd2core.sensor import VirtualSensor

FACING = replace(PRESETS["paper"], visibility="facing")


@pytest.fixture(scope="module")
def mesh() -> MeshSequence:
    warm_up()
    return sd2.load_mesh(resource_path("swipes.sd2") / "mesh.zarr").between(0, 450)


class Dense(PreparedMesh):
    """Everything is counted."""

    def moving(self, *_: object) -> None:
        """Leave nothing out."""
        return


def in_turns(*works: Any, rounds: int = 30) -> NDArray[np.float64]:
    """Shortest times, in turns, so that a busy machine slows all."""
    return np.min([[best_s(work, 1) for work in works] for _ in range(rounds)], axis=0)


def pair_of(mesh: MeshSequence) -> tuple[Synthesizer, Synthesizer]:
    """Prepared synthesizers that count everything, and what moves."""
    whole, sparse = Synthesizer(mesh, FACING), Synthesizer(mesh, FACING)
    whole.prepared.__class__ = Dense
    for one in (whole, sparse):
        one.prepare()
        one.stretch(VirtualSensor(), 0, mesh.frame_count, shares=False)
    return whole, sparse


def test_gestures(benchmark: Any, mesh: MeshSequence, capsys: pytest.CaptureFixture[str]) -> None:
    """Target: a whole-clip facing map takes no longer than a plain copy of the mesh."""
    whole, sparse = pair_of(mesh)
    vertices, parts, place = np.array(mesh.read(0, 450)), known_parts(mesh), VirtualSensor()

    def stretched(maker: Synthesizer, **how: Any) -> Any:
        return lambda: maker.stretch(place, 0, 450, **how)

    copy_s, dense_s, map_s, shares_s, dense_limbs_s, limbs_s = in_turns(
        vertices.copy,
        stretched(whole, shares=False),
        stretched(sparse, shares=False),
        stretched(sparse),
        stretched(whole, shares=False, parts=parts),
        stretched(sparse, shares=False, parts=parts),
    )
    with capsys.disabled():
        print(
            f"\ngestures, facing: {map_s / copy_s:.2f} times a copy of the mesh ({1e3 * map_s:.1f}"
            f" ms), counting everything {dense_s / copy_s:.2f}, with the share that is seen"
            f" {shares_s / copy_s:.2f}; by limb {limbs_s / copy_s:.2f}, counting everything"
            f" {dense_limbs_s / copy_s:.2f}"
        )
    assert map_s < 0.6 * dense_s
    benchmark.pedantic(stretched(sparse, shares=False), rounds=20)


def test_where_counting_everything_is_faster(
    benchmark: Any,
    mesh: MeshSequence,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The share of moving pairs up to which leaving out pays."""
    monkeypatch.setattr(moving, "_LARGEST_SHARE", 1.0)
    still = np.array(mesh.read(0, 150))
    rng = np.random.default_rng(0)
    for share in (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8):
        moves = rng.random(mesh.vertex_count) < share
        shaken = still.copy()
        shaken[::4, moves] += 0.02  # 0.3 m/s over two frames
        shaken[1::4, moves] += 0.02
        whole, sparse = pair_of(replace(mesh.between(0, 150), vertices=shaken))
        dense_s, map_s = in_turns(
            *(
                lambda maker=maker: maker.stretch(VirtualSensor(), 0, 150, shares=False)
                for maker in (whole, sparse)
            )
        )
        pairs = sparse.prepared.moving(sparse.prepared.block(0), sparse._frames.counting)
        assert pairs is not None
        found = len(pairs.vertex) / ((len(pairs.first) - 1) * mesh.vertex_count)
        with capsys.disabled():
            print(f"\n{found:.0%} of the pairs move: {map_s / dense_s:.2f} times everything")
    benchmark.pedantic(lambda: None)
