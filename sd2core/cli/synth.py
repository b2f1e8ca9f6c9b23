"""``sd2 synth``: mesh to synthetic Doppler map."""

from __future__ import annotations

import argparse
from dataclasses import replace
from typing import TYPE_CHECKING

from sd2core.cli.command_parser import add_command
from sd2core.cli.ladder import add_wish, chosen
from sd2core.cli.options import (
    bin_list,
    flag,
    given,
    not_negative_float,
    positive_float,
    positive_int,
    share,
)
from sd2core.cli.output import progress_bar
from sd2core.cli.simulate import add_radar_choice, simulate_with_bar
from sd2core.errors import Sd2Error

if TYPE_CHECKING:
    from sd2core.doppler import SynthesisOptions, Synthesizer
    from sd2core.maps import DopplerMap
    from sd2core.mesh.sequence import MeshSequence
    from sd2core.sensor import VirtualSensor


def add_commands(commands: argparse._SubParsersAction) -> None:
    """Add ``synth``."""
    parser = add_command(commands, "synth", handler=_synth)
    parser.add_mesh_and_sensor()
    parser.add_map_output()
    text = "the paper's chain, or Vid2Doppler's arithmetic to the last digit"
    parser.add_choice("--preset", ("paper", "vid2doppler"), text, "paper")
    parser.add_method("count vertices, or simulate the radar's signal")
    add_radar_choice(parser)
    add_wish(parser, "none: what the options say")
    text = "which vertices count: all, those that face the sensor, or those that nothing hides:"
    text += " by a depth buffer (fast, approximate) or exactly"
    parser.add_choice("--visibility", ("none", "facing", "depth", "exact"), text)
    text = "pixels along each side of the depth buffer (default: 256)"
    parser.add_argument("--depth-resolution", type=int, choices=(128, 256), help=text)
    text = "compute depth or exact visibility for every N-th frame only, and use it for the"
    text += " frames nearest to each (default: 1)"
    parser.add_value("--mask-stride", positive_int, "N", text)
    text = "simplify the surface to this share of its vertices, e.g. 25%% (default: 1, all)"
    parser.add_value("--vertices-kept", share, "SHARE", text)
    text = "a vertex counts as one, by its area, or by the area it turns towards the sensor"
    parser.add_choice("--weight", ("count", "area", "projected"), text)
    parser.add_count()
    parser.add_axis()
    text = "bins to empty, as 14,15,16, or none (default: those from -0.25 to 0.125 m/s, which"
    text += " the paper's radar cannot tell from a static room; on any axis those at 0 m/s)"
    parser.add_value("--null-bins", bin_list, "LIST", text)
    text = "velocities beyond the axis: left out, folded back as a radar does, or counted in"
    text += " the last bin"
    parser.add_choice("--beyond", ("drop", "wrap", "clip"), text)
    text = "echoes weaken with range to the power of N; 4 is the radar equation, 0 is off"
    parser.add_value("--range-exponent", not_negative_float, "N", text)
    text = "range at which a vertex counts as one (paper: 2.2)"
    parser.add_value("--reference-range-m", positive_float, "M", text)
    text = "echoes weaken with the range of each vertex or of the whole frame (default: vertex)"
    parser.add_choice("--range-law", ("vertex", "frame"), text)
    text = "smooth the mesh's motion over this many seconds (sigma), without delay"
    parser.add_value("--trajectory-smoothing-s", not_negative_float, "S", text)
    text = "raise the frame rate N times before velocities are taken, and average each frame over"
    text += " its N moments (default: 1)"
    parser.add_value("--oversampling", positive_int, "N", text)
    text = "smooth the map along velocity (sigma in bins)"
    parser.add_value("--velocity-sigma-bins", not_negative_float, "BINS", text)
    parser.add_value(
        "--time-sigma-s", not_negative_float, "S", "smooth the map along time (sigma in seconds)"
    )
    text = "add to the map how well its values are known (arrays sd and expected), which a mesh"
    text += " from sd2 fit says"
    parser.add_flag("--uncertainty", text)
    parser.add_limbs()
    parser.add_mesh_reading()
    parser.add_json()


def _synth(options: argparse.Namespace) -> None:
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
    from sd2core.cli.info.description import describe_map, show
    from sd2core.cli.reading import mesh_and_sensor
    from sd2core.doppler import Synthesizer
    from sd2core.mesh.decimation import decimate

    if options.method == "fmcw":
        _check_fmcw(options)
    elif options.radar != "paper":
        raise Sd2Error("--radar is given", "it together with --method fmcw only")
    wish = options.tolerance is not None or options.budget_ms is not None
    if wish:
        _check_wish(options)
    synthesis = synthesis_options(options)
    mesh, sensor = mesh_and_sensor(options)
    if not wish:
        mesh = decimate(mesh, options.vertices_kept or 1.0)
    if options.uncertainty and mesh.uncertainty is None:
        raise Sd2Error(
            f"--uncertainty is given, but {mesh.source} does not say how well its velocities are"
            " known",
            "a mesh that was fitted to a video with `sd2 fit`",
        )
    if options.method == "fmcw":
        doppler = _by_fmcw(options, mesh, sensor)
    elif wish:
        doppler = _as_chosen(options, mesh, sensor, synthesis)
    else:
        doppler = _counted(options, Synthesizer(mesh, synthesis), sensor)
    doppler.save(options.out)
    description = describe_map(options.out, doppler)
    description.notes = mesh.notes + description.notes
    description.data["notes"] = list(description.notes)
    show(description, as_json=options.json)


def _check_wish(options: argparse.Namespace) -> None:
    from sd2core.accuracy.plans import CHOSEN

    wish = "--tolerance" if options.tolerance is not None else "--budget-ms"
    if options.method == "fmcw":
        raise Sd2Error(f"{wish} is given with --method fmcw", f"{wish} with the histogram only")
    for name in given(options, CHOSEN):
        raise Sd2Error(
            f"{wish} is given with {flag(name)}", f"one of them: with {wish} the plan chooses how"
        )


def _as_chosen(
    options: argparse.Namespace,
    mesh: MeshSequence,
    sensor: VirtualSensor,
    base: SynthesisOptions,
) -> DopplerMap:
    """Map by the plan that the scene requires; plan and reasons go into its provenance."""
    from sd2core.accuracy.trial import synthesizer_for

    choice = chosen(mesh, sensor, base, options, dragging=False)
    if not choice.holds:
        raise Sd2Error(choice.summary, "a tolerance or budget that can be held", "Allow more of it")
    doppler = _counted(options, synthesizer_for(choice.plan, mesh, base), sensor)
    origin = choice.plan.provenance(choice.errors.l1)
    origin["plan_reasons"] = [reason.text for reason in choice.reasons]
    return replace(doppler, meta=doppler.meta | origin)


def _counted(
    options: argparse.Namespace, synthesizer: Synthesizer, sensor: VirtualSensor
) -> DopplerMap:
    from sd2core.body.parts import synthetic_map

    with progress_bar("Synthesising") as progress:
        doppler = synthetic_map(synthesizer, sensor, limbs=options.limbs, progress=progress)
    if not options.uncertainty:
        return doppler
    with progress_bar("Estimating the uncertainty") as progress:
        return replace(doppler, uncertainty=synthesizer.uncertainty(sensor, progress=progress))


def _check_fmcw(options: argparse.Namespace) -> None:
    from sd2core.doppler import SynthesisOptions

    counting = SynthesisOptions.__dataclass_fields__.keys() - {"visibility"}
    unfit = list(given(options, sorted(counting)))
    unfit += ["preset"] * (options.preset != "paper") + ["uncertainty"] * options.uncertainty
    unfit += ["limbs"] * options.limbs
    if unfit:
        raise Sd2Error(
            f"{flag(unfit[0])} is given with --method fmcw",
            "options of the histogram with the histogram only",
        )
    if options.visibility not in (None, "facing", "exact"):
        raise Sd2Error(
            f"--visibility {options.visibility} is given with --method fmcw", "facing or exact"
        )


def _by_fmcw(options: argparse.Namespace, mesh: MeshSequence, sensor: VirtualSensor) -> DopplerMap:
    from sd2core.cli.reading import chosen_axis
    from sd2core.fmcw import doppler_map
    from sd2core.io.radar import named_radar

    config = named_radar(options.radar)
    capture = simulate_with_bar(mesh, sensor, config, options.visibility or "exact")
    with progress_bar("Processing") as progress:
        doppler = doppler_map(capture, axis=chosen_axis(options), progress=progress)
    provenance = doppler.meta | {"simulation": capture.meta["simulation"]}
    # The capture's clock starts with its first frame, the map's is the mesh's.
    return replace(doppler, meta=provenance).shifted(mesh.timebase.start_s)


def synthesis_options(options: argparse.Namespace) -> SynthesisOptions:
    """The preset, with options of the command line in its place."""
    from sd2core.doppler.options import SynthesisOptions, chosen_options

    chosen = given(options, SynthesisOptions.__dataclass_fields__)
    return chosen_options(options.preset, options.bins, options.v_max, chosen)
