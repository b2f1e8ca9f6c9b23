"""What counting only the vertices that move brings, as ratios within one run.

The scenes are the bundled sample (gestures of somebody who stands), and bodies of which more and
more moves.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from timing import best_s, spent_s

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


def in_turns(*works: Any, rounds: int = 30, timed: Any = best_s) -> NDArray[np.float64]:
    """Shortest times, in turns, so that a busy machine slows all."""
    return np.min([[timed(work, 1) for work in works] for _ in range(rounds)], axis=0)


def pair_of(mesh: MeshSequence) -> tuple[Synthesizer, Synthesizer]:
    """Prepared synthesizers that count everything, and what moves."""
    whole, sparse = Synthesizer(mesh, FACING), Synthesizer(mesh, FACING)
    whole.prepared.__class__ = Dense
    for one in (whole, sparse):
        one.prepare()
        one.stretch(VirtualSensor(), 0, mesh.frame_count, shares=False)
    return whole, sparse


def test_gestures(benchmark: Any, mesh: MeshSequence, capsys: pytest.CaptureFixture[str]) -> None:
    """Target: ``map()`` after a move takes 0.7 times as long as a copy of the mesh, facing.

    With all that it says of the map, from another place each time; the copy goes into an array
    that is there, whose pages nobody has to fetch first.
    """
    whole, sparse = pair_of(mesh)
    vertices, parts = np.array(mesh.read(0, 450)), known_parts(mesh)
    kept = vertices.copy()
    exact = Synthesizer(mesh, PRESETS["paper"], blocks_of=sparse)
    exact.stretch(VirtualSensor(), 0, 450)
    moves = iter(range(1, 10**6))

    def place() -> VirtualSensor:
        at = float(next(moves))
        return VirtualSensor(position_m=(0.5 * math.sin(at), 0.3 * math.cos(0.7 * at), 0.0))

    def stretched(maker: Synthesizer, **how: Any) -> Any:
        return lambda: maker.stretch(place(), 0, 450, **how)

    works = {
        "copied": lambda: np.copyto(kept, vertices),
        "map()": lambda: sparse.map(place()),
        "without shares": stretched(sparse, shares=False),
        "mask kept, without shares": stretched(exact, visibility="frozen", shares=False),
        "by limb": stretched(sparse, shares=False, parts=parts),
        "counting everything": stretched(whole, shares=False),
        "by limb, counting everything": stretched(whole, shares=False, parts=parts),
    }
    clock = dict(zip(works, in_turns(*works.values()), strict=True))
    processor = dict(zip(works, in_turns(*works.values(), timed=spent_s), strict=True))
    exact_s = spent_s(lambda: exact.map(place()), 5)
    with capsys.disabled():
        print("\ngestures, facing, in copies of the mesh by the clock (by processor time):")
        for name in works:
            ratio, spent = (spans[name] / spans["copied"] for spans in (clock, processor))
            print(f"  {name}: {ratio:.2f} ({spent:.2f}), {1e3 * clock[name]:.2f} ms")
        print(f"  exact: {1e3 * exact_s / 450:.3f} ms of processor time a frame")
    assert processor["without shares"] < 0.6 * processor["counting everything"]
    benchmark.pedantic(works["map()"], rounds=20)


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
