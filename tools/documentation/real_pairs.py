"""Makes ``real-pairs.md``: ``python -m tools.documentation.real_pairs``, from MARS recordings.

Ways to turn the Kinect's skeleton into synthetic Doppler are compared by the mean velocity per
frame with that of the radar's points, before any denoising. Then the least denoiser learns from the
pairs: a linear map of five frames, of the whole body or of its parts. At last, how far the radar's
own points agree with one another, which no denoiser can exceed. The pairs stay in
``build/real-pairs``; what is there is not made again.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sd2core import MeshSequence, Synthesizer, Timebase, VirtualSensor
from sd2core.denoise.card import DENOISER_PARTS
from sd2core.io.radar.mars import MarsPart, MarsStretch, mars_parts, read_mars
from sd2core.mesh.vertex_parts import PARTS
from sd2core.mocap.driving import KINECT_MARKERS, DrivenClip, puppet_of
from sd2core.mocap.mars_pairs import (
    MarsChoices,
    body_doppler,
    radar_doppler,
    seen_of,
    skeleton_clip,
)
from sd2core.mocap.radar_place import RadarPlace, estimate_place
from sd2core.pairs.store import PairSet, read_pairs
from tools.documentation.measured import BUILD, SHARED, table, write_filled
from tools.documentation.runs import sd2

Maps = list[NDArray[np.float32]]
Floats = NDArray[np.float64]
Parts = list[MarsPart]
"""Recordings of one person."""

FOLDER = BUILD / "real-pairs"
DEFAULT = MarsChoices()
RIDGE = 10.0
HALVINGS = 8
_POINT_ARRAYS = ("point_rows", "point_mps", "point_intensity")
MARS = [SHARED / "paired" / name for name in ("mars_subject1", "mars_subject4")]


def changed(**options: object) -> MarsChoices:
    """The default with other options of synthesis."""
    return replace(DEFAULT, synthesis=replace(DEFAULT.synthesis, **options))


WAYS = {
    "body, facing, count (default)": DEFAULT,
    "body, exact, count": changed(visibility="exact"),
    "body, facing, area": changed(weight="area"),
    "body, 5,000 vertices": replace(DEFAULT, resolution="medium"),
    "body, bins 14–16 nulled": changed(null_bins=(14, 15, 16)),
}


def cloud_maps(part: MarsPart) -> Maps:
    """Synthetic Doppler of the joints as a cloud of points."""
    options, maps = replace(DEFAULT.synthesis, visibility="none"), []
    for clip in map(skeleton_clip, part.stretches):
        joints_m = clip.joints_m.astype(np.float32)
        cloud = MeshSequence(joints_m, None, Timebase(clip.times_s), "joints of a skeleton")
        maps.append(Synthesizer(cloud, options).map(VirtualSensor()).values.T)
    return maps


def body_maps(driven: list[DrivenClip], choices: MarsChoices, place: RadarPlace) -> Maps:
    """Synthetic Doppler of a body."""
    return [body_doppler(clip, choices, place).values.T for clip in driven]


def mean_mps(maps: Iterable[NDArray[np.float32]]) -> Floats:
    """Mean velocity of every frame, one stretch after the other; an empty one is at rest."""
    values = np.concatenate(list(maps)).astype(np.float64)
    total = values.sum(axis=1)
    moment = values @ DEFAULT.synthesis.axis.centres_mps
    return np.divide(moment, total, out=np.zeros(len(total)), where=total > 0)


def errors(maps: Maps, radar: Maps) -> list[str]:
    """Cells on the mean velocities of an input: their correlation with the radar's, their MAE."""
    seen = np.concatenate(radar).sum(axis=1) > 0
    estimate, truth = mean_mps(maps)[seen], mean_mps(radar)[seen]
    return agreement_cells(estimate, truth)


def agreement_cells(estimate: Floats, truth: Floats) -> list[str]:
    """Cells of a correlation, if anything moves, and of a mean absolute error."""
    alike = f"{np.corrcoef(estimate, truth)[0, 1]:.3f}" if estimate.any() else "–"
    return [alike, f"{np.abs(estimate - truth).mean():.3f}"]


def drive(part: MarsPart) -> list[DrivenClip]:
    """One part's body in the poses of all its stretches."""
    clips = [skeleton_clip(stretch) for stretch in part.stretches]
    puppet = puppet_of(clips, KINECT_MARKERS)
    return [puppet.pose(clip) for clip in clips]


def inputs(people: Sequence[Parts]) -> tuple[str, str]:
    """Table of ways to make the input, and where the radar stands."""
    nothing, joints, at_kinect = (
        "nothing moves",
        "25 joints, from the Kinect",
        "body, from the Kinect",
    )
    rows = {name: [name] for name in (nothing, joints, at_kinect, *WAYS)}
    head, notes = ["input"], []
    for parts in people:
        driven = [drive(part) for part in parts]
        each = [
            [seen_of(*one) for one in zip(clips, part.stretches, strict=True)]
            for clips, part in zip(driven, parts, strict=True)
        ]
        place = estimate_place([one for part in each for one in part])
        alone = [place_words(estimate_place(seen)) for seen in each] if len(each) > 1 else []
        notes.append(
            f"- person {parts[0].subject}: {place_words(place)}"
            + "".join(f"; by one part alone {words}" for words in alone)
        )
        for part, clips in zip(parts, driven, strict=True):
            head += [f"{part.subject}-{part.name}: corr.", "MAE m/s"]
            radar = [radar_doppler(stretch, DEFAULT.synthesis.axis) for stretch in part.stretches]
            rows[nothing] += errors([0.0 * values for values in radar], radar)
            rows[joints] += errors(cloud_maps(part), radar)
            rows[at_kinect] += errors(body_maps(clips, DEFAULT, RadarPlace()), radar)
            for name, choices in WAYS.items():
                rows[name] += errors(body_maps(clips, choices, place), radar)
    return table([head, *rows.values()]), "\n".join(notes)


def place_words(place: RadarPlace) -> str:
    """Place and clock of a radar that was found."""
    right, down, _ = place.position_m
    return f"{right:+.2f} m right, {down:+.2f} m below, clock {1e3 * place.offset_s:+.0f} ms"


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
    head = [f"person {test}: corr." for test in pairs.subjects]
    columns = (cell for one in head for cell in (one, "MAE m/s"))
    return table([["input", *columns], *rows.values()])


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


def ceiling(people: Sequence[Parts]) -> str:
    """Table of how far the radar's points of a frame agree, person by person."""
    rows = [["person", "takes", "halves", "all points", "at most", "at most, takes"]]
    for parts in people:
        every = [stretch for part in parts for stretch in part.stretches]
        of_takes = sorted(agreement([one])[2] for one in every)
        values = (f"{value:.2f}" for value in agreement(every))
        takes = f"{of_takes[0]:.2f} to {of_takes[-1]:.2f}"
        rows.append([parts[0].subject, str(len(every)), *values, takes])
    return table(rows)


def main() -> None:
    """Make the pairs if they are missing, measure and write the page."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    pairs = FOLDER / "mars.zarr"
    sd2("pairs", "mars", *MARS, "--limbs", "--out", pairs)
    people = [[read_mars(folder, name) for name in mars_parts(folder)] for folder in MARS]
    of_inputs, places = inputs(people)
    write_filled(
        "real-pairs.md",
        inputs=of_inputs,
        places=places,
        linear=linear(read_pairs(pairs)),
        ceiling=ceiling(people),
    )


if __name__ == "__main__":
    main()
