"""``sd2 fit``: a video of a person to a moving mesh."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from sd2core.cli.command_parser import command
from sd2core.cli.output import (
    picked,
    print_event,
    print_facts,
    print_json,
    print_rows,
    progress_bar,
    progress_events,
)
from sd2core.cli.output_folders import refuse_existing
from sd2core.options.fitting import FIT_CHOICES, Fitting, meshes_of
from sd2core.options.kinds import Natural, Typed, joined
from sd2core.options.records import ARGUMENT, OptionError, Place, given
from sd2core.options.shared import JsonAndProgress, Overwrite

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from sd2core.body.fit_video import FitChoices, FitReport, FittedVideo, Stage
    from sd2core.body.people import SeenPerson
    from sd2core.io.video import VideoReader
    from sd2core.progress import Progress

ALL, LIST = ("all",), ("list",)
"""What is said of people to fit everybody, and to see who is there."""

_FORMAT = "sd2-fit-progress"
_VERSION = 1
_PROGRESS_EVERY_S = 0.05
_LANDMARKS_EVERY_S = 0.1
_UNITS = {"models": "byte", "fit": "step"}

_STATURES = {
    "default": ", by default: every velocity is proportional to it",
    "floor": ", by the floor that all stand on",
    "user": ", as given",
}

_BARS = {
    "models": ("Fetching the landmark models", "B"),
    "people": ("Following everybody", "frame"),
    "find": ("Finding the person", "frame"),
    "refine": ("Refining the landmarks", "frame"),
    "fit": ("Fitting the body", "step"),
    "write": ("Writing the mesh", "frame"),
}


def _rectangle(text: str) -> tuple[float, float, float, float]:
    try:
        x, y, width, height = (float(part) for part in text.split(","))
    except ValueError:
        x = y = width = height = 0.0
    if not (0.0 < width < 1e6 and 0.0 < height < 1e6 and abs(x) < 1e6 and abs(y) < 1e6):
        raise argparse.ArgumentTypeError(
            f"{text!r} is not X,Y,WIDTH,HEIGHT in pixels, e.g. 40,60,180,400"
        )
    return x, y, width, height


def _people(text: str) -> tuple[str, ...]:
    words = tuple(dict.fromkeys(word.strip() for word in text.split(",")))
    if words not in (ALL, LIST) and not all(word.isdigit() and int(word) for word in words):
        raise argparse.ArgumentTypeError(f"{text!r} is none of all, list, and numbers such as 1,3")
    return words


class Fit(Overwrite, Fitting, JsonAndProgress):
    """Options of ``sd2 fit``.

    Parameters
    ----------
    video : VIDEO
        any video that FFmpeg reads
    out : FILE
        the mesh to write (.zarr or .npz); of several people NAME-1.zarr, NAME-2.zarr, …
    people : WHO
        follow everybody and fit `all`, or those with the numbers N,N that `list` shows
    person_box : X,Y,W,H
        a rectangle around the person, in pixels (default: who is seen best)
    person_frame : N
        the frame of that rectangle, counted from 0 (default: 0)
    landmarks : FILE
        keep the landmarks as well (.npz)
    restart
        start from the beginning, not where a stopped run ended
    """

    video: Annotated[Path, ARGUMENT]
    out: Path | None = None
    people: Annotated[tuple[str, ...], Typed(_people, joined)] = ()
    person_box: Annotated[tuple[float, float, float, float] | None, Typed(_rectangle, joined)] = (
        None
    )
    person_frame: Natural | None = None
    landmarks: Annotated[Path | None, Place(endings=(".npz",))] = None
    restart: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.person_frame is not None and self.person_box is None:
            raise OptionError(
                "--person-frame is given without --person-box", "the rectangle in that frame"
            )
        for name, value in (("--person-box", self.person_box), ("--landmarks", self.landmarks)):
            if self.people and value is not None:
                raise OptionError(f"--people is given with {name}", "one of them")
        if self.out is None and self.people != LIST:
            raise OptionError("--out is not given", "the mesh to write")


@command("fit", Fit)
def _fit(options: Fit) -> None:
    """Make a moving mesh from a video of a person.

    Finds the person, 33 landmarks in every frame, and the body and motion that fit
    them. The size of everything follows from the person's height: say it with
    --stature-m where you know it, every velocity is proportional to it. With several
    --people it is that of the first, and the floor that all stand on tells the others'.
    At first use the landmark models are fetched (77 MB; `sd2 doctor --fetch-models`).

    It can be stopped at any moment: what is done stays in FILE.partial, and the same
    command goes on from there.

      sd2 fit walk.mp4 --out walk.zarr --stature-m 1.78
      sd2 fit two.mp4 --people list
      sd2 fit two.mp4 --out two.zarr --people all
      sd2 fit walk.mp4 --out walk.npz --field-of-view 68 --resolution low
    """
    from sd2core.body.fit_video import PARTIAL, check_fit_output, fit_video
    from sd2core.runs.pace import fit_kind, keep_pace

    if options.people:
        (_list if options.people == LIST else _fit_people)(options)
        return
    assert options.out is not None
    check_fit_output(options.out)
    continues = options.out.with_name(options.out.name + PARTIAL).exists() and not options.restart
    begun_s, begun_core_s = time.perf_counter(), time.process_time()
    with ExitStack() as stack:
        report = _lines(options) if options.progress_json else _bars(stack)
        made = fit_video(
            options.video,
            options.out,
            _choices(options),
            report,
            models=options.models,
            landmarks_out=options.landmarks,
            restart=options.restart,
        )
    seconds = time.perf_counter() - begun_s
    if not continues:
        core_s = time.process_time() - begun_core_s
        keep_pace(fit_kind(options.resolution), core_s, made.frames)
    if options.progress_json:
        _tell_end(options, [(options.out, made)], seconds)
    elif options.json:
        print_json(_summary(options, options.out, made, seconds))
    else:
        _print(_summary(options, options.out, made, seconds), made)


def _tell_end(options: Fit, meshes: list[tuple[Path, FittedVideo]], seconds: float) -> None:
    """Lines of JSON about what was made."""
    for _, made in meshes:
        for note in (*made.notes, *made.doubts):
            print_event("note", text=note)
    print_event(
        "done",
        out=str(options.out),
        frames=max((made.frames for _, made in meshes), default=0),
        present=max((made.present for _, made in meshes), default=0),
        seconds=round(seconds, 2),
    )


def _fit_people(options: Fit) -> None:
    """Fit everybody, or some."""
    from sd2core.body.fit_people import fit_people, is_stopped, people_to_fit

    assert options.out is not None
    choices, begun_s = _choices(options), time.perf_counter()
    wanted = () if options.people == ALL else tuple(map(int, options.people))
    meshes, summaries = [], []
    with ExitStack() as stack:
        report = _lines(options) if options.progress_json else _bars(stack)
        people = people_to_fit(options.video, wanted, choices, report, options.models)
        numbers = [each.number for each in people]
        outs = meshes_of(options.out, numbers)
        continues = not options.restart and is_stopped(options.video, options.out, people, choices)
        for mesh in outs:
            refuse_existing(mesh, options.overwrite or continues)

        def report_of(number: int) -> FitReport:
            return (
                _lines(options, number, numbers)
                if options.progress_json
                else _bars(stack, f", person {number}")
            )

        for person, mesh, chosen, made in fit_people(
            options.video,
            options.out,
            people,
            choices,
            report_of,
            models=options.models,
            restart=options.restart,
        ):
            seconds = time.perf_counter() - begun_s
            meshes.append((mesh, made))
            about = _summary(options, mesh, made, seconds, chosen)
            summaries.append({"person": person.number, "certainty": person.certainty, **about})
            if not (options.progress_json or options.json):
                stack.close()  # the bar, on whose line it would be
                _print(about, made)
    if options.progress_json:
        _tell_end(options, meshes, time.perf_counter() - begun_s)
    elif options.json:
        print_json({"people": summaries})


def _list(options: Fit) -> None:
    """Say who is in the video."""
    from sd2core.body.landmark_models import landmark_models
    from sd2core.body.people import find_people
    from sd2core.io.video import open_video

    with ExitStack() as stack:
        report = _lines(options) if options.progress_json else _bars(stack)
        models = landmark_models(options.models, report.progress_of("models"))
        with open_video(options.video) as video:
            people = [
                _about(each) for each in find_people(video, models, report.progress_of("people"))
            ]
    if options.progress_json:
        print_event("people", people=people)
    elif options.json:
        print_json({"video": str(options.video), "people": people})
    else:
        print_rows(
            [
                ("person", "from", "to", "seen for", "certain", "best in frame", "there"),
                *(_row(each) for each in people),
            ],
            right=range(6),
        )


def _about(person: SeenPerson) -> dict[str, Any]:
    """Facts about a person, for the list."""
    from sd2core.body.roi import MARGIN

    frame, roi = person.portrait
    side = roi.size_px / MARGIN
    corner = roi.centre_x_px - side / 2.0, roi.centre_y_px - side / 2.0
    return {
        **picked(person, "number", "from_s", "to_s", "seen_s", "certainty", "may_be"),
        "frame": frame,
        "box": [round(value) for value in (*corner, side, side)],
    }


def _row(about: dict[str, Any]) -> tuple[str, ...]:
    again = f"; may be person {about['may_be']}" if about["may_be"] else ""
    return (
        str(about["number"]),
        *(f"{about[name]:.1f} s" for name in ("from_s", "to_s", "seen_s")),
        f"{100.0 * about['certainty']:.0f} %",
        str(about["frame"]),
        ",".join(map(str, about["box"])) + again,
    )


def _choices(options: Fit) -> FitChoices:
    from sd2core.body.fit_video import FitChoices
    from sd2core.body.person_selection import Rectangle

    person = None
    if options.person_box is not None:
        x, y, width, height = options.person_box
        person = Rectangle(x, y, width, height, options.person_frame or 0)
    return FitChoices(person=person, **given(options, FIT_CHOICES))


def _bars(stack: ExitStack, of_whom: str = "") -> FitReport:
    """One bar after the other on standard error."""
    from sd2core.body.fit_video import FitReport

    def progress_of(stage: Stage) -> Progress:
        stack.close()
        words, unit = _BARS[stage]
        return stack.enter_context(progress_bar(words + of_whom, unit))

    def started(video: Any, resumed: bool) -> None:
        if resumed and sys.stderr.isatty():
            print("Going on where a stopped run ended", file=sys.stderr)

    return FitReport(progress_of, started, lambda *_: None)


def _lines(options: Fit, number: int | None = None, numbers: Sequence[int] = ()) -> FitReport:
    """Lines of JSON for another program, about the person of a number among several."""
    from sd2core.body.fit_video import STAGES, FitReport

    last_landmarks_s = -1.0
    stages: Sequence[str] = STAGES
    if numbers:
        # Several are found before.
        first = STAGES[:2] if len(numbers) == 1 else STAGES[1:2]
        parts = first, STAGES[2:]
        stages = [f"{stage} {each}" for part in parts for each in numbers for stage in part]

    def started(video: VideoReader, resumed: bool) -> None:
        print_event(
            "start",
            format=_FORMAT,
            version=_VERSION,
            video=str(options.video),
            out=str(options.out),
            frames=len(video),
            width=video.width,
            height=video.height,
            frames_per_s=round(video.timebase.frames_per_s, 4),
            stages=stages,
            resumed=resumed,
        )

    def progress_of(stage: Stage) -> Progress:
        unit = _UNITS.get(stage, "frame")
        named = stage if number is None or stage == "models" else f"{stage} {number}"
        return progress_events(_PROGRESS_EVERY_S, stage=named, unit=unit)

    def landmarks(
        stage: Stage, frame: int, image_px: NDArray[np.float32], visibility: NDArray[np.float32]
    ) -> None:
        nonlocal last_landmarks_s
        now_s = time.monotonic()
        if now_s - last_landmarks_s < _LANDMARKS_EVERY_S:
            return
        last_landmarks_s = now_s
        print_event(
            "landmarks",
            stage=stage,
            frame=frame,
            image_px=[[round(float(x), 1), round(float(y), 1)] for x, y in image_px],
            visibility=[round(float(value), 2) for value in visibility],
        )

    return FitReport(progress_of, started, landmarks)


def _summary(
    options: Fit, out: Path, made: FittedVideo, seconds: float, choices: FitChoices | None = None
) -> dict[str, Any]:
    from sd2core.body.fit_video import provenance

    about = provenance(made, options.video, choices or _choices(options))
    return about | {
        "out": str(out),
        **picked(made, "frames", "frames_per_s", "present", "bridged", "residual_m", "quality"),
        "seconds": seconds,
    }


def _print(about: dict[str, Any], made: FittedVideo) -> None:
    camera, sources = about["camera"], {"user": "as given", "metadata": "as the file says"}
    frames, present, bridged = about["frames"], about["present"], about["bridged"]
    print_facts(
        f"Made {about['out']}",
        {
            "frames": f"{frames}, {present} with the person"
            + (f" ({bridged} of them interpolated)" if bridged else ""),
            "landmarks off by": f"{100 * about['residual_m']:.1f} cm on average",
            "focal length": f"{camera['focal_px']:.0f} px,"
            f" {sources.get(camera['source'], 'by default (56° across the longer side)')}",
            "stature": f"{about['stature_m']:g} m"
            + _STATURES[about["stature_source"]],
            "took": f"{about['seconds']:.0f} s, {about['seconds'] / frames:.2f} s per frame",
        },
    )  # fmt: skip
    for note in (*made.notes, *made.doubts):
        print(f"  {note}")
