"""Makes ``real-pairs.md``: ``python -m tools.documentation.real_pairs``, from MARS recordings.

Ways of `sd2 pairs mars` to turn the Kinect's skeleton into synthetic Doppler are compared by the
mean velocity per frame with that of the radar's points, before any denoising. Then the least
denoiser learns from the pairs: a linear map of five frames, of the whole body or of its parts. At
last, how far the radar's own points agree with one another, which no denoiser can exceed. The pairs
stay in ``build/real-pairs``; what is there is not made again.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from sd2core.denoise.card import DENOISER_PARTS
from sd2core.io.radar.mars import MarsStretch, mars_parts, read_mars
from sd2core.maps import mean_velocity_mps
from sd2core.mesh.vertex_parts import PARTS
from sd2core.pairs.store import PairSet, read_pairs
from sd2core.sensor import VelocityAxis
from tools.documentation.measured import BUILD, SHARED, table, write_filled
from tools.documentation.runs import sd2

Floats = NDArray[np.float64]

FOLDER = BUILD / "real-pairs"
RIDGE = 10.0
HALVINGS = 8
_POINT_ARRAYS = ("point_rows", "point_mps", "point_intensity")
MARS = [SHARED / "paired" / name for name in ("mars_subject1", "mars_subject4")]
WAYS = {
    "facing, count (default)": ("--limbs",),
    "--sensor 0,0,0": ("--sensor", "0,0,0"),
    "--visibility exact": ("--visibility", "exact"),
    "--weight area": ("--weight", "area"),
    "--null-bins 14,15,16": ("--null-bins", "14,15,16"),
}


def pairs_of(number: int) -> PairSet:
    """Pairs made in one of :data:`WAYS`, unless they are there."""
    path = FOLDER / f"mars-{number}.zarr"
    sd2("pairs", "mars", *MARS, *list(WAYS.values())[number], "--out", path)
    return read_pairs(path)


def mean_mps(maps: Iterable[NDArray[np.float32]]) -> Floats:
    """Mean velocity of every frame, one take after the other; an empty one is at rest."""
    return np.nan_to_num(mean_velocity_mps(np.concatenate(list(maps)), VelocityAxis()))


def agreement_cells(estimate: Floats, truth: Floats) -> list[str]:
    """Cells of a correlation, if anything moves, and of a mean absolute error."""
    alike = f"{np.corrcoef(estimate, truth)[0, 1]:.3f}" if estimate.any() else "–"
    return [alike, f"{np.abs(estimate - truth).mean():.3f}"]


def heading(pairs: PairSet) -> list[str]:
    """Of a table with the cells of each person."""
    each = ((f"person {subject}: corr.", "MAE m/s") for subject in pairs.subjects)
    return ["input", *chain.from_iterable(each)]


def inputs(default: PairSet) -> str:
    """Table of ways to make the input, beside the radar as by default."""
    rows = {name: [name] for name in ("nothing moves", *WAYS)}
    for number, name in enumerate(WAYS):
        made = pairs_of(number) if number else default
        for subject in default.subjects:
            radar = np.concatenate([take.radar for take in default.of([subject]).takes])
            seen = radar.sum(axis=1) > 0
            truth = mean_mps([radar[seen]])
            if not number:
                rows["nothing moves"] += agreement_cells(0.0 * truth, truth)
            estimate = mean_mps(take.synthetic for take in made.of([subject]).takes)[seen]
            rows[name] += agreement_cells(estimate, truth)
    return table([heading(default), *rows.values()])


def features(values: NDArray[np.float32]) -> Floats:
    """Square roots of the shares in a frame and two on each side, (frames, 5 bins)."""
    shares = np.sqrt(values / np.maximum(values.sum(axis=1, keepdims=True), 1e-9))
    padded = np.pad(shares, ((2, 2), (0, 0)), mode="edge")
    return np.hstack([padded[shift : shift + len(shares)] for shift in range(5)])


def examples(pairs: PairSet, parts: tuple[str, ...]) -> tuple[Floats, ...]:
    """Features, mean velocity of the radar and of the input, in frames with points."""
    seen = [take.radar.sum(axis=1) > 0 for take in pairs.takes]
    each = list(zip(pairs.takes, seen, strict=True))
    return (
        np.concatenate([features(take.inputs(parts))[rows] for take, rows in each]),
        mean_mps(take.radar[rows] for take, rows in each),
        mean_mps(take.synthetic[rows] for take, rows in each),
    )


def ridge_map(x: Floats, y: Floats, unseen: Floats) -> Floats:
    """Answers to unseen features by a linear map learnt from ``x`` and ``y``."""
    centred = x - (middle := x.mean(axis=0))
    slope = np.linalg.solve(
        centred.T @ centred + RIDGE * np.eye(x.shape[1]), centred.T @ (y - y.mean())
    )
    return (unseen - middle) @ slope + y.mean()


def linear(pairs: PairSet) -> str:
    """Table of what a linear map makes of the pairs."""
    ways: dict[str, tuple[str, ...]] = {
        "map": (),
        "limbs, sides together": DENOISER_PARTS,
        "limbs, sides apart": PARTS,
    }
    none, alone = "no denoising", "limbs, own other minutes"
    rows = {name: [name] for name in (none, *ways, alone)}
    for test in pairs.subjects:
        own, others = pairs.of([test]), [name for name in pairs.subjects if name != test]
        for name, parts in ways.items():
            x, y, _ = examples(pairs.of(others), parts)
            unseen, truth, before = examples(own, parts)
            if not parts:
                rows[none] += agreement_cells(before, truth)
            rows[name] += agreement_cells(ridge_map(x, y, unseen), truth)
        rows[alone] += agreement_cells(*own_minutes(own))
    return table([heading(pairs), *rows.values()])


def own_minutes(pairs: PairSet) -> tuple[Floats, Floats]:
    """Answers to a quarter of a person's takes by the other three, and the truth."""
    answers, truth = [], []
    for fold in range(4):
        unseen = pairs.takes[fold::4]
        rest = tuple(take for number, take in enumerate(pairs.takes) if number % 4 != fold)
        x, y, _ = examples(replace(pairs, takes=rest), DENOISER_PARTS)
        asked, wanted, _ = examples(replace(pairs, takes=unseen), DENOISER_PARTS)
        answers.append(ridge_map(x, y, asked))
        truth.append(wanted)
    return np.concatenate(answers), np.concatenate(truth)


def halves_mps(stretch: MarsStretch, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Mean velocity of either half of every frame's points, in frames where both have some."""
    second = rng.integers(0, 2, len(stretch.point_rows)) > 0
    means = []
    for half in (~second, second):
        points = {name: getattr(stretch, name)[half] for name in _POINT_ARRAYS}
        with np.errstate(invalid="ignore"):  # NaN where a half has no point
            means.append(replace(stretch, **points).mean_velocity_mps())
    both = np.isfinite(means[0]) & np.isfinite(means[1])
    return means[0][both], means[1][both]


def agreement(stretches: Iterable[MarsStretch]) -> tuple[float, float, float]:
    """Correlation of halves, that of all points with as many others, and the most possible.

    The second is by C. Spearman's and W. Brown's formula (British Journal of Psychology 3, 1910),
    the third its root: the correlation of what all points have in common with their mean.
    """
    rng = np.random.default_rng(0)
    drawn = [halves_mps(one, rng) for one in stretches for _ in range(HALVINGS)]
    first, second = map(np.concatenate, zip(*drawn, strict=True))
    halves = np.corrcoef(first, second)[0, 1]
    whole = 2.0 * halves / (1.0 + halves)
    return float(halves), float(whole), float(np.sqrt(max(whole, 0.0)))


def ceiling() -> str:
    """Table of how far the radar's points of a frame agree, person by person."""
    rows = [["person", "takes", "halves", "all points", "at most", "at most, takes"]]
    for folder in MARS:
        parts = [read_mars(folder, name) for name in mars_parts(folder)]
        every = [stretch for part in parts for stretch in part.stretches]
        of_takes = sorted(agreement([one])[2] for one in every)
        values = (f"{value:.2f}" for value in agreement(every))
        takes = f"{of_takes[0]:.2f} to {of_takes[-1]:.2f}"
        rows.append([parts[0].subject, str(len(every)), *values, takes])
    return table(rows)


def main() -> None:
    """Make the pairs that are missing, measure and write the page."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    pairs = pairs_of(0)
    write_filled("real-pairs.md", inputs=inputs(pairs), linear=linear(pairs), ceiling=ceiling())


if __name__ == "__main__":
    main()
