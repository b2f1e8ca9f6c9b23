"""``sd2 synth``: mesh to synthetic Doppler map."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Literal

from sd2core.cli.command_parser import command
from sd2core.cli.output import Report, progress_bar
from sd2core.errors import Sd2Error
from sd2core.options.records import OptionError, changed_flags, options_of
from sd2core.options.shared import Json, MapOutput, MeshAndSensor, Method, RadarChoice
from sd2core.options.synthesis import Request, Synthesis

if TYPE_CHECKING:
    from sd2core.doppler import SynthesisOptions, Synthesizer
    from sd2core.maps import DopplerMap
    from sd2core.mesh.sequence import MeshSequence
    from sd2core.sensor import VirtualSensor


_HISTOGRAM_ONLY = {one.name for one in options_of(Synthesis)} - {
    *("visibility", "bins", "v_max_mps", "vertices_kept")
} | {"budget_ms", "uncertainty"}


class Synth(MeshAndSensor, MapOutput, Method, RadarChoice, Request, Synthesis, Json):
    """Options of ``sd2 synth``.

    Parameters
    ----------
    uncertainty
        add to the map how well its values are known (arrays sd and expected), which a mesh
        from sd2 fit says
    """

    uncertainty: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.budget_ms is not None:
            self.refuse_chosen("budget_ms")
        if self.method == "histogram":
            if self.radar != "paper":
                raise OptionError("--radar is given", "it together with --method fmcw only")
            return
        unfit = changed_flags(self, _HISTOGRAM_ONLY)
        if unfit:
            raise OptionError(
                f"{unfit[0]} is given with --method fmcw",
                "options of the histogram with the histogram only",
            )
        if self.visibility not in (None, "facing", "exact"):
            raise OptionError(
                f"--visibility {self.visibility} is given with --method fmcw", "facing or exact"
            )


@command("synth", Synth)
def _synth(options: Synth) -> Report:
    """Compute the Doppler that a radar would have measured of a moving mesh.

    Counts the mesh's vertices by their velocity towards the sensor, frame by frame.
    The camera is at 0,0,0 and looks along z; x is to its right and y down, in
    metres. Positive velocity is approaching. Options that are not given come from
    the preset. With --method fmcw the echoes of all triangles are summed to the signal
    of a radar, and that is processed like a capture (more: sd2 simulate radar).

      sd2 synth walk.npz --out map.npz
      sd2 synth walk.npz --out left.npz --sensor -1,0,2
      sd2 synth walk.sd2 --out map.npz    (mesh and sensor of a recording)
      sd2 synth points.npz --out map.npz --visibility none --null-bins none
      sd2 synth walk.npz --out map.npz --preset vid2doppler
      sd2 synth walk.npz --out map.npz --tolerance 2%    (as quick as this allows)
      sd2 synth walk.npz --out map.npz --method fmcw
      sd2 synth walk.zarr --out map.npz --uncertainty    (of a mesh from sd2 fit)
      sd2 synth walk.zarr --out map.npz --limbs    (each part of the body apart, too)
    """
    from sd2core.cli.info.description import describe_map
    from sd2core.cli.reading import mesh_and_sensor
    from sd2core.doppler import Synthesizer
    from sd2core.doppler.options import chosen_options
    from sd2core.io.radar import named_radar
    from sd2core.mesh.decimation import decimate
    from sd2core.placements.body_extent import notes_on

    request = options.tolerance is not None or options.budget_ms is not None
    synthesis = chosen_options(options)
    mesh, sensor = mesh_and_sensor(options)
    if not request:
        mesh = decimate(mesh, options.vertices_kept or 1.0)
    if options.uncertainty and mesh.uncertainty is None:
        raise Sd2Error(
            f"--uncertainty is given, but {mesh.source} does not say how well its velocities are"
            " known",
            "a mesh that was fitted to a video with `sd2 fit`",
        )
    if options.method == "fmcw":
        doppler = _by_fmcw(options, mesh, sensor)
    elif request:
        doppler = _as_chosen(options, mesh, sensor, synthesis)
    else:
        maker = Synthesizer(mesh, synthesis, left_out=options.left_out or ())
        doppler = _counted(options, maker, sensor)
    doppler.save(options.out)
    description = describe_map(options.out, doppler)
    radar = named_radar(options.radar) if options.method == "fmcw" else None
    notes = (*mesh.notes, *notes_on(mesh, sensor, radar), *description.notes)
    description.notes = tuple(dict.fromkeys(notes))  # a gap is found in the mesh and in the map
    description.data["notes"] = list(description.notes)
    return description


def _as_chosen(
    options: Synth, mesh: MeshSequence, sensor: VirtualSensor, base: SynthesisOptions
) -> DopplerMap:
    """Map by the plan that the scene requires; plan and reasons go into its provenance."""
    from sd2core.accuracy.trial import synthesizer_for
    from sd2core.cli.ladder import chosen

    choice = chosen(mesh, sensor, base, options, dragging=False)
    if not choice.holds:
        raise Sd2Error(choice.summary, "a tolerance or budget that can be held", "Allow more of it")
    doppler = _counted(options, synthesizer_for(choice.plan, mesh, base), sensor)
    origin = choice.plan.provenance(choice.errors.l1)
    origin["plan_reasons"] = [reason.text for reason in choice.reasons]
    return replace(doppler, meta=doppler.meta | origin)


def _counted(options: Synth, synthesizer: Synthesizer, sensor: VirtualSensor) -> DopplerMap:
    from sd2core.body.parts import synthetic_map

    with progress_bar("Synthesising") as progress:
        doppler = synthetic_map(synthesizer, sensor, limbs=options.limbs, progress=progress)
    if not options.uncertainty:
        return doppler
    with progress_bar("Estimating the uncertainty") as progress:
        return replace(doppler, uncertainty=synthesizer.uncertainty(sensor, progress=progress))


def _by_fmcw(options: Synth, mesh: MeshSequence, sensor: VirtualSensor) -> DopplerMap:
    from sd2core.cli.reading import chosen_axis
    from sd2core.cli.simulate import simulate_with_bar
    from sd2core.fmcw import doppler_map
    from sd2core.io.radar import named_radar

    config = named_radar(options.radar)
    visibility: Literal["facing", "exact"] = "facing" if options.visibility == "facing" else "exact"
    capture = simulate_with_bar(mesh, sensor, config, visibility)
    with progress_bar("Processing") as progress:
        doppler = doppler_map(capture, axis=chosen_axis(options), progress=progress)
    provenance = doppler.meta | {"simulation": capture.meta["simulation"]}
    # The capture's clock starts with its first frame, the map's is the mesh's.
    return replace(doppler, meta=provenance).shifted(mesh.timebase.start_s)
