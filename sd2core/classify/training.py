"""Training a classifier: small networks, one thread, the same result for the same seed."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch.nn import functional

from sd2core.classify.card import ClassifierCard
from sd2core.classify.data import UNKNOWN, Clip, ClipSet, frame_counts, some_noisy
from sd2core.classify.defaults import DELAY_S, DELAYS_S, WIDTH, WIDTHS, FeatureKind
from sd2core.classify.features import Features
from sd2core.classify.live import TrainedClassifier
from sd2core.classify.metrics import confusion_of, mean_recall
from sd2core.classify.models import Classifier, build, options, parameter_groups
from sd2core.errors import Sd2Error
from sd2core.options.bounds import LEARNING_RATE, STEPS
from sd2core.train.checkpoint import Position
from sd2core.train.loop import Loop
from sd2core.train.steps import set_rate

Watch = Callable[[dict[str, Any]], None]
"""Told every event; may raise ``KeyboardInterrupt`` to stop with the best so far."""


@dataclass(frozen=True)
class TrainOptions:
    """Options of a training."""

    model: str = "lstm"
    features: FeatureKind = "columns"
    delay_s: float = DELAY_S  # part after a frame that is seen before it is answered
    options: Mapping[str, Any] = field(default_factory=dict)  # of the model, in place of its own
    noisy_share: float = 0.5
    """Share of the training clips that get a noise floor (:mod:`sd2core.classify.data`)."""
    steps: int = 300  # batches that are learnt from
    batch: int = 32  # windows per batch; of few clips several each, cut at other places
    window_frames: int = 300  # longer clips are cut at random places
    piece_frames: int = 50
    """A model that carries its state learns from pieces of this length, one after another
    (truncated backpropagation); the state is kept between them."""
    learning_rate: float = 0.01
    """Highest rate, like the other: both rise for a tenth of the steps and fall along a cosine."""
    ssm_learning_rate: float = 0.003
    weight_decay: float = 0.01
    check_steps: int = 20  # between two validations
    patience: int = 10  # validations without a better one after which it ends; the best is kept
    seed: int = 0

    def __post_init__(self) -> None:
        if self.steps not in STEPS:
            raise Sd2Error(f"steps is {self.steps}", STEPS.words)
        width = self.options.get("width", WIDTH)
        if width not in WIDTHS:
            raise Sd2Error(f"width is {width}", WIDTHS.words)
        for name in ("batch", "window_frames", "piece_frames", "check_steps", "patience"):
            if getattr(self, name) < 1:
                raise Sd2Error(f"{name} is {getattr(self, name)}", "at least 1")
        for name in ("learning_rate", "ssm_learning_rate"):
            value = getattr(self, name)
            if value not in LEARNING_RATE:
                raise Sd2Error(f"{name} is {value}", LEARNING_RATE.words)
        if not 0 <= self.noisy_share <= 1:
            raise Sd2Error(f"The share of noisy clips is {self.noisy_share}", "0 to 1")
        if self.delay_s not in DELAYS_S:
            raise Sd2Error(f"The delay is {self.delay_s} s", f"0 to {DELAYS_S.high:g} s")

    def to_json(self) -> dict[str, Any]:
        """Return the fields by name, with all options of the model."""
        return {**asdict(self), "options": {**options(self.model), **self.options}}


class Trained(NamedTuple):
    """Result of a training."""

    classifier: TrainedClassifier  # the best on validation, or the last without validation
    events: list[dict[str, Any]]
    interrupted: bool


class TrainingArrays(NamedTuple):
    """Features and labels of clips."""

    features: list[NDArray[np.float32]]
    """Float32 (frames, size) of whole clips, so that what was before a window is known; then the
    silence in which a clip's last answers are found."""
    labels: list[NDArray[np.int64]]
    """Int64 (frames,); those of earlier frames, where answers are late."""

    @classmethod
    def of(cls, clips: Sequence[Clip], features: Features, delay_frames: int) -> TrainingArrays:
        """Compute features and labels of clips."""
        return cls(
            [np.pad(features.of(c.energies)[0], ((0, delay_frames), (0, 0))) for c in clips],
            [
                np.pad(c.label.astype(np.int64), (delay_frames, 0), constant_values=UNKNOWN)
                for c in clips
            ],
        )


def train(
    training: Sequence[Clip],
    validation: Sequence[Clip],
    known: ClipSet,
    chosen: TrainOptions | None = None,
    *,
    weights: Sequence[float] | None = None,
    about: Mapping[str, Any] | None = None,
    watch: Watch = lambda event: None,
) -> Trained:
    """Train a classifier on clips of ``known``.

    The loss is the cross entropy, every class weighted by the inverse of its number of
    frames, as often as they are shown, so that all of them count the same. The clips are
    shuffled again when all have been seen. The best on validation is the one with the
    highest mean recall of frames; without validation the last one is taken.

    Parameters
    ----------
    training, validation : sequence of Clip
        Clips to learn from, and to choose the best by; the latter may be none.
    known : ClipSet
        Axis, null bins, frame rate and classes of both.
    chosen : TrainOptions, optional
        The defaults by default.
    weights : sequence of float, optional
        How much a frame of each training clip counts; by default all the same.
    about : mapping, optional
        Goes onto the card; fits into JSON.
    watch : callable
        Called with every event; may raise ``KeyboardInterrupt`` to stop with the best so far.

    Raises
    ------
    Sd2Error
        If no training clip has a labelled frame.
    """
    chosen = chosen or TrainOptions()
    own_weights = np.ones(len(training)) if weights is None else np.asarray(weights, np.float64)
    features = Features(chosen.features, known.axis, known.null_bins, known.frame_rate_hz)
    delay_frames = round(chosen.delay_s * known.frame_rate_hz)
    events: list[dict[str, Any]] = []

    def say(event: str, **content: Any) -> None:
        events.append({"event": event, **content})
        watch(events[-1])

    own = _options_of(chosen, delay_frames)
    with _one_thread(), torch.random.fork_rng(devices=[]):
        torch.manual_seed(chosen.seed)
        network = build(chosen.model, features.size, len(known.classes), **own)
        shares = own_weights
        if not network.closed_form:  # Windows are cut from clips, which are drawn.
            lengths = np.array([len(clip) for clip in training])
            chances = np.ones(len(training)) if weights is None else own_weights * lengths
            shares = chances * np.minimum(lengths, chosen.window_frames) / lengths
        of_classes = _class_weights(training, shares / shares.max(initial=1e-12), known.classes)
        shown = some_noisy(training, known.null_bins, chosen.noisy_share, chosen.seed)
        if network.closed_form:  # It has no second look at a clip.
            noisy = zip(shown, training, strict=True)
            again = [number for number, (one, clean) in enumerate(noisy) if one is not clean]
            own_weights = np.concatenate([own_weights, own_weights[again]])
            shown = [*training, *(shown[number] for number in again)]
        arrays = TrainingArrays.of(shown, features, delay_frames)
        steps, interrupted = 1 if network.closed_form else chosen.steps, False
        say("start", steps=steps, clips=len(training), frames=sum(map(len, training)))
        if network.closed_form:
            network.fit(
                [torch.from_numpy(one) for one in arrays.features],
                [torch.from_numpy(one) for one in arrays.labels],
                of_classes,
                own_weights.tolist(),
                chosen.seed,
            )
            best_step = 1
        else:
            loop = _ClassifierLoop(
                network,
                arrays,
                TrainingArrays.of(validation, features, delay_frames),
                of_classes,
                chosen,
                None if weights is None else own_weights * [len(clip) for clip in training],
                say,
            )
            try:
                loop.run()
            except KeyboardInterrupt:
                interrupted = True
            best_step = loop.best_step
            # Stopped before the first check, it is as far as it came.
            if loop.best is not None:
                network.load_state_dict(loop.best)
        say("end", best_step=best_step, interrupted=interrupted)
    every = {**options(chosen.model), **own}
    told = {**chosen.to_json(), "options": every}
    if network.closed_form:  # There are no steps.
        used = ("model", "features", "delay_s", "options", "noisy_share", "seed")
        told = {name: told[name] for name in used}
    card = ClassifierCard(
        chosen.model,
        every,
        known.axis,
        known.null_bins,
        known.frame_rate_hz,
        chosen.features,
        known.classes,
        tuple(dict.fromkeys(clip.kind for clip in training)),
        delay_frames,
        about={**(about or {}), "best_step": best_step, "training": told},
    )
    return Trained(TrainedClassifier(network, card), events, interrupted)


def _options_of(chosen: TrainOptions, delay_frames: int) -> dict[str, Any]:
    """Options of the network; windows are twice as long as the delay."""
    given = {name: value for name, value in chosen.options.items() if name in options(chosen.model)}
    if "frames" in options(chosen.model):
        given["frames"] = 2 * delay_frames + 1
    return given


class _ClassifierLoop(Loop):
    """Training of a network by steps; ``chances`` say how often each clip is to be drawn."""

    def __init__(
        self,
        network: Classifier,
        arrays: TrainingArrays,
        validation: TrainingArrays,
        weights: torch.Tensor,
        chosen: TrainOptions,
        chances: NDArray[np.float64] | None,
        say: Callable[..., None],
    ) -> None:
        super().__init__(
            # Worse than any recall.
            Position(best={"score": 1.0, "step": 0}),
            epoch_steps=chosen.check_steps,
            steps=chosen.steps,
            patience=chosen.patience,
        )
        self._network, self._arrays, self._validation = network, arrays, validation
        self._weights, self._chosen, self._say = weights, chosen, say
        # Without chances all clips are shown in turn.
        self._chances = None if chances is None else chances / chances.sum()
        self._waiting: list[int] = []
        self._rng = np.random.default_rng([chosen.seed, 1])
        groups = parameter_groups(network, chosen.learning_rate, chosen.ssm_learning_rate)
        self._optimiser = torch.optim.AdamW(groups, weight_decay=chosen.weight_decay)
        self.best: dict[str, torch.Tensor] | None = None

    @property
    def best_step(self) -> int:
        """Step of the best check; 0 before one."""
        assert self.position.best is not None
        return int(self.position.best["step"])

    def step(self) -> None:
        """Learn from one batch of windows."""
        set_rate(self._optimiser, _schedule(self.share_done))
        loss = self._learn(*self._windows(self._drawn()))
        self._say("step", step=self.position.steps_done + 1, loss=loss, elapsed_s=self.elapsed_s)

    def check(self) -> dict[str, Any]:
        """Mean recall of the validation; without one the last step is the best."""
        step = self.position.steps_done
        if not self._validation.labels:
            return {"score": -step, "step": step}
        recall = _score(self._network, self._validation, len(self._weights))
        self._say("check", step=step, validation_mean_recall=recall)
        return {"score": -recall, "step": step}

    def keep_best(self) -> None:
        """Copy the weights."""
        self.best = copy.deepcopy(self._network.state_dict())

    def _drawn(self) -> list[int]:
        """Numbers of the clips of a batch."""
        batch = self._chosen.batch
        if self._chances is not None:
            return self._rng.choice(len(self._chances), batch, p=self._chances).tolist()
        while len(self._waiting) < batch:
            # The last are taken first.
            self._waiting[:0] = self._rng.permutation(len(self._arrays.labels)).tolist()
        return [self._waiting.pop() for _ in range(batch)]

    def _windows(self, clips: Sequence[int]) -> tuple[torch.Tensor, torch.Tensor]:
        """Cut a window from each clip: (batch, frames, size) and (batch, frames)."""
        length = min(
            self._chosen.window_frames, max(len(self._arrays.labels[one]) for one in clips)
        )
        size = self._arrays.features[0].shape[1]
        shown = np.zeros((len(clips), length, size), np.float32)
        label = np.full((len(clips), length), UNKNOWN, np.int64)
        for row, one in enumerate(clips):
            frames = len(self._arrays.labels[one])
            start = int(self._rng.integers(max(frames - length, 0) + 1))
            part = slice(start, start + length)
            count = min(frames, length)
            shown[row, :count] = self._arrays.features[one][part]
            label[row, :count] = self._arrays.labels[one][part]
        return torch.from_numpy(shown), torch.from_numpy(label)

    def _learn(self, shown: torch.Tensor, label: torch.Tensor) -> float:
        """Learn from a batch in parts; every network gets the same number of updates.

        A network that carries its state gets the frames piece after piece, one that looks at
        whole stretches some of the stretches after others.
        """
        network = self._network.train()
        pieces = -(-shown.shape[1] // self._chosen.piece_frames)
        if network.whole:
            parts = torch.arange(len(shown)).tensor_split(min(pieces, len(shown)))
            losses = [self._update(network(shown[rows]), label[rows]) for rows in parts]
        else:
            losses = []
            state = network.initial_state(len(shown))
            for number in range(pieces):
                begin = number * self._chosen.piece_frames
                part = slice(begin, begin + self._chosen.piece_frames)
                answer, state = network.chunk(shown[:, part], state)
                losses.append(self._update(answer, label[:, part]))
                state = tuple(one.detach() for one in state)
        known = [loss for loss in losses if loss is not None]
        return sum(known) / max(len(known), 1)

    def _update(self, answer: torch.Tensor, label: torch.Tensor) -> float | None:
        """Do one step of the optimiser; return the loss, or None where no frame is known."""
        if (label == UNKNOWN).all():
            return None
        loss = functional.cross_entropy(
            answer.flatten(0, 1), label.flatten(), self._weights, ignore_index=UNKNOWN
        )
        self._optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self._network.parameters(), 1.0)
        self._optimiser.step()
        return float(loss.detach())


def _schedule(share: float) -> float:
    """Learning rate as a share of its highest, after this share of the steps."""
    rise = 0.1
    if share < rise:
        return (share + 0.01) / (rise + 0.01)
    return 0.02 + 0.98 * 0.5 * (1.0 + math.cos(math.pi * (share - rise) / (1.0 - rise)))


def _score(network: Classifier, arrays: TrainingArrays, classes: int) -> float:
    """Mean recall over classes of all frames."""
    network.eval()
    confusion = np.zeros((classes, classes), np.int64)
    with torch.no_grad():
        for shown, label in zip(arrays.features, arrays.labels, strict=True):
            answer = network(torch.from_numpy(shown)[None])[0].argmax(1).numpy()
            confusion += confusion_of(label, answer, classes)
    return mean_recall(confusion)


def _class_weights(
    clips: Sequence[Clip], weights: NDArray[np.float64], classes: tuple[str, ...]
) -> torch.Tensor:
    counts = np.zeros(len(classes))
    for clip, weight in zip(clips, weights, strict=True):
        counts += weight * frame_counts([clip], len(classes))
    if not counts.sum():
        raise Sd2Error("There is no labelled frame to learn from", "clips with labels")
    # A class without a frame is never in the loss.
    weights = np.where(counts > 0, counts.sum() / np.maximum(counts, 1e-9), 0.0)
    return torch.from_numpy((weights / weights[counts > 0].mean()).astype(np.float32))


@contextmanager
def _one_thread() -> Iterator[None]:
    """Use one thread: small matrices are slower on several, and differ between machines."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)
