"""Agreement of two people in words and numbers."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import median

from sd2app.agreement.model import AgreementModel
from sd2core.labels.agreement import kappa_words


def verdict(model: AgreementModel) -> str:
    """Return the kappa of all frames, and the customary word for it."""
    if model.found is None:
        return "Comparing…"
    kappa = model.found.frames.overall.value
    return f"Kappa {'–' if kappa is None else f'{kappa:.2f}'}: {kappa_words(kappa)}"


def facts(model: AgreementModel) -> list[tuple[str, str]]:
    """Return names and values of the measures of agreement."""
    found = model.found
    if found is None:
        return []
    frames, spans = found.frames, found.spans
    same = sum(match.same_label for match in spans.matches)
    rows = [
        ("Frames the same", _share(frames.overall.observed)),
        ("By chance alone", _share(frames.overall.expected)),
        ("Spans matched", str(len(spans.matches))),
        ("of these with the same label", str(same)),
        ("Only yours", str(len(spans.only_a))),
        (f"Only {model.name}'s", str(len(spans.only_b))),
    ]
    if spans.mean_iou is not None:
        rows.append(("Overlap of matches", _share(spans.mean_iou)))
        rows.append(
            (
                "Median difference of starts",
                _median([one.start_difference_s for one in spans.matches]),
            )
        )
        rows.append(
            ("Median difference of ends", _median([one.end_difference_s for one in spans.matches]))
        )
    if model.left_out:
        rows.append(("Left out, outside the recording", str(model.left_out)))
    return rows


def label_facts(model: AgreementModel) -> list[tuple[str, str]]:
    """Return every label that either used, with its kappa."""
    found = model.found
    if found is None:
        return []
    return [
        (label, "–" if kappa.value is None else f"{kappa.value:.2f}")
        for label, kappa in found.frames.of_label.items()
    ]


def where(model: AgreementModel) -> str:
    """Describe the disagreement at the present frame, or all of them."""
    stretches, number = model.disagreements, model.current
    if model.found is None:
        return "Comparing…"
    if not stretches:
        return "No frame is labelled differently."
    total_s = sum(one.end_s - one.start_s for one in stretches)
    if number is None:
        plural = "s" * (len(stretches) != 1)
        return f"{len(stretches)} disagreement{plural}, {total_s:.2f} s in all."
    one = stretches[number]
    return (
        f"{number + 1} of {len(stretches)}, {one.start_s:.2f} to {one.end_s:.2f} s.\n"
        f"You: {_said(one.a)}.\n{model.name}: {_said(one.b)}."
    )


def _said(answer: Sequence[str]) -> str:
    return " and ".join(answer) or "nothing"


def _share(value: float) -> str:
    return f"{100 * value:.1f} %"


def _median(differences_s: Sequence[float]) -> str:
    return f"{median(abs(value) for value in differences_s):.2f} s"
