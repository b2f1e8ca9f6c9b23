"""From a counting plan to what carries it out."""

from __future__ import annotations

from sd2core.accuracy.plans import AccuracyPlan
from sd2core.doppler.options import SynthesisOptions
from sd2core.doppler.synthesizer import Synthesizer
from sd2core.errors import Sd2Error
from sd2core.mesh.decimation import decimate
from sd2core.mesh.sequence import MeshSequence


def synthesizer_for(
    plan: AccuracyPlan,
    mesh: MeshSequence,
    options: SynthesisOptions,
    *,
    like: Synthesizer | None = None,
) -> Synthesizer:
    """What counts a mesh as planned.

    Parameters
    ----------
    mesh : MeshSequence
        The full one.
    options : SynthesisOptions
        For what a plan does not choose: axis, nulled bins, range law, smoothing.
    like : Synthesizer, optional
        One made for a plan that keeps as many vertices; its decimated mesh, and
        its prepared frames where possible, are shared.

    Raises
    ------
    Sd2Error
        For an FMCW plan, or a plan that this mesh cannot have.
    """
    if plan.family != "histogram":
        raise Sd2Error(f"The plan is {plan}", "a plan that counts vertices")
    counted = like.mesh if like is not None else decimate(mesh, plan.vertices_kept)
    return Synthesizer(counted, plan.options(options), blocks_of=like)
