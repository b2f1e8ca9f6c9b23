"""``sd2 classify eval``: score a classifier on labelled maps."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from sd2core.cli.classify.data import DATA_HELP, add_data, asked_maps, clips_of, denoiser_for
from sd2core.cli.eval import add_judging, check_result_files, named_subjects, print_or_write
from sd2core.cli.options import add_command
from sd2core.cli.output import print_rows
from sd2core.errors import Sd2Error

if TYPE_CHECKING:
    from sd2core.classify.card import ClassifierCard
    from sd2core.classify.data import Clip, ClipSet
    from sd2core.classify.metrics import Score


def add_eval(kinds: argparse._SubParsersAction) -> None:
    """Add ``eval``."""
    parser = add_command(
        kinds,
        "eval",
        "evaluate a classifier on people it was not trained on",
        handler=_eval,
        description=(
            f"{DATA_HELP}\n\n"
            "Prints the confusion matrices of frames and of whole gestures, and the latency of a\n"
            "recognised gesture. Uses the people that the training kept for the test, or those\n"
            "that are named."
        ),
        examples=(
            "  sd2 classify eval campaign.zarr --model gestures.safetensors\n"
            "  sd2 classify eval own.sd2 --model g.safetensors --subjects all --plot matrix.png"
        ),
    )
    add_data(parser)
    parser.add_argument(
        "--model",
        type=Path,
        required=True,
        metavar="FILE",
        help="classifier from `sd2 classify train`",
    )
    add_judging(parser, "those the training kept for the test", "both matrices")


def _eval(options: argparse.Namespace) -> None:
    from sd2core.classify.files import load_classifier
    from sd2core.classify.live import judge
    from sd2core.files.figure_files import save_figure

    check_result_files(options)
    classifier = load_classifier(options.model)
    maps = asked_maps(options)
    known = clips_of(options.data, maps, denoiser_for(maps, options.denoiser))
    clips = _judged(known, classifier.card, options)
    found = judge(classifier, clips, known)
    subjects = list(dict.fromkeys(clip.subject for clip in clips))
    learnt = set(classifier.card.about.get("split", {}).get("training", ())) & set(subjects)
    told = {
        "model": str(options.model),
        "maps": list(known.kinds),
        "subjects": subjects,
        "learnt_from": sorted(learnt),
        **found.to_json(),
        **found.summary(),
    }
    if not print_or_write(options, told):
        _say(found, known, subjects, sorted(learnt))
    if options.plot is not None:
        from sd2core.classify.comparison_report import confusion_figure
        from sd2core.classify.metrics import shares

        figure = confusion_figure(
            [shares(found.frames), shares(found.gestures)],
            found.classes,
            ["frames", "gestures"],
            f"{options.model.stem} on {' and '.join(known.kinds)} maps",
        )
        save_figure(figure, options.plot)


def _judged(known: ClipSet, card: ClassifierCard, options: argparse.Namespace) -> tuple[Clip, ...]:
    kept = card.about.get("split", {}).get("test") or ()
    if options.subjects is not None:
        names = named_subjects(options.subjects, known.subjects)
    else:
        # Data of other people than the training's are judged whole.
        names = tuple(name for name in kept if name in known.subjects) or known.subjects
    missing = [name for name in names if name not in known.subjects]
    if missing:
        raise Sd2Error(
            f"There is nothing of {', '.join(missing)}", f"some of {', '.join(known.subjects)}"
        )
    clips = known.of(names)
    return clips if options.all_placements else tuple(c for c in clips if c.placement == 0)


def _say(found: Score, known: ClipSet, subjects: list[str], learnt: list[str]) -> None:
    from sd2core.classify.metrics import shares

    print(f"Evaluated on {' and '.join(known.kinds)} maps of {', '.join(subjects)}")
    if learnt:
        print(f"It was trained on {', '.join(learnt)}: this does not show how it does for others.")
    for what, matrix in (("frames", found.frames), ("gestures", found.gestures)):
        rows = [(what, *(f"taken for {name}" for name in found.classes), "in all")]
        for name, row, counts in zip(found.classes, shares(matrix), matrix, strict=True):
            cells = ["–" if value != value else f"{100 * value:.1f} %" for value in row]
            rows.append((name, *cells, f"{counts.sum():,}"))
        print()
        print_rows(rows, right=range(1, len(found.classes) + 2))
    print(f"\nMean recall of frames {100 * found.mean_recall:.1f} %")
    if found.latency_s == found.latency_s:
        print(
            f"A gesture is recognised after {found.latency_s:.2f} s (median), {found.missed} never"
        )
