"""Synthesizers of accuracy plans for the open mesh."""

from __future__ import annotations

import threading
from collections import OrderedDict
from dataclasses import replace
from typing import TYPE_CHECKING

from sd2app.accuracy.ladder import Ladder
from sd2core.doppler.options import SynthesisOptions
from sd2core.doppler.synthesizer import Synthesizer
from sd2core.mesh.sequence import MeshSequence

if TYPE_CHECKING:
    from sd2core.accuracy.plans import AccuracyPlan

_KEPT = 3
"""Number of kept synthesizers: for the rest, for dragging, and the one before."""


class SynthesizerCache:
    """Makes a synthesizer per plan on demand, and keeps the newest.

    Those that count as many vertices share what is prepared, as far as they can.
    ``options`` are those that no plan chooses; ``ladder`` makes synthesizers, where decimating
    the mesh takes long. ``full`` is the synthesizer on the full mesh with these options, for
    readouts of single vertices and for use without a plan.
    """

    def __init__(self, mesh: MeshSequence, options: SynthesisOptions, ladder: Ladder) -> None:
        self.mesh = mesh
        self.options = options
        self.full = Synthesizer(mesh, options)
        self._ladder = ladder
        self._made: OrderedDict[AccuracyPlan, Synthesizer] = OrderedDict()
        self._lock = threading.Lock()

    def of(self, plan: AccuracyPlan | None) -> Synthesizer:
        """The synthesizer of a plan; the first time it takes as long as decimating."""
        if plan is None:
            return self.full
        key = _key(plan)
        with self._lock:
            synthesizer = self._made.get(key)
            if synthesizer is None:
                synthesizer = self._ladder.synthesizer_for(
                    key, self.mesh, self.options, self._like(key)
                )
                self._made[key] = synthesizer
            self._made.move_to_end(key)
            while len(self._made) > _KEPT:
                self._made.popitem(last=False)
        return synthesizer

    def ready(self, plan: AccuracyPlan | None) -> Synthesizer | None:
        """The synthesizer of a plan if there is one already; never waits."""
        return self.full if plan is None else self._made.get(_key(plan))

    def _like(self, plan: AccuracyPlan) -> Synthesizer | None:
        if plan.vertices_kept == 1:
            return self.full
        same = [made for key, made in self._made.items() if key.vertices_kept == plan.vertices_kept]
        return same[-1] if same else None


def _key(plan: AccuracyPlan) -> AccuracyPlan:
    # How long a mask is kept is up to the window; it changes no synthesizer.
    return replace(plan, mask_reuse_m=0.0)
