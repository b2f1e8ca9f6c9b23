"""Table of the denoiser networks by name, with options that make them comparable."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING, Any

from sd2core.errors import Sd2Error
from sd2core.plug_ins import Group, PlugIn

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from sd2core.denoise.model import Denoiser


@dataclass(frozen=True)
class Architecture:
    """Network that learns: a denoiser, or a classifier.

    Parameters
    ----------
    place : str
        ``package.module.Class`` of a :class:`~sd2core.denoise.model.Denoiser` or a
        :class:`~sd2core.classify.models.Classifier`, imported when one is built.
    summary : str
        What it is, in a few words.
    options : mapping
        Its options with their defaults: whole numbers from 1 to 1024, shares, or true or false.
        Of a denoiser, ``skip`` puts a linear map of each frame beside it, and ``live`` makes a
        causal one as well, with ``bidirectional=False``.
    fixed : mapping
        Further arguments of the class.
    """

    place: str
    summary: str
    options: Mapping[str, Any] = field(default_factory=dict)
    fixed: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if "." not in self.place:
            raise Sd2Error(f"The place of a network is {self.place!r}", "package.module.Class")
        if not isinstance(self.options, Mapping):
            raise Sd2Error(f"The options of a network are {self.options!r}", "a mapping")

    @property
    def made(self) -> Callable[..., Any]:
        """Class of the network."""
        module, _, name = self.place.rpartition(".")
        return getattr(import_module(module), name)


_S4 = {
    "channels": 128,
    "depth": 4,
    "state_size": 64,
    "dropout": 0.3,
    "dt_min": 0.02,
    "dt_max": 1.0,
    "skip": True,
}

# ``live``: beside the one that looks both ways a causal one, for live frames.
_BOTH_WAYS = {"bidirectional": True, "live": True}

_ENTRIES: dict[str, Architecture] = {
    "s4": Architecture(
        "sd2core.denoise.causal_models.S4Denoiser",
        "structured state space, HiPPO-LegS (the paper's model)",
        {**_S4, **_BOTH_WAYS},
        {"kernel": "legs"},
    ),
    "s4d": Architecture(
        "sd2core.denoise.causal_models.S4Denoiser",
        "structured state space, diagonal",
        {**_S4, **_BOTH_WAYS},
        {"kernel": "diagonal"},
    ),
    "s4-serial": Architecture(
        "sd2core.denoise.causal_models.SerialS4Denoiser",
        "the paper's literal form: all cells one after another, one channel; slow",
        # A sample is a bin, not a frame.
        {**_S4, "dt_min": 1e-3, "dt_max": 1e-1},
        {"kernel": "legs"},
    ),
    "gru": Architecture(
        "sd2core.denoise.causal_models.GruDenoiser",
        "gated recurrent network",
        {"channels": 144, "depth": 2, "dropout": 0.0, "skip": True},
    ),
    "unet": Architecture(
        "sd2core.denoise.window_models.UNetDenoiser",
        "2D U-Net over windows of 72 frames",
        {"channels": 12, "depth": 3, "dropout": 0.0, "skip": True},
    ),
    "swin": Architecture(
        "sd2core.denoise.window_models.SwinDenoiser",
        "Swin transformer over windows of 72 frames",
        {"channels": 48, "depth": 2, "dropout": 0.0, "skip": True},
    ),
    "none": Architecture("sd2core.denoise.filters.NoDenoiser", "no denoising"),
    "median": Architecture(
        "sd2core.denoise.filters.MedianDenoiser",
        "median over frames and bins",
        {"frames": 5, "width": 3},
    ),
    "wiener": Architecture(
        "sd2core.denoise.filters.WienerDenoiser",
        "linear filter of least squared error",
        {"frames": 9, "width": 5},
    ),
    "ridge": Architecture(
        "sd2core.denoise.filters.RidgeDenoiser",
        "ridge regression on the last frames",
        {"frames": 9},
    ),
}

DENOISERS = Group("denoisers", Architecture, _ENTRIES)
"""Networks of other packages."""

FILTERS = ("none", "median", "wiener", "ridge")
"""Denoisers that are fitted by :func:`fit_filter` instead of trained."""

MODELS = tuple(name for name in _ENTRIES if name not in FILTERS)
"""Networks that are trained."""

_LARGEST = 1024
"""No option is a larger number: a damaged file must not ask for all the memory."""
_MAX_BINS = 65_536  # of a map, for the same reason


def options(name: str) -> dict[str, Any]:
    """Default options of a model, with about as many numbers to learn as the S4's.

    Raises Sd2Error when there is no such model.
    """
    return dict(_entry(name).options)


def summary(name: str) -> str:
    """Short description of a model."""
    return _entry(name).summary


def build(name: str, bins: int = 32, parts: int = 1, more: int = 0, **given: Any) -> Denoiser:
    """Create a model of :data:`MODELS` or :data:`FILTERS` with fresh weights.

    Parameters
    ----------
    name : str
        Name of the model.
    bins : int
        Velocity bins of a map.
    parts : int
        Number of maps in the input; filters take one.
    more : int
        Numbers of kinematics per frame after the one map.
    **given
        Options in place of those of :func:`options`.

    Raises
    ------
    Sd2Error
        When there is no such model or option, or an option is not of its kind, or for more bins
        than a map has.
    """
    if not 1 <= bins <= _MAX_BINS:
        raise Sd2Error(f"A model of maps of {bins} bins", f"from 1 to {_MAX_BINS:,} bins")
    known = options(name)
    for option, value in given.items():
        check_option(f"model {name}", option, value, known)
    from sd2core.denoise.model import Denoiser

    if name in _ENTRIES:
        return _built(name, _ENTRIES[name], bins, parts, more, given)
    return _plug_in(name).use(lambda entry: _built(name, entry, bins, parts, more, given), Denoiser)


def _built(
    name: str, entry: Architecture, bins: int, parts: int, more: int, given: Mapping[str, Any]
) -> Denoiser:
    from sd2core.denoise.model import Corrected, TwoNetworks

    make = entry.made
    several = {} if name in FILTERS else {"parts": 0 if more else parts, "more": more}
    chosen = {**entry.options, **given}
    corrects, also_live = chosen.pop("skip", False), chosen.pop("live", False)

    def made(**other: Any) -> Denoiser:
        network: Denoiser = make(bins, **several, **entry.fixed, **{**chosen, **other})
        return Corrected(network, parts) if corrects else network

    whole = made()
    if whole.causal or not also_live:
        return whole
    return TwoNetworks(whole, made(bidirectional=False))


def options_of_version_1(name: str, stored: Mapping[str, Any]) -> dict[str, Any]:
    """Options in a model file of version 1, which knew nothing of some of today's."""
    known = _ENTRIES[name].options if name in _ENTRIES else {}
    return {**{option: False for option in ("skip", "live") if option in known}, **stored}


def fit_filter(
    name: str,
    inputs: Sequence[NDArray[np.float32]],
    targets: Sequence[NDArray[np.float32]],
    null_bins: Sequence[int] = (),
) -> tuple[Denoiser, dict[str, Any]]:
    """Fit one of :data:`FILTERS`; returns it and its options.

    Parameters
    ----------
    name : {"none", "median", "wiener", "ridge"}
        Sd2Error for another name.
    inputs, targets : sequence of float32 ndarray, (frames, bins)
        Compressed maps, one of each per take.
    null_bins : sequence of int
        Bins that do not count.
    """
    from sd2core.denoise import filters

    if name == "none":
        return filters.NoDenoiser(inputs[0].shape[1]), {}
    if name not in FILTERS:
        raise Sd2Error(f"{name} is not a filter", f"one of {', '.join(FILTERS)}")
    fits = {
        "median": filters.fit_median, "wiener": filters.fit_wiener, "ridge": filters.fit_ridge
    }  # fmt: skip
    fitted = fits[name](inputs, targets, null_bins)
    return fitted, {option: getattr(fitted, option) for option in options(name)}


def is_network(name: str) -> bool:
    """True for networks that are trained, those of plug-ins too."""
    return name in MODELS or DENOISERS.find(name) is not None


def network_names() -> tuple[str, ...]:
    """Names of all networks that are trained."""
    return (*MODELS, *DENOISERS.names())


def _entry(name: str) -> Architecture:
    return _ENTRIES[name] if name in _ENTRIES else _plug_in(name).load()


def _plug_in(name: str) -> PlugIn[Architecture]:
    plug_in = DENOISERS.find(name)
    if plug_in is None:
        known = ", ".join([*_ENTRIES, *DENOISERS.names()])
        raise Sd2Error(f"There is no model {name!r}", f"one of {known}")
    return plug_in


def check_option(what: str, option: str, value: Any, known: Mapping[str, Any]) -> None:
    """Raise Sd2Error for an option of a network that is unknown or not of its default's kind.

    Parameters
    ----------
    what : str
        Names the network in messages.
    option : str
        Name of the option.
    value : object
        Value that was given for it.
    known : mapping
        Defaults of all options. Steps (``dt_min``, ``dt_max``) are 1e-6 to 10, other numbers that
        are not whole shares from 0 to below 1.
    """
    if option not in known:
        raise Sd2Error(
            f"The {what} has no option {option!r}",
            f"one of {', '.join(known)}" if known else "no options",
        )
    message = f"{what}: {option} is {value!r}"
    if isinstance(known[option], bool):
        if not isinstance(value, bool):
            raise Sd2Error(message, "true or false")
    elif isinstance(known[option], int):
        if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= _LARGEST:
            raise Sd2Error(message, f"a whole number, 1 to {_LARGEST}")
    elif isinstance(value, bool) or not isinstance(value, int | float):
        raise Sd2Error(message, "a number")
    elif option in ("dt_min", "dt_max"):
        if not 1e-6 <= value <= 10:
            raise Sd2Error(message, "a step from 1e-6 to 10")
    elif not 0 <= value < 1:
        raise Sd2Error(message, "a share from 0 to below 1")
