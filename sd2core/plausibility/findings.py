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
        The probable cause.
    cure : Cure, optional
        What puts it right: an option of a command line, or a button.

    Examples
    --------
    >>> print(Finding("The body measures 1,700 m", "a body below 10 m", "These are mm"))
    The body measures 1,700 m. Expected: a body below 10 m. These are mm.
    """

    found: str
    expected: str = ""
    remedy: str = ""
    cure: Cure | None = None

    def __str__(self) -> str:
        return str(self.error())

    @property
    def words(self) -> str:
        """The finding without the option of a command line."""
        return self.error().words

    def error(self) -> Sd2Error:
        """The same as an error, where nothing can be done with such content."""
        error = Sd2Error(self.found, self.expected, self.remedy)
        error.cure = self.cure
        return error
