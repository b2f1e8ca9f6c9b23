"""``sd2 classify eval`` and ``sd2 classify apply``: a trained classifier scored, and used."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from sd2core.cli.classify.data import DATA_HELP, SourcesAndMaps, clips_of
from sd2core.cli.command_parser import command
from sd2core.cli.eval import Judging, named_subjects
from sd2core.cli.labels.reading import check_label_output, print_lost
from sd2core.cli.labels.suggest import (
    SearchedMap,
    map_and_clock,
    span_cells,
    spans_data,
    write_spans,
)
from sd2core.cli.output import counted, print_json, print_rows, progress_bar
from sd2core.cli.recording_maps import MapName, parsed_maps
from sd2core.errors import Sd2Error
from sd2core.options.records import OptionRecord, Place
from sd2core.options.shared import Json
from sd2core.options.suggesting import PredictedSpans

if TYPE_CHECKING:
    from sd2core.classify.card import ClassifierCard
    from sd2core.classify.data import Clip, ClipSet
    from sd2core.classify.metrics import Score


class TrainedModel(OptionRecord):
    """The classifier that is used.

    Parameters
    ----------
    model : FILE
        classifier from `sd2 classify train` (default: the one that comes with SD² Studio)
    """

    model: Path | None = None

    @property
    def classifier(self) -> Path:
        """File of the classifier."""
        from sd2core.classify.files import bundled_classifier

        return bundled_classifier() if self.model is None else self.model


class Evaluate(SourcesAndMaps, TrainedModel, Judging):
    """Options of ``sd2 classify eval``.

    Parameters
    ----------
    subjects : LIST
        people to evaluate on, separated by commas, or `all` (default: those the training kept
        for the test)
    figure : FILE
        draw both matrices, as .png, .svg or .pdf
    """


class Apply(PredictedSpans, SearchedMap, TrainedModel, Json):
    """Options of ``sd2 classify apply``.

    Parameters
    ----------
    of
        which map of a recording (default: of a kind that was learnt from; synthetic, or radar)
    probabilities : FILE.npz
        write `probabilities` (frames, classes), `times_s` and `classes`
    """

    of: MapName | None = None
    probabilities: Annotated[Path | None, Place(endings=(".npz",))] = None


@command("eval", Evaluate, DATA_HELP)
def _eval(options: Evaluate) -> None:
    """Evaluate a classifier on people it was not trained on.

    Prints the confusion matrices of frames and of whole gestures, and the latency of a
    recognised gesture. Uses the people that the training kept for the test, or those
    that are named.

      sd2 classify eval campaign.zarr --model gestures.safetensors
      sd2 classify eval own.sd2 --model g.safetensors --subjects all --figure matrix.png
    """
    from sd2core.classify.files import load_classifier
    from sd2core.classify.live import judge
    from sd2core.files.figure_files import save_figure
    from sd2core.pairs.summary import is_among

    classifier = load_classifier(options.classifier)
    maps = parsed_maps(options.maps)
    known = clips_of(options.data, maps, options.denoiser)
    clips = _judged(known, classifier.card, options)
    score = judge(classifier, clips, known)
    subjects = list(dict.fromkeys(clip.subject for clip in clips))
    learnt = sorted(name for name in subjects if is_among(name, _seen(classifier.card)))
    data = {
        "model": str(options.classifier),
        "maps": list(known.kinds),
        "subjects": subjects,
        "learnt_from": learnt,
        **score.to_json(),
        **score.summary(),
    }
    if options.json:
        print_json(data)
    else:
        _say(score, known, subjects, learnt)
    if options.figure is not None:
        from sd2core.classify.confusion_figure import confusion_figure
        from sd2core.classify.metrics import shares

        figure = confusion_figure(
            [shares(score.frames), shares(score.gestures)],
            score.classes,
            ["frames", "gestures"],
            f"{options.classifier.stem} on {' and '.join(known.kinds)} maps",
        )
        save_figure(figure, options.figure)


def _judged(known: ClipSet, card: ClassifierCard, options: Evaluate) -> tuple[Clip, ...]:
    from sd2core.classify.data import seen_first
    from sd2core.pairs.summary import kept_out

    if options.subjects is not None:
        names = named_subjects(options.subjects, known.subjects)
    else:
        # Data of other people than the training's are judged whole.
        kept = card.about.get("split", {}).get("test") or ()
        names = kept_out(known.subjects, kept, _seen(card))
    missing = [name for name in names if name not in known.subjects]
    if missing:
        raise Sd2Error(
            f"There is nothing of {', '.join(missing)}", f"some of {', '.join(known.subjects)}"
        )
    clips = known.of(names)
    return clips if options.placements == "all" else tuple(filter(seen_first(clips), clips))


def _seen(card: ClassifierCard) -> list[str]:
    """People whom a classifier learnt from, or whose validation its best step was chosen by."""
    split, chosen = card.about.get("split", {}), "steps" in card.about.get("training", {})
    return [*split.get("training", ()), *(split.get("validation", ()) if chosen else ())]


def _say(score: Score, known: ClipSet, subjects: list[str], learnt: list[str]) -> None:
    from sd2core.classify.metrics import shares

    print(f"Evaluated on {' and '.join(known.kinds)} maps of {', '.join(subjects)}")
    if learnt:
        print(
            f"It was trained on, or chosen by, {', '.join(learnt)}: this does not show how it does"
            " for others."
        )
    for what, matrix in (("frames", score.frames), ("gestures", score.gestures)):
        rows = [(what, *(f"taken for {name}" for name in score.classes), "in all")]
        for name, row, counts in zip(score.classes, shares(matrix), matrix, strict=True):
            cells = ["–" if value != value else f"{100 * value:.1f} %" for value in row]
            rows.append((name, *cells, f"{counts.sum():,}"))
        print()
        print_rows(rows, right=range(1, len(score.classes) + 2))
    print(f"\nMean recall of frames {100 * score.mean_recall:.1f} %")
    if score.latency_s == score.latency_s:
        print(
            f"A gesture is recognised after {score.latency_s:.2f} s (median), {score.missed} never"
        )


@command("apply", Apply)
def _apply(options: Apply) -> None:
    """Find gestures in a recording or a map.

    Computes the probability of each class in every frame, and spans of the frames in
    which a gesture is the most probable class. The confidence of a span is the mean
    probability of its class. The map must be on the velocity axis that the classifier
    was trained on; another frame rate is resampled to the classifier's and back.

      sd2 classify apply walk.sd2
      sd2 classify apply walk.sd2 --of radar --model g.safetensors --out found.json
      sd2 classify apply map.npz --model g.safetensors --probabilities p.npz
    """
    import numpy as np

    from sd2core.classify.files import describe_classifier, load_classifier
    from sd2core.classify.spans import predicted_spans
    from sd2core.denoise.resample_to_model import check_bins
    from sd2core.files.atomic import atomic_write
    from sd2core.files.texts import errors_in

    if options.out is not None:
        check_label_output(options.out)
    card = describe_classifier(options.classifier)
    doppler, clock = map_and_clock(options, card.axis, card.trained_on)
    # Before torch is loaded, which takes seconds.
    with errors_in(options.map):
        check_bins(doppler, card)
    with progress_bar("Classifying") as progress:
        probabilities = load_classifier(options.classifier).probabilities(doppler, progress)
    spans = predicted_spans(
        probabilities, doppler.timebase, card.classes, options, present=doppler.present
    )
    lost = write_spans(options, spans, clock)
    if options.probabilities is not None:
        with atomic_write(options.probabilities) as stream:
            np.savez_compressed(
                stream,
                probabilities=probabilities,
                times_s=doppler.times_s,
                classes=np.array(card.classes),
            )
    if options.json:
        print_json(
            {
                "map_kind": doppler.kind,
                "model": str(options.classifier),
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
    print(f"{counted(len(spans), 'gesture')} in the {doppler.kind} map, by {options.classifier}")
    if spans:
        rows = [("id", "start s", "end s", "gesture", "confidence")]
        rows += [(*span_cells(span), span.label, f"{span.confidence:.2f}") for span in spans]
        print_rows(rows, right=(0, 1, 2, 4))
    for path in (options.out, options.probabilities):
        if path is not None:
            print(f"Wrote {path}")
    print_lost(lost)
