"""Synthesizers of accuracy plans, what prepares them, and the quality of what they make."""

from __future__ import annotations

import functools
import math
import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Hashable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sd2app.accuracy.measurements import InUse
from sd2app.background.latest import Emit
from sd2app.maps.partial_map import FINAL, ROUGH, Part, View, pieces
from sd2app.session.tasks import ListedRunner
from sd2core.body.parts import body_parts
from sd2core.doppler.options import SynthesisOptions
from sd2core.doppler.synthesizer import Synthesizer, Visibility
from sd2core.mesh.made_vertices import same_bodies
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.vertex_parts import VertexParts
from sd2core.numerics.compiled import compile_in_background, kernels_compiled, kernels_ready
from sd2core.sensor import VirtualSensor

if TYPE_CHECKING:
    from sd2core.accuracy.plans import AccuracyPlan

_MAP_BUDGET_MS = 15.0
"""For one map while the sensor is dragged and the video plays: 20 of them a second, with most
of the time left to drawing."""

AT_ONCE = 12_000_000
"""Vertices times frames that are swept roughly in one go: a few ms up to some 20 ms."""
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

    def parts_of(self, synthesizer: Synthesizer) -> VertexParts | None:
        """Parts of the body, where they are wanted and known; the first time takes a moment."""
        if not self.limbs:
            return None
        with self._lock:
            return body_parts(synthesizer.mesh)

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


@dataclass(frozen=True, eq=False)
class QualityLevel:
    """Synthesizer and visibility with which frames are computed."""

    synthesizer: Callable[[], Synthesizer]  # the first call may take long
    quality: int  # rank of the computed frames
    words: str  # the same for people
    visibility: Visibility | None = None  # None: that of the synthesizer's options
    parts_of: Callable[[Synthesizer], VertexParts | None] = lambda _: None
    """Parts of the body by which the map is split, too."""
    key_of: Callable[[VirtualSensor], Hashable] = lambda _: None
    """Key of frames of the final quality."""


def budget_ms(frames: int) -> float:
    """Time budget per frame, in steps, so that a little zooming needs no other plan."""
    steps = math.ceil(2 * math.log2(max(frames, 1)))
    return float(_MAP_BUDGET_MS / 2 ** (steps / 2))


def final_words(synthesizers: SynthesizerCache, in_use: InUse | None) -> str:
    """Text about the quality of a map of the plan in use."""
    if in_use is not None:
        return in_use.accuracy
    return ALL_WORDS if synthesizers.options.visibility == "none" else "exact visibility"


def compute_part(
    level: QualityLevel,
    sensor: VirtualSensor,
    start: int,
    stop: int,
    proceed: Callable[[], None] = lambda: None,
) -> Part:
    """Compute frames ``start`` to ``stop``; ``proceed`` is called in between and may raise."""
    synthesizer = level.synthesizer()
    stretch = synthesizer.stretch(
        sensor, start, stop, level.visibility, lambda *_: proceed(), level.parts_of(synthesizer),
        shares=level.quality == FINAL,  # which a map that is exported names
    )  # fmt: skip
    shares = None
    if stretch.visible_share is not None and stretch.beyond_share is not None:
        shares = np.stack([stretch.visible_share, stretch.beyond_share])
    quality, words = level.quality, level.words
    if level.visibility == "frozen" and stretch.quality == "facing":
        # No mask is kept.
        quality, words = ROUGH, ROUGH_WORDS
    return Part(
        sensor, start, stretch.values, stretch.limbs, quality, words, synthesizer.unit,
        level.key_of(sensor), shares,
    )  # fmt: skip


def refine(
    sensor: VirtualSensor,
    quality: NDArray[np.uint8],
    view: View,
    rough: QualityLevel,
    final: QualityLevel | None,
    vertices: int,
    emit: Emit,
    *,
    only_view: bool = False,
) -> None:
    """Raise the quality of every frame: those in ``view`` first, those that follow, those before.

    ``quality``, shape (T,), is raised in place. ``rough`` is for frames without any value;
    ``final`` is the last stage of every frame, None stops at rough ones. ``vertices``, the size
    of the mesh, decides how much is done at once. ``emit`` receives each :class:`Part` and
    ``(done, total)`` frames, and raises to stop. ``only_view`` leaves the other frames for later.
    """
    rough_size = max(AT_ONCE // vertices, 64)
    final_size = max(rough_size // 16, 8)
    done, total = 0, int((quality < FINAL).sum())

    def run(below: int, part: View, size: int, level: QualityLevel) -> None:
        nonlocal done
        for start, stop in pieces(quality, below, *part, size):
            made = compute_part(level, sensor, start, stop, lambda: emit(None))
            quality[start:stop] = made.quality
            emit(made)
            if level.quality == FINAL:
                done += stop - start
                emit((done, total))

    others = () if only_view else ((view[1], len(quality)), (0, view[0]))
    for part in (view, *others):
        if rough.quality < FINAL:
            run(ROUGH, part, rough_size, rough)
        if final is not None:
            run(FINAL, part, final_size, final)


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
