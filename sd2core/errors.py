"""Error shown to users: a sentence, never a traceback."""

from __future__ import annotations

from typing import Any, NamedTuple, TypeVar

Value = TypeVar("Value")
_LONGEST = 60


class Cure(NamedTuple):
    """Setting that puts right how a mesh is read, and the words for its button."""

    setting: str  # field of sd2core.files.recording_json.MeshReading
    value: float | str
    words: str
    option: str = ""  # the same on a command line


class Sd2Error(Exception):
    """Something the user can act on.

    Parameters
    ----------
    found : str
        What was found, with the value and, where a file is at fault, its path.
    expected : str
        What was expected instead.
    remedy : str
        What to do about it.
    cure : Cure, optional
        What puts it right: an option of a command line, or a button.

    Examples
    --------
    >>> import sd2core as sd2
    >>> try:
    ...     sd2.Timebase([0.0, 0.5, 0.4])
    ... except sd2.Sd2Error as error:
    ...     print(error.expected)
    times that increase from frame to frame
    """

    def __init__(
        self, found: str, expected: str = "", remedy: str = "", cure: Cure | None = None
    ) -> None:
        self.found = found
        self.expected = expected
        self.remedy = remedy
        self.cure = cure
        super().__init__(found, expected, remedy)

    def within(self, place: object) -> Sd2Error:
        """Return the same error, said of a file; itself if it names that already."""
        if str(place) in self.found:
            return self
        return Sd2Error(f"{place}: {self.found}", self.expected, self.remedy, self.cure)

    @property
    def arguments(self) -> dict[str, Any]:
        """Arguments to make it anew in another process."""
        return {"found": self.found, "expected": self.expected, "remedy": self.remedy}

    @property
    def words(self) -> str:
        """The error without the option of a command line, for who has a button in its place."""
        return self._with(self.remedy)

    def __str__(self) -> str:
        option = "" if self.cure is None else self.cure.option
        return self._with(f"{self.remedy}: pass {option}" if option else self.remedy)

    def _with(self, remedy: str) -> str:
        parts = [self.found, f"Expected: {self.expected}" if self.expected else "", remedy]
        return " ".join(part.rstrip(".") + "." for part in parts if part)


def wanted(value: object, kind: type[Value], example: str) -> Value:
    """Return a value that is of a type; otherwise raise Sd2Error with an example of one."""
    if isinstance(value, kind):
        return value
    shown = " ".join(repr(value).split())
    shown = shown if len(shown) <= _LONGEST else f"{shown[:_LONGEST]}…"
    raise Sd2Error(f"{shown} is given, a {type(value).__name__}", f"a {kind.__name__}", example)


def of_the_system(error: OSError) -> Sd2Error:
    """Error of the operating system in words, with its file."""
    if not error.strerror:
        return Sd2Error(str(error) or type(error).__name__)
    return Sd2Error(f"{error.filename}: {error.strerror}" if error.filename else error.strerror)
