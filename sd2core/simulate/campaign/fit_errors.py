"""Statistics of the errors that fits from video make, on disk, and errors drawn from them.

A fit errs as its evidence does: the same pose is misread in the same way, another pose
in another, so that who stands still has no false velocity and who moves faster has more
of it. So errors are a random function of the pose, not of time: for each group of
:mod:`~sd2core.simulate.campaign.posture`

    error = gain · (1, pose) + bias + f(pose)

with the regression that all clips have in common (limbs that are drawn too short in
depth), a constant per clip, and a Gaussian process over poses with a rational quadratic
kernel (C. E. Rasmussen and C. K. I. Williams, "Gaussian Processes for Machine Learning",
2006, eq. 4.19). It is drawn by random Fourier features (A. Rahimi and B. Recht, "Random
features for large-scale kernel machines", NIPS 2007).
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from sd2core.body.model import Skeleton
from sd2core.body.rotations import Floats
from sd2core.body.shape import BodyShape
from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write_text
from sd2core.files.resources import resource_path
from sd2core.files.texts import check_version, read_json
from sd2core.simulate.campaign.posture import Group, all_groups, change_posture, posture

FORMAT = "sd2-fit-errors"
VERSION = 1
RESOURCE = "fit_errors.json"

_EXPECTED = f"a file of format {FORMAT}, see docs/formats.md"
_WAVES = 96


@dataclass(frozen=True, eq=False)
class GroupErrors:
    """Errors of one group of a posture; n of them, depending on m features.

    The kernel of the Gaussian process is (1 + h² / (2 · mixing · length²)) ** -mixing: the smaller
    the mixing, the more lengths it mixes.
    """

    gain: Floats  # (n, 1 + m).
    bias: Floats  # Covariance of what is constant within a clip, (n, n).
    spread: Floats  # Covariance of the Gaussian process, (n, n).
    length: float  # Length of the kernel, in the unit of the features.
    mixing: float  # Exponent of its kernel.

    def draw(self, rng: np.random.Generator) -> ErrorFunction:
        """Errors of one clip."""
        count, features = len(self.gain), self.gain.shape[1] - 1
        constant = _root(self.bias) @ rng.standard_normal(count)
        # The kernel is a mixture of squared exponentials whose inverse squared lengths
        # are gamma distributed; each of those has normally distributed frequencies.
        precision = rng.gamma(self.mixing, 1.0 / self.mixing, (_WAVES, 1)) / self.length**2
        frequency = np.sqrt(precision) * rng.standard_normal((_WAVES, features))
        phase = rng.uniform(0.0, 2.0 * np.pi, _WAVES)
        size = rng.standard_normal((_WAVES, count)) @ _root(self.spread).T
        size *= np.sqrt(2.0 / _WAVES)
        return ErrorFunction(self.gain, constant, frequency, phase, size)


@dataclass(frozen=True, eq=False)
class ErrorFunction:
    """Errors of one clip as a function of the pose."""

    gain: Floats
    constant: Floats
    frequency: Floats
    phase: Floats
    size: Floats

    def __call__(self, features: Floats) -> Floats:
        """Errors (T, n) at features (T, m)."""
        waves = np.cos(features @ self.frequency.T + self.phase)
        shared = features @ self.gain[:, 1:].T + self.gain[:, 0]
        return np.asarray(shared + self.constant + waves @ self.size)

    def scaled(self, factor: float) -> ErrorFunction:
        """Errors so many times as large."""
        larger = {name: factor * getattr(self, name) for name in ("gain", "constant", "size")}
        return replace(self, **larger)


@dataclass(frozen=True, eq=False)
class FitErrors:
    """Statistics of the errors of fits, from which those of one clip are drawn."""

    groups: Mapping[Group, GroupErrors]  # ``place``, ``trunk``, ``arm``, ``leg``.
    shape_mean: Floats  # Mean errors of the shape's coefficients, (K,).
    shape_covariance: Floats  # Their mean square about that, (K, K).
    provenance: dict[str, Any] = field(default_factory=dict)  # Measured fits and the method.

    @classmethod
    def load(cls, path: Path | None = None) -> FitErrors:
        """Read what :meth:`save` wrote; the bundled ones by default.

        Raises Sd2Error when the file is missing, damaged or of a later version.
        """
        path = resource_path(RESOURCE) if path is None else Path(path)
        try:
            content = read_json(path, _EXPECTED)
            check_version(content, path, FORMAT, VERSION)
            groups: dict[Group, GroupErrors] = {
                name: GroupErrors(
                    **{key: np.array(one[key], np.float64) for key in ("gain", "bias", "spread")},
                    length=float(one["length"]),
                    mixing=float(one["mixing"]),
                )
                for name, one in content["groups"].items()
            }
            wanted = {group for group, _ in all_groups()}
            if set(groups) != wanted:
                raise KeyError(", ".join(sorted(wanted - set(groups))))
            return cls(
                groups,
                np.array(content["shape_mean"], np.float64),
                np.array(content["shape_covariance"], np.float64),
                content["provenance"],
            )
        except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
            raise Sd2Error(
                f"{path} cannot be read as errors of fits ({error})", _EXPECTED
            ) from error

    def as_dict(self) -> dict[str, Any]:
        """Content of the file, fit for JSON."""
        return {
            "format": FORMAT,
            "version": VERSION,
            "groups": {
                name: {key: _plain(value) for key, value in asdict(group).items()}
                for name, group in self.groups.items()
            },
            "shape_mean": _plain(self.shape_mean),
            "shape_covariance": _plain(self.shape_covariance),
            "provenance": self.provenance,
        }

    def save(self, path: Path) -> None:
        """Write JSON, whole or not at all."""
        atomic_write_text(Path(path), json.dumps(self.as_dict(), indent=1) + "\n")

    def draw(self, rng: np.random.Generator) -> Disturbance:
        """The errors of one clip's fit."""
        shape = self.shape_mean + _root(self.shape_covariance) @ rng.standard_normal(
            len(self.shape_mean)
        )
        functions = {key: self.groups[key[0]].draw(rng) for key in all_groups()}
        return Disturbance(shape, functions)


@dataclass(frozen=True, eq=False)
class Disturbance:
    """The errors of one clip's fit: see :meth:`FitErrors.draw`."""

    shape_error: Floats
    functions: Mapping[tuple[Group, str], ErrorFunction]

    def scaled(self, factor: float) -> Disturbance:
        """Errors so many times as large; at 0 the fit is the truth."""
        functions = {key: function.scaled(factor) for key, function in self.functions.items()}
        return Disturbance(factor * self.shape_error, functions)

    def shape(self, true: BodyShape) -> BodyShape:
        """The shape that is found; the stature is known."""
        return BodyShape(true.coefficients + self.shape_error, true.stature_m)

    def transforms(self, true: Skeleton, transforms: Floats, fitted: Skeleton) -> Floats:
        """Transforms of the bones that are found.

        ``true`` and ``fitted`` have the true shape and the one that is found; ``transforms``, (T,
        B, 3, 4), are those of the true body in the camera frame.
        """
        held = posture(true, transforms)
        change = {key: function(held.features(*key)) for key, function in self.functions.items()}
        return change_posture(fitted, transforms, held, change)


def _root(covariance: Floats) -> Floats:
    """A matrix whose product with its transpose is a covariance, also a singular one."""
    values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T))
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def _plain(value: Any) -> Any:
    """Numbers for JSON, without digits that mean nothing."""
    if isinstance(value, np.ndarray):
        return [_plain(one) for one in value] if value.ndim else float(value)
    return float(f"{float(value):.6g}")
