"""Pose through time by Gauss–Newton: its cost, the equations of a step, and the stages.

Eight kinds of residuals, each divided by its standard deviation: landmarks in the
picture, their depth behind the middle of the trunk, the trunk's own depth, their
velocity along the optical axis, movement of feet that stand, habits and limits of joints, arms
behind the chest, and smoothness (the acceleration of every degree of freedom). Landmarks,
depths and velocities far off count less (iteratively reweighted least squares). Unknowns
of a frame meet only those of the next two, so the equations are banded.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from sd2core.body.evidence import Evidence
from sd2core.body.initial import Pose
from sd2core.body.lifter import FEET
from sd2core.body.rig import BEHIND, CHEST, JOINT, JOINTS, Rig
from sd2core.body.rotations import Floats, from_vector, to_vector, transposed
from sd2core.body.track import LANDMARKS

REACH = 2
"""Frames that one residual spans, less one."""


@dataclass(eq=False)
class Normal:
    """Normal equations of a Gauss–Newton step: a symmetric banded matrix of n × n blocks.

    ``blocks[k][t]`` (n, n) is the block between frames t and t + k, for k = 0, 1, 2; ``gradient``
    (T, n) is that of half the sum of squares.
    """

    blocks: list[Floats]
    gradient: Floats

    @classmethod
    def zeros(cls, frames: int, unknowns: int) -> Normal:
        """Equations without residuals."""
        return cls(
            [np.zeros((max(frames - k, 0), unknowns, unknowns)) for k in range(REACH + 1)],
            np.zeros((frames, unknowns)),
        )

    def add(self, residual: Floats, parts: list[tuple[int, Floats]]) -> None:
        """Add R residuals (m, R) of m first frames, divided by their standard deviations.

        ``parts`` holds for each frame offset o, ascending, the derivative (m, R, n) by the
        unknowns of frame t + o.
        """
        count = len(residual)
        for number, (at, left) in enumerate(parts):
            transposed = np.swapaxes(left, 1, 2)
            self.gradient[at : at + count] += (transposed @ residual[..., None])[..., 0]
            for other, right in parts[number:]:
                self.blocks[other - at][at : at + count] += transposed @ right

    def add_diagonal(self, residual: Floats, parts: list[tuple[int, Floats]]) -> None:
        """Add one residual per unknown that depends on that unknown alone.

        As :meth:`add` with R = n and the diagonals (m, n) of the derivatives.
        """
        count, unknowns = residual.shape
        rows = np.arange(unknowns)
        for number, (at, left) in enumerate(parts):
            self.gradient[at : at + count] += left * residual
            for other, right in parts[number:]:
                self.blocks[other - at][at : at + count, rows, rows] += left * right

    def step(self, damping: float) -> Floats:
        """Change (T, n) of the unknowns that solves the equations (Levenberg–Marquardt).

        ``damping`` is the share of its own diagonal that is added to the matrix.
        """
        from scipy.linalg import solveh_banded

        frames, unknowns = self.gradient.shape
        reach = min(REACH, frames - 1)
        # As LAPACK takes it: a column of the matrix, down to its diagonal, after the other.
        columns = np.zeros((frames, unknowns, (reach + 1) * unknowns))
        for apart, blocks in enumerate(self.blocks[: reach + 1]):
            for column in range(unknowns):
                first = (reach - apart + 1) * unknowns - 1 - column
                rows = unknowns if apart else column + 1
                columns[apart:, column, first : first + rows] = blocks[:, :rows, column]
        banded = columns.reshape(frames * unknowns, -1).T
        banded[-1] *= 1.0 + damping
        solved = solveh_banded(
            banded, -self.gradient.ravel(), overwrite_ab=True, overwrite_b=True, check_finite=False
        )
        return np.asarray(solved.reshape(frames, unknowns))


_RELAXED_DEG = 35.0
"""Angle from the rest pose, arms held away, to hanging arms."""

# Standard deviation of what people do, radians from relaxed; of shared joints per place.
_HABIT_RAD = {
    "root": 50.0,
    "spine": 0.15,
    "head": 0.2,
    "clavicle": 0.15,
    "shoulder": 1.2,
    "elbow": 1.0,
    "pronation": 0.4,
    "wrist": 0.35,
    "hip": 0.6,
    "knee": 0.8,
    "ankle": 0.3,
}
# What a hinge allows, radians from the rest pose.
_LIMITS_RAD = {"elbow": (-0.65, 1.95), "knee": (-0.15, 2.2)}
_LIMIT_SD_RAD = 0.03

# What arms do seldom: to be behind the plane of the chest. Marks from and to, how far
# behind is common, and the standard deviation of more, in lengths of the upper arm.
_BEHIND = tuple(
    (LANDMARKS.index(start) if start else CHEST, LANDMARKS.index(end), common, sd)
    for side in "LR"
    for start, end, common, sd in (
        (f"shoulder.{side}", f"elbow.{side}", 0.15, 0.15),
        (None, f"wrist.{side}", 0.15, 0.3),
    )
)

_FAR_PX = 3.0
_FAR_DEPTH = 2.0
"""Standard deviations from where on a residual counts less."""


class Residuals(NamedTuple):
    """Whitened residuals of a pose through time."""

    picture: Floats  # (T, 33, 2)
    depth: Floats  # (T, 33)
    trunk: Floats  # (T, 1)
    velocity: Floats  # (T - 1, 33)
    standing: Floats  # (T - 1, 12) movement of feet that stand
    habit: Floats  # (T, n), and (T, n) of the limits
    limit: Floats
    behind: Floats  # (T, 4)
    smooth: Floats  # (T - 2, n)


class Objective:
    """Weighted sum of squares of a pose; ``acceleration_sd`` (T - 2, n) is the smoothness."""

    def __init__(self, rig: Rig, evidence: Evidence, acceleration_sd: Floats) -> None:
        self.rig, self.evidence, self.acceleration_sd = rig, evidence, acceleration_sd
        self._relaxed, self._habit_sd, self._limits = _habits(rig)
        self._step_s = np.diff(evidence.times_s)
        self._size, self._size_share = _size_error(evidence)
        self._velocity_mps, self._velocity_sd_mps = (
            0.5 * (values[1:] + values[:-1])
            for values in (evidence.velocity_mps, evidence.velocity_sd_mps)
        )
        sd_mps = evidence.standing_sd_mps
        standing_sd_mps = np.repeat(np.maximum(sd_mps[1:], sd_mps[:-1]), 3, axis=1)
        self._held_per_m = 1.0 / (standing_sd_mps * self._step_s[:, None])  # (T - 1, 12)
        heads, index = rig.skeleton.heads_m, rig.skeleton.index
        self._arm_m = float(
            np.linalg.norm(heads[index["lowerarm01.L"]] - heads[index["upperarm01.L"]])
        )

    def residuals(self, pose: Pose) -> Residuals:
        """Residuals of one pose through time."""
        return self._residuals(pose, self.rig.marks.positions(self.rig.transforms(*pose)))

    def _residuals(self, pose: Pose, marks: Floats) -> Residuals:
        seen = self.evidence
        positions = marks[:, : len(LANDMARKS)]
        depth = positions[..., 2]  # (T, 33)
        trunk = depth[:, seen.trunk].mean(axis=1)
        angles = self._angles(pose)
        low, high = self._limits
        beyond = np.minimum(angles - low, 0.0) + np.maximum(angles - high, 0.0)
        off = (positions[..., :2] / depth[..., None] - seen.slopes) / seen.slopes_sd[..., None]
        return Residuals(
            self._but_for_size(off.reshape(len(off), -1, 1)).reshape(off.shape),
            (depth - trunk[:, None] - seen.depth_m) / seen.depth_sd_m,
            ((trunk - seen.trunk_m) / seen.trunk_sd_m)[:, None],
            (np.diff(depth, axis=0) / self._step_s[:, None] - self._velocity_mps)
            / self._velocity_sd_mps,
            self._held_per_m * np.diff(positions[:, FEET].reshape(len(depth), -1), axis=0),
            angles / self._habit_sd,
            beyond / _LIMIT_SD_RAD,
            self._behind(marks)[0],
            self.accelerations(pose) / self.acceleration_sd,
        )

    def accelerations(self, pose: Pose) -> Floats:
        """Acceleration of every degree of freedom, (T - 2, freedoms), rad/s² and m/s²."""
        step_s = self._step_s[:, None]
        turned = to_vector(transposed(pose.turns[:-1]) @ pose.turns[1:])  # (T - 1, J, 3)
        rates = [turned[:, j] @ axes / step_s for j, axes in enumerate(self.rig.axes)]
        rates.append(np.diff(pose.translation_m, axis=0) / step_s)
        rate = np.concatenate(rates, axis=1)
        return np.asarray(np.diff(rate, axis=0) / (0.5 * (step_s[1:] + step_s[:-1])))

    def trust(self, residuals: Residuals) -> Residuals:
        """Square roots of the weights that make far residuals count less."""
        picture, depth, trunk, velocity, standing, *others = residuals
        size = (picture**2).sum(axis=-1, keepdims=True)
        far = (depth, trunk, velocity, standing)
        return Residuals(
            1.0 / (1.0 + size / _FAR_PX**2),
            *(1.0 / np.sqrt(1.0 + (each / _FAR_DEPTH) ** 2) for each in far),
            *(np.ones(1) for _ in others),
        )

    def normal(self, pose: Pose, trust: Residuals) -> tuple[float, Normal]:
        """Half the weighted sum of squares, and the equations of the next step."""
        seen = self.evidence
        transforms = self.rig.transforms(*pose)
        marks = self.rig.marks.positions(transforms)
        moves = self.rig.jacobian(transforms, marks)  # (T, 35, 3, n)
        residuals = weighted(self._residuals(pose, marks), trust)
        positions, jacobian = marks[:, : len(LANDMARKS)], moves[:, : len(LANDMARKS)]
        frames, _, _, unknowns = jacobian.shape
        normal = Normal.zeros(frames, unknowns)

        depth, along = positions[..., 2], jacobian[:, :, 2]  # (T, 33), (T, 33, n)
        slopes = positions[..., :2] / depth[..., None]
        shift = (jacobian[:, :, :2] - slopes[..., None] * along[:, :, None]) / depth[
            ..., None, None
        ]
        shift /= seen.slopes_sd[..., None, None]
        shift = self._but_for_size(shift.reshape(frames, -1, unknowns)).reshape(shift.shape)
        shift *= trust.picture[..., None]
        normal.add(
            residuals.picture.reshape(frames, -1), [(0, shift.reshape(frames, -1, unknowns))]
        )

        trunk = along[:, seen.trunk].mean(axis=1, keepdims=True)  # (T, 1, n)
        apart = along - trunk
        normal.add(residuals.depth, [(0, apart * (trust.depth / seen.depth_sd_m)[..., None])])
        normal.add(
            residuals.trunk, [(0, trunk * (trust.trunk / seen.trunk_sd_m[:, None])[..., None])]
        )
        if frames > 1:
            per_m = trust.velocity / (self._velocity_sd_mps * self._step_s[:, None])
            normal.add(
                residuals.velocity,
                [(0, -along[:-1] * per_m[..., None]), (1, along[1:] * per_m[..., None])],
            )
            feet = jacobian[:, FEET].reshape(frames, -1, unknowns)  # (T, 12, n)
            held = (self._held_per_m * trust.standing)[..., None]
            normal.add(residuals.standing, [(0, -held * feet[:-1]), (1, held * feet[1:])])
        normal.add_diagonal(
            residuals.habit, [(0, np.broadcast_to(1.0 / self._habit_sd, (frames, unknowns)))]
        )
        normal.add_diagonal(residuals.limit, [(0, (residuals.limit != 0.0) / _LIMIT_SD_RAD)])
        normal.add(residuals.behind, [(0, self._behind(marks, moves)[1])])
        if frames > 2:
            first, second = self._step_s[:-1, None], self._step_s[1:, None]
            middle = 0.5 * (first + second)
            ahead = 1.0 / (second * middle * self.acceleration_sd)
            behind = 1.0 / (first * middle * self.acceleration_sd)
            normal.add_diagonal(residuals.smooth, [(0, behind), (1, -(ahead + behind)), (2, ahead)])
        return cost(residuals), normal

    def moved(self, pose: Pose, change: Floats) -> Pose:
        """The pose after small turns and shifts (T, freedoms)."""
        turns = np.stack(
            [
                pose.turns[:, number] @ from_vector(change[:, columns] @ axes.T)
                for number, (columns, axes) in enumerate(
                    zip(self.rig.columns, self.rig.axes, strict=True)
                )
            ],
            axis=1,
        )
        return Pose(turns, pose.translation_m + change[:, -3:])

    def _but_for_size(self, shifts: Floats) -> Floats:
        """Shifts (T, 66, n) in the picture, in standard deviations of independent errors.

        A change of the person's size counts less, as all landmarks share its error.
        """
        along = self._size.transpose(0, 2, 1) @ shifts
        return np.asarray(shifts - (self._size_share * self._size) @ along)

    def _behind(self, marks: Floats, moves: Floats | None = None) -> tuple[Floats, Floats]:
        """Distance of arms behind the chest beyond what is common (T, 4), derivatives (T, 4, n).

        The derivatives are empty without those of the marks.
        """
        starts, ends, common, sd = (np.array(part) for part in zip(*_BEHIND, strict=True))
        lines = marks[:, ends] - marks[:, starts]  # (T, 4, 3)
        back = (marks[:, BEHIND] - marks[:, CHEST])[:, None]
        beyond = (lines * back).sum(axis=-1) / self._arm_m - common
        residuals = np.maximum(beyond, 0.0) / sd
        if moves is None:
            return residuals, np.empty(0)
        turned = (moves[:, BEHIND] - moves[:, CHEST])[:, None]  # (T, 1, 3, n)
        shifted = moves[:, ends] - moves[:, starts]
        slope = (lines[..., None] * turned + shifted * back[..., None]).sum(axis=-2)
        return residuals, slope * ((beyond > 0.0) / (sd * self._arm_m))[..., None]

    def _angles(self, pose: Pose) -> Floats:
        """Rotation vectors of joints from relaxed, on their axes, (T, n); 0 for the translation."""
        vectors = to_vector(transposed(self._relaxed) @ pose.turns)
        parts = [vectors[:, j] @ axes for j, axes in enumerate(self.rig.axes)]
        parts.append(np.zeros((len(vectors), 3)))
        return np.concatenate(parts, axis=1)


def weighted(residuals: Residuals, trust: Residuals) -> Residuals:
    """Residuals times the square roots of their weights."""
    return Residuals(*(r * w for r, w in zip(residuals, trust, strict=True)))


def cost(residuals: Residuals) -> float:
    """Half the sum of squares."""
    return 0.5 * float(sum((one**2).sum() for one in residuals))


def _size_error(evidence: Evidence) -> tuple[Floats, Floats]:
    """Change of the picture with the person's size, (T, 66, 1) of length 1, and its share.

    Independent errors and one of the size, which all landmarks share, have the covariance
    1 + s² u uᵀ; the root of its inverse is 1 - share · u uᵀ / |u|².
    """
    known = np.isfinite(evidence.slopes_sd)[..., None]
    slopes = np.where(known, evidence.slopes, 0.0)
    middle = slopes.sum(axis=1, keepdims=True) / np.maximum(known.sum(axis=1, keepdims=True), 1)
    change = np.where(known, slopes - middle, 0.0) / evidence.slopes_sd[..., None]
    change = change.reshape(len(change), -1, 1)
    length = np.linalg.norm(change, axis=1, keepdims=True)
    share = 1.0 - 1.0 / np.sqrt(1.0 + (evidence.size_sd * length) ** 2)
    return change / np.maximum(length, 1e-12), share


def _habits(rig: Rig) -> tuple[Floats, Floats, tuple[Floats, Floats]]:
    """Relaxed rotations (J, 3, 3), spread (n,) and limits (n,) of every joint."""
    relaxed = np.tile(np.eye(3), (len(JOINTS), 1, 1))
    turn = np.array([0.0, 0.0, np.radians(_RELAXED_DEG)])
    relaxed[JOINT["shoulder.L"]] = from_vector(turn)
    relaxed[JOINT["shoulder.R"]] = from_vector(-turn)
    spread = np.full(rig.freedoms, np.inf)
    low, high = np.full(rig.freedoms, -np.inf), np.full(rig.freedoms, np.inf)
    for joint, columns in zip(JOINTS, rig.columns, strict=True):
        kind = joint.name.partition(".")[0]
        spread[columns] = _HABIT_RAD[kind]
        if kind in _LIMITS_RAD:
            low[columns], high[columns] = _LIMITS_RAD[kind]
    return relaxed, spread, (low, high)


# -- The stages ------------------------------------------------------------------------------------


def one_thread() -> AbstractContextManager[object]:
    """Context in which products and factorisations of this process use one thread.

    A fit consists of many small ones, which gain nothing from threads; beside other work
    threads that wait for each other made it seven times as slow.
    """
    # SciPy's own copy of the library is limited only once it is loaded.
    import scipy.linalg  # noqa: F401
    from threadpoolctl import threadpool_limits

    return threadpool_limits(limits=1, user_api="blas")


_FIRST_ROTATION_RADPS2 = 60.0
FIRST_TRANSLATION_MPS2 = 6.0
_MIN_ROTATION_RADPS2 = 0.3
MIN_TRANSLATION_MPS2 = 0.05
_LIVELINESS = 0.7
"""Standard deviation of an acceleration over what was found around it."""
_AROUND_S = 0.3
ROUNDS = 3
_STEPS = 8
_CONVERGED = 1e-2
"""Share of the cost below which a step's gain ends a round: further ones change no velocity."""


def solve(
    rig: Rig, evidence: Evidence, start: Pose, tick: Callable[[int], None] = lambda done: None
) -> Pose:
    """Pose through time that agrees best with the evidence of consecutive frames.

    The smoothness follows the motion: after each round, every degree of freedom may accelerate as
    much as it was found to do around each moment (docs/decisions/0022).

    Parameters
    ----------
    rig : Rig
        Joints of the body, and the landmarks that follow them.
    evidence : Evidence
        T consecutive frames.
    start : Pose
        Of the same frames, to begin with.
    tick : callable
        Called often with the number of rounds done, of :data:`ROUNDS`; may raise.
    """
    frames = len(evidence.times_s)
    sd = np.full((max(frames - 2, 0), rig.freedoms), _FIRST_ROTATION_RADPS2)
    sd[:, -3:] = FIRST_TRANSLATION_MPS2
    pose = start
    with one_thread():
        for number in range(ROUNDS):
            objective = Objective(rig, evidence, sd)
            pose = _descend(objective, pose, robust=number > 0, tick=partial(tick, number))
            if number < ROUNDS - 1:
                least = np.full(rig.freedoms, _MIN_ROTATION_RADPS2)
                least[-3:] = MIN_TRANSLATION_MPS2
                sd = liveliness(objective.accelerations(pose), evidence.times_s, least)
    return pose


def solve_stills(rig: Rig, evidence: Evidence, start: Pose) -> Pose:
    """Pose of each frame for itself, independent of the frames around it."""
    apart = replace(evidence, velocity_sd_mps=np.full_like(evidence.velocity_sd_mps, np.inf))
    sd = np.full((max(len(evidence.times_s) - 2, 0), rig.freedoms), np.inf)
    objective = Objective(rig, apart, sd)
    with one_thread():
        pose = _descend(objective, start, robust=False, tick=lambda: None)
        return _descend(objective, pose, robust=True, tick=lambda: None)


def _descend(objective: Objective, pose: Pose, *, robust: bool, tick: Callable[[], None]) -> Pose:
    """Levenberg–Marquardt until the cost hardly falls."""
    damping = 1e-4
    residuals = objective.residuals(pose)
    plain = Residuals(*[np.ones(1)] * len(residuals))
    for _ in range(_STEPS):
        tick()
        trust = objective.trust(residuals) if robust else plain
        now, normal = objective.normal(pose, trust)
        for _ in range(6):
            tried = objective.moved(pose, normal.step(damping))
            tried_residuals = objective.residuals(tried)
            then = cost(weighted(tried_residuals, trust))
            if then <= now:
                break
            damping = max(damping, 1e-4) * 10.0
        else:
            return pose
        pose, residuals = tried, tried_residuals
        damping = max(damping / 10.0, 1e-6)
        if now - then < _CONVERGED * now:
            break
    return pose


def liveliness(
    values: Floats, times_s: Floats, least: Floats | float, share: float = _LIVELINESS
) -> Floats:
    """Share of the root mean square of values (m, N) around each moment, not below the least.

    Accelerations do not fall below what is left at rest.
    """
    from scipy.ndimage import correlate1d

    if not len(values):
        return values
    reach = max(round(_AROUND_S / float(np.median(np.diff(times_s)))), 1)
    kernel = np.hanning(2 * reach + 3)[1:-1]
    inside = correlate1d(np.ones(len(values)), kernel, mode="constant")[:, None]
    mean = correlate1d(values**2, kernel, axis=0, mode="constant") / inside
    return np.asarray(np.sqrt(share**2 * mean + np.square(least)))
