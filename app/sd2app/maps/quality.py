"""Synthesizers of accuracy plans, what prepares them, and the quality of what they make."""

from __future__ import annotations

import functools
import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Hashable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sd2app.accuracy.measurements import InUse
from sd2app.background.latest import Emit
from sd2app.maps.partial_map import FINAL, Part, View
from sd2app.session.tasks import ListedRunner
from sd2core.body.parts import body_parts
from sd2core.doppler.options import SynthesisOptions
from sd2core.doppler.synthesizer import Synthesizer, Visibility
from sd2core.mesh.made_vertices import same_bodies
from sd2core.mesh.sequence import MeshSequence
from sd2core.numerics.compiled import compile_in_background, kernels_compiled, kernels_ready
from sd2core.sensor import VirtualSensor

if TYPE_CHECKING:
    from sd2core.accuracy.plans import AccuracyPlan

AT_ONCE = 12_000_000
"""Vertices times frames that are swept in one go: roughly in a few ms up to some 20 ms."""
_BUDGET_BYTES = 192 << 20
"""For prepared frames: more than a clip takes that is swept in one go; of a longer one, what is in
view."""
_KEPT = 3
"""Number of kept synthesizers: for the rest, for dragging, and the one before."""

ROUGH_WORDS = "preview: vertices facing the sensor"
ALL_WORDS = "all vertices of the point cloud"
Postprocess = Callable[[Part], Any]
"""Makes something more of a part, while the next is computed."""


class SynthesizerCache:
    """Makes a synthesizer per plan on demand, and keeps the newest.

    Those that count as many vertices share what is prepared, as far as they can.
    ``options`` are those that no plan chooses, ``files`` tells apart what the bodies were read
    from. ``full`` is the synthesizer on the full mesh with these options, for readouts of single
    vertices and for use without a plan; it shares what ``like`` has prepared, as far as it can.
    """

    def __init__(
        self,
        mesh: MeshSequence,
        options: SynthesisOptions,
        files: str,
        like: Synthesizer | None = None,
    ) -> None:
        self.mesh = mesh
        self.options = options
        self.files = files
        self.full = Synthesizer(mesh, options, memory_budget_bytes=_BUDGET_BYTES, blocks_of=like)
        self.limbs = False  # True: maps are also split by the parts of the body
        self._made: OrderedDict[AccuracyPlan, Synthesizer] = OrderedDict()
        self._lock = threading.Lock()

    def among(self, mesh: MeshSequence, options: SynthesisOptions, files: str) -> SynthesizerCache:
        """Synthesizers of the same mesh among other things and people, or with other options.

        Whatever is the same is shared: of things and people that move, all but what they hide.
        """
        other = SynthesizerCache(mesh, options, files, self.full)
        other.limbs = self.limbs
        if options == self.options and same_bodies(mesh, self.mesh):
            from sd2core.accuracy.trial import synthesizer_for

            for plan, made in list(self._made.items()):
                other._made[plan] = synthesizer_for(plan, mesh, options, like=made)
        return other

    def key(self, plan: AccuracyPlan | None, sensor: VirtualSensor) -> Hashable:
        """Key of all that a final map depends on."""
        return self.files, self._scene, plan and _key(plan), self.limbs, sensor

    @functools.cached_property
    def _scene(self) -> str:
        from sd2core.accuracy.cache import scene_fingerprint

        return scene_fingerprint(self.mesh, VirtualSensor(), self.options, "histogram")

    def of(self, plan: AccuracyPlan | None) -> Synthesizer:
        """The synthesizer of a plan; the first time it takes as long as decimating."""
        if plan is None:
            return self.full
        key = _key(plan)
        with self._lock:
            synthesizer = self._made.get(key)
            if synthesizer is None:
                from sd2core.accuracy.trial import synthesizer_for

                like = self._like(key)
                synthesizer = synthesizer_for(key, self.mesh, self.options, like=like)
                self._made[key] = synthesizer
            self._made.move_to_end(key)
            while len(self._made) > _KEPT:
                self._made.popitem(last=False)
        return synthesizer

    def part(self, request: Request, frames: View, emit: Emit) -> Part:
        """Frames that are asked for, split by the parts of the body where that is wanted."""
        # A sweep does not wait while the synthesizer of another plan is being made.
        synthesizer = self.ready(request.plan) or self.of(request.plan)
        parts = body_parts(synthesizer.mesh) if self.limbs else None
        final = request.quality == FINAL
        made = synthesizer.stretch(
            request.sensor, *frames, request.visibility, lambda *_: emit(None), parts,
            shares=final,  # which a map that is exported names
        )  # fmt: skip
        shares = None
        if made.visible_share is not None and made.beyond_share is not None:
            shares = np.stack([made.visible_share, made.beyond_share])
        # Where no mask is kept.
        rough = request.visibility == "frozen" and made.quality == "facing"
        return Part(
            request.sensor, frames[0], made.values, made.limbs, request.quality,
            ROUGH_WORDS if rough else request.words, synthesizer.unit,
            self.key(request.plan, request.sensor) if final else None, shares,
        )  # fmt: skip

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


class Request(NamedTuple):
    """For which placement frames are computed, and how."""

    sensor: VirtualSensor
    plan: AccuracyPlan | None  # of the synthesizer
    quality: int  # rank of the computed frames
    words: str  # the same for people
    visibility: Visibility | None = None  # None: that of the synthesizer's options


def final_words(synthesizers: SynthesizerCache, in_use: InUse | None) -> str:
    """Text about the quality of a map of the plan in use."""
    if in_use is not None:
        return in_use.accuracy
    return ALL_WORDS if synthesizers.options.visibility == "none" else "exact visibility"


_POLL_S = 0.2


class Compiler(ListedRunner):
    """Waits for the compiler where there is no machine code yet, and says how far it is."""

    def start(self) -> None:
        """Compile what is not compiled: a map waits for it."""
        process = compile_in_background()
        if process is None or kernels_ready() or process.poll() is not None or self.busy:
            return

        def wait(emit: Emit) -> None:
            while not kernels_ready() and process.poll() is None:
                emit(kernels_compiled())
                time.sleep(_POLL_S)

        self.cancelled.connect(process.terminate)
        self.submit(wait, "Compiling, once after installing")
