"""``sd2 classify apply``: find gestures in a recording or a map."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from sd2core.cli.labels.reading import check_label_output, print_lost
from sd2core.cli.labels.suggest import (
    add_searched_map,
    map_and_clock,
    span_cells,
    spans_data,
    write_found,
)
from sd2core.cli.options import add_command, add_json, not_negative_float
from sd2core.cli.output import counted, print_json, print_rows, progress_bar
from sd2core.cli.recording_maps import MAP_NAMES

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


def add_apply(kinds: argparse._SubParsersAction) -> None:
    """Add ``apply``."""
    parser = add_command(
        kinds,
        "apply",
        "find gestures in a recording or a map",
        handler=_apply,
        description=(
            "Computes the probability of each class in every frame, and spans of the frames in\n"
            "which a gesture is the most probable class. The confidence of a span is the mean\n"
            "probability of its class. The map must be on the velocity axis that the classifier\n"
            "was trained on; another frame rate is resampled to the classifier's and back."
        ),
        examples=(
            "  sd2 classify apply walk.sd2 --model gestures.safetensors\n"
            "  sd2 classify apply walk.sd2 --of radar --model g.safetensors --out found.json\n"
            "  sd2 classify apply map.npz --model g.safetensors --probabilities p.npz"
        ),
    )
    add_searched_map(parser, MAP_NAMES)
    parser.add_argument(
        "--model",
        type=Path,
        required=True,
        metavar="FILE",
        help="classifier from `sd2 classify train`",
    )
    parser.add_argument(
        "--probabilities",
        type=Path,
        metavar="FILE.npz",
        help="write `probabilities` (frames, classes), `times_s` and `classes`",
    )
    parser.add_argument(
        "--min-duration-s",
        type=not_negative_float,
        default=0.2,
        metavar="S",
        help="shorter spans are left out (default: 0.2)",
    )
    parser.add_argument(
        "--merge-gap-s",
        type=not_negative_float,
        default=0.1,
        metavar="S",
        help="merge spans of a class with a shorter gap between them (default: 0.1)",
    )
    add_json(parser)


def _apply(options: argparse.Namespace) -> None:
    from sd2core.classify.files import describe_classifier, load_classifier
    from sd2core.classify.spans import SpanOptions, predicted_spans
    from sd2core.cli.reading import check_output
    from sd2core.denoise.resample_to_model import check_bins

    if options.out is not None:
        check_label_output(options.out, replace=options.replace)
    if options.probabilities is not None:
        check_output(options.probabilities, ".npz")
    chosen = SpanOptions(options.min_duration_s, options.merge_gap_s)
    card = describe_classifier(options.model)
    doppler, clock = map_and_clock(options, card.axis)
    # Before torch is loaded, which takes seconds.
    check_bins(doppler, card)
    with progress_bar("Classifying") as progress:
        probabilities = load_classifier(options.model).probabilities(doppler, progress)
    spans = predicted_spans(
        probabilities, doppler.timebase, card.classes, chosen, present=doppler.present
    )
    lost = write_found(options, spans, clock)
    if options.probabilities is not None:
        _write_probabilities(options.probabilities, probabilities, doppler.times_s, card.classes)
    if options.json:
        print_json(
            {
                "map_kind": doppler.kind,
                "model": str(options.model),
                "classes": list(card.classes),
                "mean_probabilities": dict(
                    zip(card.classes, probabilities.mean(axis=0).tolist(), strict=True)
                ),
                "spans": spans_data(spans, "label", "confidence"),
                "path": None if options.out is None else str(options.out),
                "not_kept": lost,
            }
        )
        return
    print(f"{counted(len(spans), 'gesture')} in the {doppler.kind} map, by {options.model}")
    if spans:
        rows = [("id", "start s", "end s", "gesture", "confidence")]
        rows += [(*span_cells(span), span.label, f"{span.confidence:.2f}") for span in spans]
        print_rows(rows, right=(0, 1, 2, 4))
    for path in (options.out, options.probabilities):
        if path is not None:
            print(f"Wrote {path}")
    print_lost(lost)


def _write_probabilities(
    path: Path,
    probabilities: NDArray[np.float32],
    times_s: NDArray[np.float64],
    classes: tuple[str, ...],
) -> None:
    import numpy as np

    from sd2core.files.atomic import atomic_write

    with atomic_write(path) as stream:
        np.savez_compressed(
            stream, probabilities=probabilities, times_s=times_s, classes=np.array(classes)
        )
