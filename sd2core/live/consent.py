"""Who has agreed to be recorded: kept in the folder of a session, with the text and the time."""

from __future__ import annotations

import hashlib
from datetime import UTC, datetime
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict

from sd2core.files.atomic import atomic_write_json
from sd2core.files.texts import faults_in, read_json

FILE_NAME = "consent.json"
_EXPECTED = "agreements of people who were recorded, as a session writes them"


class Agreement(BaseModel):
    """One person's agreement to one text."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    person: str
    """Pseudonym."""
    agreed_at: datetime
    text_sha256: str


class _Document(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)

    format: Literal["sd2-consent"] = "sd2-consent"
    version: Literal[1] = 1
    texts: dict[str, str] = {}
    """By their SHA-256."""
    agreements: tuple[Agreement, ...] = ()


class Consent:
    """Agreements to the text of a protocol, of a session that begins or goes on.

    Parameters
    ----------
    folder : Path
        Of the session.
    text : str
        What people are asked to agree to. Who agreed to another text is asked again.

    Raises
    ------
    Sd2Error
        If there are agreements that cannot be read.
    """

    def __init__(self, folder: Path, text: str) -> None:
        self._path, self._text = folder / FILE_NAME, text
        self._sha256 = hashlib.sha256(text.encode()).hexdigest()
        self._kept = _Document()
        if self._path.exists():
            with faults_in(self._path, _EXPECTED):
                self._kept = _Document.model_validate(read_json(self._path, _EXPECTED))

    @property
    def agreements(self) -> dict[str, Agreement]:
        """Agreements to this text, by the person."""
        kept = self._kept.agreements
        return {one.person: one for one in kept if one.text_sha256 == self._sha256}

    def agree(self, person: str) -> None:
        """Keep that a person agrees now; it is on disk when this returns."""
        now = datetime.now(UTC).replace(microsecond=0)
        made = Agreement(person=person, agreed_at=now, text_sha256=self._sha256)
        self._kept = _Document(
            texts=self._kept.texts | {self._sha256: self._text},
            agreements=(*self._kept.agreements, made),
        )
        atomic_write_json(self._path, self._kept.model_dump(mode="json"))
