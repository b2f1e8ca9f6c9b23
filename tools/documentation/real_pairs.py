"""Print the tables of docs/real-pairs.md.

::

    python -m tools.documentation.real_pairs inputs FOLDER...
    python -m tools.documentation.real_pairs linear PAIRS
    python -m tools.documentation.real_pairs ceiling FOLDER...

The first compares ways to turn the Kinect's skeleton into synthetic Doppler: its mean
velocity per frame with that of the radar's points, before any denoising. The second
shows what the least denoiser makes of the pairs (made with ``--limbs``): a linear map of
five frames, of the whole body or of its parts. The third shows how far the radar's own
points agree with one another, which no denoiser can exceed.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sd2core.denoise.card import DENOISER_PARTS
from sd2core.doppler import Synthesizer
from sd2core.io.radar.mars import MarsPart, MarsStretch, mars_parts, read_mars
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.vertex_parts import PARTS
from sd2core.mocap.driving import KINECT_MARKERS, DrivenClip, SkeletonClip, puppet_of
from sd2core.mocap.mars_pairs import (
    AT_THE_CAMERA,
    MarsChoices,
    body_doppler,
    radar_doppler,
    seen_of,
    skeleton_clip,
)
from sd2core.mocap.radar_place import RadarPlace, estimate_place
from sd2core.pairs.store import PairSet, read_pairs
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase

Maps = list[NDArray[np.float32]]

DEFAULT = MarsChoices()
RIDGES = (10.0, 100.0)
HALVINGS = 8
_POINT_ARRAYS = ("point_rows", "point_mps", "point_intensity")
Answers = tuple[NDArray[np.float64], NDArray[np.float64], float]


def skeleton_cloud(clip: SkeletonClip) -> MeshSequence:
    """The joints alone, as a cloud of points."""
    return MeshSequence(
        clip.joints_m.astype(np.float32), None, Timebase(clip.times_s), "joints of a skeleton"
    )


def changed(**options: object) -> MarsChoices:
    """The default with other options of synthesis."""
    return replace(DEFAULT, synthesis=replace(DEFAULT.synthesis, **options))  # type: ignore[arg-type]


WAYS = {
    "body, facing, count (default)": DEFAULT,
    "body, parts alike": replace(DEFAULT, limbs=True),
    "body, all vertices, count": changed(visibility="none"),
    "body, exact, count": changed(visibility="exact"),
    "body, facing, area": changed(weight="area"),
    "body, facing, projected area": changed(weight="projected"),
    "body, 5,000 vertices, facing, count": replace(DEFAULT, resolution="medium"),
    "body, posed at 30 Hz, facing, count": replace(DEFAULT, moments=3),
    "body, facing, count, bins 14–16 nulled": changed(null_bins=(14, 15, 16)),
}


def cloud_maps(part: MarsPart) -> Maps:
    """Synthetic Doppler of the joints as a cloud of points."""
    options = replace(DEFAULT.synthesis, visibility="none")
    return [
        Synthesizer(skeleton_cloud(skeleton_clip(stretch)), options).map(VirtualSensor()).values.T
        for stretch in part.stretches
    ]


def body_maps(driven: list[DrivenClip], choices: MarsChoices, place: RadarPlace) -> Maps:
    """Synthetic Doppler of a body; with limbs the mean of its parts, each adding up to 1."""
    maps = []
    for one in (body_doppler(clip, choices, place) for clip in driven):
        if one.limbs is None:
            maps.append(one.values.T)
        else:
            total = one.limbs.values.sum(axis=1, keepdims=True)
            maps.append((one.limbs.values / np.maximum(total, 1e-9)).mean(axis=0).T)
    return maps


def mean_mps(maps: Iterable[NDArray[np.float32]]) -> NDArray[np.float64]:
    """Mean velocity of every frame, one stretch after the other; an empty one is at rest."""
    values = np.concatenate(list(maps)).astype(np.float64)
    total = values.sum(axis=1)
    moment = values @ DEFAULT.synthesis.axis.centres_mps
    return np.divide(moment, total, out=np.zeros(len(total)), where=total > 0)


def row(part: MarsPart, name: str, maps: Maps, radar: Maps) -> str:
    """One line of the table."""
    seen = np.concatenate(radar).sum(axis=1) > 0
    found, truth = mean_mps(maps)[seen], mean_mps(radar)[seen]
    correlation = np.corrcoef(found, truth)[0, 1] if found.any() else np.nan
    gain = (found * truth).sum() / max((found**2).sum(), 1e-12)
    return (
        f"| {part.subject}-{part.name} | {name} | {correlation:.3f}"
        f" | {np.abs(found - truth).mean():.3f} | {np.abs(gain * found - truth).mean():.3f} |"
    )


def residuals(driven: list[DrivenClip]) -> str:
    """Sentence on the distance of the body's joints from the skeleton's."""
    values = np.concatenate([clip.residual_m.ravel() for clip in driven]) * 100.0
    values = values[np.isfinite(values)]
    stature = driven[0].puppet.shape.stature_m
    return (
        f"a body of {stature:.2f} m, joints {values.mean():.1f} cm from the skeleton's in the"
        f" mean, 95 % within {np.percentile(values, 95):.1f} cm"
    )


def drive(part: MarsPart) -> list[DrivenClip]:
    """One part's body in the poses of all its stretches."""
    clips = [skeleton_clip(stretch) for stretch in part.stretches]
    puppet = puppet_of(clips, KINECT_MARKERS)
    return [puppet.pose(clip) for clip in clips]


def inputs(folders: list[Path]) -> None:
    """Print the first table, then where the radar stands and how well the bodies fit."""
    print("| part | input | correlation | MAE, m/s | MAE after one gain, m/s |")
    print("|---|---|---|---|---|")
    notes = []
    for folder in folders:
        parts = [read_mars(folder, name) for name in mars_parts(folder)]
        driven = [drive(part) for part in parts]
        each = [
            [seen_of(*one) for one in zip(clips, part.stretches, strict=True)]
            for clips, part in zip(driven, parts, strict=True)
        ]
        place = estimate_place([one for part in each for one in part])
        notes.append(f"person {parts[0].subject}, all parts: {place_words(place)}")
        for part, clips, seen in zip(parts, driven, each, strict=True):
            axis = DEFAULT.synthesis.axis
            radar = [radar_doppler(stretch, axis) for stretch in part.stretches]
            print(row(part, "nothing moves", [0.0 * values for values in radar], radar))
            print(row(part, "25 joints, from the Kinect", cloud_maps(part), radar), flush=True)
            at_kinect = body_maps(clips, DEFAULT, AT_THE_CAMERA)
            print(row(part, "body, facing, count, from the Kinect", at_kinect, radar), flush=True)
            for name, choices in WAYS.items():
                print(row(part, name, body_maps(clips, choices, place), radar), flush=True)
            empty = 1.0 - float((np.concatenate(radar).sum(axis=1) > 0).mean())
            notes.append(
                f"{part.subject}-{part.name}: {residuals(clips)}; {empty:.1%} of the frames"
                f" without points; by this part alone {place_words(estimate_place(seen))}"
            )
    print("\n" + "\n".join(f"- {note}" for note in notes))


def place_words(place: RadarPlace) -> str:
    """Place and clock of a radar that was found."""
    right, down, _ = place.position_m
    return (
        f"the radar {right:+.2f} m right and {down:+.2f} m below the Kinect, its clock"
        f" {1e3 * place.offset_s:+.0f} ms"
    )


def features(values: NDArray[np.float32]) -> NDArray[np.float64]:
    """Square roots of the shares in a frame and two on each side, (frames, 5 bins)."""
    shares = np.sqrt(values / np.maximum(values.sum(axis=1, keepdims=True), 1e-9))
    padded = np.pad(shares, ((2, 2), (0, 0)), mode="edge")
    return np.hstack([padded[shift : shift + len(shares)] for shift in range(5)])


def examples(pairs: PairSet, parts: tuple[str, ...]) -> tuple[NDArray[np.float64], ...]:
    """Features, mean velocity of the radar and of the input, in frames with points."""
    seen = [take.radar.sum(axis=1) > 0 for take in pairs.takes]
    each = list(zip(pairs.takes, seen, strict=True))
    return (
        np.concatenate([features(take.inputs(parts))[rows] for take, rows in each]),
        mean_mps(take.radar[rows] for take, rows in each),
        mean_mps(take.synthetic[rows] for take, rows in each),
    )


def ridge_map(
    x: NDArray[np.float64], y: NDArray[np.float64], unseen: NDArray[np.float64], ridge: float
) -> NDArray[np.float64]:
    """Answers to unseen features by a linear map learnt from ``x`` and ``y``."""
    centred = x - (middle := x.mean(axis=0))
    slope = np.linalg.solve(
        centred.T @ centred + ridge * np.eye(x.shape[1]), centred.T @ (y - y.mean())
    )
    return (unseen - middle) @ slope + y.mean()


def judged(person: str, learnt: str, name: str, ridge: float, answers: Answers) -> str:
    """One line of the second table."""
    after, truth, plain = answers
    error = np.abs(after - truth).mean()
    alike = np.corrcoef(after, truth)[0, 1]
    return (
        f"| {person} | {learnt} | {name} | {ridge:g} | {error:.3f} | {error / plain - 1:+.0%} |"
        f" {alike:.3f} |"
    )


def linear(path: Path) -> None:
    """Print the second table."""
    pairs = read_pairs(path)
    ways: dict[str, tuple[str, ...]] = {
        "map": (),
        "limbs, sides together": DENOISER_PARTS,
        "limbs, sides apart": PARTS,
    }
    print("| person | learnt from | input | ridge | MAE, m/s | to no denoising | correlation |")
    print("|---|---|---|---|---|---|---|")
    for test in pairs.subjects:
        own, others = pairs.of([test]), [name for name in pairs.subjects if name != test]
        for name, parts in ways.items():
            x, y, _ = examples(pairs.of(others), parts)
            unseen, truth, before = examples(own, parts)
            plain = np.abs(before - truth).mean()
            if not parts:
                alike = np.corrcoef(before, truth)[0, 1]
                print(f"| {test} | | no denoising | | {plain:.3f} | | {alike:.3f} |")
            for ridge in RIDGES:
                after = ridge_map(x, y, unseen, ridge)
                print(judged(test, "the other", name, ridge, (after, truth, plain)))
        after, truth = own_minutes(own)
        print(
            judged(test, "own other minutes", "limbs, sides together", 10.0, (after, truth, plain))
        )


def own_minutes(pairs: PairSet) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Answers to a quarter of a person's takes by the other three, and the truth."""
    found, truth = [], []
    for fold in range(4):
        unseen = pairs.takes[fold::4]
        rest = tuple(take for number, take in enumerate(pairs.takes) if number % 4 != fold)
        x, y, _ = examples(replace(pairs, takes=rest), DENOISER_PARTS)
        asked, wanted, _ = examples(replace(pairs, takes=unseen), DENOISER_PARTS)
        found.append(ridge_map(x, y, asked, 10.0))
        truth.append(wanted)
    return np.concatenate(found), np.concatenate(truth)


def halves_mps(
    stretch: MarsStretch, rng: np.random.Generator
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
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
    halves = np.corrcoef(*map(np.concatenate, zip(*drawn, strict=True)))[0, 1]
    whole = 2.0 * halves / (1.0 + halves)
    return float(halves), float(whole), float(np.sqrt(max(whole, 0.0)))


def ceiling(folders: list[Path]) -> None:
    """Print how far the radar's points of a frame agree, person by person and take by take."""
    print("| person | takes | halves | all points | at most |")
    print("|---|---|---|---|---|")
    for folder in folders:
        parts = [read_mars(folder, name) for name in mars_parts(folder)]
        every = [stretch for part in parts for stretch in part.stretches]
        of_takes = sorted(agreement([one])[2] for one in every)
        values = " | ".join(f"{value:.2f}" for value in agreement(every))
        print(
            f"| {parts[0].subject} | {len(every)} | {values}"
            f" (takes: {of_takes[0]:.2f} to {of_takes[-1]:.2f}) |"
        )


def main() -> None:
    """Print one of the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    tables = parser.add_subparsers(dest="table", metavar="TABLE", required=True)
    tables.add_parser("inputs").add_argument("paths", type=Path, nargs="+", metavar="FOLDER")
    tables.add_parser("linear").add_argument("paths", type=Path, nargs=1, metavar="PAIRS")
    tables.add_parser("ceiling").add_argument("paths", type=Path, nargs="+", metavar="FOLDER")
    options = parser.parse_args()
    if options.table == "linear":
        linear(options.paths[0])
    else:
        {"inputs": inputs, "ceiling": ceiling}[options.table](options.paths)


if __name__ == "__main__":
    main()
