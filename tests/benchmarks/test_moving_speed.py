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
    """Target: a whole-clip facing map takes 0.7 times as long as a plain copy of the mesh."""
    whole, sparse = pair_of(mesh)
    vertices, parts, place = np.array(mesh.read(0, 450)), known_parts(mesh), VirtualSensor()

    def stretched(maker: Synthesizer, **how: Any) -> Any:
        return lambda: maker.stretch(place, 0, 450, **how)

    exact = Synthesizer(mesh, PRESETS["paper"], blocks_of=sparse)
    exact.stretch(place, 0, 450)
    moves = iter(range(1, 10**6))

    def moved() -> None:
        exact.stretch(
            VirtualSensor(position_m=(1e-9 * next(moves), 0.0, 0.0)), 0, 450, shares=False
        )

    copy_s, dense_s, map_s, mask_s, exact_s, shares_s, dense_limbs_s, limbs_s = in_turns(
        vertices.copy,
        stretched(whole, shares=False),
        stretched(sparse, shares=False),
        stretched(exact, visibility="frozen", shares=False),
        moved,
        stretched(sparse),
        stretched(whole, shares=False, parts=parts),
        stretched(sparse, shares=False, parts=parts),
    )
    with capsys.disabled():
        print(
            f"\ngestures, facing: {map_s / copy_s:.2f} times a copy of the mesh ({1e3 * map_s:.1f}"
            f" ms), mask kept {mask_s / copy_s:.2f}, exact {1e3 * exact_s / 450:.3f} ms/frame,"
            f" counting everything {dense_s / copy_s:.2f}, with the share that is seen"
            f" {shares_s / copy_s:.2f}; by limb {limbs_s / copy_s:.2f}, counting everything"
            f" {dense_limbs_s / copy_s:.2f}"
        )
    assert map_s < 0.6 * dense_s
    benchmark.pedantic(stretched(sparse, shares=False), rounds=20)


@pytest.mark.parametrize("visibility", ["facing", "exact"])
def test_nine_places(
    benchmark: Any, mesh: MeshSequence, visibility: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    """Target: maps from nine places take 0.15 times as long as when everything was counted."""
    places = [VirtualSensor(position_m=(x, y, 0.0)) for x in (-0.5, 0, 0.5) for y in (-0.3, 0, 0.3)]

    def nine(kind: type[PreparedMesh]) -> Any:
        def work() -> None:
            maker = Synthesizer(mesh, FACING)
            maker.prepared.__class__ = kind
            for place in places:
                maker.stretch(place, 0, 450, visibility, shares=False)

        return work

    def kept(maker: Synthesizer) -> Any:
        return lambda: [maker.stretch(place, 0, 450, visibility, shares=False) for place in places]

    whole, sparse = (kept(maker) if visibility == "facing" else None for maker in pair_of(mesh))
    dense_s, nine_s = in_turns(nine(Dense), nine(PreparedMesh), rounds=5)
    with capsys.disabled():
        print(
            f"\nnine places, {visibility}: {nine_s / dense_s:.2f} times everything, prepared once"
        )
        if whole is not None and sparse is not None:
            dense_s, nine_s = in_turns(whole, sparse, rounds=10)
            print(f"nine more places: {nine_s / dense_s:.2f} times everything")
    benchmark.pedantic(nine(PreparedMesh), rounds=2)


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
        found = sparse.prepared.moving(sparse.prepared.block(0), sparse._frames.counting)
        assert found is not None
        kept = len(found.vertex) / ((len(found.first) - 1) * mesh.vertex_count)
        with capsys.disabled():
            print(f"\n{kept:.0%} of the vertices move: {map_s / dense_s:.2f} times everything")
    benchmark.pedantic(lambda: None)
