"""How well people who meet are told apart, and how good their fits are beside those of one alone.

Simulated people of known places pass, cross, stand before and sit beside one another, in like and
in unlike clothes. Nothing of the program was tuned on these people and places.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from sd2core.body.fit_people import fit_people
from sd2core.body.fit_video import FitChoices, FitReport, fit_video
from sd2core.body.landmark_models import landmark_models
from sd2core.body.model import Body, Skeleton
from sd2core.body.people import SeenPerson, find_people
from sd2core.body.rig import KeypointSpace
from sd2core.body.shape import ShapeSpace
from sd2core.body.skinning import pose_vertices
from sd2core.files.tables import markdown_table
from sd2core.io.mesh import load_mesh
from sd2core.io.video import open_video
from sd2core.io.video_writing import write_video
from sd2core.progress import Progress, silent
from sd2core.simulate.gait import Path as GaitPath
from sd2core.simulate.gait import gait
from sd2core.simulate.limbs import arm_length_m
from sd2core.simulate.people.arms import STYLES
from sd2core.simulate.people.motion import Deed, random_motion
from tools.build_sample.clothing import Clothes, srgb
from tools.build_sample.render import Camera, Renderer, _tone
from tools.fitting.cast import PEOPLE, ROOMS, Person

FRAMES_PER_S = 10
CAMERA = Camera(320, 240, 260.0, above_floor_m=1.1)
Floats = NDArray[np.float64]

OUT_M = 2.6
"""Way to the side after which nothing of a person is in the picture."""

OWN = PEOPLE["chen"]
OTHERS = {
    "unlike": PEOPLE["dora"],
    "like": replace(PEOPLE["bo"], outfit=replace(OWN.outfit, hair=(0.09, 0.08, 0.08))),
}
_OFF = 0.1
"""Distance of the hips in squares from where they are, beyond which somebody else is shown."""
_VISIBLE = 1.0 / 3.0
"""Share of a person's pixels from which on they are to be seen; hips are in the picture, too."""
_HIPS = (23, 24)
_NEAR_M = 3.0
_SILENT = FitReport(lambda stage: silent, lambda *_: None, lambda *_: None)


@dataclass(frozen=True)
class Part:
    """Part of a person: across the picture they go along ``x_m``, and turn by ``yaw_deg``."""

    person: Person
    times_s: tuple[float, ...]
    x_m: tuple[float, ...]  # at those times, positive to the right
    away_m: float  # from the camera
    yaw_deg: tuple[float, ...]  # at those times; 0 faces the camera
    sits: bool = False  # facing the camera, moving their arms


@dataclass(frozen=True)
class Actor:
    """A person of a scene, ready to be drawn."""

    drawer: Renderer
    vertices_m: NDArray[np.float32]  # (T, V, 3)
    points_px: Floats  # (T, 33, 2)
    away_m: float


@lru_cache(maxsize=1)
def _space() -> ShapeSpace:
    return ShapeSpace()


def actor(part: Part, frames: int, room: str) -> Actor:
    """A person who walks and turns as their part says."""
    space, shape = _space(), part.person.shape(_space())
    skeleton, body = space.skeleton(shape), space.load("low", shape)
    times = np.arange(frames) / FRAMES_PER_S
    rotations, move = (_sitting if part.sits else _walking)(part, skeleton, times)
    place = np.array([0.0, CAMERA.above_floor_m, part.away_m])
    transforms = skeleton.transforms(rotations, move + place)
    studio = replace(ROOMS[room], wall_m=4.8, shadow_m=6.0, shadow_depth_m=3.0, noise=0.012)
    drawer = Renderer(body, CAMERA, studio, Clothes.of(Body.load("low"), part.person.outfit))
    points = CAMERA.project(KeypointSpace(space).of(shape).positions(transforms))
    return Actor(drawer, pose_vertices(body, transforms), points, part.away_m)


def _sitting(part: Part, skeleton: Skeleton, times_s: Floats) -> tuple[Floats, Floats]:
    """Rotations and places of one who sits and talks with their hands."""
    deed = Deed("sit", (STYLES["talk"], STYLES["wave"]), still=False)
    rng = np.random.default_rng(round(100.0 * part.away_m))
    motion = random_motion(rng, skeleton, part.person.stature_m, times_s, deed)
    return motion.rotations, motion.translation_m + np.array([part.x_m[0], 0.0, 0.0])


def _walking(part: Part, skeleton: Skeleton, times: Floats) -> tuple[Floats, Floats]:
    """Rotations and places of one who walks across the picture."""
    x = np.array(part.x_m)
    along = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(x)))])
    way = GaitPath(
        lambda t: np.interp(t, part.times_s, along),
        lambda t: np.interp(t, part.times_s, part.yaw_deg),
    )
    scale = arm_length_m(skeleton) / arm_length_m(_space().base_skeleton)
    motion = gait(skeleton, times, way, scale)
    # The way of the gait leads to the camera; here it leads across.
    forward = -motion.translation_m[:, 2]
    across = np.interp(times, part.times_s, x) - np.interp(times, part.times_s, along) + forward
    move = np.stack([across, motion.translation_m[:, 1], motion.translation_m[:, 0]], axis=1)
    return motion.rotations, move


def scenes(actors: Sequence[Actor]) -> Iterator[tuple[NDArray[np.uint8], Floats]]:
    """Pictures, and the share of each actor that nobody hides in them, (A,)."""
    far_to_near = sorted(range(len(actors)), key=lambda row: -actors[row].away_m)
    layers = [actors[row] for row in far_to_near]
    for frame in range(len(actors[0].vertices_m)):
        seen = [each.vertices_m[frame] for each in layers]
        shadows = [each.drawer.light_buffer(part) for each, part in zip(layers, seen, strict=True)]
        picture = layers[0].drawer.background(np.maximum.reduce(shadows))
        drawn = []
        for each, part, shadow in zip(layers, seen, shadows, strict=True):
            colours, coverage = each.drawer.person(part, shadow)
            picture = picture * (1.0 - coverage[..., None]) + colours
            drawn.append(coverage)
        shares, free = np.zeros(len(actors)), np.ones(picture.shape[:2])
        for row, coverage in zip(far_to_near[::-1], drawn[::-1], strict=True):
            shares[row] = (free * coverage).sum() / max(float(coverage.sum()), 1.0)
            free *= 1.0 - coverage
        noise = np.random.default_rng(frame).standard_normal(picture.shape, dtype=np.float32)
        bright = np.clip(srgb(_tone(picture)) + 0.012 * noise, 0.0, 1.0)
        yield (bright * 255.0).astype(np.uint8), shares


Way = tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]


@dataclass(frozen=True)
class Meeting:
    """What two people do, how far one is from the other, and for how long."""

    name: str
    apart_m: float
    ways: tuple[Way, ...]
    """Of both: times, places across the picture, and turns."""
    length_s: float
    fitted: bool = False  # the errors of fits are measured, too
    sits: bool = False

    def parts(self, clothes: str) -> list[Part]:
        """Parts of both people, the other one nearer."""
        away = (_NEAR_M if self.sits else _NEAR_M + self.apart_m, _NEAR_M)
        return [
            Part(who, times, x, far, turns, self.sits)
            for who, (times, x, turns), far in zip(
                (OWN, OTHERS[clothes]), self.ways, away, strict=True
            )
        ]


_STANDS: Way = ((0.0, 1.0, 2.0, 5.0), (0.0,) * 4, (0.0, 20.0, -20.0, 0.0))


def _walks(start_m: float, to_m: float) -> Way:
    return (0.0, 4.0), (start_m, to_m), (-90.0 if to_m > start_m else 90.0,) * 2


def meetings() -> Iterator[Meeting]:
    """All of them."""
    for apart_m in (0.5, 1.5, 3.0):
        ways = (_walks(-2.0, 2.0), _walks(2.0, -2.0))
        yield Meeting("pass each other", apart_m, ways, 4.2, fitted=apart_m == 1.5)
    for apart_m in (0.5, 1.5):
        crosses: Way = ((0.1, 4.1), (2.0, -2.0), (90.0, 90.0))
        yield Meeting("crosses in front", apart_m, (_STANDS, crosses), 4.4)
        waits: Way = ((0.1, 2.0, 3.0, 4.9), (-2.0, 0.0, 0.0, 2.0), (-90.0,) * 4)
        yield Meeting("stops in front", apart_m, (_STANDS, waits), 5.2, fitted=apart_m == 1.5)
        turns: Way = ((0.1, 2.0, 2.5, 4.4), (-2.0, 0.0, 0.0, -2.0), (-90.0, -90.0, 90.0, 90.0))
        yield Meeting("turns back in front", apart_m, (_STANDS, turns), 4.8)
    sides: list[Way] = [((0.0,), (x,), (0.0,)) for x in (-0.4, 0.4)]
    yield Meeting("sit side by side", 0.8, tuple(sides), 4.0, fitted=True, sits=True)


@dataclass(frozen=True)
class Outcome:
    """How well two people of one meeting are told apart."""

    meeting: Meeting
    clothes: str
    observed: int  # ten times a second, at one of them in the picture
    visible: int  # of them, in which a third of that one or more is to be seen
    recognised: int  # of those, in which that one was found
    seen: int  # looks in which somebody was found
    wrong: int  # of those, in which it was the other one
    people: int  # who were told apart
    place_m: tuple[float, float] | None = None  # mean error, in company and alone
    velocity_mps: tuple[float, float] | None = None  # RMS along the line of sight, the same

    @property
    def right(self) -> float:
        """Share of the looks with somebody that show the right one."""
        return 1.0 - self.wrong / max(self.seen, 1)


def measure_people(progress: Progress) -> list[Outcome]:
    """Outcomes of all meetings, the other one in either clothes."""
    outcomes = []
    wanted = list(product(meetings(), OTHERS))
    with TemporaryDirectory() as folder:
        for number, (meeting, clothes) in enumerate(wanted):
            progress(number, len(wanted))
            outcomes.append(_measured(meeting, clothes, Path(folder)))
        progress(len(wanted), len(wanted))
    return outcomes


def told_apart(
    meeting: Meeting, clothes: str, path: Path
) -> tuple[list[Actor], list[SeenPerson], Outcome]:
    """Film a meeting, find the people in it, and say how often they are taken for one another."""
    frames = int(FRAMES_PER_S * meeting.length_s)
    actors = [actor(part, frames, "office") for part in meeting.parts(clothes)]
    shares = _film(path, actors)
    with open_video(path) as video:
        people = find_people(video, landmark_models())
    across_px = np.stack([_hips_px(each)[:, 0] for each in actors])
    inside = (across_px > 0) & (across_px < CAMERA.width)
    visible, recognised = inside & (shares >= _VISIBLE), np.zeros(inside.shape, bool)
    seen = wrong = 0
    for person in people:
        off = _off(person, actors)
        mistaken = (off > _OFF) & (off > off[::-1])
        own = int(mistaken.sum(axis=1).argmin())
        seen += off.shape[1]
        wrong += int(mistaken[own].sum())
        recognised[own, person.sightings.frames[person.seen][~mistaken[own]]] = True
    observed, clear, known = (int(each.sum()) for each in (inside, visible, visible & recognised))
    outcome = Outcome(meeting, clothes, observed, clear, known, seen, wrong, len(people))
    return actors, people, outcome


def _hips_px(person: Actor) -> NDArray[np.float64]:
    return np.asarray(person.points_px[:, _HIPS].mean(axis=1))


def _off(person: SeenPerson, actors: Sequence[Actor]) -> NDArray[np.float64]:
    """Distance of where a person was found from each actor, in squares, (2, N)."""
    rois = person.sightings.rois[person.seen]
    frames = person.sightings.frames[person.seen]
    truth = np.stack([_hips_px(each)[frames] for each in actors])
    return np.asarray(np.linalg.norm(rois[:, :2] - truth, axis=2) / rois[:, 2])


def _measured(meeting: Meeting, clothes: str, folder: Path) -> Outcome:
    path = folder / "pair.mp4"
    actors, people, outcome = told_apart(meeting, clothes, path)
    if not meeting.fitted or len(people) != len(actors):
        return outcome
    choices = FitChoices(focal_px=CAMERA.focal_px, resolution="low", landmark_model="full")
    squares: list[list[float]] = [[], []]
    places: list[list[float]] = [[], []]
    for person in people:
        who = int(np.median(_off(person, actors), axis=1).argmin())
        mine = actors[who]
        known = replace(choices, stature_m=(OWN, OTHERS[clothes])[who].stature_m)
        ((_, mesh, _, _),) = fit_people(
            path, folder / "pair.npz", [person], known, lambda number: _SILENT
        )
        alone = folder / "alone.mp4"
        _film(alone, [mine])
        fit_video(alone, folder / "alone.npz", known, _SILENT)
        fits = [load_mesh(each) for each in (mesh, folder / "alone.npz")]
        present = np.logical_and.reduce([fit.presence.present for fit in fits])
        for number, fit in enumerate(fits):
            off_m = np.asarray(fit.read(0, fit.frame_count)) - mine.vertices_m
            places[number].append(float(np.linalg.norm(off_m[present], axis=2).mean()))
            both = present[1:] & present[:-1]
            rate = np.diff(off_m[..., 2], axis=0)[both] * FRAMES_PER_S
            squares[number].append(float(np.square(rate).mean()))
    return replace(
        outcome,
        place_m=(float(np.mean(places[0])), float(np.mean(places[1]))),
        velocity_mps=(float(np.sqrt(np.mean(squares[0]))), float(np.sqrt(np.mean(squares[1])))),
    )


def _film(path: Path, actors: Sequence[Actor]) -> NDArray[np.float64]:
    """Film actors; returns the share of each that is to be seen, (A, T)."""
    path.unlink(missing_ok=True)
    shares = []

    def drawn() -> Iterator[NDArray[np.uint8]]:
        for picture, seen in scenes(actors):
            shares.append(seen)
            yield picture

    write_video(path, drawn(), FRAMES_PER_S, (CAMERA.width, CAMERA.height))
    return np.stack(shares, axis=1)


def as_table(outcomes: Sequence[Outcome]) -> str:
    """Markdown table of outcomes."""
    away = ["place off by, alone", "velocity, alone"]
    rows = [["two people", "apart", "clothes", "right", "found", "looks", "listed", *away]]
    for each in outcomes:
        met = [each.meeting.name, f"{each.meeting.apart_m:g} m", each.clothes]
        fits = [_beside(each.place_m, "m"), _beside(each.velocity_mps, "m/s")]
        rows.append([*met, *_cells([each]), str(each.people), *fits])
    rows.append(["all", "", "", *_cells(outcomes), "", "", ""])
    return "\n".join(markdown_table(rows, len(rows[0])))


def _cells(outcomes: Sequence[Outcome]) -> tuple[str, str, str]:
    observed, visible, recognised, seen, wrong = (
        sum(getattr(each, name) for each in outcomes)
        for name in ("observed", "visible", "recognised", "seen", "wrong")
    )
    right = f"{seen - wrong} of {seen}, {100.0 * (1.0 - wrong / max(seen, 1)):.2f} %"
    return right, f"{recognised} of {visible} to be seen", str(observed)


def _beside(errors: tuple[float, float] | None, unit: str) -> str:
    if errors is None:
        return ""
    company, alone = errors
    return f"{company:.3f}, {alone:.3f} {unit}: {company / alone:.2f} ×"
