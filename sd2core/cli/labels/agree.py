"""``sd2 labels agree``: agreement of two people who labelled the same recording."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from sd2core.cli.command_parser import command
from sd2core.cli.labels.reading import FrameTimes, clock_of, labels_at, needed, with_rate
from sd2core.cli.labels.suggest import spans_data
from sd2core.cli.output import Report, counted, picked, print_rows
from sd2core.options.kinds import Share
from sd2core.options.records import ARGUMENT
from sd2core.options.shared import Json

if TYPE_CHECKING:
    from sd2core.labels.agreement import Agreement, Answer, Kappa


class Agree(FrameTimes, Json):
    """Options of ``sd2 labels agree``.

    Parameters
    ----------
    a : A
        labels of one person
    b : B
        labels of the other
    min_iou : SHARE
        intersection over union that a match must reach
    track : NAME
        compare this track only
    """

    a: Annotated[Path, ARGUMENT]
    b: Annotated[Path, ARGUMENT]
    min_iou: Share = 0.5
    track: str | None = None


@command("agree", Agree)
def _agree(options: Agree) -> Report:
    """Compare the labels of two people.

    Frame by frame by Cohen's kappa (1 is agreement, 0 is chance), span by span by
    one-to-one matches. Differences of edges are B's less A's: positive is later.

      sd2 labels agree anna.json ben.json --video walk.mp4
      sd2 labels agree walk.sd2 ben.eaf --min-iou 0.3 --track Gestures
    """
    from sd2core.labels.agreement import agreement

    clock = clock_of(options, options.a, options.b)
    a, b = labels_at(options.a, clock), labels_at(options.b, clock)
    clock = needed(with_rate(options, clock, a, b), "Comparing labels")
    result = agreement(a, b, clock, min_iou=options.min_iou, track=options.track)
    return Report("", _data(result), say=partial(_print, result))


def _print(result: Agreement) -> None:
    frames, spans = result.frames, result.spans
    rows: list[tuple[str, ...]] = [("frames", "kappa", "same", "by chance")]
    rows.append(("all labels", *_kappa(frames.overall)))
    rows += [(label, *_kappa(kappa)) for label, kappa in frames.of_label.items()]
    print_rows(rows, right=(1, 2, 3))
    if frames.overall.value is None:
        print("Kappa is undefined: both give the same single answer in all frames.")
    print()
    rows = [("frames: A \\ B", *(_answer(answer) for answer in frames.answers))]
    rows += [
        (_answer(answer), *(str(count) for count in row))
        for answer, row in zip(frames.answers, frames.confusion.tolist(), strict=True)
    ]
    print_rows(rows, right=tuple(range(1, len(rows[0]))))
    print()
    same = sum(match.same_label for match in spans.matches)
    print(
        f"{counted(len(spans.matches), 'span')} matched from an IoU of {spans.min_iou:g} on,"
        f" {same} of them with the same label;"
        f" {len(spans.only_a)} only in A, {len(spans.only_b)} only in B"
        + ("" if spans.f1 is None else f"; F1 {spans.f1:.3f}")
    )
    if spans.matches:
        from statistics import median

        start_s = median(abs(match.start_difference_s) for match in spans.matches)
        end_s = median(abs(match.end_difference_s) for match in spans.matches)
        print(f"Median difference: {start_s:.3f} s between starts, {end_s:.3f} s between ends")
        rows = [("A", "B", "label", "IoU", "start s", "frames", "end s", "frames")]
        for match in spans.matches:
            words = match.a.label if match.same_label else f"{match.a.label} / {match.b.label}"
            rows.append(
                (
                    str(match.a.id),
                    str(match.b.id),
                    words,
                    f"{match.iou:.2f}",
                    f"{match.start_difference_s:+.3f}",
                    _frames(match.start_difference_frames),
                    f"{match.end_difference_s:+.3f}",
                    _frames(match.end_difference_frames),
                )
            )
        print_rows(rows, right=(0, 1, 3, 4, 5, 6, 7))
    for which, alone in (("A", spans.only_a), ("B", spans.only_b)):
        for span in alone:
            print(f"only in {which}: {span.id} {span.label} {span.start_s:.3f}–{span.end_s:.3f} s")


def _data(result: Agreement) -> dict[str, Any]:
    frames, spans = result.frames, result.spans
    return {
        "frames": frames.overall.frames,
        "overall": _kappa_data(frames.overall),
        "labels": {label: _kappa_data(kappa) for label, kappa in frames.of_label.items()},
        "answers": [list(answer) for answer in frames.answers],
        "confusion": frames.confusion.tolist(),
        "min_iou": spans.min_iou,
        "f1": spans.f1,
        "mean_iou": spans.mean_iou,
        "matches": [
            {
                "a": match.a.id,
                "b": match.b.id,
                "label_a": match.a.label,
                "label_b": match.b.label,
                **picked(match, "iou", *_DIFFERENCES),
            }
            for match in spans.matches
        ],
        "only_a": spans_data(spans.only_a, "label"),
        "only_b": spans_data(spans.only_b, "label"),
    }


_DIFFERENCES = (
    "start_difference_s",
    "end_difference_s",
    "start_difference_frames",
    "end_difference_frames",
)


def _kappa(kappa: Kappa) -> tuple[str, str, str]:
    value = "–" if kappa.value is None else f"{kappa.value:.3f}"
    return value, f"{kappa.observed:.1%}", f"{kappa.expected:.1%}"


def _kappa_data(kappa: Kappa) -> dict[str, Any]:
    return {"kappa": kappa.value, "observed": kappa.observed, "expected": kappa.expected}


def _answer(answer: Answer) -> str:
    return " + ".join(answer) or "(none)"


def _frames(difference: int | None) -> str:
    return "–" if difference is None else f"{difference:+d}"
