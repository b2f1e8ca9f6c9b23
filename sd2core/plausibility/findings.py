"""What is found unlikely."""

from __future__ import annotations

from dataclasses import dataclass

from sd2core.errors import Cure, Sd2Error


@dataclass(frozen=True)
class Finding:
    """Something unlikely about content that was read.

    Parameters
    ----------
    found : str
        What is unlikely, with the number.
    expected : str
        What is usual instead.
    remedy : str
        The probable cause, and the option that puts it right.
    cure : Cure, optional
        That option, for a button.

    Examples
    --------
    >>> print(Finding("The body measures 1,700 m", "a body below 10 m", "Pass --scale 0.001"))
    The body measures 1,700 m. Expected: a body below 10 m. Pass --scale 0.001.
    """

    found: str
    expected: str = ""
    remedy: str = ""
    cure: Cure | None = None

    def __str__(self) -> str:
        return str(self.error())

    def error(self) -> Sd2Error:
        """The same as an error, where nothing can be done with such content."""
        error = Sd2Error(self.found, self.expected, self.remedy)
        error.cure = self.cure
        return error
