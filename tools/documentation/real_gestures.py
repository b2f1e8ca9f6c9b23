"""Makes ``real-gestures.md``: ``make real-gestures``, about twenty minutes.

Suggestions and classifiers on gestures that a real radar saw, on the same five splits of the
files. Trainings stay in ``build/real-gestures``.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.classify.data import ClipSet
from sd2core.classify.live import TrainedClassifier, judge
from sd2core.classify.metrics import Score, mean_recall
from sd2core.classify.spans import predicted_spans
from sd2core.classify.splitting import dealt
from sd2core.classify.training import TrainOptions, train
from sd2core.cli.classify.data import clips_of
from sd2core.datasets.labelled import unfolded
from sd2core.datasets.labelled_source import LabelledSource
from sd2core.io.radar.kkt import RecordedMap, load_kkt
from sd2core.labels.matching import match_spans
from sd2core.labels.suggest import suggest_spans
from sd2core.options.suggesting import PredictedSpans, SuggestOptions
from sd2core.study.plan import Learner
from tools.documentation.measured import BUILD, SHARED, spread_of, table, write_filled
from tools.documentation.runs import sd2

FOLDER = BUILD / "real-gestures"
DATA = [SHARED / "radar" / f"kkt_gestures{more}" for more in ("", "_more", "_study")]
SPLITS = 3
KERNEL = TrainOptions(model="kernel", delay_s=0.9)
KERNEL_NAME = "kernel, columns, after 0.9 s"
SPANS = PredictedSpans(min_duration_s=0.5, merge_gap_s=0.2)
IOUS = (0.3, 0.4, 0.5, 0.6, 0.7)
"""Options are chosen by the mean F1 over these: with few files F1 at one of them has steps."""
AT = IOUS.index(0.5)
GRID = [
    SuggestOptions(high_db=high, low_db=low, merge_gap_s=gap, margin_s=margin, hold_s=hold)
    for high, low, gap, margin, hold in product(
        (6.0, 7.0, 8.0, 9.0), (4.0, 5.0, 6.0), (0.1, 0.2), (0.1, 0.2, 0.3), (0.0, 0.1, 0.2, 0.3)
    )
]


@dataclass(frozen=True, eq=False)
class Counts:
    """Suggestions in every file against its labels."""

    labels: NDArray[np.int64]  # (files,)
    suggested: NDArray[np.int64]  # (files,)
    matched: NDArray[np.int64]  # (files, IoUs)

    @classmethod
    def of(cls, recorded: Sequence[RecordedMap], options: SuggestOptions) -> Counts:
        """Suggest spans in every file."""
        suggested, matched = [], []
        for one in recorded:
            spans = suggest_spans(one.doppler, options)
            suggested.append(len(spans))
            matched.append(
                [
                    len(match_spans(one.labels.spans, spans, one.timebase, min_iou=iou).matches)
                    for iou in IOUS
                ]
            )
        labels = [len(one.labels.spans) for one in recorded]
        return cls(np.array(labels), np.array(suggested), np.array(matched))

    def f1(self, files: NDArray[np.bool_]) -> NDArray[np.float64]:
        """F1 in these files at every IoU, (IoUs,)."""
        spans = self.labels[files].sum() + self.suggested[files].sum()
        return np.asarray(2.0 * self.matched[files].sum(axis=0) / spans)


def main() -> None:
    """Measure and write the page."""
    sources = [LabelledSource(folder) for folder in DATA]
    paths = [one.path for one in unfolded(sources)]
    recorded = [load_kkt(path) for path in paths]
    known = clips_of(sources, ("radar",))
    judged = []  # (splits, files)
    for number in range(SPLITS):
        part = {
            movement: own for (_, movement), own in dealt(known, known.clips, 2, number).items()
        }
        judged.append(np.array([part[path.stem] == 1 for path in paths]))
    usual = Counts.of(recorded, SuggestOptions())
    tried = [Counts.of(recorded, one) for one in GRID]
    best = [tried[int(np.argmax([one.f1(~files).mean() for one in tried]))] for files in judged]
    how = ("--seeds", SPLITS, "--shares", "100%")
    sd2("classify", "table", *DATA, "--out", FOLDER, *how)
    names = " ".join(folder.name for folder in DATA)
    study = json.loads((FOLDER / "study.json").read_text("utf-8"))
    networks, best_network, classes = _classified(study)
    write_filled(
        "real-gestures.md",
        files=len(paths),
        splits=SPLITS,
        now=table(_by_gesture(usual, recorded)),
        grid=len(GRID),
        chosen=spread_of([one.f1(files)[AT] for one, files in zip(best, judged, strict=True)], 2),
        default=spread_of([usual.f1(files)[AT] for files in judged], 2),
        command=f"sd2 classify table {names} --out tables {' '.join(map(str, how))}",
        networks=table(networks),
        best=best_network,
        classes=table(classes),
        kernel=KERNEL_NAME,
        shortest=SPANS.min_duration_s,
        gap=SPANS.merge_gap_s,
        spans=table(_found_by_kernel(known, paths, recorded)),
    )


def _found_by_kernel(
    known: ClipSet, paths: Sequence[Path], recorded: Sequence[RecordedMap]
) -> list[list[str]]:
    """Spans that a classifier finds in files that it did not learn from."""
    rows = [
        ["learnt from", "frames", "gestures", "labels", "suggested", "matched", "F1", "and named"]
    ]
    file_of = {path.stem: one for path, one in zip(paths, recorded, strict=True)}
    for words, parts in (("half", 2), ("four fifths", 5)):
        scores, counts = [], np.zeros(4, int)
        for repeated in range(SPLITS):
            part = dealt(known, known.clips, parts, repeated)
            folds = []
            for number in range(parts):
                kept = [clip for clip in known.clips if part[clip.key] != number]
                asked = [clip for clip in known.clips if part[clip.key] == number]
                made = train(kept, (), known, KERNEL).classifier
                folds.append(judge(made, asked, known))
                counts += sum(_spans(made, file_of[clip.movement]) for clip in asked)
            scores.append(sum(folds[1:], folds[0]))
        labels, suggested, matched, named = counts.tolist()
        rows.append(
            [
                words,
                spread_of([100.0 * one.mean_recall for one in scores], 1),
                spread_of([100.0 * mean_recall(one.gestures) for one in scores], 1),
                *(f"{count / SPLITS:.1f}" for count in (labels, suggested, matched)),
                f"{2 * matched / (labels + suggested):.2f}",
                f"{2 * named / (labels + suggested):.2f}",
            ]
        )
    return rows


def _spans(made: TrainedClassifier, file: RecordedMap) -> NDArray[np.int64]:
    """Labels, spans found, those that match, and those with the same gesture."""
    spans = predicted_spans(made.probabilities(file.doppler), file.timebase, made.classes, SPANS)
    matches = match_spans(file.labels.spans, spans, file.timebase).matches
    named = sum(match.a.label == match.b.label for match in matches)
    return np.array([len(file.labels.spans), len(spans), len(matches), named])


def _by_gesture(counted: Counts, recorded: Sequence[RecordedMap]) -> list[list[str]]:
    rows = [["gesture", "labels", "suggested", "matched", "F1"]]
    names = np.array([one.gesture for one in recorded])
    for name in (*np.unique(names), "all"):
        files = (names == name) | (name == "all")
        labels, suggested = counted.labels[files].sum(), counted.suggested[files].sum()
        f1 = f"{counted.f1(files)[AT]:.2f}" if labels else ""
        counts = (labels, suggested, counted.matched[files, AT].sum())
        rows.append([str(name), *(f"{count}" for count in counts), f1])
    return rows


def _classified(study: dict[str, Any]) -> tuple[list[list[str]], str, list[list[str]]]:
    """Table of the networks, name of the best, and its table of the classes."""
    networks = [["network", "frames", "gestures", "latency s"]]
    best, name_of_best = -1.0, ""
    scores_of_best: list[Score] = []
    first = Learner.model_validate(study["plan"]["classifiers"][0]).title
    for total in study["totals"]:
        name = first if total["title"] == "radar alone" else total["title"]
        scores = [Score.from_json(one) for one in total["seeds"]]
        frames = [100.0 * one.mean_recall for one in scores]
        gestures = [100.0 * mean_recall(one.gestures) for one in scores]
        latency = spread_of([one.latency_s for one in scores], 2)
        networks.append([name, spread_of(frames, 1), spread_of(gestures, 1), latency])
        if np.mean(frames) > best:
            best, name_of_best, scores_of_best = float(np.mean(frames)), name, scores
    classes = [[name] for name in ("class", *study["classes"], "all together")]
    for what in ("frames", "gestures"):
        counts = np.array([getattr(one, what) for one in scores_of_best])  # (splits, true, found)
        right, judged = np.diagonal(counts, axis1=1, axis2=2), counts.sum(axis=2)
        classes[0].append(what)
        for row, own, all_ in zip(classes[1:-1], right.T, judged.T, strict=True):
            row.append(spread_of(100.0 * own / all_, 1) if all_.all() else "")
        classes[-1].append(spread_of(100.0 * right.sum(axis=1) / judged.sum(axis=1), 1))
    return networks, name_of_best, classes


if __name__ == "__main__":
    main()
