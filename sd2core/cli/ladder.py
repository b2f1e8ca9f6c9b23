"""``sd2 ladder``: measured cost and error of every accuracy setting, and a scene's needs."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from sd2core.cli.command_parser import command
from sd2core.cli.output import print_json, progress_bar
from sd2core.options.kinds import Count
from sd2core.options.records import OptionError, given
from sd2core.options.shared import Figure, Json, MeshAndSensor, Method
from sd2core.options.synthesis import Counting, Request, Weight

if TYPE_CHECKING:
    from sd2core.accuracy import Choice, Measurement
    from sd2core.doppler import SynthesisOptions
    from sd2core.mesh.sequence import MeshSequence
    from sd2core.sensor import VirtualSensor

_TOLERANCE = 0.02


class UsualRequest(Request):
    """Error or time that is allowed, of what cannot do without.

    Parameters
    ----------
    tolerance : SHARE
        the error that is allowed, as 2% or 0.02: relative L1 of the smoothed map (default: 2%)
    """


class Ladder(MeshAndSensor, UsualRequest, Method, Counting, Figure, Json):
    """Options of ``sd2 ladder``.

    Parameters
    ----------
    method
        measure counting, or the FMCW signal
    weight
        what a vertex counts
    quick
        only say what the scene requires, without the table
    repeats : N
        how often every plan is timed (default: 5)
    fresh
        measure again what was measured before
    figure : FILE
        draw error against cost, as .png, .svg or .pdf
    """

    weight: Weight = "count"
    quick: bool = False
    repeats: Count | None = None
    fresh: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.figure is not None and self.quick:
            raise OptionError(
                "--figure is given with --quick", "one of the two: nothing is measured"
            )
        if self.method == "fmcw":
            for flag, is_given in (("--quick", self.quick), ("--count", self.count is not None)):
                if is_given:
                    raise OptionError(
                        f"{flag} is given with --method fmcw", "it with --method histogram only"
                    )


@command("ladder", Ladder)
def _ladder(options: Ladder) -> int:
    """Measure what accuracy costs on a scene, and say what the scene requires.

    Tries every sensible way of computing the Doppler of a mesh on some of its frames:
    how long it takes on this machine, and how far its map is from the most accurate
    one. Then says which is the cheapest that holds a tolerance, and why. A tolerance of
    2 % means: the absolute differences between the two smoothed maps add up to 2 % of
    the map. What was measured is kept until mesh, sensor or machine change.

      sd2 ladder walk.npz
      sd2 ladder walk.npz --quick --tolerance 1%
      sd2 ladder walk.sd2 --sensor 1.5,0,2 --budget-ms 0.1
      sd2 ladder walk.npz --method fmcw
      sd2 ladder walk.npz --figure accuracy.png --json
    """
    from sd2core.accuracy.choosing import check_options
    from sd2core.cli.reading import mesh_and_sensor
    from sd2core.doppler import PRESETS
    from sd2core.files.figure_files import save_figure

    mesh, sensor = mesh_and_sensor(options)
    chosen_by_user = given(options, ("weight", "count"))
    synthesis = check_options(mesh, replace(PRESETS["paper"], **chosen_by_user))
    choice = None
    if options.method == "histogram":
        choice = chosen(mesh, sensor, synthesis, options)
    measurement = None if options.quick else _measured(mesh, sensor, synthesis, options)
    if options.figure is not None and measurement is not None:
        from sd2core.accuracy.results import plot_cost_and_error

        save_figure(plot_cost_and_error(measurement, choice), options.figure)
    if options.json:
        print_json(
            {
                "choice": None if choice is None else choice.to_json(),
                "measurement": None if measurement is None else measurement.to_json(),
            }
        )
    else:
        if choice is not None:
            _print_choice(choice)
        if measurement is not None:
            _print_measurement(measurement)
    return 0 if choice is None or choice.holds else 1


def chosen(
    mesh: MeshSequence,
    sensor: VirtualSensor,
    synthesis: SynthesisOptions,
    options: Request,
    *,
    dragging: bool = True,
) -> Choice:
    """Choose a plan as the options wish, with progress bars.

    Parameters
    ----------
    mesh, sensor : MeshSequence, VirtualSensor
        The scene.
    synthesis : SynthesisOptions
        For what a plan does not choose.
    options : Request
        Tolerance or budget; without either the tolerance is 2 %.
    dragging : bool
        True if a budget also considers plans that keep a mask while the sensor moves.
    """
    from sd2core.accuracy.choosing import choose
    from sd2core.numerics.compiled import kernels_ready, warm_up

    tolerance = options.tolerance
    if tolerance is None and options.budget_ms is None:
        tolerance = _TOLERANCE
    if not kernels_ready():
        with progress_bar("Compiling", "kernel") as progress:
            warm_up(progress)
    with progress_bar("Choosing", "plan") as progress:
        return choose(
            mesh,
            sensor,
            tolerance=tolerance,
            budget_ms=options.budget_ms,
            dragging=dragging,
            options=synthesis,
            progress=progress,
        )


def _measured(
    mesh: MeshSequence, sensor: VirtualSensor, synthesis: SynthesisOptions, options: Ladder
) -> Measurement:
    from sd2core.accuracy.cache import cached_measurement, store_measurement
    from sd2core.accuracy.measuring import REPEATS, measure

    known = cached_measurement(mesh, sensor, synthesis, options.method)
    if known is not None and not (known.stale or options.fresh or options.repeats):
        return known
    with progress_bar("Measuring", "plan") as progress:
        measurement = measure(
            mesh,
            sensor,
            options=synthesis,
            family=options.method,
            repeats=options.repeats or REPEATS,
            progress=progress,
        )
    store_measurement(mesh, measurement)
    return measurement


def _print_choice(choice: Choice) -> None:
    from sd2core.numerics.map_accuracy import percent

    print(choice.summary)
    errors = choice.errors
    print(
        f"  as {errors.frames} frames tell of the clip: L1 {percent(errors.l1)} after smoothing,"
        f" {percent(errors.l1_raw)} before; peak velocity off by {errors.peak_mps.median:.3g} m/s"
        f" in the median frame, by up to {errors.peak_mps.p95:.3g} m/s in 95 % of them"
    )
    print("  what the scene requires (+) and what it does not (-), on the frames used to choose:")
    for reason in choice.reasons:
        print(f"  {'+' if reason.modelled else '-'} {reason.text}")


def _print_measurement(measurement: Measurement) -> None:
    from sd2core.numerics.map_accuracy import percent

    print()
    print(
        f"{measurement.source} on {measurement.machine}; {len(measurement.frames)} frames;"
        f" against {measurement.reference}"
    )
    for pieces, change in measurement.convergence:
        print(f"  reference with {pieces} pieces per facet: changed by {percent(change)}")
    print("  cost in ms per frame, 5 % of the runs took more than the number in brackets;")
    print("  errors as median of frames, 95 % in brackets; L1 of all frames together")
    header = (
        f"{'one thread':>15} {'all cores':>15} {'MB':>6} {'L1':>8} {'raw L1':>8}"
        f" {'peak m/s':>14} {'mean m/s':>14} {'wrong bins':>14}  plan"
    )
    print(header)
    front = set(measurement.front)
    for result in measurement.results:
        cost, errors = result.cost, result.errors
        one, cores = cost.one_thread_ms, cost.all_cores_ms
        print(
            f"{one.median:>7.3f} ({one.p95:.3f})"
            f" {cores.median:>7.3f} ({cores.p95:.3f})"
            f" {'–' if cost.peak_bytes is None else format(cost.peak_bytes / 1e6, '.0f'):>6}"
            f" {percent(errors.l1):>8} {percent(errors.l1_raw):>8}"
            f" {errors.peak_mps.median:>6.3f} ({errors.peak_mps.p95:.3f})"
            f" {errors.mean_mps.median:>6.3f} ({errors.mean_mps.p95:.3f})"
            f" {percent(errors.wrong_bins.median):>6} ({percent(errors.wrong_bins.p95)})"
            f"  {'*' if result in front else ' '} {result.plan}"
        )
    print("  * no other plan is both cheaper and more accurate")
