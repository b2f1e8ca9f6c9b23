"""Frames and persons by the numbers in the names of files: ``000012_0.obj``."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error

Person = TypeVar("Person", int, str, int | str)

_TEMPLATES = re.compile(
    "(?<![a-z])(template|mean|average|rest|t[ _-]?pose|canonical|neutral)(?![a-z])"
)
"""Words in the names of meshes that are no frame: the body that all others are made from."""
_PERSON_WORDS = {"p", "person", "pid", "id", "tid", "track", "subject", "body", "human"}
_FRAME_WORDS = {"f", "frame", "frm", "img", "image", "t"}
_SHOWN = 3


class FrameFiles(NamedTuple):
    """Files of one person, one per frame, in order."""

    files: list[Path]
    numbers: NDArray[np.int64] | None  # of the frames, where the names count them
    notes: list[str]


def natural_key(name: str) -> tuple[object, ...]:
    """Sort key by which ``frame9`` comes before ``frame10``."""
    parts = re.findall(r"[0-9]+|[^0-9]+", name)
    return (*((0, int(p)) if p[0] in "0123456789" else (1, p) for p in parts), (2, name))


def frames_among(files: Sequence[Path], notes: list[str]) -> list[Path]:
    """Files that are frames, in natural order; hidden ones and templates are left out with a note.

    A template has a word for it in its name, or no number where others have one.
    """
    hidden = [file for file in files if file.name.startswith(".")]
    shown = sorted(
        (file for file in files if file not in hidden), key=lambda f: natural_key(f.name)
    )
    if hidden:
        notes.append(f"Hidden files are left out: {_named(hidden)}.")
    numbered = [file for file in shown if re.search("[0-9]", file.stem)]
    templates = [file for file in shown if _TEMPLATES.search(file.stem.lower())]
    if len(numbered) > 1:
        templates += [file for file in shown if file not in numbered and file not in templates]
    if 0 < len(templates) < len(shown):
        notes.append(f"Left out, as they are no frames: {_named(templates)}.")
        shown = [file for file in shown if file not in templates]
    return shown


def numbered_frames(files: Sequence[Path], person: int | str | None, source: str) -> FrameFiles:
    """Files of one person with the numbers of their frames, by what changes in their names.

    Parameters
    ----------
    files : sequence of Path
        In natural order.
    person : optional
        Number in the names; None: the one in most frames.
    source : str
        Folder or pattern, for messages.

    Raises
    ------
    Sd2Error
        If there is no such person, or the names are of two kinds.
    """
    numbers, notes = _numbers_in(files, source), list[str]()
    if numbers is None:
        notes.append(
            "The names do not tell frame and person: the files are taken as consecutive frames of"
            " one person."
        )
    if numbers and len(numbers) == 2:
        frames, persons = numbers
        chosen = chosen_person(_counted(persons), person, source, notes)
        own = np.flatnonzero(persons == chosen)
        order = own[np.argsort(frames[own], kind="stable")]
        counted = _frame_numbers(frames[order], frames, notes)
        return FrameFiles([files[place] for place in order], counted, notes)
    if person is not None:
        raise Sd2Error(
            f"Person {person} is asked for, and the names in {source} tell no persons",
            "names such as 000012_0.obj, of frame 12 and person 0",
        )
    counted = _frame_numbers(numbers[0], numbers[0], notes) if numbers else None
    return FrameFiles(list(files), counted, notes)


def persons_among(files: Sequence[Path], source: str) -> dict[int, int]:
    """Number of files of each person, by the names as :func:`numbered_frames` reads them."""
    numbers = _numbers_in(files, source)
    return _counted(numbers[1]) if numbers is not None and len(numbers) == 2 else {}


def _counted(persons: NDArray[np.int64]) -> dict[int, int]:
    return {number: int((persons == number).sum()) for number in np.unique(persons).tolist()}


def _numbers_in(files: Sequence[Path], source: str) -> tuple[NDArray[np.int64], ...] | None:
    """Numbers (files,) of frames, and of persons, as far as the names tell; None: they are unclear.

    Raises Sd2Error where the names are of two kinds.
    """
    names = [re.split("([0-9]+)", file.name.lower()) for file in files]
    kinds = {tuple(name[::2]): [] for name in names}  # type: dict[tuple[str, ...], list[int]]
    for place, name in enumerate(names):
        kinds[tuple(name[::2])].append(place)
    if len(kinds) > 1:
        _refuse_two_kinds(files, list(kinds.values()), source)
    if len(kinds) != 1 or len(files) < 2:
        return ()
    (words,) = kinds
    values = np.array([[int(part) for part in name[1::2]] for name in names])  # (files, columns)
    changing = np.flatnonzero((values != values[0]).any(axis=0)).tolist()
    if len(changing) > 2 or (len(changing) == 2 and words[changing[1]] == "."):
        return None
    if len(changing) == 2 and _person_is_first(words, names, changing, values):
        changing.reverse()
    return tuple(values[:, column] for column in changing)


def chosen_person(
    frames: Mapping[Person, int], person: int | str | None, source: str, notes: list[str]
) -> Person:
    """The person asked for, or else the one in most frames; of several, a note says which.

    Parameters
    ----------
    frames : mapping
        Number of frames of each person.
    person : int, str or None
    source : str
        For the error if there is no such person.
    notes : list of str
        Gets the note.
    """
    listed = ", ".join(f"{key} ({count:,} frames)" for key, count in frames.items())
    if person is None:
        key, why = max(frames, key=lambda one: frames[one]), "seen longest of"
    else:
        matching = [one for one in frames if str(one) == str(person)]
        if not matching:
            raise Sd2Error(f"{source} holds no person {person}", f"one of: {listed}")
        key, why = matching[0], "as asked, of"
    if len(frames) > 1:
        notes.append(f"Person {key} is read, {why}: {listed}.")
    return key


def _frame_numbers(
    frames: NDArray[np.int64], all_frames: NDArray[np.int64], notes: list[str]
) -> NDArray[np.int64] | None:
    """Numbers of a person's frames, where those of all count frames; None where they do not."""
    every = np.unique(all_frames)
    steps = np.diff(every)
    if len(np.unique(frames)) < len(frames) or not steps.size:
        return None
    step = int(np.gcd.reduce(steps))
    if int(np.median(steps)) != step:
        notes.append(
            f"The numbers in the names go up by {np.median(steps):g} typically and do not count"
            " frames: the files are taken as consecutive ones."
        )
        return None
    # Counted from 0 or from 1, the first picture is where the video begins.
    first = int(every[0])
    start = first // step if first > 1 else 0
    if step > 1:
        notes.append(
            f"The names count in steps of {step}: the files are taken as consecutive frames, whose"
            " rate is to be given (--fps)."
        )
    if start:
        notes.append(f"The first frame is number {first:,}: time before it is empty.")
    return (frames - first) // step + start


def _person_is_first(
    words: tuple[str, ...],
    names: Sequence[Sequence[str]],
    changing: Sequence[int],
    values: NDArray[np.int64],
) -> bool:
    """True where the first of two changing numbers is the person, by the words before them."""
    before = [re.sub("[^a-z]+", " ", words[column]).split()[-1:] for column in changing]
    persons = [bool(_PERSON_WORDS & set(word)) for word in before]
    frames = [bool(_FRAME_WORDS & set(word)) for word in before]
    if persons[0] != persons[1]:
        return persons[0]
    if frames[0] != frames[1]:
        return frames[1]
    digits = [max(len(name[1 + 2 * column]) for name in names) for column in changing]
    distinct = [len(np.unique(values[:, column])) for column in changing]
    return digits[0] < digits[1] and distinct[0] < distinct[1]


def _refuse_two_kinds(files: Sequence[Path], kinds: list[list[int]], source: str) -> None:
    first, second = sorted(kinds, key=len, reverse=True)[:2]
    if len(second) > 1:
        one, other = (files[kind[0]].name for kind in (first, second))
        raise Sd2Error(
            f"{source} holds {len(first):,} files like {one} and {len(second):,} like {other}",
            "the frames of one body, named alike",
            "Name those that are meant by a pattern such as 'body_*.obj'",
        )


def _named(files: Sequence[Path]) -> str:
    shown = ", ".join(file.name for file in files[:_SHOWN])
    more = len(files) - _SHOWN
    return shown + (f" and {more:,} more" if more > 0 else "")
