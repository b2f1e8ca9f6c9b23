"""Training data of classifiers: maps with a class per frame, a subject and a kind."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.denoise import resample_to_model as matching
from sd2core.denoise.live import TrainedDenoiser
from sd2core.errors import Sd2Error
from sd2core.labels.label_set import GESTURES, LabelSet
from sd2core.labels.per_frame import BACKGROUND
from sd2core.labels.spans import Labels
from sd2core.maps import DopplerMap, MapKind
from sd2core.pairs.rows import UNKNOWN as UNKNOWN
from sd2core.pairs.store import PairSet
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase, frames_that_begin
from sd2core.train.evaluation import check_fits

BELOW_LOUDEST_DB = (20.0, 45.0)
"""Mean power of the noise in a bin, under that of the clip's loudest cell.

A K60168A's recordings of gestures have it at 23 to 27 dB, a simulated radar by its link
budget at 36 dB (a person at 2.2 m), and synthetic maps and a campaign's targets have none.
"""
_MOST_CLASSES = np.iinfo(np.int8).max
_MAX_LOOKS = 8.0
"""Noise of one look is exponential; of several, whose powers are averaged, less uneven."""


@dataclass(frozen=True, eq=False)
class Clip:
    """Uninterrupted part of a map with the class of every frame."""

    subject: str
    movement: str  # the same for all maps of one movement: kinds, and places of the sensor
    kind: MapKind
    energies: NDArray[np.float32]  # (frames, bins)
    label: NDArray[np.int8]  # index into the classes, or UNKNOWN; shape (frames,)
    placement: int = 0  # 0 for the movement's own sensor; 1 and up are others (range synthesis)

    def __post_init__(self) -> None:
        if self.energies.ndim != 2 or len(self.energies) != len(self.label):
            raise Sd2Error(
                f"{self.title}: the map is of shape {self.energies.shape}, with"
                f" {len(self.label)} labels",
                "(frames, bins), and a label for every frame",
            )

    def __len__(self) -> int:
        return len(self.label)

    @property
    def key(self) -> tuple[str, str]:
        """Subject and movement, which training and test must not share."""
        return self.subject, self.movement

    @property
    def title(self) -> str:
        """Name for messages."""
        return f"{self.subject}/{self.movement}"

    def until(self, frames: int) -> Clip:
        """Return the first frames of the clip."""
        return replace(self, energies=self.energies[:frames], label=self.label[:frames])


@dataclass(frozen=True, eq=False)
class ClipSet:
    """Clips that share an axis, a frame rate and classes."""

    axis: VelocityAxis
    null_bins: tuple[int, ...]
    frame_rate_hz: float
    classes: tuple[str, ...]  # the background first, where there is one
    clips: tuple[Clip, ...]
    provenance: dict[str, Any] = field(default_factory=dict)
    """Origin of the clips; fits into JSON."""

    @property
    def subjects(self) -> tuple[str, ...]:
        """Subjects in the order of their first clips."""
        return tuple(dict.fromkeys(clip.subject for clip in self.clips))

    @property
    def kinds(self) -> tuple[MapKind, ...]:
        """Kinds of maps in the order of their first clips."""
        return tuple(dict.fromkeys(clip.kind for clip in self.clips))

    def of(self, subjects: Iterable[str]) -> tuple[Clip, ...]:
        """Return the clips of these subjects."""
        wanted = set(subjects)
        return tuple(clip for clip in self.clips if clip.subject in wanted)


def seen_first(clips: Iterable[Clip]) -> Callable[[Clip], bool]:
    """Return a test for clips from the first placement of their movement."""
    first: dict[tuple[str, str], int] = {}
    for clip in clips:
        first[clip.key] = min(clip.placement, first.get(clip.key, clip.placement))
    return lambda clip: clip.placement == first[clip.key]


def frame_counts(clips: Iterable[Clip], classes: int) -> NDArray[np.int64]:
    """Count the frames of each class, (classes,)."""
    counts = np.zeros(classes, np.int64)
    for clip in clips:
        counts += np.bincount(clip.label[clip.label >= 0], minlength=classes)
    return counts


def gesture_classes(labels: Sequence[str]) -> tuple[str, ...]:
    """Return the class of every label: swipes by direction, others by name.

    Background, however it is written, is the background.
    """
    return tuple(_class_of(label, GESTURES) for label in labels)


def clips_of_pairs(
    pairs: PairSet,
    kind: MapKind,
    denoiser: TrainedDenoiser | None = None,
    names: Sequence[str] | None = None,
) -> ClipSet:
    """Return the clips of one kind of maps in a store of pairs.

    Parameters
    ----------
    pairs : PairSet
        Its radar is simulated or real.
    kind : {"synthetic", "denoised", "simulated", "real"}
        Of the radar's maps that which the pairs say.
    denoiser : TrainedDenoiser, optional
        Needed for denoised maps, of the axis, null bins and frame rate of the pairs.
    names : sequence of str, optional
        Class of every label of the pairs; by default :func:`gesture_classes`.

    Raises
    ------
    Sd2Error
        If the radar is of another kind, or the denoiser is missing or does not fit.
    """
    if kind in ("simulated", "real") and kind != pairs.kind:
        raise Sd2Error(f"The pairs hold a {pairs.kind} radar", f"a {kind} one")
    if kind == "denoised":
        if denoiser is None:
            raise Sd2Error("No denoiser is given", "one, for denoised maps")
        check_fits(denoiser.card, pairs, "Choose a denoiser that learnt from pairs like these")
    names = gesture_classes(pairs.labels) if names is None else names
    classes = in_order(names)
    clips = []
    for take in pairs.takes:
        if denoiser is not None and kind == "denoised":
            energies = denoiser.denoise_values(take.inputs(denoiser.card.parts))
        else:
            energies = take.synthetic if kind == "synthetic" else take.radar
        label = _renumbered(take.label, names, classes)
        clips.append(Clip(take.subject, take.name, kind, energies, label, take.placement))
    return ClipSet(
        pairs.axis,
        pairs.null_bins,
        pairs.frame_rate_hz,
        classes,
        tuple(clips),
        {"pairs": pairs.provenance, "kind": kind},
    )


def clips_of_map(
    doppler: DopplerMap,
    labels: Labels,
    *,
    subject: str,
    movement: str,
    frame_rate_hz: float | None = None,
) -> ClipSet:
    """Return the clips of one labelled map, such as a recording's or a radar file's.

    A frame has the class of the label in which it begins (``gesture_class`` of the label
    set); frames without a label are background. Labels without a class, and frames on
    which two labels of different classes stand, are unknown: neither learnt from nor
    judged. Gaps and stretches without a person part a map into several clips.

    Parameters
    ----------
    doppler : DopplerMap
        On the clock of the labels.
    labels : Labels
        Suggestions do not count.
    frame_rate_hz : float, optional
        Brought to that rate where it is another; its own by default.
    """
    own_hz = doppler.timebase.frames_per_s
    rate_hz = frame_rate_hz or own_hz
    if not matching.can_resample(own_hz, rate_hz):
        raise Sd2Error(
            f"{subject}/{movement}: the {doppler.kind} map has {own_hz:.4g} frames/s",
            f"{rate_hz:.4g} as the other maps, or up to {matching.MAX_RESAMPLED:g} times more or"
            " less",
        )
    label, classes = frame_labels(doppler.timebase, labels)
    clips = []
    for start, stop in matching.stretches(doppler, rate_hz):
        part, times_s = doppler.between(start, stop), doppler.times_s[start:stop]
        even = matching.evenly(part, rate_hz)
        nearest = np.searchsorted((times_s[1:] + times_s[:-1]) / 2.0, even.times_s)
        own = label[start:stop][nearest]
        clips.append(Clip(subject, movement, doppler.kind, np.array(even.values.T), own))
    return ClipSet(
        doppler.axis,
        doppler.null_bins,
        rate_hz,
        classes,
        tuple(clips),
        {"movement": movement, "subject": subject, "kind": doppler.kind},
    )


def frame_labels(timebase: Timebase, labels: Labels) -> tuple[NDArray[np.int8], tuple[str, ...]]:
    """Return the class of every frame, and the classes; see :func:`clips_of_map`."""
    spans = labels.decided
    names = {span.label: _class_of(span.label, labels.label_set) for span in spans}
    classes = in_order([BACKGROUND, *(name for name in names.values() if name)])
    label = np.zeros(len(timebase), np.int8)
    taken = np.zeros(len(timebase), bool)
    for span in spans:
        name = names[span.label]
        number = classes.index(name) if name else UNKNOWN
        frames = frames_that_begin(timebase.times_s, span.start_s, span.end_s)
        clash = taken[frames] & (label[frames] != number)
        label[frames] = np.where(clash, UNKNOWN, number)
        taken[frames] = True
    return label, classes


def merged(sets: Sequence[ClipSet]) -> ClipSet:
    """Merge several sets; a bin that is zero in one of them is nulled in all."""
    if not sets:
        raise Sd2Error("Nothing to learn from is given", "pairs, recordings or radar files")
    first = sets[0]
    for other in sets[1:]:
        if other.axis != first.axis:
            raise Sd2Error(
                f"The data cannot be mixed: {first.axis.words} and {other.axis.words}",
                "the same velocity axis",
            )
        if abs(other.frame_rate_hz / first.frame_rate_hz - 1.0) > matching.SAME_RATE:
            raise Sd2Error(
                f"The data cannot be mixed: {first.frame_rate_hz:.4g} and"
                f" {other.frame_rate_hz:.4g} frames/s",
                "the same frame rate",
            )
    classes = in_order([name for one in sets for name in one.classes])
    clips = tuple(
        replace(clip, label=_renumbered(clip.label, one.classes, classes))
        for one in sets
        for clip in one.clips
    )
    provenance = first.provenance if len(sets) == 1 else {"mixed": [s.provenance for s in sets]}
    emptied = tuple(sorted({number for one in sets for number in one.null_bins}))
    return replace(first, null_bins=emptied, classes=classes, clips=clips, provenance=provenance)


def _renumbered(
    label: NDArray[np.int8], own: Sequence[str], classes: tuple[str, ...]
) -> NDArray[np.int8]:
    # The last place is that of UNKNOWN.
    table = np.array([*(classes.index(name) for name in own), UNKNOWN], np.int8)
    return table[label]


def _class_of(label: str, label_set: LabelSet) -> str:
    known = label_set.find(label)
    name = known.gesture_class if known is not None else label
    return BACKGROUND if name.casefold() == BACKGROUND else name


def in_order(names: Iterable[str]) -> tuple[str, ...]:
    """Sort names of classes, each once: the background first. Sd2Error for too many."""
    each = set(names)
    if len(each) > _MOST_CLASSES:
        raise Sd2Error(
            f"The labels are of {len(each)} classes",
            f"up to {_MOST_CLASSES}",
            "Give labels that one thing is meant by the same class, in the label set",
        )
    return tuple(sorted(each, key=lambda name: (name != BACKGROUND, name)))


# -- Noise floors, so that maps of any receiver are known ----------------------------------------


def with_noise_floor(clip: Clip, null_bins: Sequence[int], rng: np.random.Generator) -> Clip:
    """Add a random noise floor to a clip, as of a noisier receiver; ``null_bins`` stay empty."""
    level = clip.energies.max(initial=0.0) * 10.0 ** (-rng.uniform(*BELOW_LOUDEST_DB) / 10.0)
    looks = _MAX_LOOKS ** rng.random()
    noise = rng.gamma(looks, level / looks, clip.energies.shape).astype(np.float32)
    noise[:, list(null_bins)] = 0.0
    return replace(clip, energies=clip.energies + noise)


def some_noisy(
    clips: Sequence[Clip], null_bins: Sequence[int], share: float, seed: int
) -> list[Clip]:
    """Add a noise floor to some clips, see :func:`with_noise_floor`.

    Parameters
    ----------
    clips : sequence of Clip
        The others are returned as they are, in the same order.
    null_bins : sequence of int
        Bins that stay empty.
    share : float
        Probability for each clip, 0 to 1.
    seed : int
        The same one gives the same clips and noise.
    """
    rng = np.random.default_rng(seed)
    return [
        with_noise_floor(clip, null_bins, rng) if rng.random() < share else clip for clip in clips
    ]
