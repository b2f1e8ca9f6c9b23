"""Check of the place before one records: whether radar and camera see the same person move."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sd2core.body.camera import DEFAULT_FIELD_OF_VIEW_DEG
from sd2core.fmcw.chain import Chain, ProcessingOptions
from sd2core.io.radar.capture import RadarCapture
from sd2core.placements.placements import Place
from sd2core.radar_config import CLUTTER, RadarConfig

PICTURE_WIDTH_PX = 160
"""Pictures are compared at this width: a person fills many pixels, and noise averages out."""

_CHANCE = 0.01
"""Share of the frames without motion in which noise alone looks like some."""
_MOVING_SHARE = 0.25
"""Of the frames, in which a person who walks to and fro is seen at the least."""
_GREATEST_DB = 120.0
_NOTCH = 5
"""Bins of the padded spectrum from 0 m/s on, within which the clutter filter takes noise, too."""
_NOISE_SIGMAS, _MIN_STEP = 5.0, 2.0
"""Change of a pixel that is none of the camera's noise: five standard deviations, two grey levels
where it has none. Of 14,400 pixels chance gives 0.01."""
_MIN_PIXELS = 10
_EDGE = 0.03
_SMOOTHED_S, _STEP_S = 0.5, 0.02
_LAG_S = 0.5
"""Searched to either side; beyond, a sway of one second would fit with the opposite sign."""
_LIKENESS = 0.5
"""Correlation from which two series are alike. Ten seconds of movements slower than 1 Hz are
twenty independent values, whose correlation exceeds it by chance once in forty."""
_CLOCK_S = 0.2
_LEAST_WALK_M = 0.5
"""Change of distance from which somebody walked. Of one who stands and swings the arms, what moves
in the picture grows and shrinks for other reasons than its distance."""


class Seen(NamedTuple):
    """Movement in a frame of the radar."""

    time_s: float
    level_db: float  # strongest cell of range and velocity above the mean noise
    distance_m: float = np.nan  # of what is above chance; NaN where nothing is, or no range is told
    velocity_mps: float = 0.0  # the same, positive when approaching


class Moved(NamedTuple):
    """Movement between two pictures."""

    time_s: float
    pixels: int
    left: float = np.nan  # share of the picture's width, 90 % of the moving pixels lie between
    right: float = np.nan
    growth_hz: float = 0.0  # of what moves, relative to its size: velocity by distance


@dataclass(frozen=True)
class Answer:
    """Answer to one question, as a sentence with its numbers."""

    name: str
    passed: bool
    sentence: str
    numbers: dict[str, float] = field(default_factory=dict)


def chance_db(config: RadarConfig) -> float:
    """Level that the strongest cell of noise alone exceeds in one frame of a hundred.

    Noise power is distributed exponentially, its mean over channels as a gamma variable; the cells
    are all bins of the padded spectrum times all samples, so that the level is rather too high
    (M. A. Richards, *Fundamentals of Radar Signal Processing*, section 6.3).
    """
    from scipy.special import gammainccinv

    cells = 4 * config.chirps_per_frame * config.samples_per_chirp
    factor = gammainccinv(config.channels, _CHANCE / cells) / config.channels
    return 10.0 * float(np.log10(factor))


def seen_in(frame: RadarCapture, time_s: float) -> Seen:
    """Movement in a capture of one frame, at a time of this computer's clock."""
    from scipy.special import gammaincinv

    config = frame.config
    chain = Chain(frame, ProcessingOptions(CLUTTER))
    power = chain.cell_power(0).astype(np.float64)  # (doppler, gates)
    strongest = float(power.max())
    if not strongest > 0.0:
        return Seen(time_s, -_GREATEST_DB)
    # Most cells hold noise; a median does not mind those that do not.
    typical = gammaincinv(config.channels, 0.5) / config.channels
    notch = min(_NOTCH, len(power) // 2)
    noise = float(np.median(power[notch : 1 - notch])) / typical
    noise = max(noise, strongest * 10.0 ** (-0.1 * _GREATEST_DB))
    moving = np.where(power > noise * 10.0 ** (0.1 * chance_db(config)), power, 0.0)
    level_db = 10.0 * float(np.log10(strongest / noise))
    total = float(moving.sum())
    if not total:
        return Seen(time_s, level_db)
    velocity_mps = -np.fft.fftfreq(len(power)) * 2.0 * config.v_max_mps
    distance_m = np.nan
    if not config.is_continuous:
        distance_m = float(moving.sum(axis=0) @ chain.range_m) / total
    return Seen(time_s, level_db, distance_m, float(velocity_mps @ moving.sum(axis=1)) / total)


def moved_between(
    before: NDArray[np.uint8], after: NDArray[np.uint8], time_s: float, passed_s: float
) -> Moved:
    """Movement between two grey pictures (height, width).

    Parameters
    ----------
    before, after : uint8 array, shape (height, width)
    time_s : float
        Middle between both.
    passed_s : float
        Time between both.
    """
    import cv2

    change = after.astype(np.float32) - before
    change -= np.median(change)  # a lamp, or the camera's exposure
    size = np.abs(change)
    moving = size > max(_NOISE_SIGMAS * 1.4826 * float(np.median(size)), _MIN_STEP)
    pixels = int(moving.sum())
    if pixels < _MIN_PIXELS:
        return Moved(time_s, pixels)
    flow = cv2.calcOpticalFlowFarneback(before, after, None, 0.5, 3, 15, 3, 5, 1.1, 0)
    rows, columns = np.nonzero(moving)
    place = np.stack([columns, rows], axis=1).astype(np.float64)  # (pixels, 2)
    left, right = np.quantile(place[:, 0], (0.05, 0.95)) / (before.shape[1] - 1)
    away = place - place.mean(axis=0)
    shift = flow[moving] - flow[moving].mean(axis=0)
    spread = float((away**2).sum())
    growth = float((away * shift).sum()) / spread if spread else 0.0
    return Moved(time_s, pixels, float(left), float(right), growth / passed_s)


def check_place(config: RadarConfig, seen: Sequence[Seen], moved: Sequence[Moved]) -> list[Answer]:
    """Four findings: motion, range, view, agreement.

    Parameters
    ----------
    config : RadarConfig
    seen : sequence of Seen
        By the radar, in order of time, on the clock of the pictures.
    moved : sequence of Moved
        In the pictures, in order of time.
    """
    return [_motion(config, seen), _range(config, seen), _view(moved), _agreement(seen, moved)]


def found_place(findings: Sequence[Answer]) -> Place | None:
    """Place of a radar beside the camera, found by what moves; None if it is not certain.

    The distance is the radar's, the direction that of the camera: 10° to the right in the picture
    is what a camera, and a radar, sees that is 10° to its left.
    """
    of = {one.name: one for one in findings if one.passed}
    if "median_m" not in getattr(of.get("range"), "numbers", {}) or "view" not in of:
        return None
    azimuth_deg = -of["view"].numbers["azimuth_deg"]
    return Place(round(of["range"].numbers["median_m"], 2), round(azimuth_deg, 1) + 0.0)


def _motion(config: RadarConfig, seen: Sequence[Seen]) -> Answer:
    if not seen:
        return Answer("motion", False, "No frame of the radar came.")
    level_db = float(np.quantile([one.level_db for one in seen], 1.0 - _MOVING_SHARE))
    least_db = chance_db(config)
    numbers = {"level_db": level_db, "chance_db": least_db}
    passed = level_db > least_db
    sees = f"{level_db:.0f} dB above its noise in a quarter of the frames"
    chance = f"noise alone gives up to {least_db:.0f} dB"
    words = (
        f"The radar sees motion, {sees}; {chance}."
        if passed
        else f"The radar sees no motion: {sees}, and {chance}. Move in front of it; does it point"
        " at you?"
    )
    return Answer("motion", passed, words, numbers)


def _range(config: RadarConfig, seen: Sequence[Seen]) -> Answer:
    if config.is_continuous:
        return Answer("range", True, "The radar is a continuous wave, which tells no distances.")
    far = np.array([one.distance_m for one in seen])
    far = far[np.isfinite(far)]
    most_m = config.range_max_m
    if not len(far):
        return Answer("range", False, "The radar sees nothing whose distance could be told.")
    near_m, median_m, far_m = (float(one) for one in np.quantile(far, (0.1, 0.5, 0.9)))
    passed = far_m + config.range_resolution_m <= most_m
    words = f"What moves is {near_m:.1f} to {far_m:.1f} m from the radar, mostly {median_m:.1f} m;"
    reach = f"it reaches {most_m:.1f} m"
    words += f" {reach}." if passed else f" {reach}, and tells what is beyond as near. Step closer."
    numbers = {"near_m": near_m, "median_m": median_m, "far_m": far_m, "range_max_m": most_m}
    return Answer("range", passed, words, numbers)


def _view(moved: Sequence[Moved]) -> Answer:
    shown = [one for one in moved if one.pixels >= _MIN_PIXELS]
    numbers = {"moving_share": len(shown) / max(len(moved), 1)}
    if not moved:
        return Answer("view", False, "No two pictures of the camera came.", numbers)
    if numbers["moving_share"] < _MOVING_SHARE:
        words = f"Nothing moves in {100 * (1 - numbers['moving_share']):.0f} % of the pictures."
        return Answer("view", False, words + " Move in front of the camera.", numbers)
    left = float(np.quantile([one.left for one in shown], 0.1))
    right = float(np.quantile([one.right for one in shown], 0.9))
    half = np.tan(np.radians(0.5 * DEFAULT_FIELD_OF_VIEW_DEG))
    aside_deg = float(np.degrees(np.arctan(half * (left + right - 1.0))))
    numbers |= {"left": left, "right": right, "azimuth_deg": aside_deg}
    words = (
        f"What moves is between {100 * left:.0f} % and {100 * right:.0f} % of the picture's width"
    )
    if left < _EDGE or right > 1.0 - _EDGE:
        words += ", up to its edge. Step back, or turn the camera."
        return Answer("view", False, words, numbers)
    if abs(aside_deg) < 0.5:
        return Answer("view", True, f"{words}, straight ahead: point the radar there.", numbers)
    side = "right" if aside_deg > 0 else "left"
    words += (
        f", {abs(aside_deg):.0f}° to the {side} if the camera sees"
        f" {DEFAULT_FIELD_OF_VIEW_DEG:.0f}° across: point the radar there."
    )
    return Answer("view", True, words, numbers)


def _agreement(seen: Sequence[Seen], moved: Sequence[Moved]) -> Answer:
    likeness, lag_s = _likeness(
        _series([(one.time_s, one.velocity_mps) for one in seen]),
        _series([(one.time_s, one.growth_hz) for one in moved]),
    )
    numbers = {"correlation": likeness, "video_late_s": lag_s}
    value = f"correlation {likeness:.2f}".replace("-", "−")
    far_m = np.array([one.distance_m for one in seen])
    far_m = far_m[np.isfinite(far_m)]
    walked = not far_m.size or np.ptp(np.quantile(far_m, [0.05, 0.95])) >= _LEAST_WALK_M
    if abs(likeness) < _LIKENESS or (likeness < 0 and not walked):
        needed = f"{_LIKENESS:g} is needed" if walked else "nobody comes nearer or goes away"
        words = (
            f"Radar and video cannot be compared ({value}; {needed}): walk towards both, and away"
            " again, a few times."
        )
    elif likeness < 0:
        words = (
            f"The radar's sign is wrong: what it sees come nearer shrinks in the video ({value})."
            " If both saw the same walk, set the sign of the radar, or swap I and Q."
        )
    else:
        order = "after" if lag_s > 0 else "before"
        words = f"What comes nearer by the radar grows in the video ({value}), which is"
        words += f" {abs(lag_s):.2f} s {order} the radar."
        if abs(lag_s) > _CLOCK_S:
            delay = "camera" if lag_s > 0 else "radar"
            words += f" The {delay}'s delay is probably larger: give it as --{delay}-delay-ms."
    return Answer("agreement", likeness >= _LIKENESS and abs(lag_s) <= _CLOCK_S, words, numbers)


def _series(values: list[tuple[float, float]]) -> NDArray[Any]:
    """Times and values without what is shorter than a quarter of a second, (2, n)."""
    from scipy.ndimage import median_filter

    series = np.array(values, dtype=np.float64).reshape(-1, 2).T
    if series.shape[1] < 2:
        return series
    step_s = float(np.median(np.diff(series[0])))
    series[1] = median_filter(series[1], size=2 * round(0.5 * _SMOOTHED_S / step_s) + 1)
    return series


def _likeness(radar: NDArray[Any], video: NDArray[Any]) -> tuple[float, float]:
    """Correlation of two series where it is strongest, and how much later the second one is."""
    if min(radar.shape[1], video.shape[1]) < 2:
        return 0.0, 0.0
    start_s = max(radar[0, 0], video[0, 0]) + _LAG_S
    times_s = np.arange(start_s, min(radar[0, -1], video[0, -1]) - _LAG_S, _STEP_S)
    ours = np.interp(times_s, *radar)
    if len(ours) < 2 or not ours.std():
        return 0.0, 0.0
    by_lag = [(0.0, 0.0)]
    for lag_s in np.arange(-_LAG_S, _LAG_S + 0.5 * _STEP_S, _STEP_S):
        theirs = np.interp(times_s + lag_s, *video)
        if theirs.std():
            by_lag.append((float(np.corrcoef(ours, theirs)[0, 1]), float(lag_s)))
    return max(by_lag, key=lambda one: abs(one[0]))
